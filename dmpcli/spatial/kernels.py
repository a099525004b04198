"""Euler angles along many paths, compiled: `rotations.to_euler_continuous` of products."""

import math

import numpy as np

from dmpcli.arrays import Booleans, Floats
from dmpcli.compiled import kernel

# S. Moshier, Cephes, atan.c: x + x z P(z)/Q(z), z = x², for |x| < 0.66.
_P0, _P1, _P2 = -8.750608600031904122785e-1, -1.615753718733365076637e1, -7.500855792314704667340e1
_P3, _P4 = -1.228866684490136173410e2, -6.485021904942025371773e1
_Q0, _Q1, _Q2 = 2.485846490142306297962e1, 1.650270098316988542046e2, 4.328810604912902668951e2
_Q3, _Q4 = 4.853903996359136964868e2, 1.945506571482613964425e2
_EIGHTH = math.sqrt(2.0) - 1.0
_PI, _LOW = math.pi, -math.pi + 1e-9
_SINGULAR = 1e-9
# As `rotations` has it.
_NEAR = 0.4 * math.pi


@kernel
def arctan2(y: float, x: float) -> float:
    """Angle of a point, without a branch, so that a loop of it works on several at once.

    -π + 1e-9 and less is read from +π on, as `rotations.to_euler` does.
    """
    ax, ay = abs(x), abs(y)
    low, high = min(ax, ay), max(ax, ay)
    large = low > _EIGHTH * high
    below = low + high if large else high
    t = (low - high if large else low) / (below if below > 0.0 else 1.0)
    z = t * t
    top = (((_P0 * z + _P1) * z + _P2) * z + _P3) * z + _P4
    bottom = ((((z + _Q0) * z + _Q1) * z + _Q2) * z + _Q3) * z + _Q4
    angle = t + t * (z * (top / bottom))
    angle = angle + _PI / 4.0 if large else angle
    angle = _PI / 2.0 - angle if ay > ax else angle
    angle = _PI - angle if x < 0.0 else angle
    angle = -angle if y < 0.0 else angle
    return angle + 2.0 * _PI if angle < _LOW else angle


@kernel
def _angles(y: Floats, x: Floats, out: Floats) -> None:
    """Angles of points (T,)."""
    for t in range(len(out)):
        out[t] = arctan2(y[t], x[t])


# Of a product: row and column of the elements that tell the angles, and the signs they have there.
_ROWS, _COLUMNS = np.array([1, 2, 0, 0, 0]), np.array([2, 2, 1, 0, 2])
_SIGNS = np.array([-1.0, 1.0, -1.0, 1.0, 1.0])


@kernel
def _products(C: Floats, M: Floats, R: Floats) -> None:
    """Elements of C M that tell the angles, (5, T); C is (9, 1) or (9, T), M (9, T)."""
    for k in range(5):
        row, column, sign = 3 * _ROWS[k], _COLUMNS[k], _SIGNS[k]
        p, q, s = M[column], M[3 + column], M[6 + column]
        out = R[k]
        if C.shape[1] == 1:
            a, b, c = sign * C[row, 0], sign * C[row + 1, 0], sign * C[row + 2, 0]
            for t in range(len(out)):
                out[t] = a * p[t] + b * q[t] + c * s[t]
        else:
            u, v, w = C[row], C[row + 1], C[row + 2]
            for t in range(len(out)):
                out[t] = sign * (u[t] * p[t] + v[t] * q[t] + w[t] * s[t])


@kernel
def _small_steps(angles: Floats) -> bool:
    """Tell whether no step of an angle (T,) is large enough to be a turn, or of another set."""
    large = 0
    for t in range(len(angles) - 1):
        large |= 1 if abs(angles[t + 1] - angles[t]) >= _NEAR else 0
    return large == 0


@kernel
def _unwound(angles: Floats, steps: Floats) -> bool:
    """Unwrap an angle (T,); tell whether its steps are too small for another set to be meant."""
    if _small_steps(angles):
        return True
    samples = len(angles)
    largest = 0.0
    turning = 0.0
    for t in range(samples - 1):
        step = angles[t + 1] - angles[t]
        turns = np.rint(step / (2.0 * _PI))
        steps[t] = turns
        turning = max(turning, abs(turns))
        largest = max(largest, abs(step - 2.0 * _PI * turns))
    if turning > 0.0:
        whole = 0.0
        for t in range(samples - 1):
            whole += steps[t]
            angles[t + 1] -= 2.0 * _PI * whole
    return largest < _NEAR


@kernel
def _any_below(values: Floats, least: float) -> bool:
    """Tell whether one of so many values is no more than this."""
    found = 0
    for t in range(len(values)):
        found |= 1 if values[t] <= least else 0
    return found != 0


@kernel
def euler_of_products(C: Floats, M: Floats, out: Floats) -> Booleans:
    """Unwrapped X-Y-Z angles of paths C_b(t) M_b(t), rad.

    Parameters
    ----------
    C : array, shape (B, 1 or T, 3, 3)
    M : array, shape (1 or B, 9, T)
    out : array, shape (3, B, T)
        To be filled.

    Returns
    -------
    array of bool, shape (B,)
        Paths through ry = ±π/2 or beside it, which are to be worked out with more care.
    """
    samples = M.shape[2]
    c, R, steps = np.empty((9, C.shape[1])), np.empty((5, samples)), np.empty(samples)
    cosine = np.empty(samples)
    special = np.zeros(len(C), dtype=np.bool_)
    for b in range(len(C)):
        for t in range(C.shape[1]):
            for k in range(9):
                c[k, t] = C[b, t, k // 3, k % 3]
        _products(c, M[b if len(M) > 1 else 0], R)
        rx, ry, rz = out[0, b], out[1, b], out[2, b]
        for t in range(samples):
            cosine[t] = math.sqrt(R[2, t] * R[2, t] + R[3, t] * R[3, t])
        _angles(R[0], R[1], rx)
        _angles(R[4], cosine, ry)
        _angles(R[2], R[3], rz)
        sound = _unwound(rx, steps)
        sound &= _unwound(ry, steps)
        sound &= _unwound(rz, steps)
        special[b] = _any_below(cosine, _SINGULAR) or not sound
    return special
