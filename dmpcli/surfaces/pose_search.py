"""Poses of a part that touched points may be of: many starts, each brought to its own best fit.

Sums of squared distances have many minima over a pose, and from a rough one the nearest is often
not the true one. So the points are laid onto the surface from many starts at once by damped
Gauss-Newton steps on their signed distances (K. Levenberg 1944, D. Marquardt 1963, on the distances
of Y. Chen, G. Medioni, Image and Vision Computing 10 (1992) 145), all starts as one array.
"""

from collections.abc import Callable

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.spatial import rotations
from dmpcli.spatial.pose import Pose
from dmpcli.surfaces.conditioning import radius_of

Closest = Callable[[Floats], tuple[Floats, Floats]]
"""From points (n, 3) to the closest points of the part and its unit normals there, part frame."""

_STEPS, LAST_STEPS = 12, 60
_MOST_KEPT = 48
"""Poses that go on to the end after the first steps, the best that differ ..."""
_SAME = 0.05
"""... by more than this at a touched point, mm."""
_SETTLED = 1e-9
"""A step that changes the sum of squares by less than this part of it is the last."""
# Frequency of the super-Fibonacci spiral on SO(3): the root of psi^4 = psi + 4.
_PSI = 1.533751168755204288118041


def signed(points: Floats, closest: Closest) -> tuple[Floats, Floats]:
    """Signed distances (...) of points (..., 3) from the surface and their gradients (..., 3)."""
    flat = points.reshape(-1, 3)
    foot, normal = closest(flat)
    away = flat - foot
    distance = np.linalg.norm(away, axis=1)
    side = np.where(np.sum(away * normal, axis=1) < 0.0, -1.0, 1.0)
    off = distance > 1e-9
    safe = np.where(off, distance, 1.0)[:, None]
    gradient = np.where(off[:, None], away / safe * side[:, None], normal)
    return (side * distance).reshape(points.shape[:-1]), gradient.reshape(points.shape)


def near(
    rotation: Floats, position: Floats, about: Floats, count: int, shift: float, turn: float
) -> Pose:
    """Spread poses evenly about one: itself first, then others off by `shift` and `turn` at most.

    Parameters
    ----------
    rotation, position : array, shape (3, 3) and (3,)
    about : array, shape (3,)
        What the poses turn about, base frame, mm.
    count : int
    shift, turn : float
        Largest shift, mm, and turn, rad.
    """
    from scipy.stats import qmc

    cube = qmc.Halton(6, scramble=False).random(count)[1:]
    steps = np.concatenate(
        [
            np.zeros((1, 6)),
            np.concatenate([shift * _ball(cube[:, :3]), turn * _ball(cube[:, 3:])], axis=1),
        ]
    )
    R = rotations.exp(steps[:, 3:])
    moved = np.einsum("bij,j->bi", R, position - about) + about + steps[:, :3]
    return Pose(moved, R @ rotation)


def anywhere(centre: Floats, about: Floats, count: int) -> Pose:
    """Spread poses over all orientations, each with a point of the part on one of the base frame.

    Super-Fibonacci spirals (M. Alexa, CVPR 2022).

    Parameters
    ----------
    centre : array, shape (3,)
        Of the part, part frame, mm.
    about : array, shape (3,)
        Where it is to lie, base frame, mm.
    count : int
    """
    s = np.arange(count) + 0.5
    r, big = np.sqrt(s / count), np.sqrt(1.0 - s / count)
    alpha, beta = 2.0 * np.pi * s / np.sqrt(2.0), 2.0 * np.pi * s / _PSI
    q = np.stack([r * np.sin(alpha), r * np.cos(alpha), big * np.sin(beta), big * np.cos(beta)], 1)
    R = rotations.from_quaternion(q)
    return Pose(about - R @ centre, R)


def descend(touched: Floats, closest: Closest, starts: Pose) -> tuple[Pose, Floats]:
    """Bring the starts to poses that fit the touched points best, each its own; best first.

    Parameters
    ----------
    touched : array, shape (n, 3)
        Base frame, mm.
    closest : callable
    starts : Pose
        B of them; the worst are given up on the way.

    Returns
    -------
    poses : Pose
    squares : array
        Sums of squared distances, mm².
    """
    poses, squares = descended(touched, closest, starts, _STEPS)
    kept = _distinct(poses.apply_inverse(touched), np.argsort(squares, kind="stable"))
    poses, squares = descended(touched, closest, poses[kept])
    order = np.argsort(squares, kind="stable")
    return poses[order], squares[order]


