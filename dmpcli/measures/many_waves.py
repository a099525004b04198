"""Wave heights of many strokes at once: as `measures.wave`, without a loop over strokes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.measures.wave import LINE, PROMINENCE, WaveHeights


@dataclass(frozen=True)
class ManyWaves:
    """The turning points of B strokes, m in all, those of a stroke one after the other.

    Attributes
    ----------
    count : int
        B.
    stroke : array of int, shape (m,)
        Whose they are; not falling.
    index, value : array, shape (m,)
        As in `WaveHeights`.
    """

    count: int
    stroke: Integers
    index: Floats
    value: Floats

    @property
    def ends(self) -> Integers:
        """Where each height ends among the turning points; it begins at the one before."""
        return np.flatnonzero(self.stroke[1:] == self.stroke[:-1]) + 1

    @property
    def heights(self) -> Floats:
        """All heights, mm."""
        ends = self.ends
        return np.asarray(np.abs(self.value[ends] - self.value[ends - 1]))

    @property
    def mean(self) -> Floats:
        """Mean height of each stroke, shape (B,), mm; NaN where there is no wave."""
        stroke = self.stroke[self.ends]
        number = np.bincount(stroke, minlength=self.count)
        total = np.bincount(stroke, self.heights, minlength=self.count)
        return np.asarray(np.where(number > 0, total / np.maximum(number, 1), np.nan))

    @property
    def spread(self) -> Floats:
        """Largest less smallest height of each stroke, shape (B,), mm; NaN without a wave."""
        stroke = self.stroke[self.ends]
        least, largest = np.full(self.count, np.nan), np.full(self.count, np.nan)
        np.fmin.at(least, stroke, self.heights)
        np.fmax.at(largest, stroke, self.heights)
        return np.asarray(largest - least)

    @classmethod
    def joined(cls, waves: Sequence[WaveHeights]) -> "ManyWaves":
        """Return the waves of strokes that were measured one by one."""
        counts = [len(wave.value) for wave in waves]
        return cls(
            len(waves),
            np.repeat(np.arange(len(waves)), counts),
            np.concatenate([wave.index for wave in waves]),
            np.concatenate([wave.value for wave in waves]),
        )


def many_waves(
    v: Floats, length: Floats, closed: Booleans, prominence: float = PROMINENCE
) -> ManyWaves:
    """Wave heights of strokes with as many samples each; none for lines and closed strokes.

    Parameters
    ----------
    v : array, shape (B, n)
        Signed distances across the start-goal lines, mm; n ≥ 2.
    length : array, shape (B,)
        Start-goal distances, mm.
    closed : array, shape (B,)
    prominence : float
        Share of v's range, above 0.
    """
    swing = np.ptp(v, axis=1)
    rows = np.flatnonzero((swing >= LINE * length) & ~closed & (swing > 0.0))
    stroke, at = _turning_points(v[rows], prominence * swing[rows])
    stroke = rows[stroke]
    before, here, after = v[stroke, at - 1], v[stroke, at], v[stroke, at + 1]
    bend = before - 2.0 * here + after
    offset = np.divide(0.5 * (before - after), bend, out=np.zeros(len(at)), where=bend != 0.0)
    return ManyWaves(
        len(v), stroke, at.astype(float) + offset, here - 0.25 * (before - after) * offset
    )


def _turning_points(v: Floats, least: Floats) -> tuple[Integers, Integers]:
    """Strokes and samples of the turning points; the walk of `measures.wave`, all in step."""
    count = len(v)
    stroke, sample = _corners(v)
    number = np.bincount(stroke, minlength=count)
    first = np.concatenate([[0], np.cumsum(number)[:-1]]).astype(np.int64)
    low = np.zeros(count, dtype=np.int64)
    high = np.zeros(count, dtype=np.int64)
    # +1 while it rises, -1 while it falls, 0 before the first candidate is confirmed.
    way = np.zeros(count, dtype=np.int64)
    found: list[tuple[Integers, Integers]] = []
    for step in range(int(number.max(initial=0))):
        on = np.flatnonzero(number > step)
        i = sample[first[on] + step]
        here = v[on, i]
        up, down = way[on] >= 0, way[on] <= 0
        high[on] = np.where(up & (here > v[on, high[on]]), i, high[on])
        low[on] = np.where(down & (here < v[on, low[on]]), i, low[on])
        peak = up & (v[on, high[on]] - here >= least[on])
        trough = ~peak & down & (here - v[on, low[on]] >= least[on])
        turned = peak | trough
        # The first candidate is where the signal set out from.
        counts = turned & (way[on] != 0)
        found.append((on[counts], np.where(peak, high[on], low[on])[counts]))
        low[on[peak]], high[on[trough]] = i[peak], i[trough]
        way[on[turned]] = np.where(peak, -1, 1)[turned]
    if not found:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    strokes, samples = (np.concatenate(list(part)) for part in zip(*found, strict=True))
    order = np.argsort(strokes, kind="stable")
    return strokes[order], samples[order]


def _corners(v: Floats) -> tuple[Integers, Integers]:
    """Strokes and samples of both ends and of every change of direction; see `measures.wave`."""
    move = np.sign(v[:, 1:] - v[:, :-1])
    onward = move[:, 1:]
    if not move.all():
        onward = _next_moves(move)[:, 1:]
    corner = np.ones(v.shape, dtype=bool)
    corner[:, 1:-1] = (move[:, :-1] != onward) & (move[:, :-1] != 0.0) & (onward != 0.0)
    stroke, sample = np.nonzero(corner)
    return stroke, sample


def _next_moves(move: Floats) -> Floats:
    """Put at each sample where a signal stands still the way that it moves on, 0 at the end."""
    last = move.shape[1] - 1
    at = np.where(move != 0.0, np.arange(last + 1), last)
    at = np.minimum.accumulate(at[:, ::-1], axis=1)[:, ::-1]
    return np.take_along_axis(move, at, axis=1)
