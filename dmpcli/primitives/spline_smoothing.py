"""Smoothing splines whose stiffness follows the noise.

Least-squares splines of degree 5. The number of uniform intervals K is the one of least expected
error by Mallows' Cp (C. L. Mallows, Technometrics 15, 1973) over a ladder × 2^(1/4). What the whole
decides can be wrong in one place: where noise does not explain the residual, as at a corner,
intervals are halved there and only there.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dmpcli.arrays import Booleans, Floats
from dmpcli.primitives import least_squares
from dmpcli.primitives.least_squares import DEGREE, Design
from dmpcli.primitives.noise import FEWEST, Noise

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

# Fewest intervals, and rungs of the ladder per octave.
_LEAST = 2
_RUNGS = 4
# Rungs over which Cp has risen at the end of the search.
_RISEN = 3
# What a coefficient costs, in variances. Mallows' 2 is unbiased, but the least of many values is
# not: now and then it is far too soft.
_PENALTY = 3.0
# Samples per interval that the search for K needs; more are averaged.
_DENSE = 12
# Part by which the median square of 1 sample may exceed the mean one of noise, ∝ 1/√n.
_SIGNIFICANT = 1.0
# Residuals count up to so many σ in the search: corners are for the halving.
_CLIP = 3.0
# Sliding means of the residual that noise must explain; probability that noise alone exceeds it.
_WINDOWS = (1, 2, 8, 32, 128, 512)
_CHANCE = 1e-3
# Times that intervals are halved, and samples that the smallest holds, and the smallest at an end:
# a spline that is told so little from one side swings beyond its last sample.
_HALVINGS = 12
_SMALLEST, _SMALLEST_AT_END = 1.0, 2.0
# Part of the stroke's acceleration below which that of noise is not worth smoothing.
_NEGLIGIBLE = 1e-3
# Points of the shape-preserving curve for each sample.
_SHAPED = 4
# Noise below this part of the largest value is rounding.
_ROUNDING = 1e-13
# Conditions at an end, by the derivatives that vanish, and how far the samples may contradict them,
# in variances per condition: at rest, or cubic.
_ENDS = (((1, 2), 3.0), ((3, 4, 5), 2.0), ((4, 5), 2.0), ((5,), 2.0))


@dataclass(frozen=True)
class SmoothSpline:
    """A smoothed recording, at any time of it.

    Attributes
    ----------
    spline : scipy.interpolate.BSpline
        Degree 5, over [0, T] s.
    intervals : int or None
        K; None where it interpolates.
    cutoff : float or None
        K / (2 T), Hz; None where it interpolates.
    noise : Noise
        Of the samples.
    smoothed_noise : float
        Noise that is left, root mean square per axis, σ·sqrt(K/n), unit of the samples.
    removed : float
        Root mean square of what smoothing took off, over all axes, unit of the samples.
    rests : tuple of bool
        Whether the spline begins and ends at rest, since the samples do not contradict it.
    """

    spline: "BSpline"
    intervals: int | None
    cutoff: float | None
    noise: Noise
    smoothed_noise: float
    removed: float
    rests: tuple[bool, bool]

    @property
    def finest(self) -> int:
        """Intervals that there were, were all as short as the shortest."""
        breaks = self.spline.t[DEGREE:-DEGREE]
        return int(np.rint(np.ptp(breaks) / np.diff(breaks).min()))

    def __call__(self, t: Floats, derivative: int = 0) -> Floats:
        """Values or derivatives at times t (S,), s, shape (S, D)."""
        values: Floats = self.spline(t, derivative)
        return values


def smooth(
    x: Floats,
    duration: float,
    noise: Noise,
    cutoff: float | None = None,
    resampled: bool = False,
) -> SmoothSpline:
    """Smooth even samples.

    Parameters
    ----------
    x : array, shape (T, D)
        Even over [0, duration].
    duration : float
        s.
    noise : Noise
        Decides where no cut-off is given.
    cutoff : float, optional
        Hz; K = 2 T · cutoff uniform intervals, free ends, nothing halved.
    resampled : bool
        Whether the samples were interpolated from uneven ones; then an interpolating spline keeps
        their shape too.

    Returns
    -------
    SmoothSpline
        The interpolating spline where K would be half the number of samples or more, and without a
        cut-off from fewer than `FEWEST` samples, which do not tell noise from stroke.
    """
    count = len(x)
    # About its mean, so that a stroke far from the origin loses no digits.
    middle = x.mean(axis=0)
    centred = x - middle
    if cutoff is not None:
        K: int | None = max(1, round(2.0 * duration * cutoff))
    else:
        K = None if _too_little(centred, noise) else _intervals(centred, _variance(centred, noise))
    if K is None or _too_many(K, count):
        return _interpolating(x, duration, noise, resampled)
    design = least_squares.uniform(count, K)
    c = design.coefficients(centred)
    rests = (False, False)
    if cutoff is None:
        halved = _halved(design, c, centred, noise)
        if halved is None:
            return _interpolating(x, duration, noise, resampled)
        design, c = halved
        c, rests = _with_ends(design, c, _variance(centred, noise))
    residual = centred - design.values(c)
    from scipy.interpolate import BSpline

    return SmoothSpline(
        BSpline(design.knots * (duration / design.breaks[-1]), c + middle, DEGREE),
        K,
        K / (2.0 * duration),
        noise,
        noise.typical * float(np.sqrt(design.intervals / count)),
        float(np.sqrt(np.mean(np.sum(residual**2, axis=1)))),
        rests,
    )


def _interpolating(x: Floats, duration: float, noise: Noise, resampled: bool) -> SmoothSpline:
    from scipy.interpolate import PchipInterpolator, make_interp_spline

    t = np.linspace(0.0, duration, len(x))
    if resampled:
        # A quintic through noise of a few samples swings beyond them by as much again; through
        # points of the shape-preserving curve it has no room to.
        fine = np.linspace(0.0, duration, _SHAPED * (len(x) - 1) + 1)
        t, x = fine, np.asarray(PchipInterpolator(t, x, axis=0)(fine))
    degree = DEGREE if len(x) > DEGREE else 3 if len(x) > 3 else 1
    spline = make_interp_spline(t, x, k=degree)
    return SmoothSpline(spline, None, None, noise, noise.typical, 0.0, (False, False))


def _too_many(K: int, count: int) -> bool:
    """Whether K intervals are as good as none: half as many as samples."""
    return count <= 2 * K


def _too_little(x: Floats, noise: Noise) -> bool:
    """Whether there is nothing to smooth: noise whose acceleration is lost in the stroke's own.

    Over T that of noise on n samples is about σn²/T², that of the stroke at least extent/T².
    """
    extent = float(np.linalg.norm(np.ptp(x, axis=0)))
    return len(x) < FEWEST or bool(noise.typical * len(x) ** 2 <= _NEGLIGIBLE * extent)


def _variance(x: Floats, noise: Noise) -> float:
    """Variance of the noise over all axes, at least that of rounding."""
    return float(max(noise.total, x.shape[1] * (_ROUNDING * np.max(np.abs(x))) ** 2))


def _intervals(x: Floats, variance: float) -> int | None:
    """K of least Cp; None where the samples carry half as many intervals or more."""
    count = len(x)
    K = _LEAST
    while True:
        coarse = _averaged(x, _DENSE * K)
        share = variance * len(coarse) / count
        middle = float(np.median(_squares(coarse, count, K)))
        # Half the samples as near as noise explains: the other half may hold corners.
        if middle <= share * (1.0 + _SIGNIFICANT / np.sqrt(len(coarse))):
            return _best(x, variance, K)
        K *= 2
        if _too_many(K, count):
            return None


def _best(x: Floats, variance: float, about: int) -> int | None:
    """Climb the ladder from an octave below, until Cp has risen for three rungs."""
    count = len(x)
    rung, highest = max(0, _rung(about) - _RUNGS + 1), 2 * about
    best, least, at = None, np.inf, rung
    coarse = _averaged(x, _DENSE * highest)
    share = variance * len(coarse) / count
    while True:
        K = _ladder(rung)
        if _too_many(K, count):
            return best
        if highest < K:
            # Means of fewer samples from here on, and the last octave again.
            highest *= 2
            rung, best, least = at, None, np.inf
            coarse = _averaged(x, _DENSE * highest)
            share = variance * len(coarse) / count
            continue
        left = np.minimum(_squares(coarse, count, K), _CLIP**2 * share)
        criterion = float(np.sum(left)) + _PENALTY * share * (K + DEGREE)
        if criterion < least:
            best, least, at = K, criterion, rung
        elif rung - at >= _RISEN:
            return best
        rung += 1


def _ladder(rung: int) -> int:
    """K = 2, 3, 4, 5, 6, 7, 8, then × 2^(1/4)."""
    return rung + 2 if rung < 6 else round(8 * 2.0 ** ((rung - 6) / _RUNGS))


def _rung(K: int) -> int:
    return K - 2 if K < 8 else 6 + round(_RUNGS * np.log2(K / 8))


def _averaged(x: Floats, enough: int) -> Floats:
    """Means of so many neighbours that at least `enough` samples are left."""
    each = 1
    while len(x) // (2 * each) >= max(enough, 2 * FEWEST):
        each *= 2
    blocks = len(x) // each
    return x[: blocks * each].reshape(blocks, each, -1).mean(axis=1) if each > 1 else x


def _squares(coarse: Floats, count: int, K: int) -> Floats:
    """Squared distances that the best spline on K intervals leaves of means of samples."""
    each, unit = count // len(coarse), K / (count - 1)
    design = least_squares.uniform(len(coarse), K, 0.5 * (each - 1) * unit, each * unit)
    residual = design.residual(coarse)
    return np.asarray(np.einsum("td,td->t", residual, residual))


def _halved(design: Design, c: Floats, x: Floats, noise: Noise) -> tuple[Design, Floats] | None:
    """Halve intervals where noise does not explain the residual; None where that is everywhere."""
    for _ in range(_HALVINGS):
        doubted = _doubted(x - design.values(c), design, noise, x)
        if not doubted.any():
            break
        breaks = design.breaks
        place = design.first + design.step * np.flatnonzero(doubted)
        at = np.minimum(np.searchsorted(breaks, place, side="right") - 1, design.intervals - 1)
        marked = np.zeros(design.intervals + 2, dtype=bool)
        marked[at + 1] = True
        marked = marked[1:-1] | marked[:-2] | marked[2:]
        smallest = np.full(design.intervals, _SMALLEST)
        smallest[[0, -1]] = _SMALLEST_AT_END
        marked &= np.diff(breaks) >= 2.0 * smallest * design.step
        if not marked.any():
            break
        if 2 * (design.intervals + int(marked.sum())) >= design.count:
            return None
        middles = 0.5 * (breaks[:-1] + breaks[1:])[marked]
        breaks = np.insert(breaks, np.flatnonzero(marked) + 1, middles)
        design = Design(design.count, design.first, design.step, breaks, False)
        c = design.coefficients(x)
    return design, c


def _doubted(residual: Floats, design: Design, noise: Noise, x: Floats) -> Booleans:
    """Samples in the middle of a sliding mean that noise does not explain, shape (n,)."""
    from scipy.special import chdtri

    count = len(residual)
    sigma = max(noise.largest, _ROUNDING * float(np.max(np.abs(x))))
    limit = float(np.sqrt(chdtri(x.shape[1], _CHANCE / (count * len(_WINDOWS)))))
    # Rounding to a lattice may hold on for as long as the tool is slow.
    lattice = 0.0 if noise.step is None else 0.5 * noise.step * np.sqrt(x.shape[1])
    sums = np.concatenate([np.zeros((1, x.shape[1])), np.cumsum(residual, axis=0)])
    doubted = np.zeros(count, dtype=bool)
    for window in _WINDOWS:
        if window > _WINDOWS[3] and window > count / (2 * design.intervals):
            break
        if window > count:
            break
        means = (sums[window:] - sums[:-window]) / window
        far = limit * sigma / np.sqrt(window) + lattice
        wrong = np.einsum("td,td->t", means, means) > far * far
        doubted[window // 2 : window // 2 + len(wrong)] |= wrong
    return doubted


def _with_ends(design: Design, c: Floats, variance: float) -> tuple[Floats, tuple[bool, bool]]:
    """Let derivatives vanish at the ends where the samples do not contradict it.

    Free ends are the noisiest part of a fit. Conditions A c = 0 cost (Ac)ᵀ(A G⁻¹ Aᵀ)⁻¹(Ac) of
    squares and save as many coefficients: the choice is Mallows' again.
    """
    chosen = [_end_condition(design, c, variance, reverse) for reverse in (False, True)]
    A = np.concatenate([rows for rows, _ in chosen])
    if len(A) > 0:
        back = design.solve(np.ascontiguousarray(A.T))
        c = c - back @ np.linalg.solve(A @ back, A @ c)
    rests = chosen[0][1], chosen[1][1]
    # To the last digit, so that the drawn velocity is zero.
    if rests[0]:
        c[1:3] = c[0]
    if rests[1]:
        c[-3:-1] = c[-1]
    return c, rests


def _end_condition(
    design: Design, c: Floats, variance: float, reverse: bool
) -> tuple[Floats, bool]:
    """Rows A (m, K + 5) of the best condition at an end, none if free; and whether it rests."""
    derivatives = _derivatives(-design.knots[::-1] if reverse else design.knots)
    best, least, rests = np.zeros((0, len(c))), 0.0, False
    for orders, doubt in _ENDS:
        # Few coefficients: what is asked of the inner ones would meet the other end's.
        if max(orders) > 2 and len(c) < 2 * (DEGREE + 1):
            continue
        A = np.zeros((len(orders), len(c)))
        A[:, : DEGREE + 1] = derivatives[list(orders)]
        A = A[:, ::-1] if reverse else A
        value = A @ c
        back = design.solve(np.ascontiguousarray(A.T))
        cost = float(np.sum(value * np.linalg.solve(A @ back, value)))
        criterion = cost - doubt * len(orders) * variance
        if criterion < least:
            best, least, rests = A, criterion, orders == (1, 2)
            if rests:
                break
    return best, rests


def _derivatives(knots: Floats) -> Floats:
    """Derivatives 0 … 5 at the first knot, by the first six coefficients, shape (6, 6).

    Scaled so that each row's largest entry is 1.
    """
    rows = np.zeros((DEGREE + 1, DEGREE + 1))
    level = np.eye(DEGREE + 1)
    rows[0] = level[0]
    for order in range(1, DEGREE + 1):
        degree = DEGREE - order + 1
        spans = knots[order + degree : order + degree + len(level) - 1] - knots[DEGREE]
        level = np.diff(level, axis=0) / spans[:, None]
        rows[order] = level[0] / np.max(np.abs(level[0]))
    return rows
