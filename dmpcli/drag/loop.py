"""The control loop of ``record``: sensor → compensation → admittance → servo, and the log.

Deadlines are absolute. The loop stops by itself where going on would not be safe: a silent or
saturated sensor, a robot that is not ready, refuses a set-point, does not follow or leaves the
workspace, a loop that is late. Whatever ends it, the arm is stopped and the log is there.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from dmpcli.drag.log import Log
from dmpcli.drag.settings import RecordSettings
from dmpcli.errors import DmpError, InputError, InstrumentError, RefusedError
from dmpcli.instruments import guards
from dmpcli.instruments.guards import Trail
from dmpcli.instruments.interruption import Interruption
from dmpcli.instruments.protocols import (
    Clock,
    DragTeaching,
    RobotState,
    Sensor,
    SensorInfo,
    Servo,
    ServoInfo,
)
from dmpcli.instruments.sensing import Sensing
from dmpcli.primitives.admittance import Pose, brake, move
from dmpcli.primitives.compensation import Compensation, LowPass, dead_band
from dmpcli.primitives.wrench import Tool

STILL = 0.5
"""mm: a tool that stays within this of one point is at rest."""

MOVED = 2.0
"""mm: a tool that has been further than this from where it began has moved."""

DEFECT = "a defect of dmpcli"

_BRAKING_TIME = 2.0


@dataclass(frozen=True)
class Ending:
    """Why a recording ended.

    Attributes
    ----------
    reason : str
        ``duration``, ``rest``, ``asked``, or what failed.
    failure : DmpError or None
        What the command shall end with once the recording is kept.
    missed : int
        Deadlines that passed without a cycle.
    """

    reason: str
    failure: DmpError | None = None
    missed: int = 0

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

    Attributes
    ----------
    log : Log
        It is there whatever goes wrong.
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
    ) -> None:
        self._robot, self._sensor, self._clock = robot, sensor, clock
        self._tool, self._settings = tool, settings
        self._longest, self._asked_to_end, self._begin = longest, asked_to_end, begin
        self._interruption = interruption or Interruption()
        self._lead_in = lead_in
        self._law, self._bounds = settings.law, settings.bounds
        self._period = self._law.period
        self._low_pass = LowPass(settings.low_pass, settings.sensor_rate)
        self._wrench = np.zeros(6)
        self._missed = 0
        self.log = Log()

    def run(self) -> Ending:
        """Record until the end; the instruments are closed after.

        Returns
        -------
        Ending
            A failure while running is in it, not raised, so that `log` can be kept.

        Raises
        ------
        InputError
            A rate does not suit the instruments.
        RefusedError
            The robot is not ready.
        InstrumentError
            An instrument cannot be reached or started.
        """
        closing = None
        try:
            servo, info = self._robot.open(), self._sensor.open()
            self._check_rates(servo, info)
            self._sensor.start(self._settings.sensor_rate)
            state = self._robot.state()
            guards.check_state(state, self._settings.workspace)
            ending = self._drag(state, servo, info)
        finally:
            closing = guards.leave(self._robot.close, self._sensor.close)
        return ending.unless(closing)

    def _check_rates(self, servo: ServoInfo, sensor: SensorInfo) -> None:
        shortest, longest = servo.period_range
        s = self._settings
        if not shortest <= self._period <= longest:
            raise InputError(
                f"[record] control_rate = {s.control_rate:g} Hz: the {servo.make} robot takes "
                f"{1.0 / longest:g} to {1.0 / shortest:g}"
            )
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
        tool = self._sensing.zeroed(self._tool, state.rotation, s.bias_time)
        self._compensate = Compensation(tool)
        self._servo = servo
        self._trail = Trail(servo, self._period, s.following_error, s.following_angle)
        reason, failure, stopping = DEFECT, None, None
        try:
            reason = self._cycles(Pose(state.position, state.rotation, np.zeros(6)))
        except (InstrumentError, RefusedError) as error:
            reason, failure = str(error), error
        finally:
            # Also on a defect of ours: nothing may leave the arm moving.
            stopping = guards.leave(self._robot.stop)
        return Ending(reason, failure, self._missed).unless(stopping)

    def _cycles(self, home: Pose) -> str:
        """Run the loop to its end and the tool to rest; return why it ended."""
        if self._interruption.count:
            return "asked"
        reference: Pose | None = home
        if self._settings.drag == "builtin" and isinstance(self._robot, DragTeaching):
            self._robot.drag()
            reference = None
        else:
            self._robot.start(self._period)
        start = self._clock.now()
        self._last = start - self._period
        self._begin(start)
        cycle = 0
        while True:
            state = self._checked_state(reference)
            fresh = self._feel(self._clock.now(), state)
            if reference is not None:
                reference = (
                    move(self._law, reference, self._wrench, home, self._bounds)
                    if fresh
                    else brake(self._law, reference, self._bounds)
                )
                self._send(reference)
            t = state.t - start - self._lead_in
            if t > -0.5 * self._period:
                self.log.add(t, state, reference, self._wrench, self._sensing.newest)
            reason = self._reason_to_end(t)
            if reason is not None:
                self._come_to_rest(reference)
                return reason
            cycle += 1
            # A loop that is late waits for the next deadline; it never sends a burst.
            due = math.ceil((self._clock.now() - start) / self._period - 1e-6)
            self._missed += max(due - cycle, 0)
            cycle = max(due, cycle)
            self._clock.sleep_until(start + cycle * self._period)

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
            felt = self._low_pass(self._compensate(sample.wrench, state.rotation))
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

    def _come_to_rest(self, reference: Pose | None) -> None:
        """Brake within the bounds; a second signal stops at once."""
        for _ in range(1, round(_BRAKING_TIME / self._period)):
            if reference is None or not reference.velocity.any():
                break
            self._clock.sleep_until(self._last + self._period)
            if self._interruption.count > 1:
                break
            self._checked_state(reference)
            reference = brake(self._law, reference, self._bounds)
            self._send(reference)
