"""A demonstration in the skill's coordinates, as a function of time that can be differentiated."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.sine_series import SineSeries

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

DEGREE = 5
# Samples of the densest curve: more than eight for each of the most basis functions.
MOST_SAMPLES = 32_000
_OVERSAMPLED = 4
# Of the Butterworth filter, forward and backward.
_ORDER = 4


@dataclass(frozen=True)
class Curve:
    """Coordinates of a stroke over time.

    Attributes
    ----------
    spline : BSpline
        From [0, T] to D coordinates, quintic.
    duration : float
        T, s.
    intervals : int
        Pieces of the band that the curve fills: its highest frequency is ``intervals / (2 T)``.
    """

    spline: "BSpline"
    duration: float
    intervals: int

    @classmethod
    def through(cls, x: Floats, duration: float, intervals: int) -> "Curve":
        """Return the quintic spline through even samples.

        Parameters
        ----------
        x : array, shape (M, D)
            M ≥ 6, from 0 to the duration.
        duration : float
            s.
        intervals : int
            Of the band that the samples fill.
        """
        from scipy.interpolate import make_interp_spline

        spline = make_interp_spline(np.linspace(0.0, duration, len(x)), x, k=DEGREE)
        return cls(spline, duration, intervals)

    def __call__(self, t: Floats, derivative: int = 0) -> Floats:
        """Coordinates, or a derivative of them by time, shape (..., D)."""
        return np.asarray(self.spline(t, derivative))

    def even(self, samples: int) -> Floats:
        """Coordinates at even times from 0 to the end, shape (samples, D)."""
        return self(np.linspace(0.0, self.duration, samples))

    def limited(self, intervals: int, samples: int) -> tuple[Floats, Floats, Floats]:
        """Coordinates without frequencies beyond those of so many pieces, and their derivatives.

        Weights of N functions cannot hold more than N pieces; what is left would alias into them.
        The gentle slope of a Butterworth filter of order 4, forward and backward, harms the
        regression less than the sharp one of a spline.

        Parameters
        ----------
        intervals : int
            Pieces; a frequency of so many / (2 T) falls to one half.
        samples : int
            Even times from 0 to the end.

        Returns
        -------
        x, velocity, acceleration : array, shape (samples, D)
        """
        if intervals >= self.intervals:
            t = np.linspace(0.0, self.duration, samples)
            return self(t), self(t, 1), self(t, 2)
        from scipy.fft import next_fast_len

        pieces = next_fast_len(min(MOST_SAMPLES, _OVERSAMPLED * self.intervals), real=True)
        series = SineSeries.of(np.ascontiguousarray(self.even(pieces + 1).T))
        n = np.arange(1, pieces)
        series = series.lowered(1.0 / (1.0 + (n / intervals) ** (2 * _ORDER)))
        x, velocity, acceleration = (
            series.at(samples, order).T / self.duration**order for order in range(3)
        )
        return x, velocity, acceleration


def dense_count(samples: int) -> int:
    """Even samples that hold a recording of so many: every fourth is one of its own."""
    return min(4 * (samples - 1), MOST_SAMPLES) + 1
