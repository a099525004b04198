"""A stroke in pieces between corners, each as smooth as its own samples ask for.

A polynomial of at most the fifth degree where that explains a piece, a spline on intervals of its
own elsewhere. What is left of the noise at a corner is then that of two fits' ends, not that of as
wide a band as a corner has. Pieces meet, as smoothly as their noise allows: the least change of all
that closes the gaps is taken.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp import gram_polynomials, knot_refinement
from dmpcli.dmp.least_squares import DEGREE, Design
from dmpcli.dmp.noise import Noise
from dmpcli.dmp.spline_ends import derivatives, end

# What a coefficient costs, in variances (Mallows), and where one degree is chosen of several.
COST = 2.0
_PENALTY, _UNSURE = 3.0, 4.0
# Degrees that are tried; by the highest ones it is seen that a polynomial does not do; of a piece
# at an end of the stroke, which may rest there.
_HIGHEST, _TRIED, _AT_END = DEGREE, DEGREE + 2, 2
# Steps in which intervals of a piece are tried, until so many rungs have cost more.
_RUNG, _RISEN = 1.4, 2
# Residuals count up to so many σ in the search for them: what is narrow is for the halving.
_CLIP = 3.0
# Sliding means that noise must explain, and the chance by which it does not.
_WINDOWS, _CHANCE = (1, 2, 4, 8, 16, 32, 64, 128, 256, 512), 1e-4
# Samples by which given breaks stay away from a piece's ends.
_APART = 2.0
# Position and derivatives in which pieces may meet, and the chance by which each does not.
_JOINED, _APART_BY_CHANCE = 3, 1e-4
# Least eigenvalue of correlated ends, below which one of them says nothing of its own.
_SINGULAR = 1e-9
# Fewest samples of a piece.
FEWEST = 3


@dataclass(frozen=True)
class SmoothPiece:
    """What was fitted between two corners.

    Attributes
    ----------
    values : array, shape (n, D)
        At its samples.
    squares : float
        That it leaves of them.
    size : float
        Coefficients.
    ends : array, shape (2, 3, D)
        Its values at the two corners, and first and second derivatives by samples.
    covariance : array, shape (2, 3, 2, 3)
        Of the ends, in variances of a sample.
    pulls : array, shape (n, 2, 3)
        What a pull on each of them does to the values: the least change for that of the ends.
    smooth : bool
        Whether it is one polynomial.
    rests : tuple of bool
        Whether the stroke begins and ends at rest in it.
    """

    values: Floats
    squares: float
    size: float
    ends: Floats
    covariance: Floats
    pulls: Floats
    smooth: bool
    rests: tuple[bool, bool]

    def cost(self, variance: float) -> float:
        """Mallows' Cp, in variances over all axes."""
        return self.squares / variance + COST * self.size


def between(
    x: Floats, low: float, high: float, noise: Noise, variance: float, breaks: Floats
) -> SmoothPiece | None:
    """Fit the samples between two corners; None where nothing smooth explains them.

    Parameters
    ----------
    x : array, shape (T, D)
        The whole recording.
    low, high : float
        Times of the corners, in samples; 0 and T - 1 are the ends.
    noise : Noise
    variance : float
        Of the noise, over all D.
    breaks : array, shape (K + 1,)
        Of a spline for all samples, in samples: a piece that spans no corner may do best with them.
    """
    first = low == 0.0, high == len(x) - 1.0
    begin = 0 if first[0] else int(np.floor(low)) + 1
    y = x[begin : int(np.floor(high)) + 1]
    if len(y) < FEWEST:
        return None
    piece = _polynomial(y, begin, low, high, noise, variance, any(first))
    if piece is not None:
        return piece
    own = _halved(_best(y, begin, low, high, variance), y, noise)
    inside = breaks[(breaks > low + _APART) & (breaks < high - _APART)] - low
    given = Design(len(y), begin - low, 1.0, np.array([0.0, *inside, high - low]), False)
    found = []
    for design in (own, given):
        if design is None or design.size >= len(y):
            continue
        try:
            found.append(_spline(design, y, variance, first))
        except np.linalg.LinAlgError:
            # Given breaks may leave a short piece's coefficients fewer samples than there are.
            continue
    return min(found, key=lambda piece: piece.cost(variance), default=None)


