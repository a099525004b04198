"""The checks of an arm's joints before it moves: rows of the verdict, and where they begin."""

import dataclasses

import numpy as np
import pytest

from dmpcli.control import execution, preflight_table
from dmpcli.control.execution_plan import CheckedPlan
from dmpcli.errors import InputError, RefusedError
from dmpcli.instruments.clock import SimulatedClock
from dmpcli.instruments.protocols import RobotState
from dmpcli.kinematics import chain, inverse, models
from dmpcli.kinematics.reachability import Reach
from dmpcli.planning import preflight
from dmpcli.settings.execute import ExecuteSettings
from dmpcli.simulation.mock import Lab, MockServo
from dmpcli.spatial.trajectory import StrokeTrajectory
from tests.control.streaming_fakes import PEN_DOWN, START, WIDE, plan, refuse_any, stroke

EC66 = models.model("ec66")
REACH = Reach(EC66)


def shifted(source, by):
    return dataclasses.replace(source, position=source.position + np.array(by, dtype=float))


def standing(position, joints=None):
    return RobotState(0.0, position, PEN_DOWN, "ready", joints)


def test_the_papers_stroke_is_within_an_ec66s_joints():
    source = stroke()
    made = plan(source)
    checks, after = preflight.by_joints(made, source, REACH, None)
    assert [c.unit for c in checks] == ["mm", "°", "°/s"]
    assert all(c.passed for c in checks)
    assert checks[2].limit in (150, 190, pytest.approx(260))
    at = chain.forward(EC66, after)
    position, rotation = at.position, at.rotation
    assert position == pytest.approx(made.position[-1], abs=1e-9)
    assert rotation == pytest.approx(made.rotation[-1], abs=1e-12)


def test_a_pose_out_of_reach_is_one_row_with_its_distance_and_place():
    source = shifted(stroke(first_row=5), [-450, 0, 0])
    [check], after = preflight.by_joints(plan(source), source, REACH, None)
    assert after is None
    assert not check.passed
    assert check.quantity == "distance out of the arm's reach"
    worst = inverse.solve(EC66, source.position, PEN_DOWN[None])[1].min(axis=1)
    assert check.value == pytest.approx(worst.max(), rel=1e-6)
    assert check.row == 5 + int(worst.argmax())
    with pytest.raises(RefusedError, match=r"^distance out .* mm at t = .*\(row \d+\) is over"):
        refuse_any([check])


def test_too_fast_a_joint_is_named_and_the_advised_speed_passes():
    source = stroke(duration=0.12)
    checks, _ = preflight.by_joints(plan(source, approach=2000), source, REACH, None)
    fast = checks[2]
    assert not fast.passed
    assert fast.quantity.startswith("speed of joint ")
    factor = float(fast.remedy.split(" times")[0].split()[-1])
    slower, _ = preflight.by_joints(plan(source, speed=factor), source, REACH, None)
    assert slower[2].passed


def test_a_jump_is_not_said_to_be_mended_by_a_lower_speed():
    source = stroke()
    turned = np.where(np.arange(len(source.t))[:, None, None] < 200, PEN_DOWN, PEN_DOWN @ _turn(2))
    made = dataclasses.replace(plan(source), rotation=turned)
    checks, _ = preflight.by_joints(made, source, REACH, None)
    assert not checks[2].passed
    assert "no --speed helps" in checks[2].remedy


def _turn(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def test_the_arm_begins_where_its_joints_are():
    source = stroke()
    made = plan(source)
    for first in inverse.solve(EC66, source.position[0], PEN_DOWN)[0]:
        if np.isnan(first).any():
            continue
        first[5] += 2 * np.pi * (first[5] < 0)  # another turn than the best one, sometimes
        _, after = preflight.by_joints(made, source, REACH, first)
        assert np.abs(after - first).max() < np.pi


def test_a_joint_near_its_limit_where_the_arm_stands_is_refused_though_another_turn_would_do():
    source = stroke(turn=1.5)
    first = inverse.solve(EC66, source.position[0], source.rotation[0])[0][0]
    end = 0.2  # rad before the limit, on the side that the stroke turns to
    _, after = preflight.by_joints(plan(source), source, REACH, first)
    side = np.sign(after[5] - first[5])
    near = first.copy()
    near[5] = side * (2 * np.pi - end)
    turned = source.rotation @ _about_flange(near[5] - first[5])
    held = dataclasses.replace(source, rotation=turned)
    checks, _ = preflight.by_joints(plan(held), held, REACH, near)
    assert [c.passed for c in checks] == [True, False, True]
    assert checks[1].quantity == "joint 6 from the middle of its range"
    assert checks[1].limit == pytest.approx(360)
    assert all(c.passed for c in preflight.by_joints(plan(held), held, REACH, None)[0])


def _about_flange(angle):
    return _turn(angle)


def test_prepare_adds_the_joints_rows_and_the_table_shows_them():
    source, settings = stroke(), ExecuteSettings()
    state = standing(source.position[0])
    bare = execution.prepare(source, settings, state)[1]
    made, checks = execution.prepare(source, settings, state, REACH)
    assert len(checks) == len(bare) + 3
    text = preflight_table.table([CheckedPlan(made, checks)])
    assert "distance out of the arm's reach" in text
    assert "°/s" in text
    assert text.endswith("may be executed")


def test_a_robot_whose_joints_do_not_fit_the_model_is_refused():
    source = stroke()
    state = standing(source.position[0], np.zeros(6))
    with pytest.raises(RefusedError, match="where an ec66 with this tool has it"):
        execution.prepare(source, ExecuteSettings(), state, REACH)


def test_the_model_that_is_named_is_taken_where_the_robot_tells_none():
    robot = MockServo(Lab(SimulatedClock()))
    assert execution.reach_of(robot, None, None) is None
    assert execution.reach_of(robot, "ec66", None).arm is EC66
    with pytest.raises(InputError, match="not known"):
        execution.reach_of(robot, "ec67", None)


def test_a_stroke_without_orientation_is_judged_as_the_arm_holds_it():
    source = stroke(rotated=False)
    upside_down = StrokeTrajectory(source.t, source.position, id=source.id)
    made, checks = execution.prepare(
        upside_down, ExecuteSettings(), standing(source.position[0]), REACH
    )
    assert all(c.passed for c in checks)
    assert pytest.approx(made.position[0]) == START
    assert WIDE.speed == ExecuteSettings().max_speed
