"""How far a mesh may lie from the smooth surface it was made of, judged by the mesh alone.

Where the surface is the graph of a quadratic form over a triangle, its height over the middle of
an edge is s = e · (n_b - n_a) / 8, with the edge e from a to b and the surface's normals there, and
its height at barycentric coordinates λ is 4 Σ_{i<j} λ_i λ_j s_ij: at most s_ij on an edge, and
4/9 Σ s_ij at the centroid. Normals are those of the mesh's corners, apart across creases.

A chord that is as long as a part, beside a chamfer, stands off nothing: the surface there is flat,
though its corners' normals turn. Facets of width w that meet at an angle θ are chords of an arc of
height w θ/8, so that the narrower of the two bounds both.
"""

from dataclasses import dataclass

import igl
import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.spatial.vectors import cross, dot, length, unit
from dmpcli.surfaces.topology import Topology

CREASE = 30.0
"""Faces that meet at more than this angle, degrees, are meant to: no chord of a smooth surface."""

HALF_CREASE = np.cos(np.radians(0.5 * CREASE))
"""Cosine of half that angle."""

# Facets of one arc may differ in width, and surfaces bend more in one direction than across an
# edge: heights up to so many times those across edges are believed.
UNEVEN = 3.0


@dataclass(frozen=True)
class ChordalError:
    """Estimated distance of a mesh's faces from the surface behind it, mm.

    Attributes
    ----------
    median, largest : float
        Over the faces. Of the noise of a scan they see about a half.
    """

    median: float
    largest: float


def chordal_error(V: Floats, F: Integers) -> ChordalError:
    """Estimate the chordal error of a mesh from the turn of its normals; second order.

    Parameters
    ----------
    V : array, shape (n, 3)
        Vertices, mm.
    F : array, shape (m, 3)
        Faces of consistent winding, all with area.

    Returns
    -------
    ChordalError
    """
    normals = igl.per_corner_normals(V, F, CREASE).reshape(-1, 3, 3)
    after, corners = Topology(F, len(V)).neighbours, V[F]
    flat = unit(cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 1]))
    cosine = dot(flat[:, None], flat[after])[..., 0]
    worst = heights(corners, normals, after, np.arccos(np.clip(cosine, -1.0, 1.0)))
    return ChordalError(float(np.median(worst)), float(worst.max()))


def heights(corners: Floats, normals: Floats, after: Integers, angles: Floats) -> Floats:
    """Estimate the chordal error of each of m faces; see `chordal_error`.

    Parameters
    ----------
    corners : array, shape (m, 3, 3)
        mm.
    normals : array, shape (m, 3, 3)
        Unit vectors at the corners, by the areas about them, apart across creases.
    after : array of int, shape (m, 3)
        See `Topology.neighbours`.
    angles : array, shape (m, 3)
        Between facets across the edges, rad; of no meaning at borders.

    Returns
    -------
    array, shape (m,)
        mm.
    """
    edges = np.roll(corners, -1, axis=1) - corners
    sagitta = dot(edges, np.roll(normals, -1, axis=1) - normals)[..., 0] / 8.0
    worst = np.abs(sagitta).max(axis=1)
    worst = np.maximum(worst, np.abs(sagitta.sum(axis=1)) * (4.0 / 9.0))
    # The largest height w θ/8 across the edges.
    area = length(cross(edges[:, 0], edges[:, 1]))[:, 0]
    smooth = (after >= 0) & (angles < np.radians(CREASE))
    width = np.minimum(area[:, None], area.take(after)) / length(edges)[..., 0]
    largest = np.max(np.where(smooth, width * angles / 8.0, 0.0), axis=1)
    return np.asarray(np.minimum(worst, UNEVEN * largest))


def mean_normals(V: Floats, F: Integers) -> Floats:
    """Unit normals at vertices, shape (n, 3), by the areas of the faces about them."""
    weighting = igl.PER_VERTEX_NORMALS_WEIGHTING_TYPE_AREA
    return np.asarray(igl.per_vertex_normals(V, F, weighting))


def split_normals(V: Floats, F: Integers, face_normals: Floats) -> Floats:
    """Normals at the corners of faces, shape (m, 3, 3), as `heights` wants them.

    Parameters
    ----------
    V : array, shape (n, 3)
        mm.
    F : array of int, shape (m, 3)
    face_normals : array, shape (m, 3)
        Unit vectors.
    """
    normals = mean_normals(V, F).take(F, axis=0)
    # Where no face leans off the mean about a vertex by half a crease, no two meet at one.
    leaning = dot(normals, face_normals[:, None])[..., 0] < HALF_CREASE
    bent = np.zeros(len(V), dtype=bool)
    bent[F[leaning]] = True
    if bent.any():
        apart = igl.per_corner_normals(V, F, CREASE).reshape(-1, 3, 3)
        normals = np.where(bent[F][..., None], apart, normals)
    return normals
