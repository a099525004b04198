"""What is judged before an arm moves, and the mock lab that a session is given."""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest

from dmpcli.admittance.force_coupling import fast_filter
from dmpcli.admittance.force_law import ForceGains
from dmpcli.control import execution
from dmpcli.control.contact_policy import ContactEvent, ContactPolicy
from dmpcli.control.cycle import ReadyArm, StopLimits
from dmpcli.control.normal_sensing import NormalPolicy
from dmpcli.errors import InputError, RefusedError
from dmpcli.instruments.protocols import RobotState, SensorInfo
from dmpcli.kinematics import models
from dmpcli.kinematics.reachability import Reach
from dmpcli.records import schemas
from dmpcli.records.record import Provenance
from dmpcli.records.stroke_selection import StrokeSelection
from dmpcli.settings.execute import ExecuteSettings
from dmpcli.simulation.mock import PEN
from dmpcli.spatial.rotations import exp_one
from dmpcli.spatial.trajectory import StrokeTrajectory
from tests.control.fake_sensors import StreamingSensor
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
# Each as no other one, and none as it is by default.
OWN = {
    "coupling_contact": 0.7, "coupling_reach": 4.5, "coupling_seek": 1.5, "coupling_release": 8.0,
    "coupling_clamp": 12.0, "coupling_rate": 9.0, "coupling_limit": 3.5, "coupling_drag": 2.5,
    "coupling_rub": 0.3, "coupling_patience": 0.09, "on_contact_loss": "hold", "stiffness": 6.5,
    "delay": 0.11, "coupling_damping": 1.7, "coupling_mass": 0.4, "coupling_stiffness": 0.25,
    "coupling_zero_limit": 1.25, "min_contact": 60.0, "force_setpoint": 3.25,
}  # fmt: skip


def test_the_coupling_goes_by_each_setting_as_it_is_set():
    made = execution.policy_of(selection(stroke()), ExecuteSettings(**OWN), 0.17, 19.6133)
    assert made == ContactPolicy(
        setpoint=3.25, contact=0.7, reach=4.5, again=4.5, seek=1.5, free=8.0, clamp=12.0, rate=9.0,
        limit=3.5, drag=2.5, rub=0.3, patience=0.09, on_loss="hold", delay=0.17, stiffness=6.5,
        whole_delay=0.11, gains=ForceGains(0.4, 1.7, 0.25, math.inf, 0.02), spring=0.25,
        zero_limit=1.25, least_share=0.6, tool_mass=pytest.approx(2.0),
    )  # fmt: skip


def test_less_than_half_the_set_point_is_no_contact_and_lost_it_is_sought_over_six_millimetres():
    plain = execution.policy_of(selection(stroke()), ExecuteSettings(coupling_reach=14.0), 0.1)
    assert (plain.setpoint, plain.contact, plain.reach, plain.again) == (5.0, 0.5, 14.0, 6.0)
    assert plain.gains is None
    assert plain.tool_mass == 0.0
    light = ExecuteSettings(force_setpoint=0.8)
    assert execution.policy_of(selection(stroke()), light, 0.1).contact == pytest.approx(0.4)


def test_the_largest_force_of_all_strokes_is_the_set_point_unless_one_is_asked_for():
    forces = [None, np.full(501, 0.0), np.linspace(1.0, 4.0, 501), np.full(501, 2.0)]
    batch = selection(*(dataclasses.replace(stroke(), force=force) for force in forces))
    assert execution.policy_of(batch, ExecuteSettings(), 0.1).setpoint == 4.0
    assert execution.policy_of(batch, ExecuteSettings(force_setpoint=3.0), 0.1).setpoint == 3.0
    assert execution.policy_of(selection(stroke()), ExecuteSettings(), 0.1).setpoint == 5.0


def test_the_loop_stops_by_each_limit_as_it_is_set():
    settings = ExecuteSettings(
        following_error=1.0, following_angle=0.2, max_force=33.0, max_torque=4.0,
        arrival_tolerance=0.5, arrival_angle=0.06,
    )  # fmt: skip
    assert execution.watch(settings) == StopLimits(1.0, 0.2, 33.0, 4.0, 0.5, 0.06)


@pytest.mark.parametrize("speed", [0.5, 1.0, 2.0])
def test_the_filter_is_that_of_the_strokes_tau_at_the_speed_and_period_of_the_run(speed):
    settings = ExecuteSettings(speed=speed, period=0.01)
    pressed = stroke(normal=UP)
    for facts, tau in (({"tau": 4.0}, 4.0), ({}, 10.0), ({"tau": None}, 10.0)):
        found = execution.coupling_filter(dataclasses.replace(pressed, facts=facts), settings)
        own = fast_filter(tau / speed, 0.01)
        assert (found.tau, found.k, found.d, found.alpha_e) == (
            pytest.approx((tau / speed, own.k, own.d, own.alpha_e))
        )
        np.testing.assert_allclose(found.transition, own.transition)
    # Of several strokes it is the first one's; each of them is asked.
    batch = selection(pressed, dataclasses.replace(pressed, t=2.0 * pressed.t), facts={"k": 1.0})
    assert execution.coupling_of(batch, settings, 5.0).tau == pytest.approx(10.0 / speed)
    late = dataclasses.replace(pressed, t=pressed.t + 100.0)
    assert execution.coupling_filter(late, settings).tau == pytest.approx(10.0 / speed)
    with pytest.raises(InputError, match="no surface normal"):
        execution.coupling_of(selection(pressed, stroke()), settings, 5.0)


