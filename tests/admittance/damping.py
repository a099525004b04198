"""Where gains begin to swing, found by halving what `force_stability` says of them."""

import numpy as np

from dmpcli.admittance.force_law import ForceGains
from dmpcli.admittance.force_stability import is_stable


def smallest_damping(
    stiffness: float, delay: float, period: float, integral: float = np.inf, tool: float = 0.0
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
    tool : float
        Mass on the sensor's tool side, N·s²/mm.
    """
    about = stiffness * (delay + period / 2.0)
    low, high = about / 100.0, about * 100.0
    for _ in range(20):
        middle = float(np.sqrt(low * high))
        gains = ForceGains(period * middle, middle, 0.0, integral, period)
        low, high = (low, middle) if is_stable(gains, stiffness, delay, tool) else (middle, high)
    return high
