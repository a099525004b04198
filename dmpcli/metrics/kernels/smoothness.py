"""Smoothness of strokes, compiled: low-passed forward and backward, a few strokes side by side.

The filter is `sine_series.zero_phase`'s: the same Butterworth low-pass, as a recursion. What the
line between both ends leaves goes on beyond them point-mirrored, far enough that nothing is left of
what the recursion began with.
"""

import math

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.compiled import kernel

_ASIDE = 8
"""Strokes side by side: the processor works on several at once."""

_LANES = 3 * _ASIDE

_LEFT = 1e-18
"""What is left of the beginning of the recursion."""


def low_pass(cutoff: float) -> Floats:
    """Return the three sections of a digital Butterworth low-pass of order 6.

    By the bilinear transform, as `sine_series.lowered` has it.

    Parameters
    ----------
    cutoff : float
        Cycles per sample, below one half.

    Returns
    -------
    array, shape (3, 3)
        g, p, q of ``g (1 + z⁻¹)² / (1 + p z⁻¹ + q z⁻²)``.
    """
    w = math.tan(math.pi * cutoff)
    damping = 2.0 * w * np.sin(np.pi / 12.0 * np.array([1.0, 3.0, 5.0]))
    whole = 1.0 + damping + w * w
    g, p, q = w * w / whole, 2.0 * (w * w - 1.0) / whole, (1.0 - damping + w * w) / whole
    return np.stack([g, p, q], axis=1)


def settling(sections: Floats) -> int:
    """Samples after which nothing is left of what a low-pass began with."""
    # The poles of a section are a pair of magnitude √q.
    return math.ceil(math.log(_LEFT) / math.log(math.sqrt(float(sections[:, 2].max()))))


@kernel
def _filtered(x: Floats, held: Floats, sections: Floats, first: int, last: int, way: int) -> None:
    """Filter rows of x (m, _LANES) from first to last, in place; `held` is (6, _LANES)."""
    held[:] = 0.0
    g0, p0, q0 = sections[0, 0], sections[0, 1], sections[0, 2]
    g1, p1, q1 = sections[1, 0], sections[1, 1], sections[1, 2]
    g2, p2, q2 = sections[2, 0], sections[2, 1], sections[2, 2]
    for i in range(first, last, way):
        row = x[i]
        for k in range(_LANES):
            v = g0 * row[k]
            y = v + held[0, k]
            held[0, k], held[1, k] = (v + v) - p0 * y + held[1, k], v - q0 * y
            v = g1 * y
            y = v + held[2, k]
            held[2, k], held[3, k] = (v + v) - p1 * y + held[3, k], v - q1 * y
            v = g2 * y
            y = v + held[4, k]
            held[4, k], held[5, k] = (v + v) - p2 * y + held[5, k], v - q2 * y
            row[k] = y


@kernel
def _laid(even: Floats, b: int, some: int, x: Floats, first: int) -> None:
    """Lay so many strokes from b on side by side into x, from row `first` on: u, then v, then w."""
    for c in range(3):
        for i in range(even.shape[2]):
            for k in range(some):
                x[first + i, c * _ASIDE + k] = even[c, b + k, i]


@kernel
def _low_passed(x: Floats, held: Floats, sections: Floats, first: int, last: int) -> None:
    """Low-pass the rows of x from `first` to `last`, which stay as they are, in place."""
    start, end, beyond = x[first].copy(), x[last].copy(), first
    way = end - start
    for i in range(last - first + 1):
        share = i / (last - first)
        for k in range(_LANES):
            x[first + i, k] -= start[k] + share * way[k]
    x[last] = 0.0
    for i in range(1, beyond + 1):
        for k in range(_LANES):
            x[first - i, k] = -x[first + i, k]
            x[last + i, k] = -x[last - i, k]
    _filtered(x, held, sections, 0, len(x), 1)
    _filtered(x, held, sections, len(x) - 1, first, -1)
    for i in range(1, last - first):
        share = i / (last - first)
        for k in range(_LANES):
            x[first + i, k] += start[k] + share * way[k]
    x[first], x[last] = start, end


