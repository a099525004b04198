"""Parts of a stroke with a timing of their own: from rest to rest, on the stroke's own path."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Booleans, Floats
from dmpcli.dmp.time_scaling import timing
from dmpcli.dmp.tool_speed import Pace, passed

LEAST_LENGTH = 5.0
"""Shorter pieces of a stroke that is split are left out, mm."""

_EASE = 0.5
"""Soft start and end of a piece where the stroke itself goes on, s."""

Span = tuple[float, float]
"""Stroke times at which a part begins and ends."""


@dataclass(frozen=True)
class Path:
    """A stroke as it is drawn, close together.

    Attributes
    ----------
    stroke : array, shape (N,)
        Stroke times, increasing, s.
    position : array, shape (N, 3)
        mm.
    """

    stroke: Floats
    position: Floats

    def within(self, span: Span) -> "Path":
        """Return the part between two stroke times, with both ends."""
        first, last = span
        inner = (self.stroke > first) & (self.stroke < last)
        at = np.concatenate([[first], self.stroke[inner], [last]])
        ends = np.stack([np.interp(span, self.stroke, self.position[:, i]) for i in range(3)], -1)
        return Path(at, np.concatenate([ends[:1], self.position[inner], ends[1:]]))


def inside(stroke: Floats, position: Floats, outside: Booleans, least: float) -> list[Span]:
    """Parts of a stroke between those that are outside.

    Parameters
    ----------
    stroke : array, shape (T,)
        Stroke times, s.
    position : array, shape (T, 3)
        mm.
    outside : array of bool, shape (T,)
    least : float
        Shorter parts are left out, mm.

    Returns
    -------
    list of Span
        From the first to the last sample of each part.
    """
    marks = np.concatenate([[True], outside, [True]])
    change = np.flatnonzero(marks[1:] != marks[:-1])
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(position, axis=0), axis=1))])
    firsts, lasts = change[::2], change[1::2] - 1
    long = (arc[lasts] - arc[firsts] >= least) & (stroke[lasts] > stroke[firsts])
    ends = zip(stroke[firsts[long]].tolist(), stroke[lasts[long]].tolist(), strict=True)
    return list(ends)


def retimed(
    spans: Sequence[Span],
    before: Floats,
    path: Path | None,
    pace: Pace | None,
    rate: float,
    scale: float,
    eases: tuple[float, float],
) -> tuple[Floats, list[tuple[int, int]]]:
    """Stroke times of a stroke whose parts go from rest to rest; between them it stays as it was.

    Parameters
    ----------
    spans : sequence of Span
    before : array, shape (T,)
        Stroke times as the stroke was drawn, s.
    path : Path, optional
        For a pace.
    pace : Pace, optional
        Without it a part keeps the stroke's speed, but for soft ends.
    rate : float
        Samples per second, Hz.
    scale : float
        Seconds that a second of stroke time takes.
    eases : tuple of float
        Soft start and end of the whole stroke as asked for, s.

    Returns
    -------
    array, shape (K,)
        Stroke times, not decreasing, from the first of `before` to its last.
    list of tuple of int
        Where each part begins among them, and where what follows it begins.
    """
    done: list[Floats] = []
    cuts: list[tuple[int, int]] = []
    count, last = 0, -np.inf
    for span in spans:
        between = before[(before > last) & (before < span[0])]
        if pace is not None and path is not None:
            part = path.within(span)
            new = passed(part.stroke, part.position, pace, rate)
        else:
            new = _eased(span, before, rate, scale, eases)
        done += [between, new]
        count += len(between) + len(new)
        cuts.append((count - len(new), count))
        last = span[1]
    return np.concatenate([*done, before[before > last]]), cuts


def _eased(
    span: Span, before: Floats, rate: float, scale: float, eases: tuple[float, float]
) -> Floats:
    first, last = span
    seconds = scale * (last - first)
    soft = [min(_EASE, seconds), min(_EASE, seconds)]
    # An end that is the stroke's own is as soft as it was asked to be.
    for i, own in enumerate((first <= before[0], last >= before[-1])):
        soft[i] = min(eases[i], seconds) if own else soft[i]
    when = timing(seconds, rate, last - first, 1.0, *soft)
    new: Floats = np.minimum(first + when.stroke, last)
    new[-1] = last
    return new
