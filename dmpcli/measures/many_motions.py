"""Length, speed, ends and smoothness of many strokes that share their times.

As `measures.path` and `measures.smoothness`, without a loop over strokes. Positions come with the
components first, shape (3, B, n): each is then one block of memory.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.measures.smoothness import CUTOFF, ORDER
from dmpcli.sine_series import zero_phase

_THRESHOLD, _PADDING = 0.05, 4
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


def many_motions(t: Floats, position: Floats, start: Floats, goal: Floats) -> Motions:
    """Measure how B strokes move.

    Parameters
    ----------
    t : array, shape (n,)
        Increasing, s; n ≥ 5.
    position : array, shape (3, B, n)
        mm.
    start, goal : array, shape (B, 3)
        Where each stroke should begin and end, mm.
    """
    step = _norm(position[..., 1:] - position[..., :-1])
    dt, even = _even(t, position)
    return Motions(
        step.sum(axis=-1),
        (step / np.diff(t)).max(axis=-1),
        np.linalg.norm(position[..., 0].T - start, axis=1),
        np.linalg.norm(position[..., -1].T - goal, axis=1),
        *_smoothness(dt, float(t[-1] - t[0]), even),
    )


def _smoothness(dt: float, T: float, p: Floats) -> tuple[Floats, Floats]:
    """LDLJ and SPARC of evenly sampled, low-passed positions (3, B, n)."""
    move = p[..., 1:] - p[..., :-1]
    step = _norm(move)
    bend = move[..., 1:] - move[..., :-1]
    jerk = bend[..., 1:] - bend[..., :-1]
    squared = np.einsum("cbn,cbn->bn", jerk, jerk) / dt**6
    integral = dt * (squared.sum(axis=1) + squared[:, 0] + squared[:, -1])
    peak = step.max(axis=1) / dt
    moves = (peak > 0.0) & (integral > 0.0)
    safe = np.where(moves, peak, 1.0)
    ldlj = -np.log(T**3 / safe**2 * np.where(moves, integral, 1.0))
    return np.where(moves, ldlj, np.nan), _sparc(step / dt, dt)


def _sparc(speed: Floats, dt: float) -> Floats:
    """Spectral arc length of speeds (B, n), shape (B,)."""
    n = speed.shape[1]
    size = 2 ** (int(np.ceil(np.log2(n))) + _PADDING)
    lines = int(np.searchsorted(np.fft.rfftfreq(size, dt), CUTOFF, side="right"))
    # Speeds are not negative, so that the spectrum is largest at rest.
    largest = speed.sum(axis=1)
    needed = _loud_at_most(speed, largest, size)
    result = np.full(len(speed), np.nan)
    few = needed <= _FEW * lines
    rows = np.flatnonzero((largest > 0.0) & few)
    if len(rows):
        count = min(int(needed[rows].max()) + 1, lines)
        cosine, sine = _waves(n, size, -(-count // 32) * 32)
        some = speed[rows]
        spectrum = np.sqrt((some @ cosine) ** 2 + (some @ sine) ** 2)[:, :count]
        result[rows] = _arc(spectrum / largest[rows, None])
    rows = np.flatnonzero((largest > 0.0) & ~few)
    if len(rows):
        spectrum = np.abs(np.fft.rfft(speed[rows], size))[:, :lines]
        result[rows] = _arc(spectrum / largest[rows, None])
    return result


@lru_cache(maxsize=4)
def _waves(n: int, size: int, count: int) -> tuple[Floats, Floats]:
    """Cosines and sines of the first lines of a spectrum, shape (n, count) each."""
    turn = 2.0 * np.pi / size * (np.outer(np.arange(n), np.arange(count)) % size)
    return np.cos(turn), np.sin(turn)


def _loud_at_most(speed: Floats, largest: Floats, size: int) -> Floats:
    """Line of the spectrum beyond which none reaches the threshold, shape (B,).

    Summed by parts twice, the line at angle w is at most the sum of the second differences'
    magnitudes over (2 sin(w/2))².
    """
    padded = np.pad(speed, ((0, 0), (2, 2)))
    rough = np.abs(padded[:, 2:] - 2.0 * padded[:, 1:-1] + padded[:, :-2]).sum(axis=1)
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


def _even(t: Floats, position: Floats) -> tuple[float, Floats]:
    """Bring samples to even times and low-pass them, as `measures.smoothness` does."""
    n = len(t)
    dt = float(t[-1] - t[0]) / (n - 1)
    even = t[0] + dt * np.arange(n)
    p = position
    if np.abs(t - even).max() > 1e-6 * dt:
        i = np.clip(np.searchsorted(t, even, side="right") - 1, 0, n - 2)
        share = np.clip((even - t[i]) / (t[i + 1] - t[i]), 0.0, 1.0)
        p = p[..., i] + share * (p[..., i + 1] - p[..., i])
    if 0.45 / dt <= CUTOFF:
        return dt, p
    return dt, zero_phase(p, CUTOFF * dt, ORDER)


def _norm(vectors: Floats) -> Floats:
    """Lengths of vectors whose components come first, shape (3, ...)."""
    x, y, z = vectors
    return np.asarray(np.sqrt(x * x + y * y + z * z))
