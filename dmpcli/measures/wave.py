"""Wave height: how far a stroke swings across its start-goal line, from peak to trough."""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers

PROMINENCE = 0.10
"""Least prominence of an extremum, as a share of the signal's range."""

LINE = 0.008
"""A stroke is a line where it swings across by less than this share of the start-goal distance."""


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


def wave_heights(v: Floats, prominence: float = PROMINENCE) -> WaveHeights:
    """Heights between consecutive extrema of a signal.

    An extremum counts when the signal falls (or rises) away from it on both sides by at least
    `prominence` times the signal's range; the ends never count. Peaks and troughs alternate. Each
    is refined by the parabola through its sample and both neighbours.

    Parameters
    ----------
    v : array, shape (n,)
        Signed distance across the start-goal line, mm.
    prominence : float
        Share of v's range, above 0.

    Returns
    -------
    WaveHeights
        Without any extremum where v is constant.
    """
    v = np.asarray(v, dtype=float)
    found = _turning_points(v, prominence * float(np.ptp(v)))
    index, value = _refined(v, found)
    return WaveHeights(index, value)


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
    v = lateral(position, start, goal, normal)
    if np.ptp(v) < LINE * np.linalg.norm(np.subtract(goal, start)):
        return WaveHeights(np.empty(0), np.empty(0))
    return wave_heights(v)


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


def _turning_points(v: Floats, least: float) -> Integers:
    """Find where v turns back by `least` or more, having come as far; peaks and troughs in turn.

    One walk over the signal's own turning points: a candidate becomes an extremum once v has
    moved away from it by `least`. The first candidate so confirmed is where the signal set out
    from, not an extremum: v had not come to it by `least`.
    """
    if least <= 0.0:
        return np.empty(0, dtype=np.int64)
    own = _corners(v)
    found: list[int] = []
    low = high = int(own[0])
    rising: bool | None = None
    for i in own.tolist():
        if rising is not False and v[i] > v[high]:
            high = i
        if rising is not True and v[i] < v[low]:
            low = i
        if rising is not False and v[high] - v[i] >= least:
            found.append(high)
            rising, low = False, i
        elif rising is not True and v[i] - v[low] >= least:
            found.append(low)
            rising, high = True, i
    return np.array(found[1:], dtype=np.int64)


def _corners(v: Floats) -> Integers:
    """Both ends, and every sample where v changes direction (the first one of a level stretch)."""
    moves: Booleans = np.concatenate([[True], np.diff(v) != 0.0])
    kept = np.flatnonzero(moves)
    turns = np.flatnonzero(np.diff(np.sign(np.diff(v[kept]))) != 0.0) + 1
    return np.concatenate([[0], kept[turns], [len(v) - 1]]).astype(np.int64)


def _refined(v: Floats, i: Integers) -> tuple[Floats, Floats]:
    before, here, after = v[i - 1], v[i], v[i + 1]
    bend = before - 2.0 * here + after
    offset = np.divide(0.5 * (before - after), bend, out=np.zeros(len(i)), where=bend != 0.0)
    return i.astype(float) + offset, here - 0.25 * (before - after) * offset
