"""How the simulated EC66 moves: six position servos behind a command that a feed moves along."""

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.kinematics import chain
from dmpcli.kinematics.models import Arm
from dmpcli.spatial.wrench import Tool

LAG = 0.02
"""Time constant of each joint's servo, s; the maker states none."""

Leg: TypeAlias = tuple[Floats, float]
"""Joint angles to go to, shape (6,), rad, and the time to get there, s."""

Feed: TypeAlias = Callable[[Floats], Leg | None]
"""From the joint angles that the command has reached to its next leg; None is to stay there."""


@dataclass(frozen=True)
class Posture:
    """Where an arm is at one instant.

    Attributes
    ----------
    flange_position, flange_rotation : array, shape (3,) and (3, 3)
        Base frame, mm.
    position, rotation : array, shape (3,) and (3, 3)
        TCP, base frame, mm.
    velocity : array, shape (6,)
        Of the TCP, base axes, mm/s and rad/s.
    """

    flange_position: Floats
    flange_rotation: Floats
    position: Floats
    rotation: Floats
    velocity: Floats


class JointArm:
    """An arm in joint space, solved exactly between events.

    The command runs evenly along each leg that the feed hands out; each joint follows it through a
    first-order lag. With the command c and the error e = c - q this is ``e' = c' - e / lag``, as in
    `dmpcli.simulation.mock.arms.ServoArm`.

    Parameters
    ----------
    model : Arm
    tool : Tool
        For the TCP.
    joints : array, shape (6,)
        Where it stands at first, rad.
    lag : float
        s; 0 follows at once.

    Attributes
    ----------
    model : Arm
    tool : Tool
    joints, speeds : array, shape (6,)
        Actual, rad and rad/s.
    command : array, shape (6,)
        What the servos head for, rad.
    feed : callable or None
        Where the next legs come from; None: the arm stays.
    """

    def __init__(self, model: Arm, tool: Tool, joints: Floats, lag: float = LAG) -> None:
        self.model, self.tool = model, tool
        self._lag = lag
        self.joints = np.array(joints, dtype=float)
        self.stand_still()

    def stand_still(self) -> None:
        """Hold the actual joints from now on; nothing is fed any more."""
        self.feed: Feed | None = None
        self.command = self.joints.copy()
        self._error = np.zeros(6)
        self.end_leg()
        self._moved(np.zeros(6))

    def end_leg(self) -> None:
        """End the leg where the command is; the servos still catch up with it."""
        self._left, self._target, self._rate = 0.0, self.command, np.zeros(6)

    @property
    def idle(self) -> bool:
        """Whether the command has reached the end of its leg."""
        return self._left <= 0.0

    def advance(self, dt: float) -> None:
        """Move on by `dt` s."""
        while dt > 0.0:
            if self._left <= 0.0 and not self._begin_leg():
                self._follow(dt, np.zeros(6))
                return
            moving = min(dt, self._left)
            # Within rounding of the leg's end is at its end.
            arrived = self._left - moving < 1e-9
            self._left = 0.0 if arrived else self._left - moving
            self.command = self._target if arrived else self.command + moving * self._rate
            self._follow(moving, self._rate)
            dt -= moving

    def _begin_leg(self) -> bool:
        leg = self.feed(self.command) if self.feed is not None else None
        if leg is None:
            return False
        self._target, self._left = leg
        self._rate = (self._target - self.command) / self._left
        return True

    def _follow(self, dt: float, rate: Floats) -> None:
        """Solve ``e' = rate - e / lag`` over `dt` and read the joints off the command."""
        if self._lag > 0.0:
            settled = self._lag * rate
            self._error = settled + np.exp(-dt / self._lag) * (self._error - settled)
            speeds = self._error / self._lag
        else:
            speeds = rate
        self.joints = self.command - self._error
        self._moved(speeds)

    def _moved(self, speeds: Floats) -> None:
        self.speeds = speeds
        self.__dict__.pop("posture", None)

    @cached_property
    def posture(self) -> Posture:
        """Where flange and TCP are now."""
        reach = self.tool.tcp_position
        flange, velocity = chain.forward_moving(self.model, self.joints, self.speeds, reach)
        p, R = flange.position, flange.rotation
        tip = p + R @ reach
        return Posture(p, R, tip, R @ self.tool.tcp_rotation, velocity)


class FeelingArm(JointArm):
    """An arm whose tool meets the part by a physics of its own."""

    @abstractmethod
    def felt(self) -> Floats:
        """What acts on the tool at the sensor, with its weight: shape (6,), N and N·m."""
