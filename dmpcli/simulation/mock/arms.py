"""How the simulated arm moves: behind servo set-points, or dragged by its own teaching mode."""

import math
from functools import cached_property

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.simulation.mock.parameters import DragParameters, ServoParameters
from dmpcli.spatial.rotations import exp_one, log_one


class ServoArm:
    """A position servo, solved exactly between events.

    The command runs evenly from one set-point to the next (rotation by slerp), at most at the speed
    limits, and arrives one period after the set-point did; the arm follows the command through a
    first-order lag. With the command c and the error e = c - x this is ``e' = c' - e / lag``.

    Attributes
    ----------
    velocity : array, shape (6,)
        Actual, mm/s and rad/s, base axes.
    """

    def __init__(self, position: Floats, rotation: Floats, servo: ServoParameters) -> None:
        self._servo = servo
        self._period = 0.0
        self._command, self._attitude = position.copy(), rotation.copy()
        self._error = np.zeros(6)
        self.stand_still()

    @property
    def position(self) -> Floats:
        """Actual TCP, shape (3,), mm."""
        return self._command - self._error[:3]

    @cached_property
    def rotation(self) -> Floats:
        """Actual, shape (3, 3); between two events it is read several times, or never."""
        return exp_one(-self._error[3:]) @ self._attitude

    def stand_still(self) -> None:
        """Hold the actual pose from now on."""
        self._command, self._attitude = self.position, self.rotation
        self._target, self._target_attitude = self._command, self._attitude
        self._rate = np.zeros(6)
        self._left = 0.0
        self._settle(np.zeros(6), np.zeros(6))

    def start(self, period: float) -> None:
        """Take one set-point every `period` s from now on."""
        self._period = period

    def send(self, position: Floats, rotation: Floats) -> None:
        """Head for a new set-point."""
        way = np.concatenate([position - self._command, log_one(rotation @ self._attitude.T)])
        self._left = max(
            self._period,
            float(np.sqrt(way[:3] @ way[:3])) / self._servo.speed,
            float(np.sqrt(way[3:] @ way[3:])) / self._servo.turning,
        )
        self._rate = way / self._left
        self._target, self._target_attitude = position.copy(), rotation.copy()

    def advance(self, dt: float) -> None:
        """Move on by `dt` s."""
        if self._left > 0.0:
            moving = min(dt, self._left)
            # Within rounding of the set-point is at the set-point.
            arrived = self._left - moving < 1e-9
            self._left = 0.0 if arrived else self._left - moving
            if arrived:
                self._command, self._attitude = self._target, self._target_attitude
            else:
                self._command = self._command + moving * self._rate[:3]
                self._attitude = exp_one(moving * self._rate[3:]) @ self._attitude
            self._follow(moving, self._rate)
            dt -= moving
        if dt > 0.0:
            self._follow(dt, np.zeros(6))

    def _follow(self, dt: float, rate: Floats) -> None:
        """Solve ``e' = rate - e / lag`` over `dt`."""
        lag = self._servo.lag
        if lag > 0.0:
            settled = lag * rate
            error = settled + math.exp(-dt / lag) * (self._error - settled)
            self._settle(error, error / lag)
        else:
            self._settle(np.zeros(6), rate)

    def _settle(self, error: Floats, velocity: Floats) -> None:
        self._error, self.velocity = error, velocity
        self.__dict__.pop("rotation", None)


class DraggedArm:
    """The robot's own drag teaching: stick and slip on each axis, and the mass behind it.

    Attributes
    ----------
    position, rotation, velocity
        As in `ServoArm`.
    wrench : array, shape (6,)
        What pulls at the TCP, base axes, N and N·m; the lab sets it.
    """

    def __init__(self, position: Floats, rotation: Floats, teaching: DragParameters) -> None:
        self.position = position.copy()
        self.rotation = rotation.copy()
        self.velocity = np.zeros(6)
        self.wrench = np.zeros(6)
        rated = np.array([teaching.rated_force] * 3 + [teaching.rated_torque] * 3)
        self._sliding = teaching.friction * rated
        self._start = teaching.start * rated
        self._stribeck = np.array([teaching.stribeck] * 3 + [teaching.turning_stribeck] * 3)
        self._mass = np.array([teaching.mass] * 3 + [teaching.inertia] * 3)
        self._damping = np.array([teaching.damping] * 3 + [teaching.turning_damping] * 3)

    def stand_still(self) -> None:
        """Lock the brakes."""
        self.velocity = np.zeros(6)
        self.wrench = np.zeros(6)

    def advance(self, dt: float) -> None:
        """Move on by `dt` s under the wrench."""
        v = self.velocity
        at_rest = v == 0.0
        way = np.where(at_rest, np.sign(self.wrench), np.sign(v))
        extra = (self._start - self._sliding) * np.exp(-np.abs(v) / self._stribeck)
        friction = np.where(at_rest, self._sliding, self._sliding + extra)
        after = v + dt / self._mass * (self.wrench - way * friction - self._damping * v)
        # Friction stops a slide, it does not turn it back; then the axis sticks.
        stays = np.where(at_rest, np.abs(self.wrench) <= self._start, after * v < 0.0)
        self.velocity = np.where(stays, 0.0, after)
        self.position = self.position + dt * self.velocity[:3]
        if self.velocity[3:].any():
            self.rotation = exp_one(dt * self.velocity[3:]) @ self.rotation
