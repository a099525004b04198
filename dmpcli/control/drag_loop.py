"""The control loop of ``record``: sensor → compensation → admittance → servo, and the log.

It stops by itself where going on would not be safe: a silent or saturated sensor, a robot that is
not ready, refuses a set-point, does not follow or leaves the workspace, a loop that is late.
"""

from collections.abc import Callable

import numpy as np

from dmpcli.admittance.compensation import Compensation, LowPass, dead_band
from dmpcli.admittance.model import DragState, brake, move
from dmpcli.arrays import Floats
from dmpcli.control import guards, ownership
from dmpcli.control.chatter import ChatterDetector, damped
from dmpcli.control.cycle import (
    ControlLoop,
    Cycle,
    LoopOutcome,
    ReadyArm,
    StopLimits,
    StoppedAtOnce,
)
from dmpcli.control.demonstration_log import DemonstrationLog
from dmpcli.control.force_sensing import Sensing
from dmpcli.control.signals import Interruption
from dmpcli.errors import DmpError, InputError, beside
from dmpcli.instruments.protocols import (
    Clock,
    DragTeaching,
    RobotState,
    Sensor,
    SensorInfo,
    Servo,
    ServoInfo,
)
from dmpcli.settings.record import RecordSettings
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.wrench import Tool

STILL = 0.5
"""mm: a tool that stays within this of one point is at rest."""

LONGEST_LOOKAHEAD = 0.15
"""s: an arm that lags by more makes the hand and the admittance model swing against each other."""

MOVED = 2.0
"""mm: a tool that has been further than this from where it began has moved."""

DEFECT = "a defect of dmpcli"


class HandForce:
    """What the hand does: the newest wrench, compensated and filtered, past the dead-band.

    Parameters
    ----------
    sensing : Sensing
    tool : Tool
        With its zero.
    settings : RecordSettings

    Attributes
    ----------
    felt : array, shape (6,)
        The newest one before the dead-band.
    """

    def __init__(self, sensing: Sensing, tool: Tool, settings: RecordSettings) -> None:
        self._sensing, self._settings = sensing, settings
        self._compensate = Compensation(tool)
        self.felt = np.zeros(6)
        self._low_pass = LowPass(settings.low_pass, settings.sensor_rate)
        self._wrench = np.zeros(6)

    def feel(
        self, state: RobotState, now: float, force: float = np.inf, torque: float = np.inf
    ) -> Floats | None:
        """Take in the new samples; see `WrenchSource`."""
        s = self._settings
        for sample in self._sensing.hear(now):
            external = self._compensate(sample.wrench, state.rotation)
            guards.check_wrench(external, force, torque)
            felt = self.felt = self._low_pass(external)
            self._wrench = dead_band(felt, s.dead_band_force, s.dead_band_torque)
        return self._wrench if self._sensing.fresh(now) else None


