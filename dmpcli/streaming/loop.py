"""The servo loop of `execute`: one set-point per period, at absolute deadlines.

Deadline k is ``begin + k·period``. A late cycle never makes up by a burst, and it never jumps: the
deadlines that it missed are gone, and the plan goes on from where it is, that much later, so that
every step between two set-points is one that the pre-flight checks have seen. Every cycle is
logged, the last one too.
"""

import signal
from collections import deque
from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import DmpError, InstrumentError, RefusedError
from dmpcli.instruments import guards
from dmpcli.instruments.guards import Trail
from dmpcli.instruments.interruption import Interruption
from dmpcli.instruments.protocols import Clock, RobotState, Servo, ServoInfo
from dmpcli.streaming.contact import Touch
from dmpcli.streaming.cursor import Cursor
from dmpcli.streaming.limits import Limits
from dmpcli.streaming.plan import Plan, gap
from dmpcli.streaming.run_file import Log, Row

DONE = "done"
# At rest is what moves less than so many mm and rad in this time, s; it is waited for so long, s.
_REST_WINDOW, _REST_DISTANCE, _REST_ANGLE, _REST_PATIENCE = 0.05, 0.02, 0.001, 2.0
# Between two checked set-points the brake's curve may be faster than either by this share.
_SLACK = 0.01


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
        Deadlines at which nothing was sent because the loop was late.
    """

    reason: str
    error: type[DmpError] | None = None
    signal: int | None = None
    missed: int = 0


@dataclass(frozen=True)
class _Cycle:
    """One period: its deadline, how late the loop woke, and the number of the next one."""

    due: float
    late: float
    following: int


class _StoppedAtOnce(Exception):  # noqa: N818
    """The second signal."""


class Loop:
    """Streams one plan.

    Parameters
    ----------
    plan : Plan
        Checked.
    limits : Limits
        For the deceleration, and for every set-point that is sent.
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
        self._touch = touch
        self._pressing = touch.pressing if touch else None
        self._limits = limits
        self._cursor = Cursor(plan, limits, wait=self._pressing is not None)
        self._missed = 0
        self._trail = Trail(arm.info, plan.period, watch.following_error, watch.following_angle)
        self._states: deque[RobotState] = deque()
        self._finished: float | None = None

    @property
    def senses(self) -> bool:
        """Whether there is a force sensor."""
        return self._touch is not None

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
        failure: DmpError | None = None
        stopping: InstrumentError | None = None
        try:
            self._arm.servo.start(self.plan.period)
            self._stream(interruption)
        except _StoppedAtOnce:
            reason = "stopped at once at the second signal"
        except (InstrumentError, RefusedError) as error:
            failure = error
        finally:
            # Also on a defect of ours: nothing may leave the arm moving.
            stopping = guards.leave(self._arm.servo.stop)
        failure = failure or stopping
        number = interruption.number
        if failure is not None:
            return Outcome(str(failure), type(failure), None, self._missed)
        if number is not None:
            name = signal.Signals(number).name
            reason = f"{name}: {'decelerated along the path' if reason == DONE else reason}"
        return Outcome(reason, None, number, self._missed)

    def _stream(self, interruption: Interruption) -> None:
        begin = self._arm.clock.now()
        number = 0
        while True:
            cycle = self._wait(begin, number)
            number = cycle.following
            state = self._arm.servo.state()
            if self._trail.last is not None:
                self._cursor.advance()
            wrench: Floats | None = None
            try:
                if interruption.count > 1:
                    raise _StoppedAtOnce
                self._check(cycle, state)
                wrench = self._feel(state)
                if interruption.count:
                    self._cursor.brake()
                elif self._pressing and self._cursor.waiting and self._pressing.settled:
                    self._cursor.release()
                setpoint = self._setpoint(wrench)
                self._check_setpoint(*setpoint)
            except (_StoppedAtOnce, DmpError):
                self._record(cycle, state, wrench, self._trail.last)
                raise
            taken = self._arm.servo.send(*setpoint)
            late = max(self._arm.clock.now() - begin - cycle.due, 0.0)
            self._record(cycle, state, wrench, setpoint, late)
            if not taken:
                guards.check_state(self._arm.servo.state())
                raise InstrumentError("robot: refused a set-point; see its pendant")
            self._trail.add(*setpoint)
            if self._at_rest(state):
                return

    def _wait(self, begin: float, number: int) -> _Cycle:
        period, clock = self.plan.period, self._arm.clock
        clock.sleep_until(begin + number * period)
        late = max(clock.now() - begin - number * period, 0.0)  # rounding may say earlier
        skipped = int(late / period) if late > period else 0
        self._missed += skipped
        return _Cycle(number * period, late, number + skipped + 1)

    def _check(self, cycle: _Cycle, state: RobotState) -> None:
        """Stop at once where the arm must not go on."""
        guards.check_state(state, self._limits.workspace)
        guards.check_late(cycle.late, self._arm.info, self.plan.period)
        self._trail.check(state)
        if self._pressing is not None and self._cursor.waiting and self._pressing.given_up:
            raise RefusedError(f"{self._pressing.given_up}; check surface and sensor")

    def _feel(self, state: RobotState) -> Floats | None:
        if self._touch is None:
            return None
        wrench = self._touch.feel(state, self._arm.clock.now())
        if wrench is not None:
            force = float(np.linalg.norm(wrench[:3]))
            if not force <= self._watch.force:
                raise RefusedError(f"force {force:.1f} N is over {self._watch.force:g} N")
        return wrench

    def _setpoint(self, wrench: Floats | None) -> tuple[Floats, Floats]:
        index = self._cursor.index
        position, rotation = self.plan.at(index)
        if self._pressing is not None and index >= self.plan.lead:
            if wrench is None or self._cursor.braking:
                position = position + self._pressing.hold(index)
            else:
                position = position + self._pressing.displace(index, wrench)
        return position, rotation

    def _check_setpoint(self, position: Floats, rotation: Floats) -> None:
        """Stop rather than send what the checks before the motion cannot have seen."""
        guards.check_setpoint(position, rotation, self._limits.workspace)
        if self._trail.last is None:
            return
        distance, angle = gap(self._trail.last, (position, rotation))
        speed, turning = distance / self.plan.period, angle / self.plan.period
        most, most_turning = self._limits.speed, self._limits.rotation_speed
        if not (speed <= (1.0 + _SLACK) * most and turning <= (1.0 + _SLACK) * most_turning):
            raise RefusedError(
                f"the next set-point would take {speed:.4g} mm/s, {turning:.3g} rad/s, over "
                f"{most:g} mm/s, {most_turning:g} rad/s"
            )

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
            raise InstrumentError("the arm does not come to rest after its last set-point")
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
