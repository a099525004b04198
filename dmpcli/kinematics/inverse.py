"""Inverse kinematics in closed form, for arms whose axes 2, 3 and 4 are parallel.

The EC66 is of this family, as the UR arms are: joint 1 and joint 2 meet, as do 4 with 5 and 5 with
6, all at right angles. In the symbols of `Arm`, with φ = q + offset, σ = sin α = ±1, p and R the
flange's pose and c = p - d6 R e_z the point where axes 5 and 6 meet:

1. c · z1 = d4, with z1 = σ1 (sin φ1, -cos φ1, 0) the common direction of axes 2, 3, 4: two φ1.
2. cos φ5 = -σ4 σ5 (R e_z · z1): two φ5; Rᵀ z1 then gives φ6.
3. x4 = R (c5 c6, -c5 s6, σ5 s5) lies in the plane across z1: its direction is φ2 + φ3 + φ4.
4. What is left is a plane arm of two links, a2 and a3: two φ3, then φ2 and φ4.

So there are up to eight solutions, numbered 4 shoulder + 2 wrist + elbow.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import InputError, RefusedError, beside
from dmpcli.kinematics.models import Arm
from dmpcli.spatial.pose import Pose

BRANCHES = 8

SINGULARITIES = ("shoulder", "elbow", "wrist")
"""The wrist's centre over the axis of joint 1; arm stretched or folded; axes 4 and 6 in line."""

IN_LINE = 1e-12
"""Sine of φ5 below which joints 4 and 6 turn about one line, and joint 6 is free."""

# A cosine beyond 1 by less is rounding: at full stretch less than 1e-9 mm.
_ROUNDING = 1e-12
# A joint beyond its limit by less, rad, is rounding.
_SLACK = 1e-9

_TURN = 2.0 * math.pi


@dataclass(frozen=True)
class _Geometry:
    """What the closed form needs of an arm, in plain floats."""

    d1: float
    d4: float
    d5: float
    d6: float
    a2: float
    a3: float
    s1: float
    s4: float
    s5: float


@lru_cache
def _geometry(arm: Arm) -> _Geometry:
    s1, s4, s5 = (round(float(np.sin(arm.alpha[i]))) for i in (0, 3, 4))
    family = np.radians([90.0 * s1, 0.0, 0.0, 90.0 * s4, 90.0 * s5, 0.0])
    straight = np.concatenate([arm.a[[0, 3, 4, 5]], arm.d[[1, 2]]])
    if not (s1 * s4 * s5 and np.allclose(arm.alpha, family, atol=1e-9) and not straight.any()):
        raise InputError(f"robot model {arm.name}: not an arm with three parallel axes 2, 3, 4")
    d1, _, _, d4, d5, d6 = arm.d.tolist()
    return _Geometry(d1, d4, d5, d6, float(arm.a[1]), float(arm.a[2]), s1, s4, s5)


