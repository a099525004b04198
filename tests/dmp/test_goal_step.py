import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from dmpcli.dmp.goal_step import GoalFilter, response, settling

STILL = np.zeros((2, 3))

# Damping ratios of 0.5 to 2; what learning makes is 1.
gains = st.builds(
    lambda d, ratio, tau, period: (d**2 / (2.0 * ratio) ** 2, d, tau, period),
    st.floats(8.0, 60.0),
    st.floats(0.5, 2.0),
    st.floats(0.5, 10.0),
    st.floats(0.01, 0.05),
)
ways = st.lists(st.floats(-100.0, 100.0), min_size=3, max_size=3).map(np.array)


@pytest.mark.parametrize(("k", "d"), [(100.0, 20.0), (20.0, 20.0), (400.0, 10.0)])
def test_the_response_is_that_of_the_differential_equations(k, d):
    tau, period = 5.0, 0.02
    shift, state = np.array([30.0, -12.0, 0.5]), np.array([[1.0, 2.0, 0.0], [-4.0, 9.0, 1.0]])
    made = response(GoalFilter(k, d, tau, period), state, shift, 400)

    def slope(_, y):
        delta, V = y.reshape(2, 3)
        return np.concatenate([V, k * (shift - delta) - d * V]) / tau

    t = period * np.arange(1, 401)
    true = solve_ivp(slope, (0.0, t[-1]), state.ravel(), "DOP853", t, rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(made.reshape(400, 6), true.y.T, atol=1e-8)


def test_a_critically_damped_step_has_its_closed_form():
    filter_ = GoalFilter(100.0, 20.0, 5.0, 0.02)
    made = response(filter_, STILL, np.array([10.0, 0.0, -3.0]), 300)
    x = 2.0 * np.arange(1, 301) * 0.02  # d t / (2 tau)
    rise = 1.0 - (1.0 + x) * np.exp(-x)
    np.testing.assert_allclose(made[:, 0], np.outer(rise, [10.0, 0.0, -3.0]), atol=1e-12)


@pytest.mark.slow
@given(gains, st.lists(ways, min_size=1, max_size=5), st.data())
def test_whatever_the_goal_does_position_and_velocity_are_continuous(given_gains, goals, data):
    filter_ = GoalFilter(*given_gains)
    state, fine = STILL, GoalFilter(*given_gains[:3], given_gains[3] / 1000.0)
    for shift in goals:
        after = response(fine, state, shift, 1)[0]
        size = float(np.abs(state - shift).max() + np.abs(state).max())
        rate = (filter_.k + filter_.d + 1.0) / filter_.tau * fine.period
        assert np.abs(after - state).max() <= 1.1 * rate * size + 1e-12
        state = response(filter_, state, shift, data.draw(st.integers(1, 40)))[-1]


@pytest.mark.slow
@given(gains, st.lists(ways, min_size=1, max_size=4), st.integers(1, 50))
def test_the_last_goal_is_reached_and_when_is_known(given_gains, goals, held):
    filter_, state = GoalFilter(*given_gains), STILL
    for shift in goals[:-1]:
        state = response(filter_, state, shift, held)[-1]
    count = settling(filter_, state, goals[-1], 0.01)
    after = response(filter_, state, goals[-1], max(count, 1) + 200)
    off = np.abs(after - np.stack([goals[-1], np.zeros(3)])).max(axis=(1, 2))
    assert off[max(count - 1, 0) :].max() <= 0.01 * (1.0 + 1e-9)
    if count > 1:
        assert off[count - 2] > 0.01


@given(gains, ways, ways, st.integers(1, 60))
def test_responses_add_up_as_the_equations_are_linear(given_gains, one, other, count):
    filter_ = GoalFilter(*given_gains)
    both = response(filter_, STILL, one + other, count)
    parts = response(filter_, STILL, one, count) + response(filter_, STILL, other, count)
    np.testing.assert_allclose(both, parts, atol=1e-9)


@given(gains, ways, st.integers(1, 30), st.integers(1, 30))
def test_stopping_on_the_way_changes_nothing(given_gains, shift, first, then):
    filter_ = GoalFilter(*given_gains)
    state = response(filter_, STILL, shift, first)[-1]
    whole = response(filter_, STILL, shift, first + then)[-1]
    np.testing.assert_allclose(response(filter_, state, shift, then)[-1], whole, atol=1e-8)
