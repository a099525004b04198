"""The geometric Jacobian, from the frames of the links."""

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.kinematics import chain
from dmpcli.kinematics.models import Arm


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
    position, rotation = chain.frames(arm, q)
    axis = rotation[..., :6, :, 2]
    lever = position[..., 6:, :] - position[..., :6, :]
    return np.swapaxes(np.concatenate([np.cross(axis, lever), axis], axis=-1), -1, -2)
