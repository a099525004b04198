"""The low-pass against scipy's filter and its frequency response, derivatives in closed form."""

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt, sosfreqz

from dmpcli.sine_series import SineSeries, zero_phase


@pytest.mark.parametrize("order", [2, 6])
@pytest.mark.parametrize("cutoff", [0.02, 0.1, 0.3])
def test_it_is_scipys_filter_with_the_longest_padding(order, cutoff):
    t = np.linspace(0.0, 1.0, 1501)
    x = np.stack([40 * t + np.sin(9 * t), 30 * np.sin(60 * t) + np.cos(900 * t) * t])
    sections = butter(order, cutoff, fs=1.0, output="sos")
    right = sosfiltfilt(sections, x, axis=-1, padlen=1500)
    np.testing.assert_allclose(
        zero_phase(x, cutoff, order)[:, 100:-100], right[:, 100:-100], atol=1e-5
    )
    np.testing.assert_allclose(zero_phase(x, cutoff, order), right, atol=0.05)


@pytest.mark.parametrize("waves", [3, 40, 200, 600])
def test_a_wave_falls_by_the_filters_gain(waves):
    n = np.arange(2001)
    x = np.sin(np.pi * waves * n / 2000)
    sections = butter(6, 0.1, fs=1.0, output="sos")
    gain = abs(sosfreqz(sections, [waves / 4000], fs=1.0)[1][0]) ** 2
    np.testing.assert_allclose(zero_phase(x, 0.1, 6), gain * x, atol=1e-10)


def test_lines_and_ends_stay_and_the_order_of_axes_does_not_matter():
    x = np.random.default_rng(0).normal(size=(3, 4, 301)).cumsum(axis=-1)
    y = zero_phase(x, 0.05, 6)
    np.testing.assert_array_equal(y[..., [0, -1]], x[..., [0, -1]])
    np.testing.assert_allclose(y[1, 2], zero_phase(x[1, 2], 0.05, 6), atol=1e-12)
    line = np.linspace(-3.0, 8.0, 77)
    np.testing.assert_allclose(zero_phase(line, 0.01, 6), line, atol=1e-12)
    np.testing.assert_array_equal(zero_phase(np.array([1.0, 5.0]), 0.1, 6), [1.0, 5.0])


@pytest.mark.parametrize("samples", [300, 501, 1200])
def test_values_and_derivatives_are_those_of_the_sines(samples):
    s, at = np.linspace(0.0, 1.0, 501), np.linspace(0.0, 1.0, samples)
    w = np.pi * np.array([[3.0], [40.0]])
    series = SineSeries.of(2.0 - 5.0 * s + np.sin(w * s))
    np.testing.assert_allclose(series.at(samples), 2.0 - 5.0 * at + np.sin(w * at), atol=1e-12)
    np.testing.assert_allclose(series.at(samples, 1), -5.0 + w * np.cos(w * at), atol=1e-9)
    np.testing.assert_allclose(series.at(samples, 2), -w * w * np.sin(w * at), atol=1e-7)
