"""Even samples as a line and a sine series: a zero-phase low-pass, and derivatives of what is left.

What the line from first to last sample leaves goes on beyond the ends point-mirrored, as in
`scipy.signal.sosfiltfilt` with a padding as long as the samples, whose import takes longer than
most reports: each term of the series falls by the filter's gain, and the ends stay where they are.
"""

from dataclasses import dataclass, replace

import numpy as np

from dmpcli.arrays import Floats


@dataclass(frozen=True)
class SineSeries:
    """``x(s) = start + s (end - start) + Σ c_n sin(π n s)`` for s from 0 to 1.

    Attributes
    ----------
    start, end : array, shape (...)
    terms : array, shape (..., M)
        c_n, n = 1 ... M.
    """

    start: Floats
    end: Floats
    terms: Floats

    @classmethod
    def of(cls, x: Floats) -> "SineSeries":
        """Return the series through even samples (..., T), T ≥ 2, which has T - 2 terms."""
        start, end = x[..., 0], x[..., -1]
        rest = (x - _line(start, end, x.shape[-1]))[..., 1:-1]
        return cls(start, end, _dst(rest) / (x.shape[-1] - 1))

    def lowered(self, gain: Floats) -> "SineSeries":
        """Return the series with its terms multiplied by gains (M,)."""
        return replace(self, terms=self.terms * gain)

    def at(self, samples: int, derivative: int = 0) -> Floats:
        """Values at even places from 0 to 1, or a derivative by s, shape (..., samples).

        Terms that so few samples do not hold are left out.

        Parameters
        ----------
        samples : int
            At least 2.
        derivative : {0, 1, 2}
        """
        from scipy.fft import dct

        order = min(self.terms.shape[-1], samples - 2)
        frequency = np.pi * np.arange(1, order + 1)
        terms = np.zeros((*self.terms.shape[:-1], samples))
        terms[..., 1 : order + 1] = self.terms[..., :order] * frequency**derivative
        if derivative == 1:
            slope: Floats = (self.end - self.start)[..., None] + 0.5 * dct(terms, type=1, axis=-1)
            return slope
        waves = np.zeros_like(terms)
        waves[..., 1:-1] = 0.5 * _dst(terms[..., 1:-1])
        return -waves if derivative else waves + _line(self.start, self.end, samples)


def zero_phase(x: Floats, cutoff: float, order: int) -> Floats:
    """Digital Butterworth low-pass, forward and backward, along the last axis.

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
    found = _line(x[..., 0], x[..., -1], x.shape[-1])
    found[..., 1:-1] += lowered((x - found)[..., 1:-1], cutoff, order)
    return found


def lowered(waves: Floats, cutoff: float, order: int) -> Floats:
    """Return what is left of waves (..., T - 2) about the line between the ends; see `zero_phase`.

    `SineSeries.of(x).lowered(gain).at(T)` without the line, with no array more than it needs.
    """
    steps = waves.shape[-1] + 1
    # The bilinear transform of the analogue filter.
    ratio = np.tan(0.5 * np.pi * np.arange(1, steps) / steps) / np.tan(np.pi * cutoff)
    terms = _dst(waves)
    terms /= steps
    terms *= 1.0 / (1.0 + ratio ** (2 * order))
    left = _dst(terms, overwrite=True)
    left *= 0.5
    return left


def _line(start: Floats, end: Floats, samples: int) -> Floats:
    share = np.linspace(0.0, 1.0, samples)
    line: Floats = start[..., None] + share * (end - start)[..., None]
    line[..., -1] = end  # to the last digit
    return line


def _dst(x: Floats, overwrite: bool = False) -> Floats:
    from scipy.fft import dst

    return np.asarray(dst(x, type=1, axis=-1, overwrite_x=overwrite)) if x.shape[-1] else x
