"""The linear map from weights to the response, against scipy's integrator."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from dmpcli.dmp.canonical_system import phase
from dmpcli.dmp.forced_model import forced_model


@pytest.mark.sweep(kept=3)
@pytest.mark.slow
@pytest.mark.parametrize(("count", "tau", "alpha_1"), [(2, 0.5, 1.0), (80, 0.5, 1.0), (30, 2.0, 3)])
@pytest.mark.parametrize(
    ("widths", "k", "d"),
    [("spacing", 100.0, 20.0), ("power", 900.0, 10.0), ("spacing", 25.0, 40.0)],
)
def test_the_response_is_the_integrated_motion(count, tau, alpha_1, widths, k, d):
    model = forced_model(count, k, d, tau, alpha_1, widths)
    w = np.random.default_rng(count).normal(size=(2, count)) * 100.0

    def motion(t, z):
        s = phase(np.array(t), tau, alpha_1)
        f = model.basis.normalized(s) @ w.T * s
        return np.concatenate([z[2:], f - k * z[:2] - d * z[2:]]) / tau

    t = np.linspace(0.0, 1.0, model.samples)
    done = solve_ivp(
        motion, (0, 1), np.zeros(4), "DOP853", t[::40], rtol=1e-10, atol=1e-12, max_step=0.01
    )
    response = model.response(w)
    np.testing.assert_allclose(response[::40], done.y[:2].T, atol=1e-8 * np.abs(response).max())
    end = np.stack([done.y[:2, -1], done.y[2:, -1]], axis=1)
    np.testing.assert_allclose(w @ model.end_responses.T, end, atol=1e-8 * np.abs(end).max())


def test_a_model_is_worked_out_once_and_does_not_depend_on_what_was_before():
    given = (80, 100.0, 20.0, 0.5, 1.0, "spacing")
    model = forced_model(*given)
    assert forced_model(*given) is model
    w = np.random.default_rng(0).normal(size=(6, 80))
    before = model.response(w)
    for count in range(90, 96):
        forced_model(count, *given[1:])
    again = forced_model(*given)
    assert again is not model
    np.testing.assert_array_equal(again.response(w), before)
