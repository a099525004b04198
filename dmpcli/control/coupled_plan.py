"""What a plan asks of a force coupling: set-points of the force, and the lift on the way to it."""

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.control.contact_policy import ContactPolicy
from dmpcli.planning.plan import Plan


def setpoints(plan: Plan, setpoint: float, override: float | None) -> Floats:
    """F_d at each set-point of a plan, shape (n,), N; an override leaves lifted parts at 0.

    Parameters
    ----------
    plan : Plan
        On the ways to its stroke and off it nothing is asked for.
    setpoint : float
        For a plan that brings no force of its own, N.
    override : float or None
        Instead of a plan's own force wherever that presses, N.
    """
    wanted = np.zeros(len(plan))
    drawn = slice(plan.lead, plan.last + 1)
    if plan.force is None:
        wanted[drawn] = setpoint
    else:
        own = plan.force[drawn]
        wanted[drawn] = own if override is None else np.where(own > 0.0, override, 0.0)
    return wanted


def lifts(plan: Plan, policy: ContactPolicy) -> Floats:
    """Share of the lift at each set-point before the stroke: it grows along the last way to it.

    A way that is too short to be lifted on stays as it is; the tool is lifted where it ends.
    """
    shares = np.zeros(plan.lead)
    first = [at for phase, at in plan.legs if phase == "approach" and at < plan.lead]
    if not first:
        return shares
    count = plan.lead - first[-1]
    if 1.875 * policy.reach > policy.free * 2.0 * count * plan.period:
        return shares
    s = np.arange(1, count + 1) / count
    shares[first[-1] :] = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    return shares
