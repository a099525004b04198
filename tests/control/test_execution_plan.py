"""Messages and facts of a run of many strokes stay short however many there are."""

import dataclasses
import itertools

import numpy as np
import pytest

from dmpcli.control import execution_plan
from dmpcli.control.cycle import ReadyArm
from dmpcli.control.execution_plan import CheckedPlan
from dmpcli.errors import InputError, RefusedError
from dmpcli.kinematics import models
from dmpcli.kinematics.reachability import Reach
from dmpcli.planning.preflight import Check
from dmpcli.planning.transfers import TransferOptions
from dmpcli.records.stroke_selection import StrokeSelection
from dmpcli.settings.execute import ExecuteSettings
from dmpcli.spatial.trajectory import StrokeTrajectory
from tests.control.streaming_fakes import START, FakeClock, FakeServo, plan, stroke


def batch(*names, folder=True):
    t, position = np.arange(3.0), np.zeros((3, 3))
    found = [
        StrokeTrajectory(t, position, id=name, facts={"tau": 2.0, "start": [0, 0, 0]})
        for name in names
    ]
    return StrokeSelection(tuple(found), {}, (), folder)


def test_what_is_left_is_named_as_the_options_that_draw_it():
    said = execution_plan.rest_of(batch("a", "b", "c"), ["b"])
    assert said == "1 of 3 strokes are drawn; the rest: --id a --id c"


def test_of_a_thousand_that_are_left_a_few_are_named():
    names = [str(i) for i in range(1000)]
    said = execution_plan.rest_of(batch(*names), names[:3])
    assert said.startswith("3 of 1000 strokes are drawn; the rest: --id 3 --id 4 ")
    assert said.endswith("and 989 more, which inspect lists")
    assert len(said) < 160


@pytest.mark.slow
def test_of_a_thousand_that_fail_a_few_are_named():
    bad = Check("speed", 9.0, 1.0, "mm/s", 0.5, 7, "slow it down")
    judged = [CheckedPlan(plan(), [bad]) for _ in range(1000)]
    with pytest.raises(RefusedError, match=r"^stroke 0: speed 9 .*1000 of 1000 strokes fail") as e:
        execution_plan.refuse_any(judged)
    assert str(e.value).endswith("0, 0, 0, 0, 0 and 995 more")


def test_the_others_that_fail_are_named_beside_the_first():
    bad = Check("speed", 9.0, 1.0, "mm/s", 0.5, 7, "slow it down")
    of = {name: dataclasses.replace(plan(), id=name) for name in "abcd"}
    judged = [CheckedPlan(of[name], [bad] if name in "bd" else []) for name in "abcd"]
    with pytest.raises(RefusedError, match=r"^stroke b: speed 9 .*; 2 of 4 strokes fail: b, d$"):
        execution_plan.refuse_any(judged)
    with pytest.raises(RefusedError) as alone:
        execution_plan.refuse_any(judged[:3])
    assert "strokes fail" not in str(alone.value)
    execution_plan.refuse_any([judged[0], judged[2]])


def test_one_stroke_of_a_file_is_not_lifted_but_for_a_clearance():
    plain, lifted = ExecuteSettings(), ExecuteSettings(clearance=5.0)
    assert not execution_plan.lifts(batch("a", folder=False), plain)
    assert execution_plan.lifts(batch("a", folder=False), lifted)
    assert execution_plan.lifts(batch("a", "b", folder=False), plain)
    assert execution_plan.lifts(batch("a"), plain)


def prepared(strokes, position=START, **options):
    clock = FakeClock()
    servo = FakeServo(clock, position=position)
    done = []
    found = execution_plan.prepare(
        StrokeSelection(tuple(strokes), {}, (), len(strokes) > 1),
        ExecuteSettings(**options),
        ReadyArm(servo, servo.info, clock),
        False,
        done.append,
    )
    return found, done


def test_a_single_stroke_is_drawn_from_where_the_arm_stands_and_ends_on_the_work():
    [one], _ = prepared([stroke()])
    assert one.failure is None
    assert [phase for phase, _ in one.plan.legs] == ["stroke"]
    [told], _ = prepared([stroke()], START + [0.0, 0.0, 30.0])
    assert told.failure.quantity == "distance from the arm to the start"
    # Asked to come, it comes through the air, from above.
    [led], done = prepared([stroke()], START + [0.0, 40.0, 30.0], approach=20.0)
    assert led.failure is None
    assert led.plan.position[: led.plan.lead, 2].min() >= START[2] - 1e-9
    assert led.plan.legs[-1][0] == "stroke"
    assert done == [1]


def test_each_of_several_strokes_is_planned_from_where_the_one_before_it_ended():
    checked, done = prepared([stroke(), stroke(), stroke()], clearance=15.0)
    assert done == [1, 1, 1]
    assert [one.failure for one in checked] == [None] * 3
    for before, after in itertools.pairwise(checked):
        assert after.plan.position[0] == pytest.approx(before.plan.position[-1], abs=1e-9)
    for one in checked:
        assert one.plan.position[-1, 2] == pytest.approx(START[2] + 15.0)
        assert one.plan.legs[-1][0] == "retract"


