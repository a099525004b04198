"""A tool's speed held along a path: as fast as it was asked to be, but for ends and corners.

The speed over arc length is the largest below three bounds: the one asked for; sqrt(a_n / κ) where
the path bends by κ; and what can be reached from, and braked to, every slower place at the
tangential acceleration a_t: v² (s) <= v² (s') + 2 a_t |s - s'|, which is the time-optimal profile
(J. E. Bobrow, S. Dubowsky, J. S. Gibson: Time-optimal control of robotic manipulators along
specified paths. Int. J. Robotics Research 4(3), 1985, 3-17) of a path whose two accelerations are
bounded apart. A moving average over time then takes the steps out of the acceleration; where the
speed is constant it stays so.
"""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp.arc_length import monotone
from dmpcli.dmp.options import ACCELERATION

HELD = 0.05
"""Part of a speed that it may be missed by, where it counts as held."""

LEAST_HELD = 0.5
"""Part of the path on which a speed that was asked for is expected to be held."""

# The acceleration rises and falls within this time, s: three servo periods of 50 Hz either way.
_BLENDED = 0.12
# Both accelerations at once come to the limit.
_SHARE = np.sqrt(0.5)
# Places along the path, and times, that the profile is worked out at.
_PLACES, _STEPS, _LEAST_TIMES, _MOST_TIMES = 4001, 60, 2001, 1_000_001
# The bend is that of the path over this length, mm: what is finer is ripple of facets.
_BEND = 1.0
_SLOWEST = 1e-9


@dataclass(frozen=True)
class Pace:
    """How fast a tool goes along its path.

    Attributes
    ----------
    speed : float
        mm/s.
    acceleration : float
        Of the tip at most, mm/s².
    """

    speed: float
    acceleration: float = ACCELERATION


def passed(stroke: Floats, position: Floats, pace: Pace, rate: float) -> Floats:
    """When each place of a path is to be passed, from rest to rest.

    Parameters
    ----------
    stroke : array, shape (N,)
        Stroke time of each position, increasing, s; any scale.
    position : array, shape (N, 3)
        Close together along the path, mm.
    pace : Pace
    rate : float
        Samples per second that are wanted, Hz.

    Returns
    -------
    array, shape (T,)
        Stroke times at 0, 1/rate, 2/rate, ... s: from stroke[0] to stroke[-1], where the last
        sample, up to one sample's time after the arrival, rests.
    """
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(position, axis=0), axis=1))])
    if arc[-1] <= _SLOWEST:
        return np.array([stroke[0], stroke[-1]])
    t, way = _law(arc, position, pace)
    steps = max(1, int(np.ceil(t[-1] * rate - 1e-9)))
    at = np.interp(np.arange(steps + 1) / rate, t, way)
    law = monotone(stroke - stroke[0], arc, np.gradient(arc, stroke))
    passes = np.maximum.accumulate(stroke[0] + law.time(at))
    passes[0], passes[-1] = stroke[0], stroke[-1]
    return np.asarray(np.minimum(passes, stroke[-1]))


def held(position: Floats, rate: float, speed: float) -> tuple[float, float]:
    """How well a speed is held by samples at so many Hz.

    Parameters
    ----------
    position : array, shape (T, 3)
        mm.
    rate : float
        Hz.
    speed : float
        That was asked for, mm/s.

    Returns
    -------
    share : float
        Part of the path that is passed at the speed, within `HELD`.
    fastest : float
        mm/s.
    """
    steps = np.linalg.norm(np.diff(position, axis=0), axis=1)
    fast = steps * rate >= (1.0 - HELD) * speed
    return float(steps[fast].sum() / max(steps.sum(), _SLOWEST)), float(steps.max(initial=0) * rate)


def _law(arc: Floats, position: Floats, pace: Pace) -> tuple[Floats, Floats]:
    """Times and arc lengths of the motion from rest to rest, finely spaced."""
    limit = _SHARE * pace.acceleration
    s = np.linspace(0.0, arc[-1], _PLACES)
    bend = _bend(arc, position, s)
    cap = np.minimum(pace.speed, np.sqrt(limit / np.maximum(bend, limit / pace.speed**2)))
    if cap.min() < pace.speed:
        # The average over time must not be faster than a corner allows: what surrounds it within
        # the time of the average is as slow.
        t, way, half = _in_time(*_timed(s, cap, limit))
        around = np.interp(way, s, cap)
        windows = np.lib.stride_tricks.sliding_window_view
        slowest = windows(np.pad(around, half, mode="edge"), 2 * half + 1).min(axis=1)
        cap = np.minimum(cap, np.interp(s, way, slowest))
    t, way, half = _in_time(*_timed(s, cap, limit))
    # A triangle: the speed is averaged twice over half of `_BLENDED`.
    kernel = np.convolve(np.ones(half), np.ones(half)) / half**2
    held = np.pad(way, 2 * half - 2, mode="edge")
    way = np.convolve(held, kernel, mode="valid")
    return (t[1] - t[0]) * np.arange(len(way)), np.clip(way, 0.0, arc[-1])


def _timed(s: Floats, cap: Floats, limit: float) -> tuple[Floats, Floats]:
    """Times at places (N,) of the fastest motion below `cap`, from rest to rest; with the places.

    In v² the bounds of the acceleration are straight lines, so that running minima find it.
    """
    squares = cap**2
    squares[[0, -1]] = 0.0
    slope = 2.0 * limit * s
    squares = np.minimum.accumulate(squares - slope) + slope
    squares = np.minimum.accumulate((squares + slope)[::-1])[::-1] - slope
    v = np.sqrt(np.maximum(squares, 0.0))
    steps = 2.0 * np.diff(s) / np.maximum(v[1:] + v[:-1], _SLOWEST)
    return np.concatenate([[0.0], np.cumsum(steps)]), s


def _in_time(t: Floats, s: Floats) -> tuple[Floats, Floats, int]:
    """Even times, the places then, and how many steps are half of `_BLENDED`."""
    wanted = t[-1] / _BLENDED * _STEPS
    count = int(np.clip(wanted, _LEAST_TIMES, _MOST_TIMES))
    even = np.linspace(0.0, t[-1], count)
    return even, np.interp(even, t, s), max(1, round(0.5 * _BLENDED / even[1]))


def _bend(arc: Floats, position: Floats, s: Floats) -> Floats:
    """Curvature of a path at arc lengths s, 1/mm: by the circle through three places."""
    reach = np.minimum(_BEND, 0.25 * arc[-1])
    at = np.clip(s, reach, arc[-1] - reach)

    def place(where: Floats) -> Floats:
        return np.stack([np.interp(where, arc, position[:, i]) for i in range(3)], axis=-1)

    before, here, after = place(at - reach), place(at), place(at + reach)
    change = (after - here) - (here - before)
    return np.asarray(np.linalg.norm(change, axis=1) / reach**2)
