"""Rotations as matrices; Euler angles only where files and drivers need them.

Euler angles are X-Y-Z, intrinsic, in rad: ``R = Rx(rx) Ry(ry) Rz(rz)``. Every function works on
stacks: the rotation's own axes are the last ones, any number of axes may stand before them.
"""

import math

import numpy as np

from dmpcli.arrays import Floats

# Below this the series of sin(x)/x to second order is exact to rounding.
_SMALL_ANGLE = 1e-4
# Steps of an angle, rad, below which neither a full turn nor the other set of angles can be meant.
_NEAR = 0.4 * np.pi
# Samples that are worked on at once.
_IN_CACHE = 1 << 13


def from_euler(angles: Floats) -> Floats:
    """Rotation matrices of X-Y-Z intrinsic Euler angles.

    Parameters
    ----------
    angles : array, shape (..., 3)
        rx, ry, rz in rad.

    Returns
    -------
    array, shape (..., 3, 3)
        ``Rx(rx) Ry(ry) Rz(rz)``.
    """
    a = np.asarray(angles, dtype=float)
    cx, cy, cz = np.moveaxis(np.cos(a), -1, 0)
    sx, sy, sz = np.moveaxis(np.sin(a), -1, 0)
    R = np.empty((*a.shape[:-1], 3, 3))
    R[..., 0, 0] = cy * cz
    R[..., 0, 1] = -cy * sz
    R[..., 0, 2] = sy
    R[..., 1, 0] = cx * sz + sx * sy * cz
    R[..., 1, 1] = cx * cz - sx * sy * sz
    R[..., 1, 2] = -sx * cy
    R[..., 2, 0] = sx * sz - cx * sy * cz
    R[..., 2, 1] = sx * cz + cx * sy * sz
    R[..., 2, 2] = cx * cy
    return R


def to_euler(R: Floats) -> Floats:
    """X-Y-Z intrinsic Euler angles of rotation matrices, each on its own.

    At the singularity (ry = ±π/2), where only rx ± rz is defined, rz is 0.

    Parameters
    ----------
    R : array, shape (..., 3, 3)

    Returns
    -------
    array, shape (..., 3)
        rx, rz in (-π, π], ry in [-π/2, π/2], rad. A pen that points straight down reads
        rx = +π whatever the sign of the rounding error.
    """
    return np.stack(_angles(np.moveaxis(R, (-2, -1), (0, 1))), axis=-1)


def to_euler_one(R: Floats) -> tuple[float, float, float]:
    """`to_euler` of one rotation matrix, in plain floats: several times faster, for loops.

    Parameters
    ----------
    R : array, shape (3, 3)

    Returns
    -------
    tuple of float
        rx, ry, rz in rad.
    """
    (r00, r01, r02), (_, r11, r12), (_, r21, r22) = R.tolist()
    cy = math.sqrt(r00 * r00 + r01 * r01)
    if cy <= 1e-9:
        rx, rz = math.atan2(r21, r11), 0.0
    else:
        rx, rz = math.atan2(-r12, r22), math.atan2(-r01, r00)
    low = -math.pi + 1e-9
    rx, rz = (angle + 2.0 * math.pi if angle < low else angle for angle in (rx, rz))
    return rx, math.atan2(r02, cy), rz


def _angles(R: Floats) -> tuple[Floats, Floats, Floats]:
    """Euler angles of rotations whose own axes are the first ones, shape (3, 3, ...)."""
    cy = np.sqrt(R[0, 0] * R[0, 0] + R[0, 1] * R[0, 1])
    rx = np.arctan2(-R[1, 2], R[2, 2])
    ry = np.arctan2(R[0, 2], cy)
    rz = np.arctan2(-R[0, 1], R[0, 0])
    singular = cy <= 1e-9
    if singular.any():
        rx = np.where(singular, np.arctan2(R[2, 1], R[1, 1]), rx)
        rz = np.where(singular, 0.0, rz)
    return _from_plus_pi(rx), ry, _from_plus_pi(rz)


def _from_plus_pi(angle: Floats) -> Floats:
    """Read a half turn as +π, whatever the sign of its rounding error."""
    low = -np.pi + 1e-9
    return (
        np.where(angle < low, angle + 2 * np.pi, angle) if angle.min(initial=0.0) < low else angle
    )


