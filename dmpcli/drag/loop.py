"""The control loop of ``record``: sensor → compensation → admittance → servo, and the log.

Deadlines are absolute. A controller that queues set-points goes on while a deadline is missed, and
gets those that it is owed with the next one. The loop stops by itself where going on would not be
safe: a silent or saturated sensor, a robot that is not ready, refuses a set-point, does not follow
or leaves the workspace, a loop that is late. Whatever ends it, the arm is stopped and the log is
there.
"""

import math
import signal
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from dmpcli.drag.log import Log
from dmpcli.errors import DmpError, InputError, InstrumentError, RefusedError
from dmpcli.instruments import guards
from dmpcli.instruments.guards import Trail
from dmpcli.instruments.interruption import Interruption
from dmpcli.instruments.pace import Pace, undisturbed
from dmpcli.instruments.protocols import (
    Clock,
    DragTeaching,
    RobotState,
    Sensor,
    SensorInfo,
    Servo,
    ServoInfo,
)
from dmpcli.instruments.rest import Rest
from dmpcli.instruments.sensing import Sensing
from dmpcli.primitives.admittance import Pose, brake, move
from dmpcli.primitives.compensation import Compensation, LowPass, dead_band
from dmpcli.primitives.wrench import Tool
from dmpcli.settings.record import RecordSettings

STILL = 0.5
"""mm: a tool that stays within this of one point is at rest."""

LONGEST_LOOKAHEAD = 0.15
"""s: an arm that lags by more makes the hand and the admittance model swing against each other."""

MOVED = 2.0
"""mm: a tool that has been further than this from where it began has moved."""

DEFECT = "a defect of dmpcli"


@dataclass(frozen=True)
class Ending:
    """Why a recording ended.

    Attributes
    ----------
    reason : str
        ``duration``, ``rest``, ``asked``, the signal that came, or what failed.
    failure : DmpError or None
        What the command shall end with once the recording is kept.
    """

    reason: str
    failure: DmpError | None = None

    def unless(self, failure: DmpError | None) -> "Ending":
        """Return an ending with this failure; the first one that came is the one told."""
        if failure is None or self.failure is not None:
            return self
        return replace(self, reason=str(failure), failure=failure)


