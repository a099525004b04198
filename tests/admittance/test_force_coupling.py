import numpy as np
import pytest
from scipy.integrate import solve_ivp

from dmpcli.admittance.force_coupling import discretize, fast_filter, follow
from dmpcli.admittance.force_law import ForceGains, LawState, advance

PERIOD = 0.02


@pytest.mark.parametrize(
    ("k", "d"), [(100.0, 20.0), (30.0, 20.0), (400.0, 20.0)], ids=["critical", "over", "under"]
)
def test_filter_is_the_solution_of_its_equations(k, d):
    tau, alpha_e, rng = 5.0, 0.7, np.random.default_rng(1)
    filter_, z = discretize(k, d, tau, alpha_e, 0.05), np.array([0.3, -0.2])
    for e in rng.normal(size=20):
        oracle = solve_ivp(
            lambda _, y, e=e: [(y[1] + alpha_e * e) / tau, (-k * y[0] - d * y[1]) / tau],
            (0.0, 0.05),
            z,
            rtol=1e-11,
            atol=1e-13,
        )
        z = follow(filter_, z, e)
        np.testing.assert_allclose(z, oracle.y[:, -1], atol=1e-9)


def test_filter_is_exact_at_any_period():
    coarse, fine = fast_filter(5.0, 0.02), discretize(500.0**2, 1000.0, 5.0, 250.0, 0.001)
    a, b = np.zeros(2), np.zeros(2)
    for _ in range(10):
        a = follow(coarse, a, 1.5)
        for _ in range(20):
            b = follow(fine, b, 1.5)
    np.testing.assert_allclose(a, b, rtol=1e-9)


@pytest.mark.parametrize("tau", [0.2, 5.0])
def test_chosen_filter_is_critical_fast_and_of_unit_gain(tau):
    """Whatever the stroke's tau: a double pole at half a servo period, delta = e at rest."""
    filter_ = fast_filter(tau, PERIOD)
    poles = np.roots([tau**2, filter_.d * tau, filter_.k])
    np.testing.assert_allclose(poles, [-2 / PERIOD] * 2, rtol=1e-6)
    z = np.zeros(2)
    for _ in range(50):
        z = follow(filter_, z, 0.8)
    assert z[0] == pytest.approx(0.8)


def test_alpha_e_of_the_file_has_unit_gain_at_rest():
    filter_, z = discretize(100.0, 20.0, 1.0, 100.0 / 20.0, PERIOD), np.zeros(2)
    for _ in range(500):
        z = follow(filter_, z, -0.8)
    assert z[0] == pytest.approx(-0.8)


def step(force, state=None, spring=0.0, period=PERIOD):
    return advance(ForceGains(0.08, 2.0, spring, np.inf, period), state or LawState(), force, 1e9)


def test_pressed_too_hard_the_tool_moves_away_and_too_lightly_in():
    assert step(4.0).e > 0.0 > step(-3.0).e


def test_model_is_integrated_in_the_order_of_the_paper():
    before = LawState(0.4, -3.0)
    acceleration = (7.0 - 5.0 - 2.0 * -3.0 - 0.5 * 0.4) / 0.08
    after = step(2.0, before, spring=0.5)
    assert after.speed == pytest.approx(-3.0 + PERIOD * acceleration)
    assert after.e == pytest.approx(0.4 + PERIOD * after.speed)


def test_model_follows_its_differential_equation():
    oracle = solve_ivp(
        lambda t, y: [y[1], (6.0 + np.sin(3 * t) - 5.0 - 2.0 * y[1] - 0.5 * y[0]) / 0.08],
        (0.0, 1.0),
        [0.0, 0.0],
        rtol=1e-10,
        atol=1e-12,
    )
    state, dt = LawState(), 1e-4
    for i in range(10_000):
        state = step(1.0 + np.sin(3 * i * dt), state, spring=0.5, period=dt)
    assert state.e == pytest.approx(oracle.y[0, -1], abs=2e-4)
