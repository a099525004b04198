"""How well several demonstrations of one stroke agree, and which of them does not belong."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from dmpcli.arrays import Floats, Integers

Kind = Literal["opposite", "start", "shape", "outlier"]

# A doubt that another reading of the path explains: it takes two thirds off the distance, which is
# this part of the extent or more.
_EXPLAINED = 1.0 / 3.0
_NOTABLE = 0.03
# Another shape: its RMS distance is this part of the extent. Of the 26 shapes of the LASA set that
# people drew seven times, no stroke is so far from the others.
_SHAPE = 0.25
# Shapes whose mean path is shorter than the shortest of them by more than this part cancel each
# other: a bulge to the left and one to the right. Of people's strokes of one shape the mean loses
# 3 % at most.
_CANCELLED = 0.07
# An outlier is this many times as far from the others as they are from each other (of the LASA
# set's strokes, taken by three, about one group in a hundred has one; taken by seven, none) ...
_OUTLYING = 5.0
# ... and by this part of the extent at least, and this many deviations of the noise.
_SMALLEST = 0.03
_NOISE = 4.0
# A path whose ends are nearer than this part of its extent may have been begun elsewhere.
_CLOSED = 0.25


@dataclass(frozen=True)
class Doubt:
    """A demonstration that differs from the others.

    Attributes
    ----------
    index : int
        Of the demonstration, from 0.
    kind : {'opposite', 'start', 'shape', 'outlier'}
        Drawn in the opposite direction; closed, and begun at another place; of another shape; or
        merely far away.
    distance : float
        RMS distance from the mean of the others, mm.
    shift : float
        Of 'start': the part of the length, from 0 to 1, at which the others' start lies on it;
        else 0.
    """

    index: int
    kind: Kind
    distance: float
    shift: float = 0.0


def pooled_mean(x: Floats) -> Floats:
    """Mean over the first axis, the same to the last bit in any order of its entries.

    Parameters
    ----------
    x : array, shape (n, ...)

    Returns
    -------
    array, shape (...)
    """
    # Ties of the time warping must not be decided by rounding; Neumaier's sum keeps what it loses.
    total = np.zeros(x.shape[1:])
    lost = np.zeros(x.shape[1:])
    for row in np.sort(x, axis=0):
        following = total + row
        larger = np.abs(total) >= np.abs(row)
        lost += np.where(larger, (total - following) + row, (row - following) + total)
        total = following
    return np.asarray((total + lost) / len(x))


def spread(x: Floats) -> Floats:
    """Standard deviation over the demonstrations, at each of the common times.

    Parameters
    ----------
    x : array, shape (n, M, C)

    Returns
    -------
    array, shape (M, C)
        Of the n as they are (ddof = 0), so that the same demonstrations twice give the same.
    """
    return np.sqrt(pooled_mean((x - pooled_mean(x)) ** 2))


def distances(x: Floats) -> Floats:
    """RMS distance of each demonstration from the mean of the others.

    Parameters
    ----------
    x : array, shape (n, M, D)
        Aligned, mm.

    Returns
    -------
    array, shape (n,)
        mm; 0 for one alone.
    """
    n = len(x)
    if n == 1:
        return np.zeros(1)
    off = x - pooled_mean(x)
    return np.asarray(n / (n - 1) * np.sqrt(np.mean(np.sum(off**2, axis=2), axis=1)))


def extent(x: Floats) -> float:
    """Diagonal of the mean path's box, mm."""
    return float(np.linalg.norm(np.ptp(pooled_mean(x), axis=0)))


def reversals(x: Floats) -> list[Doubt]:
    """Find the demonstrations that run the other way, or begin elsewhere on a closed path.

    Each is compared with the one in the midst of all: as it is, and reversed (as recorded, and as
    its own chart, with u from its start to its goal, shows it: turned by 180 degrees). Closed paths
    are compared from each start, about their centres.

    Parameters
    ----------
    x : array, shape (n, P, D)
        At even arc length, mm; the first two coordinates along and across.

    Returns
    -------
    list of Doubt
    """
    n = len(x)
    if n < 2:
        return []
    apart = _apart(x)
    midst = x[int(np.argmin(np.median(apart, axis=1)))]
    size = float(np.linalg.norm(np.ptp(midst, axis=0)))
    away = distances(x)
    doubts = []
    for i, path in enumerate(x):
        distance = _rms(path - midst)
        if distance <= _NOTABLE * size:
            continue
        if min(_rms(other - midst) for other in _reversed(path)) <= _EXPLAINED * distance:
            doubts.append(Doubt(i, "opposite", float(away[i])))
        elif _closed(path) and _closed(midst):
            shift, left = _rotated(path, midst)
            _, backward = _rotated(path[::-1], midst)
            if min(left, backward) <= _EXPLAINED * distance:
                start = left <= backward
                doubts.append(
                    Doubt(i, "start", float(away[i]), shift)
                    if start
                    else Doubt(i, "opposite", float(away[i]))
                )
    if sum(d.kind == "opposite" for d in doubts) * 2 > n:
        # The one in the midst is of the minority: it and its like run the other way.
        against = {d.index for d in doubts if d.kind == "opposite"}
        others = [Doubt(i, "opposite", float(away[i])) for i in range(n) if i not in against]
        return sorted(
            [d for d in doubts if d.kind != "opposite"] + others, key=lambda d: (d.index, d.kind)
        )
    return doubts


