"""What feeds the simulated EC66's command: its look-ahead buffer, or a path known beforehand."""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import RefusedError
from dmpcli.kinematics import chain, inverse
from dmpcli.kinematics.models import Arm
from dmpcli.simulation.elite_server.joint_arm import Leg
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.rotations import exp_one, log_one

Underrun = Literal["hold", "decelerate", "alarm"]
Jump = Literal["alarm", "ignore", "clamp"]

DECELERATION = 4.0
"""Of the command's fastest joint when the buffer runs empty, rad/s²."""

CAPACITY = 1000
"""Points that the buffer holds."""

_ROUNDING = 1e-9
# s between the points of a path that a move is cut into.
_STEP = 0.008


@dataclass(frozen=True)
class Policies:
    """What nobody could tell of the real controller, to be chosen.

    Attributes
    ----------
    underrun : str
        When the look-ahead buffer runs empty: ``hold`` the last point, ``decelerate`` from the last
        speed, or raise an ``alarm``.
    jump : str
        When a point needs more than a joint's speed: raise an ``alarm``, ``ignore`` the point and
        answer false, or ``clamp`` it to what the joint's speed allows.
    """

    underrun: Underrun = "hold"
    jump: Jump = "alarm"


class Transmission:
    """Transparent transmission: points are collected, then taken one every period.

    Motion begins when look-ahead / period points are in, and again so after the buffer ran empty.

    Parameters
    ----------
    lookahead, period : float
        s.
    speeds : array, shape (6,)
        Fastest that the joints turn, rad/s.
    policies : Policies
    alarm : callable
        Raises the controller's alarm with a text; the arm then stands.

    Attributes
    ----------
    needed : int
        Points that must be in before the motion begins.
    """

    def __init__(
        self,
        lookahead: float,
        period: float,
        speeds: Floats,
        policies: Policies,
        alarm: Callable[[str], None],
    ) -> None:
        self.needed = max(math.ceil(lookahead / period - _ROUNDING), 1)
        self._period, self._speeds = period, speeds
        self._policies, self._alarm = policies, alarm
        self._points: deque[Floats] = deque()
        self._running = False
        self._rate = np.zeros(6)

    def __len__(self) -> int:
        return len(self._points)

    @property
    def running(self) -> bool:
        """Whether points are taken: enough came in, and the buffer has not run empty since."""
        return self._running

    def put(self, joints: Floats, command: Floats) -> bool:
        """Take one point, shape (6,), rad; False when it is not taken.

        `command` is where the arm's command is now.
        """
        if len(self._points) >= CAPACITY:
            return False
        before = self._points[-1] if self._points else command
        step, most = joints - before, self._speeds * self._period
        if np.any(np.abs(step) > most * (1.0 + _ROUNDING)):
            if self._policies.jump == "clamp":
                joints = before + np.clip(step, -most, most)
            else:
                if self._policies.jump == "alarm":
                    joint = int(np.argmax(np.abs(step) / most))
                    self._alarm(
                        f"joint {joint + 1}: {math.degrees(abs(step[joint])):.3f} deg within "
                        f"{1e3 * self._period:g} ms is over its speed"
                    )
                return False
        self._points.append(joints)
        return True

    def feed(self, command: Floats) -> Leg | None:
        """Hand out the next leg; see `joint_arm.Feed`."""
        if not self._running:
            if self._rate.any():
                return self._slow_down(command)
            if len(self._points) < self.needed:
                return None
            self._running = True
        if not self._points:
            return self._run_empty(command)
        target = self._points.popleft()
        # After a deceleration the arm may stand further off than one period's way.
        time = max(self._period, float(np.max(np.abs(target - command) / self._speeds)))
        self._rate = (target - command) / time
        return target, time

    def _run_empty(self, command: Floats) -> Leg | None:
        self._running = False
        if self._policies.underrun == "alarm":
            self._alarm("the buffer of transparent transmission ran empty")
        if self._policies.underrun == "decelerate":
            return self._slow_down(command)
        self._rate = np.zeros(6)
        return None

    def _slow_down(self, command: Floats) -> Leg | None:
        """One period at a lower speed, until there is none left."""
        fastest = float(np.abs(self._rate).max())
        left = fastest - DECELERATION * self._period
        if left <= 0.0:
            self._rate = np.zeros(6)
            return None
        self._rate = self._rate * (left / fastest)
        return command + self._rate * self._period, self._period


