"""What a loop may believe of a force sensor: every sample is checked, and an old one is no force.

Unhealthy, saturated, near the end of the range or not a number is a failure at rest as much as in
motion, as is silence. Between two samples a loop goes on; without a fresh one it feels nothing.
"""

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import InstrumentError
from dmpcli.instruments.protocols import Clock, Sample, Sensor, SensorInfo
from dmpcli.primitives.compensation import rest_zero
from dmpcli.primitives.wrench import Tool

SILENCE = 0.1
"""s without a sample, after which the sensor counts as dead."""

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
    newest : Sample
        The last one heard, as sensed.
    """

    def __init__(
        self, sensor: Sensor, info: SensorInfo, rate: float, period: float, clock: Clock
    ) -> None:
        self._sensor, self._clock = sensor, clock
        self._limit = RANGE_SHARE * info.limit
        self._stale = STALE * max(period, 1.0 / rate)
        self.newest = Sample(clock.now(), 0, np.zeros(6), healthy=True, lost=0)

    def zeroed(self, tool: Tool, rotation: Floats, pause: float) -> Tool:
        """Wait at rest for the first samples; return the tool with its zero.

        Parameters
        ----------
        tool : Tool
            Where its zero is None, the mean of the wait becomes it.
        rotation : array, shape (3, 3)
            Of the tool meanwhile.
        pause : float
            How long a zero takes, s.

        Raises
        ------
        InstrumentError
            Nothing came, or nothing that may be believed.
        """
        pause = SILENCE if tool.zero is not None else pause
        self._clock.sleep_until(self._clock.now() + pause)
        samples = self._poll()
        if not samples:
            raise InstrumentError(
                f"force sensor: sends nothing within {pause:g} s; check cable and power"
            )
        if tool.zero is not None:
            return tool
        return tool.with_zero(rest_zero(tool, np.array([s.wrench for s in samples]), rotation))

    def hear(self, now: float) -> list[Sample]:
        """Return the samples since the last call, oldest first.

        Raises
        ------
        InstrumentError
            The sensor is silent, or a sample must not be believed.
        """
        samples = self._poll()
        silent = now - self.newest.t
        if not silent <= SILENCE:
            raise InstrumentError(
                f"force sensor: silent for {silent:.2f} s, stopped; check cable and power"
            )
        return samples

    def fresh(self, now: float) -> bool:
        """Tell whether the newest sample is young enough to be believed."""
        return now - self.newest.t <= self._stale + 1e-9  # less is rounding

    def _poll(self) -> list[Sample]:
        samples = self._sensor.poll()
        for sample in samples:
            self._check(sample)
            self.newest = sample
        return samples

    def _check(self, sample: Sample) -> None:
        if not sample.healthy:
            raise InstrumentError(
                f"force sensor: sample {sample.seq} is saturated or flagged as faulty, stopped; "
                "use less force, or check range and cable"
            )
        if not np.isfinite(sample.wrench).all():
            raise InstrumentError(
                f"force sensor: sample {sample.seq} is not a number, stopped; check its driver"
            )
        over = np.abs(sample.wrench) > self._limit
        if over.any():
            axis = int(np.argmax(over))
            raise InstrumentError(
                f"force sensor: {_AXES[axis]} = {sample.wrench[axis]:.3g} is over "
                f"{RANGE_SHARE:.0%} of its range, stopped; use less force"
            )
