"""Arms by name: Denavit-Hartenberg parameters, joint limits and joint speeds."""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import InputError


@dataclass(frozen=True, eq=False)
class Arm:
    """A serial arm of six turning joints, standard Denavit-Hartenberg.

    Link i is ``Rz(q_i + offset_i) Tz(d_i) Tx(a_i) Rx(alpha_i)``; base to flange.

    Attributes
    ----------
    name : str
    d, a : array, shape (6,)
        mm.
    alpha, offset : array, shape (6,)
        rad; `offset` is what the joint angle lacks to the DH angle.
    limits : array, shape (6, 2)
        Smallest and largest joint angle, rad.
    speeds : array, shape (6,)
        rad/s.
    """

    name: str
    d: Floats
    a: Floats
    alpha: Floats
    offset: Floats
    limits: Floats
    speeds: Floats


# Elite EC66, from the maker's ec66_description.urdf and joint_limits.yaml (Elite-Robots/ROS):
# the DH chain is that URDF with its angles taken as the multiples of 90° that they round. The
# offset of joint 6 gives the flange the URDF's orientation too; position alone leaves it open.
_EC66 = Arm(
    name="ec66",
    d=np.array([96.0, 0.0, 0.0, 122.0, 98.0, 89.0]),
    a=np.array([0.0, 418.0, 398.0, 0.0, 0.0, 0.0]),
    alpha=np.radians([90.0, 0.0, 0.0, -90.0, 90.0, 0.0]),
    offset=np.radians([180.0, 180.0, 0.0, 0.0, 180.0, 180.0]),
    limits=np.radians(np.outer([360.0, 360.0, 160.0, 360.0, 360.0, 360.0], [-1.0, 1.0])),
    speeds=np.radians([150.0, 150.0, 190.0, 260.0, 260.0, 260.0]),
)

# Universal Robots UR5e: the maker's published DH parameters (its support article "DH parameters for
# calculations of kinematics and dynamics"), joint ranges and speeds of its data sheet. Each arm
# leaves the factory with corrections of its own, of a millimetre or so.
_UR5E = Arm(
    name="ur5e",
    d=np.array([162.5, 0.0, 0.0, 133.3, 99.7, 99.6]),
    a=np.array([0.0, -425.0, -392.2, 0.0, 0.0, 0.0]),
    alpha=np.radians([90.0, 0.0, 0.0, 90.0, -90.0, 0.0]),
    offset=np.zeros(6),
    limits=np.radians(np.outer([360.0] * 6, [-1.0, 1.0])),
    speeds=np.radians([180.0] * 6),
)

_MODELS = {arm.name: arm for arm in (_EC66, _UR5E)}


def names() -> list[str]:
    """Return the names that `model` knows."""
    return sorted(_MODELS)


def model(name: str) -> Arm:
    """Return an arm by its name.

    Raises
    ------
    InputError
        No such arm.
    """
    if name not in _MODELS:
        raise InputError(f"robot model {name!r}: not known; there is {', '.join(names())}")
    return _MODELS[name]