def to_euler_continuous(R: Floats) -> Floats:
    """Euler angles along a path, unwrapped: no jump where the rotation has none.

    Each rotation has two sets of X-Y-Z angles, (rx, ry, rz) and (rx + π, π - ry, rz + π), both up
    to full turns. The set and the turns nearest to the previous sample are taken, so that a path
    through ry = ±π/2 or past rx = ±π stays continuous.

    Parameters
    ----------
    R : array, shape (..., T, 3, 3)
        Rotations along the path, on axis -3.

    Returns
    -------
    array, shape (..., T, 3)
        rad; the first sample is that of `to_euler`.
    """
    return np.stack(_continuous(_angles(np.moveaxis(R, (-2, -1), (0, 1)))), axis=-1)


def to_euler_continued(R: Floats, before: Floats, angles: Floats) -> Floats:
    """Return `to_euler_continuous` of a path that goes on from an earlier part of it.

    Parameters
    ----------
    R : array, shape (T, 3, 3)
    before : array, shape (3, 3)
        The last rotation of the part before.
    angles : array, shape (3,)
        Its angles there, rad.

    Returns
    -------
    array, shape (T, 3)
        rad.
    """
    own = to_euler_continuous(np.concatenate([before[None], R]))
    other = np.stack([own[:, 0] + np.pi, np.pi - own[:, 1], own[:, 2] + np.pi], axis=1)
    far = [np.abs(_wrapped(each[0] - angles)).sum() for each in (own, other)]
    same = own if far[0] <= far[1] else other
    found: Floats = same + 2 * np.pi * np.rint((angles - same[0]) / (2 * np.pi))
    return found[1:]


