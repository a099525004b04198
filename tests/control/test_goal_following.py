import dataclasses
import signal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dmpcli.control import goal_following
from dmpcli.control.cycle import ReadyArm, StopLimits
from dmpcli.control.goal_following import GoalFollower, GoalOptions, filter_of, plane_of
from dmpcli.control.servo_loop import DONE, ServoLoop
from dmpcli.control.signals import Interruption
from dmpcli.dmp.goal_step import GoalFilter
from dmpcli.errors import InputError, RefusedError
from dmpcli.instruments.goal_sources import BACK, GoalNews, ScheduledGoals
from dmpcli.kinematics.models import model
from dmpcli.kinematics.reachability import Reach
from dmpcli.planning import goal_course
from dmpcli.planning.plan import joined, sample, straight
from dmpcli.spatial.output_events import OutputEvent
from dmpcli.spatial.pose import Pose
from tests.control.streaming_fakes import (
    PEN_DOWN,
    START,
    WIDE,
    FakeClock,
    FakeServo,
    plan,
    rows_of,
    stroke,
)

PERIOD, TAU = 0.02, 2.0
UP = np.array([0.0, 0.0, 1.0])
FILTER = GoalFilter(100.0, 20.0, TAU, PERIOD)
SHORT = plan(stroke(duration=4.0))
GOAL = SHORT.position[-1]


class Run:
    """A stroke of 4 s whose goal moves at given times by given ways from the planned one."""

    def __init__(self, moves, limits=WIDE, reach=None, at=None, made=SHORT, jumps=None):
        self.told = []
        times = np.array([t for t, _ in moves])
        goals = GOAL + np.array([way for _, way in moves], dtype=float).reshape(-1, 3)
        options = GoalOptions(limits, reach, 200.0, self.told.append)
        source = ScheduledGoals("goals.csv", times, goals)
        self.goals = GoalFollower(source, made, FILTER, UP, options)
        clock = FakeClock(PERIOD, jumps)
        self.servo = FakeServo(clock, at=at)
        arm = ReadyArm(self.servo, self.servo.info, clock)
        watch = StopLimits(5.0, 0.1, 50.0, 5.0)
        self.loop = ServoLoop(made, limits, watch, arm, goals=self.goals)
        self.interruption = Interruption()

    def run(self):
        self.outcome = self.loop.run(self.interruption)
        return self

    @property
    def sent(self):
        return np.array([position for position, _ in self.servo.sent])

    @property
    def taken(self):
        return [np.array(one.goal) - GOAL for one in self.goals.taken]

    @property
    def kinds(self):
        return [one.kind for one in self.goals.told]


def rise(count):
    """Unit step response of the critically damped filter after 1 to count periods."""
    x = 20.0 * PERIOD * np.arange(1, count + 1) / (2.0 * TAU)
    return 1.0 - (1.0 + x) * np.exp(-x)


def test_the_stroke_is_the_planned_one_and_the_filters_step_response():
    run = Run([(1.0, (10.0, -6.0, 0.0))]).run()
    sent = run.sent
    assert run.outcome.reason == DONE
    assert run.loop.drawn == ["0"]
    held = np.concatenate([SHORT.position, np.repeat(GOAL[None], len(sent) - len(SHORT), axis=0)])
    added = np.zeros(len(sent))
    added[51:] = rise(len(sent) - 51)
    end = run.loop.plan.last
    np.testing.assert_allclose(
        sent[:end], (held + added[:, None] * [10.0, -6.0, 0.0])[:end], atol=1e-9
    )
    np.testing.assert_array_equal(
        sent[end:], np.broadcast_to(GOAL + [10.0, -6.0, 0.0], (len(sent) - end, 3))
    )
    assert run.loop.duration == pytest.approx(PERIOD * len(run.loop.plan))


