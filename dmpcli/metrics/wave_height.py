"""Wave height: how far a stroke swings across its start-goal line, from peak to trough."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers

PROMINENCE = 0.10
"""Least prominence of an extremum, as a share of the signal's range."""

LINE = 0.008
"""A stroke is a line where it swings across by less than this share of the start-goal distance."""

_FEW, _PASSES = 32, 64
"""Corners of a stroke that are simply walked over; how often the small swings are looked for."""

_TURNS = 16
"""Turning points that there is room for to each stroke, before they are counted."""


@dataclass(frozen=True)
class WaveHeights:
    """The turning points of a stroke and the heights between them.

    Attributes
    ----------
    index : array, shape (m,)
        Where the extrema lie, in samples; fractional, since a parabola refines them.
    value : array, shape (m,)
        Signed distance across the start-goal line there, mm.
    heights : array, shape (m - 1,) or (0,)
        ``|value[i] - value[i + 1]|``, mm.
    """

    index: Floats
    value: Floats

    @property
    def heights(self) -> Floats:
        """Heights between consecutive extrema, mm."""
        return np.abs(np.diff(self.value))

    @property
    def mean(self) -> float | None:
        """Mean height, mm; None where there is no wave."""
        return float(self.heights.mean()) if self.heights.size else None

    @property
    def spread(self) -> float | None:
        """Largest less smallest height, mm; None where there is no wave."""
        return float(np.ptp(self.heights)) if self.heights.size else None

    def at(self, samples: Floats) -> Floats:
        """Read a column (t, position, ...) at the extrema, linearly between samples.

        Parameters
        ----------
        samples : array, shape (n,) or (n, k)

        Returns
        -------
        array, shape (m,) or (m, k)
        """
        grid = np.arange(len(samples))
        if samples.ndim == 1:
            return np.interp(self.index, grid, samples)
        return np.column_stack([np.interp(self.index, grid, column) for column in samples.T])


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


def wave_heights(v: Floats, prominence: float = PROMINENCE, length: float = 0.0) -> WaveHeights:
    """Heights between consecutive extrema of one open stroke; see `many_waves`.

    Parameters
    ----------
    v : array, shape (n,)
        Signed distance across the start-goal line, mm.
    prominence : float
        Share of v's range, above 0.
    length : float
        Start-goal distance, mm.

    Returns
    -------
    WaveHeights
        Without any extremum for a line, and where v is constant.
    """
    v = np.asarray(v, dtype=float)[None]
    waves = many_waves(v, np.array([length]), np.zeros(1, dtype=bool), prominence)
    return WaveHeights(waves.index, waves.value)


def stroke_wave(position: Floats, start: Floats, goal: Floats, normal: Floats) -> WaveHeights:
    """Wave heights of an open stroke on a plane; none for a line.

    Parameters
    ----------
    position : array, shape (n, 3)
        mm, base frame.
    start, goal : array, shape (3,)
        Ends of the start-goal line, mm.
    normal : array, shape (3,)
        Normal of the plane, on the tool's side.

    Returns
    -------
    WaveHeights
        Its values are the signed distances of `lateral`.
    """
    length = float(np.linalg.norm(np.subtract(goal, start)))
    return wave_heights(lateral(position, start, goal, normal), length=length)


def lateral(position: Floats, start: Floats, goal: Floats, normal: Floats) -> Floats:
    """Signed distance across the start-goal line, along v = n × u.

    Parameters
    ----------
    position : array, shape (n, 3)
        mm.
    start, goal : array, shape (3,)
        Apart from each other, mm.
    normal : array, shape (3,)
        Not along the line; only its part square to the line matters.

    Returns
    -------
    array, shape (n,)
        mm.
    """
    v = np.cross(normal, np.subtract(goal, start))
    return np.asarray((position - start) @ (v / np.linalg.norm(v)))


def many_waves(
    v: Floats,
    length: Floats,
    closed: Booleans,
    prominence: float = PROMINENCE,
    compiled: bool = False,
) -> ManyWaves:
    """Wave heights of strokes with as many samples each; none for lines and closed strokes.

    An extremum counts when the signal falls (or rises) away from it on both sides by at least
    `prominence` times the signal's range; the ends never count. Peaks and troughs alternate. Each
    is refined by the parabola through its sample and both neighbours.

    Parameters
    ----------
    v : array, shape (B, n)
        Signed distances across the start-goal lines, mm; n ≥ 2.
    length : array, shape (B,)
        Start-goal distances, mm.
    closed : array, shape (B,)
    prominence : float
        Share of v's range, above 0.
    compiled : bool
        Whether by kernels: the same.
    """
    if compiled:
        stroke, at = _turning_points_walked(v, length, closed, prominence)
    else:
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
    """Find where signals turn back by `least` or more, having come as far; peaks, troughs in turn.

    One walk over each signal's own corners, all signals in step: a candidate becomes an extremum
    once v has moved away from it by `least`. The first candidate so confirmed is where the signal
    set out from, not an extremum: v had not come to it by `least`.
    """
    count = len(v)
    stroke, sample = _without_ripple(v, least, *_corners(v))
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
        counts = turned & (way[on] != 0)
        found.append((on[counts], np.where(peak, high[on], low[on])[counts]))
        low[on[peak]], high[on[trough]] = i[peak], i[trough]
        way[on[turned]] = np.where(peak, -1, 1)[turned]
    if not found:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    strokes, samples = (np.concatenate(list(part)) for part in zip(*found, strict=True))
    order = np.argsort(strokes, kind="stable")
    return strokes[order], samples[order]


def _turning_points_walked(
    v: Floats, length: Floats, closed: Booleans, prominence: float
) -> tuple[Integers, Integers]:
    """Find the same by kernels, of the strokes that may have waves."""
    from dmpcli.metrics.kernels import strokes

    v = np.ascontiguousarray(v)
    swing = strokes.swings(v)
    looked = (swing >= LINE * length) & ~closed & (swing > 0.0)
    room = _TURNS * len(v)
    while True:
        stroke, at = np.empty((2, room), dtype=np.int64)
        held = strokes.turning_points(v, prominence * swing, looked, stroke, at)
        if held <= room:
            return stroke[:held], at[:held]
        room = held


def _without_ripple(
    v: Floats, least: Floats, stroke: Integers, sample: Integers
) -> tuple[Integers, Integers]:
    """Take out pairs of corners that no extremum can come of, so that noise costs few steps.

    A swing below `least` that is smaller than both of its neighbours is passed over by the walk.
    """
    for _ in range(_PASSES):
        if len(stroke) <= _FEW * len(v):
            break
        swing = np.abs(np.diff(v[stroke, sample]))
        within = stroke[1:] == stroke[:-1]
        small = within[1:-1] & within[:-2] & within[2:] & (swing[1:-1] < least[stroke[1:-2]])
        # Of equal extrema the first one counts.
        small &= (swing[1:-1] <= swing[:-2]) & (swing[1:-1] < swing[2:])
        gone = np.flatnonzero(small) + 1
        if not len(gone):
            break
        kept = np.ones(len(stroke), dtype=bool)
        kept[gone] = kept[gone + 1] = False
        stroke, sample = stroke[kept], sample[kept]
    return stroke, sample


def _corners(v: Floats) -> tuple[Integers, Integers]:
    """Both ends, and where v changes direction (the first sample of a level stretch)."""
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
