"""Which derivatives vanish at an end of a smoothing spline."""

import numpy as np
import pytest
from scipy.interpolate import BSpline

from dmpcli.dmp import least_squares, spline_ends

U = np.linspace(0.0, 1.0, 401)
DESIGN = least_squares.uniform(401, 20)


@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.parametrize(
    ("powers", "conditions"),
    [((3,), 3), ((3, 4), 3), ((4,), 3), ((3, 5), 2), ((5,), 2)],
)
def test_at_rest_velocity_and_acceleration_vanish_and_the_fifth_where_it_may(
    powers, conditions, reverse
):
    """Polynomials of degree 5 are in the space: what vanishes there is known."""
    u = 1.0 - U if reverse else U
    x = 100.0 * sum(u**power for power in powers)[:, None] * [[1.0, -2.0, 0.5]]
    found = spline_ends.end(DESIGN, DESIGN.coefficients(x), 1e-12, reverse)
    assert found.rests
    assert found.conditions == conditions
    np.testing.assert_allclose(found.change, 0.0, atol=1e-6)


def stationary(count, waves=3.0, seed=0):
    """Samples (n, 2) of many cosines about so many waves in 1, and their coefficients on 60 pieces.

    Of frequencies as near each other as a hand's: no few numbers tell all of it.
    """
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 1.0, count)
    f = waves * rng.uniform(0.7, 1.3, 40)
    phase = rng.uniform(0.0, 2.0 * np.pi, (2, 40))
    x = [np.cos(2.0 * np.pi * np.outer(t, f) + p) @ rng.normal(size=40) for p in phase]
    return np.stack(x, axis=1)


@pytest.mark.parametrize("reverse", [False, True])
def test_an_end_in_motion_is_the_bayesian_estimate_from_all_of_the_stroke(reverse):
    """Against the dense normal equations on knots that are not repeated, by scipy's basis."""
    rng = np.random.default_rng(3)
    x = stationary(1201, 9.0) + 0.1 * rng.normal(size=(1201, 2))
    design = least_squares.uniform(1201, 60)
    found = spline_ends.end(design, design.coefficients(x), 2 * 0.1**2, reverse)
    assert not found.rests
    here = x[::-1] if reverse else x
    u, knots = np.linspace(0.0, 60.0, 1201), np.arange(-5.0, 66.0)
    A = BSpline.design_matrix(u, knots, 5).toarray()
    free = np.linalg.lstsq(A, here, rcond=None)[0]
    windows = [np.diff(free[i : i + 10], axis=0) for i in range(6, 65 - 6 - 10 + 1)]
    mean = np.mean(windows, axis=0)
    S = np.mean([np.mean([np.outer(e, e) for e in (w - mean).T], axis=0) for w in windows], axis=0)
    D = np.diff(np.eye(65), axis=0)[:9]
    precision = np.linalg.inv(S)
    left = A.T @ A / 0.1**2 + D.T @ precision @ D
    best = np.linalg.solve(left, A.T @ here / 0.1**2 + D.T @ precision @ mean)
    changed = design.values(design.coefficients(x) - found.change)
    changed = changed[::-1] if reverse else changed
    np.testing.assert_allclose(changed, A @ best, atol=1e-6)


@pytest.mark.parametrize("reverse", [False, True])
def test_an_end_of_few_coefficients_is_the_bayesian_estimate_by_what_is_inside(reverse):
    rng = np.random.default_rng(3)
    u = np.linspace(0.0, 4.0, 201)
    x = np.column_stack([np.sin(1.5 * u), np.cos(2.0 * u) + u]) + 0.1 * rng.normal(size=(201, 2))
    design = least_squares.uniform(201, 4)
    c = design.coefficients(x)
    found = spline_ends.end(design, c, 2 * 0.1**2, reverse)
    assert not found.rests
    knots = np.pad(np.arange(5.0), 5, mode="edge")
    A = BSpline.design_matrix(u, knots, 5).toarray()
    path, inside = BSpline(knots, c, 5), np.linspace(0.8, 3.2, 25)
    there = np.stack([path(inside, 2), path(inside, 3)], axis=-1).reshape(-1, 2)
    S = 4.0 * there.T @ there / len(there)
    each = BSpline(knots, np.eye(9), 5)
    D = np.stack([each(4.0 if reverse else 0.0, order) for order in (2, 3)])
    left = A.T @ A / 0.1**2 + D.T @ np.linalg.solve(S, D)
    np.testing.assert_allclose(c - found.change, np.linalg.solve(left, A.T @ x / 0.1**2), atol=1e-9)
    before, after = (np.sum((x - A @ k) ** 2) for k in (c, c - found.change))
    assert found.cost == pytest.approx(after - before, rel=1e-6)
    assert 0.0 < found.conditions < 2.0


def test_an_end_unlike_the_rest_of_the_stroke_is_left_as_its_samples_have_it():
    x = stationary(1201, 9.0)
    t = np.linspace(0.0, 1.0, 1201)
    x[:, 0] += 30.0 * np.maximum(0.0, t - 0.95) * np.sin(2.0 * np.pi * 18.0 * t)
    x += 0.01 * np.random.default_rng(4).normal(size=(1201, 2))
    design = least_squares.uniform(1201, 60)
    c = design.coefficients(x)
    assert spline_ends._likely(design, c, 2 * 0.01**2, True) is None
    assert spline_ends._likely(design, c, 2 * 0.01**2, False) is not None
