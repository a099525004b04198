"""One control cycle: wake at a deadline, look at the arm, feel, lead it on, and log.

Deadline k is ``begin + k·period``, whatever came before. A cycle is late by the time from its
deadline to its waking, whether the loop slept or computed too long; one that is late by more than
half the arm's look-ahead, or by more than a period if that is longer, ends the loop. Deadlines that
have passed by the waking are missed: an arm that takes set-points at once gets one in a cycle and
is that much later for good; one that queues them has gone on meanwhile and gets those that it is
owed too, or its queue would run empty in the end. An arm that keeps the time by itself (it plays a
plan, or is dragged by its own teaching) waits for nobody: its cycle is that of the last deadline.

Whatever ends a loop, the arm is stopped and the log is there.
"""

import signal
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf
from typing import Protocol

from dmpcli.arrays import Floats
from dmpcli.control import guards, stopping
from dmpcli.control.arrival import ANGLE, TOLERANCE
from dmpcli.control.guards import FollowingErrorMonitor
from dmpcli.control.loop_timing import LoopTiming, undisturbed
from dmpcli.control.settling import SettlingDetector
from dmpcli.control.signals import Interruption
from dmpcli.control.stopping import AT_REST, StopOutcome
from dmpcli.errors import DmpError, InstrumentError, RefusedError
from dmpcli.instruments.protocols import Clock, RobotState, Servo, ServoInfo
from dmpcli.settings.ranges import Box
from dmpcli.spatial.pose import Pose


@dataclass(frozen=True)
class ReadyArm:
    """A robot that stands ready, and the clock it runs on.

    Attributes
    ----------
    servo : Servo
    info : ServoInfo
    clock : Clock
    joints : int
        How many joint angles its states tell; 0 where none.
    """

    servo: Servo
    info: ServoInfo
    clock: Clock
    joints: int = 0

    def as_told(self) -> "ReadyArm":
        """Return the arm with as many joints as its state tells now."""
        told = self.servo.state().joints
        return replace(self, joints=0 if told is None else len(told))


@dataclass(frozen=True)
class StopLimits:
    """When the loop stops by itself.

    Attributes
    ----------
    following_error, following_angle : float
        Distance of the actual pose from the set-points just sent, mm and rad.
    force, torque : float
        On the tool, N and N·m.
    arrival, arrival_angle : float
        Distance of the arm at rest from the set-point that it was led to last, mm and rad.
    """

    following_error: float
    following_angle: float
    force: float
    torque: float
    arrival: float = TOLERANCE
    arrival_angle: float = ANGLE


class WrenchSource(Protocol):
    """What a loop feels with."""

    def feel(
        self, state: RobotState, now: float, force: float = inf, torque: float = inf
    ) -> Floats | None:
        """Return the wrench on the tool, shape (6,), base axes; None where none is fresh enough.

        Parameters
        ----------
        state : RobotState
            The actual pose turns the sensor's axes into the base's, and tells the tool's weight.
        now : float
            s, on the loop's clock.
        force, torque : float
            Largest that the tool may meet, N and N·m.

        Returns
        -------
        array, shape (6,), or None
            At the TCP, N and N·m.

        Raises
        ------
        InstrumentError
            The sensor is silent, or sends what must not be believed.
        RefusedError
            The tool meets more than `force` or `torque`.
        """


@dataclass
class Cycle:
    """One period.

    Attributes
    ----------
    due : float
        Its deadline, s since the first one.
    woke : float
        s, on the loop's clock.
    late : float
        From the deadline to the waking, s.
    missed : int
        Deadlines that have passed meanwhile, each without a cycle.
    state : RobotState
        Read on waking.
    wrench : array, shape (6,), or None
        What was felt, if anything was.
    """

    due: float
    woke: float
    late: float
    missed: int
    state: RobotState
    wrench: Floats | None = None


