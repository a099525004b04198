"""From joint angles to the flange: forward kinematics and the geometric Jacobian."""

import math
from functools import lru_cache
from typing import TypeAlias

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.kinematics.models import Arm

# Origin, mm, and axis of a joint.
_Joint: TypeAlias = tuple[float, float, float, float, float, float]


def forward(arm: Arm, q: Floats) -> tuple[Floats, Floats]:
    """Pose of the flange in the base frame.

    Parameters
    ----------
    arm : Arm
    q : array, shape (..., 6)
        Joint angles, rad.

    Returns
    -------
    position : array, shape (..., 3)
        mm.
    rotation : array, shape (..., 3, 3)
    """
    position, rotation = frames(arm, q)
    return position[..., 6, :], rotation[..., 6, :, :]


def forward_one(arm: Arm, q: Floats) -> tuple[Floats, Floats]:
    """`forward` of one set of joint angles, in plain floats: several times faster, for loops.

    Parameters
    ----------
    arm : Arm
    q : array, shape (6,)
        rad.

    Returns
    -------
    position : array, shape (3,)
        mm.
    rotation : array, shape (3, 3)
    """
    position, rotation, _ = _walked(arm, q)
    return position, rotation


def forward_moving(
    arm: Arm, q: Floats, speeds: Floats, tip: Floats
) -> tuple[Floats, Floats, Floats]:
    """`forward_one`, and how a point fixed to the flange moves while the joints turn.

    Parameters
    ----------
    arm : Arm
    q, speeds : array, shape (6,)
        rad, rad/s.
    tip : array, shape (3,)
        The point, mm, flange axes.

    Returns
    -------
    position : array, shape (3,)
        Of the flange, mm.
    rotation : array, shape (3, 3)
    velocity : array, shape (6,)
        Of the point, mm/s, and angular, rad/s; base axes. The sum over the joints of
        ``[z × (p - p_i), z]`` times the joint's speed.
    """
    position, rotation, joints = _walked(arm, q)
    x, y, z = (position + rotation @ tip).tolist()
    vx = vy = vz = wx = wy = wz = 0.0
    for speed, (px, py, pz, zx, zy, zz) in zip(speeds.tolist(), joints, strict=True):
        vx += speed * (zy * (z - pz) - zz * (y - py))
        vy += speed * (zz * (x - px) - zx * (z - pz))
        vz += speed * (zx * (y - py) - zy * (x - px))
        wx, wy, wz = wx + speed * zx, wy + speed * zy, wz + speed * zz
    return position, rotation, np.array([vx, vy, vz, wx, wy, wz])


def _walked(arm: Arm, q: Floats) -> tuple[Floats, Floats, list[_Joint]]:
    """Pose of the flange; origin and axis of each joint that was passed on the way."""
    # Origin and axes of the link frame that has been reached.
    px = py = pz = 0.0
    xx, xy, xz, yx, yy, yz, zx, zy, zz = 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0
    joints: list[_Joint] = []
    for angle, (offset, d, a, ca, sa) in zip(q.tolist(), _links(arm), strict=True):
        joints.append((px, py, pz, zx, zy, zz))
        c, s = math.cos(angle + offset), math.sin(angle + offset)
        ux, uy, uz = c * yx - s * xx, c * yy - s * xy, c * yz - s * xz
        xx, xy, xz = c * xx + s * yx, c * xy + s * yy, c * xz + s * yz
        px, py, pz = px + d * zx + a * xx, py + d * zy + a * xy, pz + d * zz + a * xz
        yx, yy, yz = ca * ux + sa * zx, ca * uy + sa * zy, ca * uz + sa * zz
        zx, zy, zz = ca * zx - sa * ux, ca * zy - sa * uy, ca * zz - sa * uz
    rotation: Floats = np.array([[xx, yx, zx], [xy, yy, zy], [xz, yz, zz]])
    return np.array([px, py, pz]), rotation, joints


@lru_cache
def _links(arm: Arm) -> list[tuple[float, float, float, float, float]]:
    """Offset, d, a, and cosine and sine of alpha, of each link."""
    columns = (arm.offset, arm.d, arm.a, np.cos(arm.alpha), np.sin(arm.alpha))
    return list(zip(*(column.tolist() for column in columns), strict=True))


def frames(arm: Arm, q: Floats) -> tuple[Floats, Floats]:
    """Poses of the base (0) and of the six link frames (1 to 6); joint i turns about z of i - 1.

    Parameters
    ----------
    arm : Arm
    q : array, shape (..., 6)
        rad.

    Returns
    -------
    position : array, shape (..., 7, 3)
        mm.
    rotation : array, shape (..., 7, 3, 3)
    """
    theta = np.asarray(q, dtype=float) + arm.offset
    c, s = np.cos(theta), np.sin(theta)
    ca, sa = np.cos(arm.alpha), np.sin(arm.alpha)
    link = np.zeros((*theta.shape, 3, 3))
    link[..., 0, 0], link[..., 0, 1], link[..., 0, 2] = c, -s * ca, s * sa
    link[..., 1, 0], link[..., 1, 1], link[..., 1, 2] = s, c * ca, -c * sa
    link[..., 2, 1], link[..., 2, 2] = sa, ca
    step = np.stack([arm.a * c, arm.a * s, np.broadcast_to(arm.d, theta.shape)], axis=-1)
    position = np.zeros((*theta.shape[:-1], 7, 3))
    rotation = np.empty((*theta.shape[:-1], 7, 3, 3))
    rotation[..., 0, :, :] = np.eye(3)
    for i in range(6):
        R = rotation[..., i, :, :]
        position[..., i + 1, :] = position[..., i, :] + np.matvec(R, step[..., i, :])
        rotation[..., i + 1, :, :] = R @ link[..., i, :, :]
    return position, rotation
