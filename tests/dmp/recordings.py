"""Noise-free strokes in closed form, and what happens to recordings of them."""

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

from tests.minimum_jerk import minimum_jerk


def jerk(u):
    """Minimum-jerk time law on 0 … 1."""
    u = np.clip(u, 0.0, 1.0)
    return minimum_jerk(u)


def wave(s, length=300.0, height=50.0):
    """Points of a sine wave across a line along x, at shares s of its length."""
    return np.column_stack([length * s, 0.5 * height * np.sin(2 * np.pi * s), 0.0 * s])


def times(duration, rate=100.0):
    return np.arange(round(duration * rate) + 1) / rate


def six_seconds(rate=100.0):
    """The wave in 6 s: times, points."""
    t = times(6.0, rate)
    return t, wave(jerk(t / 6.0))


def letters(seconds=30.0, rate=100.0):
    """Cursive, a letter of 20 mm a second."""
    t = times(seconds, rate)
    a = 2 * np.pi * t
    y = 10 * (1 - np.cos(a)) + 3 * np.sin(0.5 * a)
    return t, np.column_stack([12 * t + 7 * np.sin(a), y, 0 * t])


def handwriting_and_lines(seed, glyphs=24, seconds=0.3, rate=100.0):
    """Glyphs of about 16 mm, a curve through random points, then lines with corners at 50 mm/s."""
    rng = np.random.default_rng(seed)
    knots = rng.normal(0.0, 8.0, (glyphs, 3)) * [1, 1, 0]
    knots[:, 0] += 4.0 * np.arange(glyphs)
    t = times(seconds * (glyphs - 1), rate)
    written = CubicSpline(seconds * np.arange(glyphs), knots)(t)
    ways = np.array([[40, 0, 0], [0, -50, 0], [60, 30, 0], [-20, 60, 0], [90, 0, 0.0]])
    V = written[-1] + np.r_[[[0.0, 0.0, 0.0]], np.cumsum(ways, axis=0)]
    way = np.r_[0, np.cumsum(np.linalg.norm(np.diff(V, axis=0), axis=1))]
    along = np.arange(50.0 / rate, way[-1], 50.0 / rate)
    lines = np.column_stack([np.interp(along, way, c) for c in V.T])
    points = np.concatenate([written, lines])
    return np.arange(len(points)) / rate, points


def corners():
    """A zigzag of 30 legs at 50 mm/s."""
    k = np.arange(31)
    V = np.column_stack([12.0 * k, 20.0 * (k % 2), 0.0 * k])
    way = np.r_[0, np.cumsum(np.linalg.norm(np.diff(V, axis=0), axis=1))]
    t = np.arange(0, way[-1] / 50, 0.01)
    return t, np.column_stack([np.interp(50 * t, way, c) for c in V.T])


def blended(seed, seconds, rate=100.0):
    """Legs at one speed that turn within so many seconds: times, points, largest acceleration."""
    rng = np.random.default_rng(seed)
    legs = int(rng.integers(3, 8))
    turn = rng.choice([-1.0, 1.0], legs) * rng.uniform(np.radians(20), np.radians(150), legs)
    heading = np.cumsum(turn)
    way = np.column_stack([np.cos(heading), np.sin(heading), rng.normal(0.0, 0.3, legs)])
    v = rng.uniform(20.0, 80.0) * way / np.linalg.norm(way, axis=1, keepdims=True)
    lasts = rng.uniform(0.6, 1.5, legs)
    t = times(lasts.sum() - 0.01, rate)
    points = v[0] * t[:, None]
    for end, change in zip(np.cumsum(lasts)[:-1], np.diff(v, axis=0), strict=True):
        # The integral of a velocity that changes linearly over that time.
        u = np.clip((t - end) / seconds + 0.5, 0.0, 1.0)
        points += (seconds * 0.5 * u**2 + np.maximum(t - end - 0.5 * seconds, 0.0))[
            :, None
        ] * change
    return t, points, np.linalg.norm(np.diff(v, axis=0), axis=1).max() / seconds


def pen_lift():
    """Two strokes on z = 0 with the pen lifted by 8 mm between."""
    t = times(9.0)
    p = t / 9.0
    go = jerk(p)
    lift = 8 * (jerk((p - 0.55) / 0.08) - jerk((p - 0.72) / 0.08))
    y = 18 * np.sin(3 * np.pi * np.minimum(go / 0.5, 1))
    y = y + 34 * jerk((p - 0.58) / 0.14) - 54 * jerk((p - 0.80) / 0.2)
    return t, np.column_stack([90 * go, y, lift])


def noisy(points, sigma, seed=0):
    return points + np.random.default_rng(seed).normal(0.0, sigma, points.shape)


def filtered(points, sigma, seed=0, cutoff=10.0, rate=100.0):
    """Noise that a low-pass has taken the upper band from."""
    noise = np.random.default_rng(seed).normal(0.0, sigma, points.shape)
    return points + sosfiltfilt(butter(4, cutoff, fs=rate, output="sos"), noise, axis=0)


def interpolated(law, sigma, kind, seed=0, slow=30.0, duration=6.0):
    """A stroke law(t) recorded with noise at 30 Hz, and interpolated to 100 Hz."""
    at = times(duration, slow)
    points = noisy(law(at), sigma, seed)
    t = times(duration)
    if kind == "linear":
        return t, np.column_stack([np.interp(t, at, c) for c in points.T])
    return t, CubicSpline(at, points)(t)


def with_approach(points, down, up, seconds=2.0):
    """A stroke at 100 Hz with straight motions along z before and after it, as soft as it."""
    q = jerk(np.arange(0.0, seconds, 0.01) / seconds)[:, None]
    parts = [points]
    if down:
        parts.insert(0, points[0] + (1 - q) * [0.0, 0.0, down])
    if up:
        parts.append(points[-1] + q * [0.0, 0.0, up])
    joined = np.concatenate(parts)
    return np.arange(len(joined)) / 100.0, joined
