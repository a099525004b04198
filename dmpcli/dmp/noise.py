"""How much of a recording is noise, and which part of the band it fills.

The estimate rests on the upper half of the discrete cosine spectrum, where a hand does not reach.
It is blind to noise that was filtered, interpolated or quantised on its way: such noise is
recognised by a plateau that ends within the band, or by a lattice on which all samples lie. A
stroke's own detail, such as handwriting, may make a plateau too: it is believed to be noise only
where it is small against the stroke, and present all along the recording. Elsewhere it is doubted.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp import least_squares

Kind = Literal["white", "band", "quantised", "unknown"]

ROUNDING = 1e-5
"""Noise below this part of the stroke's extent is rounding."""

# Mean of the lower three quarters of sums of squares of two standard normal numbers.
_LOWER = 0.75
_MEAN_OF_LOWER = 2.0 * (1.0 - 0.25 * (1.0 + np.log(4.0))) / 0.75
# Times the mean square difference by chance from which on the axes' variances differ.
_APART = 4.0
# Fewer samples do not tell noise from stroke.
FEWEST = 40
# Bands per octave, octaves that a plateau spans at least, and its slope and spread, in decades.
_BANDS = 3
_PLATEAU = 5 / 3
_SLOPE = 0.13
_SPREAD = 1.0
# Decades by which the spectrum falls behind a plateau, and octaves within which it does.
_FALL = 1.5
_WITHIN = 2.0
# Part of the extent above which the root mean square of a plateau is the stroke's own detail.
_SMALL = 0.01
# Halvings of the recording into windows, none of which noise leaves; degrees of freedom that a
# window has at least, the part of the nominal ones that counts, as the plateau is only about level,
# and the chance by which noise leaves any of them.
_HALVINGS, _FREEDOM, _COUNTED, _LEFT = 7, 3.0, 0.75, 3e-3
# First bin that the window's main lobe leaves free.
_FIRST_BIN = 6
# Quantisation coarser than this part of the extent is noise.
_COARSE = 1e-4
# Intervals that resolve most strokes, and samples up to which a recording is short.
_RESOLVED = 40
_SHORT = 1 << 14
# Samples that one rounding error is taken to last, at most.
_LONGEST_HELD = 32.0
# Samples that are looked at for a lattice, at most.
_LATTICE_SAMPLES = 4096


@dataclass(frozen=True)
class Noise:
    """The noise of a recording, as density: the variance per sample, were it white.

    Attributes
    ----------
    axes : array, shape (D, D)
        Columns: its principal axes.
    sigma : array, shape (D,)
        Standard deviation along each, unit of the samples. Of noise that fills a part of the band
        only, the standard deviation that white noise of the same density has.
    kind : {'white', 'band', 'quantised', 'unknown'}
        Of too few samples it is not known, and σ is 0.
    reach : float or None
        Frequency up to which noise of kind 'band' reaches, as part of half the sampling rate. Of
        kind 'white', that up to which there may be such noise too, which is not told from the
        stroke since it is large, or parts of the recording are without it: it is not counted.
    stroke : float or None
        Frequency from which on the noise outweighs the stroke, likewise; a cut-off to name.
    rms : float or None
        Root mean square, over all axes, of what fills the band up to `reach`, unit of the samples.
    step : float or None
        Step of kind 'quantised', unit of the samples.
    """

    axes: Floats
    sigma: Floats
    kind: Kind = "white"
    reach: float | None = None
    stroke: float | None = None
    rms: float | None = None
    step: float | None = None

    @property
    def doubted(self) -> bool:
        """Whether there may be noise in a part of the band that is not counted."""
        return self.kind == "white" and self.reach is not None

    @property
    def total(self) -> float:
        """Variance over all axes."""
        return float(np.sum(self.sigma**2))

    @cached_property
    def largest(self) -> float:
        """Standard deviation along the noisiest axis."""
        return float(np.max(self.sigma))

    @property
    def typical(self) -> float:
        """Root mean square of the axes' standard deviations."""
        return float(np.sqrt(np.mean(self.sigma**2)))

    def along(self, directions: Floats) -> "Noise":
        """Return the noise in coordinates along orthonormal directions, the columns of (D, M)."""
        part = directions.T @ self.axes * self.sigma
        variances, axes = np.linalg.eigh(part @ part.T)
        return replace(self, axes=axes, sigma=np.sqrt(np.maximum(variances, 0.0)))


