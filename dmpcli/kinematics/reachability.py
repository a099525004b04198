"""Whether an arm can draw strokes: the tool's poses, brought to the flange and followed.

Strokes are poses of the TCP; a stroke without orientation is judged with the tool along the
surface's normal at its start, the TCP's x axis as near as can be to base x.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import RefusedError
from dmpcli.kinematics import chain, inverse, path
from dmpcli.kinematics.models import Arm
from dmpcli.kinematics.path import Followed, Peak
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.rotations import exp, from_euler, smallest_between
from dmpcli.spatial.wrench import Tool

NEAR = 0.1
"""A measure of a singularity below this is worth a word: 6° of joint 3 or 5."""

_DOWN = np.diag([1.0, -1.0, -1.0])
# What joints and TCP of a robot may differ by, mm and rad: the tolerances of a real arm.
_AGREE, _AGREE_ANGLE = 5.0, 0.05


class ToolPath(Protocol):
    """A stroke of a tool: where its TCP is, in mm, and how the tool is held, if that is said."""

    @property
    def position(self) -> Floats:
        """Positions of the TCP, mm, shape (T, 3)."""

    @property
    def euler(self) -> Floats | None:
        """RPY angles (alpha, beta, gamma) of the tool, rad, shape (T, 3); None where unsaid."""

    @property
    def normal(self) -> Floats | None:
        """Unit normals of the surface, shape (T, 3); None where there are none."""


@dataclass(frozen=True)
class Reach:
    """An arm and the tool on its flange.

    Attributes
    ----------
    arm : Arm
    tool : Tool or None
        Without one the flange is the TCP.
    base_turn, flange_turn : float
        By how much the controller's base and flange frames are turned about z against those of the
        model, rad; strokes are in the controller's base frame, the tool is on its flange.
    """

    arm: Arm
    tool: Tool | None = None
    base_turn: float = 0.0
    flange_turn: float = 0.0

    def follow(
        self, position: Floats, rotation: Floats, period: float, start: Floats | None = None
    ) -> Followed:
        """Follow paths of the TCP; see `path.follow`.

        Parameters
        ----------
        position, rotation : array, shape (B, T, 3) and (B, T, 3, 3)
            mm, base frame.
        period : float
            s.
        start : array, shape (6,), optional
            Joint angles at the beginning, rad.
        """
        flange = self._flange(Pose(position, rotation))
        return path.follow(self.arm, flange.position, flange.rotation, period, start)

    def standing(self, joints: Floats | None, tcp: Pose) -> Floats | None:
        """Return the joint angles that a robot tells, once they agree with where its TCP is.

        Parameters
        ----------
        joints : array, shape (6,), or None
            rad.
        tcp : Pose
            Of the TCP.

        Raises
        ------
        RefusedError
            They do not: it is another arm, or another tool is on it.
        """
        if joints is None:
            return None
        away, angle = np.inf, 0.0
        if len(joints) == 6:
            away, angle = self._flange(tcp).apart(chain.forward_one(self.arm, joints))
        if not (away <= _AGREE and angle <= _AGREE_ANGLE):
            raise RefusedError(
                f"robot: by its joints the flange is {away:.1f} mm and {np.degrees(angle):.1f}° "
                f"from where an {self.arm.name} with this tool has it; check --robot-model and "
                "--tool"
            )
        return joints

    def _flange(self, tcp: Pose) -> Pose:
        """Pose of the model's flange, in the model's base frame."""
        at = tcp if self.tool is None else self.tool.flange(tcp)
        base = exp(np.array([0.0, 0.0, self.base_turn]))
        flange = exp(np.array([0.0, 0.0, -self.flange_turn]))
        return Pose(np.matvec(base, at.position), base @ at.rotation @ flange)

    def refusals(self, strokes: Sequence[ToolPath], rate: float) -> list[str]:
        """Say why each stroke cannot be followed, from whatever configuration is best.

        Parameters
        ----------
        strokes : sequence of ToolPath
        rate : float
            Their samples per second, Hz.

        Returns
        -------
        list of str
            Empty where it can.
        """
        said = [""] * len(strokes)
        lengths = np.array([len(stroke.position) for stroke in strokes])
        for length in np.unique(lengths):
            rows = np.flatnonzero(lengths == length)
            alike = [strokes[int(row)] for row in rows]
            position = np.array([stroke.position for stroke in alike])
            rotation = np.array([attitude(stroke) for stroke in alike])
            followed = self.follow(position, rotation, 1.0 / rate)
            for i in np.flatnonzero(~followed.passed):
                said[rows[i]] = self._refusal(followed, int(i), rate)
        return said

    def _refusal(self, followed: Followed, i: int, rate: float) -> str:
        def of(peak: Peak) -> tuple[float, float, str, int]:
            at = f"at t = {peak.sample[i] / rate:.3f} s"
            return float(peak.value[i]), float(peak.limit[i]), at, int(peak.joint[i]) + 1

        if not followed.missing.passed[i]:
            value, _, at, _ = of(followed.missing)
            return f"out of reach: {at} the {self.arm.name} misses the pose by {value:.1f} mm"
        near = "".join(f", {clause}" for clause in singular(followed.nearness[i]))
        if followed.jumps[i]:
            value, _, at, joint = of(followed.leap)
            return f"joint {joint} would jump by {np.degrees(value):.0f}° {at}{near}"
        if not followed.angle.passed[i]:
            value, limit, at, joint = of(followed.angle)
            return (
                f"joint {joint} would turn {np.degrees(value):.1f}° from the middle of its range "
                f"{at}, beyond its {np.degrees(limit):g}°"
            )
        value, limit, at, joint = of(followed.speed)
        longer = np.ceil(100.0 * value / limit) / 100.0
        return (
            f"joint {joint} would turn at {np.degrees(value):.0f}°/s {at}, over its "
            f"{np.degrees(limit):.0f}°/s{near}; {longer:.2f} times the duration would do"
        )


def singular(nearness: Floats) -> list[str]:
    """Name the singularity that is near, as a clause; none where none is.

    Parameters
    ----------
    nearness : array, shape (3,)
        Measures of `inverse.SINGULARITIES`.
    """
    nearest = int(np.argmin(nearness))
    near = nearness[nearest] < NEAR
    return [f"near the {inverse.SINGULARITIES[nearest]} singularity"] if near else []


def attitude(stroke: ToolPath) -> Floats:
    """Rotations of the TCP along a stroke; see above for a stroke without orientation.

    Returns
    -------
    array, shape (T, 3, 3)
    """
    if stroke.euler is not None:
        return from_euler(stroke.euler)
    up = np.array([0.0, 0.0, 1.0])
    normal = up if stroke.normal is None else stroke.normal[0]
    # Against a ceiling the smallest turn is not unique: about base x.
    upward = normal[2] < -1.0 + 1e-6
    held = np.eye(3) if upward else smallest_between(up, normal) @ _DOWN
    return np.broadcast_to(held, (len(stroke.position), 3, 3))
