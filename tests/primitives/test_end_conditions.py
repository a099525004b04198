"""End responses against scipy's integrator, and the least change of weights that meets them."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import minimize

from dmpcli.primitives import end_conditions
from dmpcli.primitives.dynamics import Spring
from dmpcli.primitives.phase import even_in_time, phase
from dmpcli.primitives.regression import BandedRegression

DURATION = 3.0


def axis(k, d, tau=1.4):
    return Spring(np.array([k]), np.array([d]), tau)


@pytest.mark.slow
@pytest.mark.parametrize(("k", "d"), [(100.0, 20.0), (30.0, 40.0), (200.0, 5.0)])
@pytest.mark.parametrize(("count", "alpha_1"), [(2, 1.0), (9, 1.7), (40, 0.5)])
def test_responses_are_the_integrated_end_states_of_each_function(k, d, count, alpha_1):
    spring = axis(k, d)
    basis = even_in_time(count, DURATION, spring.tau, alpha_1)
    C = end_conditions.end_responses(spring, basis, alpha_1, DURATION)
    assert C.shape == (2, count)
    for i in {0, count // 2, count - 1}:

        def motion(t, z, i=i):
            s = phase(np.array(t), spring.tau, alpha_1)
            f = basis.normalized(s)[i] * s
            return [z[1] / spring.tau, (-k * z[0] - d * z[1] + f) / spring.tau]

        done = solve_ivp(
            motion, (0, DURATION), [0, 0], "DOP853", rtol=1e-10, atol=1e-13, max_step=0.02
        )
        np.testing.assert_allclose(C[:, i], done.y[:, -1], atol=1e-9 * np.abs(C).max())


@pytest.mark.parametrize("method", ["lwr", "ridge"])
@pytest.mark.parametrize("count", [2, 5, 80, 400])
@pytest.mark.parametrize("alpha_1", [0.5, 1.0, 1.7])
def test_corrected_weights_end_as_required(method, count, alpha_1):
    spring = axis(100.0, 20.0)
    basis = even_in_time(count, DURATION, spring.tau, alpha_1)
    s = phase(np.linspace(0.0, DURATION, max(8 * count, 300)), spring.tau, alpha_1)
    C = end_conditions.end_responses(spring, basis, alpha_1, DURATION)
    moves = BandedRegression(basis, s).least_change(method, C)
    rng = np.random.default_rng(0)
    w, required = rng.normal(size=(6, count)), rng.normal(size=(6, 2)) * [0.01, 1.0]
    m = end_conditions.corrections(w, required, C, moves)
    np.testing.assert_allclose((w + m @ moves.T) @ C.T, required, atol=1e-9)
    none = end_conditions.corrections(w, w @ C.T, C, moves)
    np.testing.assert_allclose(none @ moves.T, 0.0, atol=1e-9)


@pytest.mark.parametrize("method", ["lwr", "ridge"])
def test_the_change_is_the_least_by_the_regressions_own_cost(method):
    spring, count = axis(100.0, 20.0), 12
    basis = even_in_time(count, DURATION, spring.tau, 1.0)
    s = phase(np.linspace(0.0, DURATION, 400), spring.tau, 1.0)
    if method == "lwr":
        H = np.diag(np.exp(basis.exponents(s)).T @ s**2)
    else:
        features = basis.normalized(s) * s[:, None]
        H = features.T @ features
    C = end_conditions.end_responses(spring, basis, 1.0, DURATION)
    moves = BandedRegression(basis, s).least_change(method, C)
    w, required = np.random.default_rng(1).normal(size=(1, count)), np.array([[0.02, -0.3]])
    found = (end_conditions.corrections(w, required, C, moves) @ moves.T)[0]
    rows = C / np.linalg.norm(C, axis=1, keepdims=True)
    asked = (required[0] - C @ w[0]) / np.linalg.norm(C, axis=1)
    least = minimize(
        lambda x: x @ H @ x,
        np.linalg.lstsq(rows, asked, rcond=None)[0],
        jac=lambda x: 2 * H @ x,
        method="SLSQP",
        constraints={"type": "eq", "fun": lambda x: rows @ x - asked, "jac": lambda _: rows},
        options={"maxiter": 500, "ftol": 1e-14},
    )
    assert found @ H @ found <= least.fun * (1 + 1e-6)