@dataclass(frozen=True)
class LoopOutcome:
    """How a loop ended.

    Attributes
    ----------
    reason : str
        How a run ends that nothing stopped, why it was stopped, or what failed.
    failure : DmpError or None
        What went wrong first.
    signal : int or None
        The signal that stopped it.
    stop : StopOutcome
        How the arm was left.
    """

    reason: str
    failure: DmpError | None = None
    signal: int | None = None
    stop: StopOutcome = AT_REST

    def unless(self, failure: DmpError | None) -> "LoopOutcome":
        """Return an outcome with this failure; the first one that came is the one told."""
        if failure is None or self.failure is not None:
            return self
        return replace(self, reason=str(failure), failure=failure, signal=None)

    def error(self, before: str = "", after: str = "") -> DmpError | None:
        """Return what the command ends with once all is kept; None where nothing failed.

        An arm that may still move is told last, and decides the exit code.

        Parameters
        ----------
        before, after : str
            Put around the reason.
        """
        if self.stop.confirmed:
            said = f"{before}{self.reason}{after}"
            return None if self.failure is None else type(self.failure)(said)
        alone = self.reason == str(self.stop)  # nothing else went wrong
        return self.stop.error(after.lstrip("; ") if alone else f"{before}{self.reason}{after}")


class StoppedAtOnce(Exception):  # noqa: N818
    """A signal that leaves no time to come to rest; the text says how it ended."""


