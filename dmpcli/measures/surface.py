"""How a stroke lies on a curved surface: distance, wave height along it, tilt, stretch.

Everything is measured from the stroke's points. The surface comes as callables, so that planes,
cylinders, spheres and meshes are measured alike.
"""

from collections.abc import Callable

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.measures.wave import LINE, WaveHeights, wave_heights

Closest = Callable[[Floats], tuple[Floats, Floats]]
"""Points (n, 3), mm, to the closest points of the surface and the unit normals there, (n, 3)."""

Lift = Callable[[Floats], tuple[Floats, Floats, Floats]]
"""Chart coordinates u, v (b, n, 2), mm, of b strokes to points of the surface, e_u and e_v there,
(b, n, 3) each; NaN where the chart does not reach.
"""

SETTLED = 1e-6
"""Chart coordinates that move by less than this per step are found, mm."""

ASTRAY = 1e-2
"""Coordinates that lead to a point farther than this from the one sought are none, mm."""

PIECES = 100
"""A stroke's stretch is taken over so many pieces of equal length."""

_MOST_STEPS = 20
_DIFFERENCE = 0.5
_LEAST_SLOPE = 0.05


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
    return np.asarray(demonstrated[nearest, 2])


def height(position: Floats, closest: Closest) -> Floats:
    """Signed distance of points (n, 3) to the surface, mm, positive on the normals' side."""
    foot, normal = closest(position)
    gap = position - foot
    side = np.where(np.sum(gap * normal, axis=1) < 0.0, -1.0, 1.0)
    return np.asarray(side * np.linalg.norm(gap, axis=1))


def coordinates(foot: Floats, lift: Lift, guess: Floats) -> Floats:
    """Chart coordinates of points on the surface: the chart inverted by Newton's method.

    v is the length of the geodesic that leaves the start-goal geodesic at a right angle and ends
    in the point. The residual is projected on the chart's axes; of the chart's metric
    diag(g², 1) in strip coordinates (A. Gray, Tubes, 2nd ed., Birkhäuser 2004, ch. 2) g is a
    difference quotient.

    Strokes do not depend on those beside them.

    Parameters
    ----------
    foot : array, shape (b, n, 3)
        Points of b strokes, mm.
    lift : callable
    guess : array, shape (b, n, 2)
        mm; need not be near.

    Returns
    -------
    array, shape (b, n, 2)
        u, v, mm; NaN for points that the chart does not reach.
    """
    at = np.array(guess, dtype=float)
    n = at.shape[1]
    reach = 2.0 * np.abs(at).max(axis=(1, 2), keepdims=True) + 10.0
    looking = np.ones((len(at), 1, 1), dtype=bool)
    for _ in range(_MOST_STEPS):
        # Both places in one: what carries them there need be prepared only once.
        both = np.concatenate([at, at + np.array([_DIFFERENCE, 0.0])], axis=1)
        points, along, aside = lift(both)
        point, ahead, e_u, e_v = points[:, :n], points[:, n:], along[:, :n], aside[:, :n]
        slope = np.sum((ahead - point) * e_u, axis=-1) / _DIFFERENCE
        gap = foot - point
        move = np.stack(
            [
                np.sum(gap * e_u, axis=-1) / np.maximum(slope, _LEAST_SLOPE),
                np.sum(gap * e_v, axis=-1),
            ],
            axis=-1,
        )
        # Beyond the border the way back is unknown: such a point tries again nearer the middle.
        lost = ~np.isfinite(move).all(axis=-1)
        move[lost] = -0.5 * at[lost]
        at = np.where(looking, np.clip(at + move, -reach, reach), at)
        looking &= np.abs(move).max(axis=(1, 2), keepdims=True) >= SETTLED
        if not looking.any():
            break
    found = np.linalg.norm(gap, axis=-1) < ASTRAY
    return np.where(found[..., None], at, np.nan)


def wave_along(uv: Floats, length: float) -> WaveHeights | None:
    """Wave heights of an open stroke along the surface.

    Parameters
    ----------
    uv : array, shape (n, 2)
        Of `coordinates`, mm.
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
    if np.ptp(v) < LINE * length:
        return WaveHeights(np.empty(0), np.empty(0))
    return wave_heights(v)


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
