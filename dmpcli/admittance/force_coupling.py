"""Force coupling along the surface normal: e(X) of eq. (10) and what it adds to a trajectory.

The wrench acts on the tool and the unit normal n points to the tool's side, so that a surface
pushes with n·F > 0. Where it pushes harder than the set-point, e grows and the tool moves away;
`force_law` has the law that moves e.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp.transformation_system import TransformationGains, transition


@dataclass(frozen=True)
class Filter:
    """How e enters the trajectory: ``tau·dV = -k·delta - d·V``, ``tau·ddelta = V + alpha_e·e``.

    Equations (9)-(10) are linear, so their coupled solution is the plain trajectory plus delta.

    Attributes
    ----------
    k, d, tau, alpha_e : float
        tau in s, the others dimensionless; alpha_e = k/d has unit gain at rest.
    transition : array, shape (2, 2)
        Of the state (delta, V) over one period, exact.
    response : array, shape (2,)
        To e held over that period, exact.
    """

    k: float
    d: float
    tau: float
    alpha_e: float
    transition: Floats
    response: Floats

    @cached_property
    def plain(self) -> tuple[float, float, float, float, float, float]:
        """The six numbers of the update by themselves: arrays of two take three times as long."""
        (a, b), (c, d) = self.transition.tolist()
        p, q = self.response.tolist()
        return a, b, c, d, p, q


def discretize(k: float, d: float, tau: float, alpha_e: float, period: float) -> Filter:
    """Return the filter of eq. (10) with its exact update over one period, e held in between.

    Parameters
    ----------
    k, d, tau, alpha_e : float
        See `Filter`.
    period : float
        s.
    """
    E = transition(TransformationGains(np.array([k]), np.array([d]), tau), np.array(period))[0]
    # x' = A x + b e  =>  x(T) = E x(0) + A^-1 (E - I) b e
    inverse = tau * np.array([[-d / k, -1.0 / k], [1.0, 0.0]])
    return Filter(k, d, tau, alpha_e, E, inverse @ (E - np.eye(2)) @ np.array([alpha_e / tau, 0.0]))


def fast_filter(tau: float, period: float, periods: float = 0.5) -> Filter:
    """Return the filter that `execute` takes on the normal axis.

    The stroke's own gains answer within about 2·tau/d, half a second for a stroke of ten: too slow
    to hold a force. A plain trajectory solves the equations for any k and d, with another forcing
    term, so on this one axis they are chosen anew: critically damped (k = d²/4) with a time
    constant 2·tau/d of half a servo period, and unit gain at rest, alpha_e = k/d: what it delays
    the loop can hold the less force by.

    Parameters
    ----------
    tau : float
        Of the trajectory, s.
    period : float
        Servo period, s.
    periods : float
        Time constant in servo periods.
    """
    d = 2.0 * tau / (periods * period)
    return discretize(d**2 / 4.0, d, tau, d / 4.0, period)


def follow(filter_: Filter, state: Sequence[float], e: float) -> tuple[float, float]:
    """One exact step of the filter.

    Parameters
    ----------
    filter_ : Filter
    state : sequence of float
        delta in mm, the displacement along the normal, and V.
    e : float
        mm.

    Returns
    -------
    tuple of float
        The next state.
    """
    a, b, c, d, p, q = filter_.plain
    delta, v = state
    return a * delta + b * v + p * e, c * delta + d * v + q * e  # eq. (10)
