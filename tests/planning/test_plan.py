from dataclasses import replace

import numpy as np
import pytest

from dmpcli.errors import InputError
from dmpcli.planning import plan as planning
from dmpcli.planning.limits import Limits
from dmpcli.planning.plan import PlanSegment, joined, sample, straight
from dmpcli.spatial import rotations
from dmpcli.spatial.output_events import OutputEvent
from dmpcli.spatial.pose import Pose
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
    made = plan(stroke(), start=Pose(away, turned), approach=25.0)
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
    made = plan(stroke(), start=Pose(START + 1.0, PEN_DOWN), approach=250.0)
    _, acceleration, jerk = made.derivatives()
    head = slice(0, made.lead + 1)
    assert np.linalg.norm(acceleration[head, 0], axis=1).max() < WIDE.acceleration
    assert np.linalg.norm(jerk[head, 0], axis=1).max() < WIDE.jerk


def test_a_missing_orientation_holds_the_arms():
    held = rotations.exp(np.array([0.1, 0.2, 0.3])) @ PEN_DOWN
    made = plan(stroke(rotated=False), start=Pose(START, held))
    np.testing.assert_allclose(made.rotation, np.broadcast_to(held, made.rotation.shape))
    assert not made.oriented


def test_what_lies_far_off_does_not_count_between_two_set_points():
    """So it takes no longer on a long plan than on a short one when the loop first brakes."""
    made = plan(stroke(turn=0.8))
    expected = made.at(200.5)
    for part in (made.position, made.rotation):
        part[:150], part[250:] = np.nan, np.nan
    found = made.at(200.5)
    np.testing.assert_array_equal(found.position, expected.position)
    np.testing.assert_array_equal(found.rotation, expected.rotation)


def test_between_two_set_points_the_plan_runs_on_the_curve():
    made = plan(stroke(turn=0.8))
    found = made.at(200.5)
    np.testing.assert_allclose(found.position, sine(200.5 * 0.02, 10.0), atol=1e-5)
    expected = rotations.from_euler(np.array([np.pi, 0.0, 0.8 * minimum_jerk(200.5 / 500)]))
    assert found.apart(replace(found, rotation=expected))[1] < 1e-6
    assert made.time_at(200.5) == pytest.approx(4.01)


def test_derivatives_of_a_known_motion():
    """Constant speed from and to a standstill: one step in velocity at each end."""
    source = stroke()
    position = START + np.arange(501)[:, None] * np.array([0.2, 0.0, 0.0])
    made = plan(replace(source, position=position))
    velocity, acceleration, jerk = made.derivatives()
    np.testing.assert_allclose(velocity[:, 0, 0], 10.0)
    np.testing.assert_allclose(acceleration[[0, 1, -2, -1], 0, 0], [500, 0, 0, -500], atol=1e-6)
    assert (len(velocity), len(acceleration), len(jerk)) == (500, 501, 502)


def test_derivatives_of_a_known_turn_are_about_base_axes():
    """0.8 rad about base z, minimum jerk in 10 s: 1.875, 5.7735 and 60 times the closed forms."""
    # Tilted, since a pen that points straight down is its own inverse.
    tilted = rotations.exp(np.array([0.3, 0.2, 0.0]))
    source = stroke(turn=0.8)
    source = replace(source, rotation=source.rotation @ tilted)
    velocity, acceleration, jerk = plan(source).derivatives()
    at = np.argmax(velocity[:, 1, 2] ** 2)
    assert abs(velocity[at, 1, 2]) == pytest.approx(1.875 * 0.08, rel=1e-3)
    # The pen points down: its own z axis is base -z, and it turns about that.
    turned = rotations.log(source.rotation[-1] @ source.rotation[0].T)
    assert np.sign(velocity[at, 1, 2]) == np.sign(turned[2])
    assert velocity[:, 1].sum(axis=0) * 0.02 == pytest.approx(turned, abs=1e-9)
    assert np.abs(acceleration[:, 1]).max() == pytest.approx(5.7735 * 0.008, rel=1e-2)
    assert np.abs(jerk[:, 1, :2]).max() < 1e-6


def way(start, goal, limits, speed=1e6, spare=0.0, period=0.001):
    return straight("transfer", start, goal, period, limits, speed, spare)


def lasting(duration, period=0.001):
    """Set-points of a way of this duration, within a period."""
    return pytest.approx(duration / period, abs=1.0)


FREE = Limits(1e9, 1e12, 1e15, 1e9, 1e12, 1e15)


