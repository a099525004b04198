"""Plans and what is checked of them: results that are kept, see `tests/kept.py`."""

from dataclasses import replace

import numpy as np
import pytest

from dmpcli.dmp.goal_step import GoalFilter
from dmpcli.errors import DmpError
from dmpcli.kinematics import models
from dmpcli.kinematics.reachability import Reach
from dmpcli.planning import deceleration, goal_course, plan, preflight, transfers
from dmpcli.planning.limits import Limits, limits_of
from dmpcli.planning.spline import between, spline, window
from dmpcli.settings.execute import ExecuteSettings
from dmpcli.spatial import rotations
from dmpcli.spatial.pose import Pose
from tests.control.streaming_fakes import PEN_DOWN, START, WIDE, stroke
from tests.kept import Kept

KEPT = Kept(__file__)
LIMITS_OF = (
    *("max_speed", "max_acceleration", "max_jerk"),
    *("max_rotation_speed", "max_rotation_acceleration", "max_rotation_jerk"),
)
TIGHT = Limits(20.0, 30.0, 300.0, 0.1, 0.2, 1.0, (-650.0, -540.0, 100.0, 150.0, -30.0, 0.0))
UP = (0.0, 0.0, 1.0)


def turned(by):
    return rotations.exp(np.array(by)) @ PEN_DOWN


def strokes():
    """Strokes of several rates and durations, with and without orientation, normal and force."""
    made = [stroke(2.0, 40.0, 0.8, normal=UP), stroke(3.0, 73.0, rotated=False), stroke(1.0, 8.0)]
    made.append(replace(made[0], force=2.0 + np.sin(np.arange(len(made[0].t)))))
    made.append(replace(made[1], t=made[1].t ** 1.1, first_row=7))
    return made


def poses():
    return [
        Pose(START, PEN_DOWN),
        Pose(START + [30.0, -40.0, 20.0], turned([0.1, 0.0, 0.4])),
        Pose(START, turned([0.0, 0.2, 0.0])),
    ]


@KEPT.case
def plans_of_strokes():
    found: list = []
    for source in strokes():
        for period, speed in ((0.02, 1.0), (0.008, 0.5), (0.05, 0.25)):
            for start in poses():
                one = plan.make(source, period, speed, WIDE, start, 25.0)
                index = (0.0, 3.4, one.lead + 0.5, len(one) - 1.0)
                found += [
                    one,
                    one.sizes,
                    [(at.position, at.rotation) for at in map(one.at, index)],
                    [one.time_at(i) for i in index],
                    [one.phase_at(i) for i in index],
                    [one.draws_at(i) for i in index],
                ]
                if one.normal is not None:
                    found.append([one.normal_at(i) for i in index])
    return found


@KEPT.case
def straight_ways():
    found: list = [a.apart(b) for a in poses() for b in poses()]
    for limits in (WIDE, TIGHT):
        for speed in (5.0, 60.0):
            for start in poses()[1:]:
                for spare in (0.0, 0.3):
                    way = plan.straight("approach", start, poses()[0], 0.02, limits, speed, spare)
                    found += [way]
    return found


@KEPT.case
def checks_before_the_start():
    found: list = []
    for source in strokes():
        for limits in (WIDE, TIGHT):
            one = plan.make(source, 0.02, 1.0, limits, poses()[1], 25.0)
            for check in (
                *preflight.within_limits(one, source, limits),
                *preflight.at_rest(source, 1.0, 0.02, limits),
            ):
                found += [replace(check, remedy=""), check.passed]
    for d, a in ((0.1, 0.01), (3.0, 0.2)):
        found += [replace(c, remedy="") for c in preflight.near_start(d, a, 0.5, 0.05)]
    return found


@KEPT.case
def checks_of_joints():
    found: list = []
    reach = Reach(models.model("ec66"))
    source = stroke(2.0, 50.0, 0.4)
    for by in ([0, 0, 0], [-450, 0, 0], [100, -80, 60]):
        moved = replace(source, position=source.position + np.array(by, dtype=float))
        one = plan.make(moved, 0.02, 1.0, WIDE, moved.pose(0), 25.0)
        checks, joints = preflight.by_joints(one, moved, reach, None)
        found += [[replace(c, remedy="") for c in checks], joints]
    return found


@KEPT.case
def ways_between_strokes():
    a = stroke(2.0, 50.0, 0.3, normal=UP)
    many = [
        a,
        replace(a, position=a.position + [40.0, 90.0, 5.0]),
        replace(a, position=a.position[::-1].copy() + [0.0, -60.0, 0.0], normal=None),
    ]
    found: list = []
    ways = (
        transfers.TransferOptions(20.0, 100.0, 50.0, 20.0),
        transfers.TransferOptions(8.0, 60.0, 30.0, 10.0, 4, 0.1),
    )
    for one in ways:
        for start, near in ((poses()[0], True), (poses()[1], False)):
            for approach in (None, 15.0):
                made = transfers.plans(many, 0.02, 1.0, WIDE, start, near, one, approach)
                found += [[p.lead, p.last, p.legs, p.id, p.position, p.rotation, p.t] for p in made]
        level = transfers.height(many, PEN_DOWN, one.clearance)
        found += [
            level,
            level.over(START),
            level.over(START, 4.0),
            transfers.height(many[:1], PEN_DOWN, 9.0, (0,)),
        ]
    return [*found, [transfers.off(s, PEN_DOWN, e) for s in many for e in (0, -1)]]


