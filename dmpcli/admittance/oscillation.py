"""A force that swings to and fro: told from noise, steps and slow changes by its alternations.

A loop on the edge of its stability swings with a period of a few of its delays. What counts is one
alternation after the other: from an extreme to the opposite one by at least `size`, so many of them
within `window` s. Noise is too small, a step or a bump alternates once or twice, a slow
change takes longer.
"""

from collections import deque


class AlternationDetector:
    """Counts the alternations of one signal.

    Parameters
    ----------
    size : float
        Least difference between two extremes, in the signal's unit.
    count : int
        So many alternations are an oscillation.
    window : float
        Within so many seconds.
    """

    def __init__(self, size: float, count: int, window: float) -> None:
        self._size, self._count, self._window = size, count, window
        self._low = self._high = 0.0
        self._rises: bool | None = None
        self._times: deque[float] = deque()
        self._sizes: deque[float] = deque()
        self._begun = False

    def reset(self) -> None:
        """Begin anew."""
        self._begun, self._rises = False, None
        self._times.clear()
        self._sizes.clear()

    @property
    def swing(self) -> float:
        """Largest alternation that is remembered."""
        return max(self._sizes, default=0.0)

    @property
    def grows(self) -> bool:
        """Whether the later alternations are no smaller than the earlier ones."""
        sizes = list(self._sizes)
        half = len(sizes) // 2
        return half > 0 and sum(sizes[half:]) * half >= 0.9 * sum(sizes[:half]) * len(sizes[half:])

    def feel(self, t: float, value: float) -> bool:
        """Take in one value; tell whether it oscillates by now.

        Parameters
        ----------
        t : float
            s.
        value : float
        """
        if not self._begun:
            self._low = self._high = value
            self._begun = True
        if self._rises is None:
            self._low, self._high = min(self._low, value), max(self._high, value)
            if self._high - self._low >= self._size:
                self._rises = value == self._high
                self._turned(t, self._high - self._low)
        elif self._rises:
            self._high = max(self._high, value)
            if self._high - value >= self._size:
                self._rises, self._low = False, value
                self._turned(t, self._high - value)
        else:
            self._low = min(self._low, value)
            if value - self._low >= self._size:
                self._rises, self._high = True, value
                self._turned(t, value - self._low)
        if self._sizes:
            # The extreme itself comes after its alternation is known.
            span = self._high - self._low
            self._sizes[-1] = max(self._sizes[-1], span)
        while self._times and t - self._times[0] > self._window:
            self._times.popleft()
            self._sizes.popleft()
        return len(self._times) >= self._count

    def _turned(self, t: float, size: float) -> None:
        self._times.append(t)
        self._sizes.append(size)
