"""Where on the plan the stream is: approach, press, stroke, and the stop at its end or before."""

import numpy as np

from dmpcli.planning import deceleration
from dmpcli.planning.limits import Limits
from dmpcli.planning.plan import Phase, Plan


class PlanCursor:
    """A set-point's number that runs along a plan, and can be brought to rest on it.

    Parameters
    ----------
    plan : Plan
    limits : Limits
        For the deceleration.
    wait : bool
        Hold at the stroke's start until `release`, as a force coupling does to find its contact.

    Attributes
    ----------
    index : float
        Number of the set-point; between two while it decelerates.
    """

    def __init__(self, plan: Plan, limits: Limits, wait: bool = False) -> None:
        self.plan = plan
        self.index = 0.0
        self._limits = limits
        self._waits = wait
        self._end = float(len(plan) - 1)
        self._brake: tuple[float, float] | None = None  # index where it began, duration
        self._elapsed = 0.0
        plan.sizes  # noqa: B018  # kept: they are asked for when it has to come to rest

    @property
    def braking(self) -> bool:
        """Coming to rest because it was asked to."""
        return self._brake is not None

    @property
    def waiting(self) -> bool:
        """Holding at the stroke's start."""
        return self._waits and self._brake is None and self.index == self.plan.lead

    @property
    def finished(self) -> bool:
        """At rest: at the end, or where the deceleration ended."""
        if self._brake is not None:
            return self._elapsed >= self._brake[1]
        return self.index >= self._end and not self.waiting

    @property
    def phase(self) -> Phase:
        """What this set-point belongs to."""
        if self._brake is not None or (self.index >= self._end and self._elapsed > 0):
            return "stop"
        return "approach" if self.waiting else self.plan.phase_at(self.index)

    def follow(self, plan: Plan) -> None:
        """Go on along a plan that is the same up to here, whose end has moved."""
        self.plan, self._end = plan, float(len(plan) - 1)

    def release(self) -> None:
        """Go on from the stroke's start."""
        self._waits = False

    def advance(self) -> None:
        """Go on by one set-point, however late the loop is: each step is one that was checked."""
        if self._brake is not None:
            begun, duration = self._brake
            self._elapsed += self.plan.period
            spent = deceleration.progress(self._elapsed, duration) if duration else 0.0
            self.index = min(begun + spent / self.plan.period, self._end)
        elif self.index >= self._end and not self.waiting:
            self._elapsed += self.plan.period
        elif not self.waiting:
            self.index = min(self.index + 1.0, self._end)

    def brake(self) -> None:
        """Decelerate to rest along the path, from now on; the first call counts."""
        if self._brake is None:
            moving = not self.waiting and self.index < self._end
            self._brake = (self.index, self._stopping_time() if moving else 0.0)
            self._elapsed = 0.0

    def _stopping_time(self) -> float:
        """Duration of the ramp: for all that lies ahead, then for what it really runs over."""
        duration = self._ramp(len(self.plan))
        return self._ramp(int(np.ceil(self.index + duration / 2.0 / self.plan.period)) + 1)

    def _ramp(self, last: int) -> float:
        ahead = slice(max(int(self.index) - 1, 0), last + 1)
        speeds, accelerations, _ = self.plan.sizes
        speed = np.max(speeds[ahead], axis=0)
        acceleration = np.max(accelerations[ahead], axis=0)
        limits = self._limits
        return max(
            deceleration.duration(speed[0], acceleration[0], limits.acceleration, limits.jerk),
            deceleration.duration(
                speed[1], acceleration[1], limits.rotation_acceleration, limits.rotation_jerk
            ),
        )