def least(x: Floats, low: float, high: float, noise: Noise, variance: float) -> float:
    """What the samples within [low, high] cost at least, in variances, of one polynomial.

    Parameters
    ----------
    x : array, shape (T, D)
        The whole recording.
    low, high : float
        Times of two corners, in samples.
    noise : Noise
    variance : float
        Of the noise, over all D.

    Returns
    -------
    float
        0 of fewer than `FEWEST` samples, infinite where no polynomial explains them.
    """
    begin, end = int(np.ceil(low)), int(np.floor(high)) + 1
    if end - begin < FEWEST:
        return 0.0
    piece = _polynomial(x[begin:end], begin, low, high, noise, variance, False)
    return np.inf if piece is None else piece.cost(variance)


def missed(x: Floats, low: float, high: float) -> float:
    """Squares that the best polynomial that is tried leaves of the samples in [low, high]."""
    y = x[int(np.ceil(low)) : int(np.floor(high)) + 1]
    Q = gram_polynomials.at_samples(len(y), min(_TRIED, len(y) - 2))
    return float(np.sum((y - Q @ (Q.T @ y)) ** 2))


def explained(residual: Floats, noise: Noise) -> bool:
    """Whether noise explains a residual (n, D) everywhere: each sliding mean, and each peak."""
    return knot_refinement.within(residual, noise.largest, _WINDOWS, _CHANCE)


def _polynomial(
    y: Floats, begin: int, low: float, high: float, noise: Noise, variance: float, at_end: bool
) -> SmoothPiece | None:
    count = len(y)
    Q = gram_polynomials.at_samples(count, min(_TRIED, count - 2))
    shares = Q.T @ y
    penalty = _PENALTY * (1.0 + _UNSURE / np.sqrt(count)) * variance
    worth = np.cumsum(np.sum(shares**2, axis=1) - penalty)
    degree = int(np.argmax(worth))
    if degree > (_AT_END if at_end else _HIGHEST):
        return None
    Q, shares = Q[:, : degree + 1], shares[: degree + 1]
    values = Q @ shares
    if not explained(y - values, noise):
        return None
    rows = np.concatenate(
        [gram_polynomials.at(count, degree, edge - begin, _JOINED) for edge in (low, high)]
    )
    return _piece(y, values, degree + 1.0, rows @ shares, rows @ rows.T, Q @ rows.T, None)


def _piece(
    y: Floats,
    values: Floats,
    size: float,
    ends: Floats,
    covariance: Floats,
    pulls: Floats,
    rests: tuple[bool, bool] | None,
) -> SmoothPiece:
    squares = float(np.sum((y - values) ** 2))
    two = (2, _JOINED)
    return SmoothPiece(
        values,
        squares,
        size,
        ends.reshape(*two, -1),
        covariance.reshape(*two, *two),
        pulls.reshape(-1, *two),
        rests is None,
        rests or (False, False),
    )


def _halved(design: Design | None, y: Floats, noise: Noise) -> Design | None:
    """Halve intervals where noise does not explain what is left."""
    if design is None:
        return None
    try:
        halved = knot_refinement.halved(design, design.coefficients(y), y, noise)
    except np.linalg.LinAlgError:
        # Halves of a short piece's intervals may hold too few samples.
        return None
    return None if halved is None else halved[0]


def _spline(design: Design, y: Floats, variance: float, at_end: tuple[bool, bool]) -> SmoothPiece:
    c = design.coefficients(y)
    rests, size = [False, False], float(design.size)
    for i in range(2):
        if at_end[i]:
            found = end(design, c, variance, bool(i))
            c = c - found.change
            size -= found.conditions
            rests[i] = found.rests
    orders = np.arange(_JOINED)
    rows = np.zeros((2 * _JOINED, design.size))
    first, last = derivatives(design.knots), derivatives(-design.knots[::-1])
    scale = design.step**orders
    rows[:_JOINED, : DEGREE + 1] = first[:_JOINED] * scale[:, None]
    rows[_JOINED:, : -DEGREE - 2 : -1] = last[:_JOINED] * (scale * (-1.0) ** orders)[:, None]
    back = design.solve(np.ascontiguousarray(rows.T))
    return _piece(
        y, design.values(c), size, rows @ c, rows @ back, design.values(back), (rests[0], rests[1])
    )


