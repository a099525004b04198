"""How strokes move and where they turn, compiled: one walk over the samples of each."""

import math

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.compiled import kernel


@kernel
def charted(position: Floats, start: Floats, axes: Floats) -> Floats:
    """u, v, w of positions in the charts of their strokes.

    Parameters
    ----------
    position : array, shape (3, B, n)
        Base frame, mm.
    start : array, shape (B, 3)
        Origins of the charts, mm.
    axes : array, shape (B, 3, 3)
        Columns e_u, e_v, n.

    Returns
    -------
    array, shape (3, B, n)
        mm.
    """
    place = np.empty_like(position)
    for b in range(position.shape[1]):
        for k in range(3):
            a, c, d = axes[b, 0, k], axes[b, 1, k], axes[b, 2, k]
            for i in range(position.shape[2]):
                place[k, b, i] = (
                    a * (position[0, b, i] - start[b, 0])
                    + c * (position[1, b, i] - start[b, 1])
                    + d * (position[2, b, i] - start[b, 2])
                )
    return place


@kernel
def ways(dt: Floats, position: Floats, length: Floats, speed: Floats) -> None:
    """Fill in lengths and largest speeds of strokes that share their times.

    Parameters
    ----------
    dt : array, shape (n - 1,)
        From sample to sample, above 0, s.
    position : array, shape (3, B, n)
        mm.
    length, speed : array, shape (B,)
        Filled in: mm and mm/s, the speeds those of whole steps.
    """
    for b in range(position.shape[1]):
        total, fastest = 0.0, 0.0
        for i in range(len(dt)):
            x = position[0, b, i + 1] - position[0, b, i]
            y = position[1, b, i + 1] - position[1, b, i]
            z = position[2, b, i + 1] - position[2, b, i]
            step = math.sqrt(x * x + y * y + z * z)
            total += step
            fastest = max(fastest, step / dt[i])
        length[b], speed[b] = total, fastest


@kernel
def _walked(v: Floats, b: int, least: float, stroke: Integers, sample: Integers, held: int) -> int:
    """Turning points of one signal, see `wave_height._turning_points`; how many there are then."""
    low, high, way = 0, 0, 0
    for i in range(v.shape[1]):
        here = v[b, i]
        if way >= 0 and here > v[b, high]:
            high = i
        if way <= 0 and here < v[b, low]:
            low = i
        if way >= 0 and v[b, high] - here >= least:
            if way != 0:
                if held < len(stroke):
                    stroke[held], sample[held] = b, high
                held += 1
            low, way = i, -1
        elif way <= 0 and here - v[b, low] >= least:
            if way != 0:
                if held < len(stroke):
                    stroke[held], sample[held] = b, low
                held += 1
            high, way = i, 1
    return held


@kernel
def turning_points(
    v: Floats, least: Floats, looked: Booleans, stroke: Integers, sample: Integers
) -> int:
    """Find where signals (B, n) turn back by `least` (B,) or more; return how many places.

    As many of them as there is room for are filled in; see `wave_height._turning_points`.
    """
    held = 0
    for b in range(len(v)):
        if looked[b]:
            held = _walked(v, b, least[b], stroke, sample, held)
    return held


@kernel
def swings(v: Floats) -> Floats:
    """Range of each signal (B, n), shape (B,)."""
    found = np.empty(len(v))
    for b in range(len(v)):
        low, high = v[b, 0], v[b, 0]
        for i in range(v.shape[1]):
            low, high = min(low, v[b, i]), max(high, v[b, i])
        found[b] = high - low
    return found
