import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dmpcli.planning import deceleration

u = np.linspace(0.0, 1.0, 2001)


def rate(elapsed, duration):
    """How fast path time runs: from 1 at once to 0 at the end, smooth at both."""
    share = min(max(elapsed / duration, 0.0), 1.0)
    return 1.0 - share**2 * (3.0 - 2.0 * share)


def test_progress_runs_from_one_to_rest_smoothly():
    spent = np.array([deceleration.progress(x, 1.0) for x in u])
    speed = np.gradient(spent, u, edge_order=2)
    assert speed[[0, -1]] == pytest.approx([1.0, 0.0], abs=1e-5)
    assert np.all(np.diff(speed[1:-1]) < 0.0)
    slope = np.gradient(speed, u)
    assert np.abs(slope[[0, -1]]).max() < 4e-3
    assert deceleration.progress(9.0, 0.4) == deceleration.progress(0.4, 0.4)


def test_progress_is_the_integral_of_the_rate():
    duration = 0.7
    t = duration * u
    r = np.array([rate(x, duration) for x in t])
    integral = np.concatenate([[0.0], np.cumsum((r[1:] + r[:-1]) / 2 * np.diff(t))])
    progress = [deceleration.progress(x, duration) for x in t]
    np.testing.assert_allclose(progress, integral, atol=1e-6)
    assert deceleration.progress(99.0, duration) == duration / 2


@given(
    speed=st.floats(1.0, 250.0),
    share=st.floats(0.0, 0.99),
    limit=st.floats(500.0, 5000.0),
)
def test_acceleration_stays_inside_the_limit(speed, share, limit):
    """The worst case of p'' r² + p' r': both at their largest and in the same direction."""
    duration = deceleration.duration(speed, share * limit, limit, 1e9)
    r = 1.0 - u**2 * (3.0 - 2.0 * u)
    braking = speed * 6.0 * u * (1.0 - u) / duration
    assert np.max(share * limit * r**2 + braking) <= limit * 1.001


def test_no_ramp_is_much_longer_than_it_must_be():
    duration = deceleration.duration(200.0, 0.0, 1000.0, 1e9)
    np.testing.assert_allclose(duration, 1.5 * 200.0 / 1000.0, rtol=1e-3)


def test_jerk_of_the_ramp_stays_inside_the_limit():
    duration = deceleration.duration(200.0, 0.0, 1e9, 40_000.0)
    assert 200.0 * 6.0 / duration**2 <= 40_000.0 * (1 + 1e-12)


def test_what_stands_still_stops_at_once():
    assert deceleration.duration(0.0, 0.0, 1000.0, 1000.0) == 0.0


@settings(max_examples=25)
@given(
    speed=st.floats(1.0, 250.0),
    share=st.floats(0.0, 0.95),
    limit=st.floats(500.0, 5000.0),
)
def test_it_takes_no_longer_than_the_worst_moment_asks(speed, share, limit):
    """There it takes all of the limit, but for what 200 steps leave out."""
    duration = deceleration.duration(speed, share * limit, limit, 1e12)
    r = 1.0 - u**2 * (3.0 - 2.0 * u)
    braking = speed * 6.0 * u * (1.0 - u) / duration
    assert np.max(share * limit * r**2 + braking) >= limit * 0.999


def test_a_plan_that_takes_all_of_the_limit_uses_its_last_hundredth():
    assert deceleration.duration(100.0, 1000.0, 1000.0, 1e12) == (
        deceleration.duration(100.0, 990.0, 1000.0, 1e12)
    )
    assert deceleration.duration(100.0, 5000.0, 1000.0, 1e12) == (
        deceleration.duration(100.0, 990.0, 1000.0, 1e12)
    )


def test_a_ramp_that_only_its_jerk_limits_takes_the_whole_of_it():
    assert deceleration.duration(200.0, 0.0, 1e12, 30_000.0) == pytest.approx(0.2)
    assert deceleration.progress(-1.0, 0.4) == 0.0
