"""The exact solution against scipy's integrators of the same equations."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from dmpcli.dmp import transformation_system
from dmpcli.dmp.learning import fit
from dmpcli.dmp.options import FitOptions
from dmpcli.dmp.transformation_system import TransformationGains
from tests.dmp.strokes import paper_stroke


@pytest.mark.parametrize("k", [40.0, 100.0, 260.0], ids=["over-damped", "critical", "under-damped"])
def test_transition_is_the_matrix_exponential(k):
    spring = TransformationGains(np.array([k]), np.array([20.0]), 4.0)
    A = np.array([[0.0, 1.0], [-k, -20.0]]) / 4.0
    for h in (0.0, 0.013, 0.7, 30.0):
        found = transformation_system.transition(spring, np.array(h))[0]
        np.testing.assert_allclose(found, expm(A * h), atol=1e-13)


def test_critical_damping_makes_both_roots_equal():
    np.testing.assert_allclose(transformation_system.critical(np.array([20.0])), [100.0])


@pytest.mark.parametrize("k", [60.0, 100.0, 200.0])
def test_homogeneous_solution_is_the_free_motion(k):
    spring = TransformationGains(np.array([k]), np.array([20.0]), 2.0)
    t = np.linspace(0.0, 4.0, 9)
    a, b, c = transformation_system.homogeneous(spring, t)
    x0, g, V0 = 3.0, -5.0, 40.0
    ivp = solve_ivp(
        lambda _, z: [z[1] / 2.0, (k * (g - z[0]) - 20.0 * z[1]) / 2.0],
        (0.0, 4.0),
        [x0, V0],
        method="DOP853",
        rtol=1e-12,
        atol=1e-12,
        t_eval=t,
    )
    np.testing.assert_allclose(x0 * a[:, 0] + g * b[:, 0] + V0 * c[:, 0], ivp.y[0], atol=1e-10)
    np.testing.assert_allclose(a + b, 1.0, atol=1e-15)


def test_forced_response_to_a_constant_is_known_in_closed_form():
    spring = TransformationGains(np.array([100.0]), np.array([20.0]), 5.0)
    t = np.linspace(0.0, 10.0, 101)
    found = transformation_system.forced(spring, lambda at: np.full((*at.shape, 1), 300.0), t, 0.5)
    decay = np.exp(-10.0 * t / 5.0)
    expected = 3.0 * (1.0 - decay * (1.0 + 10.0 * t / 5.0))
    np.testing.assert_allclose(found[:, 0], expected, atol=1e-12)


@pytest.fixture(scope="module", params=["default", "paper"])
def skill(request):
    choices = (
        FitOptions() if request.param == "default" else FitOptions(alpha_1=1.7, widths="power")
    )
    return fit([paper_stroke(turning=True)], choices).skill


@pytest.mark.sweep(kept=1)
@pytest.mark.slow
def test_roll_out_equals_solve_ivp_of_the_same_equations(skill):
    t = np.linspace(0.0, skill.duration, 501)
    r = skill.response(t)
    found = (
        skill.start * r.a
        + skill.goal * r.b
        + skill.initial_velocity * r.c
        + skill.alpha_f * r.forced
    )
    k, d, tau = skill.spring.k, skill.spring.d, skill.spring.tau

    def motion(at, z):
        x, V = z[:6], z[6:]
        f = skill.forcing(np.array(at))
        return np.concatenate([V, k * (skill.goal - x) - d * V + skill.alpha_f * f]) / tau

    ivp = solve_ivp(
        motion,
        (0.0, skill.duration),
        np.concatenate([skill.start, skill.initial_velocity]),
        method="DOP853",
        rtol=1e-10,
        atol=1e-10,
        max_step=0.02,
        t_eval=t,
    )
    assert np.abs(found - ivp.y[:6].T).max() <= 1e-9


def test_roll_out_does_not_depend_on_the_output_grid(skill):
    dense = skill.response(np.linspace(0.0, 10.0, 1001)).forced
    np.testing.assert_allclose(
        skill.response(np.linspace(0.0, 10.0, 11)).forced, dense[::100], atol=1e-10
    )
    uneven = 10.0 * np.linspace(0.0, 1.0, 1001) ** 1.7
    on_even = skill.response(uneven).forced
    last = skill.response(np.array([0.0, uneven[500]])).forced[-1]
    np.testing.assert_allclose(on_even[500], last, atol=1e-10)


def test_roll_out_does_not_depend_on_step_and_quadrature(skill, monkeypatch):
    t = np.linspace(0.0, 10.0, 501)
    step = skill.duration / (len(skill.basis) - 1) / 3.0
    usual = transformation_system.forced(skill.spring, skill.forcing, t, step)
    fine = transformation_system.forced(skill.spring, skill.forcing, t, step / 5.0)
    assert np.abs(usual - fine).max() <= 1e-10
    monkeypatch.setattr(transformation_system, "NODES", 10)
    more = transformation_system.forced(skill.spring, skill.forcing, t, step)
    assert np.abs(usual - more).max() <= 1e-10


def test_a_single_sample_is_the_start():
    spring = TransformationGains(np.full(2, 100.0), np.full(2, 20.0), 5.0)
    found = transformation_system.forced(
        spring, lambda at: np.ones((*at.shape, 2)), np.zeros(1), 0.1
    )
    np.testing.assert_array_equal(found, np.zeros((1, 2)))