def test_a_set_point_or_gains_that_must_not_be_are_refused_before_anything_moves():
    hard = dataclasses.replace(stroke(normal=UP), force=np.linspace(0.0, 50.0, 501))
    with pytest.raises(InputError, match="the trajectory's fn = 50"):
        execution.coupling_filter(hard, ExecuteSettings())
    execution.coupling_filter(hard, ExecuteSettings(max_force=50.1))
    with pytest.raises(InputError, match="coupling_mass"):
        execution.coupling_of(selection(stroke(normal=UP)), ExecuteSettings(coupling_mass=1.0), 5.0)


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


def test_a_look_ahead_behind_which_a_force_is_corrected_slowly_is_told():
    assert execution.slowed(0.15) == ""
    assert "behind a look-ahead of 0.2 s" in execution.slowed(0.2)
    assert "2 times as slowly" in execution.slowed(0.2)


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


class Started(StreamingSensor):
    """Whether a zero was asked for shows by how long was waited."""

    def start(self, rate):
        super().start(rate)
        self.asked = rate


@pytest.mark.parametrize("rate", [50.0, 1000.0])
def test_what_the_loop_feels_with_is_zeroed_at_rest_and_streams_no_faster_than_it_can(rate):
    arm = ready()
    sensor = Started(arm.clock, lambda t: np.array([1.0, 0, 2.0, 0, 0, 0]))
    sensor.open = lambda: SensorInfo("fake", rate, np.full(6, 100.0))
    tool = dataclasses.replace(PEN, weight=0.0, zero=None)
    made = plan(stroke(normal=UP))
    felt = execution.touch(sensor, tool, made, ExecuteSettings(), arm, None)
    assert sensor.asked == min(rate, 100.0)
    assert felt.pressing is None
    assert arm.clock.now() == pytest.approx(100.5)
    np.testing.assert_allclose(felt.compensate.tool.zero, [1.0, 0, 2.0, 0, 0, 0], atol=1e-12)
    np.testing.assert_allclose(
        felt.feel(RobotState(0.0, START, PEN_DOWN, "ready"), arm.clock.now()), 0.0, atol=1e-9
    )


def test_the_coupling_is_that_of_the_settings_and_tells_its_events():
    arm, said = ready(), []
    sensor = Started(arm.clock)
    settings = ExecuteSettings(
        force_setpoint=3.0, normal_from_force=True, normal_angle=0.3, normal_rate=0.4
    )
    made = plan(stroke(normal=UP))
    tool = dataclasses.replace(PEN, weight=0.0, zero=np.zeros(6))
    policy, filter_ = ContactPolicy(3.0), fast_filter(4.0, 0.02)
    felt = execution.touch(sensor, tool, made, settings, arm, filter_, 1.0, policy, said.append)
    pressing = felt.pressing
    assert pressing.supervisor.policy is policy
    assert pressing.sense._policy == NormalPolicy(True, 0.3, 0.4)
    assert pressing.wanted(10.0) == 3.0
    pressing.supervisor.leaves(1.0)
    assert [event.state for event in said] == ["retreating"]
    sensor.seq = 0
    assert execution.touch(sensor, tool, made, settings, arm, filter_).pressing is None
    # A known zero is checked where asked, against what the sensor reads.
    loaded = Started(arm.clock, lambda t: np.array([0.0, 0.0, 1.1, 0.0, 0.0, 0.0]))
    execution.touch(loaded, tool, made, settings, arm, None, 1.2)
    loaded.seq = 0
    with pytest.raises(RefusedError, match="over 1 N"):
        execution.touch(loaded, tool, made, settings, arm, None, 1.0)


def pressed_like(**found):
    whole = {
        "mean": 4.0,
        "least": 1.0,
        "largest": 6.0,
        "rms_error": 0.5,
        "share": 0.75,
        "saturated": 0.0,
    } | found
    supervisor = SimpleNamespace(events=[], noise=0.05)
    facts = {"contact": whole}
    return SimpleNamespace(facts=lambda: facts, supervisor=supervisor, wall=None)


def test_how_hard_it_pressed_is_said_in_one_line():
    assert execution.pressed(SimpleNamespace(facts=dict)) == "no stroke was drawn under force"
    assert execution.pressed(pressed_like()) == (
        "force along the normal 4.00 N in the mean, 1.00 to 6.00 N, RMS error 0.50 N; no contact "
        "on 25 % of the stroke"
    )
    more = pressed_like(landing_peak=5.5, stiffness=2.0, delay=0.06, saturated=0.125)
    more.wall = "9 N"
    more.supervisor.events = [
        ContactEvent(0.5, "drawing"),
        ContactEvent(1.25, "oscillating"),
    ]
    assert execution.pressed(more).split("; ")[2:] == [
        "landed with 5.50 N at the most, on 2 N/mm behind 0.06 s",
        "ended by a wall: 9 N",
        "at its limits on 12 % of the stroke",
        "the force swung, and the gains were softened",
        "contact: drawing at 0.50 s, oscillating at 1.25 s",
    ]
    for drift, told in ((0.16, True), (0.14, False)):
        said = execution.pressed(pressed_like(zero_drift=drift))
        assert (f"zero has moved by {drift:.2f} N" in said) is told
    leans = pressed_like(
        normal_angle={"mean": np.radians(2.0), "p95": np.radians(3.5)}, friction=0.3
    )
    assert execution.pressed(leans).split("; ")[2] == (
        "the surface leans from the planned normal by 2.0° in the mean, 3.5° (95 %), friction 0.30"
    )


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
