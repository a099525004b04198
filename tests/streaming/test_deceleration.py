import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.streaming import deceleration

u = np.linspace(0.0, 1.0, 2001)


def test_rate_falls_from_one_to_zero_and_stays():
    r = np.array([deceleration.rate(x, 0.4) for x in 0.4 * u])
    assert (r[0], r[-1]) == (1.0, 0.0)
    assert np.all(np.diff(r) < 0)
    assert deceleration.rate(9.0, 0.4) == 0.0


def test_rate_begins_and_ends_smoothly():
    slope = np.gradient([deceleration.rate(x, 1.0) for x in u], u)
    assert abs(slope[0]) < 2e-3
    assert abs(slope[-1]) < 2e-3


def test_progress_is_the_integral_of_the_rate():
    duration = 0.7
    t = duration * u
    r = np.array([deceleration.rate(x, duration) for x in t])
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