def solve(
    arm: Arm, position: Floats, rotation: Floats, sixth: Floats | None = None
) -> tuple[Floats, Floats]:
    """Every set of joint angles that brings the flange to a pose.

    Joint limits are not looked at. The poses are two arrays, as those of B paths with T samples are
    in `path.follow`, which takes rows out of them again and again.

    Parameters
    ----------
    arm : Arm
    position : array, shape (..., 3)
        Of the flange in the base frame, mm.
    rotation : array, shape (..., 3, 3)
    sixth : array, shape (..., 8), optional
        Angle of joint 6 in each branch where axes 4 and 6 are in line, rad; 0 if not given.

    Returns
    -------
    q : array, shape (..., 8, 6)
        rad, in (-π, π]; NaN where a branch does not reach the pose.
    missing : array, shape (..., 8)
        By how much the arm is too short, or cannot fold, for the pose, mm; 0 where it reaches.
    """
    g = _geometry(arm)
    R = np.asarray(rotation, dtype=float)
    centre = np.asarray(position, dtype=float) - g.d6 * R[..., :, 2]
    # Axes of the branches: shoulder, wrist, elbow.
    sign = np.array([1.0, -1.0])
    x, y, z = (centre[..., i, None] for i in range(3))
    radius = np.hypot(x, y)
    with np.errstate(invalid="ignore", divide="ignore"):
        swing = np.arcsin(_unit_range(g.s1 * g.d4 / radius))
    first = np.arctan2(y, x) + np.concatenate([swing, np.pi - swing], axis=-1)
    c1, s1 = np.cos(first), np.sin(first)
    axis = np.stack([g.s1 * s1, -g.s1 * c1, np.zeros_like(c1)], axis=-1)
    w = np.matvec(np.swapaxes(R, -1, -2)[..., None, :, :], axis)
    sine = np.hypot(w[..., 0], w[..., 1])
    # From here on axis -2 is the shoulder, axis -1 the wrist.
    fifth = np.arctan2(sine[..., None] * sign, (-g.s4 * g.s5 * w[..., 2])[..., None])
    flip = g.s4 * sign
    free = 0.0 if sixth is None else sixth[..., ::2].reshape(*sixth.shape[:-1], 2, 2)
    last = np.where(
        sine[..., None] < IN_LINE,
        arm.offset[5] + free,
        np.arctan2(-w[..., 1, None] * flip, w[..., 0, None] * flip),
    )
    c5, s5, c6, s6 = np.cos(fifth), np.sin(fifth), np.cos(last), np.sin(last)
    x4 = np.matvec(R[..., None, None, :, :], np.stack([c5 * c6, -c5 * s6, g.s5 * s5], axis=-1))
    c1, s1 = c1[..., None], s1[..., None]
    total = np.arctan2(g.s1 * x4[..., 2], x4[..., 0] * c1 + x4[..., 1] * s1)
    # The plane arm, from joint 2 to joint 4.
    u = (x * c1[..., 0] + y * s1[..., 0])[..., None] - g.d5 * g.s4 * np.sin(total)
    v = g.s1 * (z - g.d1)[..., None] + g.d5 * g.s4 * np.cos(total)
    reach = np.hypot(u, v)
    with np.errstate(invalid="ignore"):
        cosine = _unit_range((reach**2 - g.a2**2 - g.a3**2) / (2.0 * g.a2 * g.a3))
    third = np.arccos(cosine)[..., None] * sign
    second = np.arctan2(v, u)[..., None] - np.arctan2(
        g.a3 * np.sin(third), g.a2 + g.a3 * np.cos(third)
    )
    shape = third.shape
    phi = np.stack(
        [
            np.broadcast_to(first[..., None, None], shape),
            second,
            third,
            total[..., None] - second - third,
            np.broadcast_to(fifth[..., None], shape),
            np.broadcast_to(last[..., None], shape),
        ],
        axis=-1,
    )
    q = _wrapped(phi - arm.offset)
    q[np.isnan(q).any(axis=-1)] = np.nan
    near = (abs(g.d4) - radius)[..., None]
    missing = np.maximum(reach - (g.a2 + g.a3), abs(g.a2 - g.a3) - reach)
    missing = np.where(np.isnan(missing), near, missing)[..., None]
    leading = shape[:-3]
    missing = np.broadcast_to(missing, shape).reshape(*leading, BRANCHES)
    q = q.reshape(*leading, BRANCHES, 6)
    return q, np.where(np.isnan(q[..., 0]), np.maximum(missing, 0.0), 0.0)


def nearest(arm: Arm, flange: Pose, reference: Floats) -> Floats:
    """Joint angles for one pose, continuous with those before; for control loops.

    Of all branches, each joint turned by whole turns to the reference's side, the one nearest to
    the reference (sum of squares). Where axes 4 and 6 are in line joint 6 stays.

    Parameters
    ----------
    arm : Arm
    flange : Pose
        In the base frame.
    reference : array, shape (6,)
        The joint angles before, rad.

    Returns
    -------
    array, shape (6,)
        rad.

    Raises
    ------
    RefusedError
        The pose is out of reach, or the nearest solution leaves a joint's limits.
    """
    g = _geometry(arm)
    before = reference.tolist()
    # The reference as angles φ.
    here = (reference + arm.offset).tolist()
    steps: list[float] = []
    least = math.inf
    for phi in _each(g, flange.position.tolist(), flange.rotation.tolist(), here[5]):
        way, away = [], 0.0
        for p, h in zip(phi, here, strict=True):
            step = math.remainder(p - h, _TURN)
            way.append(step)
            away += step * step
            if not away < least:
                break
        else:
            steps, least = way, away
    if not steps:
        raise RefusedError(why_not(arm, flange))
    best = [b + step for b, step in zip(before, steps, strict=True)]
    for joint, (angle, (low, high)) in enumerate(zip(best, arm.limits.tolist(), strict=True), 1):
        if not low - _SLACK <= angle <= high + _SLACK:
            end = math.degrees(low if angle < low else high)
            raise RefusedError(
                f"joint limit: joint {joint} would turn to "
                f"{beside(math.degrees(angle), end, '.2f')}°, beyond "
                f"{math.degrees(low):g}° to {math.degrees(high):g}°"
            )
    return np.array(best)


