"""Where a hand rested in the middle of a stroke, and the stroke without such a rest."""

from collections.abc import Sequence

import numpy as np

from dmpcli.arrays import Floats, Integers

# At rest: slower than this part of the stroke's mean speed ...
REST_SPEED = 0.05
# ... for this part of the stroke's duration, and as many seconds.
SHORTEST_SHARE = 0.03
SHORTEST = 0.2
# The radius of a rest allows for this many deviations of the noise; never for a quarter of the mean
# speed and more, which is motion.
_NOISE = 4.0
_MOTION = 0.25
# What is left out is the part of a rest within this share of the radius, or the noise: no motion.
_CLOSE = 0.1
# A tool that turns by more than this is not at rest, rad.
_TURN = np.radians(1.0)
# The gap between both sides of a rest is spread over this part of the samples on each.
_BLEND = 0.02


def rests(t: Floats, x: Floats, noise: float) -> list[tuple[int, int]]:
    """Find where a stroke stands still between its ends.

    The stroke rests where it stays within a small radius: as far as `REST_SPEED` would bring it in
    the shortest rest, and the noise.

    Parameters
    ----------
    t : array, shape (M,)
        Even, s.
    x : array, shape (M, D)
        Smoothed positions, mm.
    noise : float
        Standard deviation of what smoothing left, mm.

    Returns
    -------
    list of tuple of int
        First and last sample of each rest, in order; never the stroke's own first or last.
    """
    duration = float(t[-1] - t[0])
    interval = duration / (len(t) - 1)
    width = int(np.ceil(max(SHORTEST, SHORTEST_SHARE * duration) / interval))
    if width < 2 or width > len(t) - 3:
        return []
    advance = (
        float(np.sum(np.linalg.norm(np.diff(x, axis=0), axis=1))) * width * interval / duration
    )
    radius = min(REST_SPEED * advance + _NOISE * noise, _MOTION * advance)
    still = np.linalg.norm(_reach(x, width), axis=1) <= radius
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(int)))
    found: list[tuple[int, int]] = []
    for first, last in zip(edges[::2].tolist(), (edges[1::2] + width - 1).tolist(), strict=True):
        if found and first <= found[-1][1] + 1:
            found[-1] = (found[-1][0], last)
        else:
            found.append((first, last))
    close = max(_NOISE * noise, _CLOSE * radius)
    inner = [_drawn_in(x, a, b, close) for a, b in found if a > 0 and b < len(t) - 1]
    return [(a, b) for a, b in inner if b - a >= width]


def _drawn_in(x: Floats, first: int, last: int, radius: float) -> tuple[int, int]:
    """A rest without the slow motion before and after it."""
    part = x[first : last + 1]
    near = np.flatnonzero(np.linalg.norm(part - np.median(part, axis=0), axis=1) <= radius)
    return (first + int(near[0]), first + int(near[-1])) if len(near) else (first, last)


def turning(angles: Floats, rest: tuple[int, int]) -> bool:
    """Whether the tool turns while its tip rests.

    Parameters
    ----------
    angles : array, shape (M, A)
        Continuous, rad.
    rest : tuple of int
        First and last sample.

    Returns
    -------
    bool
    """
    return bool(np.any(np.ptp(angles[rest[0] : rest[1] + 1], axis=0) > _TURN))


def _reach(x: Floats, width: int) -> Floats:
    """Extent of each coordinate over samples k to k + width, shape (M - width, D)."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    size, origin = width + 1, -((width + 1) // 2)
    highest = maximum_filter1d(x, size, axis=0, origin=origin)
    lowest = minimum_filter1d(x, size, axis=0, origin=origin)
    return np.asarray((highest - lowest)[: len(x) - width])


def without(x: Floats, cuts: Sequence[tuple[int, int]]) -> tuple[Floats, Integers]:
    """Join a stroke over its rests.

    What the noise moved it by while it rested is spread smoothly over the samples beside.

    Parameters
    ----------
    x : array, shape (M, D)
    cuts : sequence of tuple of int
        First and last sample of each rest, in order, apart from each other.

    Returns
    -------
    joined : array, shape (M', D)
    kept : array, shape (M',)
        The sample of `x` that each stems from.
    """
    kept = np.ones(len(x), dtype=bool)
    shifted = np.array(x)
    bounds = [0, *(k for cut in cuts for k in cut), len(x) - 1]
    for i, (a, b) in enumerate(cuts):
        kept[a + 1 : b + 1] = False
        gap = x[b] - x[a]
        wide = max(3, round(_BLEND * len(x)))
        before = min(wide, max(1, (a - bounds[2 * i]) // 2))
        after = min(wide, max(1, (bounds[2 * i + 3] - b) // 2))
        rise, fall = step(np.arange(before + 1) / before), step(np.arange(after, -1, -1) / after)
        shifted[a - before : a + 1] += 0.5 * rise[:, None] * gap
        shifted[b : b + after + 1] -= 0.5 * fall[:, None] * gap
    return shifted[kept], np.flatnonzero(kept)


def step(r: Floats) -> Floats:
    """Smooth step from 0 to 1, flat at both ends to the second derivative; r from 0 to 1."""
    return np.asarray(r**3 * (10.0 - 15.0 * r + 6.0 * r**2))
