"""A zero-phase low-pass without `scipy.signal`, whose import takes longer than most reports."""

import numpy as np

from dmpcli.arrays import Floats


def zero_phase(x: Floats, cutoff: float, order: int) -> Floats:
    """Digital Butterworth low-pass, forward and backward, along the last axis.

    The samples go on beyond their ends point-mirrored, as in `scipy.signal.sosfiltfilt` with a
    padding as long as they are: what the line from first to last leaves is a sine series, each term
    of which falls by the filter's gain. The ends stay where they are.

    Parameters
    ----------
    x : array, shape (..., T)
        Even in time.
    cutoff : float
        Cycles per sample, below one half; the gain there is one half.
    order : int
        Of the filter in one direction.

    Returns
    -------
    array, shape of `x`
    """
    from scipy.fft import dst

    steps = x.shape[-1] - 1
    if steps < 2:
        return x.copy()
    share = np.arange(1, steps) / steps
    line = x[..., :1] + share * (x[..., -1:] - x[..., :1])
    # The bilinear transform of the analogue filter.
    ratio = np.tan(0.5 * np.pi * share) / np.tan(np.pi * cutoff)
    gain = 1.0 / (1.0 + ratio ** (2 * order))
    series = dst(x[..., 1:-1] - line, type=1, axis=-1) * gain
    filtered = x.copy()
    filtered[..., 1:-1] = line + dst(series, type=1, axis=-1) / (2.0 * steps)
    return filtered