def _best(y: Floats, begin: int, low: float, high: float, variance: float) -> Design | None:
    """Uniform intervals of least Cp, among those that leave half the samples within the noise."""
    count = len(y)
    K, risen = 2, 0
    best, least = None, np.inf
    while count > max(2 * K, K + DEGREE) and risen < _RISEN:
        unit = K / (high - low)
        design = Design(count, (begin - low) * unit, unit, np.arange(K + 1.0), True)
        residual = design.residual(y)
        left = np.einsum("td,td->t", residual, residual)
        cost = float(np.minimum(left, _CLIP**2 * variance).sum()) / variance + COST * design.size
        if cost < least:
            best, least, risen = design, cost, 0
        elif float(np.median(left)) <= variance:
            risen += 1
        K = max(K + 1, round(K * _RUNG))
    return best


def joint(before: SmoothPiece, after: SmoothPiece, variance: float) -> tuple[int, float]:
    """How smoothly two pieces meet: a corner is where the velocity jumps beyond its noise.

    Parameters
    ----------
    before, after : SmoothPiece
        On either side of one corner.
    variance : float
        Of the noise, over all D.

    Returns
    -------
    int
        Of position, velocity and acceleration, how many go on: 1 at a corner, to 3.
    float
        What it costs, less the coefficients that it saves, in variances.
    """
    from scipy.special import chdtri

    gap = after.ends[0] - before.ends[1]
    axes = gap.shape[1]
    doubt = float(chdtri(axes, _APART_BY_CHANCE)) / axes
    covariance = before.covariance[1, :, 1, :] + after.covariance[0, :, 0, :]
    scale = np.sqrt(np.maximum(np.diagonal(covariance), 1e-300))
    scaled = covariance / np.outer(scale, scale)
    smooth, least, last = 1, 0.0, 0.0
    # What a line has no second derivative for is not asked of it.
    for size in range(1, 1 + min(_JOINED, int(before.size), int(after.size))):
        part = scaled[:size, :size]
        if size > 1 and np.linalg.eigvalsh(part)[0] < _SINGULAR:
            break
        asked = gap[:size] / scale[:size, None]
        cost = float(np.sum(asked * np.linalg.solve(part, asked))) / variance
        if size > 1 and cost - last > doubt:
            break
        smooth, last = size, cost
        least = cost - COST * size
    return smooth, least


def joined(pieces: list[SmoothPiece], smooth: list[int]) -> tuple[Floats, Floats]:
    """Values of pieces that meet, and what their velocity jumps by: shapes (T, D), (P, D).

    Parameters
    ----------
    pieces : list of SmoothPiece
    smooth : list of int
        As `joint` tells.
    """
    from scipy.linalg import solveh_banded

    axes = pieces[0].ends.shape[2]
    first = np.concatenate([[0], np.cumsum(smooth)])
    gaps = np.zeros((first[-1], axes))
    # Lower bands: what is asked of neighbouring corners goes together.
    bands = np.zeros((2 * _JOINED, first[-1]))
    for i, size in enumerate(smooth):
        a, b = pieces[i], pieces[i + 1]
        gaps[first[i] : first[i + 1]] = (b.ends[0] - a.ends[1])[:size]
        own = (a.covariance[1, :, 1, :] + b.covariance[0, :, 0, :])[:size, :size]
        rows = [own]
        if i + 1 < len(smooth):
            rows.append(-b.covariance[1, : smooth[i + 1], 0, :size])
        block = np.concatenate(rows)
        for column in range(size):
            bands[: len(block) - column, first[i] + column] = block[column:, column]
    pulls = solveh_banded(bands, gaps, lower=True)
    parts, slopes = [], []
    for i, piece in enumerate(pieces):
        pull = np.zeros((2, _JOINED, axes))
        if i:
            pull[0, : smooth[i - 1]] = -pulls[first[i - 1] : first[i]]
        if i < len(smooth):
            pull[1, : smooth[i]] = pulls[first[i] : first[i + 1]]
        parts.append(piece.values + np.tensordot(piece.pulls, pull, 2))
        slopes.append(piece.ends[:, 1] + np.tensordot(piece.covariance[:, 1], pull, 2))
    jumps = [after[0] - before[1] for before, after in pairwise(slopes)]
    return np.concatenate(parts), np.array(jumps)