class Recorder:
    """One recording.

    Parameters
    ----------
    robot : Servo
    sensor : Sensor
    clock : Clock
    tool : Tool
        Where its zero is None, it is taken at rest before the recording.
    settings : RecordSettings
        Checked.
    longest : float
        The recording ends after this many seconds; infinite is no limit.
    interruption : Interruption, optional
        The first signal brakes and ends the recording, the second stops at once.
    asked_to_end : callable
        Read once a cycle; True ends the recording.
    begin : callable, optional
        Called with the time from which the tool can be dragged, s.
    lead_in : float
        How long it is dragged before the recording begins, s.
    hindrance : callable, optional
        Read once a cycle; what it returns brakes the tool and is what the recording ends with.
    remark : callable, optional
        Told, before anything moves, what is odd about the instruments.

    Attributes
    ----------
    log : Log
        It is there whatever goes wrong.
    pace : Pace
    sensor_info : SensorInfo
        What the sensor said of itself, once `run` has opened it.
    """

    def __init__(
        self,
        robot: Servo,
        sensor: Sensor,
        clock: Clock,
        tool: Tool,
        settings: RecordSettings,
        longest: float = np.inf,
        interruption: Interruption | None = None,
        asked_to_end: Callable[[], bool] = lambda: False,
        begin: Callable[[float], None] = lambda _: None,
        lead_in: float = 0.0,
        hindrance: Callable[[], DmpError | None] = lambda: None,
        remark: Callable[[str], None] = lambda _: None,
    ) -> None:
        self._robot, self._sensor, self._clock = robot, sensor, clock
        self._tool, self._settings = tool, settings
        self._longest, self._asked_to_end, self._begin = longest, asked_to_end, begin
        self._interruption = interruption or Interruption()
        self._lead_in, self._hindrance, self._remark = lead_in, hindrance, remark
        self._law, self._bounds = settings.law, settings.bounds
        self._period = self._law.period
        self._low_pass = LowPass(settings.low_pass, settings.sensor_rate)
        self._wrench = np.zeros(6)
        self.log = Log(referred=settings.drag == "admittance")
        self.pace = Pace()

    def run(self) -> Ending:
        """Record until the end; the instruments are closed after.

        Returns
        -------
        Ending
            A failure while running is in it, not raised, so that `log` can be kept.

        Raises
        ------
        InputError
            A rate does not suit the instruments, or the robot takes no set-points.
        RefusedError
            The robot is not ready.
        InstrumentError
            An instrument cannot be reached or started.
        """
        closing = None
        guards.check_streams(self._robot)
        try:
            servo, info = self._robot.open(), self._sensor.open()
            self.sensor_info = info
            self._check_rates(servo, info)
            if self._settings.drag == "admittance" and servo.lookahead > LONGEST_LOOKAHEAD:
                self._remark(
                    f"robot: lags by its look-ahead of {servo.lookahead:g} s, and above "
                    f"{LONGEST_LOOKAHEAD:g} s the drag swings to and fro; shorten lookahead"
                )
            self._sensor.start(self._settings.sensor_rate)
            state = self._robot.state()
            guards.check_state(state, self._settings.workspace)
            ending = self._drag(state, servo, info)
        finally:
            closing = guards.leave(self._robot.close, self._sensor.close)
        return ending.unless(closing)

    def _check_rates(self, servo: ServoInfo, sensor: SensorInfo) -> None:
        s = self._settings
        guards.check_period(servo, self._period, f"[record] control_rate = {s.control_rate:g} Hz")
        if s.sensor_rate > sensor.rate:
            raise InputError(
                f"[record] sensor_rate = {s.sensor_rate:g} Hz: the {sensor.make} sensor sends at "
                f"most {sensor.rate:g}"
            )
        if s.drag == "builtin" and not isinstance(self._robot, DragTeaching):
            raise InputError("--drag builtin: this robot has no drag teaching of its own")

    def _drag(self, state: RobotState, servo: ServoInfo, info: SensorInfo) -> Ending:
        s = self._settings
        self._sensing = Sensing(self._sensor, info, s.sensor_rate, self._period, self._clock)
        tool = self._sensing.zeroed(self._tool, state.rotation, s.bias_time, s.tool_check)
        self._compensate = Compensation(tool)
        self._servo = servo
        self._trail = Trail(servo, self._period, s.following_error, s.following_angle)
        reason, failure, stopping = DEFECT, None, None
        try:
            with undisturbed():
                reason = self._cycles()
            failure = self._hindrance()
        except (InstrumentError, RefusedError) as error:
            reason, failure = str(error), error
        finally:
            # Also on a defect of ours: nothing may leave the arm moving.
            stopping = guards.leave(self._robot.stop)
        return Ending(reason, failure).unless(stopping)

    def _cycles(self) -> str:
        """Run the loop to its end and the tool to rest; return why it ended."""
        before = "before anything moved"
        if self._interruption.count > 0:
            return self._signalled(before)
        home = reference = self._started()
        # Servos may take seconds to come on: what was felt meanwhile is past, but it is checked.
        self._sensing.hear(self._clock.now())
        if self._interruption.count > 0:
            return self._signalled(before)
        start = self._start = self._clock.now()
        self._cycle = self._missed = 0
        self._last = start - self._period
        self._begin(start)
        while True:
            due, woke = start + self._cycle * self._period, self._clock.now()
            state = self._checked_state(reference)
            fresh = self._feel(self._clock.now(), state)
            if reference is not None and home is not None:
                reference = self._lead(reference, home if fresh else None)
            sent = self._clock.now()
            t = state.t - start - self._lead_in
            # Where the robot has told nothing new since the last cycle there is no new row.
            if t > -0.5 * self._period and not (len(self.log) and round(t, 9) <= self.log.duration):
                self.log.add(t, state, reference, self._wrench, self._sensing.newest)
            reason = self._reason_to_end(t)
            if reason is not None:
                rested = self._come_to_rest(reference)
                return self._signalled(rested) if self._interruption.count else reason
            self.pace.add(due, woke, sent, self._clock.now())
            self._wait()

    def _started(self) -> Pose | None:
        """Enter servo mode; return where the tool is then, or None where no reference leads it."""
        if self._settings.drag == "builtin" and isinstance(self._robot, DragTeaching):
            self._robot.drag()
            return None
        self._robot.start(self._period)
        # Not before: it may have been moved since, and arms sink as their brakes are released.
        state = self._robot.state()
        guards.check_state(state, self._settings.workspace)
        return Pose(state.position, state.rotation, np.zeros(6))

    def _wait(self) -> None:
        """Sleep until the next deadline; those that have passed by now are missed."""
        since = self._clock.now() - self._start
        following = math.ceil(since / self._period - 1e-6)
        self._missed = max(following - self._cycle - 1, 0)
        self.pace.missed += self._missed
        self._cycle += 1 + self._missed
        self._clock.sleep_until(self._start + self._cycle * self._period)

    def _lead(self, reference: Pose, home: Pose | None) -> Pose:
        """Send the next set-point, and before it those that a queue is owed; return it.

        Each is a step of one period; without `home`, from which the spring pulls, it brakes.
        """
        for _ in range(1 + (self._missed if self._servo.queues else 0)):
            if home is None:
                reference = brake(self._law, reference, self._bounds)
            else:
                reference = move(self._law, reference, self._wrench, home, self._bounds)
            self._send(reference)
        return reference

    def _checked_state(self, reference: Pose | None) -> RobotState:
        """Read the arm's state at the head of a cycle; raise where it must not go on."""
        now = self._clock.now()
        state = self._robot.state()
        guards.check_state(state, self._settings.workspace)
        if reference is not None:
            # Whether it slept too long or computed too long: the arm got nothing meanwhile.
            guards.check_late(now - self._last - self._period, self._servo, self._period)
            self._trail.check(state)
        self._last = now
        return state

    def _feel(self, now: float, state: RobotState) -> bool:
        """Take in the new samples; False when the newest is too old to be believed."""
        s = self._settings
        for sample in self._sensing.hear(now):
            external = self._compensate(sample.wrench, state.rotation)
            guards.check_wrench(external, s.max_force, s.max_torque)
            felt = self._low_pass(external)
            self._wrench = dead_band(felt, s.dead_band_force, s.dead_band_torque)
        fresh = self._sensing.fresh(now)
        if not fresh:
            self._wrench = np.zeros(6)
        return fresh

    def _send(self, reference: Pose) -> None:
        position, rotation = reference.position, reference.rotation
        guards.check_setpoint(position, rotation, self._settings.workspace)
        if not self._robot.send(position, rotation):
            # The mode says why, where it can.
            guards.check_state(self._robot.state())
            raise InstrumentError("robot: refused a set-point, stopped; see its pendant")
        self._trail.add(position, rotation)

    def _reason_to_end(self, t: float) -> str | None:
        hindrance = self._hindrance()
        if hindrance is not None:
            return str(hindrance)
        if self._interruption.count or self._asked_to_end():
            return "asked"
        if t >= self._longest - 0.5 * self._period:
            return "duration"
        rest = self._settings.until_rest
        if (
            rest is not None
            and len(self.log)
            and self.log.moved(MOVED)
            and self.log.still(rest, STILL)
        ):
            return "rest"
        return None

    def _signalled(self, how: str) -> str:
        number = self._interruption.number
        return f"{signal.Signals(number).name if number else 'signal'}: stopped {how}"

    def _come_to_rest(self, reference: Pose | None) -> str:
        """Brake within the bounds, and wait for the arm; a second signal stops at once."""
        rest = Rest(self._servo, self._period)
        while reference is not None:
            self._wait()
            if self._interruption.count > 1:
                return "at once at the second signal"
            state = self._checked_state(reference)
            self._feel(self._clock.now(), state)
            reference = self._lead(reference, None)
            if not reference.velocity.any() and rest.reached(state):
                break
        return "after braking to rest"
