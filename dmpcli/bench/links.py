"""What the links of an arm weigh and where: by a table of the makers', or by a description file."""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.kinematics.chain import frames
from dmpcli.kinematics.models import Arm, model
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.rotations import exp_one

# Of the links, kg: of EC66 as in the maker's ec66_description.urdf, of UR5e as in the maker's
# support article on dynamics. Where the mass sits matters little: it is fed forward, and what gives
# way under a load is the stiffness of the joints.
_MASSES = {
    "ec66": (1.783, 4.884, 2.150, 0.534, 0.534, 0.165),
    "ur5e": (3.761, 8.058, 2.846, 1.37, 1.3, 0.365),
}
_THICK = 0.05  # m, radius of a link


@dataclass(frozen=True, eq=False)
class Links:
    """An arm with masses: six links, each in the frame that turns with its joint about z.

    Attributes
    ----------
    arm : Arm
        Its kinematics, as the controller has them.
    mass : array, shape (6,)
        kg.
    centre : array, shape (6, 3)
        Of mass, m.
    inertia : array, shape (6, 3, 3)
        About the centre of mass, kg·m².
    rotors : array, shape (6,), or None
        Inertia of the rotors behind their gears, kg·m². None: that of the bench's servos.
    told : str
        In what its kinematics depart from the published ones; empty where they don't.
    """

    arm: Arm
    mass: Floats
    centre: Floats
    inertia: Floats
    rotors: Floats | None = None
    told: str = ""


def arms() -> list[str]:
    """Return the names of the arms that can stand on the bench."""
    return sorted(_MASSES)


def published(name: str) -> Links:
    """Return an arm by its name: the mass of each link half-way along it, as a rod of 50 mm radius.

    Raises
    ------
    InputError
        No such arm.
    """
    arm = model(name)
    # From the frame that turns with joint i to that in which joint i + 1 turns.
    end = np.column_stack([arm.a, np.zeros(6), arm.d]) / 1e3
    mass = np.array(_MASSES[name])
    length = np.maximum(np.linalg.norm(end, axis=1), _THICK)
    about = mass * (length**2 / 12.0 + _THICK**2 / 4.0)
    return Links(arm, mass, 0.5 * end, about[:, None, None] * np.eye(3))


def turning_frames(arm: Arm) -> Pose:
    """Frames that turn with the joints, where all of them stand at 0.

    Parameters
    ----------
    arm : Arm

    Returns
    -------
    Pose
        Six, in the base frame.
    """
    link = frames(arm, np.zeros(6))
    turned = np.array([exp_one(np.array([0.0, 0.0, offset])) for offset in arm.offset])
    return Pose(link.position[:6], link.rotation[:6] @ turned)
