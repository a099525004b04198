"""Smoothness of a movement: log dimensionless jerk and spectral arc length.

References
----------
.. [1] N. Hogan, D. Sternad: Sensitivity of smoothness measures to movement duration, amplitude,
   and arrests. Journal of Motor Behavior 41 (2009) 529-534.
.. [2] S. Balasubramanian, A. Melendez-Calderon, E. Burdet: A robust and sensitive metric for
   quantifying movement smoothness. IEEE Trans. Biomedical Engineering 59 (2012) 2126-2136.
.. [3] S. Balasubramanian, A. Melendez-Calderon, A. Roby-Brami, E. Burdet: On the analysis of
   movement smoothness. Journal of NeuroEngineering and Rehabilitation 12:112 (2015).
"""

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.sine_series import zero_phase

CUTOFF = 10.0
"""Hz: above it a hand's movement holds noise only [3]; the same for files of every rate."""

ORDER = 6
"""Of the Butterworth low-pass, in one direction."""


def log_dimensionless_jerk(t: Floats, position: Floats, cutoff: float | None = CUTOFF) -> float:
    """LDLJ [1, 3]: ``-ln(T³/v_peak² ∫|jerk|² dt)``; nearer to 0 is smoother.

    It does not depend on the movement's amplitude or duration. A minimum-jerk reach has
    -ln 204.8 = -5.322, the largest value of any movement from rest to rest.

    Parameters
    ----------
    t : array, shape (n,)
        Increasing, s; n ≥ 5.
    position : array, shape (n, d)
        mm.
    cutoff : float, optional
        Low-pass before differentiating, Hz; None leaves the samples as they are.

    Returns
    -------
    float
        NaN for a tool that stands still.
    """
    dt, p = _even(t, position, cutoff)
    T = float(t[-1] - t[0])
    peak = np.linalg.norm(np.diff(p, axis=0), axis=1).max() / dt
    if peak == 0.0:
        return float("nan")
    squared = np.sum(np.diff(p, n=3, axis=0) ** 2, axis=1) / dt**6
    # Third differences reach to one sample from either end; the end values hold there.
    integral = dt * (squared.sum() + squared[0] + squared[-1])
    return float(-np.log(T**3 / peak**2 * integral)) if integral > 0.0 else float("nan")


def spectral_arc_length(
    t: Floats,
    position: Floats,
    cutoff: float = CUTOFF,
    threshold: float = 0.05,
    padding: int = 4,
) -> float:
    """SPARC [2, 3]: minus the arc length of the speed's spectrum; nearer to 0 is smoother.

    The spectrum is divided by its peak, its frequencies by the last one that counts.

    Parameters
    ----------
    t : array, shape (n,)
        Increasing, s; n ≥ 5.
    position : array, shape (n, d)
        mm.
    cutoff : float
        Highest frequency looked at, Hz.
    threshold : float
        The spectrum is cut above the last frequency whose share of the peak reaches this.
    padding : int
        Zeros fill the speed up to ``2**(ceil(log2 n) + padding)`` samples.

    Returns
    -------
    float
        NaN for a tool that stands still.
    """
    dt, p = _even(t, position, cutoff)
    speed = np.linalg.norm(np.diff(p, axis=0), axis=1) / dt
    size = 2 ** (int(np.ceil(np.log2(len(speed)))) + padding)
    spectrum = np.abs(np.fft.rfft(speed, size))
    if spectrum.max() == 0.0:
        return float("nan")
    frequency = np.fft.rfftfreq(size, dt)
    spectrum = spectrum[frequency <= cutoff] / spectrum.max()
    loud = np.flatnonzero(spectrum >= threshold)
    spectrum = spectrum[: loud[-1] + 1]
    if len(spectrum) < 2:
        return float("nan")
    along = 1.0 / (len(spectrum) - 1)
    return float(-np.sum(np.hypot(along, np.diff(spectrum))))


def _even(t: Floats, position: Floats, cutoff: float | None) -> tuple[float, Floats]:
    """Bring samples to even times (as many as given), low-passed without phase shift."""
    n = len(t)
    dt = float(t[-1] - t[0]) / (n - 1)
    even = t[0] + dt * np.arange(n)
    p = position
    if np.abs(t - even).max() > 1e-6 * dt:
        p = np.column_stack([np.interp(even, t, column) for column in position.T])
    if cutoff is None or cutoff >= 0.45 / dt:
        return dt, p
    return dt, np.ascontiguousarray(zero_phase(p.T, cutoff * dt, ORDER).T)
