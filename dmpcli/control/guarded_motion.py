"""Ways that the force coupling makes by itself: to a displacement, or towards the work."""

import math

from dmpcli.admittance.force_law import LawState

# mm/s²; far below what an arm may do, and enough to be quick over a few millimetres.
_ACCELERATION = 200.0


def towards(state: LawState, goal: float, speed: float, period: float) -> tuple[LawState, bool]:
    """Go on to a displacement along the normal; from and to rest.

    Parameters
    ----------
    state : LawState
    goal : float
        mm.
    speed : float
        Fastest, mm/s.
    period : float
        s.

    Returns
    -------
    LawState
    bool
        Whether it is there.
    """
    left = goal - state.e
    way = abs(left)
    fastest = min(
        speed,
        abs(state.speed) + _ACCELERATION * period,
        math.sqrt(2.0 * _ACCELERATION * way),
    )
    if way <= fastest * period or way < 1e-9:
        return LawState(goal), True
    v = math.copysign(fastest, left)
    return LawState(state.e + v * period, v), False


def sinking(state: LawState, speed: float, period: float) -> LawState:
    """Go on towards the work at an even speed, mm/s.

    Parameters
    ----------
    state : LawState
    speed : float
        To which it speeds up, mm/s; a motion away from the work ends at once.
    period : float
        s.

    Returns
    -------
    LawState
        One period later; its integral is 0.
    """
    v = min(speed, abs(min(state.speed, 0.0)) + _ACCELERATION * period)
    return LawState(state.e - v * period, -v)
