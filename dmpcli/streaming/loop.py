"""The servo loop of `execute`: one set-point per period, at absolute deadlines.

Deadline k is ``begin + k·period``. The plan never jumps: every step between two set-points is one
that the pre-flight checks have seen. An arm that takes set-points at once gets one in a cycle,
however late it is: the deadlines that were missed are gone, and the plan goes on that much later.
One that queues them has gone on meanwhile, and gets those that it is owed too: else its queue would
stay that much shorter, and run empty in the end. Every cycle is logged, the last one too.
"""

import signal
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from dmpcli.arrays import Floats
from dmpcli.errors import DmpError, InstrumentError, RefusedError
from dmpcli.instruments import guards
from dmpcli.instruments.guards import Trail
from dmpcli.instruments.interruption import Interruption
from dmpcli.instruments.pace import Pace, undisturbed
from dmpcli.instruments.protocols import Clock, RobotState, Servo, ServoInfo
from dmpcli.instruments.rest import Rest
from dmpcli.streaming.contact import Pressing, Touch
from dmpcli.streaming.cursor import Cursor
from dmpcli.streaming.limits import Limits
from dmpcli.streaming.plan import Plan, Pose
from dmpcli.streaming.run_file import Log, Row
from dmpcli.streaming.steps import Steps, check_start

