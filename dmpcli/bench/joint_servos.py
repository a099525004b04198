"""Where the servos lead the joints to: set-points, taken up evenly, behind a critically damped lag.

With the command c the reference q obeys ``q'' = w² (c - q) - 2 w q'``, w = 2 / lag, solved exactly:
behind a command that moves evenly it runs at ``c - lag·c'``, from which it differs by e with
``e'' = -w² e - 2 w e'``.
"""

import math
from collections import deque
from typing import NamedTuple

import numpy as np

from dmpcli.arrays import Floats

_EPS = 1e-6  # of a step: rounding
_MOST = 256  # steps that are solved at once


class ServoMotion(NamedTuple):
    """Some steps of a reference, each array of shape (n, 6): rad, rad/s, rad/s²."""

    position: Floats
    velocity: Floats
    acceleration: Floats


class JointReference:
    """The reference of six joints, on a grid of time.

    Parameters
    ----------
    joints : array, shape (6,)
        Where they stand, rad.
    lag, delay : float
        s; see `dmpcli.bench.parameters.JointServos`.
    step : float
        Of the grid, s.

    Attributes
    ----------
    position, velocity : array, shape (6,)
        rad and rad/s.
    """

    def __init__(self, joints: Floats, lag: float, delay: float, step: float) -> None:
        self._lag, self._delay, self._step = lag, delay, step
        w = self._natural = 2.0 / lag
        ahead = step * np.arange(1, _MOST + 1)
        decay = np.exp(-w * ahead)
        # Of (e, e') over one step, two steps, ...
        self._transitions = np.empty((_MOST, 2, 2))
        self._transitions[:, 0, 0] = decay * (1.0 + w * ahead)
        self._transitions[:, 0, 1] = decay * ahead
        self._transitions[:, 1, 0] = -decay * w * w * ahead
        self._transitions[:, 1, 1] = decay * (1.0 - w * ahead)
        self._numbers = np.arange(1.0, _MOST + 1.0)[:, None]
        self._period = step
        self.hold(joints)

    def start(self, period: float) -> None:
        """Take up each set-point within `period` s from now on."""
        self._period = period

    def hold(self, joints: Floats) -> None:
        """Stay at joint angles, shape (6,), rad; set-points on their way are forgotten."""
        self.position, self.velocity = np.array(joints, dtype=float), np.zeros(6)
        self._command, self._target = self.position, self.position
        self._rate, self._left = np.zeros(6), 0
        self._coming: deque[tuple[float, Floats]] = deque()

    def send(self, t: float, joints: Floats) -> None:
        """Head for a set-point that has arrived at time `t`, s, once the delay has passed."""
        self._coming.append((t + self._delay, np.array(joints, dtype=float)))

    def lead(self, joints: Floats, duration: float) -> None:
        """Head for joint angles, shape (6,), rad, evenly within `duration` s and at once."""
        self._head_for(np.array(joints, dtype=float), duration)

    def advance(self, t: float, most: int) -> ServoMotion:
        """Go on by some steps of the grid, as far as nothing changes meanwhile.

        Parameters
        ----------
        t : float
            Time at the beginning, s.
        most : int
            How many steps at most, one or more.

        Returns
        -------
        ServoMotion
            At the end of each step.
        """
        while self._coming and self._steps_to(self._coming[0][0] - t) <= 0:
            self._head_for(self._coming.popleft()[1], self._period)
        n = min(most, _MOST)
        if self._left:
            n = min(n, self._left)
        if self._coming:
            n = min(n, self._steps_to(self._coming[0][0] - t))
        rate, w = self._rate, self._natural
        error = np.array([self.position - self._command + self._lag * rate, self.velocity - rate])
        errors = self._transitions[:n] @ error
        commands = self._command + (self._step * self._numbers[:n]) * rate
        motion = ServoMotion(
            commands - self._lag * rate + errors[:, 0],
            rate + errors[:, 1],
            -w * w * errors[:, 0] - 2.0 * w * errors[:, 1],
        )
        self.position, self.velocity = motion.position[-1], motion.velocity[-1]
        self._command = commands[-1]
        if self._left:
            self._left -= n
            if not self._left:
                # At its end the command is the set-point itself, whatever was rounded.
                self._command, self._rate = self._target, np.zeros(6)
        return motion

    def _steps_to(self, wait: float) -> int:
        """Steps that begin before `wait` s have passed."""
        return math.ceil(wait / self._step - _EPS)

    def _head_for(self, joints: Floats, duration: float) -> None:
        self._target, self._left = joints, max(round(duration / self._step), 1)
        self._rate = (joints - self._command) / (self._left * self._step)