def estimate(x: Floats, partial: bool = True, held: bool = False) -> Noise:
    """Estimate the noise of even samples.

    σ² is the median of the squared coefficients in the upper half of the orthonormal DCT-II of what
    a least-squares line leaves, over 0.4549, along the principal axes of those coefficients: a
    recording that is rotated in space has the same noise, rotated.

    Parameters
    ----------
    x : array, shape (T, D)
        Even in time.
    partial : bool
        Whether to look for noise that fills a part of the band, and for quantisation.
    held : bool
        Whether x may stand still but for its noise, as the orientation of a tool does.

    Returns
    -------
    Noise
    """
    from scipy.fft import dct

    count = len(x)
    if count < FEWEST:
        return Noise(np.eye(x.shape[1]), np.zeros(x.shape[1]), "unknown")
    centred = x - x.mean(axis=0)
    # What the stroke does at its ends reaches into the upper half of a short recording.
    line = _detrended(x)
    splines = count <= _SHORT
    intervals = max(count // 8, min(count // 4, _RESOLVED))
    rest = least_squares.uniform(count, intervals).residual(centred) if splines else line
    upper = dct(rest, axis=0, norm="ortho")[count // 2 :]
    axes, sigma = _spread(upper)
    if not partial:
        return Noise(axes, sigma)
    extent = float(np.linalg.norm(np.ptp(x, axis=0)))
    step = _lattice_step(x, extent)
    if step is not None:
        # Rounding adds step²/12 on each axis that crosses the lattice. A tool that is slow against
        # it brings fewer independent errors than samples: the same variance at lower frequencies.
        changes = np.count_nonzero(np.diff(x, axis=0), axis=0)
        held = np.clip(count / (changes + 1.0), 1.0, _LONGEST_HELD)
        rounding = np.where(np.ptp(x, axis=0) > step, step * np.sqrt(held / 12.0), 0.0)
        return Noise(
            np.eye(x.shape[1]), np.maximum(rounding, _along(upper)), "quantised", step=step
        )
    band = _plateau(line)
    if band is None:
        return Noise(axes, sigma)
    first, last, coefficients = band
    plateau_axes, plateau = _spread(coefficients)
    if float(np.max(plateau)) < ROUNDING * extent:
        return Noise(axes, sigma)
    half = 0.5 * count
    rms = float(np.sqrt(np.sum(plateau**2) * (last - first) / half))
    small = held or rms <= _SMALL * extent
    if not small or not _throughout(line, first, last, plateau):
        return Noise(axes, sigma, reach=last / half, stroke=first / half, rms=rms)
    return Noise(plateau_axes, plateau, "band", reach=last / half, stroke=first / half, rms=rms)


def _detrended(x: Floats) -> Floats:
    """What the least-squares line of every axis leaves."""
    s = np.linspace(-1.0, 1.0, len(x))
    centred = x - x.mean(axis=0)
    rest: Floats = centred - s[:, None] * ((s @ centred) / (s @ s))
    return rest


def _spread(coefficients: Floats) -> tuple[Floats, Floats]:
    """Principal axes of zero-mean coefficients (M, D), and robust standard deviations on them.

    Alike where so few coefficients do not tell them apart: of isotropic noise the variances on the
    principal axes differ by (D - 1)(D + 2)/(D M) of their mean, root mean square.
    """
    count, dimensions = coefficients.shape
    _, axes = np.linalg.eigh(coefficients.T @ coefficients)
    sigma = _along(coefficients @ axes)
    variances = sigma**2
    mean = float(variances.mean())
    apart = float(np.mean((variances - mean) ** 2))
    by_chance = (dimensions - 1) * (dimensions + 2) / (dimensions * count)
    if apart <= _APART * by_chance * mean**2:
        sigma = np.full(dimensions, np.sqrt(mean))
    return axes, sigma


def _along(coefficients: Floats) -> Floats:
    """Robust standard deviations of coefficients (M, D), by neighbours' sums of squares.

    A stroke whose second half mirrors the first may have rounding errors that do so too: every
    other coefficient is zero then, and quantiles of single ones may be with them.
    """
    squares = coefficients**2
    pairs = squares[: len(squares) // 2 * 2].reshape(-1, 2, squares.shape[1]).sum(axis=1)
    lower = np.sort(pairs, axis=0)[: max(1, round(_LOWER * len(pairs)))]
    sigma: Floats = np.sqrt(lower.mean(axis=0) / _MEAN_OF_LOWER)
    return sigma


def _lattice_step(x: Floats, extent: float) -> float | None:
    """Return the step of the lattice on which samples lie, where it is coarse; None without one."""
    part = x[: _LATTICE_SAMPLES * (1 + len(x) // _LATTICE_SAMPLES) : 1 + len(x) // _LATTICE_SAMPLES]
    steps = []
    for column in part.T:
        values = np.unique(column)
        if len(values) < 3:
            continue
        gaps = np.diff(values)
        step = float(gaps.min())
        if step < _COARSE * extent or len(values) > 0.9 * len(column):
            return None
        shares = gaps / step
        if np.max(np.abs(shares - np.rint(shares))) > 0.01:
            return None
        steps.append(step)
    return max(steps) if steps else None


def _plateau(centred: Floats) -> tuple[int, int, Floats] | None:
    """Find a level stretch of the spectrum behind which the spectrum falls off.

    Returns
    -------
    tuple of int, int, array, shape (M, D), or None
        First and last bin, and the windowed Fourier coefficients between them, real and imaginary
        parts as rows, scaled so that white noise has its own variance.
    """
    count = len(centred)
    # sin⁴ keeps the ends of the stroke and its lines out of the other bins.
    window = np.sin(np.pi * (np.arange(count) + 0.5) / count) ** 4
    spectrum = np.fft.rfft(centred * (window / np.linalg.norm(window))[:, None], axis=0)
    power = np.sum(spectrum.real**2 + spectrum.imag**2, axis=1)
    last = count // 2
    octaves = np.log2(last / _FIRST_BIN)
    if octaves < _PLATEAU + 0.5:
        return None
    edges = np.rint(last * 2.0 ** (np.arange(-int(_BANDS * octaves), 1) / _BANDS)).astype(int)
    edges = np.unique(edges)
    level = np.add.reduceat(np.log10(power[: edges[-1]] + 1e-300), edges[:-1]) / np.diff(edges)
    stretch = _level_stretch(level.tolist())
    if stretch is None:
        return None
    first, end = stretch
    rows = spectrum[edges[first] : edges[end]]
    rows = np.sqrt(2.0) * np.concatenate([rows.real, rows.imag])
    return int(edges[first]), int(edges[end]), rows


def _throughout(rest: Floats, first: int, last: int, sigma: Floats) -> bool:
    """Whether what lies between two bins of the spectrum is there all along the recording.

    Noise has about the same level everywhere; letters end, and what follows them is without.

    Parameters
    ----------
    rest : array, shape (T, D)
    first, last : int
    sigma : array, shape (D,)
        By the plateau between the bins.
    """
    from scipy.special import chdtri

    count = len(rest)
    # Splines, unlike bands of the spectrum, do not ring across the recording.
    band = least_squares.uniform(count, 2 * first).residual(rest)
    if 4 * last < count:
        band = band - least_squares.uniform(count, 2 * last).residual(rest)
    sums = np.concatenate([[0.0], np.cumsum(np.einsum("td,td->t", band, band))])
    variances = sigma**2
    level = float(variances.sum()) * (last - first) / (0.5 * count)
    alike = float(variances.sum()) ** 2 / float(np.sum(variances**2))
    for halvings in range(1, _HALVINGS + 1):
        window = count >> halvings
        freedom = 2.0 * _COUNTED * alike * (last - first) * window / count
        if freedom < _FREEDOM:
            break
        least = float(np.min(sums[window:] - sums[:-window])) / window
        if least < level * float(chdtri(freedom, 1.0 - _LEFT / 2**halvings)) / freedom:
            return False
    return True


def _level_stretch(level: list[float]) -> tuple[int, int] | None:
    """Bands [first, end) of the longest plateau before a fall; None without one."""
    least, within = round(_PLATEAU * _BANDS), round(_WITHIN * _BANDS)
    best = None
    longest = least - 1
    for first in range(len(level) - least):
        low = high = level[first]
        total = moment = 0.0
        for end in range(first + 1, len(level)):
            last = level[end - 1]
            low, high = min(low, last), max(high, last)
            if high - low > _SPREAD:
                break
            total += last
            moment += (end - 1 - first) * last
            size = end - first
            middle = total / size
            falls = level[end] <= middle - 0.3 and level[-1] <= middle - 0.5 * _FALL
            if size <= longest or not falls or min(level[end : end + within]) > middle - _FALL:
                continue
            slope = 12.0 * (moment - 0.5 * (size - 1) * total) / (size * (size * size - 1.0))
            if abs(slope) <= _SLOPE:
                best, longest = (first, end), size
    return best
