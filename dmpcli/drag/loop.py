"""The control loop of ``record``: sensor → compensation → admittance → servo, and the log.

Deadlines are absolute. The loop stops by itself where going on would not be safe: a silent or
saturated sensor, a robot that is not ready or refuses a set-point.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dmpcli.drag.log import Log
from dmpcli.drag.settings import RecordSettings
from dmpcli.errors import DmpError, InputError, InstrumentError, RefusedError
from dmpcli.instruments.protocols import (
    Clock,
    DragTeaching,
    RobotState,
    Sample,
    Sensor,
    SensorInfo,
    Servo,
    ServoInfo,
)
from dmpcli.primitives.admittance import Pose, brake, move
from dmpcli.primitives.compensation import Compensation, LowPass, dead_band, rest_zero
from dmpcli.primitives.wrench import Tool

SILENCE = 0.1
"""s without a sample, after which the sensor counts as dead."""

STALE_CYCLES = 2
"""Control periods without a fresh sample, after which no force is believed and the tool brakes."""

RANGE_SHARE = 0.8
"""Share of the sensor's range beyond which the loop stops."""

STILL = 0.5
"""mm: a tool that stays within this of one point is at rest."""

MOVED = 2.0
"""mm: a tool that has been further than this from where it began has moved."""

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
        Deadlines that were missed by more than one period.
    """

    reason: str
    failure: DmpError | None = None
    missed: int = 0


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
    asked_to_end : callable
        Read once a cycle; True ends the recording.
    begin : callable, optional
        Called with the time from which the tool can be dragged, s.
    lead_in : float
        How long it is dragged before the recording begins, s.
    """

    def __init__(
        self,
        robot: Servo,
        sensor: Sensor,
        clock: Clock,
        tool: Tool,
        settings: RecordSettings,
        longest: float = np.inf,
        asked_to_end: Callable[[], bool] = lambda: False,
        begin: Callable[[float], None] = lambda _: None,
        lead_in: float = 0.0,
    ) -> None:
        self._robot, self._sensor, self._clock = robot, sensor, clock
        self._tool, self._settings = tool, settings
        self._longest, self._asked_to_end, self._begin = longest, asked_to_end, begin
        self._lead_in = lead_in
        self._law, self._bounds = settings.law, settings.bounds
        self._period = self._law.period
        self._low_pass = LowPass(settings.low_pass, settings.sensor_rate)
        self._wrench = np.zeros(6)
        self._newest = Sample(clock.now(), 0, np.zeros(6), healthy=True, lost=0)
        self.log = Log()

    def run(self) -> Ending:
        """Record until the end.

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
        try:
            servo, info = self._robot.open(), self._sensor.open()
            self._check_rates(servo, info)
            self._limit = RANGE_SHARE * info.limit
            self._sensor.start(self._settings.sensor_rate)
            state = self._robot.state()
            _check_ready(state)
            self._compensate = Compensation(self._zeroed_tool(state))
            return self._drag(state)
        finally:
            self._robot.close()
            self._sensor.close()

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

    def _zeroed_tool(self, state: RobotState) -> Tool:
        """Return the tool with its zero: the given one, or the mean of a while at rest."""
        pause = self._settings.bias_time if self._tool.zero is None else SILENCE
        self._clock.sleep_until(self._clock.now() + pause)
        samples = self._sensor.poll()
        if not samples:
            raise InstrumentError(
                f"force sensor: sends nothing within {pause:g} s; check cable and power"
            )
        for sample in samples:
            self._check_sample(sample)
        self._newest = samples[-1]
        if self._tool.zero is not None:
            return self._tool
        sensed = np.array([sample.wrench for sample in samples])
        return self._tool.with_zero(rest_zero(self._tool, sensed, state.rotation))

    def _drag(self, state: RobotState) -> Ending:
        home = Pose(state.position, state.rotation, np.zeros(6))
        reference: Pose | None = home
        if self._settings.drag == "builtin":
            if not isinstance(self._robot, DragTeaching):
                raise InputError("--drag builtin: this robot has no drag teaching of its own")
            self._robot.drag()
            reference = None
        else:
            self._robot.start(self._period)
        start = self._clock.now()
        self._begin(start)
        cycle = missed = 0
        try:
            while True:
                state = self._robot.state()
                _check_ready(state)
                now = self._clock.now()
                fresh = self._feel(now, state)
                if reference is not None:
                    reference = (
                        move(self._law, reference, self._wrench, home, self._bounds)
                        if fresh
                        else brake(self._law, reference, self._bounds)
                    )
                    self._send(reference)
                t = state.t - start - self._lead_in
                if t > -0.5 * self._period:
                    self.log.add(t, state, reference, self._wrench, self._newest)
                reason = self._reason_to_end(t)
                if reason is not None:
                    self._come_to_rest(reference, start + cycle * self._period)
                    return Ending(reason, missed=missed)
                cycle += 1
                # A loop that is late waits for the next deadline; it never sends a burst.
                due = math.ceil((self._clock.now() - start) / self._period - 1e-6)
                missed += max(due - cycle, 0)
                cycle = max(due, cycle)
                self._clock.sleep_until(start + cycle * self._period)
        except (InstrumentError, RefusedError) as failure:
            self._robot.stop()
            return Ending(str(failure), failure, missed)

    def _feel(self, now: float, state: RobotState) -> bool:
        """Take in the new samples; False when the newest is too old to be believed."""
        for sample in self._sensor.poll():
            self._check_sample(sample)
            felt = self._low_pass(self._compensate(sample.wrench, state.rotation))
            self._wrench = dead_band(
                felt, self._settings.dead_band_force, self._settings.dead_band_torque
            )
            self._newest = sample
        silent = now - self._newest.t
        if silent > SILENCE:
            raise InstrumentError(
                f"force sensor: silent for {silent:.2f} s, stopped; check cable and power"
            )
        fresh = silent <= STALE_CYCLES * self._period
        if not fresh:
            self._wrench = np.zeros(6)
        return fresh

    def _check_sample(self, sample: Sample) -> None:
        if not sample.healthy:
            raise InstrumentError(
                f"force sensor: sample {sample.seq} is saturated or flagged as faulty, stopped; "
                "pull more gently, or check the sensor"
            )
        over = np.abs(sample.wrench) > self._limit
        if over.any():
            axis = int(np.argmax(over))
            raise InstrumentError(
                f"force sensor: {('Fx', 'Fy', 'Fz', 'Tx', 'Ty', 'Tz')[axis]} = "
                f"{sample.wrench[axis]:.3g} is over {RANGE_SHARE:.0%} of its range, stopped; "
                "pull more gently"
            )

    def _send(self, reference: Pose) -> None:
        if not self._robot.send(reference.position, reference.rotation):
            # The mode says why, where it can.
            _check_ready(self._robot.state())
            raise InstrumentError("robot: refused a set-point, stopped; see its pendant")

    def _reason_to_end(self, t: float) -> str | None:
        if self._asked_to_end():
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

    def _come_to_rest(self, reference: Pose | None, deadline: float) -> None:
        """Brake within the bounds, then leave servo mode."""
        for cycle in range(1, round(_BRAKING_TIME / self._period)):
            if reference is None or not reference.velocity.any():
                break
            self._clock.sleep_until(deadline + cycle * self._period)
            reference = brake(self._law, reference, self._bounds)
            if not self._robot.send(reference.position, reference.rotation):
                break
        self._robot.stop()


def _check_ready(state: RobotState) -> None:
    if state.mode != "ready":
        raise RefusedError(f"robot: {state.mode}; clear it on the pendant and record again")