def _each(
    g: _Geometry, p: list[float], R: list[list[float]], sixth: float
) -> Iterator[tuple[float, float, float, float, float, float]]:
    """Solutions φ of one pose, as `solve` finds them; `sixth` is φ6 where it is free."""
    (r11, r12, r13), (r21, r22, r23), (r31, r32, r33) = R
    x, y, z = p[0] - g.d6 * r13, p[1] - g.d6 * r23, p[2] - g.d6 * r33
    radius = math.hypot(x, y)
    if not abs(g.d4) <= radius * (1.0 + _ROUNDING):  # not a number is no pose either
        return
    swing = math.asin(max(-1.0, min(1.0, g.s1 * g.d4 / radius)))
    azimuth = math.atan2(y, x)
    for f1 in (azimuth + swing, azimuth + math.pi - swing):
        c1, s1 = math.cos(f1), math.sin(f1)
        ax, ay = g.s1 * s1, -g.s1 * c1
        wx, wy, wz = r11 * ax + r21 * ay, r12 * ax + r22 * ay, r13 * ax + r23 * ay
        sine = math.hypot(wx, wy)
        outward = x * c1 + y * s1
        for sign in (1.0, -1.0):
            f5 = math.atan2(sign * sine, -g.s4 * g.s5 * wz)
            flip = g.s4 * sign
            f6 = math.atan2(-wy * flip, wx * flip) if sine >= IN_LINE else sixth
            c5, s5 = math.cos(f5), math.sin(f5)
            i, j, k = c5 * math.cos(f6), -c5 * math.sin(f6), g.s5 * s5
            along = (r11 * i + r12 * j + r13 * k) * c1 + (r21 * i + r22 * j + r23 * k) * s1
            total = math.atan2(g.s1 * (r31 * i + r32 * j + r33 * k), along)
            u = outward - g.d5 * g.s4 * math.sin(total)
            v = g.s1 * (z - g.d1) + g.d5 * g.s4 * math.cos(total)
            cosine = (u * u + v * v - g.a2 * g.a2 - g.a3 * g.a3) / (2.0 * g.a2 * g.a3)
            if not abs(cosine) <= 1.0 + _ROUNDING:
                continue
            bend = math.acos(max(-1.0, min(1.0, cosine)))
            for f3 in (bend, -bend):
                f2 = math.atan2(v, u) - math.atan2(g.a3 * math.sin(f3), g.a2 + g.a3 * math.cos(f3))
                yield f1, f2, f3, total - f2 - f3, f5, f6


def why_not(arm: Arm, flange: Pose) -> str:
    """Say why a pose that has no solution is out of reach."""
    if not (np.isfinite(flange.position).all() and np.isfinite(flange.rotation).all()):
        return "out of reach: the pose is not a number"
    missing = float(solve(arm, flange.position, flange.rotation)[1].min())
    return f"out of reach: the {arm.name} misses the pose by {missing:.2f} mm"


def singularity(arm: Arm, q: Floats) -> Floats:
    """How far joint angles are from each of `SINGULARITIES`; their product is that of det J.

    ``|det J| = a2 a3 (a2 + a3) · shoulder · elbow · wrist``.

    Parameters
    ----------
    arm : Arm
    q : array, shape (..., 6)
        rad.

    Returns
    -------
    array, shape (..., 3)
        0 in the singularity: the distance of the wrist's centre from the plane through axis 1
        along axis 2, over a2 + a3; ``|sin φ3|``; ``|sin φ5|``.
    """
    g = _geometry(arm)
    phi = np.asarray(q, dtype=float) + arm.offset
    second, bent = phi[..., 1], phi[..., 1] + phi[..., 2]
    plane = (
        g.a2 * np.cos(second) + g.a3 * np.cos(bent) + g.d5 * g.s4 * np.sin(bent + phi[..., 3])
    ) / (g.a2 + g.a3)
    measure: Floats = np.abs(np.stack([plane, np.sin(phi[..., 2]), np.sin(phi[..., 4])], axis=-1))
    return measure


def _unit_range(cosine: Floats) -> Floats:
    """Clip what is beyond ±1 by rounding; NaN beyond that."""
    clipped: Floats = np.where(
        np.abs(cosine) <= 1.0 + _ROUNDING, np.clip(cosine, -1.0, 1.0), np.nan
    )
    return clipped


def _wrapped(angles: Floats) -> Floats:
    """Angles in (-π, π]."""
    return np.pi - (np.pi - angles) % _TURN
