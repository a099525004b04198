"""What a simulated sensor box is at the moment: its settings, its bias, and what it reads."""

import threading
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.instruments.netft.settings import Scale
from dmpcli.instruments.netft.status import WARNING
from dmpcli.simulation.netft_server.faults import BoxFaults
from dmpcli.simulation.netft_server.settings import INTERNAL_RATE, BoxSettings, rounded_up

_INT32 = 2**31 - 1


class BoxState:
    """A box without its ports.

    Parameters
    ----------
    read : callable
        ``read(t)`` gives the sensed wrench at `t` on `time.monotonic`, shape (6,), N and N·m,
        neither clipped nor quantised. It is called from the box's threads, one call at a time.
    settings : BoxSettings, optional
    faults : BoxFaults, optional
        May be changed while the box runs.

    Attributes
    ----------
    faults : BoxFaults
    latched : bool
        A monitor condition is latched, until a client resets it.
    enabled : bool
        Whether RDT is switched on; a box where it is not serves no stream.
    rate : int
        RDT records per second as the box prints it, Hz.
    records : int
        In one datagram of a buffered stream.
    low_pass : int
        Number of the filter that was set; it has no effect on the readings.
    """

    def __init__(
        self,
        read: Callable[[float], Floats],
        settings: BoxSettings | None = None,
        faults: BoxFaults | None = None,
    ) -> None:
        self.settings = settings or BoxSettings()
        self.faults = faults or BoxFaults()
        self.latched = False
        self.enabled = True
        self.low_pass = 0
        self.records = self.settings.records
        self.rate, self._true_rate = rounded_up(self.settings.rate)
        self._read, self._reading = read, threading.Lock()
        self._bias: Integers = np.zeros(6, np.int64)
        self._counts_per_unit = 1.0 / self.settings.scale.per_count
        most = np.round(self.settings.limit * self._counts_per_unit)
        self._most = np.minimum(most, _INT32).astype(np.int64)
        self._powered = time.monotonic()

    def set_rate(self, rate: int) -> None:
        """Set the RDT rate, Hz, rounded up to one that the box has; a stream keeps its own."""
        self.rate, self._true_rate = rounded_up(rate)

    def set_scale(self, scale: Scale) -> None:
        """Give the readings another scale, as another active configuration does."""
        self.settings = replace(self.settings, scale=scale)
        self._counts_per_unit = 1.0 / scale.per_count

    def set_bias(self, axis: int, counts: int) -> None:
        """Set what is subtracted from one axis, counts."""
        self._bias[axis] = counts

    def bias(self) -> Integers:
        """What is subtracted from the readings, counts, shape (6,)."""
        return self._bias.copy()

    def restart(self) -> None:
        """Let the sensor's own counter begin anew and forget the bias, as a power cycle does.

        The stream of a real box would end too; here it goes on, so that a client sees the counter.
        """
        self._powered = time.monotonic()
        self._bias[:] = 0

    def reading(self, t: float) -> tuple[Integers, int]:
        """Counts, shape (6,), and status of the reading at `t`.

        Parameters
        ----------
        t : float
            s, on `time.monotonic`.
        """
        with self._reading:
            wrench = self._read(t)
        counts = np.round(wrench * self._counts_per_unit).astype(np.int64)
        most = self._most
        if self.faults.saturated:
            counts = np.where(counts < 0, -most, most)
        status = WARNING if self.latched else 0
        if (np.abs(counts) >= most).any():
            status |= self.settings.saturated
        if self.faults.status is not None:
            status = self.faults.status
        # The gages saturate before the bias is taken off.
        return np.clip(counts, -most, most) - self._bias, status

    def passed(self, t: float) -> int:
        """Return the sensor's own counter at `t`, s on `time.monotonic`."""
        return int((t - self._powered) * INTERNAL_RATE)
