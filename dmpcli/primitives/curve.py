"""A demonstration in the skill's coordinates, as a function of time that can be differentiated."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dmpcli.arrays import Floats

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
        regression less than the sharp one of a spline. It acts on the sine series of what the
        line from start to goal leaves: the stroke goes on beyond its ends point-mirrored, and keeps
        them.

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
        from scipy.fft import dct, dst, next_fast_len

        pieces = next_fast_len(min(MOST_SAMPLES, _OVERSAMPLED * self.intervals), real=True)
        x = self.even(pieces + 1)
        start, way = x[0], x[-1] - x[0]
        inside = np.linspace(0.0, 1.0, pieces + 1)[1:-1, None]
        order = min(pieces, samples - 1) - 1
        series = dst(x[1:-1] - start - inside * way, type=1, axis=0)[:order] / pieces
        n = np.arange(1, order + 1)[:, None]
        series /= 1.0 + (n / intervals) ** (2 * _ORDER)
        frequency = np.pi * n / self.duration
        share = np.linspace(0.0, 1.0, samples)[:, None]
        sine, cosine = np.zeros((2, samples, x.shape[1]))
        sine[1:-1][:order] = series
        cosine[1:-1][:order] = frequency * series
        values, velocity, bend = start + share * way, np.zeros_like(sine), np.zeros_like(sine)
        values[1:-1] += 0.5 * dst(sine[1:-1], type=1, axis=0)
        velocity = way / self.duration + 0.5 * dct(cosine, type=1, axis=0)
        sine[1:-1][:order] *= frequency**2
        bend[1:-1] = -0.5 * dst(sine[1:-1], type=1, axis=0)
        return values, velocity, bend


def dense_count(samples: int) -> int:
    """Even samples that hold a recording of so many: every fourth is one of its own."""
    return min(4 * (samples - 1), MOST_SAMPLES) + 1
