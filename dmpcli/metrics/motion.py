"""How strokes move: length, speed, ends, and smoothness, of many that share their times.

Positions come with the components first, shape (3, B, n): each is then one block of memory.

References
----------
.. [1] N. Hogan, D. Sternad: Sensitivity of smoothness measures to movement duration, amplitude,
   and arrests. Journal of Motor Behavior 41 (2009) 529-534.
.. [2] S. Balasubramanian, A. Melendez-Calderon, E. Burdet: A robust and sensitive metric for
   quantifying movement smoothness. IEEE Trans. Biomedical Engineering 59 (2012) 2126-2136.
.. [3] S. Balasubramanian, A. Melendez-Calderon, A. Roby-Brami, E. Burdet: On the analysis of
   movement smoothness. Journal of NeuroEngineering and Rehabilitation 12:112 (2015).
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.sine_series import zero_phase

CUTOFF = 10.0
"""Hz: above it a hand's movement holds noise only [3]; the same for files of every rate."""

ORDER = 6
"""Of the Butterworth low-pass, in one direction."""

_THRESHOLD = 0.05
"""The spectrum is cut above the last frequency whose share of the peak reaches this [3]."""

_PADDING = 4
"""Zeros fill the speed up to ``2**(ceil(log2 n) + padding)`` samples [3]."""

_FEW = 0.3
"""A share of the spectrum up to which its lines are summed one by one rather than by FFT."""


@dataclass(frozen=True)
class Motions:
    """Figures of B strokes, shape (B,) each; NaN smoothness for a tool that stands still."""

    length: Floats
    peak_speed: Floats
    start_error: Floats
    goal_error: Floats
    ldlj: Floats
    sparc: Floats


def motions(
    t: Floats, position: Floats, start: Floats, goal: Floats, compiled: bool = False
) -> Motions:
    """Measure how B strokes move.

    Parameters
    ----------
    t : array, shape (n,)
        Increasing, s; n ≥ 5.
    position : array, shape (3, B, n)
        mm.
    start, goal : array, shape (B, 3)
        Where each stroke should begin and end, mm.
    compiled : bool
        Whether by kernels: the same but for rounding.
    """
    if compiled:
        return _by_kernels(t, position, start, goal)
    step = _norm(position[..., 1:] - position[..., :-1])
    dt, even = _even(t, position, CUTOFF)
    return Motions(
        step.sum(axis=-1),
        (step / np.diff(t)).max(axis=-1),
        np.linalg.norm(position[..., 0].T - start, axis=1),
        np.linalg.norm(position[..., -1].T - goal, axis=1),
        _ldlj(dt, float(t[-1] - t[0]), even),
        _sparc(dt, even, CUTOFF),
    )


def _by_kernels(t: Floats, position: Floats, start: Floats, goal: Floats) -> Motions:
    from dmpcli.metrics.kernels import smoothness, strokes

    count, n = position.shape[1:]
    length, peak, jerk, rough = np.empty((4, count))
    strokes.ways(np.diff(t), position, length, peak)
    dt, even = _resampled(t, position)
    sections, beyond, speed = np.empty((0, 3)), 0, np.empty((count, n - 1))
    if _low_passed(dt, CUTOFF):
        sections = smoothness.low_pass(CUTOFF * dt)
        beyond = smoothness.settling(sections)
        if beyond >= n:
            # Too few samples for the recursion to settle on.
            even, sections, beyond = zero_phase(even, CUTOFF * dt, ORDER), sections[:0], 0
    smoothness.smoothness(dt, np.ascontiguousarray(even), sections, beyond, speed, jerk, rough)
    first, last = position[..., 0].T, position[..., -1].T
    return Motions(
        length,
        peak,
        np.linalg.norm(first - start, axis=1),
        np.linalg.norm(last - goal, axis=1),
        _ldlj_of(dt, float(t[-1] - t[0]), jerk / dt**6, speed.max(axis=1)),
        _sparc_of(dt, speed, CUTOFF, rough, folded=True),
    )


def path_length(position: Floats) -> float:
    """Length of a polyline, mm; noise lengthens it, nothing is smoothed here.

    Parameters
    ----------
    position : array, shape (n, d)
        mm.
    """
    return float(_norm(np.diff(position, axis=0).T).sum())


def log_dimensionless_jerk(t: Floats, position: Floats, cutoff: float | None = CUTOFF) -> Floats:
    """LDLJ [1, 3]: ``-ln(T³/v_peak² ∫|jerk|² dt)``; nearer to 0 is smoother.

    It does not depend on the movement's amplitude or duration. A minimum-jerk reach has
    -ln 204.8 = -5.322, the largest value of any movement from rest to rest.

    Parameters
    ----------
    t : array, shape (n,)
        Increasing, s; n ≥ 5.
    position : array, shape (d, B, n)
        mm.
    cutoff : float, optional
        Low-pass before differentiating, Hz; None leaves the samples as they are.

    Returns
    -------
    array, shape (B,)
        NaN for a tool that stands still.
    """
    dt, p = _even(t, position, cutoff)
    return _ldlj(dt, float(t[-1] - t[0]), p)


