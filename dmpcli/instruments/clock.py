"""The clocks that a control loop runs on: simulated, and the machine's own."""

import time


class SimulatedClock:
    """Time that passes only while somebody sleeps; a 10 s stroke then takes as long as it computes.

    Parameters
    ----------
    start : float
        The first reading, s.
    """

    def __init__(self, start: float = 0.0) -> None:
        self._now = start

    def now(self) -> float:
        """Return the simulated time, s."""
        return self._now

    def sleep_until(self, t: float) -> None:
        """Move the simulated time forward to `t`; at once, and never backward."""
        self._now = max(self._now, t)


class MonotonicClock:
    """The machine's monotonic clock; deadlines are absolute, so lateness does not add up."""

    def now(self) -> float:
        """Return `time.monotonic`, s."""
        return time.monotonic()

    def sleep_until(self, t: float) -> None:
        """Sleep until `t`; at once if it has passed."""
        wait = t - time.monotonic()
        if wait > 0.0:
            time.sleep(wait)
