"""The servo loop of `execute`: one set-point per period, at absolute deadlines.

Deadline k is ``begin + k·period``. A late cycle never makes up by a burst: what it missed is
skipped, so that a set-point's number stays its time. Every cycle is logged, the last one too.
"""

import signal
from collections import deque
from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import DmpError, InstrumentError, RefusedError
from dmpcli.instruments.protocols import Clock, RobotState, Servo, ServoInfo
from dmpcli.streaming.contact import Touch
from dmpcli.streaming.cursor import Cursor
from dmpcli.streaming.interruption import Interruption
from dmpcli.streaming.limits import Limits
from dmpcli.streaming.plan import Plan, gap
from dmpcli.streaming.run_file import Log, Row

DONE = "done"
# At rest is what moves less than so many mm and rad in this time, s; it is waited for so long, s.
_REST_WINDOW, _REST_DISTANCE, _REST_ANGLE, _REST_PATIENCE = 0.05, 0.02, 0.001, 2.0
# The actual pose may lag the set-points by this much more than the look-ahead, s.
_LAG = 0.1


@dataclass(frozen=True)
class Arm:
    """A robot that stands ready, and the clock it runs on."""

    servo: Servo
    info: ServoInfo
    clock: Clock


@dataclass(frozen=True)
class Watch:
    """When the loop stops by itself.

    Attributes
    ----------
    following_error, following_angle : float
        Distance of the actual pose from the set-points just sent, mm and rad.
    force : float
        On the tool, N.
    """

    following_error: float
    following_angle: float
    force: float


@dataclass(frozen=True)
class Outcome:
    """How a run ended.

    Attributes
    ----------
    reason : str
        `DONE`, or why it stopped early.
    error : type of DmpError, or None
        Whose exit code it earns.
    signal : int or None
        The signal that stopped it.
    missed : int
        Set-points that were skipped because the loop was late.
    """

    reason: str
    error: type[DmpError] | None = None
    signal: int | None = None
    missed: int = 0


@dataclass(frozen=True)
class _Cycle:
    """One period: its number, when it was due, how late the loop woke, and what it skipped."""

    number: int
    due: float
    late: float
    skipped: int


class _Halt(Exception):  # noqa: N818
    def __init__(self, reason: str, error: type[DmpError] | None) -> None:
        super().__init__(reason)
        self.reason = reason
        self.error = error


def _not_ready(mode: str) -> _Halt:
    return _Halt(f"robot: {mode}; clear it on the pendant", RefusedError)


