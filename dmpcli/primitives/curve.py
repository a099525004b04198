"""A demonstration in the skill's coordinates, as a function of time that can be differentiated."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.primitives.smoothing import low_pass

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

DEGREE = 5
# Samples of the densest curve: more than eight for each of the most basis functions.
MOST_SAMPLES = 32_000
_OVERSAMPLED = 4


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

    def limited(self, intervals: int) -> "Curve":
        """Return the curve without frequencies beyond those of so many pieces.

        Weights of N functions cannot hold more than N pieces; what is left would alias into them.
        The gentle slope of a low-pass harms the regression less than the sharp one of a spline.
        """
        if intervals >= self.intervals:
            return self
        samples = min(MOST_SAMPLES, _OVERSAMPLED * self.intervals) + 1
        rate, cutoff = (samples - 1) / self.duration, 0.5 * intervals / self.duration
        x = low_pass(self.even(samples), rate, cutoff)
        return Curve.through(x, self.duration, intervals)


def dense_count(samples: int) -> int:
    """Even samples that hold a recording of so many: every fourth is one of its own."""
    return min(4 * (samples - 1), MOST_SAMPLES) + 1
