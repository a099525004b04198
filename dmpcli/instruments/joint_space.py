"""A robot that is driven by its joints: TCP ↔ joint angles, and whether its controller agrees.

The controller's frames may be turned about z against those of the kinematic model (base_turn,
flange_turn of `DriverInfo`); the tool file's flange is the controller's.
"""

from collections.abc import Callable
from itertools import product

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import RefusedError, beside
from dmpcli.instruments import pose_forms
from dmpcli.instruments.driver_protocol import DriverInfo, Orientation
from dmpcli.kinematics import chain, inverse
from dmpcli.kinematics.models import Arm
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.rotations import exp_one, to_euler
from dmpcli.spatial.wrench import Tool

# A step may need a joint speed over its limit by this share: rounding of what was planned.
_SLACK = 0.01
_QUARTERS = (0.0, 0.5 * np.pi, np.pi, -0.5 * np.pi)
_FORMS: tuple[Orientation, ...] = ("xyz euler", "zyx euler", "rotation vector")
# Where the controller's inverse kinematics is tried: so far from the actual TCP, mm and rad.
_TRIALS = (
    ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
    ((10.0, 0.0, 0.0), (0.0, 0.05, 0.0)),
    ((0.0, 10.0, 0.0), (0.0, 0.0, 0.05)),
    ((0.0, 0.0, 10.0), (0.05, 0.0, 0.0)),
)
# Joint angles for one pose that differ by more are another posture of the arm, rad.
_SAME_POSTURE = 0.1