class ControlLoop(ABC):
    """What runs one cycle after another.

    Parameters
    ----------
    period : float
        s.
    watch : StopLimits
    workspace : Box or None
        Which the tool must not leave.
    streams : bool
        Whether the arm waits for our set-points; one that keeps the time by itself does not.
    hindrance : callable
        Read once a cycle; what it returns ends the loop.

    Attributes
    ----------
    timing : LoopTiming
    stop_outcome : StopOutcome
        How the arm was left, once it was.
    """

    def __init__(
        self,
        period: float,
        watch: StopLimits,
        workspace: Box | None,
        streams: bool,
        hindrance: Callable[[], DmpError | None],
    ) -> None:
        self.timing = LoopTiming()
        self._period, self._watch, self._workspace = period, watch, workspace
        self._streams, self._hindrance = streams, hindrance
        self._interruption = Interruption()
        self._begin = 0.0
        self._moved = self._rested = False  # servo mode was asked for, and the arm rests in it
        self.stop_outcome = AT_REST
        self._last: Pose | None = None  # what the arm was led to last

    def _take(self, arm: ReadyArm, force: WrenchSource | None) -> None:
        """Take the instruments: an arm that is not yet in servo mode, and what it feels with."""
        self._arm, self._force = arm, force
        watch, self._rest = self._watch, SettlingDetector(arm.info, self._period)
        self._trail = FollowingErrorMonitor(
            arm.info, self._period, watch.following_error, watch.following_angle
        )

    def _run(self) -> tuple[str, DmpError | None]:
        """Run to the end, and stop the arm.

        Returns
        -------
        str
            How a signal ended it at once; empty where none did.
        DmpError or None
            What an instrument or a limit has caused; only defects are raised.

        Raises
        ------
        UnconfirmedStopError
            A defect ended it, and the arm may still move.
        """
        how, failure = "", None
        with stopping.outranking(lambda: self.stop_outcome):
            try:
                self._enter()
                with undisturbed():
                    self._cycles()
                failure = self._hindrance()
            except StoppedAtOnce as stop:
                how = str(stop)
            except (InstrumentError, RefusedError) as error:
                failure = error
            finally:
                # Also on a defect of ours: nothing may leave the arm moving.
                watch = self._moved and not self._rested
                servo, clock = self._arm.servo, self._arm.clock
                self.stop_outcome = stopping.stop(servo, clock, watch, self._leave)
        return how, failure

    def _leave(self) -> None:  # noqa: B027  # most loops switch nothing on
        """Leave what else is on once the arm was told to stop; raises nothing."""

    def _outcome(self, how: str, failure: DmpError | None, ended: str) -> LoopOutcome:
        """Put together how it ended, from what `_run` returns and the end that nothing forced."""
        number, stop = self._interruption.number, self.stop_outcome
        if failure is not None:
            return LoopOutcome(str(failure), failure, stop=stop)
        if number is not None and how:
            reason = f"{signal.Signals(number).name}: {how}"
            failure = None if stop.confirmed else stop.error()
            return LoopOutcome(reason, failure, number, stop)
        if not stop.confirmed:
            return LoopOutcome(str(stop), stop.error(), stop=stop)
        return LoopOutcome(ended)

    def _heed(self) -> None:
        """Begin nothing that is not wanted any more."""
        hindrance = self._hindrance()
        if hindrance is not None:
            raise hindrance
        if self._interruption.count:
            raise StoppedAtOnce("stopped before anything moved")

    def _cycles(self) -> None:
        clock, servo = self._arm.clock, self._arm.servo
        begin, number = clock.now(), 0
        self._begin = begin
        while True:
            cycle = self._wake(number)
            number += 1 + cycle.missed
            try:
                self._check(cycle)
                self._feel(cycle)
                setpoint = self._next(cycle)
                # What is owed only queues: each set-point waits for a period of its own.
                for _ in range(cycle.missed if self._streams and self._arm.info.queues else 0):
                    self._took(setpoint, servo.send(setpoint.position, setpoint.rotation))
                    setpoint = self._next(cycle, owed=True)
            except (StoppedAtOnce, DmpError):
                self._record(cycle, None, None)
                raise
            taken = not self._streams or servo.send(setpoint.position, setpoint.rotation)
            sent = clock.now()
            self._record(cycle, setpoint, max(sent - begin - cycle.due, 0.0))
            self._took(setpoint, taken)
            if not self._goes_on(cycle):
                return
            self.timing.add(begin + cycle.due, cycle.woke, sent, clock.now())

    def _wake(self, number: int) -> Cycle:
        """Wait for a deadline; return the cycle, with what the arm says of itself."""
        clock, period, due = self._arm.clock, self._period, number * self._period
        clock.sleep_until(self._begin + due)
        woke = clock.now()
        late = max(woke - self._begin - due, 0.0)  # rounding may say earlier
        missed = int(late / period) if late > period else 0
        self.timing.missed += missed
        if not self._streams:
            past = late - missed * period
            due, late = due + late - past, past
        return Cycle(due, woke, late, missed, self._arm.servo.state())

    def _check(self, cycle: Cycle) -> None:
        """Stop at once where the arm must not go on."""
        guards.check_state(cycle.state, self._workspace)
        if self._streams:
            guards.check_late(cycle.late, self._arm.info, self._period)
        self._trail.check(cycle.state)

    def _feel(self, cycle: Cycle) -> None:
        if self._force is not None:
            watch, now = self._watch, self._arm.clock.now()
            cycle.wrench = self._force.feel(cycle.state, now, watch.force, watch.torque)

    def _took(self, setpoint: Pose, taken: bool) -> None:
        """Remember what was sent; raise where it was not taken."""
        if not taken:
            # The mode says why, where it can.
            guards.check_state(self._arm.servo.state())
            raise InstrumentError("robot: refused a set-point; see its pendant")
        self._last = setpoint
        if self._streams:
            self._trail.add(setpoint)

    def _start(self) -> None:
        """Let the arm enter servo mode; from now on it may move."""
        self._moved = True
        self._arm.servo.start(self._period)

    @abstractmethod
    def _enter(self) -> None:
        """Enter servo mode, unless something has come up."""

    @abstractmethod
    def _next(self, cycle: Cycle, owed: bool = False) -> Pose:
        """Return the set-point that is next, checked; StoppedAtOnce where a signal allows none.

        Parameters
        ----------
        cycle : Cycle
        owed : bool
            Whether another one was sent in this cycle before.
        """

    @abstractmethod
    def _record(self, cycle: Cycle, setpoint: Pose | None, lateness: float | None) -> None:
        """Log the cycle.

        Parameters
        ----------
        cycle : Cycle
        setpoint : Pose or None
        lateness : float or None
            From the deadline to the set-point's being sent, s; None where the loop stopped before.
        """

    @abstractmethod
    def _goes_on(self, cycle: Cycle) -> bool:
        """Go on by one set-point; False after the last cycle."""
