"""The EC66 by another way: the joint origins and axes of the maker's URDF, product of exponentials.

Facts from Elite-Robots/ROS, ec66_description.urdf: xyz in m there, rpy rounded to 4 digits there.
Nothing here is shared with `dmpcli.kinematics`.
"""

import numpy as np
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from dmpcli.arrays import Floats

HALF = np.pi / 2
ORIGINS = (
    ((0, 0, 96), (0, 0, np.pi)),
    ((0, 0, 0), (HALF, -HALF, 0)),
    ((0, 418, 0), (0, 0, HALF)),
    ((398, 0, 122), (0, 0, 0)),
    ((0, 98, 0), (HALF, 0, -np.pi)),
    ((0, -89, 0), (-HALF, 0, np.pi)),
)


def _screws() -> tuple[list[Floats], Floats]:
    """Twists of the joints at q = 0 in the base frame, and the flange's pose there."""
    pose, twists = np.eye(4), []
    for xyz, rpy in ORIGINS:
        step = np.eye(4)
        step[:3, :3], step[:3, 3] = Rotation.from_euler("xyz", rpy).as_matrix(), xyz
        pose = pose @ step
        axis, at = pose[:3, 2], pose[:3, 3]
        twist = np.zeros((4, 4))
        twist[:3, :3] = np.cross(axis, np.eye(3)).T
        twist[:3, 3] = -np.cross(axis, at)
        twists.append(twist)
    return twists, pose


_TWISTS, _HOME = _screws()


def flange(q: Floats) -> tuple[Floats, Floats]:
    """Position, mm, and rotation of the flange at joint angles of shape (6,)."""
    pose = np.eye(4)
    for twist, angle in zip(_TWISTS, q, strict=True):
        pose = pose @ expm(angle * twist)
    pose = pose @ _HOME
    return pose[:3, 3], pose[:3, :3]
