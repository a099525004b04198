"""Whether the joint axes of an arm that somebody else describes are those of an `Arm`.

Two chains move their ends alike, up to constant transforms of base and flange, where with all
joints at 0 the axes of one lie as those of the other, moved rigidly (the product of exponentials,
Lynch and Park, Modern Robotics, ch. 4). The directions give the rotation (Kabsch), the distances of
the lines the shift and, where they are free, the lengths a2, a3, d4 and d5: d1 is part of the shift
and d6 of the flange.
"""

from dataclasses import dataclass, replace

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.kinematics.chain import frames
from dmpcli.kinematics.models import Arm
from dmpcli.spatial.pose import Pose

LENGTHS = (("a", 1), ("a", 2), ("d", 3), ("d", 4))
"""What an arm of this family may have otherwise than its maker's table: attribute and index."""

_FINEST = 3  # decimals of a length, mm


@dataclass(frozen=True, eq=False)
class Matched:
    """Where the axes of a description lie best on those of an arm.

    Attributes
    ----------
    arm : Arm
    base : Pose
        Of the arm's base frame in the description's, mm.
    """

    arm: Arm
    base: Pose


def matched(arm: Arm, axis: Floats, point: Floats, free: bool) -> Matched:
    """Lay an arm's axes on those of a description.

    Parameters
    ----------
    arm : Arm
    axis : array, shape (6, 3)
        Unit vectors about which the joints turn, all of them at 0.
    point : array, shape (6, 3)
        A point of each axis, mm.
    free : bool
        Whether the lengths are the description's; else the arm's own.
    """
    link = frames(arm, np.zeros(6))
    own, position = link.rotation[:6, :, 2], link.position[:6]
    U, _, Vt = np.linalg.svd(axis.T @ own)
    R: Floats = U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt
    along = own @ R.T
    # Of the distance between two lines only what is across them counts.
    across = np.eye(3) - along[:, :, None] * along[:, None, :]
    missing = (across @ (point - position @ R.T)[:, :, None]).ravel()
    columns = [across @ np.eye(3)]
    if free:
        grown = [(_lengthened(arm, *length) - position) @ R.T for length in LENGTHS]
        columns.append(across @ np.stack(grown, axis=-1))
    effect = np.concatenate(columns, axis=-1).reshape(18, -1)
    solved = np.linalg.lstsq(effect, missing)[0]
    if free:
        a, d = arm.a.copy(), arm.d.copy()
        for (name, i), more in zip(LENGTHS, solved[3:], strict=True):
            of = a if name == "a" else d
            of[i] = round(float(of[i] + more), _FINEST)
        arm = replace(arm, a=a, d=d)
    return Matched(arm, Pose(np.asarray(solved[:3], dtype=float), R))


def _lengthened(arm: Arm, name: str, index: int) -> Floats:
    """Origins of the joints with one length a millimetre more, shape (6, 3)."""
    a, d = arm.a.copy(), arm.d.copy()
    (a if name == "a" else d)[index] += 1.0
    return frames(replace(arm, a=a, d=d), np.zeros(6)).position[:6]