class Loop:
    """Streams one plan.

    Parameters
    ----------
    plan : Plan
        Checked.
    limits : Limits
        For the deceleration.
    watch : Watch
    arm : Arm
        Not yet in servo mode.
    touch : Touch, optional
        A sensor and, where asked, the force coupling.

    Attributes
    ----------
    plan : Plan
    log : Log
        One row per cycle; it is there whatever goes wrong.
    """

    def __init__(
        self,
        plan: Plan,
        limits: Limits,
        watch: Watch,
        arm: Arm,
        touch: Touch | None = None,
    ) -> None:
        self.plan = plan
        self.log = Log()
        self._watch = watch
        self._arm = arm
        self._sensing = touch.sensing if touch else None
        self._pressing = touch.pressing if touch else None
        self._cursor = Cursor(plan, limits, wait=self._pressing is not None)
        # At least a period: an arm that takes set-points at once has no look-ahead.
        self._late_limit = max(arm.info.lookahead / 2.0, plan.period)
        self._missed = 0
        window = int(np.ceil((arm.info.lookahead + _LAG) / plan.period)) + 1
        self._sent: deque[tuple[Floats, Floats]] = deque(maxlen=window)
        self._states: deque[RobotState] = deque()
        self._finished: float | None = None

    @property
    def senses(self) -> bool:
        """Whether there is a force sensor."""
        return self._sensing is not None

    @property
    def presses(self) -> bool:
        """Whether the force coupling is on."""
        return self._pressing is not None

    def run(self, interruption: Interruption) -> Outcome:
        """Stream until the arm rests at the end, or a reason to stop; the arm is stopped after.

        Parameters
        ----------
        interruption : Interruption
            The first signal decelerates along the path, the second stops at once.

        Returns
        -------
        Outcome
            Anything that an instrument or a limit can cause; only defects are raised.
        """
        reason: str = DONE
        error: type[DmpError] | None = None
        try:
            try:
                self._arm.servo.start(self.plan.period)
                self._stream(interruption)
            finally:
                # Also on a defect of ours: nothing may leave the arm moving.
                self._arm.servo.stop()
        except _Halt as halt:
            reason, error = halt.reason, halt.error
        except InstrumentError as failure:
            reason, error = str(failure), InstrumentError
        number = interruption.number
        if error is None and number is not None:
            name = signal.Signals(number).name
            how = "decelerated along the path" if reason == DONE else reason
            reason = f"{name}: {how}"
        else:
            number = None
        return Outcome(reason, error, number, self._missed)

    def _stream(self, interruption: Interruption) -> None:
        begin = self._arm.clock.now()
        last, number = 0, 0
        while True:
            cycle = self._wait(begin, number)
            state = self._arm.servo.state()
            wrench = self._sensing.read(state) if self._sensing else None
            self._cursor.advance(cycle.number - last)
            last = cycle.number
            halt = self._fault(cycle, state, wrench, interruption.count)
            if halt is not None:
                self._record(cycle, state, wrench, self._sent[-1] if self._sent else None)
                raise halt
            if interruption.count:
                self._cursor.brake()
            elif self._pressing is not None and self._cursor.waiting and self._pressing.settled:
                self._cursor.release()
            setpoint = self._setpoint(wrench)
            taken = self._arm.servo.send(*setpoint)
            late = max(self._arm.clock.now() - begin - cycle.due, 0.0)
            self._record(cycle, state, wrench, setpoint, late)
            if not taken:
                raise self._refused()
            self._sent.append(setpoint)
            if self._at_rest(state):
                return
            number = cycle.number + 1

    def _wait(self, begin: float, number: int) -> _Cycle:
        period, clock = self.plan.period, self._arm.clock
        clock.sleep_until(begin + number * period)
        late = max(clock.now() - begin - number * period, 0.0)  # rounding may say earlier
        skipped = int(late / period) if late > period else 0
        self._missed += skipped
        number += skipped
        return _Cycle(number, number * period, late - skipped * period, skipped)

    def _fault(
        self, cycle: _Cycle, state: RobotState, wrench: Floats | None, signals: int
    ) -> _Halt | None:
        """Why the arm must stop at once, if it must."""
        late = cycle.late + cycle.skipped * self.plan.period
        distance, angle = self._strayed(state)
        force = 0.0 if wrench is None else float(np.linalg.norm(wrench[:3]))
        pressing = self._pressing if self._cursor.waiting else None
        if signals > 1:
            return _Halt("stopped at once at the second signal", None)
        if state.mode != "ready":
            return _not_ready(state.mode)
        if late > self._late_limit:
            return _Halt(
                f"{1e3 * late:.0f} ms late, over {1e3 * self._late_limit:.0f} ms (half the "
                "robot's look-ahead); use a quieter computer or a longer look-ahead",
                RefusedError,
            )
        if distance > self._watch.following_error or angle > self._watch.following_angle:
            return _Halt(
                f"following error {distance:.2f} mm, {angle:.3f} rad is over "
                f"{self._watch.following_error:g} mm, {self._watch.following_angle:g} rad",
                RefusedError,
            )
        if force > self._watch.force:
            return _Halt(f"force {force:.1f} N is over {self._watch.force:g} N", RefusedError)
        if pressing is not None and pressing.given_up:
            return _Halt(f"{pressing.given_up}; check surface and sensor", RefusedError)
        return None

    def _refused(self) -> _Halt:
        mode = self._arm.servo.state().mode
        if mode != "ready":
            return _not_ready(mode)
        return _Halt("robot: refused a set-point; see its pendant", InstrumentError)

    def _strayed(self, state: RobotState) -> tuple[float, float]:
        """Distance and angle to the nearest of the set-points just sent."""
        if not self._sent:
            return 0.0, 0.0
        positions = np.array([p for p, _ in self._sent])
        traces = np.einsum("nij,ij->n", np.array([R for _, R in self._sent]), state.rotation)
        cosine = np.clip((traces.max() - 1.0) / 2.0, -1.0, 1.0)
        distance = np.linalg.norm(positions - state.position, axis=1).min()
        return float(distance), float(np.arccos(cosine))

    def _setpoint(self, wrench: Floats | None) -> tuple[Floats, Floats]:
        index = self._cursor.index
        position, rotation = self.plan.at(index)
        if self._pressing is not None and wrench is not None and index >= self.plan.lead:
            position = position + self._pressing.displace(index, wrench)
        return position, rotation

    def _at_rest(self, state: RobotState) -> bool:
        """Whether the plan has ended and the arm stands still."""
        self._states.append(state)
        while state.t - self._states[0].t > _REST_WINDOW + self.plan.period / 2.0:
            self._states.popleft()
        if not self._cursor.finished:
            return False
        self._finished = state.t if self._finished is None else self._finished
        waited = state.t - self._finished - self._arm.info.lookahead
        if waited > _REST_PATIENCE:
            raise _Halt("the arm does not come to rest after its last set-point", InstrumentError)
        here = (state.position, state.rotation)
        gaps = np.array([gap((s.position, s.rotation), here) for s in self._states])
        still = bool(np.all(gaps.max(axis=0) <= (_REST_DISTANCE, _REST_ANGLE)))
        return still and waited >= _REST_WINDOW

    def _record(
        self,
        cycle: _Cycle,
        state: RobotState,
        wrench: Floats | None,
        sent: tuple[Floats, Floats] | None,
        lateness: float | None = None,
    ) -> None:
        index = self._cursor.index
        active = self._pressing is not None and index >= self.plan.lead
        self.log.rows.append(
            Row(
                t=cycle.due + cycle.late,
                t_plan=self.plan.time_at(index),
                planned=self.plan.at(index),
                sent=sent or (state.position, state.rotation),
                actual=(state.position, state.rotation),
                deadline=cycle.due,
                lateness=cycle.late if lateness is None else lateness,
                wrench=wrench,
                coupling=self._pressing.e if self._pressing and active else 0.0,
                state=state.mode,
                phase=self._cursor.phase,
            )
        )