def _distinct(placed: Floats, order: Integers) -> Integers:
    """Choose up to `_MOST_KEPT` of B poses in their order, none twice.

    Where many starts lead to one pose, the best of all would be that pose alone.

    Parameters
    ----------
    placed : array, shape (B, n, 3)
        The touched points in the part's frame, mm.
    order : array of int, shape (B,)
    """
    kept: list[int] = []
    while len(order) and len(kept) < _MOST_KEPT:
        first = int(order[0])
        kept.append(first)
        apart = np.sum((placed[order] - placed[first]) ** 2, axis=2).max(axis=1)
        order = order[apart > _SAME**2]
    return np.array(kept)


def descended(
    touched: Floats,
    closest: Closest,
    starts: Pose,
    steps: int = LAST_STEPS,
    fixed: Floats | None = None,
) -> tuple[Pose, Floats]:
    """Take damped Gauss-Newton steps from every start, all at once.

    Parameters
    ----------
    touched : array, shape (n, 3)
    closest : callable
    starts : Pose
    steps : int
        At most.
    fixed : array, shape (B, 6), optional
        A unit motion (v, ω·radius) of each start that no step takes; see `conditioning`.

    Returns
    -------
    poses : Pose
    squares : array, shape (B,)
        Sums of squared distances, mm².
    """
    R, t = np.array(starts.rotation, dtype=float), np.array(starts.position, dtype=float)
    centre = touched.mean(axis=0)
    radius = radius_of(touched - centre)
    distance, gradient = signed(Pose(t, R).apply_inverse(touched), closest)
    squares = np.sum(distance**2, axis=1)
    damping = np.full(len(R), 1e-3)
    active = np.arange(len(R))
    for _ in range(steps):
        # In base axes: the points move by v + w x (p - c), the part the other way.
        g = np.einsum("bij,bnj->bni", R[active], gradient[active])
        rows = np.concatenate([g, np.cross(touched - centre, g) / radius], axis=2)
        normal = np.swapaxes(rows, 1, 2) @ rows
        slope = np.einsum("bni,bn->bi", rows, distance[active])
        if fixed is not None:
            u = fixed[active]
            along = np.einsum("bij,bj->bi", normal, u)
            both = u[:, :, None] * along[:, None, :]
            inner = np.einsum("bi,bi->b", u, along)[:, None, None] * u[:, :, None] * u[:, None, :]
            normal = normal - both - np.swapaxes(both, 1, 2) + inner
            slope = slope - np.einsum("bi,bi->b", u, slope)[:, None] * u
        load = damping[active] * np.trace(normal, axis1=1, axis2=2) / 6.0 + 1e-12
        step = -np.linalg.solve(normal + load[:, None, None] * np.eye(6), slope[..., None])[..., 0]
        turn = rotations.exp(-step[:, 3:] / radius)
        R_new = turn @ R[active]
        t_new = np.einsum("bij,bj->bi", turn, t[active] - step[:, :3] - centre) + centre
        d_new, g_new = signed(Pose(t_new, R_new).apply_inverse(touched), closest)
        s_new = np.sum(d_new**2, axis=1)
        better = s_new < squares[active]
        gain = (squares[active] - s_new) / np.maximum(squares[active], 1e-300)
        took = active[better]
        R[took], t[took] = R_new[better], t_new[better]
        distance[took], gradient[took], squares[took] = d_new[better], g_new[better], s_new[better]
        damping[active] = np.clip(
            np.where(better, damping[active] * 0.2, damping[active] * 8.0), 1e-9, 1e9
        )
        done = (better & (gain < _SETTLED)) | (~better & (damping[active] > 1e4))
        done |= squares[active] < 1e-18
        active = active[~done]
        if len(active) == 0:
            break
    return Pose(t, R), squares


def _ball(cube: Floats) -> Floats:
    """Map the unit cube (n, 3) evenly into the unit ball."""
    z, around = 2.0 * cube[:, 0] - 1.0, 2.0 * np.pi * cube[:, 1]
    flat = np.sqrt(1.0 - z**2)
    direction = np.stack([flat * np.cos(around), flat * np.sin(around), z], axis=1)
    return np.asarray(np.cbrt(cube[:, 2:]) * direction)