def spectral_arc_length(t: Floats, position: Floats, cutoff: float = CUTOFF) -> Floats:
    """SPARC [2, 3]: minus the arc length of the speed's spectrum; nearer to 0 is smoother.

    The spectrum is divided by its peak, its frequencies by the last one that counts.

    Parameters
    ----------
    t : array, shape (n,)
        Increasing, s; n ≥ 5.
    position : array, shape (d, B, n)
        mm.
    cutoff : float
        Highest frequency looked at, Hz.

    Returns
    -------
    array, shape (B,)
        NaN for a tool that stands still.
    """
    return _sparc(*_even(t, position, cutoff), cutoff)


def _ldlj(dt: float, T: float, p: Floats) -> Floats:
    """LDLJ of evenly sampled, low-passed positions (d, B, n)."""
    move = p[..., 1:] - p[..., :-1]
    step = _norm(move)
    bend = move[..., 1:] - move[..., :-1]
    jerk = bend[..., 1:] - bend[..., :-1]
    squared = np.einsum("cbn,cbn->bn", jerk, jerk) / dt**6
    # Third differences reach to one sample from either end; the end values hold there.
    whole = squared.sum(axis=1) + squared[:, 0] + squared[:, -1]
    return _ldlj_of(dt, T, whole, step.max(axis=1) / dt)


def _ldlj_of(dt: float, T: float, squared: Floats, peak: Floats) -> Floats:
    """LDLJ of summed squares of the jerk, those of both ends twice, and largest speeds, (B,)."""
    integral = dt * squared
    moves = (peak > 0.0) & (integral > 0.0)
    safe = np.where(moves, peak, 1.0)
    ldlj = -np.log(T**3 / safe**2 * np.where(moves, integral, 1.0))
    return np.where(moves, ldlj, np.nan)


def _sparc(dt: float, p: Floats, cutoff: float) -> Floats:
    """Spectral arc length of evenly sampled, low-passed positions (d, B, n)."""
    speed = _norm(p[..., 1:] - p[..., :-1]) / dt
    return _sparc_of(dt, speed, cutoff, _roughness(speed))


def _roughness(speed: Floats) -> Floats:
    """Sums of the magnitudes of second differences of speeds (B, n) among zeros, shape (B,)."""
    padded = np.pad(speed, ((0, 0), (2, 2)))
    return np.asarray(np.abs(padded[:, 2:] - 2.0 * padded[:, 1:-1] + padded[:, :-2]).sum(axis=1))


