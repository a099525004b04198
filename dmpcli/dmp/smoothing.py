"""From a recording to a stroke that can be learned: even time, no idle ends, no noise.

The zero-phase low-pass and the spline are scipy's.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.spatial import rotations
from dmpcli.spatial.trajectory import Trajectory

# A sample moves when it is faster than this part of the stroke's peak speed ...
REST_SPEED = 0.01
# ... and this part of the moving time is kept before and after, so that a soft start stays whole.
IDLE_MARGIN = 0.05
# Recordings are evenly sampled when no step differs from the median by more than this part of it.
_EVEN = 1e-4
_ORDER = 4


@dataclass(frozen=True)
class Signal:
    """Smoothed samples and their derivatives by time.

    Attributes
    ----------
    x, velocity, acceleration : array, shape (T, D)
    """

    x: Floats
    velocity: Floats
    acceleration: Floats


def evenly_sampled(stroke: Trajectory) -> Trajectory:
    """Return the stroke on an even time grid from 0, at its median rate.

    Positions follow a cubic spline, rotations the shortest arc.
    """
    t = stroke.t - stroke.t[0]
    steps = np.diff(t)
    step = float(np.median(steps))
    if is_even(t):
        # Spread rounding of the time stamps over the grid instead of leaving it in the derivatives.
        return Trajectory(
            np.linspace(0.0, t[-1], len(t)),
            stroke.position,
            stroke.rotation,
            contact_force=stroke.contact_force,
        )
    from scipy.interpolate import CubicSpline

    even = np.linspace(0.0, t[-1], round(float(t[-1]) / step) + 1)
    rotation = None if stroke.rotation is None else rotations.interpolate(t, stroke.rotation, even)
    force = stroke.contact_force
    if force is not None:
        force = CubicSpline(t, force)(even)
    return Trajectory(even, CubicSpline(t, stroke.position)(even), rotation, contact_force=force)


def is_even(t: Floats) -> bool:
    """Whether no step of times (T,) differs from the median one by more than rounding does."""
    steps = np.diff(t)
    step = float(np.median(steps))
    return bool(np.max(np.abs(steps - step)) <= _EVEN * step)


def low_pass(x: Floats, rate: float, cutoff: float | None) -> Floats:
    """Zero-phase Butterworth low-pass of order 4, forward and backward.

    Parameters
    ----------
    x : array, shape (T, D)
    rate : float
        Hz.
    cutoff : float or None
        Hz, where the gain is one half; None, or half the rate and above, leaves x as it is.

    Returns
    -------
    array, shape (T, D)
    """
    if cutoff is None or cutoff >= 0.5 * rate:
        return x
    from scipy.signal import sosfiltfilt

    # The longest settling time that the recording allows keeps its ends where they are.
    settling = int(np.ceil(3.0 * rate / cutoff))
    padding = min(len(x) - 1, settling)
    return np.asarray(sosfiltfilt(_butterworth(cutoff / rate), x, axis=0, padlen=padding))


@lru_cache(maxsize=8)
def _butterworth(cutoff: float) -> Floats:
    """Second-order sections of the low-pass; `cutoff` in samples⁻¹."""
    from scipy.signal import butter

    return np.asarray(butter(_ORDER, cutoff, fs=1.0, output="sos"))


def differentiated(t: Floats, x: Floats) -> Signal:
    """Velocity and acceleration of even samples, from the quintic spline through them.

    Parameters
    ----------
    t : array, shape (T,)
    x : array, shape (T, D)

    Returns
    -------
    Signal
    """
    from scipy.interpolate import make_interp_spline

    spline = make_interp_spline(t, x, k=5)
    return Signal(x, spline(t, 1), spline(t, 2))


def moving_part(t: Floats, position: Floats) -> slice:
    """Samples between the idle ends.

    Parameters
    ----------
    t : array, shape (T,)
        Even, s.
    position : array, shape (T, 3)
        Smoothed, mm.

    Returns
    -------
    slice
        From `IDLE_MARGIN` before the first sample faster than `REST_SPEED` of the peak to as much
        after the last; everything when nothing moves.
    """
    speed = np.linalg.norm(np.gradient(position, t, axis=0), axis=1)
    moving = np.flatnonzero(speed > REST_SPEED * speed.max())
    if len(moving) == 0:
        return slice(0, len(t))
    first, last = int(moving[0]), int(moving[-1])
    margin = int(np.ceil(IDLE_MARGIN * (last - first)))
    return slice(max(0, first - margin), min(len(t), last + 1 + margin))
