"""When a stroke is where: duration, sample grid, and soft starts and ends."""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats

# A shorter soft start, s, is none: no servo has such a period, and t / ease would overflow.
_SHORTEST_EASE = 1e-9


@dataclass(frozen=True)
class Timing:
    """The sample times of one trajectory and the stroke time that each shows.

    Attributes
    ----------
    t : array, shape (T,)
        Time since the trajectory began, s, even.
    stroke : array, shape (T,)
        Time on the demonstration's scale, s: from 0 to T_d.
    tau : float
        Time constant of the new duration, s.
    """

    t: Floats
    stroke: Floats
    tau: float


def timing(
    duration: float,
    rate: float,
    demonstrated: float,
    tau: float,
    ease_in: float = 0.0,
    ease_out: float = 0.0,
) -> Timing:
    """Sample times for a new duration.

    The stroke's path and its ends stay; tau scales with the duration. With easing the rate of
    stroke time rises from 0 to 1 over `ease_in`, and falls to 0 over `ease_out`, as a smooth step
    (6r⁵ - 15r⁴ + 10r³), so that the arm is at rest at both ends; between them the stroke keeps its
    speed, and the trajectory is longer than `duration` by half of either time.

    Parameters
    ----------
    duration : float
        Of the stroke without easing, s; it is rounded to a whole number of samples.
    rate : float
        Samples per second, Hz.
    demonstrated : float
        T_d, s.
    tau : float
        The skill's time constant, s.
    ease_in, ease_out : float
        s; together at most twice the duration.

    Returns
    -------
    Timing
    """
    total = duration + 0.5 * (ease_in + ease_out)
    steps = max(1, round(total * rate))
    t = np.arange(steps + 1) / rate
    total = float(t[-1])
    elapsed = eased(t, ease_in) + total - eased(total - t, ease_out) - t
    elapsed -= elapsed[0]
    # Rounding must not turn stroke time back where the rate is nearly zero.
    stroke = np.maximum.accumulate(elapsed * (demonstrated / elapsed[-1]))
    stroke = np.minimum(stroke, demonstrated)
    stroke[-1] = demonstrated
    return Timing(t, stroke, tau * float(elapsed[-1]) / demonstrated)


def eased(t: Floats, ease: float) -> Floats:
    """Integral over time of a rate that rises smoothly from 0 to 1 in `ease` seconds."""
    if ease < _SHORTEST_EASE:
        return np.array(t, dtype=float)
    r = np.clip(t / ease, 0.0, 1.0)
    risen: Floats = ease * (r**6 - 3.0 * r**5 + 2.5 * r**4)
    return risen + np.maximum(t - ease, 0.0)
