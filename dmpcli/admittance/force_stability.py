"""Which force gains are stable in contact: predicted from stiffness and delay, in one dimension.

The loop is the law of `force_law` in discrete time, a pure delay (between two cycles linearly
interpolated) and a spring of stiffness k. Its largest eigenvalue tells; no frequency response is
approximated. A lag counts as a delay as long, which is on the safe side: of the same total, lags
turn the phase less.
"""

import numpy as np

from dmpcli.admittance.force_law import ForceGains
from dmpcli.arrays import Floats

_STEPS, _BRACKET = 20, 100.0
# Steps of the bisection, and how far from the rule a bound is looked for, times.


def loop_matrix(gains: ForceGains, stiffness: float, delay: float) -> Floats:
    """State matrix of one cycle of the closed loop.

    Parameters
    ----------
    gains : ForceGains
    stiffness : float
        N/mm.
    delay : float
        From a displacement to its force, s, without the half period that the law's own steps are.

    Returns
    -------
    array, shape (n, n)
        Of the state (∫f, ė, e, e one cycle ago, ...); without ∫f where there is no integral.
    """
    T = gains.period
    cycles = delay / T
    whole = int(cycles)
    share = cycles - whole
    size = 3 + whole + 1
    felt = np.zeros(size)
    felt[2 + whole] = -stiffness * (1.0 - share)
    felt[3 + whole] = -stiffness * share
    integral = np.eye(size)[0] + T * felt
    speed = np.eye(size)[1] + (T / gains.mass) * (
        felt
        + integral / gains.integral
        - gains.damping * np.eye(size)[1]
        - gains.spring * np.eye(size)[2]
    )
    # A surface pushes harder the deeper the tool is: e away from it lowers the force.
    matrix = np.zeros((size, size))
    matrix[0], matrix[1] = integral, speed
    matrix[2] = np.eye(size)[2] + T * speed
    matrix[3:, 2:-1] = np.eye(size - 3)
    # Without an integral its sum goes on for ever, and has no say.
    return matrix if np.isfinite(gains.integral) else matrix[1:, 1:]


def growth(gains: ForceGains, stiffness: float, delay: float) -> float:
    """Largest absolute eigenvalue of the loop; below 1 it comes to rest."""
    return float(np.abs(np.linalg.eigvals(loop_matrix(gains, stiffness, delay))).max())


def is_stable(gains: ForceGains, stiffness: float, delay: float) -> bool:
    """Tell whether the force comes to rest in such a contact."""
    return growth(gains, stiffness, delay) < 1.0


def largest_stiffness(gains: ForceGains, delay: float) -> float:
    """Stiffest contact in which the gains are stable, N/mm; by bisection, to a thousandth.

    Parameters
    ----------
    gains : ForceGains
    delay : float
        s.
    """
    about = gains.damping / (delay + gains.period / 2.0)
    low, high = about / _BRACKET, about * _BRACKET
    for _ in range(_STEPS):
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if is_stable(gains, middle, delay) else (low, middle)
    return low


def smallest_damping(
    stiffness: float, delay: float, period: float, integral: float = np.inf
) -> float:
    """Smallest stable damping of a law whose mass is period times damping, N·s/mm.

    Parameters
    ----------
    stiffness : float
        N/mm.
    delay : float
        s.
    period : float
        s.
    integral : float
        T_i, s.
    """
    about = stiffness * (delay + period / 2.0)
    low, high = about / _BRACKET, about * _BRACKET
    for _ in range(_STEPS):
        middle = float(np.sqrt(low * high))
        gains = ForceGains(period * middle, middle, 0.0, integral, period)
        low, high = (low, middle) if is_stable(gains, stiffness, delay) else (middle, high)
    return high
