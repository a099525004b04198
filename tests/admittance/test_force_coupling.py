import numpy as np
import pytest
from scipy.integrate import solve_ivp

from dmpcli.admittance import model as admittance
from dmpcli.admittance.force_coupling import (
    CouplingLaw,
    Displacement,
    discretize,
    displace,
    fast_filter,
    follow,
)

PERIOD = 0.02


def law(mass=0.08, damping=2.0, stiffness=0.0, clamp=5.0, period=PERIOD):
    model = admittance.AdmittanceLaw(
        np.array([mass]), np.array([damping]), np.array([stiffness]), period
    )
    return CouplingLaw(model, setpoint=5.0, clamp=clamp, contact=0.5, patience=0.1, release=10.0)


LAW = law()


def forces(chosen, seconds, force, state=None, retreat=False):
    """Run the model on forces n·F(e, t); return the states."""
    state, states = state or Displacement(), []
    for i in range(round(seconds / PERIOD)):
        state = displace(chosen, state, force(state.e, i * PERIOD), retreat)
        states.append(state)
    return states


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
    coarse, fine = fast_filter(5.0, 0.02), discretize(125.0**2, 250.0, 5.0, 62.5, 0.001)
    a, b = np.zeros(2), np.zeros(2)
    for _ in range(10):
        a = follow(coarse, a, 1.5)
        for _ in range(20):
            b = follow(fine, b, 1.5)
    np.testing.assert_allclose(a, b, rtol=1e-9)


@pytest.mark.parametrize("tau", [0.2, 5.0])
def test_chosen_filter_is_critical_fast_and_of_unit_gain(tau):
    """Whatever the stroke's tau: a double pole at two servo periods, delta = e at rest."""
    filter_ = fast_filter(tau, PERIOD)
    poles = np.roots([tau**2, filter_.d * tau, filter_.k])
    np.testing.assert_allclose(poles, [-1 / (2 * PERIOD)] * 2, rtol=1e-6)
    z = np.zeros(2)
    for _ in range(50):
        z = follow(filter_, z, 0.8)
    assert z[0] == pytest.approx(0.8)


def test_alpha_e_of_the_file_has_unit_gain_at_rest():
    filter_, z = discretize(100.0, 20.0, 1.0, 100.0 / 20.0, PERIOD), np.zeros(2)
    for _ in range(500):
        z = follow(filter_, z, -0.8)
    assert z[0] == pytest.approx(-0.8)


def test_pressed_too_hard_the_tool_moves_away():
    assert displace(LAW, Displacement(), 9.0).e > 0


def test_pressed_too_lightly_the_tool_moves_in():
    assert displace(LAW, Displacement(), 2.0).e < 0


def test_model_is_integrated_in_the_order_of_the_paper():
    before = Displacement(0.4, -3.0, True, 0.0)
    acceleration = (7.0 - 5.0 - 2.0 * -3.0 - 0.5 * 0.4) / 0.08
    after = displace(law(stiffness=0.5), before, 7.0)
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
    state, dt = Displacement(), 1e-4
    chosen = law(stiffness=0.5, period=dt)
    for i in range(10_000):
        state = displace(chosen, state, 6.0 + np.sin(3 * i * dt))
    assert state.e == pytest.approx(oracle.y[0, -1], abs=2e-4)


@pytest.mark.parametrize("stiffness", [1.0, 5.0, 20.0])
@pytest.mark.parametrize("offset", [-1.0, 1.0])
def test_force_on_a_spring_settles_at_the_set_point(stiffness, offset):
    """A surface below or above the plan, reached three periods late and through the filter."""
    chosen, filter_ = law(clamp=10.0), fast_filter(5.0, PERIOD)
    z, state = np.zeros(2), Displacement()
    deltas = [0.0] * 3
    pushes = []
    for _ in range(round(30 / PERIOD)):
        pushes.append(max(stiffness * (offset - deltas[-3]), 0.0))
        state = displace(chosen, state, pushes[-1])
        z = follow(filter_, z, state.e)
        deltas.append(z[0])
    assert pushes[-1] == pytest.approx(5.0, abs=1e-3)
    assert max(pushes) < 25.0


def test_e_is_clamped_and_does_not_wind_up():
    out = forces(law(clamp=1.0), 10.0, lambda e, t: 60.0)
    assert max(s.e for s in out) == 1.0
    back = displace(law(clamp=1.0), out[-1], 1.0)
    assert back.e < 1.0


def test_before_the_first_contact_it_seeks_the_surface_up_to_the_clamp():
    out = forces(law(clamp=3.0), 5.0, lambda e, t: 0.0)
    assert np.all(np.diff([s.e for s in out]) <= 0)
    assert out[-1].e == -3.0
    assert not out[-1].touched


@pytest.mark.parametrize("e", [-2.0, 2.0])
def test_after_contact_is_lost_e_returns_to_zero_and_stays(e):
    out = forces(LAW, 1.5, lambda e, t: 0.0, Displacement(e, 0.0, True, 0.0))
    kept = round(LAW.patience / PERIOD)
    released = np.array([s.e for s in out[kept + 1 :]])
    assert np.all(np.diff(np.abs(released)) <= 0)
    assert np.max(np.abs(np.diff(released))) <= LAW.release * PERIOD + 1e-12
    assert out[-1].e == 0.0


def test_a_short_loss_of_contact_releases_nothing():
    state = Displacement(-1.0, 0.0, True, 0.0)
    out = forces(LAW, LAW.patience - PERIOD, lambda e, t: 0.0, state)
    assert np.all(np.diff([s.e for s in out]) < 0)


def test_a_retreat_releases_at_once_and_contact_takes_up_again():
    state = Displacement(-1.0, 0.0, True, 0.0)
    out = forces(LAW, 0.1, lambda e, t: 0.0, state, retreat=True)
    assert out[0].e > -1.0
    assert displace(LAW, out[-1], 3.0).e < out[-1].e