def test_a_goal_that_moves_at_the_end_is_run_after_until_it_is_reached():
    run = Run([(3.9, (10.0, 0.0, 0.0))]).run()
    assert run.outcome.reason == DONE
    np.testing.assert_array_equal(run.sent[-1], GOAL + [10.0, 0.0, 0.0])
    late = (run.loop.plan.last - SHORT.last) * PERIOD
    assert 1.5 < late < 2.5  # ten times 2 tau/d


def test_a_goal_that_comes_nearer_asks_less_of_the_arm():
    """Half as far as the stroke leads in the end: it is no arm that has not moved."""
    run = Run([(1.0, (60.0, 0.0, 0.0))]).run()
    assert (run.outcome.reason, run.loop.drawn) == (DONE, ["0"])
    np.testing.assert_allclose(run.sent[-1], GOAL + [60.0, 0.0, 0.0], atol=1e-9)


def test_without_news_the_set_points_are_those_of_the_plan():
    run = Run([(99.0, (1.0, 0.0, 0.0))]).run()
    np.testing.assert_array_equal(run.sent[: len(SHORT)], SHORT.position)
    assert run.goals.said().startswith("no goal was taken")


# Each way from the planned goal: in the plane, now and then out of it, small and huge.
moves = st.lists(
    st.tuples(
        st.floats(0.0, 4.5),
        st.tuples(
            st.floats(-60.0, 60.0), st.floats(-60.0, 60.0), st.sampled_from([0.0, 0.0, 0.3, 9.0])
        ),
    ),
    min_size=1,
    max_size=6,
).map(lambda found: sorted(found, key=lambda one: one[0]))


@pytest.mark.slow
@settings(max_examples=25)
@given(moves)
def test_however_the_goal_jumps_no_limit_breaks_and_the_last_one_taken_is_reached(
    jumps,
):
    run = Run(jumps).run()
    assert run.outcome.failure is None
    assert run.loop.drawn == ["0"]
    rest = np.concatenate([[START, START, START], run.sent, np.repeat(run.sent[-1:], 3, axis=0)])
    for order, most in ((1, WIDE.speed), (2, WIDE.acceleration), (3, WIDE.jerk)):
        size = np.linalg.norm(np.diff(rest, order, axis=0), axis=1).max() / PERIOD**order
        assert size <= most * (1.0 + 1e-6)
    ended = run.taken[-1] if run.taken else np.zeros(3)
    np.testing.assert_allclose(run.sent[-1], GOAL + ended, atol=1e-9)
    assert all(abs(way[2]) < 1e-9 for way in run.taken)


@pytest.mark.parametrize(
    ("way", "kind"),
    [
        ((10.0, 0.0, 0.6), "off the plane"),
        ((10.0, 0.0, -20.0), "off the plane"),
        ((201.0, 0.0, 0.0), "too far"),
        ((150.0, 0.0, 0.0), "over a limit"),
    ],
)
def test_a_goal_that_must_not_be_is_refused_told_and_the_last_one_reached(way, kind):
    run = Run([(0.5, (5.0, 0.0, 0.0)), (1.0, way)]).run()
    assert run.outcome.reason == DONE
    assert run.kinds == [kind]
    assert f": {kind}" in run.told[0]
    np.testing.assert_allclose(run.sent[-1], GOAL + [5.0, 0.0, 0.0], atol=1e-9)
    assert run.goals.facts()["goals"]["not_taken"] == {kind: 1}


def test_a_goal_beside_the_workspace_is_refused():
    low, high = SHORT.position.min(axis=0) - 1.0, SHORT.position.max(axis=0) + 1.0
    box = tuple(np.column_stack([low, high]).ravel().tolist())
    limits = dataclasses.replace(WIDE, workspace=box)
    run = Run([(0.5, (-3.0, 0.0, 0.0))], limits).run()
    assert run.kinds == ["over a limit"]
    assert "2 mm outside the workspace" in run.told[0]
    np.testing.assert_array_equal(run.sent[-1], GOAL)