@pytest.mark.parametrize(
    ("name", "most", "duration"),
    [
        # Of 40 mm and 0.5 rad by the peaks of minimum jerk: 1.875, 5.7735 and 60.
        ("speed", 50.0, 1.875 * 40.0 / 50.0),
        ("acceleration", 100.0, np.sqrt(5.7735 * 40.0 / 100.0)),
        ("jerk", 500.0, np.cbrt(60.0 * 40.0 / 500.0)),
        ("rotation_speed", 0.4, 1.875 * 0.5 / 0.4),
        ("rotation_acceleration", 1.5, np.sqrt(5.7735 * 0.5 / 1.5)),
        ("rotation_jerk", 7.0, np.cbrt(60.0 * 0.5 / 7.0)),
    ],
)
def test_a_straight_way_takes_as_long_as_its_nearest_limit_asks(name, most, duration):
    goal = Pose(START + [24.0, -32.0, 0.0], rotations.exp(np.array([0.0, 0.3, 0.4])) @ PEN_DOWN)
    made = way(Pose(START, PEN_DOWN), goal, replace(FREE, **{name: most}))
    assert len(made.position) == lasting(duration)
    np.testing.assert_array_equal(made.position[0], START)
    share = minimum_jerk(np.arange(len(made.position)) / len(made.position))
    np.testing.assert_allclose(made.position, START + share[:, None] * [24.0, -32.0, 0.0])
    turned = rotations.log(made.rotation @ PEN_DOWN.T)
    np.testing.assert_allclose(turned, share[:, None] * [0.0, 0.3, 0.4], atol=1e-9)


def test_a_way_is_no_faster_than_asked_and_slower_by_what_a_coupling_may_add():
    goal = Pose(START + [0.0, 0.0, 30.0], PEN_DOWN)
    asked = way(Pose(START, PEN_DOWN), goal, FREE, speed=20.0)
    assert len(asked.position) == lasting(1.875 * 30.0 / 20.0)
    spared = way(Pose(START, PEN_DOWN), goal, FREE, speed=20.0, spare=10.0)
    assert len(spared.position) == lasting(1.875 * 40.0 / 20.0)


@pytest.mark.parametrize(
    ("off", "turn", "count"),
    [(0.00099, 0.0, 0), (0.00101, 0.0, 1), (0.0, 1.9e-5, 0), (0.0, 2.1e-5, 1)],
)
def test_an_arm_that_stands_at_the_goal_needs_no_way(off, turn, count):
    start = Pose(START + [off, 0.0, 0.0], rotations.exp(np.array([turn, 0.0, 0.0])) @ PEN_DOWN)
    assert bool(len(way(start, Pose(START, PEN_DOWN), WIDE).position)) == bool(count)


def forced(force):
    source = stroke(duration=1.0, rate=10.0)
    return replace(
        source, force=np.array(force, dtype=float), normal=np.tile([0.0, 0.0, 2.0], (11, 1))
    )


def test_a_force_is_linear_between_two_samples_that_press_and_none_beside_a_lifted_one():
    made = plan(forced([0, 0, 4, 6, 6, 6, 0, 0, 3, 3, 3]))
    at = np.arange(51) * 0.02 / 0.1  # in samples of the file
    inside = ((at >= 2 - 1e-9) & (at <= 5 + 1e-9)) | (at >= 8 - 1e-9)
    wanted = np.where(inside, np.interp(at, np.arange(11), [0, 0, 4, 6, 6, 6, 0, 0, 3, 3, 3]), 0.0)
    np.testing.assert_allclose(made.force, wanted)
    np.testing.assert_allclose(made.normal, np.tile([0.0, 0.0, 1.0], (51, 1)))


def test_what_is_switched_lies_on_the_strokes_own_time_from_its_first_sample():
    source = stroke(duration=2.0)
    events = (OutputEvent(3.0, "DO1", on=True), OutputEvent(3.55, "DO1", on=False))
    made = plan(
        replace(source, t=source.t + 3.0, events=events),
        speed=0.5,
        start=Pose(START + 5.0, PEN_DOWN),
    )
    assert made.t[made.lead] == 0.0
    assert [at for at, _ in made.events] == pytest.approx([made.lead, made.lead + 55.0])
    assert [event.t for _, event in made.events] == pytest.approx([0.0, 0.55])
    np.testing.assert_array_equal(made.t[: made.lead], 0.0)
    assert made.t[made.last] == pytest.approx(2.0)


