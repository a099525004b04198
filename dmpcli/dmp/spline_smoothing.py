"""Smoothing splines whose stiffness follows the noise.

Least-squares splines of degree 5. The number of uniform intervals K is the one of least expected
error by Mallows' Cp (C. L. Mallows, Technometrics 15, 1973) over a ladder × 2^(1/4). What the whole
decides can be wrong in one place: where noise does not explain the residual, as at a corner,
intervals are halved there and only there. Last of all the acceleration is lowered wherever what is
drawn of it may be the noise's (`least_acceleration`).
"""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp import knot_refinement, least_squares
from dmpcli.dmp.corner_pieces import COST
from dmpcli.dmp.cornered import Cornered, cornered
from dmpcli.dmp.flat_directions import moving_axes
from dmpcli.dmp.knot_refinement import ROUNDING
from dmpcli.dmp.least_acceleration import calmed
from dmpcli.dmp.least_squares import DEGREE, Design
from dmpcli.dmp.noise import FEWEST, Noise
from dmpcli.dmp.spline_ends import MANY, end, with_ends

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
# Standard errors, ∝ 1/√n, by which the variance may have been estimated too low.
_UNSURE = 4.0
# Samples per interval that the search for K needs; more are averaged.
_DENSE = 12
# Part by which the median square of 1 sample may exceed the mean one of noise, ∝ 1/√n.
_SIGNIFICANT = 1.0
# Residuals count up to so many σ in the search: corners are for the halving.
_CLIP = 3.0
# Part of the stroke's acceleration below which that of noise is not worth smoothing.
_NEGLIGIBLE = 1e-3
# Part of the highest speed below which an end may rest.
_STILL = 0.1
# Points of the shape-preserving curve for each sample.
_SHAPED = 4


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
    corners : int
        Corners between which it was smoothed; K is then that of the finest piece.
    """

    spline: "BSpline"
    intervals: int | None
    cutoff: float | None
    noise: Noise
    smoothed_noise: float
    removed: float
    rests: tuple[bool, bool]
    corners: int = 0

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
    if cutoff is None and _too_little(x, noise):
        return _interpolating(x, duration, noise, resampled)
    # About its mean, so that a stroke far from the origin loses no digits.
    middle = x.mean(axis=0)
    centred = x - middle
    axes = np.eye(x.shape[1]) if cutoff is not None else moving_axes(centred, noise)
    moving, inside = centred @ axes, noise.along(axes)
    variance = _variance(moving, inside)
    if cutoff is not None:
        K: int | None = max(1, round(2.0 * duration * cutoff))
    else:
        K = _intervals(moving, variance)
    fitted = None
    if K is not None and not _too_many(K, count):
        design = least_squares.uniform(count, K)
        fitted = design, design.coefficients(moving)
        if cutoff is None:
            fitted = knot_refinement.refined(*fitted, moving, inside, variance)
    judged = cutoff is None and not resampled and not _is_rounding(noise, x)
    if judged:
        # Through all samples there is nothing left, and as many coefficients.
        cost = COST * count if fitted is None else knot_refinement.cost(*fitted, moving, variance)
        corners = cornered(moving, inside, variance, cost, fitted and fitted[0])
        if corners is not None:
            calm = calmed(moving, corners.values, inside)
            if calm is not None:
                rests = _still(corners.rests, calm)
                corners = replace(corners, values=calm, rests=rests)
            return _through(centred, middle, axes, duration, noise, inside, corners)
    if K is None or fitted is None:
        return _interpolating(x, duration, noise, resampled)
    design, c = fitted
    rests = (False, False)
    if cutoff is None:
        c, rests = with_ends(design, c, variance)
    width = (count - 1) / design.intervals if design.uniform else None
    calm = calmed(moving, design.values(c), inside, width) if judged else None
    if calm is not None:
        rests = _still(rests, calm)
        found = Cornered(calm, np.zeros(0), float(design.intervals), K / (count - 1.0), rests)
        return _through(centred, middle, axes, duration, noise, inside, found)
    c = c @ axes.T
    residual = centred - design.values(c)
    from scipy.interpolate import BSpline

    return SmoothSpline(
        BSpline(design.knots * (duration / design.breaks[-1]), c + middle, DEGREE),
        K,
        K / (2.0 * duration),
        noise,
        float(np.sqrt(inside.total / x.shape[1] * design.intervals / count)),
        float(np.sqrt(np.mean(np.sum(residual**2, axis=1)))),
        rests,
    )


def _still(rests: tuple[bool, bool], calm: Floats) -> tuple[bool, bool]:
    """Whether ends rest still: one that goes on, less accelerated, would stop within a sample."""
    steps = np.linalg.norm(np.diff(calm, axis=0), axis=1)
    slow = _STILL * float(steps.max())
    return rests[0] and bool(steps[0] <= slow), rests[1] and bool(steps[-1] <= slow)


def _through(
    centred: Floats,
    middle: Floats,
    axes: Floats,
    duration: float,
    noise: Noise,
    inside: Noise,
    found: Cornered,
) -> SmoothSpline:
    """Go through samples without their noise: as a recording of the corners without any is."""
    from scipy.interpolate import make_interp_spline

    count = len(centred)
    values = found.values @ axes.T
    t = np.linspace(0.0, duration, count)
    spline = make_interp_spline(t, values, k=DEGREE)
    if any(found.rests):
        ends: Any = []
        for at, rest in zip((0.0, duration), found.rests, strict=True):
            ends.append([(n, 0.0 * middle if rest else spline(at, n)) for n in (1, 2)])
        spline = make_interp_spline(t, values, k=DEGREE, bc_type=ends)
        # To the last digit, so that the drawn velocity is zero.
        if found.rests[0]:
            spline.c[1:3] = spline.c[0]
        if found.rests[1]:
            spline.c[-3:-1] = spline.c[-1]
    residual = centred - values
    spline.c = spline.c + middle
    intervals = max(1, round(found.finest * (count - 1)))
    return SmoothSpline(
        spline,
        intervals,
        intervals / (2.0 * duration),
        noise,
        float(np.sqrt(inside.total / len(middle) * found.size / count)),
        float(np.sqrt(np.mean(np.sum(residual**2, axis=1)))),
        found.rests,
        len(found.corners),
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


def _is_rounding(noise: Noise, x: Floats) -> bool:
    """Whether the noise is that of the numbers: what is held, as an orientation, has no other."""
    return bool(noise.typical <= ROUNDING * np.max(np.abs(x)))


def _variance(x: Floats, noise: Noise) -> float:
    """Variance of the noise over all axes, at least that of rounding."""
    return float(max(noise.total, x.shape[1] * (ROUNDING * np.max(np.abs(x))) ** 2))


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
        criterion = _criterion(coarse, count, K, share)
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


def _criterion(coarse: Floats, count: int, K: int, share: float) -> float:
    """Mallows' Cp of K intervals, with conditions at the ends where these are a part of it all."""
    design = _design(coarse, count, K)
    c = design.solve(design.right(coarse))
    residual = coarse - design.values(c)
    left = np.einsum("td,td->t", residual, residual)
    criterion = float(np.sum(np.minimum(left, _CLIP**2 * share)))
    coefficients = float(design.size)
    if K <= MANY:
        for reverse in (False, True):
            found = end(design, c, share, reverse)
            criterion += found.cost
            coefficients -= found.conditions
    penalty = _PENALTY * (1.0 + _UNSURE / float(np.sqrt(count)))
    return criterion + penalty * share * coefficients


def _squares(coarse: Floats, count: int, K: int) -> Floats:
    """Squared distances that the best spline on K intervals leaves of means of samples."""
    residual = _design(coarse, count, K).residual(coarse)
    return np.asarray(np.einsum("td,td->t", residual, residual))


def _design(coarse: Floats, count: int, K: int) -> Design:
    each, unit = count // len(coarse), K / (count - 1)
    return least_squares.uniform(len(coarse), K, 0.5 * (each - 1) * unit, each * unit)
