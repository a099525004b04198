"""Intervals of a smoothing spline halved where noise does not explain what it leaves: at corners.

Three searches, each for what the one before cannot see. Sliding means and peaks of the residual are
held against the noise, of all places so many may be wrong. Of the most doubtful ones that are left
it is tried by how much the squares fall about each if its intervals are halved. And as a corner
makes all intervals short where they are to be uniform, it is tried whether fewer ones, halved so,
explain the samples with fewer coefficients.
"""

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.dmp import least_squares
from dmpcli.dmp.least_squares import Design
from dmpcli.dmp.noise import Noise

# Noise below this part of the largest value is rounding.
ROUNDING = 1e-13
# Sliding means of the residual that noise must explain; those that tell of one place.
_WINDOWS = (1, 2, 8, 32, 128, 512)
_NARROW = (1, 2, 4, 8)
# Part of the places found that may be noise (Y. Benjamini and Y. Hochberg, J. R. Statist. Soc. B
# 57, 1995): so often are intervals halved of which none should be; and where some were.
_FALSE_FIRST, _FALSE = 0.005, 0.1
# Times that intervals are halved, and samples that the smallest holds, and the smallest at an end:
# a spline that is told so little from one side swings beyond its last sample.
_HALVINGS = 12
_SMALLEST, _SMALLEST_AT_END = 1.0, 2.0
# Chance by which noise alone makes a place worth a trial, and by which a trial may succeed by it:
# any of all, and each beside intervals that were halved, as a corner's mostly are not enough.
_TRIED, _ANYWHERE, _BESIDE = 1e-2, 5e-3, 3e-3
# Second differences of samples, in standard deviations of the noise, from which on intervals may
# hold less than two: what such ones follow of the noise is 2.4 on each axis.
_BENT = 15.0
# Samples, less rounding, that an interval holds whose halves hold two.
_HALVES_HOLD_TWO = 4.0 - 1e-8
# What a coefficient costs, in variances (Mallows).
_COST = 2.0
# Intervals within which one place is tried at a time, and within which its squares are counted.
_APART, _ABOUT = 8, 5
# Intervals are as short as those of a corner where they are shorter than this part of the longest.
_SHORT = 0.75
# Variances by which fewer intervals, halved, must explain the samples better.
_CLEARLY = 8.0
# Fewest of them.
_FEWEST = 4
# Samples that are laid splines through for the second and the third search, at most.
_EFFORT = 500_000


