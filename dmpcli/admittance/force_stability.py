"""Which force gains are stable in contact: predicted from stiffness, delay and the tool's mass.

The loop in one dimension, cycle by cycle: the law of `force_law`, the filter of eq. (10), then
set-points that the arm takes up evenly, a dead time, a lag, and a spring. Its largest eigenvalue
tells; no frequency response is approximated. Of a whole delay nobody tells how much is dead time:
up to 25 ms are taken for the servos' lag, critically damped as those of position-controlled arms.

A sensor feels the inertia of the tool that it carries too, which steadies some contacts and lets
others swing, and a contact damps a little: a pen in its holder, a pad, a plate on its supports.
"""

import numpy as np

from dmpcli.admittance.force_coupling import Filter, fast_filter
from dmpcli.admittance.force_law import ForceGains
from dmpcli.arrays import Floats

LAG = 0.025
"""How much of a delay is the servos' lag, s; what is beyond is dead time."""

LOSS = 0.003
"""Damping of a contact by its stiffness, s."""

MARGIN = 1.1
"""By how much gains must answer more slowly than those that begin to swing."""

# Delay of the mean of a period's two readings of what is taken up evenly, in periods.
_READ = 0.25
# Steps within a period.
_WITHIN = 20
# Gains are softened by this, so many times.
_SOFTER, _SOFTENINGS = 1.2, 15


def loop_matrix(gains: ForceGains, stiffness: float, delay: float, tool: float = 0.0) -> Floats:
    """State matrix of one cycle of the closed loop.

    Parameters
    ----------
    gains : ForceGains
    stiffness : float
        N/mm.
    delay : float
        From a displacement to its force as a landing measures it, s, without the half period that
        the law's own steps are.
    tool : float
        Mass on the sensor's tool side, N·s²/mm, or thousand kg.

    Returns
    -------
    array, shape (n, n)
        Of the state (∫f, ė, e, delta and V of eq. (10), the set-points before, the arm's position
        and speed, the force); without ∫f where there is no integral.
    """
    T = gains.period
    dt = T / _WITHIN
    made = fast_filter(1.0, T)  # the same for any tau
    dead, lag = _parts(delay, T, made)
    whole, late = divmod(round(dead / dt), _WITHIN)
    size = 10 + whole
    # Each quantity is a row: how it depends on the state at the cycle's begin.
    rows = np.eye(size)
    integral, speed, e = rows[:3]
    x, v, force = rows[-3:]
    integral = integral + T * force
    push = force + integral / gains.integral - gains.damping * speed - gains.spring * e
    speed = speed + (T / gains.mass) * push  # eq. (1), (2)
    e = e + T * speed  # eq. (3)
    delta, rate = made.transition @ rows[3:5] + np.outer(made.response, e)  # eq. (10)
    sent = np.vstack([delta, rows[5:-3]])
    before, now, then = sent[whole + 2], sent[whole + 1], sent[whole]
    command = before + (1.0 - late / _WITHIN) * (now - before)
    w = 2.0 / lag
    decay = np.exp(-w * dt) * np.array([[1.0 + w * dt, dt], [-w * w * dt, 1.0 - w * dt]])
    felt = np.zeros(size)
    for n in range(1, _WITHIN + 1):
        pace = ((now - before) if n <= late else (then - now)) / T
        behind = decay @ np.array([x - command + lag * pace, v - pace])
        command = command + dt * pace
        x, v = command - lag * pace + behind[0], pace + behind[1]
        if n in (_WITHIN // 2, _WITHIN):
            # A surface pushes harder the deeper the tool is: e away from it lowers the force.
            a = -w * w * behind[0] - 2.0 * w * behind[1]
            felt = felt - 0.5 * (stiffness * (x + LOSS * v) + tool * a)
    matrix = np.vstack([integral, speed, e, delta, rate, sent[:-1], x, v, felt])
    # Without an integral its sum goes on for ever, and has no say.
    return matrix if np.isfinite(gains.integral) else matrix[1:, 1:]


def _parts(delay: float, period: float, filter_: Filter) -> tuple[float, float]:
    """Dead time and lag of the arm in a loop of this delay, s; the damping shortens what is met."""
    # What the filter's step response is short of 1, summed up.
    left = np.linalg.inv(np.eye(2) - filter_.transition)
    late = float((left @ filter_.transition @ left @ filter_.response)[0])
    arm = max(delay + LOSS - (late + _READ) * period, 0.0)
    lag = min(arm, LAG)
    return arm - lag, max(lag, period / _WITHIN)


def growth(gains: ForceGains, stiffness: float, delay: float, tool: float = 0.0) -> float:
    """Largest absolute eigenvalue of the loop; below 1 it comes to rest.

    Parameters
    ----------
    gains : ForceGains
    stiffness : float
        Of the contact, N/mm.
    delay : float
        s, as in `loop_matrix`.
    tool : float
        Mass on the sensor's tool side, N·s²/mm.
    """
    return float(np.abs(np.linalg.eigvals(loop_matrix(gains, stiffness, delay, tool))).max())


def is_stable(gains: ForceGains, stiffness: float, delay: float, tool: float = 0.0) -> bool:
    """Tell whether the force comes to rest in such a contact.

    Parameters
    ----------
    gains : ForceGains
    stiffness, delay, tool : float
        N/mm, s and N·s²/mm, as in `growth`.
    """
    return growth(gains, stiffness, delay, tool) < 1.0


def is_safe(gains: ForceGains, stiffness: float, delay: float, tool: float = 0.0) -> bool:
    """Tell whether it does with gains that answer quicker by `MARGIN`, too.

    Parameters
    ----------
    gains : ForceGains
    stiffness, delay, tool : float
        N/mm, s and N·s²/mm, as in `growth`.
    """
    return is_stable(gains.softened(1.0 / MARGIN), stiffness, delay, tool)


def steadied(
    gains: ForceGains, stiffness: float, delay: float, tool: float = 0.0
) -> ForceGains | None:
    """Return the gains, softened as far as such a contact needs it; None where nothing helps.

    Parameters
    ----------
    gains : ForceGains
    stiffness, delay, tool : float
        N/mm, s and N·s²/mm, as in `growth`.

    Returns
    -------
    ForceGains or None
        The first that `is_safe`, each softer by a fifth than the one before.
    """
    for _ in range(_SOFTENINGS):
        if is_safe(gains, stiffness, delay, tool):
            return gains
        gains = gains.softened(_SOFTER)
    return None
