"""The speed along a path: constant where it may be, and within the acceleration everywhere."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dmpcli.dmp import tool_speed
from dmpcli.dmp.tool_speed import Pace, held, passed

RATE = 50.0
T = np.linspace(0.0, 10.0, 2001)


def jerk(u):
    return u**3 * (10 - 15 * u + 6 * u * u)


def line(u):
    return np.stack([300 * u, 0 * u, 0 * u], axis=-1)


def circle(u):
    return 30.0 * np.stack([np.cos(6 * u), np.sin(6 * u), 0 * u], axis=-1)


def wave(height, periods):
    def of(u):
        return np.stack([300 * u, height * np.sin(2 * np.pi * periods * u), 0 * u], axis=-1)

    return of


def motion(path, pace, law=jerk):
    """Velocities (K, 3) between samples of a path of shares 0..1, taught with a time law."""
    times = passed(T, path(law(T / 10.0)), pace, RATE)
    assert times[0] == 0.0
    assert times[-1] == 10.0
    assert np.all(np.diff(times) >= 0.0)
    return np.diff(path(law(times / 10.0)), axis=0) * RATE


@pytest.mark.parametrize("law", [jerk, lambda u: u, lambda u: u - 0.9 * np.sin(6 * u) / 6 * u])
@pytest.mark.parametrize("speed", [15.0, 60.0, 200.0])
def test_on_a_line_the_speed_is_the_one_asked_for_whatever_the_hand_did(speed, law):
    v = np.linalg.norm(motion(line, Pace(speed), law), axis=1)
    ramp = int(np.ceil((speed / 700.0 + 0.14) * RATE)) + 1
    np.testing.assert_allclose(v[ramp:-ramp], speed, rtol=2e-4)
    assert v.max() < speed * (1 + 2e-4)
    assert v[0] < 1.0  # from rest: the first step of the ramp
    assert v[-1] < 1.0


def test_the_duration_is_that_of_a_trapezoid_with_rounded_corners():
    speed, acceleration = 100.0, 1000.0
    times = passed(T, line(jerk(T / 10.0)), Pace(speed, acceleration), RATE)
    ideal = 300.0 / speed + speed / (np.sqrt(0.5) * acceleration) + 0.12
    assert (len(times) - 1) / RATE == pytest.approx(ideal, abs=1.5 / RATE)


def test_on_a_circle_the_speed_is_held_below_what_the_acceleration_allows():
    # sqrt(a_n r) with a_n = 707 mm/s² and r = 30 mm is 145.6 mm/s.
    slow = np.linalg.norm(motion(circle, Pace(100.0)), axis=1)
    np.testing.assert_allclose(slow[20:-20], 100.0, rtol=1e-3)
    fast = np.linalg.norm(motion(circle, Pace(400.0)), axis=1)
    np.testing.assert_allclose(fast[25:-25], np.sqrt(np.sqrt(0.5) * 1000.0 * 30.0), rtol=5e-3)


@settings(max_examples=40, deadline=None)
@given(st.floats(0.5, 40.0), st.floats(0.25, 12.0), st.floats(5.0, 400.0), st.floats(100.0, 3000.0))
def test_neither_speed_nor_acceleration_is_exceeded_on_waves(height, periods, speed, acceleration):
    velocity = motion(wave(height, periods), Pace(speed, acceleration))
    v = np.linalg.norm(velocity, axis=1)
    a = np.linalg.norm(np.diff(velocity, axis=0), axis=1) * RATE
    assert v.max() <= speed * 1.005
    assert a.max() <= acceleration * 1.02


def test_a_right_angle_is_passed_slowly_and_the_speed_is_back_after_it():
    def corner(u):
        return np.stack([np.minimum(300 * u, 150), np.maximum(300 * u - 150, 0), 0 * u], axis=-1)

    v = np.linalg.norm(motion(corner, Pace(100.0)), axis=1)
    way = np.cumsum(v) / RATE
    assert v[np.abs(way - 150.0) < 2.0].min() < 30.0
    apart = (np.abs(way - 150.0) > 25.0) & (way > 25.0) & (way < 275.0)
    np.testing.assert_allclose(v[apart], 100.0, rtol=2e-3)


def test_a_point_is_passed_in_one_step():
    assert passed(T, np.zeros((len(T), 3)), Pace(10.0), RATE).tolist() == [0.0, 10.0]


def test_what_is_held_is_the_share_of_the_path_at_the_speed():
    """1 s at 40 mm/s and 3 s at 20 mm/s: four tenths of the path."""
    x = np.concatenate([np.linspace(0.0, 40.0, 51), np.linspace(40.0, 100.0, 151)[1:]])
    position = np.stack([x, 0.0 * x, 0.0 * x], axis=1)
    for speed, share in ((40.0, 0.4), (41.0, 0.4), (20.0, 1.0), (43.0, 0.0)):
        found, fastest = held(position, 50.0, speed)
        assert found == pytest.approx(share)
        assert fastest == pytest.approx(40.0)


@pytest.mark.parametrize(("arrives", "samples"), [(1.0, 11), (1.02, 12), (0.98, 11)])
def test_an_arrival_at_a_sample_is_the_last_one_and_else_the_next_rests(
    monkeypatch, arrives, samples
):
    law = np.array([0.0, 0.4, arrives]), np.array([0.0, 30.0, 60.0])
    monkeypatch.setattr(tool_speed, "_law", lambda *_: law)
    path = np.column_stack([np.linspace(0.0, 60.0, 40), *np.zeros((2, 40))])
    found = tool_speed.passed(np.linspace(0.0, 6.0, 40), path, Pace(60.0), 10.0)
    assert len(found) == samples
    assert found[[0, -1]].tolist() == [0.0, 6.0]
    np.testing.assert_allclose(found[:4], [0.0, 0.75, 1.5, 2.25])