@KEPT.case
def ramps_and_splines():
    found: list = [[deceleration.progress(t, 0.7) for t in (0.0, 0.1, 0.4, 0.9)]]
    found.append(
        [
            deceleration.duration(v, a, 2250.0, j)
            for v in (5.0, 100.0)
            for a in (0.0, 2000.0)
            for j in (1e3, 5e4)
        ]
    )
    t = np.cumsum(1.0 + 0.5 * np.sin(np.arange(30.0)))
    y = np.column_stack([np.sin(t), t**1.5])
    curve = spline(t, y)
    found += [curve, curve(np.linspace(t[0] - 1.0, t[-1] + 1.0, 70))]
    for index in (0.0, 2.25, 28.9):
        near, share = window(index, 30)
        found += [near, share, between(y[near], share)]
    return found


@KEPT.case
def verdicts_in_words():
    found: list = []
    reach = Reach(models.model("ec66"))
    for source in strokes()[:3]:
        for by in ([0.0, 0.0, 0.0], [-350.0, 120.0, 0.0], [500.0, -80.0, 60.0]):
            moved = replace(source, position=source.position + np.array(by))
            start = Pose(moved.position[0] + [0.0, 20.0, 9.0], turned([0.0, 0.0, 0.2]))
            one = plan.make(moved, 0.02, 1.0, WIDE, start, 60.0)
            for limits in (WIDE, TIGHT):
                checks = preflight.within_limits(one, moved, limits)
                checks += preflight.at_rest(moved, 2.0, 0.02, limits)
                found += [[c.t, c.row, c.place, c.remedy] for c in checks]
            found += [[str(c) for c in preflight.by_joints(one, moved, reach, None)[0]]]
    quick = replace(strokes()[0], t=strokes()[0].t / 4.0)
    one = plan.make(quick, 0.004, 1.0, WIDE, poses()[0], 25.0)
    checks, joints = preflight.by_joints(
        one, quick, reach, np.array([0.1, -1.5, 1.4, -1.5, -1.5, 0])
    )
    return [*found, [str(c) for c in checks], joints]


@KEPT.case
def goals_that_move():
    source = stroke(2.0, 50.0, 0.4, normal=UP)
    source = replace(source, force=2.0 + np.sin(np.arange(len(source.t))))
    way = transfers.TransferOptions(8.0, 60.0, 30.0, 10.0, 4)
    [base] = transfers.plans([source], 0.02, 1.0, WIDE, poses()[0], True, way)
    reach = Reach(models.model("ec66"))
    joints = reach.follow(base.position[None], base.rotation[None], 0.02).joints[0]
    filter_ = GoalFilter(100.0, 25.0, 1.0, 0.02)
    course, found = goal_course.first(base, joints), []
    for at, shift in ((10, [4.0, -3.0, 0.0]), (60, [-9.0, 2.0, 0.0]), (97, [30.0, 0.0, 1.0])):
        made = goal_course.moved(base, course, filter_, np.array(shift), at)
        assert made is not None
        found += [made.plan, made.states, made.goal, goal_course.slices(course, at, filter_)]
        for limits in (WIDE, replace(WIDE, workspace=TIGHT.workspace), TIGHT):
            *more, last = goal_course.judged(made, course, limits, reach)
            found += [len(more), last if isinstance(last, str) else last.joints]
        course = last if not isinstance(last, str) else replace(made, joints=None)
    return found


@KEPT.case
def limits_as_they_are_set():
    numbers = dict(zip(LIMITS_OF, range(3, 9), strict=True))
    return [limits_of(ExecuteSettings(**numbers)), limits_of(ExecuteSettings(workspace=(0.0,) * 6))]


@KEPT.case
def what_no_plan_is_made_of():
    a = stroke(2.0, 50.0, 0.3, normal=UP)
    found: list = []
    for change in ({"t": a.t * 1e5}, {"normal": None}, {"rotation": None}, {"force": a.t}):
        for start in poses()[:2]:
            try:
                one = plan.make(replace(a, **change), 0.02, 1.0, WIDE, start, 25.0)
                found += [len(one), one.oriented, one.normal is None, one.force]
            except DmpError as error:
                found.append(type(error).__name__)
    return found


@pytest.mark.slow
@pytest.mark.parametrize("name", KEPT.cases)
def test_results_are_those_that_were_kept(name):
    KEPT.check(name)