def test_what_comes_at_once_is_the_last_of_it_and_the_same_goal_again_is_none():
    both = Run([(0.5, (5.0, 0.0, 0.0)), (0.5, (9.0, 0.0, 0.0))]).run()
    assert len(both.taken) == 1
    np.testing.assert_allclose(both.sent[-1], GOAL + [9.0, 0.0, 0.0], atol=1e-9)
    again = Run([(0.5, (5.0, 0.0, 0.0)), (1.0, (5.0, 0.0, 0.0)), (2.0, (5.0, 0.0, 0.2))]).run()
    assert len(again.taken) == 1
    assert again.kinds == []


def test_a_goal_that_comes_at_the_end_is_too_late_unless_the_stroke_goes_on():
    late = Run([(4.0, (5.0, 0.0, 0.0))]).run()
    assert (late.outcome.reason, late.kinds) == (DONE, ["too late"])
    np.testing.assert_array_equal(late.sent[-1], GOAL)
    on = Run([(3.98, (5.0, 0.0, 0.0)), (4.0, (6.0, 0.0, 0.0))]).run()
    assert len(on.taken) == 2
    np.testing.assert_array_equal(on.sent[-1], GOAL + [6.0, 0.0, 0.0])


def test_a_signal_brings_the_arm_to_rest_on_the_moved_path_and_no_goal_moves_it_then():
    run = Run([(0.5, (8.0, 0.0, 0.0)), (1.1, (-8.0, 0.0, 0.0))])
    run.servo.at[52] = lambda _: run.interruption.receive(signal.SIGINT)
    run.run()
    assert run.outcome.signal == signal.SIGINT
    assert len(run.taken) == 1
    step = np.linalg.norm(np.diff(run.sent, axis=0), axis=1)
    assert step[-1] < 0.02
    assert np.abs(np.diff(run.sent, 2, axis=0)).max() / PERIOD**2 < 1.1 * WIDE.acceleration
    path, stop = run.loop.plan.position, run.sent[-1]
    assert np.linalg.norm(path - stop, axis=1).min() < 0.5 * step.max()


def test_the_joints_of_a_course_are_judged_some_in_each_cycle(monkeypatch):
    monkeypatch.setattr(goal_course, "SLICE", 80)
    reach = Reach(model("ec66"))
    run = Run([(0.5, (4.0, 0.0, 0.0)), (2.0, (4.0, 160.0, 0.0))], reach=reach).run()
    assert [way.round(9).tolist() for way in run.taken] == [[4.0, 0.0, 0.0]]
    assert run.goals.taken[0].t > 0.5 + 1e-9  # there is more than one slice to it
    joints = run.goals.course.joints
    true = reach.follow(run.loop.plan.position[None], run.loop.plan.rotation[None], PERIOD).joints
    np.testing.assert_allclose(joints, true[0], atol=1e-7)


def test_a_course_out_of_reach_is_refused():
    reach = Reach(model("ec66"))
    followed = reach.follow(SHORT.position[None], SHORT.rotation[None], PERIOD)
    base = goal_course.first(SHORT, followed.joints[0])
    slow = GoalFilter(100.0, 20.0, 8.0, PERIOD)
    far = goal_course.moved(SHORT, base, slow, np.array([-900.0, 0.0, 0.0]), 10)
    assert far is not None
    quick = dataclasses.replace(WIDE, speed=1e4, acceleration=1e6, jerk=1e8)
    *more, last = goal_course.judged(far, base, quick, reach)
    assert isinstance(last, str)
    assert "reach" in last or "joint" in last
    assert set(more) <= {""}


