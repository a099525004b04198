"""Force coupling along the surface normal: e(X) of eq. (10) and what it adds to a trajectory.

The wrench acts on the tool and the unit normal n points to the tool's side, so that a surface
pushes with n·F > 0. Where it pushes harder than the set-point, e grows and the tool moves away.
"""

from dataclasses import dataclass

import numpy as np

from dmpcli.admittance import model as admittance
from dmpcli.arrays import Floats
from dmpcli.dmp.transformation_system import TransformationGains, transition


@dataclass(frozen=True)
class CouplingLaw:
    """The admittance model along the normal, ``M·ë + D·ė + K·e = n·F - F_d``.

    Attributes
    ----------
    model : admittance.Law
        M, D and K of one axis, the normal, and the servo period. With K = 0 the force settles at
        the set-point.
    setpoint : float
        F_d, N, with which the tool shall press.
    clamp : float
        Largest |e|, mm.
    contact : float
        N; less than this is no contact.
    patience : float
        s without contact, once there was one, after which e is released.
    release : float
        mm/s at which a released e returns to 0.
    """

    model: admittance.AdmittanceLaw
    setpoint: float
    clamp: float
    contact: float
    patience: float
    release: float


@dataclass(frozen=True)
class Displacement:
    """State of the admittance model.

    Attributes
    ----------
    e, speed : float
        mm and mm/s along the normal.
    touched : bool
        There has been contact.
    absent : float
        s since the last contact.
    """

    e: float = 0.0
    speed: float = 0.0
    touched: bool = False
    absent: float = 0.0


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


def displace(
    law: CouplingLaw, state: Displacement, force: float, retreat: bool = False
) -> Displacement:
    """One step of the admittance model, integrated in the order of eq. (1)-(3).

    Before the first contact e seeks the surface, towards -n, as far as the clamp. When contact is
    lost for longer than the law's patience, or the plan retreats, e returns to 0 at constant
    speed: with K = 0 it would otherwise run on. Contact takes the model up again.

    Parameters
    ----------
    law : CouplingLaw
    state : Displacement
    force : float
        n·F, N.
    retreat : bool
        The plan leaves the surface faster than the model could follow.
    """
    period = law.model.period
    touching = force > law.contact
    touched = state.touched or touching
    absent = 0.0 if touching else state.absent + period
    if not touching and (retreat or (touched and absent > law.patience)):
        back = law.release * period
        return Displacement(state.e - min(max(state.e, -back), back), 0.0, touched, absent)
    excess, speed, e = np.array([[force - law.setpoint], [state.speed], [state.e]])
    speed, e = admittance.advance(law.model, excess, speed, e)  # e(X) of eq. (10)
    if abs(e[0]) > law.clamp:
        return Displacement(float(np.copysign(law.clamp, e[0])), 0.0, touched, absent)
    return Displacement(float(e[0]), float(speed[0]), touched, absent)


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


def fast_filter(tau: float, period: float, periods: float = 2.0) -> Filter:
    """Return the filter that `execute` takes on the normal axis.

    The stroke's own gains answer within about 2·tau/d, half a second for a stroke of ten: too slow
    to hold a force. A plain trajectory solves the equations for any k and d, with another forcing
    term, so on this one axis they are chosen anew: critically damped (k = d²/4) with a time
    constant 2·tau/d of two servo periods, and unit gain at rest, alpha_e = k/d.

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


def follow(filter_: Filter, state: Floats, e: float) -> Floats:
    """One exact step of the filter.

    Parameters
    ----------
    filter_ : Filter
    state : array, shape (2,)
        delta in mm, the displacement along the normal, and V.
    e : float
        mm.

    Returns
    -------
    array, shape (2,)
    """
    new: Floats = filter_.transition @ state + filter_.response * e  # eq. (10)
    return new
