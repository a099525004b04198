"""Goals that were meant for the other side of a thin wall.

The closest point of a goal that was measured a little off a sheet can be on the sheet's far side.
A line leads there, over the rim, but that is not what was asked for.
"""

from typing import TYPE_CHECKING

import numpy as np

from dmpcli.arrays import Booleans, Floats
from dmpcli.spatial.vectors import dot, length
from dmpcli.surfaces import geodesic_search

if TYPE_CHECKING:
    from dmpcli.surfaces.triangle_mesh import TriangleMesh

# Walls thinner than this, mm, are thin, and those thinner than so many times the distance of the
# goal from them.
_THIN, _TIMES = 1.0, 4.0
# The sides of a wall look away from each other; those of a wedge, at a rim, less so.
_AWAY = -0.9


def mistaken(
    mesh: "TriangleMesh", origin: Floats, goal: Floats, off: Floats, lengths: Floats
) -> Booleans:
    """Tell which goals are behind a thin wall, on whose near side a shorter line arrives.

    Parameters
    ----------
    mesh : TriangleMesh
    origin, goal : array, shape (B, 3)
        On the mesh, mm.
    off : array, shape (B,)
        How far from the mesh the goals were asked, mm.
    lengths : array, shape (B,)
        Of the lines found, mm.

    Returns
    -------
    array of bool, shape (B,)
    """
    _, face = mesh.search(goal)
    normal = mesh.face_normals[face]
    limit = np.maximum(_THIN, _TIMES * off)[:, None]
    behind, other = mesh.search(goal - limit * normal)
    gap = behind - goal
    depth = -dot(gap, normal)
    sideways = length(gap + depth * normal)
    thin = (dot(mesh.face_normals[other], normal) < _AWAY) & (depth > 0.0) & (depth <= limit)
    rows = np.flatnonzero((thin & (sideways <= 0.5 * limit))[:, 0])
    mistaken = np.zeros(len(goal), dtype=bool)
    if len(rows):
        _, near, found = geodesic_search.find(mesh, origin[rows], behind[rows])
        mistaken[rows] = found & (near < lengths[rows])
    return mistaken
