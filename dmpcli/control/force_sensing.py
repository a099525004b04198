"""What a loop may believe of a force sensor: every sample is checked, and an old one is no force.

Unhealthy, saturated, near the end of the range or not a number is a failure at rest as much as in
motion, as is silence. Between two samples a loop goes on; without a fresh one it feels nothing.
"""

import numpy as np

from dmpcli.admittance.compensation import rest_zero
from dmpcli.arrays import Floats, finite, within
from dmpcli.errors import InstrumentError, RefusedError, beside
from dmpcli.instruments.protocols import Clock, Sample, Sensor, SensorInfo
from dmpcli.spatial.wrench import LEVER, Tool

SILENCE = 0.1
"""s without a sample, after which the sensor counts as dead."""

ONE_LOST = 2.5
"""Periods of the sensor that pass at most where one sample is lost."""

STALE = 2
"""Periods, of the loop or of the sensor if that is slower, after which no force is believed."""

RANGE_SHARE = 0.8
"""Share of the sensor's range beyond which the loop stops."""

_AXES = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")


class Sensing:
    """A sensor that streams.

    Parameters
    ----------
    sensor : Sensor
        Started.
    info : SensorInfo
    rate : float
        At which it streams, Hz.
    period : float
        Of the loop, s.
    clock : Clock

    Attributes
    ----------
    info : SensorInfo
    interval : float
        From one sample to the next, s.
    newest : Sample
        The last one heard, as sensed.
    """

    def __init__(
        self, sensor: Sensor, info: SensorInfo, rate: float, period: float, clock: Clock
    ) -> None:
        self._sensor, self.info, self._clock = sensor, info, clock
        # A reading at the share itself is allowed.
        self._limit = np.nextafter(RANGE_SHARE * info.limit, np.inf)
        self.interval = 1.0 / rate
        self._stale = STALE * max(period, self.interval)
        # One sample that the network loses is no silence, however slow the sensor.
        self._silence = max(SILENCE, ONE_LOST / rate)
        self.newest = Sample(clock.now(), 0, np.zeros(6), healthy=True, lost=0)

    def first(self, pause: float) -> list[Sample]:
        """Wait for so many seconds; return the samples meanwhile, of which there must be some.

        Raises
        ------
        InstrumentError
            Nothing came, or nothing that may be believed.
        """
        self._clock.sleep_until(self._clock.now() + pause)
        samples = self._poll()
        if not samples:
            raise InstrumentError(
                f"force sensor: sends nothing within {pause:g} s; check cable and power"
            )
        return samples

    def zeroed(
        self, tool: Tool, rotation: Floats, pause: float, tolerance: float | None = None
    ) -> Tool:
        """Wait at rest for the first samples; return the tool with its zero.

        Parameters
        ----------
        tool : Tool
            Where its zero is None, the mean of the wait becomes it.
        rotation : array, shape (3, 3)
            Of the tool meanwhile.
        pause : float
            How long a zero takes, s.
        tolerance : float, optional
            By how much a zero that is known may miss the reading, N, and at 0.1 m in N·m; None
            does not check it.

        Raises
        ------
        InstrumentError
            Nothing came, or nothing that may be believed.
        RefusedError
            The zero belongs to another sensor, or the tool does not explain the reading.
        """
        if tool.zero is None:
            samples = self.first(pause)
            zero = rest_zero(tool, np.array([s.wrench for s in samples]), rotation)
            return tool.with_zero(zero)
        if tolerance is None:
            self.first(SILENCE)
            return tool
        _check_sensor(tool, self.info)
        samples = self.first(SILENCE)
        _check_rest(tool, np.array([s.wrench for s in samples]), rotation, tolerance)
        return tool

    def hear(self, now: float) -> list[Sample]:
        """Return the samples since the last call, oldest first.

        Raises
        ------
        InstrumentError
            The sensor is silent, or a sample must not be believed.
        """
        samples = self._poll()
        silent = now - self.newest.t
        if not silent <= self._silence:
            raise InstrumentError(
                f"force sensor: silent for {silent:.2f} s, stopped; check cable and power"
            )
        return samples

    def recent(self, now: float) -> list[Sample]:
        """Return what is young enough to be believed of the samples since the last call.

        All are checked. Where none came meanwhile the newest one counts on while it is young;
        what a longer wait has gathered is past, and would hide a contact in a mean.

        Raises
        ------
        InstrumentError
            As in `hear`.
        """
        samples = self.hear(now) or [self.newest]
        return [sample for sample in samples if self._young(sample, now)]

    def rest(self) -> list[Sample]:
        """Return the healthy samples since the last call, once nothing depends on them any more."""
        try:
            samples = self._sensor.poll()
        except InstrumentError:
            return []
        return [one for one in samples if one.healthy and finite(one.wrench)]

    def fresh(self, now: float) -> bool:
        """Tell whether the newest sample is young enough to be believed."""
        return self._young(self.newest, now)

    def _young(self, sample: Sample, now: float) -> bool:
        return now - sample.t <= self._stale + 1e-9  # less is rounding

    def _poll(self) -> list[Sample]:
        samples = self._sensor.poll()
        for sample in samples:
            self._check(sample)
            self.newest = sample
        return samples

    def _check(self, sample: Sample) -> None:
        wrench = sample.wrench
        array = isinstance(wrench, np.ndarray) and wrench.shape == (6,)
        if sample.healthy and array and within(wrench, self._limit):
            return  # what is not a number is not within
        if not sample.healthy and sample.reason:
            raise InstrumentError(f"force sensor: sample {sample.seq}: {sample.reason}, stopped")
        if not sample.healthy:
            raise InstrumentError(
                f"force sensor: sample {sample.seq} is saturated or flagged as faulty, stopped; "
                "use less force, or check range and cable"
            )
        if not array:
            raise InstrumentError(
                f"force sensor: sample {sample.seq} is no array of six, stopped; check its driver"
            )
        if not finite(wrench):
            raise InstrumentError(
                f"force sensor: sample {sample.seq} is not a number, stopped; check its driver"
            )
        axis = int(np.argmax(np.abs(wrench) >= self._limit))
        raise InstrumentError(
            f"force sensor: {_AXES[axis]} = {wrench[axis]:.3g} is over {RANGE_SHARE:.0%} of its "
            "range, stopped; use less force"
        )


def _check_sensor(tool: Tool, info: SensorInfo) -> None:
    if tool.sensor and tool.sensor != info.identity:
        raise RefusedError(
            f"--tool: was calibrated with the sensor {tool.sensor}, and {info.identity} is "
            "connected; calibrate with this one: dmpcli calibrate"
        )


def _check_rest(tool: Tool, sensed: Floats, rotation: Floats, tolerance: float) -> None:
    """Refuse a tool whose zero and payload do not explain the readings at rest.

    A contact explains what they leave as well as another tool does: a pen that rests on a plate
    reads like a lighter tool. So neither may be larger than the tolerance.
    """
    left = rest_zero(tool, sensed, rotation) - (np.zeros(6) if tool.zero is None else tool.zero)
    force, torque = float(np.linalg.norm(left[:3])), float(np.linalg.norm(left[3:]))
    if not (force <= tolerance and torque <= LEVER * tolerance):
        raise RefusedError(
            f"--tool: leaves {beside(force, tolerance, '.2f')} N and "
            f"{beside(torque, LEVER * tolerance, '.3f')} N·m of the reading at rest, over "
            f"{tolerance:g} N and {LEVER * tolerance:g} N·m: calibrated for another tool (dmpcli "
            "calibrate), or something touches this one (lift it clear, or give --tool-check N)"
        )
