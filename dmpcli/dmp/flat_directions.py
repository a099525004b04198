"""Directions in which a recording does not move: a flat stroke's height, a straight one's sides.

All that a spline follows there is noise. A plate is flat and a seam is straight more often than
not, and a direction less is a third of the noise less.
"""

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp.knot_refinement import ROUNDING
from dmpcli.dmp.noise import Noise

# Probability that noise alone is taken for motion.
_CHANCE = 1e-3
# Means of neighbours that noise must explain everywhere; more of them are the cosines' part.
_WINDOWS = (1, 2, 4, 8, 16, 32, 64, 128)


def moving_axes(x: Floats, noise: Noise) -> Floats:
    """Orthonormal directions in which samples move by more than their noise.

    Parameters
    ----------
    x : array, shape (T, D)
        Even in time, of zero mean.
    noise : Noise

    Returns
    -------
    array, shape (D, M)
        Columns: the principal axes of x without the least ones that are flat; M ≥ 1.
    """
    _, axes = np.linalg.eigh(x.T @ x)
    if noise.kind not in ("white", "band"):
        return np.asarray(axes)
    covariance = (noise.axes * noise.sigma**2) @ noise.axes.T
    # What rounding leaves of a plate that is level is nothing, and of one that is aslant a little.
    least = ROUNDING * float(np.max(np.abs(x)))
    flat = 0
    while flat < x.shape[1] - 1:
        axis = axes[:, flat]
        # Rounding takes the variance across the only axis that moves below 0.
        sigma = max(float(np.sqrt(max(axis @ covariance @ axis, 0.0))), least)
        if sigma == 0.0 or not _flat(x @ axis / sigma):
            break
        flat += 1
    return np.asarray(axes[:, flat:])


def _flat(y: Floats) -> bool:
    """Whether samples (T,) are noise of variance 1: in each octave of cosines, and everywhere."""
    from scipy.fft import dct
    from scipy.special import chdtri, ndtri

    count = len(y)
    power = np.cumsum(dct(y, norm="ortho")[1:] ** 2)
    orders = 2 ** np.arange(int(np.log2(count - 1)) + 1)
    if np.any(power[orders - 1] > chdtri(orders, _CHANCE / len(orders))):
        return False
    sums = np.concatenate([[0.0], np.cumsum(y)])
    limit = -ndtri(0.5 * _CHANCE / (count * len(_WINDOWS)))
    return all(
        np.max(np.abs(sums[window:] - sums[:-window])) <= limit * np.sqrt(window)
        for window in _WINDOWS
        if window < count
    )