def strangers(x: Floats, noise: Floats, apart_from: Integers) -> list[Doubt]:
    """Find demonstrations of another shape, and outliers.

    Of another shape is also the farthest of some whose mean is no stroke of theirs, however small
    their distances: two waves to either side are half their height apart, and their mean is a line.
    An outlier is far from the others by S_n's measure of scatter (Rousseeuw and Croux, J. Am. Stat.
    Assoc. 88(424), 1993, 1273-1283): its median distance to all, itself included, is `_OUTLYING`
    times the median of such distances. It takes three to tell.

    Parameters
    ----------
    x : array, shape (n, M, D)
        Aligned, mm.
    noise : array, shape (n,)
        Standard deviation of each, mm.
    apart_from : array of int
        Demonstrations that are doubted already: neither judged nor judging.

    Returns
    -------
    list of Doubt
    """
    judged = np.setdiff1d(np.arange(len(x)), apart_from)
    if len(judged) < 2:
        return []
    apart = _apart(x[judged])
    typical = np.median(apart, axis=1)
    size = extent(x[judged])
    away = distances(x[judged])
    midst = int(np.argmin(typical))
    size = max(size, float(np.linalg.norm(np.ptp(x[judged[midst]], axis=0))))
    doubts = []
    for k, i in enumerate(judged.tolist()):
        floor = max(_SMALLEST * size, _NOISE * float(noise[i]))
        if apart[k, midst] > _SHAPE * size:
            doubts.append(Doubt(i, "shape", float(away[k])))
        elif len(judged) > 2 and typical[k] > max(_OUTLYING * float(np.median(typical)), floor):
            doubts.append(Doubt(i, "outlier", float(away[k])))
    if not doubts and _cancelled(x[judged]):
        k = int(np.argmax(apart[:, midst]))
        doubts.append(Doubt(int(judged[k]), "shape", float(away[k])))
    return doubts


def _cancelled(x: Floats) -> bool:
    """Whether the mean path is clearly shorter than any of the paths (n, M, D)."""
    steps = np.diff(np.concatenate([x, pooled_mean(x)[None]]), axis=1)
    *lengths, mean = np.linalg.norm(steps, axis=2).sum(axis=1).tolist()
    return bool(mean < (1.0 - _CANCELLED) * min(lengths))


def _rms(difference: Floats) -> float:
    return float(np.sqrt(np.mean(np.sum(difference**2, axis=1))))


def _apart(x: Floats) -> Floats:
    """RMS distance of each from each, shape (n, n)."""
    flat = np.reshape(x, (len(x), -1))
    return np.array([np.sqrt(np.sum((flat - a) ** 2, axis=1) / x.shape[1]) for a in flat])


def _reversed(path: Floats) -> list[Floats]:
    """The path drawn backward: in the same chart, and in the chart of its own start and goal."""
    backward = path[::-1]
    if _closed(path):
        return [backward]
    turned = backward - backward[0]
    turned[:, :2] *= -1.0
    return [backward, turned + path[0]]


def _closed(path: Floats) -> bool:
    return bool(
        np.linalg.norm(path[-1] - path[0]) <= _CLOSED * np.linalg.norm(np.ptp(path, axis=0))
    )


def _rotated(path: Floats, other: Floats) -> tuple[float, float]:
    """Shift of the start, from 0 to 1, that brings a closed path closest, and the RMS then."""
    a = path[:-1] - path[:-1].mean(axis=0)
    b = other[:-1] - other[:-1].mean(axis=0)
    turns = np.fft.rfft(a, axis=0) * np.conj(np.fft.rfft(b, axis=0))
    k = int(np.argmax(np.fft.irfft(turns, len(a), axis=0).sum(axis=1)))
    return k / len(a), _rms(np.roll(a, -k, axis=0) - b)
