"""Corners of a recording: where its velocity jumps, and when, to a part of a sample.

A corner is in no band: of a smoothing spline's error it is the largest by far. Told apart from a
bend by the narrowest stretch in which a kink is significant (R. Baranowski, Y. Chen and
P. Fryzlewicz, J. R. Statist. Soc. B 81, 2019), and likelier than a bend. Its time is where what
goes before and what comes after are nearest each other: known within about σ of the way.
"""

from functools import lru_cache
from itertools import accumulate
from math import ceil, floor, log

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp import gram_polynomials
from dmpcli.dmp.noise import Noise

Candidate = tuple[float, float]
"""A sample at which there may be a corner, and within how many it lies."""

# Chance by which noise alone makes one corner anywhere.
_CHANCE = 1e-3
# Samples to either side that are looked at: of the recording, and of means of 2, 4, 8 … of it.
_REACHES, _FURTHER = (4, 6, 8, 11), (8, 11)
# What a stretch may hold but for a kink, what would be as likely there instead of one, by powers
# of time; of stretches that are straight but for it, and of curved ones.
_STRAIGHT, _CURVED = ((0, 1), 2), ((0, 1, 2, 3), 4)
# Fewest samples by which a candidate may be off.
_DOUBTED = 2.0
# Rounds of looking for the time, and samples within which it is found.
_ROUNDS, _FOUND = 10, 0.02
# Highest degree of what goes before and after, and the chance by which a stretch is another one.
_HIGHEST, _ANOTHER = 3, 1e-3


def candidates(x: Floats, noise: Noise, straight: bool, of: int | None = None) -> list[Candidate]:
    """Samples at which there may be a corner.

    Parameters
    ----------
    x : array, shape (T, D)
        Even samples.
    noise : Noise
        White.
    straight : bool
        Whether the stroke is taken for straight about a corner: weaker corners are found, and bends
        taken for such.
    of : int, optional
        Samples of the recording that x is a part of.

    Returns
    -------
    list of Candidate
        Increasing.
    """
    from scipy.special import chdtri

    count, axes = x.shape
    limit = float(chdtri(axes, _CHANCE / (of or count)))
    found: list[Candidate] = []
    each, means, sigma = 1, x, noise.largest
    while len(means) > 2 * _REACHES[0]:
        # Means of `each` samples lie at every `each`th sample from here on.
        first = 0.5 * (each - 1)
        for reach in _REACHES if each == 1 else _FURTHER:
            if 2 * reach + 1 > len(means):
                break
            kink, bend = _likelihoods(means, sigma, reach, straight)
            middle = first + each * (reach + np.arange(len(kink)))
            free = (kink > limit) & (kink > bend)
            for at, within in found:
                free &= np.abs(middle - at) > each * reach + within
            while free.any():
                best = int(np.argmax(np.where(free, kink, -1.0)))
                found.append((float(middle[best]), float(each * reach)))
                free &= np.abs(middle - middle[best]) > 2 * each * reach
        pairs = len(means) // 2
        means = means[: 2 * pairs].reshape(pairs, 2, axes).mean(axis=1)
        each, sigma = 2 * each, sigma / np.sqrt(2.0)
    return sorted(found)


def _likelihoods(x: Floats, sigma: float, reach: int, straight: bool) -> tuple[Floats, Floats]:
    """χ² of a kink, and of a bend, in the middle of every stretch of 2·reach + 1 samples."""
    s = np.arange(-reach, reach + 1) / reach
    held, other = _STRAIGHT if straight else _CURVED
    basis, _ = np.linalg.qr(np.stack([s**power for power in held], axis=1))
    both = []
    for shape in (np.abs(s), s**other):
        kernel = shape - basis @ (basis.T @ shape)
        kernel = kernel[::-1] / (sigma * np.linalg.norm(kernel))
        parts = [np.convolve(column, kernel, "valid") ** 2 for column in x.T]
        both.append(np.sum(parts, axis=0))
    return both[0], both[1]


def doubted(within: float) -> float:
    """Samples to either side of a candidate of which it is not known what they belong to."""
    return max(_DOUBTED, 0.5 * within)


def located(x: Floats, found: list[Candidate], noise: Noise) -> Floats:
    """Times of corners, in samples, shape (P,), increasing.

    Parameters
    ----------
    x : array, shape (T, D)
    found : list of Candidate
        Increasing.
    noise : Noise
    """
    last = len(x) - 1.0
    at = np.array([place for place, _ in found])
    # Samples about a corner count once it is known to which side they belong.
    doubt = np.array([doubted(within) for _, within in found])
    moving = np.ones(len(at), dtype=bool)
    for _ in range(_ROUNDS):
        edges = np.concatenate([[0.0], at, [last]])
        around = np.concatenate([[0.0], doubt, [0.0]])
        new = at.copy()
        for k in np.flatnonzero(moving):
            before = _extrapolated(x, at[k], edges[k] + around[k], at[k] - doubt[k], noise)
            after = _extrapolated(x, at[k], at[k] + doubt[k], edges[k + 2] - around[k + 2], noise)
            if before is None or after is None:
                continue
            gap, jump = after[0] - before[0], after[1] - before[1]
            most = max(1.0, 2.0 * doubt[k])
            step = np.clip(-(gap @ jump) / max(float(jump @ jump), 1e-300), -most, most)
            new[k] = np.clip(at[k] + step, edges[k] + 1.0, edges[k + 2] - 1.0)
        new = np.sort(np.clip(new, 1.0, last - 1.0))
        moving = (np.abs(new - at) > _FOUND) | (doubt > 0.0)
        at = new
        doubt = np.where(doubt > 1.0, 0.25 * doubt, 0.0)
        if not moving.any():
            break
    return at


def _extrapolated(
    x: Floats, at: float, low: float, high: float, noise: Noise
) -> tuple[Floats, Floats] | None:
    """Value and derivative by samples, at a time, of what is in [low, high], shapes (D,)."""
    begin, end = max(0, ceil(low)), min(len(x), floor(high) + 1)
    axes, sigma2 = x.shape[1], noise.largest**2
    size = end - begin
    result = None
    while size >= _HIGHEST:
        # Those next to the corner.
        first = begin if low >= at else end - size
        y = x[first : first + size]
        degree = min(_HIGHEST, size - 2)
        shares = gram_polynomials.at_samples(size, degree).T @ y
        squares: list[float] = np.einsum("kd,kd->k", shares, shares).tolist()
        # Schwarz's criterion: a degree too high throws the corner about.
        dearer = log(size) * axes * sigma2
        saved = list(accumulate(energy - dearer for energy in squares[1:]))
        best = 1 + saved.index(max(saved))
        value, slope = gram_polynomials.at(size, best, at - first, 2) @ shares[: best + 1]
        result = value, slope
        left = float(np.vdot(y, y)) - sum(squares[: best + 1])
        if left <= sigma2 * _squares_by_chance(axes * max(1, size - best - 1)):
            break
        size //= 2
    return result


@lru_cache(maxsize=1 << 14)
def _squares_by_chance(freedom: int) -> float:
    from scipy.special import chdtri

    return float(chdtri(freedom, _ANOTHER))
