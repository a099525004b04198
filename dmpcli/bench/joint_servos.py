"""Where the servos lead the joints to: set-points, taken up evenly, behind a critically damped lag.

With the command c the reference q obeys ``q'' = w² (c - q) - 2 w q'``, w = 2 / lag, solved exactly:
behind a command that moves evenly it runs at ``c - lag·c'``, from which it differs by e with
``e'' = -w² e - 2 w e'``.
"""

import math
from collections import deque

import numpy as np

from dmpcli.arrays import Floats

_EPS = 1e-9


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
    position, velocity, acceleration : array, shape (6,)
        rad, rad/s and rad/s².
    """

    def __init__(self, joints: Floats, lag: float, delay: float, step: float) -> None:
        self._lag, self._delay, self._step = lag, delay, step
        self._natural = 2.0 / lag
        w, h = self._natural, step
        decay = math.exp(-w * h)
        self._transition = decay * np.array([[1.0 + w * h, h], [-w * w * h, 1.0 - w * h]])
        self._period = step
        self.position = np.array(joints, dtype=float)
        self.stand_still()

    def start(self, period: float) -> None:
        """Take up each set-point within `period` s from now on."""
        self._period = period

    def stand_still(self) -> None:
        """Hold the joints where they are; set-points that are on their way are forgotten."""
        self._command = self._target = self.position.copy()
        self._rate, self._left = np.zeros(6), 0
        self._coming: deque[tuple[float, Floats]] = deque()
        self.velocity, self.acceleration = np.zeros(6), np.zeros(6)

    def send(self, t: float, joints: Floats) -> None:
        """Head for a set-point that has arrived at time `t`, s, once the delay has passed."""
        self._coming.append((t + self._delay, joints.copy()))

    def advance(self, t: float) -> None:
        """Go on by one step of the grid, from time `t`, s."""
        while self._coming and self._coming[0][0] <= t + _EPS:
            self._head_for(self._coming.popleft()[1])
        rate = self._rate
        error = np.array([self.position - self._command + self._lag * rate, self.velocity - rate])
        error = self._transition @ error
        if self._left > 0:
            self._left -= 1
            # At its end the command is the set-point itself, whatever was rounded on the way.
            self._command = self._command + self._step * rate if self._left else self._target
            if not self._left:
                self._rate = np.zeros(6)
        self.position = self._command - self._lag * rate + error[0]
        self.velocity = rate + error[1]
        w = self._natural
        self.acceleration = -w * w * error[0] - 2.0 * w * error[1]

    def _head_for(self, joints: Floats) -> None:
        self._target, self._left = joints, max(round(self._period / self._step), 1)
        self._rate = (joints - self._command) / (self._left * self._step)
