"""What a goal that moves while a stroke runs adds to it: eq. (9)-(10) are linear in the goal.

The stroke that was planned and the moved one obey the same equations with the same forcing term, so
that their difference delta obeys them without any::

    tau dV/dt = k (Dg - delta) - d V
    tau d(delta)/dt = V

with Dg the way by which the goal has moved. Delta and its velocity are continuous wherever Dg
jumps; its acceleration then jumps by k·Dg/tau². Between two samples Dg is held, so that the exact
matrix exponential of the free system is the exact response (zero-order hold); a stroke that was
re-timed or is drawn at another speed solves the equations with another forcing term, and the
difference is the same.
"""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp.transformation_system import TransformationGains, transition


@dataclass(frozen=True)
class GoalFilter:
    """The transformation system that a moved goal drives, one for all axes.

    Attributes
    ----------
    k, d : float
        Spring constant and damping of eq. (4); dimensionless.
    tau : float
        Time constant, s.
    period : float
        Between two samples, s.
    """

    k: float
    d: float
    tau: float
    period: float

    @property
    def slowest(self) -> float:
        """Time in which the slower mode falls to 1/e, s."""
        half = self.d / 2.0
        root = np.sqrt(max(half**2 - self.k, 0.0))
        # Of a weak spring (half - root) would be lost in rounding.
        return float(self.tau * (half + root) / self.k) if root else self.tau / half


def response(filter_: GoalFilter, state: Floats, shift: Floats, count: int) -> Floats:
    """States at the next samples, the goal held where it is now.

    Parameters
    ----------
    filter_ : GoalFilter
    state : array, shape (2, 3)
        Delta, mm, and V = tau·d(delta)/dt, mm, now.
    shift : array, shape (3,)
        By which the goal has moved from where it was planned, Dg, mm.
    count : int

    Returns
    -------
    array, shape (count, 2, 3)
        After 1 to `count` periods. Each is exact by itself: no error adds up.
    """
    spring = TransformationGains(np.array([filter_.k]), np.array([filter_.d]), filter_.tau)
    t: Floats = filter_.period * np.arange(1.0, count + 1.0)
    E = transition(spring, t)[:, 0]
    goal = np.stack([shift, np.zeros(3)])
    states: Floats = goal + E @ (state - goal)
    return states


def settling(filter_: GoalFilter, state: Floats, shift: Floats, tolerance: float) -> int:
    """After how many periods delta is at the goal and stays there.

    Parameters
    ----------
    filter_ : GoalFilter
    state : array, shape (2, 3)
        As of `response`.
    shift : array, shape (3,)
        mm.
    tolerance : float
        mm; of delta, and of V, which is what delta would do in tau.

    Returns
    -------
    int
        0 where it is there already.
    """
    goal = np.stack([shift, np.zeros(3)])
    off = float(np.abs(state - goal).max())
    if off <= tolerance:
        return 0
    # Critically damped, (1 + c x) exp(-x) of the first distance: some e-folds more than the decay.
    folds = np.log(off / tolerance) + 3.0
    folds += np.log(folds * (1.0 + max(filter_.k, filter_.d, 1.0))) + 3.0
    count = int(np.ceil(folds * filter_.slowest / filter_.period)) + 1
    away = np.abs(response(filter_, state, shift, count) - goal).max(axis=(1, 2)) > tolerance
    return int(np.flatnonzero(away)[-1]) + 2 if away.any() else 1
