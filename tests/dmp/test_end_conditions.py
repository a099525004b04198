"""End responses against scipy's integrator, and the changes of weights that meet them."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import lstsq, null_space

from dmpcli.dmp import end_conditions
from dmpcli.dmp.canonical_system import even_in_time, phase
from dmpcli.dmp.forced_model import forced_model
from dmpcli.dmp.transformation_system import TransformationGains

DURATION = 3.0


def axis(k, d, tau=1.4):
    return TransformationGains(np.array([k]), np.array([d]), tau)


@pytest.mark.sweep(kept=3)
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


@pytest.mark.parametrize("count", [2, 5, 80, 400])
@pytest.mark.parametrize("alpha_1", [0.5, 1.0, 1.7])
def test_corrected_weights_end_as_required(count, alpha_1):
    model = forced_model(count, 100.0, 20.0, 0.5, alpha_1, "spacing")
    C, (moves, _) = model.end_responses, model.end_moves
    rng = np.random.default_rng(0)
    w, required = rng.normal(size=(6, count)), rng.normal(size=(6, 2)) * [0.01, 1.0]
    m = end_conditions.corrections(w, required, C, moves)
    np.testing.assert_allclose((w + m @ moves.T) @ C.T, required, atol=1e-9)
    none = end_conditions.corrections(w, w @ C.T, C, moves)
    np.testing.assert_allclose(none @ moves.T, 0.0, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("count", [2, 12, 80])
def test_the_correction_moves_the_path_hardly_farther_than_any_weights_could(count):
    """Any weights: all of them, by scipy's minimizer of least squares under linear conditions."""
    model = forced_model(count, 100.0, 20.0, 0.5, 1.0, "spacing")
    P = model.response(np.eye(count))
    C, (moves, response) = model.end_responses, model.end_moves
    np.testing.assert_allclose(response, P @ moves, atol=1e-12 * np.abs(response).max())
    for required in ([0.001, 0.0], [0.0, 0.3], [0.001, -0.3]):
        m = end_conditions.corrections(np.zeros((1, count)), np.array([required]), C, moves)
        found = np.linalg.norm(response @ m[0])
        exact = lstsq(C, np.array(required))[0]
        free = null_space(C)
        least = exact - (free @ lstsq(P @ free, P @ exact)[0] if free.size else 0.0)
        assert found <= 1.05 * np.linalg.norm(P @ least)
        if count == 80:
            # Next to the end: nothing before the reach of the functions that are changed.
            before = (response @ m[0])[: -8 * (end_conditions.CHANGED + 6)]
            assert np.linalg.norm(before) <= 1e-3 * found


@pytest.mark.parametrize(("count", "part"), [(12, 0.35), (80, 0.05)])
def test_another_initial_velocity_is_made_up_for_next_to_the_start(count, part):
    model = forced_model(count, 100.0, 20.0, 0.5, 1.0, "spacing")
    move, response = model.start_move
    left = model.c[:, 0] + response
    np.testing.assert_allclose(response, model.response(move[None])[:, 0], atol=1e-12)
    assert np.linalg.norm(left) <= part * np.linalg.norm(model.c)
    # Of the velocity nothing is taken back: a forcing term changes none at once.
    h = 1.0 / (model.samples - 1)
    assert left[1] / h == pytest.approx(1.0 / 0.5, rel=0.1 if count < 80 else 0.25)
