"""How a stroke lies on a curved surface: distance, wave height along it, tilt, stretch.

Everything is measured from the stroke's points. The surface comes as callables, so that planes,
cylinders, spheres and meshes are measured alike.
"""

from collections.abc import Callable

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.metrics.wave_height import WaveHeights, wave_heights

Closest = Callable[[Floats], tuple[Floats, Floats]]
"""Points (n, 3), mm, to the closest points of the surface and the unit normals there, (n, 3)."""

PIECES = 100
"""A stroke's stretch is taken over so many pieces of equal length."""


def distance(position: Floats, closest: Closest, off: Floats | float = 0.0) -> Floats:
    """Distance of points to the surface after taking off their intended height w along the normal.

    Parameters
    ----------
    position : array, shape (n, 3)
        mm.
    closest : callable
        Its normals are on the side that w counts from.
    off : array, shape (n,), or float
        w, mm.

    Returns
    -------
    array, shape (n,)
        mm.
    """
    _, normal = closest(position)
    foot = position - np.broadcast_to(off, len(position))[:, None] * normal
    return np.asarray(np.linalg.norm(foot - closest(foot)[0], axis=1))


def height_there(uv: Floats, demonstrated: Floats) -> Floats:
    """Height w of the demonstration where it passes nearest to each place of the chart.

    Parameters
    ----------
    uv : array, shape (n, 2)
        mm.
    demonstrated : array, shape (m, 3)
        u, v, w of the demonstration, u stretched to the same start-goal distance, mm.

    Returns
    -------
    array, shape (n,)
        mm.
    """
    from scipy.spatial import cKDTree

    _, nearest = cKDTree(demonstrated[:, :2]).query(uv)
    # Beside the nearest sample on the nearer of its two segments: a lift is steep.
    best, found = np.full(len(uv), np.inf), demonstrated[nearest, 2]
    for first in (np.maximum(nearest - 1, 0), np.minimum(nearest, len(demonstrated) - 2)):
        way = demonstrated[first + 1] - demonstrated[first]
        offset = uv - demonstrated[first, :2]
        size = np.maximum(np.sum(way[:, :2] ** 2, axis=1), 1e-300)
        share = np.clip(np.sum(offset * way[:, :2], axis=1) / size, 0.0, 1.0)
        apart = np.linalg.norm(offset - share[:, None] * way[:, :2], axis=1)
        nearer = apart < best
        best = np.where(nearer, apart, best)
        found = np.where(nearer, demonstrated[first, 2] + share * way[:, 2], found)
    return np.asarray(found)


def height(position: Floats, closest: Closest) -> Floats:
    """Signed distance of points (n, 3) to the surface, mm, positive on the normals' side."""
    foot, normal = closest(position)
    gap = position - foot
    side = np.where(np.sum(gap * normal, axis=1) < 0.0, -1.0, 1.0)
    return np.asarray(side * np.linalg.norm(gap, axis=1))


def contact(position: Floats, height: Floats, band: float) -> tuple[float, float]:
    """Share of a path that touches a surface, 0 to 1, and the largest height of the rest, mm.

    Parameters
    ----------
    position : array, shape (n, 3)
        mm.
    height : array, shape (n,)
        Signed, over the surface, mm.
    band : float
        Up to this height, or depth, it touches, mm.
    """
    steps = np.linalg.norm(np.diff(position, axis=0), axis=1)
    share = np.concatenate([steps[:1], steps]) + np.concatenate([steps, steps[-1:]])
    touching = np.abs(height) <= band
    total = float(share.sum())
    part = float(share[touching].sum()) / total if total > 0.0 else float(touching.mean())
    return min(1.0, part), max(0.0, float(height[~touching].max(initial=0.0)))


def wave_along(uv: Floats, length: float) -> WaveHeights | None:
    """Wave heights of an open stroke along the surface.

    Parameters
    ----------
    uv : array, shape (n, 2)
        u, v, mm.
    length : float
        Of the start-goal geodesic, mm.

    Returns
    -------
    WaveHeights or None
        Without heights for a line; None where a point has no coordinates.
    """
    v = uv[:, 1]
    if not np.isfinite(v).all():
        return None
    return wave_heights(v, length=length)


def tilt(rotation: Floats, normal: Floats) -> Floats:
    """Angle between the tool, from its tip upwards (-R e_z), and the surface's normal.

    Parameters
    ----------
    rotation : array, shape (n, 3, 3)
        R, the tool's z axis into the work.
    normal : array, shape (n, 3)
        Unit normals, on the tool's side.

    Returns
    -------
    array, shape (n,)
        rad.
    """
    up = -rotation[:, :, 2]
    across = np.linalg.norm(np.cross(up, normal), axis=1)
    return np.asarray(np.arctan2(across, np.sum(up * normal, axis=1)))


def stretch(foot: Floats, flat: Floats, pieces: int = PIECES) -> Floats:
    """Length of a stroke's pieces on the surface over their length in the flat chart.

    Parameters
    ----------
    foot : array, shape (n, 3)
        Points on the surface, mm.
    flat : array, shape (n, 2)
        The same points' u, v, mm.
    pieces : int
        Of about equal length on the surface; a piece is at least one sample long, and samples at
        rest belong to the piece before them.

    Returns
    -------
    array, shape (m,)
        m ≤ pieces; 1 everywhere on a plane, a cylinder or a cone.
    """
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(foot, axis=0), axis=1))])
    wanted = np.linspace(0.0, way[-1], pieces + 1)
    cuts = np.unique(np.searchsorted(way, wanted - 1e-9 * way[-1]))
    there = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(flat, axis=0), axis=1))])
    short = np.diff(there[cuts])
    return np.asarray(np.diff(way[cuts])[short > 0.0] / short[short > 0.0])
