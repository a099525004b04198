"""Simulated time with events in it: whatever sleeps lets the world go on."""

import heapq
from collections.abc import Callable

LONGEST = 120.0
"""s that a command may take; one that takes longer would never end."""


class EndlessError(Exception):
    """The world has come to its end, and the command has not."""


class World:
    """A clock whose sleepers are overtaken by events; it never goes back.

    Attributes
    ----------
    lateness : callable
        How much later than asked for a sleeper wakes, s: called with the time asked for.
    """

    def __init__(self, start: float = 100.0) -> None:
        self._now = start
        self._latest = start + LONGEST
        self._number = 0
        self._events: list[tuple[float, int, Callable[[], object]]] = []
        self.lateness: Callable[[float], float] = lambda _: 0.0

    def now(self) -> float:
        """Return the time, s; within an event, that of the event."""
        return self._now

    monotonic = now

    def time_ns(self) -> int:
        """Return the time as ns since an epoch, as `time.time_ns` does."""
        return 1_700_000_000_000_000_000 + round(self._now * 1e9)

    def at(self, t: float, event: Callable[[], object]) -> None:
        """Have something happen at time `t`, s, or at once where that has passed."""
        self._number += 1
        heapq.heappush(self._events, (max(t, self._now), self._number, event))

    def every(self, period: float, event: Callable[[], bool]) -> None:
        """Have something happen periodically, s, for as long as it returns True."""

        def again(due: float) -> None:
            if event():
                self.at(due + period, lambda: again(due + period))

        self.at(self._now + period, lambda due=self._now + period: again(due))

    def sleep_until(self, t: float) -> None:
        """Let the world go on until `t`, s, or a little longer where the computer is slow."""
        self.advance(t + self.lateness(t))

    def sleep(self, duration: float) -> None:
        """As `time.sleep`."""
        self.advance(self._now + duration)

    def advance(self, t: float) -> None:
        """Let everything happen up to `t`, s.

        Raises
        ------
        EndlessError
        """
        if t > self._latest:
            raise EndlessError(f"not ended after {LONGEST:g} s of simulated time")
        while self._events and self._events[0][0] <= t:
            self._now, _, event = heapq.heappop(self._events)
            event()
        self._now = max(self._now, t)

    def wait(self, done: Callable[[], object], until: float) -> bool:
        """Let the world go on until `done` is true; False where it is not by `until`, s."""
        while not done():
            if not self._events or self._events[0][0] > min(until, self._latest):
                self.advance(until)
                return bool(done())
            self.advance(self._events[0][0])
        return True