class JointPath:
    """Joint angles at times that are known before the motion.

    Parameters
    ----------
    times : array, shape (n,)
        s, increasing.
    joints : array, shape (n, 6)
        rad. The command goes straight to the first of them, and then from each to the next.
    speeds : array, shape (6,)
        rad/s; a leg that needs more takes longer.
    """

    def __init__(self, times: Floats, joints: Floats, speeds: Floats) -> None:
        self._joints, self._speeds = joints, speeds
        self._durations = np.diff(times, prepend=times[0])
        self._next = 0

    @property
    def finished(self) -> bool:
        """Whether all of its legs are handed out."""
        return self._next >= len(self._joints)

    def feed(self, command: Floats) -> Leg | None:
        """Hand out the next leg; see `joint_arm.Feed`."""
        if self.finished:
            return None
        target, duration = self._joints[self._next], float(self._durations[self._next])
        self._next += 1
        way = float(np.max(np.abs(target - command) / self._speeds))
        return target, max(duration, way, 1e-6)


def joint_move(start: Floats, goal: Floats, speed: Floats, acceleration: Floats) -> JointPath:
    """Move all joints together from rest to rest, trapezoidal in speed.

    Parameters
    ----------
    start, goal : array, shape (6,)
        rad.
    speed, acceleration : array, shape (6,)
        Of each joint, rad/s and rad/s².
    """
    way = np.abs(goal - start)
    times, share = trapezoid(_slowest(way, speed), _slowest(way, acceleration))
    return JointPath(times, start + share[:, None] * (goal - start), speed)


def line_move(
    arm: Arm, start: Floats, goal: Floats, speed: float, acceleration: float, turning: bool
) -> JointPath:
    """Move the flange straight from one posture to another, from rest to rest.

    Parameters
    ----------
    arm : Arm
    start, goal : array, shape (6,)
        rad.
    speed, acceleration : float
        mm/s and mm/s²; with `turning` rad/s and rad/s².
    turning : bool
        Whether the speed is that of the rotation.

    Raises
    ------
    RefusedError
        A point on the way is out of reach, or there is no motion of the kind that the speed is of.
    """
    ends = chain.forward(arm, np.stack([start, goal]))
    (p0, p1), (R0, R1) = ends.position, ends.rotation
    turn = log_one(R1 @ R0.T)
    size = float(np.linalg.norm(turn if turning else p1 - p0))
    if size < _ROUNDING:
        raise RefusedError("the speed's type does not suit this move")
    times, share = trapezoid(speed / size, acceleration / size)
    joints = [start]
    for s in share[1:]:
        flange = Pose(p0 + s * (p1 - p0), exp_one(s * turn) @ R0)
        joints.append(inverse.nearest(arm, flange, joints[-1]))
    return JointPath(times, np.array(joints), arm.speeds)


def trapezoid(speed: float, acceleration: float) -> tuple[Floats, Floats]:
    """From 0 to 1 with bounded speed and acceleration.

    Parameters
    ----------
    speed, acceleration : float
        1/s and 1/s².

    Returns
    -------
    times, share : array, shape (n,)
        About every 8 ms.
    """
    speed = min(speed, math.sqrt(acceleration))
    ramp = speed / acceleration
    total = 1.0 / speed + ramp
    times = np.linspace(0.0, total, max(math.ceil(total / _STEP), 1) + 1)
    rising = 0.5 * acceleration * np.minimum(times, ramp) ** 2
    even = speed * np.clip(times - ramp, 0.0, max(total - 2.0 * ramp, 0.0))
    rest = np.clip(times - (total - ramp), 0.0, ramp)
    falling = speed * rest - 0.5 * acceleration * rest**2
    return times, rising + even + falling


def _slowest(way: Floats, most: Floats) -> float:
    """The rate, 1/s, at which no joint exceeds what it may."""
    return float(np.min(most / np.maximum(way, 1e-9)))
