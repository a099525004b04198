"""Smoothing frames along a path: of the orientation only, never of positions.

A mesh's normals ripple with its facets, and turn at once at a crease. A moving average over arc
length, three times over (nearly a Gaussian), takes the ripple off; at the ends it narrows, so that
the first and the last frame stay. What it takes off a curved surface's own turning, half the
variance times the second derivative, is put back by smoothing what it left once more (twicing:
J. W. Tukey, Exploratory Data Analysis, 1977, ch. 16); not over a crease: it would overshoot there.
"""

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.spatial.vectors import across, cross, length, unit

# Standard deviation of the smoothing along the path, mm: of the size of a scanned mesh's facets.
WIDTH = 1.5
# Of frames: twiced, it leaves as much of a scan's ripple as `WIDTH` does once.
FRAME_WIDTH = 2.25
_PASSES = 3
# What is put back is a smooth surface's well below this, a crease's well above it, rad.
_CREASE = np.radians(1.0)


def smoothed(
    axes: Floats, position: Floats, width: float = FRAME_WIDTH, compiled: bool = False
) -> Floats:
    """Frames smoothed along their paths.

    Parameters
    ----------
    axes : array, shape (B, T, 3, 3)
        Columns e_u, e_v, n.
    position : array, shape (B, T, 3)
        mm.
    width : float
        Standard deviation, mm; 0 leaves the frames alone. Over a crease that turns the frame by
        an angle A the steepest turn is about 0.4 A per `width` of path.
    compiled : bool
        Whether by kernels.

    Returns
    -------
    array, shape (B, T, 3, 3)
        Orthonormal; the first and the last of each path are those given.
    """
    if width <= 0.0 or axes.shape[1] < 3:
        return axes
    if compiled:
        from dmpcli.surfaces.kernels import smoothing

        return smoothing.smoothed(axes, position, width, _PASSES, _CREASE)
    values = np.concatenate([axes[..., 1], axes[..., 2]], axis=-1)
    values = smoothed_vectors(values, position, width)
    lost = values - smoothed_vectors(values, position, width)
    size = np.sum(lost**2, axis=-1, keepdims=True) / _CREASE**2
    values = values + lost / (1.0 + size**2)
    n = unit(values[..., 3:])
    e_v = across(values[..., :3], n)
    return np.stack([cross(e_v, n), e_v, n], axis=-1)


def smoothed_vectors(values: Floats, position: Floats, width: float = WIDTH) -> Floats:
    """Values smoothed along paths by moving averages, three times over; not twiced.

    Parameters
    ----------
    values : array, shape (B, T, C)
        In any unit, each of C smoothed for itself.
    position : array, shape (B, T, 3)
        mm; tells the arc length, and stays as it is.
    width : float
        Standard deviation, mm; near the ends it narrows, so that the first and the last stay.

    Returns
    -------
    array, shape (B, T, C)
    """
    steps = length(np.diff(position, axis=1))[..., 0]
    arc = np.concatenate([np.zeros((len(values), 1)), np.cumsum(steps, axis=1)], axis=1)
    # Three averages over ± half-width a have the variance a².
    for _ in range(_PASSES):
        values = _averaged(arc, values, width)
    return values


def _averaged(arc: Floats, values: Floats, half: float) -> Floats:
    """Means of values (B, T, C) over arc lengths (B, T) within ± half, less near the ends."""
    total = arc[:, -1:]
    reach = np.minimum(half, np.minimum(arc, total - arc))
    area = np.zeros_like(values)
    steps = np.diff(arc, axis=1)[..., None]
    np.cumsum(0.5 * steps * (values[:, 1:] + values[:, :-1]), axis=1, out=area[:, 1:])
    # All paths one after another on one axis, so that one search serves them.
    offset = np.concatenate([[0.0], np.cumsum(total[:-1, 0] + 1.0)])[:, None]
    knots = (arc + offset).reshape(-1)
    spread = _integral(knots, arc, values, area, arc + reach, offset)
    spread = spread - _integral(knots, arc, values, area, arc - reach, offset)
    wide = reach[..., None] > 1e-9
    return np.where(wide, spread / np.where(wide, 2.0 * reach[..., None], 1.0), values)


def _integral(
    knots: Floats, arc: Floats, values: Floats, area: Floats, at: Floats, offset: Floats
) -> Floats:
    """Integrals (B, T, C) of piecewise linear values from each path's start to `at` (B, T)."""
    B, T = arc.shape
    first = np.arange(B)[:, None] * T
    i = np.searchsorted(knots, (at + offset).reshape(-1), side="right").reshape(B, T) - 1
    i = np.clip(i, first, first + T - 2)
    start, size = arc.reshape(-1)[i], np.diff(arc, axis=1, append=arc[:, -1:]).reshape(-1)[i]
    into = (at - start)[..., None]
    flat, sums = values.reshape(B * T, -1), area.reshape(B * T, -1)
    size = size[..., None]
    slope = (flat[i + 1] - flat[i]) / np.where(size > 0.0, size, 1.0)
    return sums[i] + into * (flat[i] + 0.5 * into * slope)
