"""How a smoothing spline begins and ends: at rest, or as smoothly as its samples allow.

An end is told from one side only, so that a free one is the noisiest part of a fit: of K intervals
that suit the middle, its acceleration has twenty times the noise. Conditions on derivatives at the
end take that away, where the samples do not contradict them. Those of A c = 0 cost
(Ac)ᵀ(A G⁻¹ Aᵀ)⁻¹(Ac) of squares, and save as many coefficients: the choice is Mallows' again.
"""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp.least_squares import DEGREE, Design

# Derivatives that vanish at rest, and what each may cost, in variances: noise alone costs one.
_RESTS, _DOUBT_OF_REST = ((1, 2, 5), (1, 2)), 3.0
# Derivatives that vanish one after the other where the end does not rest, and what each may cost
# entirely; what costs more is taken away by that part.
_SMOOTH, _DOUBT = ((5,), (4, 5), (3, 4, 5)), 3.0


@dataclass(frozen=True)
class End:
    """Conditions at one end of a fit.

    Attributes
    ----------
    change : array, shape (K + 5, D)
        What is taken off the coefficients.
    cost : float
        Squares that the conditions add.
    conditions : int
        Coefficients that they save.
    rests : bool
    """

    change: Floats
    cost: float
    conditions: int
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