def refined(
    design: Design, c: Floats, x: Floats, noise: Noise, variance: float
) -> tuple[Design, Floats] | None:
    """Halve intervals where noise does not explain the residual.

    Parameters
    ----------
    design : Design
        Of K uniform intervals.
    c : array, shape (K + 5, D)
        Their least-squares coefficients.
    x : array, shape (T, D)
        Samples.
    noise : Noise
    variance : float
        Of the noise, over all D.

    Returns
    -------
    (Design, array) or None
        None where intervals would be halved everywhere.
    """
    best = halved(design, c, x, noise)
    rounds = min(_HALVINGS, _EFFORT // len(x))
    if noise.kind != "white" or noise.typical == 0.0 or rounds == 0:
        return best
    least = np.inf
    if best is not None:
        best = _tried(*best, x, noise, rounds)
        least = cost(*best, x, variance)
    # Intervals of 1, 2, 4 ... samples: the shortest then hold one, and not nearly two.
    halvings = int(np.ceil(np.log2(2.0 * (len(x) - 1) / design.intervals)))
    fewer = (len(x) - 1) >> halvings
    if fewer >= _FEWEST and rounds == _HALVINGS:
        coarse = least_squares.uniform(len(x), fewer)
        other = halved(coarse, coarse.coefficients(x), x, noise)
        if other is not None:
            other = _tried(*other, x, noise, rounds)
            if cost(*other, x, variance) < least - _CLEARLY:
                return other
    return best


def cost(design: Design, c: Floats, x: Floats, variance: float) -> float:
    """Mallows' Cp, in variances.

    Parameters
    ----------
    design : Design
    c : array, shape (design.size, D)
        Its coefficients.
    x : array, shape (T, D)
        Samples.
    variance : float
        Of the noise, over all D.
    """
    residual = x - design.values(c)
    return float(np.sum(residual**2)) / variance + _COST * design.size


def halved(design: Design, c: Floats, x: Floats, noise: Noise) -> tuple[Design, Floats] | None:
    """Halve intervals where sliding means of the residual are doubted; None if everywhere.

    Parameters
    ----------
    design : Design
    c : array, shape (design.size, D)
        Its least-squares coefficients.
    x : array, shape (T, D)
        Samples.
    noise : Noise

    Returns
    -------
    (Design, array) or None
        With coefficients fitted anew wherever intervals were halved; those given, where none was.
    """
    for i in range(_HALVINGS):
        doubted = _doubted(x - design.values(c), design, noise, x, i == 0)
        if not doubted.any():
            break
        marked = np.zeros(design.intervals + 2, dtype=bool)
        marked[_interval(design, np.flatnonzero(doubted)) + 1] = True
        marked = (marked[1:-1] | marked[:-2] | marked[2:]) & _divisible(design)
        if not marked.any():
            break
        if 2 * (design.intervals + int(marked.sum())) >= design.count:
            return None
        design, c = _split(design, marked, x)
    return design, c


def _interval(design: Design, samples: Integers) -> Integers:
    """Intervals that hold samples."""
    place = design.first + design.step * samples
    at = np.searchsorted(design.breaks, place, side="right") - 1
    return np.asarray(np.minimum(at, design.intervals - 1))


def _divisible(design: Design) -> Booleans:
    """Intervals whose halves are not too small, shape (K,)."""
    smallest = np.full(design.intervals, _SMALLEST)
    smallest[[0, -1]] = _SMALLEST_AT_END
    # Less than rounding short of a sample is one.
    return np.asarray(np.diff(design.breaks) >= (2.0 - 1e-9) * smallest * design.step)


def _split(design: Design, marked: Booleans, x: Floats) -> tuple[Design, Floats]:
    """Halve marked intervals, and fit again."""
    middles = 0.5 * (design.breaks[:-1] + design.breaks[1:])[marked]
    breaks = np.insert(design.breaks, np.flatnonzero(marked) + 1, middles)
    design = Design(design.count, design.first, design.step, breaks, False)
    return design, design.coefficients(x)


def _tried(
    design: Design, c: Floats, x: Floats, noise: Noise, rounds: int
) -> tuple[Design, Floats]:
    """Halve intervals about doubtful places where that is worth its coefficients."""
    from scipy.special import chdtrc

    axes = x.shape[1]
    longest = float(np.diff(design.breaks).max())
    sigma2 = noise.largest**2
    done: set[float] = set()
    for _ in range(rounds):
        residual = x - design.values(c)
        places = _places(residual, design, noise, done)
        K, width = design.intervals, np.diff(design.breaks)
        if not places or 2 * (K + sum(len(on) for _, on in places)) >= design.count:
            break
        marked = np.zeros(K, dtype=bool)
        for _, on in places:
            marked[on] = True
        trial, changed = _split(design, marked, x)
        values = trial.values(changed)
        less = np.sum(residual**2 - (x - values) ** 2, axis=1)
        sums = np.concatenate([[0.0], np.cumsum(less)])
        marked[:] = False
        for at, on in places:
            edges = design.breaks[[max(0, at - _ABOUT), min(K, at + _ABOUT + 1)]]
            first, end = np.clip(
                np.ceil((edges - design.first) / design.step).astype(int), 0, design.count
            )
            gain = float(sums[end] - sums[first]) / sigma2
            freedom = axes * len(on)
            chance = float(chdtrc(freedom, max(gain, 0.0)))
            beside = width[max(0, at - 3) : at + 4].min() < _SHORT * longest
            if width[on].min() < _HALVES_HOLD_TWO * design.step:
                bend = np.linalg.norm(np.diff(values[first:end], 2, axis=0), axis=1)
                if bend.max(initial=0.0) < _BENT * noise.largest:
                    continue
            marked[on] = chance < (_BESIDE if beside else _ANYWHERE / K)
        if not marked.any():
            break
        design, c = _split(design, marked, x)
    return design, c


def _places(
    residual: Floats, design: Design, noise: Noise, done: set[float]
) -> list[tuple[int, list[int]]]:
    """Intervals with the most doubtful samples, and which about each to halve.

    Places that were tried are `done`, and new ones become so.
    """
    from scipy.special import chdtri

    most = _squares(residual, noise.largest, 0.0, _NARROW, len(residual)).max(axis=0)
    order = np.argsort(-most, kind="stable")
    order = order[most[order] > chdtri(residual.shape[1], _TRIED)]
    width, divisible = np.diff(design.breaks), _divisible(design)
    taken = np.zeros(design.intervals, dtype=bool)
    found = []
    for at in _interval(design, order).tolist():
        if taken[max(0, at - _APART) : at + _APART + 1].any():
            continue
        near = range(max(0, at - 1), min(design.intervals, at + 2))
        on = [i for i in near if divisible[i] and width[i] < 1.5 * width[at]]
        middle = round(float(design.breaks[at] + design.breaks[at + 1]), 9)
        if not on or middle in done:
            continue
        taken[at] = True
        done.add(middle)
        found.append((at, on))
    return found


def _doubted(residual: Floats, design: Design, noise: Noise, x: Floats, first: bool) -> Booleans:
    """Samples in the middle of a sliding mean, or on a peak, that noise does not explain, (n,)."""
    from scipy.special import chdtrc, chdtri

    count, dimensions = residual.shape
    sigma = max(noise.largest, ROUNDING * float(np.max(np.abs(x))))
    # Rounding to a lattice may hold on for as long as the tool is slow.
    lattice = 0.0 if noise.step is None else 0.5 * noise.step * np.sqrt(dimensions)
    longest = count / (2 * design.intervals)
    squares = _squares(residual, sigma, lattice, _WINDOWS, max(longest, _WINDOWS[3]))
    # Of the places found so many may be none; where one corner is found there are more.
    share = _FALSE_FIRST if first else _FALSE
    candidates = np.sort(squares[squares > chdtri(dimensions, share)])[::-1]
    false = chdtrc(dimensions, candidates) * squares.size / np.arange(1, len(candidates) + 1)
    found = np.flatnonzero(false <= share)
    if len(found) == 0:
        return np.zeros(count, dtype=bool)
    return np.asarray(np.any(squares >= candidates[found[-1]], axis=0))


def within(residual: Floats, sigma: float, windows: tuple[int, ...], chance: float) -> bool:
    """Whether sliding means of a residual (n, D), and its peaks, are as small as those of noise.

    Parameters
    ----------
    residual : array, shape (n, D)
    sigma : float
        Of the noise along each axis.
    windows : tuple of int
        Samples of the means; increasing.
    chance : float
        By which one of all is larger.
    """
    from scipy.special import chdtri

    count, dimensions = residual.shape
    most = sigma**2 * float(chdtri(dimensions, chance / ((len(windows) + 1) * count)))
    sums = np.concatenate([np.zeros((1, dimensions)), np.cumsum(residual, axis=0)])
    for window in windows:
        if window > count:
            break
        means = sums[window:] - sums[:-window]
        if np.einsum("td,td->t", means, means).max() > most * window:
            return False
    peaks = residual[1:-1] - 0.5 * (residual[:-2] + residual[2:])
    return bool(np.einsum("td,td->t", peaks, peaks).max(initial=0.0) <= 1.5 * most)


def _squares(
    residual: Floats, sigma: float, lattice: float, windows: tuple[int, ...], longest: float
) -> Floats:
    """Squares of sliding means at their middles, and of peaks, in those that noise has, (W + 1, n).

    Of windows up to `longest` samples; less than `lattice` is nothing.
    """
    count, dimensions = residual.shape
    sums = np.concatenate([np.zeros((1, dimensions)), np.cumsum(residual, axis=0)])
    squares = np.zeros((len(windows) + 1, count))
    for row, window in zip(squares, windows, strict=False):
        if window > count or window > longest:
            break
        means = (sums[window:] - sums[:-window]) / window
        far = np.sqrt(np.einsum("td,td->t", means, means)) - lattice
        row[window // 2 : window // 2 + len(far)] = window * np.maximum(far / sigma, 0.0) ** 2
    if lattice == 0.0:
        # At a corner the residual swings to and fro.
        peaks = residual[1:-1] - 0.5 * (residual[:-2] + residual[2:])
        squares[-1, 1:-1] = np.einsum("td,td->t", peaks, peaks) / (1.5 * sigma**2)
    return squares
