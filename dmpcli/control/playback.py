"""The other way to execute: the controller plays the plan by itself, and the loop looks on.

Every set-point is handed over before anything moves. From then on the controller keeps the time:
nothing of ours can be late for it, and nothing can be corrected. Each cycle still reads the arm,
checks it against the plan in time, against limits and forces, and logs a row; a reason to stop is a
stop by the controller, at once, for there is no braking along a path that it holds.
"""

from dataclasses import replace

import numpy as np

from dmpcli.control.cycle import Cycle, StoppedAtOnce
from dmpcli.control.guards import LAG, FollowingErrorMonitor
from dmpcli.control.servo_loop import PlanLoop
from dmpcli.instruments.protocols import PlanPlayer
from dmpcli.spatial.pose import Pose

# The controller's clock may run so far ahead of ours by the end of a plan, s.
_AHEAD = 0.1


class Playback(PlanLoop):
    """Has the controller play, whose servo is a `PlanPlayer`; there is no force coupling."""

    STREAMS = False
    PATIENCE = LAG + _AHEAD

    def _enter(self) -> None:
        """Hand every plan over, then begin, unless something has come up meanwhile."""
        servo, plans = self._arm.servo, [self.plan, *self._then]
        assert isinstance(servo, PlanPlayer)
        # What the arm must stay near: where the plan is in time, and a little ahead.
        info, watch = self._arm.info, self._watch
        info = replace(info, lookahead=info.lookahead + _AHEAD)
        self._trail = FollowingErrorMonitor(
            info, self._period, watch.following_error, watch.following_angle
        )
        self._ahead = round(_AHEAD / self._period)
        for number in range(self._ahead + 1):
            self._trail.add(self.plan.at(min(number, len(self.plan) - 1)))
        position = np.concatenate([plan.position for plan in plans])
        rotation = np.concatenate([plan.rotation for plan in plans])
        self._meanwhile()
        servo.upload(position, rotation, self._period, self._meanwhile)
        super()._enter()
        self._meanwhile()
        servo.play()

    def _meanwhile(self) -> None:
        self._heed()
        if self._touch is not None:
            self._touch.sensing.hear(self._arm.clock.now())

    def _wake(self, number: int) -> Cycle:
        """Wait for a deadline, and go on in the plan to where it is by then, as the arm has."""
        cycle = super()._wake(number)
        for _ in range(cycle.missed):
            self._advance()
        return cycle

    def _advance(self) -> None:
        super()._advance()
        self._trail.add(self.plan.at(min(self._cursor.index + self._ahead, len(self.plan) - 1)))

    def _setpoint(self, cycle: Cycle) -> Pose:  # noqa: ARG002
        """Where the plan is now; it was checked before it was handed over."""
        return self.plan.at(self._cursor.index)

    def _brake(self) -> None:
        """Leave the stop to the controller."""
        raise self._hindrance() or StoppedAtOnce("stopped by the controller")
