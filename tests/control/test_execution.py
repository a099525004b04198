"""What is judged before an arm moves, and the mock lab that a session is given."""

import dataclasses

import numpy as np
import pytest

from dmpcli.admittance.force_coupling import fast_filter
from dmpcli.control import execution
from dmpcli.control.cycle import ReadyArm, StopLimits
from dmpcli.errors import InputError
from dmpcli.instruments.protocols import RobotState
from dmpcli.kinematics import models
from dmpcli.kinematics.reachability import Reach
from dmpcli.records import schemas
from dmpcli.records.record import Provenance
from dmpcli.records.stroke_selection import StrokeSelection
from dmpcli.settings.execute import ExecuteSettings
from dmpcli.simulation.mock import PEN
from dmpcli.spatial.rotations import exp_one
from dmpcli.spatial.trajectory import StrokeTrajectory
from tests.control.streaming_fakes import PEN_DOWN, START, FakeClock, FakeServo, plan, stroke
from tests.control.test_servo_loop import Bench
from tests.minimum_jerk import minimum_jerk


def straight(duration, length=100.0):
    """A straight minimum-jerk stroke along x."""
    source = stroke(duration)
    way = length * minimum_jerk(source.t / duration)
    return StrokeTrajectory(
        source.t, START + way[:, None] * [1.0, 0.0, 0.0], source.rotation, id="0"
    )


def failed(source, position=START, **options):
    state = RobotState(0.0, np.array(position), PEN_DOWN, "ready")
    made, checks = execution.prepare(source, ExecuteSettings(**options), state)
    assert len(made) >= len(source.t)
    return {check.quantity: check.value for check in checks if not check.passed}


def test_a_stroke_beyond_a_limit_of_speed_acceleration_or_jerk_is_found_before_it_is_drawn():
    """A straight minimum-jerk stroke has 1.875 L/T, 5.7735 L/T² and 60 L/T³ (30 mm/s, 46 mm/s²)."""
    source = straight(6.25)
    assert failed(source) == {}
    assert failed(source, max_speed=29.0) == {"speed": pytest.approx(30.0, rel=1e-3)}
    [(quantity, value)] = failed(source, max_acceleration=14.0).items()
    assert quantity == "acceleration"
    assert value == pytest.approx(5.7735 * 100 / 6.25**2, rel=1e-2)
    assert failed(source, max_speed=31.0) == {}


def test_an_arm_that_stands_elsewhere_is_told_unless_it_is_to_come():
    away = START + [0.0, 3.0, 0.0]
    [value] = failed(straight(6.25), away).values()
    assert value == pytest.approx(3.0)
    assert failed(straight(6.25), away, start_tolerance=3.1) == {}
    assert failed(straight(6.25), away, approach=20.0) == {}


def test_the_plate_lies_under_a_stroke_that_begins_with_a_lifted_pen():
    normal = np.array([0.0, 0.6, 0.8])
    foot = np.array([300.0, 20.0, -5.0])
    position = foot + 8.0 * normal + np.linspace(0.0, 50.0, 11)[:, None] * [1.0, 0.0, 0.0]
    stroke = StrokeTrajectory(
        np.linspace(0.0, 2.0, 11), position, None, np.tile(normal, (11, 1)), id="1"
    )
    lab = execution.scene(stroke, presses=True, height=8.0)
    assert lab.plate.point == pytest.approx(foot)
    assert lab.plate.normal == pytest.approx(normal)
    assert lab.position == pytest.approx(position[0])
    assert execution.scene(stroke, presses=True).plate.point == pytest.approx(position[0])


def selection(*strokes, facts=None):
    found = tuple(dataclasses.replace(one, facts=dict(facts or {"tau": 4.0})) for one in strokes)
    return StrokeSelection(found, {}, (), len(strokes) > 1)


UP = (0.0, 0.0, 1.0)


