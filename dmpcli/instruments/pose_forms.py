"""Poses as controllers write them: in mm or m, rad or deg, and four forms of an orientation."""

from dataclasses import replace

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.instruments.driver_protocol import DriverInfo, Orientation
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.rotations import exp, from_euler, from_quaternion, log, to_euler, to_quaternion

METRE = 1000.0


def decode(declared: DriverInfo, values: Floats) -> Pose:
    """Turn a pose as a controller writes it into mm and a matrix.

    Parameters
    ----------
    declared : DriverInfo
    values : array, shape (6,) or (7,)
        Position first, then the orientation in the declared form.

    Returns
    -------
    Pose
    """
    position = values[:3] * (METRE if declared.length == "m" else 1.0)
    turn = values[3:]
    if declared.orientation == "quaternion":
        return Pose(position, from_quaternion(turn[[1, 2, 3, 0]]))
    angles = np.radians(turn) if declared.angle == "deg" else turn
    if declared.orientation == "rotation vector":
        return Pose(position, exp(angles))
    if declared.orientation == "xyz euler":
        return Pose(position, from_euler(angles))
    # Rz Ry Rx is the inverse of Rx(-rx) Ry(-ry) Rz(-rz).
    return Pose(position, from_euler(-angles).T)


def encode(declared: DriverInfo, pose: Pose) -> Floats:
    """Turn mm and a matrix into a pose as a controller reads it; undoes `decode`.

    Parameters
    ----------
    declared : DriverInfo
    pose : Pose

    Returns
    -------
    array, shape (6,) or (7,)
    """
    length, rotation = pose.position / (METRE if declared.length == "m" else 1.0), pose.rotation
    if declared.orientation == "quaternion":
        return np.concatenate([length, to_quaternion(rotation)[[3, 0, 1, 2]]])
    if declared.orientation == "rotation vector":
        angles = log(rotation)
    elif declared.orientation == "xyz euler":
        angles = to_euler(rotation)
    else:
        angles = -to_euler(rotation.T)
    return np.concatenate([length, np.degrees(angles) if declared.angle == "deg" else angles])


def width(declared: DriverInfo) -> int:
    """Return how many numbers a pose has."""
    return 7 if declared.orientation == "quaternion" else 6


def otherwise(declared: DriverInfo, orientation: Orientation) -> DriverInfo:
    """Return the declaration with another orientation form."""
    return replace(declared, orientation=orientation)
