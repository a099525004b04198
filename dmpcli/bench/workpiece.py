"""The true surface, as MuJoCo collides it: planes, cylinders and what is put together from blocks.

A workpiece has a frame of its own: z is its normal at its origin, which lies on the surface.
"""

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.spatial.pose import Pose

# Far beyond what an arm reaches, mm.
FAR = 2000.0


def upright() -> Pose:
    """A frame at the base's origin, z up."""
    return Pose(np.zeros(3), np.eye(3))


class Workpiece(Protocol):
    """Something to draw on."""

    @property
    def pose(self) -> Pose:
        """Where its frame lies in the base frame, mm."""

    def geoms(self) -> list[dict[str, str]]:
        """Return the attributes of MuJoCo's geoms, in the workpiece's frame, m."""

    def assets(self) -> list[dict[str, str]]:
        """Return the assets that they name: attributes and, as ``tag``, their kind."""


@dataclass(frozen=True)
class Nothing:
    """An empty bench."""

    pose: Pose = field(default_factory=upright)

    def geoms(self) -> list[dict[str, str]]:
        """There are none."""
        return []

    def assets(self) -> list[dict[str, str]]:
        """There are none."""
        return []


@dataclass(frozen=True)
class Flat(Nothing):
    """An endless plane."""

    def geoms(self) -> list[dict[str, str]]:
        """One plane."""
        return [{"type": "plane", "size": "2 2 0.1"}]


@dataclass(frozen=True)
class Round(Nothing):
    """A cylinder, touched from outside; its axis is the frame's y.

    Attributes
    ----------
    radius : float
        mm.
    """

    radius: float = 60.0

    def geoms(self) -> list[dict[str, str]]:
        """One cylinder."""
        r = self.radius / 1e3
        return [
            {
                "type": "cylinder",
                "size": f"{r:.9g} {FAR / 1e3:.9g}",
                "pos": f"0 0 {-r:.9g}",
                "euler": "1.5707963267948966 0 0",
            }
        ]


def placed(point: Floats, normal: Floats, along: Floats) -> Pose:
    """Return the frame at a point whose z is a normal and whose x is nearest to a direction.

    Parameters
    ----------
    point : array, shape (3,)
        mm.
    normal, along : array, shape (3,)
        Unit vector; any length.
    """
    x = along - (along @ normal) * normal
    x = x / np.linalg.norm(x)
    return Pose(point.copy(), np.column_stack([x, np.cross(normal, x), normal]))


def moved(pose: Pose, offset: float, tilt: float, about: float) -> Pose:
    """Displace a workpiece along its normal, and tilt it about a line in its surface.

    Parameters
    ----------
    pose : Pose
    offset : float
        mm, outwards.
    tilt, about : float
        rad; direction of the line, from the frame's x.
    """
    from dmpcli.spatial.rotations import exp_one

    R = pose.rotation
    axis = R @ np.array([np.cos(about), np.sin(about), 0.0])
    return Pose(pose.position + offset * R[:, 2], exp_one(tilt * axis) @ R)
