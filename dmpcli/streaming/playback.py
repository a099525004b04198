"""The other way to execute: the controller plays the plan by itself, and the loop looks on.

Every set-point is handed over before anything moves. From then on the controller keeps the time:
nothing of ours can be late for it, and nothing can be corrected. Each cycle still reads the arm,
checks it against the plan in time, against limits and forces, and logs a row; a reason to stop is a
stop by the controller, at once, for there is no braking along a path that it holds.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import DmpError, InputError
from dmpcli.instruments import guards
from dmpcli.instruments.guards import Trail
from dmpcli.instruments.interruption import Interruption
from dmpcli.instruments.protocols import PlanPlayer, RobotState
from dmpcli.streaming.contact import Touch
from dmpcli.streaming.limits import Limits
from dmpcli.streaming.loop import Arm, Cycle, Loop, StoppedAtOnce, Watch
from dmpcli.streaming.plan import Plan

# The controller's clock may run so far ahead of ours by the end of a plan, s.
_AHEAD = 0.1


class Playback(Loop):
    """Has one plan after the other played.

    Parameters
    ----------
    plan, limits, watch, touch, hindrance, then
        As in `Loop`; without a force coupling.
    arm : Arm
        Its servo is a `PlanPlayer`.

    Raises
    ------
    InputError
        There is a force coupling.
    """

    def __init__(
        self,
        plan: Plan,
        limits: Limits,
        watch: Watch,
        arm: Arm,
        touch: Touch | None = None,
        hindrance: Callable[[], DmpError | None] = lambda: None,
        then: Sequence[Plan] = (),
    ) -> None:
        if touch is not None and touch.pressing is not None:
            raise InputError(
                "--coupling force: corrects each set-point as it is sent, and this robot plays the "
                "whole plan by itself; leave mode=file out of --robot"
            )
        super().__init__(plan, limits, watch, arm, touch, hindrance, then)
        info = replace(arm.info, lookahead=arm.info.lookahead + _AHEAD)
        self._course = Trail(info, plan.period, watch.following_error, watch.following_angle)
        self._ahead = round(_AHEAD / plan.period)
        for number in range(self._ahead + 1):
            self._course.add(*plan.at(min(number, len(plan) - 1)))

    def _enter(self, interruption: Interruption) -> None:
        """Hand every plan over, then begin, unless something has come up meanwhile."""
        servo, plans = self._arm.servo, [self.plan, *self._then]
        assert isinstance(servo, PlanPlayer)

        def meanwhile() -> None:
            self._heed(interruption)
            if self._touch is not None:
                self._touch.sensing.hear(self._arm.clock.now())

        position = np.concatenate([plan.position for plan in plans])
        rotation = np.concatenate([plan.rotation for plan in plans])
        meanwhile()
        servo.upload(position, rotation, self.plan.period, meanwhile)
        super()._enter(interruption)
        meanwhile()
        servo.play()

    def _wait(self, begin: float, number: int) -> Cycle:
        """Wait for a deadline, and go on in the plan to where it is by then, as the arm has."""
        cycle = super()._wait(begin, number)
        for _ in range(cycle.missed + (0 if self._trail.last is None else 1)):
            super()._advance()
            self._look_ahead()
        late = cycle.late - cycle.missed * self.plan.period
        return replace(cycle, due=cycle.due + cycle.late - late, late=late)

    def _advance(self) -> None:
        """Nothing: it was done on waking."""

    def _look_ahead(self) -> None:
        self._course.add(*self.plan.at(min(self._cursor.index + self._ahead, len(self.plan) - 1)))

    def _check(self, cycle: Cycle, state: RobotState) -> None:  # noqa: ARG002
        """Stop at once where the arm must not go on."""
        guards.check_state(state, self._limits.workspace)
        self._course.check(state)

    def _check_setpoint(self, position: Floats, rotation: Floats) -> None:
        """Nothing: every set-point was checked before it was handed over."""

    def _send(self, position: Floats, rotation: Floats) -> bool:  # noqa: ARG002
        """Nothing: every set-point was handed over before the start."""
        return True

    def _brake(self) -> None:
        """Leave the stop to the controller."""
        raise self._hindrance() or StoppedAtOnce("stopped by the controller")