def test_the_loop_stops_by_each_limit_as_it_is_set():
    settings = ExecuteSettings(
        following_error=1.0, following_angle=0.2, max_force=33.0, max_torque=4.0,
        arrival_tolerance=0.5, arrival_angle=0.06,
    )  # fmt: skip
    assert execution.watch(settings) == StopLimits(1.0, 0.2, 33.0, 4.0, 0.5, 0.06)


class Playing(FakeServo):
    def upload(self, *_):
        pass

    def play(self):
        pass


def ready(kind=FakeServo, **options):
    clock = FakeClock()
    servo = kind(clock, **options)
    return ReadyArm(servo, servo.info, clock)


def test_a_file_says_the_look_ahead_and_the_filter_of_the_coupling():
    filter_ = fast_filter(4.0, 0.02)
    gains = {"k": filter_.k, "d": filter_.d, "tau": 4.0, "alpha_e": filter_.alpha_e}
    assert execution.facts_of(ready(lookahead=0.3), None) == {"lookahead": 0.3}
    assert execution.facts_of(ready(), filter_) == {"lookahead": 0.2, "coupling": gains}
    assert execution.facts_of(ready(Playing), None) == {}


def test_what_is_left_to_draw_is_told_in_the_order_of_the_run():
    assert execution.progress_of("abcd", ["c", "a"]) == {
        "drawn": ["c", "a"],
        "remaining": ["b", "d"],
    }


def finished(facts=None, realtime=False, reach=None, made=None, drawn=("a",)):
    bench = Bench(plan(stroke(2.0)) if made is None else made)
    outcome = bench.run()
    bench.loop.drawn = list(drawn)
    known = Provenance("execute", {"speed": 1.0}, ({"role": "tool"},), facts or {})
    return bench, execution.record_of(bench.loop, outcome, known, realtime, reach)


def test_a_record_keeps_what_was_known_before_and_says_how_the_run_went():
    strokes = {"strokes": [{"id": name} for name in "abc"], "simulated": True}
    bench, made = finished(strokes)
    assert made.schema is schemas.RUN
    assert (made.provenance.command, made.provenance.options) == ("execute", {"speed": 1.0})
    assert made.provenance.facts == strokes | {
        "reason": "done",
        "completed": True,
        "missed": 0,
        "drawn": ["a"],
        "remaining": ["b", "c"],
    }
    columns = bench.loop.log.columns()
    assert list(made.columns) == list(columns)
    for name, values in columns.items():
        np.testing.assert_array_equal(made.columns[name], values)
    # Without strokes of its own there is nothing to list.
    assert "drawn" not in finished()[1].provenance.facts


def test_how_late_it_was_is_a_fact_where_a_clock_ran():
    _, made = finished({"simulated": False}, realtime=True)
    facts = made.provenance.facts
    assert facts["simulated"] is False
    assert set(facts["lateness"]) == set(facts["work"]) == {"p50", "p99", "max"}
    assert facts["wake"]["max"] < 1e-9
    assert facts["missed"] == 0
    assert "lateness" not in finished()[1].provenance.facts


def test_a_run_that_was_stopped_is_not_completed():
    bench = Bench(plan(stroke(2.0)))
    bench.servo.at[20] = lambda servo: bench.interruption.receive(2)
    outcome = bench.run()
    known = Provenance("execute", {}, (), {"coupling": {"k": 1.0}})
    facts = execution.record_of(bench.loop, outcome, known, False).provenance.facts
    assert (facts["reason"], facts["completed"]) == ("SIGINT: decelerated along the path", False)
    assert facts["coupling"] == {"k": 1.0}


def test_a_run_under_force_says_how_it_pressed_and_by_which_gains():
    bench = Bench(plan(stroke(2.0, normal=UP)), presses=True)
    outcome = bench.run()
    for facts, gained in (({"coupling": {"k": 1.0}}, True), ({}, False)):
        known = Provenance("execute", {}, (), facts)
        made = execution.record_of(bench.loop, outcome, known, False).provenance.facts
        assert made["contact"] == bench.loop.pressing.facts()["contact"]
        assert made["contact_events"][0]["state"] == "seeking"
        gains = {"k": 1.0} | bench.loop.pressing.gains()
        assert (made.get("coupling") == gains) is gained
        assert "coupling" in made or not gained