@kernel
def _jerks(x: Floats, first: int, last: int, squared: Floats) -> None:
    """Fill in sums (_LANES,) of squared third differences, of which both ends count twice."""
    squared[:] = 0.0
    for i in range(first, last - 2):
        twice = 2.0 if i == first or i == last - 3 else 1.0
        for k in range(_LANES):
            third = x[i + 3, k] - 3.0 * (x[i + 2, k] - x[i + 1, k]) - x[i, k]
            squared[k] += twice * (third * third)


@kernel
def _speeds(dt: float, x: Floats, first: int, last: int, padded: Floats, rough: Floats) -> None:
    """Fill in speeds, from the third row on, and the sums of their second differences."""
    for i in range(last - first):
        for k in range(_ASIDE):
            u = x[first + i + 1, k] - x[first + i, k]
            v = x[first + i + 1, _ASIDE + k] - x[first + i, _ASIDE + k]
            w = x[first + i + 1, 2 * _ASIDE + k] - x[first + i, 2 * _ASIDE + k]
            padded[i + 2, k] = math.sqrt(u * u + v * v + w * w) / dt
    rough[:] = 0.0
    for i in range(last - first + 2):
        for k in range(_ASIDE):
            rough[k] += abs(padded[i + 2, k] - 2.0 * padded[i + 1, k] + padded[i, k])


@kernel
def smoothness(
    dt: float,
    even: Floats,
    sections: Floats,
    beyond: int,
    speed: Floats,
    jerk: Floats,
    rough: Floats,
) -> None:
    """Fill in what smoothness is told by, of evenly sampled strokes (3, B, n), n ≥ 5.

    Parameters
    ----------
    dt : float
        s.
    even : array, shape (3, B, n)
        mm.
    sections : array, shape (3, 3) or (0, 3)
        Sections of the low-pass, if there is one.
    beyond : int
        Samples that the recursion needs to settle, less than n.
    speed : array, shape (B, n - 1)
        Of the low-passed strokes, mm/s.
    jerk : array, shape (B,)
        Sum of the squared third differences, of which the first and last count twice, mm².
    rough : array, shape (B,)
        Sums of the magnitudes of the speed's second differences, where zeros go before and follow,
        mm/s.
    """
    count, n = even.shape[1:]
    first, last = beyond, beyond + n - 1
    x, held = np.zeros((n + 2 * beyond, _LANES)), np.empty((6, _LANES))
    squared, total, padded = np.empty(_LANES), np.empty(_ASIDE), np.zeros((n + 3, _ASIDE))
    for b in range(0, count, _ASIDE):
        some = min(_ASIDE, count - b)
        _laid(even, b, some, x, first)
        if len(sections) > 0:
            _low_passed(x, held, sections, first, last)
        _jerks(x, first, last, squared)
        _speeds(dt, x, first, last, padded, total)
        for k in range(some):
            jerk[b + k] = squared[k] + squared[_ASIDE + k] + squared[2 * _ASIDE + k]
            rough[b + k] = total[k]
            for i in range(n - 1):
                speed[b + k, i] = padded[i + 2, k]


@kernel
def arcs(
    real: Floats, imaginary: Floats, largest: Floats, least: float, lines: int, found: Floats
) -> None:
    """Fill in minus the arc lengths (B,) of spectra up to their last loud line.

    Parameters
    ----------
    real, imaginary : array, shape (B, m)
        Of which so many `lines` are looked at.
    largest : array, shape (B,)
        What spectra are divided by, above 0.
    least : float
        Share from which a line is loud; one without a loud line but the first has no arc: NaN.
    """
    line = np.empty(lines)
    for b in range(len(real)):
        for i in range(lines):
            x, y = real[b, i], imaginary[b, i]
            line[i] = math.sqrt(x * x + y * y) / largest[b]
        last = lines - 1
        while last > 0 and not line[last] >= least:
            last -= 1
        if last == 0:
            found[b] = np.nan
            continue
        total, along = 0.0, 1.0 / last
        for i in range(last):
            rise = line[i + 1] - line[i]
            total += math.sqrt(along * along + rise * rise)
        found[b] = -total