def test_ways_hold_what_the_strokes_ends_say():
    sampled = sample(forced(np.arange(11.0)), 0.1, 1.0, PEN_DOWN)
    here = PlanSegment("approach", np.zeros((2, 3)), np.tile(np.eye(3), (2, 1, 1)))
    there = PlanSegment("retract", np.ones((3, 3)), np.tile(np.eye(3), (3, 1, 1)))
    empty = PlanSegment("transfer", np.empty((0, 3)), np.empty((0, 3, 3)))
    made = joined(sampled, [empty, here], [there], 0.1, False)
    assert (made.lead, made.last, len(made)) == (2, 12, 16)
    assert made.legs == (("approach", 0), ("stroke", 2), ("retract", 13))
    np.testing.assert_allclose(made.force, [0, 0, *range(11), 10, 10, 10])
    np.testing.assert_allclose(made.t, [0, 0, *(0.1 * np.arange(11)), 1, 1, 1])
    assert [made.phase_at(i) for i in (0, 1.5, 2, 12.5, 13, 15)] == (
        ["approach", "approach", "stroke", "stroke", "retract", "retract"]
    )
    assert [made.draws_at(i) for i in (1.9, 2, 12, 12.1)] == [False, True, True, False]
    np.testing.assert_array_equal(made.position[[1, 13]], [[0, 0, 0], [1, 1, 1]])
    # At the very end, and a rounding beyond.
    np.testing.assert_array_equal(made.at(15.0).position, [1, 1, 1])
    np.testing.assert_array_equal(made.at(16.0).position, [1, 1, 1])
    assert made.time_at(15.0) == pytest.approx(1.0)
    assert made.time_at(3.5) == pytest.approx(0.15)
    np.testing.assert_allclose(made.normal_at(99.0), [0.0, 0.0, 1.0])


def test_as_many_set_points_as_may_be_are_planned_and_no_more(monkeypatch):
    monkeypatch.setattr(planning, "LONGEST", 500)
    assert len(plan(stroke())) == 501
    with pytest.raises(InputError, match="over 500 set-points"):
        plan(stroke(duration=10.02))


def test_an_attitude_that_passes_half_a_turn_is_resampled_without_a_jump():
    """A pen that points down, rx = π, is half a turn: leaning to and fro it passes that."""
    t = np.arange(21) * 0.1
    lean = 0.4 * minimum_jerk(t / 2.0) - 0.2
    angles = np.column_stack([np.pi + lean, 0.0 * t, 0.3 * lean])
    source = replace(stroke(duration=2.0, rate=10.0), rotation=rotations.from_euler(angles))
    made = plan(source)
    at = np.interp(made.t, np.linspace(0.0, 2.0, 2001), 0.4 * minimum_jerk(np.linspace(0, 1, 2001)))
    angles = np.column_stack([np.pi + at - 0.2, 0.0 * at, 0.3 * (at - 0.2)])
    off = rotations.log(rotations.from_euler(angles) @ np.swapaxes(made.rotation, -1, -2))
    assert np.abs(off).max() < 2e-3
    velocity = made.derivatives()[0][:, 1]
    assert np.linalg.norm(velocity, axis=1).max() < 1.1 * 1.875 * 0.42 / 2.0
    # Between two set-points too.
    for index in (47.5, 50.25, 53.75):
        turn = rotations.log(made.at(index).rotation @ made.rotation[int(index)].T)
        assert np.linalg.norm(turn) < 0.02


def test_a_plan_without_a_normal_says_so():
    with pytest.raises(ValueError, match="no normal"):
        plan(stroke()).normal_at(3)
    tilted = plan(stroke(normal=(0.6, 0.0, 0.8)))
    np.testing.assert_array_equal(tilted.normal_at(3), [0.6, 0.0, 0.8])


@pytest.mark.parametrize(("distance", "goes"), [(0.9990, False), (1.0, True), (1.001, True)])
def test_a_micrometre_is_gone_and_less_is_not(distance, goes):
    goal = np.array([distance * planning._AT_START, 0.0, 0.0])
    made = straight("approach", Pose(np.zeros(3), PEN_DOWN), Pose(goal, PEN_DOWN), 0.02, WIDE, 20.0)
    assert (
        Pose(np.zeros(3), PEN_DOWN).apart(Pose(goal, PEN_DOWN))[0] == distance * planning._AT_START
    )
    assert (len(made.position) > 0) == goes
