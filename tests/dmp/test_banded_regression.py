"""Sparse products and regressions against the dense ones."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.dmp.canonical_system import even_in_time, phase
from dmpcli.dmp.regression import BandedRegression, lwr, ridge

RULES = ["spacing", "power"]


def setting(count, rule="spacing", alpha_1=1.0, samples=None, seed=0):
    basis = even_in_time(count, 5.0, 2.5, alpha_1, rule)
    t = np.linspace(0.0, 5.0, samples or max(8 * count, 640))
    forcing = np.cumsum(np.random.default_rng(seed).normal(size=(len(t), 3)), axis=0)
    return basis, phase(t, 2.5, alpha_1), forcing


@pytest.mark.slow
@given(
    count=st.integers(1, 120),
    rule=st.sampled_from(RULES),
    alpha_1=st.floats(0.2, 6.0),
    place=st.lists(st.floats(0.0, 1.0), min_size=1, max_size=20),
)
def test_windows_hold_all_of_each_row_that_counts(count, rule, alpha_1, place):
    basis, _, _ = setting(count, rule, alpha_1)
    s = phase(5.0 * np.array(place), 2.5, alpha_1)
    window = basis.window(s).normalized()
    dense = np.zeros((len(s), count))
    for i, first in enumerate(window.first):
        dense[i, first : first + window.psi.shape[1]] = window.psi[i]
    np.testing.assert_allclose(dense, basis.normalized(s), atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("count", [2, 20, 150])
def test_products_are_those_of_the_dense_matrix(rule, count):
    basis, s, forcing = setting(count, rule)
    window, dense = basis.window(s).normalized(), basis.normalized(s)
    weights = np.random.default_rng(3).normal(size=(4, count))
    np.testing.assert_allclose(window.mean(weights), dense @ weights.T, atol=1e-12)
    np.testing.assert_allclose(window.gathered(forcing), dense.T @ forcing, rtol=1e-10, atol=1e-9)
    np.testing.assert_allclose(basis.mean(s, weights), dense @ weights.T, atol=1e-12)
    scaled = window.scaled(s)
    normal = (dense * s[:, None]).T @ (dense * s[:, None])
    band, reach = scaled.normal(), scaled.psi.shape[1] - 1
    unpacked = np.zeros_like(normal)
    for j in range(count):
        for i in range(max(0, j - reach), min(count, j + reach + 1)):
            unpacked[i, j] = band[reach + i - j, j]
    np.testing.assert_allclose(unpacked, normal, atol=1e-12 * normal.max())


@pytest.mark.parametrize("count", [2, 20, 150, 400])
def test_one_pass_of_lwr_is_the_printed_formula(count):
    basis, s, forcing = setting(count)
    found = BandedRegression(basis, s).fit("lwr", forcing)
    np.testing.assert_allclose(found, lwr(basis, s, s, forcing), rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("count", [2, 20, 150])
def test_ridge_is_the_dense_one_in_what_it_gives_back(count):
    basis, s, forcing = setting(count)
    found = BandedRegression(basis, s).fit("ridge", forcing)
    dense = ridge(basis, s, s, forcing)
    features = basis.normalized(s) * s[:, None]
    size = np.abs(forcing).max()
    np.testing.assert_allclose(features @ found.T, features @ dense.T, atol=1e-5 * size)


def test_each_pass_gives_back_more_of_what_the_last_one_took():
    basis, s, _ = setting(60)
    forcing = np.sin(np.linspace(0.0, 60.0, len(s)))[:, None] * s[:, None]
    regression, features = BandedRegression(basis, s), basis.normalized(s) * s[:, None]
    left = [
        np.linalg.norm(forcing - features @ regression.fit("lwr", forcing, passes).T)
        for passes in (1, 2, 3)
    ]
    assert left[0] > 2.0 * left[1] > 2.0 * left[2]


def test_passes_add_up_to_the_regression_of_the_rest():
    basis, s, forcing = setting(50)
    regression, features = BandedRegression(basis, s), basis.normalized(s) * s[:, None]
    one = lwr(basis, s, s, forcing)
    two = one + lwr(basis, s, s, forcing - features @ one.T)
    np.testing.assert_allclose(regression.fit("lwr", forcing, 2), two, rtol=1e-8, atol=1e-7)


def test_memory_does_not_grow_with_the_product_of_samples_and_functions():
    basis, s, _ = setting(2000)
    assert basis.banded
    assert basis.window(s).psi.size < 30 * len(s)