DONE = "done"


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
    force, torque : float
        On the tool, N and N·m.
    """

    following_error: float
    following_angle: float
    force: float
    torque: float


@dataclass(frozen=True)
class Outcome:
    """How a run ended.

    Attributes
    ----------
    reason : str
        `DONE`, or why it stopped early.
    failure : DmpError or None
        What the command shall end with once the run is kept.
    signal : int or None
        The signal that stopped it.
    """

    reason: str
    failure: DmpError | None = None
    signal: int | None = None


@dataclass(frozen=True)
class Cycle:
    """One period: its deadline and the waking, s, how late that was, and the deadlines missed."""

    due: float
    woke: float
    late: float
    missed: int


class StoppedAtOnce(Exception):  # noqa: N818
    """A signal that leaves no time to decelerate along the path; the text says how it ended."""


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
    hindrance : callable, optional
        Read once a cycle; what it returns decelerates the arm and is what the run ends with.
    then : sequence of Plan
        What is streamed after `plan`, each from where the one before it rests.

    Attributes
    ----------
    plan : Plan
        The one that is streamed.
    drawn : list of str
        Ids of the strokes that were drawn to their ends.
    log : Log
        One row per cycle; it is there whatever goes wrong.
    pace : Pace
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
        self.plan = plan
        self.drawn: list[str] = []
        self._then = deque(then)
        self._hindrance = hindrance
        self.pace = Pace()
        self._watch = watch
        self._arm = arm
        self._touch = touch
        self._pressing = touch.pressing if touch else None
        self._limits = limits
        self._cursor = Cursor(plan, limits, wait=self._pressing is not None)
        self.log = Log(plan.oriented, touch is not None, self._pressing is not None)
        self._trail = Trail(arm.info, plan.period, watch.following_error, watch.following_angle)
        self._rest = Rest(arm.info, plan.period)
        self._steps = Steps(limits, plan.period)

    def run(self, interruption: Interruption) -> Outcome:
        """Stream until the arm rests at the end, or a reason to stop; the arm is stopped after.

        Parameters
        ----------
        interruption : Interruption
            The first signal decelerates along the path, the second stops at once.

        Returns
        -------
        Outcome
            Anything that an instrument or a limit can cause; only defects are raised. A signal
            that comes after the last set-point ends no run early, and is not told.
        """
        reason: str = DONE
        failure: DmpError | None = None
        stopping: InstrumentError | None = None
        try:
            self._enter(interruption)
            with undisturbed():
                self._stream(interruption)
            failure = self._hindrance()
        except StoppedAtOnce as stop:
            reason = str(stop)
        except (InstrumentError, RefusedError) as error:
            failure = error
        finally:
            # Also on a defect of ours: nothing may leave the arm moving.
            stopping = guards.leave(self._arm.servo.stop)
        failure = failure or stopping
        number = interruption.number
        if failure is not None:
            return Outcome(str(failure), failure)
        if reason == DONE and not self._cursor.braking:
            number = None
        if number is not None:
            name = signal.Signals(number).name
            reason = f"{name}: {'decelerated along the path' if reason == DONE else reason}"
        return Outcome(reason, None, number)

    @property
    def virtual(self) -> bool:
        """Whether what it feels with belongs to a lab that ``dmpcli simulate`` serves."""
        return self._touch is not None and self._touch.sensing.info.virtual

    @property
    def pressing(self) -> Pressing | None:
        """The force coupling, where there is one."""
        return self._pressing

    def _enter(self, interruption: Interruption) -> None:
        """Enter servo mode, and make sure that the arm still stands where the plan begins."""
        self._heed(interruption)
        self._arm.servo.start(self.plan.period)
        # To start may take seconds.
        self._heed(interruption)
        check_start(self._arm.servo.state(), self.plan, self._limits)

    def _heed(self, interruption: Interruption) -> None:
        """Begin nothing that is not wanted any more."""
        hindrance = self._hindrance()
        if hindrance is not None:
            raise hindrance
        if interruption.count:
            raise StoppedAtOnce("stopped before anything moved")

    def _stream(self, interruption: Interruption) -> None:
        begin = self._arm.clock.now()
        number = 0
        while True:
            cycle = self._wait(begin, number)
            number += 1 + cycle.missed
            state = self._arm.servo.state()
            if self._trail.last is not None:
                self._advance()
            wrench: Floats | None = None
            try:
                self._check(cycle, state)
                wrench = self._feel(state)
                setpoint = self._next(interruption, wrench)
                # What is owed only queues: each set-point waits for a period of its own.
                for _ in range(cycle.missed if self._arm.info.queues else 0):
                    self._sent(setpoint, self._send(*setpoint))
                    self._advance()
                    setpoint = self._next(interruption, wrench)
            except (StoppedAtOnce, DmpError):
                self._record(cycle, state, wrench, self._trail.last)
                raise
            taken = self._send(*setpoint)
            sent = self._arm.clock.now()
            self._record(cycle, state, wrench, setpoint, max(sent - begin - cycle.due, 0.0))
            self._sent(setpoint, taken)
            if self._at_rest(state):
                return
            self.pace.add(begin + cycle.due, cycle.woke, sent, self._arm.clock.now())

    def _next(self, interruption: Interruption, wrench: Floats | None) -> Pose:
        """Return the set-point that is next, checked; a signal brakes, or ends it at once."""
        if interruption.count > 1:
            raise StoppedAtOnce("stopped at once at the second signal")
        if interruption.count or self._hindrance() is not None:
            self._brake()
        elif self._pressing and self._cursor.waiting and self._pressing.settled:
            self._cursor.release()
        setpoint = self._setpoint(wrench)
        self._check_setpoint(*setpoint)
        return setpoint

    def _send(self, position: Floats, rotation: Floats) -> bool:
        return self._arm.servo.send(position, rotation)

    def _sent(self, setpoint: Pose, taken: bool) -> None:
        """Remember what was sent; raise where it was not taken."""
        if not taken:
            guards.check_state(self._arm.servo.state())
            raise InstrumentError("robot: refused a set-point; see its pendant")
        self._trail.add(*setpoint)
        self._count()

    def _advance(self) -> None:
        """Go on by one set-point; after a plan's last one to the first of the next, where it is."""
        if not (self._then and self._cursor.finished) or self._cursor.braking:
            self._cursor.advance()
            return
        self.plan = self._then.popleft()
        if self._pressing is not None:
            self._pressing = self._pressing.on(self.plan)
        self._cursor = Cursor(self.plan, self._limits, wait=self._pressing is not None)

    def _brake(self) -> None:
        """Decelerate along the path from now on, if any of it is left."""
        if self._then or not self._cursor.finished:
            self._cursor.brake()

    def _count(self) -> None:
        """Count the stroke as drawn once the arm has had the time to reach its end, or rests."""
        behind = 0.0 if self._cursor.finished else self._arm.info.lookahead / self.plan.period
        arrived = self._cursor.index >= self.plan.last + behind
        if arrived and self.plan.id not in self.drawn[-1:]:
            self.drawn.append(self.plan.id)

    def _wait(self, begin: float, number: int) -> Cycle:
        period, clock = self.plan.period, self._arm.clock
        clock.sleep_until(begin + number * period)
        woke = clock.now()
        late = max(woke - begin - number * period, 0.0)  # rounding may say earlier
        skipped = int(late / period) if late > period else 0
        self.pace.missed += skipped
        return Cycle(number * period, woke, late, skipped)

    def _check(self, cycle: Cycle, state: RobotState) -> None:
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
            guards.check_wrench(wrench, self._watch.force, self._watch.torque)
        return wrench

    def _setpoint(self, wrench: Floats | None) -> Pose:
        index = self._cursor.index
        position, rotation = self.plan.at(index)
        if self._pressing is not None and index > self.plan.last:
            position = position + self._pressing.leave(index)
        elif self._pressing is not None and index >= self.plan.lead:
            if wrench is None or self._cursor.braking:
                position = position + self._pressing.hold(index)
            else:
                position = position + self._pressing.displace(index, wrench)
        return position, rotation

    def _check_setpoint(self, position: Floats, rotation: Floats) -> None:
        self._steps.check(self._trail.last, position, rotation)

    def _at_rest(self, state: RobotState) -> bool:
        """Whether the last plan has ended, or the brake, and the arm stands still."""
        over = self._cursor.finished and (not self._then or self._cursor.braking)
        return over and self._rest.reached(state)

    def _record(
        self,
        cycle: Cycle,
        state: RobotState,
        wrench: Floats | None,
        sent: Pose | None,
        lateness: float | None = None,
    ) -> None:
        index = self._cursor.index
        draws = self.plan.draws_at(index)
        active = self._pressing is not None and draws
        self.log.add(
            state.t,
            Row(
                # A state is as old as its controller's last report.
                t=cycle.due + cycle.late + (state.t - cycle.woke),
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
                id=self.plan.id if draws else None,
            ),
        )
