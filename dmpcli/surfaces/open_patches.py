"""Where on a mesh there is room for a stroke: its large smooth patches, and a way across each."""

from dataclasses import dataclass

import igl
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.spatial.vectors import any_tangent, unit
from dmpcli.surfaces.mesh import Mesh

_SMOOTH = np.cos(np.radians(15.0))
"""Cosine of the angle between facets beyond which an edge is the part's and not its mesh's."""

_WAYS = (0.6, 0.45, 0.3, 0.2, 0.12)
"""Lengths that are tried, as shares of a patch's own; none comes near its rim."""

_WIDE = 0.2
"""How far to either side of a way there must be room, as a share of its length."""

_ASLANT = 0.3
"""Sine of the angle to a facet's normal under which points over smooth edges may be seen."""

_POINTS = 25


@dataclass(frozen=True)
class Patch:
    """A smooth patch and two points on it, from one to the other of which it goes on.

    Attributes
    ----------
    area : float
        mm².
    normal : array, shape (3,)
        Its mean, outwards.
    start, goal : array, shape (3,)
        mm.
    """

    area: float
    normal: Floats
    start: Floats
    goal: Floats


def open_patches(V: Floats, F: Integers, most: int = 4) -> list[Patch]:
    """Return the patches that have room for a stroke, those that face +z first, largest first.

    Parameters
    ----------
    V : array, shape (n, 3)
        mm.
    F : array, shape (m, 3)
        Edge manifold, wound so that normals point outwards.
    most : int
    """
    corners = V[F]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    doubled = np.linalg.norm(cross, axis=1)
    normal = cross / np.maximum(doubled, 1e-300)[:, None]
    label = _labels(F, normal)
    area = np.bincount(label, 0.5 * doubled)
    mean = np.stack([np.bincount(label, column) for column in cross.T], axis=1)
    upwards = mean[:, 2] > 0.5 * np.linalg.norm(mean, axis=1)
    order = np.lexsort([-area, ~upwards])
    mesh, found = Mesh(V, F), list[Patch]()
    # A patch with no room on it is passed over; of very many, the small ones are not looked at.
    for number in order[: 4 * most]:
        faces = np.flatnonzero(label == number)
        patch = V[np.unique(F[faces])], corners[faces], doubled[faces]
        way = _way(mesh, normal, label == number, *patch)
        if way is not None:
            towards = unit(mean[number]) if mean[number].any() else np.zeros(3)
            found.append(Patch(float(area[number]), towards, *way))
        if len(found) == most:
            break
    return found


def _labels(F: Integers, normal: Floats) -> Integers:
    """Return the number of the patch of each face."""
    beside = igl.triangle_triangle_adjacency(F)[0]
    face, side = np.nonzero(beside >= 0)
    other = beside[face, side]
    smooth = np.einsum("ij,ij->i", normal[face], normal[other]) > _SMOOTH
    pairs = face[smooth], other[smooth]
    graph = coo_array((np.ones(len(pairs[0])), pairs), shape=(len(F), len(F)))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def _way(
    mesh: Mesh,
    normal: Floats,
    inside: Booleans,
    vertices: Floats,
    corners: Floats,
    weight: Floats,
) -> tuple[Floats, Floats] | None:
    """Return two points between and beside which the patch goes on; None where there is no room."""
    middle = np.average(corners.mean(axis=1), axis=0, weights=weight)
    found = mesh.closest(middle[None])
    if not inside[found.face[0]]:
        # The middle of what is bent or has a hole is beside it: begin on its largest facet.
        found = mesh.closest(corners[np.argmax(weight)].mean(axis=0)[None])
    centre, n = found.position[0], found.normal[0]
    across = vertices - centre
    across = across - np.outer(across @ n, n)
    _, axes = np.linalg.eigh(across.T @ across)
    for axis in (axes[:, 2], axes[:, 1]):
        along = axis - (axis @ n) * n
        along = unit(along) if np.linalg.norm(along) > 1e-6 else any_tangent(n)
        # From left to right as people read: in +x, or in +y.
        along = along * (1.0 if (along[0], along[1]) > (1e-9, 0.0) or along[0] > 0.0 else -1.0)
        long = float(np.ptp(across @ along))
        for share in _WAYS:
            length = share * long
            line = centre + np.outer(np.linspace(-0.5, 0.5, _POINTS) * length, along)
            aside = _WIDE * length * np.cross(n, along)
            points = np.stack([line, line + aside, line - aside])
            seen = mesh.closest(points)
            # What lies beside the patch is nearest to its rim, and seen from there aslant.
            off, facet = points - seen.position, normal[seen.face]
            aslant = np.linalg.norm(off - (off * facet).sum(axis=-1)[..., None] * facet, axis=-1)
            over = aslant <= _ASLANT * seen.distance + 1e-6 * long
            if (inside[seen.face] & over).all():
                return seen.position[0, 0], seen.position[0, -1]
    return None