def _sparc_of(
    dt: float, speed: Floats, cutoff: float, rough: Floats, folded: bool = False
) -> Floats:
    """Spectral arc length of speeds (B, n); for `rough` see `_loud_at_most`.

    With `folded` half of the products are spared: the same but for rounding.
    """
    n = speed.shape[1]
    size = 2 ** (int(np.ceil(np.log2(n))) + _PADDING)
    lines = int(np.searchsorted(np.fft.rfftfreq(size, dt), cutoff, side="right"))
    # Speeds are not negative, so that the spectrum is largest at rest.
    largest = speed.sum(axis=1)
    needed = _loud_at_most(rough, largest, size)
    result = np.full(len(speed), np.nan)
    few = needed <= _FEW * lines
    rows = np.flatnonzero((largest > 0.0) & few)
    if len(rows):
        count = min(int(needed[rows].max()) + 1, lines)
        wide, some = -(-count // 32) * 32, speed if len(rows) == len(speed) else speed[rows]
        if folded:
            result[rows] = _folded_arc(some, size, wide, count, largest[rows])
        else:
            cosine, sine = _waves(n, size, wide)
            spectrum = np.sqrt((some @ cosine) ** 2 + (some @ sine) ** 2)[:, :count]
            result[rows] = _arc(spectrum / largest[rows, None])
    rows = np.flatnonzero((largest > 0.0) & ~few)
    if len(rows):
        spectrum = np.abs(np.fft.rfft(speed[rows], size))[:, :lines]
        result[rows] = _arc(spectrum / largest[rows, None])
    return result


def _folded_arc(speed: Floats, size: int, wide: int, count: int, largest: Floats) -> Floats:
    """Arcs (B,), by kernels, of the first `count` of `wide` lines of the spectra of speeds (B, n).

    They are counted from their middles: there cosines go with what a speed has in common with its
    mirror image, sines with the rest.
    """
    from dmpcli.metrics.kernels import smoothness

    n = speed.shape[1]
    half = n - n // 2
    mirrored = speed[:, : n - half - 1 : -1]
    even, odd = speed[:, :half] + mirrored, speed[:, :half] - mirrored
    if n % 2:
        even[:, -1] *= 0.5  # the middle is its own image
    nodes, lines = _half_waves(n, size, wide)
    real, imaginary = (
        (part @ at) @ to for part, at, to in zip((even, odd), nodes, lines, strict=True)
    )
    arcs = np.empty(len(speed))
    smoothness.arcs(real, imaginary, largest, _THRESHOLD, count, arcs)
    return arcs


@lru_cache(maxsize=4)
def _half_waves(n: int, size: int, count: int) -> tuple[tuple[Floats, Floats], ...]:
    """Cosines and sines at some frequencies, (n / 2, m) each, and how lines follow from these.

    So short a signal has no room for more than few waves below the last line, so that its spectrum
    is a polynomial but for rounding: m Chebyshev nodes in place of all lines, and (m, count) from
    the ones to the others.
    """
    from_middle = np.arange(n - n // 2) - 0.5 * (n - 1)
    last = 2.0 * np.pi / size * (count - 1)
    turns = 0.5 * last * (n - 1)
    # Bessel functions of that argument are below the rounding beyond this order.
    m = int(np.ceil(0.5 * (turns + 8.0 * np.cbrt(turns)))) + 5
    node = np.pi * (2.0 * np.arange(m) + 1.0) / (4.0 * m)
    line = np.arccos(np.arange(count) / (count - 1.0))
    turn = np.outer(from_middle, last * np.cos(node))
    order = 2.0 * np.arange(m)
    share = np.where(order > 0.0, 2.0, 1.0) / m
    even = np.cos(np.outer(node, order)) * share @ np.cos(np.outer(order, line))
    order += 1.0
    odd = np.cos(np.outer(node, order)) * (2.0 / m) @ np.cos(np.outer(order, line))
    return (np.cos(turn), np.sin(turn)), (even, odd)


@lru_cache(maxsize=4)
def _waves(n: int, size: int, count: int) -> tuple[Floats, Floats]:
    """Cosines and sines of the first lines of a spectrum, shape (n, count) each."""
    turn = 2.0 * np.pi / size * (np.outer(np.arange(n), np.arange(count)) % size)
    return np.cos(turn), np.sin(turn)


def _loud_at_most(rough: Floats, largest: Floats, size: int) -> Floats:
    """Line of the spectrum beyond which none reaches the threshold, shape (B,).

    Summed by parts twice, the line at angle w is at most the sum of the second differences'
    magnitudes, `rough` (B,), over (2 sin(w/2))².
    """
    safe = np.where(largest > 0.0, largest, 1.0)
    sine = 0.5 * np.sqrt(1.000001 * rough / (_THRESHOLD * safe))
    angle = np.where(sine < 1.0, 2.0 * np.arcsin(np.minimum(sine, 1.0)), np.pi)
    return np.ceil(angle * size / (2.0 * np.pi))


def _arc(spectrum: Floats) -> Floats:
    """Minus the arc length of spectra (B, m) up to their last loud line, shape (B,)."""
    m = spectrum.shape[1]
    last = m - 1 - np.argmax(spectrum[:, ::-1] >= _THRESHOLD, axis=1)
    along = 1.0 / np.maximum(last, 1)
    pieces = np.hypot(along[:, None], np.diff(spectrum, axis=1))
    pieces[np.arange(m - 1) >= last[:, None]] = 0.0
    return np.where(last > 0, -pieces.sum(axis=1), np.nan)


def _even(t: Floats, position: Floats, cutoff: float | None) -> tuple[float, Floats]:
    """Bring samples to even times (as many as given), low-passed without phase shift."""
    dt, p = _resampled(t, position)
    if cutoff is None or not _low_passed(dt, cutoff):
        return dt, p
    return dt, zero_phase(p, cutoff * dt, ORDER)


def _low_passed(dt: float, cutoff: float) -> bool:
    """Tell whether samples hold what is above a cut-off, Hz."""
    return 0.45 / dt > cutoff


def _resampled(t: Floats, position: Floats) -> tuple[float, Floats]:
    """Bring samples to even times (as many as given)."""
    n = len(t)
    dt = float(t[-1] - t[0]) / (n - 1)
    even = t[0] + dt * np.arange(n)
    p = position
    if np.abs(t - even).max() > 1e-6 * dt:
        i = np.clip(np.searchsorted(t, even, side="right") - 1, 0, n - 2)
        share = np.clip((even - t[i]) / (t[i + 1] - t[i]), 0.0, 1.0)
        p = p[..., i] + share * (p[..., i + 1] - p[..., i])
    return dt, p


def _norm(vectors: Floats) -> Floats:
    """Lengths of vectors whose components come first, shape (d, ...)."""
    squared = vectors[0] * vectors[0]
    for component in vectors[1:]:
        squared += component * component
    return np.asarray(np.sqrt(squared))