def test_ways_and_outputs_behind_the_stroke_move_with_its_end():
    source = sample(stroke(duration=4.0), PERIOD, 1.0, PEN_DOWN)
    up = source.position[-1] + [0.0, 0.0, 20.0]
    off = straight("retract", source.pose(-1), Pose(up, source.rotation[-1]), PERIOD, WIDE, 50.0)
    events = (OutputEvent(1.0, "DO1", on=True), OutputEvent(4.0, "DO1", on=False))
    base = joined(dataclasses.replace(source, events=events), [], [off], PERIOD, True)
    made = goal_course.moved(base, goal_course.first(base), FILTER, np.array([6.0, 0.0, 0.0]), 150)
    more = made.plan.last - base.last
    assert more > 50
    np.testing.assert_allclose(made.plan.position[made.plan.last], GOAL + [6.0, 0.0, 0.0])
    np.testing.assert_allclose(
        made.plan.position[made.plan.last + 1 :], base.position[base.last + 1 :] + [6.0, 0.0, 0.0]
    )
    assert [at for at, _ in made.plan.events] == [50.0, 200.0 + more]
    assert made.plan.phase_at(made.plan.last) == "stroke"
    assert made.plan.phase_at(made.plan.last + 1) == "retract"


def test_the_log_says_which_goal_is_followed():
    run = Run([(1.0, (10.0, 0.0, 0.0))]).run()
    rows = rows_of(run.loop.log)
    columns = run.loop.log.columns()
    assert len(rows) == len(columns["xg"])
    moved = columns["xg"] - GOAL[0]
    np.testing.assert_allclose(moved[:50], 0.0)
    np.testing.assert_allclose(moved[50:], 10.0)


def test_only_a_plane_has_a_goal_that_moves():
    flat = stroke(normal=(0.0, 0.0, 1.0))
    np.testing.assert_array_equal(plane_of(flat), UP)
    np.testing.assert_array_equal(
        plane_of(dataclasses.replace(stroke(), facts={"normal": [0.0, 0.0, 2.0]})), UP
    )
    bent = stroke(normal=(0.0, 0.0, 1.0))
    lean = np.linspace(0.0, 0.1, len(bent.t))
    normals = np.column_stack([np.sin(lean), 0.0 * lean, np.cos(lean)])
    with pytest.raises(RefusedError, match="curved surface"):
        plane_of(dataclasses.replace(bent, normal=normals))
    with pytest.raises(InputError, match="which plane"):
        plane_of(stroke())
    with pytest.raises(InputError, match="original model"):
        plane_of(dataclasses.replace(flat, facts={"model": "original"}))


@pytest.mark.parametrize(
    ("facts", "said"),
    [
        ({"tau": 5.0}, "does not state"),
        ({"k": [100.0, 90.0, 100.0], "d": [20.0] * 3, "tau": 5.0}, "the same of"),
        ({"k": [0.1] * 3, "d": [20.0] * 3, "tau": 5.0}, "follows its goal within"),
    ],
)
def test_a_file_that_does_not_say_how_it_follows_a_goal_is_refused(facts, said):
    with pytest.raises(InputError, match=said):
        filter_of(facts, 1.0, PERIOD)


def test_a_slower_stroke_follows_its_goal_more_slowly():
    facts = {"k": [100.0] * 6, "d": [20.0] * 6, "tau": 5.0}
    assert filter_of(facts, 0.5, PERIOD).tau == 10.0


def test_a_stroke_that_is_too_long_is_refused(monkeypatch):
    monkeypatch.setattr(goal_following, "LONGEST", 100)
    with pytest.raises(InputError, match="201 set-points"):
        Run([(1.0, (1.0, 0.0, 0.0))])


ON = "; the arm goes on to the last goal that was taken"


class Asked:
    """A source that says what it is told to, and remembers when it was asked."""

    name = "asked"

    def __init__(self, *news):
        self.news, self.asked = list(news), []

    def take(self, now, elapsed):
        self.asked.append((now, elapsed))
        return [self.news.pop(0)] if self.news else []


def followed(*news, made=SHORT, told=None, **options):
    source, said = Asked(*news), []
    limits = options.pop("limits", WIDE)
    known = GoalOptions(limits, tell=said.append, **options)
    return GoalFollower(source, made, FILTER, UP, known), source, said


