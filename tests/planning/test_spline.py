import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from dmpcli.planning.spline import WINDOW, between, spline, window


@pytest.mark.parametrize("n", [2, 3, 4, 200])
def test_is_the_clamped_cubic_spline(n):
    rng = np.random.default_rng(n)
    t = np.cumsum(rng.uniform(0.5, 2.0, n))
    y = rng.normal(size=(n, 7))
    at = np.linspace(t[0], t[-1], 500)
    oracle = CubicSpline(t, y, bc_type="clamped")
    np.testing.assert_allclose(spline(t, y)(at), oracle(at), rtol=0, atol=1e-11)


def test_samples_are_met_to_the_last_bit():
    rng = np.random.default_rng(0)
    t, y = np.arange(50) * 0.02, rng.normal(size=(50, 3))
    assert np.array_equal(spline(t, y)(t), y)


def test_ends_hold_outside():
    curve = spline(np.array([0.0, 1.0, 2.0]), np.array([[0.0], [3.0], [1.0]]))
    assert curve(np.array([-5.0, 9.0])).tolist() == [[0.0], [1.0]]


def test_one_sample_stands_still():
    assert spline(np.array([0.0]), np.array([[4.0]]))(np.array(3.0)).tolist() == [4.0]


@pytest.mark.parametrize("n", [2, 3, 5, 30, 200])
def test_between_even_samples_it_is_the_same_from_a_window(n):
    y = np.random.default_rng(n).normal(size=(n, 7))
    oracle = CubicSpline(np.arange(n), y, bc_type="clamped")
    for index in np.linspace(0.0, n - 1.0, 41):
        near, share = window(index, n)
        np.testing.assert_allclose(between(y[near], share), oracle(index), rtol=0, atol=1e-11)


def test_a_window_is_as_wide_in_a_long_record_as_in_a_short_one():
    near, share = window(100_000.25, 200_001)
    assert (near.min(), near.max()) == (100_000 - WINDOW, 100_001 + WINDOW)
    assert share == pytest.approx(0.25)
