"""Strokes that cross a slit: an edge where sheets touch, and over which no stroke goes."""

import numpy as np

from dmpcli.arrays import Booleans, Floats
from dmpcli.spatial.vectors import length
from dmpcli.surfaces import straightest_geodesics
from dmpcli.surfaces.triangle_mesh import TriangleMesh

# Points this near to such an edge, mm, are on it, on either side: the ways past them are looked at.
_ON = 1e-3


def crossed(mesh: TriangleMesh, foot: Floats) -> Booleans:
    """Tell which points of strokes are parted from the point before by a slit.

    Parameters
    ----------
    mesh : TriangleMesh
    foot : array, shape (R, T, 3)
        Points of the mesh, mm.

    Returns
    -------
    array of bool, shape (R, T)
    """
    slits = mesh.slits
    crossed = np.zeros(foot.shape[:2], dtype=bool)
    if len(slits) == 0 or foot.shape[1] < 2:
        return crossed
    on = (slits.off(foot.reshape(-1, 3)) <= _ON).reshape(crossed.shape)
    # Each way begins at the last point that is surely on one side, and ends at one.
    place = np.arange(foot.shape[1])
    last = np.maximum.accumulate(np.where(on, 0, place), axis=1)[:, :-1]
    before = np.take_along_axis(foot, last[..., None], axis=1)
    sure = ~np.take_along_axis(on, last, axis=1) & ~on[:, 1:]
    p, way = before.reshape(-1, 3), (foot[:, 1:] - before).reshape(-1, 3)
    size = length(way)[:, 0]
    near = slits.near(p + 0.5 * way, 0.5 * size)
    some = np.flatnonzero(sure.reshape(-1) & near & (size > 0.0))
    if len(some) == 0:
        return crossed
    end = straightest_geodesics.walk(mesh, p[some], way[some], size[some])
    stopped = ~end.arrived
    stopped[stopped] = slits.off(end.position[stopped]) <= _ON
    hit = np.zeros(len(p), dtype=bool)
    hit[some] = stopped
    crossed[:, 1:] = hit.reshape(len(foot), -1)
    return crossed