def test_joints_are_those_that_were_told_or_follow_from_the_poses():
    reach = Reach(models.model("ec66"))
    bench, made = finished(reach=reach)
    assert made.provenance.facts["joints"] == {"arm": "ec66", "measured": False}
    position = np.array([row.actual[0] for row in bench.rows])
    rotation = np.array([row.actual[1] for row in bench.rows])
    q = reach.follow(position[None], rotation[None], 0.02).joints[0]
    for axis in range(6):
        np.testing.assert_allclose(made.columns[f"q{axis + 1}"], q[:, axis], atol=1e-6)
    assert "joints" not in finished()[1].provenance.facts
    told = {"q1": np.zeros(3), "q2": np.ones(3), "x": np.zeros(3)}
    assert list(execution.joints_of(told, reach, 0.02)) == ["q1", "q2"]
    far = {name: made.columns[name] for name in schemas.POSE} | {"x": np.full(9, 9e3)}
    far = {name: values[:9] for name, values in far.items()}
    assert execution.joints_of(far, reach, 0.02) == {}
    assert execution.joints_of(far, None, 0.02) == {}


def test_the_arm_whose_joints_are_judged_is_the_robots_own_or_the_one_that_is_named():
    servo = ready().servo
    assert execution.reach_of(servo, None, None) is None
    made = execution.reach_of(servo, "ec66", PEN)
    assert (made.arm, made.tool) == (models.model("ec66"), PEN)
    servo.reach = Reach(models.model("ec66"))
    assert execution.reach_of(servo, None, PEN) is servo.reach
    assert execution.reach_of(servo, "ec66", PEN) is servo.reach
    with pytest.raises(InputError, match="the robot is an ec66; leave it out"):
        execution.reach_of(servo, "ur5e", None)


def test_there_is_a_plate_only_where_something_presses_and_a_normal_is_known():
    flat = stroke(normal=UP)
    assert execution.scene(flat, presses=False).plate is None
    assert execution.scene(stroke(), presses=True).plate is None
    np.testing.assert_array_equal(execution.scene(flat, presses=True).rotation, flat.rotation[0])
    bare = dataclasses.replace(flat, rotation=None)
    np.testing.assert_array_equal(
        execution.scene(bare, presses=True).rotation, execution.Scene().rotation
    )


def test_where_the_arm_stands_is_judged_by_distance_and_angle_where_the_stroke_has_one():
    state = RobotState(
        0.0, START + [0.0, 3.0, 4.0], exp_one(np.array([0.0, 0.0, 0.03])) @ PEN_DOWN, "ready"
    )
    settings = ExecuteSettings(start_tolerance=5.5, start_angle=0.02)
    distance, angle = execution.standing(stroke(), settings, state)
    assert (distance.value, distance.limit) == (pytest.approx(5.0), 5.5)
    assert (angle.value, angle.limit) == (pytest.approx(0.03), 0.02)
    _, angle = execution.standing(stroke(rotated=False), settings, state)
    assert angle.value == pytest.approx(0.0, abs=1e-9)


def test_joints_are_judged_from_where_they_are():
    reach = Reach(models.model("ec66"))
    state = RobotState(0.0, START, PEN_DOWN, "ready")
    source = straight(6.25)
    made, checks = execution.prepare(source, ExecuteSettings(), state, reach)
    assert [c.quantity for c in checks if "joint" in c.quantity or "reach" in c.quantity]
    near, after = execution.judge(source, made, ExecuteSettings(), [], reach, None)
    q = reach.follow(made.position[None], made.rotation[None], 0.02).joints[0]
    np.testing.assert_allclose(after, q[-1])
    assert len(checks) == len(near) + 2
    assert execution.judge(source, made, ExecuteSettings(), [], None, None)[1] is None