def test_a_source_is_asked_with_the_time_since_the_strokes_first_set_point():
    made = plan(stroke(duration=4.0), start=Pose(START + [0.0, 9.0, 0.0], PEN_DOWN))
    assert made.lead > 10
    goals, source, _ = followed(made=made)
    for now, index in ((0.0, 0.0), (1.0, made.lead), (7.5, made.lead + 12.5)):
        assert goals.step(now, float(index)) is None
    np.testing.assert_allclose(source.asked, [(0.0, -made.lead * PERIOD), (1.0, 0.0), (7.5, 0.25)])


def test_what_is_not_believed_is_counted_each_time_and_told_once():
    silent = GoalNews(None, "no news", "for 1 s", status=True)
    bad = GoalNews(None, "no number", "nan")
    goals, _, said = followed(bad, silent, bad, bad, GoalNews(None, BACK, "", status=True))
    for k in range(6):
        goals.step(0.1 * k, 10.0 + k)
    facts = goals.facts()["goals"]
    assert facts["not_taken"] == {"no number": 3}
    assert facts["told"] == [
        {"t": 0.0, "what": "no number", "detail": "nan"},
        {"t": 0.1, "what": "no news", "detail": "for 1 s"},
        {"t": 0.4, "what": BACK, "detail": ""},
    ]
    assert said == [
        f"goal from asked at 0.00 s: no number: nan{ON}",
        f"goal from asked at 0.10 s: no news: for 1 s{ON}",
        f"goal from asked at 0.40 s: {BACK}",
    ]
    assert goals.said() == "no goal was taken from asked (3 × no number): drawn as planned"
    assert facts["planned"] == facts["last"] == pytest.approx(GOAL.tolist())


def test_a_goal_that_is_taken_is_told_with_when_and_where():
    goals, _, said = followed(GoalNews(GOAL + [3.0, 0.0, 0.25]), GoalNews(GOAL + [3.0, 4.0, 0.0]))
    made = goals.step(1.0, 50.0)
    assert made is goals.course.plan
    assert goals.step(1.02, 51.0) is not None
    facts = goals.facts()["goals"]
    assert [one["t"] for one in facts["taken"]] == [1.0, 1.02]
    # The part of it off the plane is left out.
    assert facts["taken"][0]["goal"] == pytest.approx((GOAL + [3.0, 0.0, 0.0]).tolist())
    assert facts["last"] == pytest.approx((GOAL + [3.0, 4.0, 0.0]).tolist())
    x, y, z = GOAL + [3.0, 4.0, 0.0]
    assert (
        goals.said() == f"2 goals taken from asked; the last one is ({x:.2f}, {y:.2f}, {z:.2f}) mm"
    )
    assert said == []


@pytest.mark.parametrize(
    ("way", "kind"),
    [
        ([0.0, 0.0, 0.5 - 1e-9], None),
        ([5.0, 0.0, 0.5 - 1e-9], "taken"),
        ([5.0, 0.0, -0.5001], "off the plane"),
        ([30.0, 40.0, 0.0], "taken"),
        ([30.0, 40.001, 0.0], "too far"),
        ([0.9e-6, 0.0, 0.0], None),
        ([1.1e-6, 0.0, 0.0], "taken"),
    ],
)
def test_a_goal_is_taken_up_to_the_limits_of_plane_range_and_sameness(way, kind):
    made = dataclasses.replace(WIDE, speed=1e6, acceleration=1e9, jerk=1e12)
    goals, _, _ = followed(GoalNews(GOAL + way), range=50.0, limits=made)
    goals.step(1.0, 50.0)
    kinds = [one.kind for one in (*goals.taken, *goals.told)]
    assert kinds == ([] if kind is None else [kind])


