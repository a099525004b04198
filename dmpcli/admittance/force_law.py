"""The law that holds a force: the admittance model of eq. (1)-(3) with an integral of its error.

Along the normal ``M·ë + D·ė + K·e = f + (1/T_i)·∫f dt`` with ``f = n·F - F_d``. In contact with a
stiffness k, felt a delay L later, it is a proportional-integral control of an integrator:

- the smallest damping that is stable is about ``(2/π)·k·L`` for a pure delay, a little more with
  the integral; the rule takes ``D = 0.9·k·L`` and ``T_i = 4·L``;
- the integral takes away the error ``D·v`` that a surface leaves which departs from the plan at v;
- a sensor feels the inertia of the tool that it carries, m·ë, too. At a frequency above √(k/m) that
  is more than the contact, and of the other sign: a soft contact of a heavy tool swings unless
  ``D`` is some 0.6·m/T, at the servos' usual lags. The rule takes ``D = 0.75·m/T`` at the least, T
  no longer than such a lag.

Plain scalars: this runs once a cycle.
"""

import math
from dataclasses import dataclass, replace

DAMPING_SHARE, INTEGRAL_DELAYS = 0.9, 4.0
"""Of the rule: damping by stiffness times delay, and the integral's time by the delay."""

INERTIA_SHARE, INERTIA_PERIOD = 0.75, 0.025
"""Of the rule: damping by the tool's mass over the period, and the longest of these, s."""


@dataclass(frozen=True)
class ForceGains:
    """M, D, K and T_i along the normal, and the control period.

    Attributes
    ----------
    mass : float
        N·s²/mm.
    damping : float
        N·s/mm.
    spring : float
        N/mm; 0 lets the force settle at its set-point wherever the surface is.
    integral : float
        T_i, s; infinite is none.
    period : float
        s.
    """

    mass: float
    damping: float
    spring: float
    integral: float
    period: float

    def softened(self, factor: float) -> "ForceGains":
        """Return gains that answer this many times as slowly."""
        return replace(
            self,
            mass=factor * self.mass,
            damping=factor * self.damping,
            integral=factor * self.integral,
        )


@dataclass(frozen=True)
class LawState:
    """Where the law has led the tool.

    Attributes
    ----------
    e, speed : float
        e(X) of eq. (10), mm, and its rate, mm/s; positive is away from the surface.
    integral : float
        ∫f dt, N·s.
    saturated : bool
        Whether the last step would have been faster than allowed.
    """

    e: float = 0.0
    speed: float = 0.0
    integral: float = 0.0
    saturated: bool = False


def by_rule(
    stiffness: float, delay: float, period: float, spring: float = 0.0, tool: float = 0.0
) -> ForceGains:
    """Return the gains for a contact of this stiffness, felt so much later.

    The mass is period times damping: then the discrete model reaches its speed within one step,
    and adds no lag to a loop that has enough of it.

    Parameters
    ----------
    stiffness : float
        Of tool and surface in series, N/mm.
    delay : float
        Of the whole loop: sensor, filter, half a period, look-ahead, servo lag, s.
    period : float
        s.
    spring : float
        K, N/mm.
    tool : float
        Mass on the sensor's tool side, N·s²/mm, or thousand kg.
    """
    damping = DAMPING_SHARE * stiffness * delay
    made = ForceGains(period * damping, damping, spring, INTEGRAL_DELAYS * delay, period)
    least = INERTIA_SHARE * tool / min(period, INERTIA_PERIOD)
    return made.softened(max(least / damping, 1.0))


def advance(gains: ForceGains, state: LawState, error: float, fastest: float) -> LawState:
    """Take one step, integrated in the order of eq. (1)-(3).

    Parameters
    ----------
    gains : ForceGains
    state : LawState
    error : float
        f = n·F - F_d, N.
    fastest : float
        Largest |ė|, mm/s; while it is reached the integral does not grow further that way.
    """
    T = gains.period
    integral = state.integral + error * T
    force = error + integral / gains.integral
    a = (force - gains.damping * state.speed - gains.spring * state.e) / gains.mass  # eq. (1)
    speed = state.speed + a * T  # eq. (2)
    saturated = abs(speed) > fastest
    if saturated:
        speed = math.copysign(fastest, speed)
        if error * speed > 0.0:
            integral = state.integral
    # eq. (3); its e is e(X) of eq. (10)
    return LawState(state.e + speed * T, speed, integral, saturated)