def euler_of_products(C: Floats, M: Floats) -> Floats:
    """Return `to_euler_continuous` of the paths C_b M(t), several times faster.

    Parameters
    ----------
    C : array, shape (B, 3, 3)
    M : array, shape (T, 3, 3)

    Returns
    -------
    array, shape (B, T, 3)
        rad.
    """
    count, samples = len(C), len(M)
    path = np.ascontiguousarray(M.transpose(1, 2, 0)).reshape(3, 3 * samples)
    angles = np.empty((3, count, samples))
    # So many paths that what is in work stays in the processor's cache.
    size = max(1, _IN_CACHE // samples)
    for first in range(0, count, size):
        part = C[first : first + size].transpose(1, 0, 2).reshape(-1, 3)
        R = (part @ path).reshape(3, -1, 3, samples).swapaxes(1, 2)
        angles[:, first : first + size] = _continuous(_angles(R))
    return angles.transpose(1, 2, 0)


def euler_of_paths(C: Floats, M: Floats) -> Floats:
    """Return `to_euler_continuous` of the paths C_b(t) M_b(t), by compiled kernels.

    Parameters
    ----------
    C : array, shape (B, 1 or T, 3, 3)
    M : array, shape (1 or B, T, 3, 3)

    Returns
    -------
    array, shape (B, T, 3)
        rad.
    """
    from dmpcli.spatial import kernels

    C = np.broadcast_to(C, (max(len(C), len(M)), *C.shape[1:]))
    path = np.ascontiguousarray(M.reshape(*M.shape[:2], 9).swapaxes(1, 2))
    out = np.empty((3, len(C), M.shape[1]))
    special = np.flatnonzero(kernels.euler_of_products(np.ascontiguousarray(C), path, out))
    if len(special):
        R = C[special] @ M[special if len(M) > 1 else slice(None)]
        out[:, special] = _continuous(_angles(np.moveaxis(R, (-2, -1), (0, 1))))
    return out.transpose(1, 2, 0)


def _continuous(angles: tuple[Floats, Floats, Floats]) -> tuple[Floats, ...]:
    """Unwrap angles along their last axis; see `to_euler_continuous`."""
    if angles[0].shape[-1] < 2:
        return angles
    steps = [angle[..., 1:] - angle[..., :-1] for angle in angles]
    turns = [_turns(step) for step in steps]
    largest = max(
        _largest(step if turn is None else step - 2 * np.pi * turn)
        for step, turn in zip(steps, turns, strict=True)
    )
    # With steps s below this the other set is further away, 2π - 2s against 3s at most.
    if largest < _NEAR:
        return tuple(map(_unwound, angles, turns))
    return _nearest_sets(angles)


def _turns(step: Floats) -> Floats | None:
    """Full turns in the steps of an angle; None where there are none."""
    return np.rint(step / (2 * np.pi)) if _largest(step) >= _NEAR else None


def _largest(values: Floats) -> float:
    return max(float(values.max(initial=0.0)), -float(values.min(initial=0.0)))


def _unwound(angle: Floats, turns: Floats | None) -> Floats:
    if turns is None:
        return angle
    angle = angle.copy()
    angle[..., 1:] -= 2 * np.pi * np.cumsum(turns, axis=-1)
    return angle


def _nearest_sets(angles: tuple[Floats, Floats, Floats]) -> tuple[Floats, ...]:
    """Choose between both sets sample by sample, then unwrap."""
    first = np.stack(angles)
    second = np.stack([first[0] + np.pi, np.pi - first[1], first[2] + np.pi])
    stay = np.abs(_wrapped(np.diff(first))).sum(axis=0)
    change = np.abs(_wrapped(second[..., 1:] - first[..., :-1])).sum(axis=0)
    swapped = np.zeros(first.shape[1:], dtype=bool)
    swapped[..., 1:] = np.cumsum(change < stay, axis=-1) % 2 == 1
    return tuple(np.unwrap(np.where(swapped, second, first)))


def _wrapped(angles: Floats) -> Floats:
    return (angles + np.pi) % (2 * np.pi) - np.pi


def exp(rotvec: Floats) -> Floats:
    """Rotation matrices of rotation vectors (Rodrigues' formula).

    Parameters
    ----------
    rotvec : array, shape (..., 3)
        Axis times angle, rad.

    Returns
    -------
    array, shape (..., 3, 3)
    """
    v = np.asarray(rotvec, dtype=float)
    angle = np.linalg.norm(v, axis=-1)
    small = angle < _SMALL_ANGLE
    safe = np.where(small, 1.0, angle)
    a = np.where(small, 1.0 - angle**2 / 6.0, np.sin(safe) / safe)
    b = np.where(small, 0.5 - angle**2 / 24.0, (1.0 - np.cos(safe)) / safe**2)
    K = skew(v)
    R: Floats = np.eye(3) + a[..., None, None] * K + b[..., None, None] * (K @ K)
    return R


def log(R: Floats) -> Floats:
    """Rotation vectors of rotation matrices; accurate at all angles, π included.

    Parameters
    ----------
    R : array, shape (..., 3, 3)

    Returns
    -------
    array, shape (..., 3)
        Axis times angle, rad, angle in [0, π].
    """
    q = to_quaternion(R)
    vector, scalar = q[..., :3], q[..., 3]
    sine = np.linalg.norm(vector, axis=-1)
    small = sine < _SMALL_ANGLE
    half = np.arctan2(sine, scalar)
    factor = np.where(small, 2.0 + sine**2 / 3.0, 2.0 * half / np.where(small, 1.0, sine))
    rotvec: Floats = factor[..., None] * vector
    return rotvec


def exp_one(rotvec: Floats) -> Floats:
    """`exp` of a single rotation vector, in plain floats: several times faster, for control loops.

    Parameters
    ----------
    rotvec : array, shape (3,)
        rad.

    Returns
    -------
    array, shape (3, 3)
    """
    x, y, z = rotvec.tolist()
    square = x * x + y * y + z * z
    angle = math.sqrt(square)
    if angle < _SMALL_ANGLE:
        a, b = 1.0 - square / 6.0, 0.5 - square / 24.0
    else:
        a, b = math.sin(angle) / angle, (1.0 - math.cos(angle)) / square
    bx, by, bz = b * x, b * y, b * z
    ax, ay, az = a * x, a * y, a * z
    return np.array(
        [
            [1.0 - by * y - bz * z, bx * y - az, bx * z + ay],
            [bx * y + az, 1.0 - bx * x - bz * z, by * z - ax],
            [bx * z - ay, by * z + ax, 1.0 - bx * x - by * y],
        ]
    )


def log_one(R: Floats) -> Floats:
    """`log` of a single rotation matrix: several times faster away from a half turn.

    Parameters
    ----------
    R : array, shape (3, 3)

    Returns
    -------
    array, shape (3,)
        rad, angle in [0, π].
    """
    (a, b, c), (d, e, f), (g, h, i) = R.tolist()
    scalar = 1.0 + a + e + i
    if scalar < 1.0:  # beyond 120°, where the vector part must be found with more care
        return log(R)
    # The quaternion times 4w, whose scalar part is 4w² = scalar.
    x, y, z = h - f, c - g, d - b
    sine = math.sqrt(x * x + y * y + z * z)
    factor = 2.0 * math.atan2(sine, scalar) / sine if sine > 0.0 else 0.5
    return np.array([factor * x, factor * y, factor * z])


def to_quaternion(R: Floats) -> Floats:
    """Unit quaternions (x, y, z, w) of rotation matrices, w ≥ 0 (Shepperd's method).

    Parameters
    ----------
    R : array, shape (..., 3, 3)

    Returns
    -------
    array, shape (..., 4)
    """
    R = np.asarray(R, dtype=float)
    trace = np.trace(R, axis1=-2, axis2=-1)
    d = np.diagonal(R, axis1=-2, axis2=-1)
    # Four times the squared components; the largest of them is the divisor that loses nothing.
    squares = np.concatenate([1.0 + 2.0 * d - trace[..., None], (1.0 + trace)[..., None]], axis=-1)
    odd, even = R - np.swapaxes(R, -1, -2), R + np.swapaxes(R, -1, -2)
    x, y, z = odd[..., 2, 1], odd[..., 0, 2], odd[..., 1, 0]
    xy, xz, yz = even[..., 0, 1], even[..., 0, 2], even[..., 1, 2]
    candidates = np.stack(
        [
            np.stack([squares[..., 0], xy, xz, x], axis=-1),
            np.stack([xy, squares[..., 1], yz, y], axis=-1),
            np.stack([xz, yz, squares[..., 2], z], axis=-1),
            np.stack([x, y, z, squares[..., 3]], axis=-1),
        ],
        axis=-2,
    )
    best = np.argmax(squares, axis=-1)
    q: Floats = np.take_along_axis(candidates, best[..., None, None], axis=-2)[..., 0, :]
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    q *= np.where(q[..., 3:] < 0, -1.0, 1.0)
    return q


def from_quaternion(q: Floats) -> Floats:
    """Rotation matrices of unit quaternions (x, y, z, w); the norm is divided out.

    Parameters
    ----------
    q : array, shape (..., 4)

    Returns
    -------
    array, shape (..., 3, 3)
    """
    q = np.asarray(q, dtype=float)
    if q.ndim == 2 and len(q) > _IN_CACHE:
        whole: Floats = np.empty((len(q), 3, 3))
        for first in range(0, len(q), _IN_CACHE):
            part = slice(first, first + _IN_CACHE)
            _from_quaternion(q[part], whole[part])
        return whole
    return _from_quaternion(q, np.empty((*q.shape[:-1], 3, 3)))


def _from_quaternion(q: Floats, R: Floats) -> Floats:
    """Fill R with 1 + 2 (w K + K K)."""
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    K = skew(q[..., :3])
    np.matmul(K, K, out=R)
    K *= q[..., 3, None, None]
    R += K
    R *= 2.0
    R += np.eye(3)
    return R


def skew(v: Floats) -> Floats:
    """Matrices of the cross product: ``skew(v) @ x = v × x``.

    Parameters
    ----------
    v : array, shape (..., 3)

    Returns
    -------
    array, shape (..., 3, 3)
    """
    v = np.asarray(v, dtype=float)
    if v.ndim == 1:  # several times faster, for control loops
        x, y, z = v.tolist()
        return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    K = np.zeros((*v.shape[:-1], 3, 3))
    K[..., 0, 1], K[..., 0, 2], K[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    K[..., 1, 0], K[..., 2, 0], K[..., 2, 1] = v[..., 2], -v[..., 1], v[..., 0]
    return K


def interpolate(t: Floats, R: Floats, at: Floats) -> Floats:
    """Rotations between samples, along the shortest arc at constant angular velocity (slerp).

    Parameters
    ----------
    t : array, shape (T,)
        Increasing times, s.
    R : array, shape (T, 3, 3)
    at : array, shape (S,)
        Times to read, s; outside [t[0], t[-1]] the end rotations hold.

    Returns
    -------
    array, shape (S, 3, 3)
    """
    if len(t) == 1:
        return np.broadcast_to(R[0], (len(at), 3, 3)).copy()
    i = np.clip(np.searchsorted(t, at, side="right") - 1, 0, len(t) - 2)
    fraction = np.clip((at - t[i]) / (t[i + 1] - t[i]), 0.0, 1.0)
    step = log(R[i + 1] @ np.swapaxes(R[i], -1, -2))
    return exp(fraction[:, None] * step) @ R[i]


def smallest_between(a: Floats, b: Floats) -> Floats:
    """Smallest rotation that turns unit vectors `a` onto unit vectors `b`.

    Parameters
    ----------
    a, b : array, shape (..., 3)
        Unit vectors, not opposite to each other.

    Returns
    -------
    array, shape (..., 3, 3)
    """
    a, b = np.broadcast_arrays(np.asarray(a, dtype=float), np.asarray(b, dtype=float))
    K = skew(np.cross(a, b))
    cosine = np.sum(a * b, axis=-1)[..., None, None]
    R: Floats = np.eye(3) + K + (K @ K) / (1.0 + cosine)
    return R
