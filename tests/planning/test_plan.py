import numpy as np
import pytest

from dmpcli.planning.plan import gap
from dmpcli.spatial import rotations
from tests.control.streaming_fakes import PEN_DOWN, START, WIDE, plan, sine, stroke
from tests.minimum_jerk import minimum_jerk


def test_a_file_at_the_servo_rate_is_streamed_unchanged():
    source = stroke()
    made = plan(source)
    assert np.array_equal(made.position, source.position)
    assert np.array_equal(made.rotation, source.rotation)
    assert made.lead == 0
    np.testing.assert_allclose(made.t, source.t, atol=1e-12)


@pytest.mark.parametrize(("rate", "period"), [(50.0, 0.008), (100.0, 0.02), (73.0, 0.02)])
def test_resampling_follows_the_curve_between_the_samples(rate, period):
    made = plan(stroke(rate=rate, turn=0.8), period)
    np.testing.assert_allclose(made.position, sine(made.t, 10.0), atol=1e-4)
    angles = rotations.to_euler_continuous(made.rotation)[:, 2]
    np.testing.assert_allclose(angles, 0.8 * minimum_jerk(made.t / 10.0), atol=1e-6)


def test_resampling_adds_no_jerk():
    """A rate that does not divide the servo's: a broken-line interpolation would shake the arm."""
    coarse = np.linalg.norm(plan(stroke(rate=33.0), 0.002).derivatives()[2], axis=-1).max()
    fine = np.linalg.norm(plan(stroke(rate=500.0), 0.002).derivatives()[2], axis=-1).max()
    assert coarse < 1.5 * fine


def test_half_the_speed_is_the_same_path_in_twice_the_time():
    made = plan(stroke(), speed=0.5)
    assert len(made) == 1001
    np.testing.assert_allclose(made.position[::2], stroke().position, atol=1e-12)
    np.testing.assert_allclose(made.position[-1], stroke().position[-1])


def test_a_duration_that_is_no_multiple_of_the_period_still_ends_at_the_goal():
    made = plan(stroke(duration=9.99, rate=100.0))
    assert np.array_equal(made.position[-1], stroke(duration=9.99, rate=100.0).position[-1])


def test_approach_is_straight_at_rest_at_both_ends_and_slow_enough():
    away = START + np.array([30.0, -40.0, 0.0])
    turned = rotations.exp(np.array([0.0, 0.0, 0.2])) @ PEN_DOWN
    made = plan(stroke(), start=(away, turned), approach=25.0)
    way = made.position[: made.lead + 1]
    np.testing.assert_allclose(way[0], away)
    assert np.array_equal(made.position[made.lead], START)
    np.testing.assert_allclose(made.rotation[0], turned, atol=1e-12)
    line = (START - away) / 50.0
    np.testing.assert_allclose(np.cross(way - away, line), 0.0, atol=1e-9)
    velocity, acceleration, _ = made.derivatives()
    assert np.linalg.norm(velocity[: made.lead, 0], axis=1).max() <= 25.0
    assert np.linalg.norm(velocity[: made.lead, 0], axis=1).max() > 24.0
    assert np.linalg.norm(acceleration[: made.lead, 0], axis=1).max() < WIDE.acceleration
    assert np.all(made.t[: made.lead] == 0.0)


def test_a_short_approach_at_high_speed_keeps_acceleration_and_jerk():
    made = plan(stroke(), start=(START + 1.0, PEN_DOWN), approach=250.0)
    _, acceleration, jerk = made.derivatives()
    head = slice(0, made.lead + 1)
    assert np.linalg.norm(acceleration[head, 0], axis=1).max() < WIDE.acceleration
    assert np.linalg.norm(jerk[head, 0], axis=1).max() < WIDE.jerk


def test_a_missing_orientation_holds_the_arms():
    held = rotations.exp(np.array([0.1, 0.2, 0.3])) @ PEN_DOWN
    made = plan(stroke(rotated=False), start=(START, held))
    np.testing.assert_allclose(made.rotation, np.broadcast_to(held, made.rotation.shape))
    assert not made.oriented


def test_what_lies_far_off_does_not_count_between_two_set_points():
    """So it takes no longer on a long plan than on a short one when the loop first brakes."""
    made = plan(stroke(turn=0.8))
    expected = made.at(200.5)
    for part in (made.position, made.rotation):
        part[:150], part[250:] = np.nan, np.nan
    position, rotation = made.at(200.5)
    np.testing.assert_array_equal(position, expected[0])
    np.testing.assert_array_equal(rotation, expected[1])


def test_between_two_set_points_the_plan_runs_on_the_curve():
    made = plan(stroke(turn=0.8))
    position, rotation = made.at(200.5)
    np.testing.assert_allclose(position, sine(200.5 * 0.02, 10.0), atol=1e-5)
    expected = np.array([np.pi, 0.0, 0.8 * minimum_jerk(200.5 / 500)])
    assert gap((position, rotation), (position, rotations.from_euler(expected)))[1] < 1e-6
    assert made.time_at(200.5) == pytest.approx(4.01)


def test_derivatives_of_a_known_motion():
    """Constant speed from and to a standstill: one step in velocity at each end."""
    source = stroke()
    position = START + np.arange(501)[:, None] * np.array([0.2, 0.0, 0.0])
    made = plan(type(source)("0", source.t, position, source.rotation))
    velocity, acceleration, jerk = made.derivatives()
    np.testing.assert_allclose(velocity[:, 0, 0], 10.0)
    np.testing.assert_allclose(acceleration[[0, 1, -2, -1], 0, 0], [500, 0, 0, -500], atol=1e-6)
    assert (len(velocity), len(acceleration), len(jerk)) == (500, 501, 502)


def test_derivatives_of_a_known_turn_are_about_base_axes():
    """0.8 rad about base z, minimum jerk in 10 s: 1.875, 5.7735 and 60 times the closed forms."""
    # Tilted, since a pen that points straight down is its own inverse.
    tilted = rotations.exp(np.array([0.3, 0.2, 0.0]))
    source = stroke(turn=0.8)
    source = type(source)("0", source.t, source.position, source.rotation @ tilted)
    velocity, acceleration, jerk = plan(source).derivatives()
    at = np.argmax(velocity[:, 1, 2] ** 2)
    assert abs(velocity[at, 1, 2]) == pytest.approx(1.875 * 0.08, rel=1e-3)
    # The pen points down: its own z axis is base -z, and it turns about that.
    turned = rotations.log(source.rotation[-1] @ source.rotation[0].T)
    assert np.sign(velocity[at, 1, 2]) == np.sign(turned[2])
    assert velocity[:, 1].sum(axis=0) * 0.02 == pytest.approx(turned, abs=1e-9)
    assert np.abs(acceleration[:, 1]).max() == pytest.approx(5.7735 * 0.008, rel=1e-2)
    assert np.abs(jerk[:, 1, :2]).max() < 1e-6
