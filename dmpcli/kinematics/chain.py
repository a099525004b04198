"""From joint angles to the flange: forward kinematics and the geometric Jacobian."""

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.kinematics.models import Arm


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


def jacobian(arm: Arm, q: Floats) -> Floats:
    """Geometric Jacobian of the flange, base axes: velocity and angular velocity per joint speed.

    Column i is ``[z × (p - p_i), z]`` with z and p_i axis and origin of joint i.

    Parameters
    ----------
    arm : Arm
    q : array, shape (..., 6)
        rad.

    Returns
    -------
    array, shape (..., 6, 6)
        Rows 0-2 in mm/rad, rows 3-5 in rad/rad.
    """
    position, rotation = frames(arm, q)
    axis = rotation[..., :6, :, 2]
    lever = position[..., 6:, :] - position[..., :6, :]
    return np.swapaxes(np.concatenate([np.cross(axis, lever), axis], axis=-1), -1, -2)
