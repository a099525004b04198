"""Stopping along the path: how fast path time runs while the arm comes to rest.

Path time s stands still at the end of the ramp, so the tool stops on the path and not beside it.
With position p(s), acceleration is ``p''(s)·r² + p'(s)·dr/dt`` for the rate ``r = ds/dt``.
"""

import numpy as np

_FRACTION = np.linspace(0.0, 1.0, 201)[1:-1]


def progress(elapsed: float, duration: float) -> float:
    """Path time spent since the ramp began, s: duration/2 in the end.

    The integral of its rate ``1 - u² (3 - 2u)``, where ``u = elapsed/duration``: from 1 at once to
    0 at `duration`, smooth at both ends.

    Parameters
    ----------
    elapsed, duration : float
        s.
    """
    u = min(max(elapsed / duration, 0.0), 1.0)
    return duration * (u - u**3 + u**4 / 2.0)


def duration(speed: float, acceleration: float, max_acceleration: float, max_jerk: float) -> float:
    """Shortest ramp that keeps the arm inside its limits.

    Parameters
    ----------
    speed, acceleration : float
        Largest of the plan ahead, mm/s and mm/s² (or rad/s and rad/s²).
    max_acceleration, max_jerk : float
        Limits. The ramp's own share of the jerk stays below its limit.

    Returns
    -------
    float
        s. A plan that already takes all of the acceleration leaves none for braking until it
        slows down; its last hundredth is then used, and the limit exceeded by at most that much.
    """
    if speed == 0.0:
        return 0.0
    used = min(acceleration / max_acceleration, 0.99)
    # |p''| r² + |p'| |dr/dt| <= limit, where |dr/dt| = 6 u (1 - u) / duration.
    r = 1.0 - _FRACTION**2 * (3.0 - 2.0 * _FRACTION)
    slack = (1.0 - used * r**2) / (6.0 * _FRACTION * (1.0 - _FRACTION))
    braking = max_acceleration * float(slack.min())
    return max(speed / braking, float(np.sqrt(6.0 * speed / max_jerk)))
