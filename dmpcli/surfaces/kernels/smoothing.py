"""`frame_smoothing`, compiled: moving averages of frames over arc length, path by path."""

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.compiled import kernel
from dmpcli.surfaces.kernels.vectors import across, cross, length, sub, unit


@kernel
def _averaged(arc: Floats, values: Floats, area: Floats, half: float, out: Floats) -> None:
    """Means of values (T, 6) over arc lengths (T,) within ± half, less near the ends."""
    samples = len(arc)
    total = arc[-1]
    area[0] = 0.0
    for t in range(samples - 1):
        step = 0.5 * (arc[t + 1] - arc[t])
        for k in range(6):
            area[t + 1, k] = area[t, k] + step * (values[t, k] + values[t + 1, k])
    first, last = 0, 0
    for t in range(samples):
        reach = min(half, arc[t], total - arc[t])
        if not reach > 1e-9:
            for k in range(6):
                out[t, k] = values[t, k]
            continue
        low, high = arc[t] - reach, arc[t] + reach
        while first < samples - 2 and arc[first + 1] <= low:
            first += 1
        while last < samples - 2 and arc[last + 1] <= high:
            last += 1
        a, b = low - arc[first], high - arc[last]
        p, q = arc[first + 1] - arc[first], arc[last + 1] - arc[last]
        p = 0.5 * a / p if p > 0.0 else 0.5 * a
        q = 0.5 * b / q if q > 0.0 else 0.5 * b
        for k in range(6):
            before, after = values[first, k], values[last, k]
            until = area[last, k] + b * (after + q * (values[last + 1, k] - after))
            since = area[first, k] + a * (before + p * (values[first + 1, k] - before))
            out[t, k] = (until - since) / (2.0 * reach)


@kernel
def smoothed(axes: Floats, position: Floats, width: float, passes: int, crease: float) -> Floats:
    """Frames (B, T, 3, 3) smoothed along paths (B, T, 3), mm, and twiced but over creases.

    Parameters
    ----------
    axes : array, shape (B, T, 3, 3)
        Columns e_u, e_v, n.
    position : array, shape (B, T, 3)
        mm.
    width : float
        Half-width of each moving average, mm; it narrows near the ends.
    passes : int
        Averages, one after the other.
    crease : float
        What is put back fades where it is larger than this, rad.

    Returns
    -------
    array, shape (B, T, 3, 3)
        Orthonormal.
    """
    out = np.empty_like(axes)
    samples = axes.shape[1]
    arc = np.empty(samples)
    values, other, area = np.empty((samples, 6)), np.empty((samples, 6)), np.empty((samples, 6))
    once = np.empty((samples, 6))
    for b in range(len(axes)):
        arc[0] = 0.0
        for t in range(samples):
            if t > 0:
                x, y = position[b, t], position[b, t - 1]
                arc[t] = arc[t - 1] + length(sub((x[0], x[1], x[2]), (y[0], y[1], y[2])))
            for k in range(3):
                values[t, k], values[t, 3 + k] = axes[b, t, k, 1], axes[b, t, k, 2]
        for _ in range(passes):
            _averaged(arc, values, area, width, other)
            values, other = other, values
        once[:] = values
        for _ in range(passes):
            _averaged(arc, values, area, width, other)
            values, other = other, values
        for t in range(samples):
            size = 0.0
            for k in range(6):
                size += (once[t, k] - values[t, k]) ** 2
            size /= crease**2
            share = 1.0 / (1.0 + size**2)
            for k in range(6):
                values[t, k] = once[t, k] + share * (once[t, k] - values[t, k])
            n = unit((values[t, 3], values[t, 4], values[t, 5]))
            e_v = across((values[t, 0], values[t, 1], values[t, 2]), n)
            e_u = cross(e_v, n)
            for k in range(3):
                out[b, t, k, 0] = e_u[0] if k == 0 else e_u[1] if k == 1 else e_u[2]
                out[b, t, k, 1] = e_v[0] if k == 0 else e_v[1] if k == 1 else e_v[2]
                out[b, t, k, 2] = n[0] if k == 0 else n[1] if k == 1 else n[2]
    return out
