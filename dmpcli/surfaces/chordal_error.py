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

# Facets of one arc may differ in width, and surfaces bend more in one direction than across an
# edge: heights up to so many times those across edges are believed.
_UNEVEN = 3.0


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
    worst = heights(V, F, Topology(F, len(V)))
    return ChordalError(float(np.median(worst)), float(worst.max()))


def heights(V: Floats, F: Integers, topology: Topology) -> Floats:
    """Estimate the chordal error of each face, shape (m,), mm; see `chordal_error`."""
    normals = igl.per_corner_normals(V, F, CREASE).reshape(-1, 3, 3)
    worst, total = np.zeros(len(F)), np.zeros(len(F))
    for a, b in ((0, 1), (1, 2), (2, 0)):
        edge, turn = V[F[:, b]] - V[F[:, a]], normals[:, b] - normals[:, a]
        sagitta = np.einsum("fi,fi->f", edge, turn) / 8.0
        worst = np.maximum(worst, np.abs(sagitta))
        total += sagitta
    worst = np.maximum(worst, np.abs(total) * (4.0 / 9.0))
    return np.minimum(worst, _UNEVEN * _across_edges(V[F], topology.neighbours))


def _across_edges(corners: Floats, after: Integers) -> Floats:
    """Largest height w θ/8 of each face and its neighbours (m, 3) across their edges, (m,), mm."""
    edges = np.roll(corners, -1, axis=1) - corners
    twice = cross(edges[:, 0], edges[:, 1])
    area, normal = length(twice)[:, 0], unit(twice)
    cosine = dot(normal[:, None], normal[after])[..., 0]
    angle = np.arccos(np.clip(cosine, -1.0, 1.0))
    smooth = (after >= 0) & (angle < np.radians(CREASE))
    width = np.minimum(area[:, None], area[after]) / length(edges)[..., 0]
    largest: Floats = np.max(np.where(smooth, width * angle / 8.0, 0.0), axis=1)
    return largest