class JointSpace:
    """The kinematics between a controller's joint angles and the tool.

    Parameters
    ----------
    arm : Arm
    declared : DriverInfo
    tool : Tool, optional
        Without one the TCP is the flange.
    """

    def __init__(self, arm: Arm, declared: DriverInfo, tool: Tool | None) -> None:
        self._arm, self._declared = arm, declared
        self._reach = np.zeros(3) if tool is None else tool.tcp_position
        self._attitude = np.eye(3) if tool is None else tool.tcp_rotation
        self._base, self._flange = _about_z(-declared.base_turn), _about_z(declared.flange_turn)

    def tcp(self, joints: Floats) -> Pose:
        """Pose of the TCP in the controller's base frame.

        Parameters
        ----------
        joints : array, shape (6,)
            rad.
        """
        return self._tcp(joints, self._base, self._flange)

    def joints(self, tcp: Pose, before: Floats) -> Floats:
        """Joint angles of a TCP pose, continuous with the last ones.

        Parameters
        ----------
        tcp : Pose
            In the controller's base frame.
        before : array, shape (6,)
            rad.

        Returns
        -------
        array, shape (6,)
            rad.

        Raises
        ------
        RefusedError
            Out of reach, or beyond a joint's limit.
        """
        attitude = tcp.rotation @ self._attitude.T
        position = self._base.T @ (tcp.position - attitude @ self._reach)
        flange = Pose(position, self._base.T @ attitude @ self._flange.T)
        return inverse.nearest(self._arm, flange, before)

    def step(self, tcp: Pose, before: Floats, period: float) -> Floats:
        """Joint angles of a TCP pose that the arm can reach from the last ones within a period.

        Parameters
        ----------
        tcp, before
            As in `joints`.
        period : float
            s.

        Raises
        ------
        RefusedError
            As in `joints`; or a joint would have to turn faster than it can.
        """
        joints = self.joints(tcp, before)
        speed = np.abs(joints - before) / period
        if not (speed <= (1.0 + _SLACK) * self._arm.speeds).all():
            worst = int(np.argmax(speed / self._arm.speeds))
            needed, most = np.degrees(speed[worst]), np.degrees(self._arm.speeds[worst])
            raise RefusedError(
                f"joint {worst + 1} would have to turn at {beside(needed, most, '.0f')}°/s, over "
                f"its {beside(most, needed, '.0f')}°/s: too fast, or too near a singularity"
            )
        return joints

    def check(self, joints: Floats, reported: Floats) -> None:
        """Refuse a robot whose joints put the TCP elsewhere than its controller says it is.

        Parameters
        ----------
        joints : array, shape (6,)
            Actual, rad.
        reported : array, shape (6,) or (7,)
            The controller's TCP, as declared.

        Raises
        ------
        RefusedError
            Names both poses, what would explain the difference, and the option that changes it.
        """
        ours, theirs = self.tcp(joints), pose_forms.decode(self._declared, reported)
        if self._agree(ours, theirs):
            return
        distance, angle = ours.apart(theirs)
        raise RefusedError(
            f"robot: by its joints the TCP is at {_words(ours)}, by its controller at "
            f"{_words(theirs)}: {distance:.1f} mm and {np.degrees(angle):.1f}° apart; "
            f"{self._cause(joints, reported)}{self._remedy}"
        )

    def check_inverse(
        self, joints: Floats, theirs: Callable[[Floats, Floats], Floats | None]
    ) -> None:
        """Refuse a robot whose controller would reach poses near the actual one otherwise than we.

        Parameters
        ----------
        joints : array, shape (6,)
            Actual, rad.
        theirs : callable
            From a TCP pose as declared, and the actual joints in rad, to the controller's joint
            angles in rad; None where it is not to be asked.

        Raises
        ------
        RefusedError
        """
        here = self.tcp(joints)
        for move, turn in _TRIALS:
            turned = exp_one(np.array(turn)) @ here.rotation
            goal = Pose(here.position + np.array(move), turned)
            try:
                ours = self.joints(goal, joints)
            except RefusedError:
                continue  # near the end of the arm's reach; the others will do
            answer = theirs(pose_forms.encode(self._declared, goal), joints)
            if answer is None:
                return
            distance, angle = self.tcp(answer).apart(goal)
            away = float(np.abs(answer - ours).max())
            if not (self._agree(self.tcp(answer), goal) and away <= _SAME_POSTURE):
                raise RefusedError(
                    f"robot: its inverse kinematics and ours differ at {_words(goal)}: by "
                    f"{distance:.1f} mm, {np.degrees(angle):.1f}° and {np.degrees(away):.1f}° in "
                    f"a joint; {self._declared.make} may not be this arm{self._remedy}"
                )

    @property
    def _remedy(self) -> str:
        """What the driver advises, set off from what was said before."""
        advice = self._declared.remedy.lstrip("; ")
        return f"; {advice}" if advice else ""

    def _cause(self, joints: Floats, reported: Floats) -> str:
        """Name what would explain the difference, tried out; else what usually does."""
        ours, theirs = self.tcp(joints), pose_forms.decode(self._declared, reported)
        for form in _FORMS:
            as_form = pose_forms.otherwise(self._declared, form)
            if len(reported) == 6 and self._agree(ours, pose_forms.decode(as_form, reported)):
                return f"its orientation would fit as {form}"
        if self._agree(JointSpace(self._arm, self._declared, None).tcp(joints), theirs):
            return "what it reports is its flange, so it does not know the tool of --tool"
        for base, flange in product(_QUARTERS, _QUARTERS):
            if self._agree(self._tcp(joints, _about_z(-base), _about_z(flange)), theirs):
                turned = f"base_turn={np.degrees(base) % 360:g}&flange_turn="
                return f"it would fit with {turned}{np.degrees(flange) % 360:g}"
        return "its tool is not that of --tool, or its frames or Euler angles differ"

    def _agree(self, one: Pose, other: Pose) -> bool:
        distance, angle = one.apart(other)
        most, most_angle = self._declared.tolerance
        return distance <= most and angle <= most_angle

    def _tcp(self, joints: Floats, base: Floats, flange: Floats) -> Pose:
        end = chain.forward_one(self._arm, joints)
        attitude = base @ end.rotation @ flange
        return Pose(base @ end.position + attitude @ self._reach, attitude @ self._attitude)


def _about_z(angle: float) -> Floats:
    return exp_one(np.array([0.0, 0.0, angle]))


def _words(pose: Pose) -> str:
    x, y, z = pose.position
    a, b, c = np.degrees(to_euler(pose.rotation))
    return f"({x:.1f}, {y:.1f}, {z:.1f}) mm, ({a:.1f}, {b:.1f}, {c:.1f})°"
