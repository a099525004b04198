"""The servo loop of `execute`: one set-point per period, at absolute deadlines.

The plan never jumps: every step between two set-points is one that the pre-flight checks have seen,
however late the loop is. Every cycle is logged, the last one too.
"""

from collections.abc import Callable, Sequence

from dmpcli.control.cycle import Cycle, ReadyArm, StopLimits
from dmpcli.control.force_tracking import ForceInput
from dmpcli.control.plan_loop import DONE, Outcome, PlanLoop
from dmpcli.control.step_limits import StepLimits
from dmpcli.errors import DmpError, RefusedError
from dmpcli.planning.limits import Limits
from dmpcli.planning.plan import Plan, Pose

__all__ = ["DONE", "Outcome", "ReadyArm", "ServoLoop", "StopLimits"]


class ServoLoop(PlanLoop):
    """Streams one plan after the other.

    Parameters
    ----------
    plan, watch, arm
        As in `PlanLoop`.
    limits : Limits
        For the deceleration, and for every set-point that is sent.
    touch : ForceInput, optional
    hindrance : callable, optional
        What it returns decelerates the arm and is what the run ends with.
    then : sequence of Plan
    """

    def __init__(
        self,
        plan: Plan,
        limits: Limits,
        watch: StopLimits,
        arm: ReadyArm,
        touch: ForceInput | None = None,
        hindrance: Callable[[], DmpError | None] = lambda: None,
        then: Sequence[Plan] = (),
    ) -> None:
        super().__init__(plan, limits, watch, arm, touch, hindrance, then, streams=True)
        self._steps = StepLimits(limits, plan.period)

    def _brake(self) -> None:
        """Decelerate along the path from now on, if any of it is left."""
        if self._then or not self._cursor.finished:
            self._cursor.brake()

    def _check(self, cycle: Cycle) -> None:
        super()._check(cycle)
        if self.pressing is not None and self._cursor.waiting and self.pressing.given_up:
            raise RefusedError(f"{self.pressing.given_up}; check surface and sensor")

    def _setpoint(self, cycle: Cycle) -> Pose:
        pressing, cursor = self.pressing, self._cursor
        if pressing is not None and cursor.waiting and pressing.settled:
            cursor.release()
        index = cursor.index
        position, rotation = self.plan.at(index)
        if pressing is not None and index > self.plan.last:
            position = position + pressing.leave(index)
        elif pressing is not None and index >= self.plan.lead:
            if cycle.wrench is None or cursor.braking:
                position = position + pressing.hold(index)
            else:
                position = position + pressing.displace(index, cycle.wrench)
        self._steps.check(self._last, position, rotation)
        return position, rotation