def test_the_set_points_wait_for_the_look_ahead():
    between = execution_plan.ways(ExecuteSettings(), 0.15, presses=False)
    assert (between.settling, between.clearance, between.spare) == (8, 20.0, 0.0)
    assert execution_plan.ways(ExecuteSettings(), 0.0, presses=True).spare == 15.0
    with pytest.raises(InputError, match="--clearance 5: must be over 5 mm"):
        execution_plan.ways(ExecuteSettings(clearance=5.0, coupling_clamp=5.0), 0.0, presses=True)


def test_the_facts_hold_each_strokes_own_ends_once():
    facts = execution_plan.facts_of(batch("a", "b"))
    assert facts["trajectory"] == {"tau": 2.0}
    assert facts["strokes"][1] == {"id": "b", "start": [0, 0, 0]}


def test_a_stroke_that_is_asked_to_wait_forever_names_the_option():
    with pytest.raises(InputError, match="raise --speed"):
        plan(stroke(), speed=1e-3, period=0.002)


def test_what_the_first_stroke_says_of_all_is_told_once():
    one, two = batch("a", "b").strokes
    two = dataclasses.replace(two, facts={"tau": 9.0, "goal": [1, 2, 3], "normal": None})
    facts = execution_plan.facts_of(StrokeSelection((one, two), {"x": "too long"}, (), True))
    assert facts == {
        "trajectory": {"tau": 2.0},
        "strokes": [{"id": "a", "start": [0, 0, 0]}, {"id": "b", "goal": [1, 2, 3]}],
        "failed": ["x"],
    }


def test_what_was_passed_over_is_named():
    assert execution_plan.passed_over({"a": "too long"}) == (
        "pair a has no trajectory and is not drawn: too long"
    )
    assert execution_plan.passed_over({"a": "too long", "b": "off"}) == (
        "2 pairs have no trajectory and are not drawn: a, b; the first: too long"
    )


def test_when_all_is_drawn_it_is_said():
    assert execution_plan.rest_of(batch("a"), ["a"]) == "the stroke is drawn"
    assert execution_plan.rest_of(batch("a", "b"), ["a", "b"]) == "all 2 strokes are drawn"
    nine = [str(i) for i in range(9)]
    assert "more" not in execution_plan.rest_of(batch(*nine), nine[:1])
    assert "and 1 more" in execution_plan.rest_of(batch(*nine), [])


def test_ways_go_by_each_setting_as_it_is_set():
    settings = ExecuteSettings(
        clearance=17.0,
        transfer_speed=90.0,
        retract_speed=40.0,
        lead_speed=15.0,
        coupling_clamp=9.0,
        period=0.05,
    )
    made = execution_plan.ways(settings, 0.2, presses=True)
    assert made == TransferOptions(17.0, 90.0, 40.0, 15.0, 4, 9.0)
    assert execution_plan.ways(settings, 0.21, presses=False) == (
        TransferOptions(17.0, 90.0, 40.0, 15.0, 5, 0.0)
    )


def test_where_the_arm_stands_is_judged_for_the_first_stroke_alone():
    away = START + [0.0, 3.0, 0.0]
    found, _ = prepared([stroke(), stroke()], away)
    assert [one.failure is None for one in found] == [False, True]
    assert "over the work with --approach" in found[0].failure.remedy
    assert sum("from the arm" in check.quantity for check in found[1].checks) == 0
    led, _ = prepared([stroke(), stroke()], away, approach=20.0)
    assert [one.failure for one in led] == [None, None]
    [one], _ = prepared([stroke()], away)
    assert "straight there with --approach" in one.failure.remedy


def test_an_arm_that_is_not_ready_is_refused_before_anything_is_planned():
    clock = FakeClock()
    servo = FakeServo(clock)
    servo.mode = "fault"
    selected = StrokeSelection((stroke(),), {}, (), True)
    with pytest.raises(RefusedError, match="robot: fault"):
        execution_plan.prepare(
            selected, ExecuteSettings(), ReadyArm(servo, servo.info, clock), False, lambda _: None
        )


def test_the_joints_of_a_stroke_go_on_from_those_of_the_one_before():
    reach = Reach(models.model("ec66"))
    clock = FakeClock()
    servo = FakeServo(clock)
    many = (stroke(4.0),) * 2
    judged = execution_plan.prepare(
        StrokeSelection(many, {}, (), False), ExecuteSettings(), ReadyArm(servo, servo.info, clock),
        False, lambda _: None, reach,
    )  # fmt: skip
    whole = np.concatenate([one.plan.position for one in judged])
    turned = np.concatenate([one.plan.rotation for one in judged])
    q = reach.follow(whole[None], turned[None], 0.02)
    for one in judged:
        assert [c.passed for c in one.checks if "joint" in c.quantity] == [True, True]
    speeds = [c.value for one in judged for c in one.checks if "speed of joint" in c.quantity]
    assert max(speeds) == pytest.approx(np.degrees(q.speed.value[0]), rel=1e-6)
