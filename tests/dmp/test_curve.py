"""A demonstration as a function of time, and its band-limited form against closed forms."""

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline
from scipy.signal import butter, sosfiltfilt

from dmpcli.dmp.curve import Curve

T = 7.3


def curve(samples=601, intervals=None):
    t = np.linspace(0.0, T, samples)
    x = np.stack([40 * t, 30 * np.sin(9 * t) + 2 * np.sin(80 * t), 3 * np.cos(35 * t)], axis=1)
    return Curve.through(x, T, intervals or samples - 1)


@pytest.mark.parametrize("intervals", [40, 80])
def test_it_is_limited_as_by_scipys_butterworth_there_and_back(intervals):
    whole = curve()
    count = 4 * whole.intervals + 1
    sections = butter(4, 0.5 * intervals / T, fs=(count - 1) / T, output="sos")
    x = sosfiltfilt(sections, whole.even(count), axis=0, padlen=count - 1)
    filtered = make_interp_spline(np.linspace(0.0, T, count), x, k=5)
    t = np.linspace(0.0, T, 8 * intervals + 1)
    inner = (t > 0.1 * T) & (t < 0.9 * T)
    for order, found in enumerate(whole.limited(intervals, len(t))):
        right = filtered(t, order)
        scale = np.abs(right).max()
        assert np.all(np.abs(found - right)[inner] <= 5e-3 * scale)
        assert np.all(np.abs(found - right) <= 1e-2 * scale)


@pytest.mark.parametrize("order", [3, 20, 80])
def test_a_wave_about_the_line_falls_by_the_filters_gain_and_keeps_its_ends(order):
    """sin(π n t / T) on a line: the gain is 1 / (1 + (n/N)⁸)."""
    t = np.linspace(0.0, T, 2001)
    line = np.outer(t, [3.0, -1.0]) + [5.0, 2.0]
    wave = np.outer(np.sin(np.pi * order * t / T), [1.0, 4.0])
    whole = Curve.through(line + wave, T, 2000)
    at = np.linspace(0.0, T, 641)
    x, velocity, acceleration = whole.limited(80, 641)
    gain, w = 1.0 / (1.0 + (order / 80) ** 8), np.pi * order / T
    amplitude = gain * np.array([1.0, 4.0])
    s, c = np.sin(w * at)[:, None], np.cos(w * at)[:, None]
    np.testing.assert_allclose(x, np.outer(at, [3.0, -1.0]) + [5.0, 2.0] + s * amplitude, atol=1e-6)
    np.testing.assert_allclose(velocity, [3.0, -1.0] + w * c * amplitude, atol=1e-4)
    np.testing.assert_allclose(acceleration, -w * w * s * amplitude, atol=1e-2)
    np.testing.assert_allclose(x[[0, -1]], whole(np.array([0.0, T])), atol=1e-9)


def test_a_curve_whose_band_is_no_wider_is_left_as_it_is():
    whole = curve(intervals=60)
    t = np.linspace(0.0, T, 301)
    for order, found in enumerate(whole.limited(60, 301)):
        np.testing.assert_array_equal(found, whole(t, order))
