"""A plan whose goal moves: what waits with it, and each limit met to the last bit."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dmpcli.dmp.goal_step import GoalFilter, response, settling
from dmpcli.kinematics.models import model
from dmpcli.kinematics.reachability import Reach
from dmpcli.planning import goal_course
from dmpcli.planning.plan import joined, sample, straight
from dmpcli.spatial.output_events import OutputEvent
from dmpcli.spatial.pose import Pose
from tests.control.streaming_fakes import PEN_DOWN, START, WIDE, plan, stroke

PERIOD = 0.02
FILTER = GoalFilter(100.0, 20.0, 2.0, PERIOD)
UP = (0.0, 0.0, 1.0)
HUGE = dataclasses.replace(WIDE, speed=1e9, acceleration=1e12, jerk=1e15)


def whole(duration=4.0):
    """A stroke with normals, forces and outputs, a way to it and one off it."""
    source = stroke(duration=duration, turn=0.3, normal=UP)
    force = 2.0 + np.sin(np.arange(len(source.t)))
    events = (OutputEvent(1.0, "DO1", on=True), OutputEvent(duration, "DO1", on=False))
    source = sample(dataclasses.replace(source, force=force, events=events), PERIOD, 1.0, PEN_DOWN)
    rise = np.array([0.0, 0.0, 20.0])
    end = Pose(source.position[-1] + rise, source.rotation[-1])
    begin = Pose(source.position[0] + rise, source.rotation[0])
    onto = straight("approach", begin, source.pose(0), PERIOD, WIDE, 50.0)
    off = straight("retract", source.pose(-1), end, PERIOD, WIDE, 50.0)
    return joined(source, [onto], [off], PERIOD, True)


BASE = whole()
FIRST = goal_course.first(BASE)


@settings(max_examples=8)
@given(st.integers(0, BASE.last - 1), st.floats(-20.0, 20.0), st.floats(-20.0, 20.0))
def test_all_that_a_plan_says_waits_at_the_strokes_end_until_the_goal_is_reached(start, x, y):
    shift = np.array([x, y, 0.0])
    made = goal_course.moved(BASE, FIRST, FILTER, shift, start)
    plan, more = made.plan, made.plan.last - BASE.last
    assert len(plan) == len(BASE) + more
    begun = max(start, 0)
    left = max(settling(FILTER, np.zeros((2, 3)), shift, goal_course.SETTLED), 1)
    assert plan.last == max(begun + left, BASE.last)
    for name in ("t", "position", "rotation", "normal", "force"):
        own, there = getattr(BASE, name), getattr(plan, name)
        assert len(there) == len(plan)
        if name == "position":
            continue
        np.testing.assert_array_equal(there[: BASE.last + 1], own[: BASE.last + 1])
        np.testing.assert_array_equal(
            there[BASE.last : plan.last + 1], np.repeat(own[BASE.last : BASE.last + 1], more + 1, 0)
        )
        np.testing.assert_array_equal(there[plan.last + 1 :], own[BASE.last + 1 :])
    assert plan.legs[:2] == BASE.legs[:2]
    assert plan.legs[2] == ("retract", plan.last + 1)
    assert [at for at, _ in plan.events] == [BASE.lead + 50.0, float(plan.last)]
    np.testing.assert_array_equal(plan.position[: begun + 1], BASE.position[: begun + 1])
    np.testing.assert_array_equal(made.goal, BASE.position[BASE.last] + shift)
    added = response(FILTER, np.zeros((2, 3)), shift, plan.last - begun)
    held = np.concatenate(
        [
            BASE.position[: BASE.last + 1],
            np.repeat(BASE.position[BASE.last : BASE.last + 1], more, 0),
        ]
    )
    np.testing.assert_allclose(
        plan.position[begun + 1 : plan.last], (held[begun + 1 :] + added[:, 0])[:-1], atol=1e-12
    )
    np.testing.assert_allclose(
        plan.position[plan.last + 1 :], BASE.position[BASE.last + 1 :] + shift, atol=1e-12
    )
    assert (made.start, made.states.shape) == (start, (len(plan), 2, 3))
    np.testing.assert_array_equal(made.states[: begun + 1], 0.0)
    np.testing.assert_array_equal(
        made.states[plan.last :],
        np.broadcast_to([shift, np.zeros(3)], (len(plan) - plan.last, 2, 3)),
    )


def test_a_goal_that_moves_again_goes_on_from_where_the_first_has_led():
    one = goal_course.moved(BASE, FIRST, FILTER, np.array([8.0, 0.0, 0.0]), 60)
    two = goal_course.moved(BASE, one, FILTER, np.array([-4.0, 6.0, 0.0]), 70)
    np.testing.assert_array_equal(two.plan.position[:71], one.plan.position[:71])
    after = response(FILTER, one.states[70], np.array([-4.0, 6.0, 0.0]), 5)
    np.testing.assert_allclose(two.states[71:76], after, atol=1e-12)
    np.testing.assert_allclose(two.plan.position[71:76], BASE.position[71:76] + after[:, 0])


@pytest.mark.parametrize("spare", [0, -1])
def test_it_may_be_drawn_out_for_so_long_and_no_set_point_longer(spare, monkeypatch):
    shift, start = np.array([5.0, 0.0, 0.0]), BASE.last - 3
    more = start + settling(FILTER, np.zeros((2, 3)), shift, goal_course.SETTLED) - BASE.last
    monkeypatch.setattr(goal_course, "LONGEST_AFTER", (more + spare) * PERIOD + 1e-9)
    made = goal_course.moved(BASE, FIRST, FILTER, shift, start)
    assert (made is None) == (spare < 0)


def test_judging_takes_as_many_cycles_as_there_are_slices_to_the_end_and_beyond():
    """What a goal of a metre may draw it out by, ln(1e5) of two slowest times, counts too."""
    beyond = np.log(1e5) * 2.0 * FILTER.slowest / PERIOD
    assert FILTER.slowest == pytest.approx(0.2)
    for index in (0.0, 40.5, len(BASE) - 20.0, len(BASE) - 1.0):
        wanted = 1 + int((len(BASE) - index + beyond) / 250.0)
        assert goal_course.slices(FIRST, index, FILTER) == wanted
    assert goal_course.slices(FIRST, len(BASE) - 1.0, FILTER) == 1


def broken(name, most):
    """What is said of a course that is judged against one limit."""
    made = goal_course.moved(BASE, FIRST, FILTER, np.array([10.0, -6.0, 0.0]), 100)
    limits = dataclasses.replace(HUGE, **{name: most})
    found = list(goal_course.judged(made, FIRST, limits, None))
    assert len(found) == 1
    return found[0]


@pytest.mark.parametrize(("order", "name"), [(1, "speed"), (2, "acceleration"), (3, "jerk")])
def test_a_limit_that_is_met_exactly_is_kept_and_one_that_is_missed_by_a_rounding_too(order, name):
    """The part in 1e9 that is let pass is met to the last bit."""
    made = goal_course.moved(BASE, FIRST, FILTER, np.array([10.0, -6.0, 0.0]), 100)
    position = made.plan.position[98:]
    rates = np.diff(position, axis=0) / PERIOD
    for _ in range(order - 1):
        rates = np.diff(np.pad(rates, ((0, 1), (0, 0))), axis=0) / PERIOD
    size = float(np.sqrt(np.vecdot(rates, rates).max()))
    most = size / (1.0 + 1e-9)
    near = [most]
    for _ in range(3):
        near = [np.nextafter(near[0], 0.0), *near, np.nextafter(near[-1], np.inf)]
    exact = [float(m) for m in near if m * (1.0 + 1e-9) == size]
    assert exact
    for met in exact:
        assert not isinstance(broken(name, met), str)
    assert not isinstance(broken(name, size), str)
    assert broken(name, size * (1.0 - 3e-9)).startswith(f"{name} ")
    assert ", over " in broken(name, 0.5 * size)


def test_a_step_where_a_course_leaves_the_one_before_is_seen_from_the_first_set_point_on():
    """From set-point 0 too, before which the arm stands there."""
    made = goal_course.moved(BASE, FIRST, FILTER, np.array([10.0, 0.0, 0.0]), 0)
    assert made is not None
    position = made.plan.position.copy()
    position[1:] += [0.5, 0.0, 0.0]
    jumped = dataclasses.replace(made, plan=dataclasses.replace(made.plan, position=position))
    [found] = goal_course.judged(
        jumped, FIRST, dataclasses.replace(HUGE, acceleration=1000.0), None
    )
    first = np.linalg.norm(position[1] - position[0]) / PERIOD**2  # from rest
    assert first > 1250.0
    assert found == f"acceleration {first:.4g} mm/s², over 1000 mm/s²"
    # What lies before the set-point that a course leaves from was judged with the course before.
    late = dataclasses.replace(jumped, start=20)
    [found] = goal_course.judged(late, FIRST, dataclasses.replace(HUGE, acceleration=1000.0), None)
    assert found is late


def test_the_border_of_the_workspace_belongs_to_it():
    made = goal_course.moved(BASE, FIRST, FILTER, np.array([10.0, 0.0, 0.0]), 100)
    low, high = made.plan.position.min(axis=0), made.plan.position.max(axis=0)
    box = np.column_stack([low, high]).ravel()
    [found] = goal_course.judged(made, FIRST, dataclasses.replace(HUGE, workspace=tuple(box)), None)
    assert found is made
    for side, inwards in enumerate((1.0, -1.0) * 3):
        smaller = box.copy()
        smaller[side] += 0.25 * inwards
        limits = dataclasses.replace(HUGE, workspace=tuple(smaller))
        # Only what is new counts: two set-points before the first that differs, and on.
        new = made.plan.position[98:]
        outside = max((smaller[::2] - new).max(), (new - smaller[1::2]).max())
        [found] = goal_course.judged(made, FIRST, limits, None)
        if outside > 0.0:
            assert found == f"{outside:.3g} mm outside the workspace"
        else:
            assert found is made


def test_joints_go_on_from_those_that_are_known_in_slices_that_meet():
    reach = Reach(model("ec66"))
    base = plan(stroke(duration=8.0))
    joints = reach.follow(base.position[None], base.rotation[None], PERIOD).joints[0]
    first = goal_course.first(base, joints)
    made = goal_course.moved(base, first, FILTER, np.array([3.0, 2.0, 0.0]), 17)
    *more, found = goal_course.judged(made, first, WIDE, reach)
    assert more == [""] * ((len(made.plan) - 2 - 17) // goal_course.SLICE)
    assert found.joints.shape == (len(made.plan), 6)
    np.testing.assert_array_equal(found.joints[:18], joints[:18])
    true = reach.follow(made.plan.position[None], made.plan.rotation[None], PERIOD, joints[0])
    np.testing.assert_allclose(found.joints, true.joints[0], atol=1e-9)
    other = dataclasses.replace(first, joints=joints + 2e-3)
    assert list(goal_course.judged(made, other, WIDE, reach)) == [
        "another configuration of the arm's joints"
    ]


def test_a_course_from_the_start_of_a_plan_is_the_plan():
    assert FIRST.plan is BASE
    np.testing.assert_array_equal(FIRST.shift, 0.0)
    np.testing.assert_array_equal(FIRST.goal, BASE.position[BASE.last])
    assert FIRST.states.shape == (len(BASE), 2, 3)
    assert (FIRST.joints, FIRST.start) == (None, 0)
    np.testing.assert_array_equal(FIRST.plan.position[BASE.lead], START)