def test_the_last_set_point_but_one_is_the_last_that_a_goal_may_drive_the_stroke_from():
    for index, kinds in ((SHORT.last - 1, []), (SHORT.last, ["too late"])):
        goals, _, _ = followed(GoalNews(GOAL + [1.0, 0.0, 0.0]))
        goals.step(1.0, float(index))
        assert [one.kind for one in goals.told] == kinds
        assert len(goals.taken) == 1 - len(kinds)
    # On the way to the stroke it drives from the stroke's first set-point on.
    made = plan(stroke(duration=4.0), start=Pose(START + [0.0, 9.0, 0.0], PEN_DOWN))
    goals, _, _ = followed(GoalNews(made.position[-1] + [1.0, 0.0, 0.0]), made=made)
    assert goals.step(0.0, 3.0) is not None
    assert goals.course.start == made.lead


def test_a_course_that_set_points_have_overtaken_is_proposed_anew(monkeypatch):
    goals, _, _ = followed(GoalNews(GOAL + [1.0, 0.0, 0.0]))
    judge = goal_course.judged

    def slow(*given):
        yield from ("", "")
        yield from judge(*given)

    monkeypatch.setattr(goal_course, "judged", slow)
    for index in (50.0, 51.0, 52.0):
        assert goals.step(1.0 + 0.02 * index, index) is None
    assert goals.taken == []
    monkeypatch.undo()
    assert goals.step(2.06, 53.0) is not None
    assert goals.course.start == 53


def test_joints_that_are_told_before_the_start_are_where_the_judging_begins():
    reach = Reach(model("ec66"))
    goals, _, _ = followed(reach=reach)
    own = goals.course.joints
    q = own[0] + [0.0, 0.0, 0.0, 0.0, 0.0, 2.0 * np.pi]
    goals.begin(q)
    np.testing.assert_allclose(goals.course.joints[0], q, atol=1e-6)
    before = goals.course
    goals.begin(None)
    goals.begin(np.zeros(7))
    assert goals.course is before
    plain, _, _ = followed()
    plain.begin(q)
    assert plain.course.joints is None
    assert (GoalOptions(WIDE).range, GoalOptions(WIDE).reach) == (200.0, None)


def test_normals_that_differ_by_a_rounding_are_one_plane():
    flat = stroke(normal=(0.0, 0.0, 1.0))
    for lean, fits in ((0.99e-4, True), (1.01e-4, False)):
        normal = flat.normal.copy()
        normal[7] = [lean, 0.0, 1.0]
        bent = dataclasses.replace(flat, normal=normal)
        if fits:
            np.testing.assert_array_equal(plane_of(bent), UP)
        else:
            with pytest.raises(RefusedError):
                plane_of(bent)
    said = dataclasses.replace(stroke(), facts={"normal": [0.0, 3.0, 4.0]})
    np.testing.assert_allclose(plane_of(said), [0.0, 0.6, 0.8])


def test_what_drives_a_stroke_is_what_its_file_states():
    facts = {"k": [90.0, 90.0, 90.0, 1.0], "d": [18.0, 18.0, 18.0, 2.0], "tau": 3.0}
    made = filter_of(facts, 2.0, 0.01)
    assert made == GoalFilter(90.0, 18.0, 1.5, 0.01)
    for bad in ({"k": [0.0] * 3}, {"d": [0.0] * 3}, {"tau": 0.0}, {"d": [18.0, 18.0, 17.0]}):
        with pytest.raises(InputError, match="must be positive, and the same"):
            filter_of(facts | bad, 1.0, PERIOD)
    for bad in ({"k": []}, {"tau": "x"}, {"k": 5.0}):
        with pytest.raises(InputError, match="does not state k, d and tau"):
            filter_of(facts | bad, 1.0, PERIOD)
    # Critically damped, the slower time is 2 tau/d: 6 s are a tenth of what it may be drawn out by.
    slow = {"k": [100.0] * 3, "d": [20.0] * 3}
    filter_of(slow | {"tau": 60.0}, 1.0, PERIOD)
    with pytest.raises(InputError, match=r"within 6\.01 s"):
        filter_of(slow | {"tau": 60.1}, 1.0, PERIOD)