class Recorder(ControlLoop):
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
    noticed : callable, optional
        Told, while it records, what is odd about the drag; it must not wait.
    shared : bool
        Whether others could move the arm: then it must stand still when it is taken, unless a hand
        leads it.

    Attributes
    ----------
    log : DemonstrationLog
        It is there whatever goes wrong.
    sensor_info : SensorInfo
        What the sensor said of itself, once `run` has opened it.
    chatter : ChatterDetector
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
        shared: bool = False,
        noticed: Callable[[str], None] = lambda _: None,
    ) -> None:
        watch = StopLimits(
            settings.following_error,
            settings.following_angle,
            settings.max_force,
            settings.max_torque,
        )
        led = settings.drag == "admittance"
        super().__init__(settings.law.period, watch, settings.workspace, led, hindrance)
        self._robot, self._sensor, self._clock = robot, sensor, clock
        self._tool, self._settings = tool, settings
        self._longest, self._asked_to_end, self._tell_begin = longest, asked_to_end, begin
        self._interruption = interruption or Interruption()
        self._lead_in, self._remark, self._shared = lead_in, remark, shared
        self._law, self._bounds = settings.law, settings.bounds
        self._ended, self._noticed = "", noticed
        self.chatter = ChatterDetector(settings.law.period)
        self.log = DemonstrationLog(referred=led)

    def run(self) -> LoopOutcome:
        """Record until the end; the instruments are closed after.

        Returns
        -------
        LoopOutcome
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
            servo, self.sensor_info = self._robot.open(), self._sensor.open()
            self._check_rates(servo, self.sensor_info)
            if self._shared and self._streams:
                ownership.require_rest(self._robot, self._clock)
            if self._streams and servo.lookahead > LONGEST_LOOKAHEAD:
                ahead = beside(servo.lookahead, LONGEST_LOOKAHEAD, ".6g")
                self._remark(
                    f"robot: lags by its look-ahead of {ahead} s, and above "
                    f"{LONGEST_LOOKAHEAD:g} s the drag swings to and fro; shorten lookahead"
                )
            self._sensor.start(self._settings.sensor_rate)
            state = self._robot.state()
            guards.check_state(state, self._settings.workspace)
            self._workspace = self._settings.room(state.position)
            self._take(ReadyArm(self._robot, servo, self._clock), self._zeroed(state))
            how, failure = self._run()
            ending = self._outcome(how or "stopped after braking to rest", failure, self._ended)
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

    def _zeroed(self, state: RobotState) -> "HandForce":
        """Wait for samples at rest, for the zero; return what the loop feels with."""
        s = self._settings
        sensing = Sensing(self._sensor, self.sensor_info, s.sensor_rate, self._period, self._clock)
        tool = sensing.zeroed(self._tool, state.rotation, s.bias_time, s.tool_check)
        self._sensing, self._hand = sensing, HandForce(sensing, tool, s)
        return self._hand

    def _enter(self) -> None:
        """Hand the arm over to its own drag teaching, or lead it from where it is then."""
        self._heed()
        if isinstance(self._robot, DragTeaching) and not self._streams:
            self._moved = True
            self._robot.drag()
            self._reference = self._home = None
        else:
            self._start()
            # Not before: it may have been moved since, and arms sink as their brakes are released.
            state = self._robot.state()
            guards.check_state(state, self._workspace)
            self._reference = self._home = DragState(state.position, state.rotation, np.zeros(6))
        # Servos may take seconds to come on: what was felt meanwhile is past, but it is checked.
        self._sensing.hear(self._clock.now())
        self._heed()
        self._tell_begin(self._clock.now())

    def _next(self, cycle: Cycle, owed: bool = False) -> Pose:  # noqa: ARG002
        """Move the reference by one period; it brakes at the end, and where nothing is felt."""
        if self._ended and self._interruption.count > 1:
            raise StoppedAtOnce("stopped at once at the second signal")
        if self._reference is None or self._home is None:
            return cycle.state.pose
        if cycle.wrench is not None:
            self._listen(cycle)
        if cycle.wrench is None or self._ended:
            reference = brake(self._law, self._reference, self._bounds)
        else:
            reference = move(self._law, self._reference, cycle.wrench, self._home, self._bounds)
        self._reference = reference
        setpoint = Pose(reference.position, reference.rotation)
        guards.check_setpoint(setpoint, self._workspace)
        return setpoint

    def _listen(self, cycle: Cycle) -> None:
        """Make the drag heavier along the tool where it chatters on the work."""
        axis = cycle.state.rotation[:, 2]
        if self.chatter.feel(cycle.state.t - self._begin, self._hand.felt[:3], axis):
            self._law = damped(self._law, axis)
            self._noticed(self.chatter.said())

    def _record(self, cycle: Cycle, setpoint: Pose | None, lateness: float | None) -> None:  # noqa: ARG002
        if self._ended or lateness is None:
            return
        t = self._age(cycle.state)
        # Where the robot has told nothing new since the last cycle there is no new row.
        if t > -0.5 * self._period and not (len(self.log) and round(t, 9) <= self.log.duration):
            wrench = np.zeros(6) if cycle.wrench is None else cycle.wrench
            self.log.add(t, cycle.state, self._reference, wrench, self._sensing.newest)

    def _age(self, state: RobotState) -> float:
        """Return how old the recording is, s; negative while the hand takes hold."""
        return state.t - self._begin - self._lead_in

    def _goes_on(self, cycle: Cycle) -> bool:
        """Go on until there is a reason to end, and then until the arm rests."""
        if not self._ended:
            self._ended = self._reason_to_end(self._age(cycle.state))
            # Nothing leads an arm that is dragged by its own teaching: it has only to be stopped.
            return not self._ended or self._reference is not None
        assert self._reference is not None
        self._rested = not self._reference.velocity.any() and self._rest.reached(cycle.state)
        return not self._rested

    def _reason_to_end(self, t: float) -> str:
        hindrance = self._hindrance()
        if hindrance is not None:
            return str(hindrance)
        if self._interruption.count or self._asked_to_end():
            return "asked"
        if t >= self._longest - 0.5 * self._period:
            return "duration"
        rest = self._settings.until_rest
        if rest is not None and self.log.moved(MOVED) and self.log.still(rest, STILL):
            return "rest"
        return ""
