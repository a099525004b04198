"""Phase, basis and the two regressions."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from dmpcli.dmp import regression
from dmpcli.dmp.canonical_system import Basis, even_in_time, phase
from dmpcli.dmp.transformation_system import TransformationGains


def test_phase_solves_the_canonical_system():
    t = np.linspace(0, 6, 7)
    ivp = solve_ivp(lambda _, s: -1.3 * s / 2.5, (0, 6), [1.0], rtol=1e-11, atol=1e-13, t_eval=t)
    np.testing.assert_allclose(phase(t, 2.5, 1.3), ivp.y[0], rtol=1e-9)


def test_phase_at_the_end_does_not_depend_on_the_duration():
    ends = [phase(np.array(T), 0.5 * T, 1.0) for T in (0.3, 10.0, 400.0)]
    np.testing.assert_allclose(ends, np.exp(-2.0), rtol=1e-14)


@given(st.integers(1, 300), st.floats(0.1, 100.0), st.sampled_from(["spacing", "power"]))
def test_basis_functions_sum_to_one_everywhere(count, duration, rule):
    basis = even_in_time(count, duration, 0.5 * duration, 1.0, rule)
    s = phase(np.linspace(0, duration, 50), 0.5 * duration, 1.0)
    psi = basis.normalized(s)
    assert np.all(np.isfinite(psi))
    np.testing.assert_allclose(psi.sum(axis=1), 1.0, rtol=1e-12)


def test_widths_follow_the_two_rules():
    basis = even_in_time(80, 10.0, 5.0, 1.0, "spacing")
    spacing = basis.centres[0] - basis.centres[1]
    assert basis.widths[0] == pytest.approx(1 / (2 * (0.5 * spacing) ** 2))
    power = even_in_time(80, 10.0, 5.0, 1.7, "power")
    np.testing.assert_allclose(power.widths, 80**1.5 / (power.centres * 1.7))


def test_mean_is_the_normalized_weighted_sum():
    rng = np.random.default_rng(0)
    basis = even_in_time(12, 3.0, 1.5, 1.0)
    s, weights = rng.random((4, 5)), rng.normal(size=(2, 12))
    np.testing.assert_allclose(basis.mean(s, weights), basis.normalized(s) @ weights.T, rtol=1e-12)


def test_lwr_is_the_printed_formula():
    rng = np.random.default_rng(1)
    basis = Basis(np.array([0.9, 0.5, 0.2]), np.array([30.0, 20.0, 60.0]))
    s, f = np.sort(rng.random(40))[::-1], rng.normal(size=(40, 2))
    xi = 3.0 * s
    expected = np.empty((2, 3))
    for i in range(3):
        psi = np.exp(-basis.widths[i] * (s - basis.centres[i]) ** 2)
        for j in range(2):
            expected[j, i] = np.sum(psi * xi * f[:, j]) / np.sum(psi * xi**2)
    np.testing.assert_allclose(regression.lwr(basis, s, xi, f), expected, rtol=1e-12)


def test_lwr_gives_finite_weights_to_functions_between_sparse_samples():
    basis = even_in_time(1000, 1.0, 0.5, 1.0)
    s = phase(np.linspace(0, 1, 10), 0.5, 1.0)
    assert np.all(np.isfinite(regression.lwr(basis, s, s, np.ones((10, 6)))))


def test_ridge_recovers_the_weights_that_made_the_forcing():
    rng = np.random.default_rng(2)
    basis = even_in_time(20, 4.0, 2.0, 1.0)
    s = phase(np.linspace(0, 4, 400), 2.0, 1.0)
    weights = rng.normal(size=(3, 20))
    f = basis.mean(s, weights) * s[:, None]
    np.testing.assert_allclose(regression.ridge(basis, s, s, f), weights, rtol=1e-6)


def test_both_regressions_are_linear_in_the_forcing():
    rng = np.random.default_rng(3)
    basis = even_in_time(15, 2.0, 1.0, 1.0)
    s = phase(np.linspace(0, 2, 100), 1.0, 1.0)
    f, g = rng.normal(size=(2, 100, 1))
    for method in regression.METHODS.values():
        both = method(basis, s, s, 2 * f - g)
        np.testing.assert_allclose(
            both, 2 * method(basis, s, s, f) - method(basis, s, s, g), atol=1e-8
        )


def test_target_forcing_vanishes_on_the_free_motion():
    spring = TransformationGains(np.array([100.0]), np.array([20.0]), 2.0)
    t = np.linspace(0, 3, 50)[:, None]
    lam = 10.0 / 2.0
    x = 4.0 + np.exp(-lam * t)
    f = regression.target_forcing(
        spring, np.array([4.0]), x, -lam * np.exp(-lam * t), lam**2 * np.exp(-lam * t)
    )
    np.testing.assert_allclose(f, 0.0, atol=1e-11)
