"""How a smoothing spline begins and ends: at rest, or as smoothly as its samples allow.

An end is told from one side only, so that a free one is the noisiest part of a fit: of K intervals
that suit the middle, its acceleration has twenty times the noise. Conditions on derivatives at the
end take that away, where the samples do not contradict them. Those of A c = 0 cost
(Ac)ᵀ(A G⁻¹ Aᵀ)⁻¹(Ac) of squares, and save as many coefficients: the choice is Mallows' again.
Of a long stroke that does not rest more is known: how neighbouring coefficients go with each other
all along it. With that, and with what its samples are worth, an end is the best linear estimate,
as in kriging.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp.least_squares import DEGREE, Design, local_basis

# Derivatives that vanish at rest, and what each may cost, in variances: noise alone costs one.
_RESTS, _DOUBT_OF_REST = ((1, 2, 5), (1, 2)), 3.0
# Derivatives that vanish one after the other where the end does not rest, and what each may cost
# entirely; what costs more is taken away by that part.
_SMOOTH, _DOUBT = ((5,), (4, 5), (3, 4, 5)), 3.0
# Intervals up to which the ends are a part of the choice of K, and beyond which the rest of the
# stroke tells of them.
MANY = 40
# Coefficients that are looked at together; those next to an end that tell nothing, being the
# noisiest; and the chance by which an end like the rest is taken for another one.
_TOGETHER, _NOISY, _ANOTHER = 10, 6, 0.02
# Of few coefficients: derivatives at an end that are no larger than inside, by what factor they may
# be, and where inside.
_LIVELY, _LIVELIER, _INSIDE = (2, 3), 2.0, np.linspace(0.2, 0.8, 25)


@dataclass(frozen=True)
class End:
    """Conditions at one end of a fit.

    Attributes
    ----------
    change : array, shape (K + 5, D)
        What is taken off the coefficients.
    cost : float
        Squares that the conditions add.
    conditions : float
        Coefficients that they save.
    rests : bool
    """

    change: Floats
    cost: float
    conditions: float
    rests: bool


def end(design: Design, c: Floats, variance: float, reverse: bool) -> End:
    """Choose the conditions at the start, or at the end, of least-squares coefficients.

    Parameters
    ----------
    design : Design
    c : array, shape (K + 5, D)
    variance : float
        Of the noise, over all D.
    reverse : bool
        Whether at the end.
    """
    # Few coefficients: what is asked of the inner ones would meet the other end's.
    few = len(c) < 2 * (DEGREE + 1)
    rows = np.zeros((DEGREE, len(c)))
    rows[:, : DEGREE + 1] = _derivatives(-design.knots[::-1] if reverse else design.knots)[1:]
    rows = rows[:, ::-1] if reverse else rows
    back = design.solve(np.ascontiguousarray(rows.T))
    value, gram = rows @ c, rows @ back

    def asked(orders: tuple[int, ...]) -> tuple[Floats, float]:
        at = np.array(orders) - 1
        multipliers = np.linalg.solve(gram[np.ix_(at, at)], value[at])
        return back[:, at] @ multipliers, float(np.sum(value[at] * multipliers))

    orders: tuple[int, ...]
    for orders in _RESTS:
        if few and max(orders) > 2:
            continue
        change, cost = asked(orders)
        if cost < _DOUBT_OF_REST * len(orders) * variance:
            return End(change, cost, len(orders), True)
    likely = (_likely if design.intervals > MANY else _lively)(design, c, variance, reverse)
    if likely is not None:
        return likely
    found = End(np.zeros_like(c), 0.0, 0, False)
    for orders in () if few else _SMOOTH:
        change, cost = asked(orders)
        more = max(cost - found.cost, 1e-300)
        if more > _DOUBT * variance:
            part = _DOUBT * variance / more
            return End(
                found.change + part * (change - found.change), found.cost, found.conditions, False
            )
        found = End(change, cost, len(orders), False)
    return found


def _likely(design: Design, c: Floats, variance: float, reverse: bool) -> End | None:
    """Choose an end by how the coefficients go along the stroke; None where it is another end.

    Their differences D c at the end are taken for some like all others, whose mean is μ and whose
    covariance, alike on all axes, is S: G⁻¹ Dᵀ (D G⁻¹ Dᵀ + S/σ²)⁻¹ (D c - μ) is taken off.
    """
    from scipy.special import chdtri

    if not design.uniform:
        return None
    count, axes = c.shape
    sigma2 = variance / axes
    # Beyond knots that are repeated coefficients go on as if they were not.
    ahead = c[::-1].copy() if reverse else c.copy()
    ends = _unrepeated()
    ahead[: DEGREE + 1] = ends @ ahead[: DEGREE + 1]
    inner = np.diff(ahead[_NOISY : count - _NOISY], axis=0)
    windows = np.lib.stride_tricks.sliding_window_view(inner, _TOGETHER - 1, axis=0)
    mean = windows.mean(axis=0).T
    around = windows - mean.T
    covariance = np.einsum("wdi,wdj->ij", around, around) / (len(around) * axes)
    differences = np.diff(np.eye(_TOGETHER), axis=0)
    differences[:, : DEGREE + 1] = differences[:, : DEGREE + 1] @ ends
    rows = np.zeros((_TOGETHER - 1, count))
    rows[:, :_TOGETHER] = differences
    rows = rows[:, ::-1] if reverse else rows
    back = design.solve(np.ascontiguousarray(rows.T))
    gap = rows @ c - mean
    pull = np.linalg.solve(sigma2 * (rows @ back) + covariance, gap)
    if float(np.sum(gap * pull)) > chdtri(gap.size, _ANOTHER):
        return None
    return End(sigma2 * (back @ pull), 0.0, 0, False)


@lru_cache(maxsize=1)
def _unrepeated() -> Floats:
    """Of the first six coefficients those on knots that go on evenly beyond the first, (6, 6)."""
    nodes = (np.arange(DEGREE + 1) + 0.5) / (DEGREE + 1)
    knots = np.pad(np.arange(2.0 * DEGREE + 2.0), DEGREE, mode="edge")
    at_end, inside = (local_basis(nodes + first, knots)[1].T for first in (0.0, float(DEGREE)))
    return np.asarray(np.linalg.solve(inside, at_end))


def _lively(design: Design, c: Floats, variance: float, reverse: bool) -> End | None:
    """Choose an end of few coefficients to be about as lively as the stroke is inside.

    Its second and third derivative A c are taken for normally distributed about zero with twice the
    standard deviations, and the correlation, that they have inside. None where they are not, and of
    so many coefficients that the ends' own do not meet.
    """
    from scipy.special import chdtri

    if not design.uniform or len(c) >= 2 * (DEGREE + 1) or variance == 0.0:
        return None
    axes = c.shape[1]
    start, goal, inner = _derivatives_of(design.intervals)
    rows = goal if reverse else start
    there = inner @ c
    moments = np.einsum("pod,pqd->oq", there, there) / (len(there) * axes)
    if reverse:
        signs = (-1.0) ** np.array(_LIVELY)
        moments = moments * np.outer(signs, signs)
    back = design.solve(np.ascontiguousarray(rows.T))
    of_noise = variance / axes * (rows @ back)
    both = of_noise + _LIVELIER**2 * moments
    pull = np.linalg.solve(both, rows @ c)
    if float(np.sum(pull * (rows @ c))) > chdtri(pull.size, _ANOTHER):
        return None
    saved = float(np.trace(np.linalg.solve(both, of_noise)))
    cost = variance / axes * float(np.sum(pull * (of_noise @ pull)))
    return End(variance / axes * (back @ pull), cost, saved, False)


@lru_cache(maxsize=DEGREE + 2)
def _derivatives_of(intervals: int) -> tuple[Floats, Floats, Floats]:
    """Derivatives `_LIVELY` by coefficients of K intervals at start, end (2, K + 5) and inside.

    Those at the end are by time that runs back.
    """
    from scipy.interpolate import BSpline

    knots = np.pad(np.arange(intervals + 1.0), DEGREE, mode="edge")
    each = BSpline(knots, np.eye(intervals + DEGREE), DEGREE)
    start = np.stack([each(0.0, order) for order in _LIVELY])
    goal = np.stack([(-1.0) ** order * each(float(intervals), order) for order in _LIVELY])
    return start, goal, np.stack([each(intervals * _INSIDE, order) for order in _LIVELY], axis=1)


def with_ends(design: Design, c: Floats, variance: float) -> tuple[Floats, tuple[bool, bool]]:
    """Return coefficients with both ends as chosen, and whether each rests.

    Parameters
    ----------
    design : Design
    c : array, shape (K + 5, D)
    variance : float
        Of the noise, over all D.
    """
    first, last = (end(design, c, variance, reverse) for reverse in (False, True))
    c = c - first.change - last.change
    # To the last digit, so that the drawn velocity is zero.
    if first.rests:
        c[1:3] = c[0]
    if last.rests:
        c[-3:-1] = c[-1]
    return c, (first.rests, last.rests)


def _derivatives(knots: Floats) -> Floats:
    """`derivatives`, scaled so that each row's largest entry is 1."""
    rows = derivatives(knots)
    return np.asarray(rows / np.max(np.abs(rows), axis=1, keepdims=True))


def derivatives(knots: Floats) -> Floats:
    """Derivatives 0 … 5 at the first knot, by the first six coefficients, shape (6, 6)."""
    return _derivatives_at(tuple((knots[: 2 * DEGREE + 1] - knots[0]).tolist())).copy()


@lru_cache(maxsize=64)
def _derivatives_at(first: tuple[float, ...]) -> Floats:
    knots = np.array(first)
    rows = np.zeros((DEGREE + 1, DEGREE + 1))
    level = np.eye(DEGREE + 1)
    rows[0] = level[0]
    for order in range(1, DEGREE + 1):
        degree = DEGREE - order + 1
        spans = knots[order + degree : order + degree + len(level) - 1] - knots[DEGREE]
        level = degree * np.diff(level, axis=0) / spans[:, None]
        rows[order] = level[0]
    return rows
