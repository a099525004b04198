import dataclasses
import tracemalloc
from collections import deque

import numpy as np
import pytest

from dmpcli.admittance.force_coupling import fast_filter
from dmpcli.admittance.force_law import ForceGains, LawState
from dmpcli.control.contact_policy import ContactPolicy
from dmpcli.control.contact_supervisor import ContactSupervisor
from dmpcli.control.force_sensing import Sensing
from dmpcli.control.force_tracking import ForceInput, ForceTracker
from dmpcli.control.met_wall import MetWall
from dmpcli.errors import RefusedError
from dmpcli.instruments.clock import SimulatedClock
from dmpcli.instruments.protocols import RobotState, Sample, SensorInfo
from dmpcli.planning.plan import joined, straight
from dmpcli.planning.plan import sample as sample_stroke
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.rotations import from_euler
from tests.control.fake_sensors import BatchSensor
from tests.control.streaming_fakes import PEN_DOWN, START, WIDE, plan, stroke

PERIOD = 0.02
UP = (0.0, 0.0, 1.0)


INFO = SensorInfo("fake", 100.0, np.full(6, 100.0))


def sample(t, force):
    return Sample(t, 1, np.array([0.0, 0.0, force, 0.0, 0.0, 0.0]), True, 0)


def state(angle=0.0):
    return RobotState(0.0, START, from_euler(np.array([angle, 0.0, 0.0])), "ready")


def turned(sensed, rotation):
    return np.concatenate([rotation @ sensed[:3], rotation @ sensed[3:]])


def touch(*batches):
    sensor = BatchSensor(*batches)
    return ForceInput(Sensing(sensor, INFO, 100.0, PERIOD, SimulatedClock()), turned)


def test_the_mean_since_the_last_cycle_is_felt():
    assert touch([sample(0.0, 4.0), sample(0.01, 6.0)]).feel(state(), 0.01)[2] == 5.0


def test_what_a_long_wait_has_gathered_does_not_hide_what_is_felt_now():
    waited = [sample(0.01 * k, 0.0) for k in range(500)]
    felt = touch([*waited, *(sample(5.0 + 0.01 * k, 8.0) for k in range(4))])
    assert felt.feel(state(), 5.04)[2] == 8.0


def test_without_a_new_sample_the_last_one_holds_while_it_is_fresh():
    felt = touch([sample(0.0, 4.0)])
    felt.feel(state(), 0.0)
    assert felt.feel(state(), 0.04)[2] == 4.0
    assert felt.feel(state(), 0.05) is None


def test_the_wrench_is_compensated_for_the_pose_of_the_moment():
    np.testing.assert_allclose(touch([sample(0.0, 4.0)]).feel(state(np.pi), 0.0)[2], -4.0)


def push(normal, force):
    return np.concatenate([force * np.asarray(normal), np.zeros(3)])


def pressing(normal=UP, source=None, override=None, **policy):
    policy = ContactPolicy(**({"setpoint": 3.0} | policy))
    made = plan(source or stroke(normal=normal))
    return ForceTracker(ContactSupervisor(policy, PERIOD), fast_filter(5.0, PERIOD), made, override)


class LateArm:
    """Presses on a plate of 5 N/mm, `gap` below the plan, whose normal it does not see."""

    def __init__(self, lookahead, gap=0.2, normal=UP, **policy):
        self.press = pressing(normal, delay=lookahead, **policy)
        # Beside its look-ahead an arm lags by a period or two, and so does the sensor.
        self.underway = deque([0.0] * (round(lookahead / PERIOD) + 3))
        self.gap, self.force, self.normal, self.t = gap, 0.0, np.asarray(normal), 0.0

    def step(self, index=0.0, beside=0.0):
        felt = push(self.normal, self.force) + np.append(beside, np.zeros(5))
        moved = self.press.displace(index, felt, self.t)
        np.testing.assert_allclose(np.cross(moved, self.normal), 0.0, atol=1e-12)
        self.underway.append(moved @ self.normal)
        self.force = 5.0 * max(-self.gap - self.underway.popleft(), 0.0)
        self.t += PERIOD
        return self.force

    def settle(self):
        """Forces until it has settled."""
        forces = []
        while not self.press.settled:
            assert self.press.failure == ""
            forces.append(self.step())
        return forces


@pytest.mark.sweep(kept=2)
@pytest.mark.slow
@pytest.mark.parametrize("lookahead", [0.02, 0.1, 0.2, 0.3, 0.5])
def test_the_force_settles_without_losing_contact_however_long_the_look_ahead(lookahead):
    arm = LateArm(lookahead)
    forces = np.array(arm.settle() + [arm.step() for _ in range(1000)])
    touched = np.flatnonzero(forces)[0]
    assert forces[touched + 1 :].min() > 0.0
    assert forces.max() < 4.5 if lookahead <= 0.2 else forces.max() < 9.0
    np.testing.assert_allclose(forces[-250:], 3.0, atol=0.1)


def test_it_moves_along_the_normal_only_and_rests_on_the_set_point():
    arm = LateArm(0.05, normal=(0.6, 0.0, 0.8))
    arm.settle()
    assert abs(arm.force - 3.0) <= 0.3


@pytest.mark.slow
def test_forces_along_the_surface_do_not_move_it():
    one, other = LateArm(0.05), LateArm(0.05)
    one.settle()
    other.settle()
    for _ in range(20):
        one.step()
        other.step(beside=1.5)
    assert one.press.e == pytest.approx(other.press.e, abs=1e-12)


def test_held_the_displacement_does_not_grow():
    arm = LateArm(0.05)
    arm.settle()
    moved = arm.press.hold(0.0)
    for _ in range(20):
        np.testing.assert_array_equal(arm.press.hold(0.0), moved)


def test_the_zero_is_taken_in_the_tools_axes_while_it_is_lifted():
    arm = LateArm(0.05)
    arm.force = 0.8
    while not arm.press.settled:
        arm.press.displace(0.0, push(UP, 0.8 + arm.force), arm.t)
        if arm.press.supervisor.state == "seeking":
            break
    arm.press.displace(0.0, push(UP, 0.8 + arm.force), arm.t)
    R = plan(stroke(normal=UP)).rotation[0]
    np.testing.assert_allclose(R @ arm.press._zero, [0.0, 0.0, 1.6], atol=1e-9)


def test_the_law_keeps_what_was_felt_for_the_run_file():
    arm = LateArm(0.05)
    arm.settle()
    for i in range(1, 200):
        arm.step(float(i))
    found = arm.press.facts()["contact"]
    assert found["share"] == 1.0
    assert found["mean"] == pytest.approx(3.0, abs=0.1)
    assert found["rms_error"] < 0.1
    assert found["stiffness"] == pytest.approx(5.0, rel=0.05)
    states = [event["state"] for event in arm.press.facts()["contact_events"]]
    assert states == ["seeking", "landing", "drawing"]
    assert arm.press.gains()["damping"] > 0.0


def wavelike(force):
    return dataclasses.replace(stroke(normal=UP), force=np.asarray(force, dtype=float))


def test_a_stroke_that_is_lifted_all_along_gets_its_plan_to_the_last_bit():
    made = wavelike(np.zeros(501))
    press = pressing(source=made)
    for i in range(501):
        np.testing.assert_array_equal(press.displace(float(i), push(UP, 0.01), i * PERIOD), 0.0)
    assert press.tally.facts(0.5) == {}


def test_the_plans_own_force_is_followed_and_an_override_leaves_lifted_parts_lifted():
    force = np.where(np.arange(501) < 300, 4.0, 0.0)
    own, over = pressing(source=wavelike(force)), pressing(source=wavelike(force), override=2.0)
    assert (own.wanted(100.0), own.wanted(400.0)) == (4.0, 0.0)
    assert (over.wanted(100.0), over.wanted(400.0)) == (2.0, 0.0)
    assert pressing().wanted(100.0) == 3.0


def test_on_the_way_down_it_is_lifted_off_the_plan_and_what_it_meets_there_stops_it():
    start = Pose(START + [0.0, 0.0, 20.0], PEN_DOWN)
    made = plan(stroke(normal=UP), start=start, approach=20.0)
    supervisor = ContactSupervisor(ContactPolicy(5.0), PERIOD)
    press = ForceTracker(supervisor, fast_filter(5.0, PERIOD), made)
    over = [made.position[i] + press.come(float(i), push(UP, 0.0), 0.0) for i in range(made.lead)]
    height = np.array([p[2] for p in over]) - START[2]
    assert np.all(np.diff(height) < 1e-3)
    assert height[-1] == pytest.approx(6.0, abs=0.1)
    press.come(float(made.lead - 1), push(UP, 8.0), 1.0)
    assert supervisor.urgent
    assert "on the way down" in press.failure


def test_work_per_cycle_makes_no_arrays_but_a_few():
    """A guard of the hot path that needs no clock: what one cycle allocates is bounded."""
    arm = LateArm(0.05)
    arm.settle()
    arm.step(1.0)
    tracemalloc.start()
    arm.step(2.0)
    used = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert used < 20_000


def test_at_the_last_set_point_the_last_force_is_wanted_and_beyond_it_too():
    force = 2.0 + 0.01 * np.arange(501)
    press = pressing(source=wavelike(force))
    assert [press.wanted(i) for i in (0.0, 499.0, 500.0, 501.0)] == [2.0, 6.99, 7.0, 7.0]
    assert press.wanted(499.9) == 6.99


def test_before_and_after_the_stroke_no_force_is_wanted():
    made = plan(stroke(normal=UP), start=Pose(START + [0.0, 0.0, 20.0], PEN_DOWN), approach=20.0)
    press = ForceTracker(
        ContactSupervisor(ContactPolicy(3.0), PERIOD), fast_filter(5.0, PERIOD), made
    )
    assert [press.wanted(i) for i in (0, made.lead - 1, made.lead, made.last)] == [0, 0, 3.0, 3.0]
    lifted = dataclasses.replace(
        made, force=np.where(np.arange(len(made)) < made.lead + 9, 1.0, 0.0)
    )
    own = ForceTracker(
        ContactSupervisor(ContactPolicy(3.0), PERIOD), fast_filter(5.0, PERIOD), lifted
    )
    assert [own.wanted(i) for i in (made.lead - 1, made.lead, made.lead + 9)] == [0.0, 1.0, 0.0]


def lifted_on(legs, lead=100, reach=6.0, free=10.0):
    """Shares of the lift before a stroke, by the legs of the way to it."""
    made = plan(stroke(normal=UP))
    rows = np.zeros(lead, dtype=int)
    whole = dataclasses.replace(
        made, t=np.concatenate([rows, made.t]), position=made.position[np.r_[rows, 0:501]],
        rotation=made.rotation[np.r_[rows, 0:501]], normal=made.normal[np.r_[rows, 0:501]],
        lead=lead, last=lead + 500, legs=(*legs, ("stroke", lead)),
    )  # fmt: skip
    policy = ContactPolicy(3.0, reach=reach, free=free)
    return ForceTracker(ContactSupervisor(policy, PERIOD), fast_filter(5.0, PERIOD), whole)._lifts


def test_the_lift_grows_along_the_last_way_to_the_stroke_by_minimum_jerk():
    found = lifted_on([("transfer", 0), ("approach", 40)])
    s = np.arange(1, 61) / 60.0
    np.testing.assert_array_equal(found[:40], 0.0)
    np.testing.assert_allclose(found[40:], 10 * s**3 - 15 * s**4 + 6 * s**5)
    assert found[-1] == 1.0
    assert found.shape == (100,)
    # The last approach counts, and a way without one lifts nothing.
    np.testing.assert_array_equal(
        lifted_on([("approach", 0), ("transfer", 9), ("approach", 40)]), found
    )
    np.testing.assert_array_equal(lifted_on([("transfer", 0)]), 0.0)


@pytest.mark.parametrize(("reach", "lifts"), [(12.79, True), (12.81, False)])
def test_a_way_that_would_lift_faster_than_twice_the_free_speed_stays_as_it_is(reach, lifts):
    # 1.875 times the reach in 60 periods of 20 ms, at the most 20 mm/s.
    assert bool(lifted_on([("transfer", 0), ("approach", 40)], reach=reach).any()) is lifts


def test_the_zero_of_the_force_turns_with_the_tool_up_to_the_last_set_point():
    made = plan(stroke(normal=UP, turn=0.5))
    last = from_euler(np.array([np.pi - 0.3, 0.2, 1.0]))
    made.rotation[-1] = last
    press = ForceTracker(
        ContactSupervisor(ContactPolicy(3.0), PERIOD), fast_filter(5.0, PERIOD), made
    )
    tool = np.array([0.4, -0.3, 0.5])  # what it reads beside its zero, tool axes
    while press.supervisor.state == "free":
        press.displace(0.0, np.append(made.rotation[0] @ tool, np.zeros(3)), press.supervisor.law.e)
    felt = []
    step = press.supervisor.step
    press.supervisor.step = lambda t, force, across, *more: (
        felt.append((force, across)) or step(t, force, across, *more)
    )
    for index, R in ((0.0, made.rotation[0]), (250.0, made.rotation[250]), (500.0, last)):
        press.displace(index, np.append(R @ tool + [0.0, 0.0, 2.0], np.zeros(3)), 9.0)
    np.testing.assert_allclose(felt, [[2.0, 0.0]] * 3, atol=1e-9)


def test_force_is_that_along_the_normal_and_the_rest_is_across_it():
    press = pressing((0.6, 0.0, 0.8))
    felt = []
    press.supervisor.step = lambda *said: felt.append(said)
    press.displace(100.0, np.array([3.96, -4.0, 4.28, 9.0, 9.0, 9.0]), 2.0)  # against the way
    [(t, force, across, wanted, friction)] = felt
    assert (t, force, wanted) == (2.0, pytest.approx(5.8), 3.0)
    assert across == pytest.approx(np.sqrt(50.0 - 5.8**2))
    assert friction == press.sense.friction


def test_only_what_is_drawn_and_wanted_is_counted():
    force = np.where(np.arange(501) < 300, 4.0, 0.0)
    press = pressing(source=wavelike(force), contact=0.5)
    press.supervisor.step = lambda *_: None
    for index, pushed in ((0.0, 4.0), (1.0, 4.5), (2.0, 0.5), (3.0, 0.51), (301.0, 9.0)):
        press.displace(index, push(UP, pushed), 0.0)
    assert press.tally.felt == [4.5, 0.5, 0.51]
    assert press.tally.share("0") == pytest.approx(2.0 / 3.0)
    press.supervisor.doubted, press.supervisor.saturated = True, True
    press.displace(4.0, push(UP, 4.0), 0.0)
    assert press.tally.share("0") == 0.5
    assert press.tally.facts(0.5)["saturated"] == 0.25
    # A set-point of less than twice the threshold: half of it counts.
    soft = pressing(source=wavelike(np.full(501, 0.6)), contact=0.5)
    soft.supervisor.step = lambda *_: None
    for index, pushed in ((1.0, 0.3), (2.0, 0.31)):
        soft.displace(index, push(UP, pushed), 0.0)
    assert soft.tally.share("0") == 0.5


@pytest.mark.parametrize(("force", "fails"), [(4.99, False), (5.01, True)])
def test_on_the_way_down_more_than_the_set_point_and_a_zero_is_met_too_early(force, fails):
    made = plan(stroke(normal=UP), start=Pose(START + [0.0, 0.0, 20.0], PEN_DOWN), approach=20.0)
    supervisor = ContactSupervisor(ContactPolicy(3.0, zero_limit=2.0), PERIOD)
    press = ForceTracker(supervisor, fast_filter(5.0, PERIOD), made)
    press.come(5.0, push(UP, force), 1.5)
    assert bool(press.failure) is fails
    assert supervisor.urgent is fails
    press.come(6.0, None, 1.5)


def test_off_the_work_what_is_left_of_it_goes_with_the_way():
    source = sample_stroke(stroke(normal=UP), PERIOD, 1.0, PEN_DOWN)
    end = Pose(source.position[-1] + [0.0, 0.0, 20.0], source.rotation[-1])
    off = straight("retract", source.pose(-1), end, PERIOD, WIDE, 50.0)
    made = joined(source, [], [off], PERIOD, True)
    press = ForceTracker(
        ContactSupervisor(ContactPolicy(3.0), PERIOD), fast_filter(5.0, PERIOD), made
    )
    press._delta = np.array([-2.0, 0.0])
    reach = made.position[-1, 2] - made.position[made.last, 2]
    for index in (made.last + 1, made.last + 9, len(made) - 1):
        left = press.leave(float(index), 1.0)
        gone = (made.position[index, 2] - made.position[made.last, 2]) / reach
        np.testing.assert_allclose(left, [0.0, 0.0, -2.0 * (1.0 - gone)], atol=1e-12)
    assert press.supervisor.state == "retreating"
    # Where the plan does not leave the work, the tool is lifted.
    press.retreat(float(made.last), 2.0)
    assert press.hold(float(made.last))[2] > -2.0


def test_another_stroke_is_counted_by_itself_with_the_same_supervisor():
    press = pressing(override=2.5)
    press.supervisor.law = LawState(3.0, 1.0, 0.5)
    press.supervisor.state = "drawing"
    other = press.on(dataclasses.replace(plan(stroke(normal=UP)), id="next"))
    assert (other.supervisor, other.tally, other.sense) == (
        press.supervisor,
        press.tally,
        press.sense,
    )
    # It begins on the plan, and looks for the surface anew.
    assert (press.supervisor.law, press.supervisor.state) == (LawState(), "free")
    assert other.wanted(100.0) == 3.0  # the plan states no force of its own to override
    assert other.tally.share("next") == 1.0
    moved = plan(stroke(duration=12.0, normal=UP))
    other.follow(moved)
    assert len(other._wanted) == len(moved)
    with pytest.raises(ValueError, match="without normals"):
        press.on(plan(stroke()))


def test_what_was_known_of_the_gains_is_told():
    press = pressing()
    assert press.gains() == {}
    press.supervisor.gains = ForceGains(0.1, 2.0, 0.3, np.inf, PERIOD)
    assert press.gains() == {"mass": 0.1, "damping": 2.0}
    press.supervisor.gains = ForceGains(0.1, 2.0, 0.3, 0.7, PERIOD)
    assert press.gains() == {"mass": 0.1, "damping": 2.0, "integral_time": 0.7}
    assert press.facts() == {"contact_events": []}


def test_a_wall_that_was_met_stands_in_the_file():
    arm = LateArm(0.05)
    arm.settle()
    arm.step(1.0)
    supervisor = arm.press.supervisor
    arm.press.wall = MetWall(4.0, 4.5, 10.0, 3.0, 0.1)
    found = arm.press.facts()["contact"]
    assert found["wall"] == {
        "across": 4.0, "largest": 4.5, "speed": 10.0, "stiffness": 3.0, "reaction": 0.1,
        "unavoidable": pytest.approx(3.0),
    }  # fmt: skip
    assert (found["stiffness"], found["delay"]) == (supervisor.stiffness, supervisor.delay)
    assert found["landing_peak"] == supervisor.landing_peak
    supervisor.stiffness = arm.press.wall = None
    assert not {"wall", "stiffness"} & set(arm.press.facts()["contact"])


def test_more_than_the_tool_may_meet_stops_whatever_is_felt_with():
    with pytest.raises(RefusedError, match="force"):
        touch([sample(0.0, 4.0)]).feel(state(), 0.0, 3.9)
    assert touch([sample(0.0, 4.0)]).feel(state(), 0.0, 4.0)[2] == 4.0


def test_a_wall_is_what_rises_across_the_normal_as_fast_as_the_stroke_runs_into_it():
    press, made = pressing(), plan(stroke(normal=UP))
    supervisor, along = press.supervisor, np.array([0.6, -0.8, 0.0])
    press._zero = np.array([0.3, -0.2, 0.4])  # of the tool, which points down
    own = made.rotation[120] @ press._zero
    readings = [
        (0.01 * n, np.append(own + 30.0 * n * along * (n < 5) + [0.0, 0.0, 4.0], np.zeros(3)))
        for n in range(8)
    ]
    press.look_back(120.0, readings, 0.01)
    assert press.wall is None  # nothing was met yet
    supervisor.across = 2.5
    press.look_back(120.0, [], 0.01)
    assert press.wall is None
    supervisor.failure = "met"
    press.look_back(120.0, readings, 0.01)
    speed = abs((made.position[120] - made.position[119]) @ along) / PERIOD
    assert press.wall.speed == pytest.approx(speed)
    assert press.wall.stiffness == pytest.approx(3000.0 / speed)
    assert (press.wall.across, press.wall.largest) == (2.5, pytest.approx(120.0))
    assert press.wall.reaction == pytest.approx(supervisor.reaction + 0.01)
    assert supervisor.failure == f"met ({press.wall})"
    before = press.wall
    press.look_back(200.0, readings, 0.01)
    assert press.wall is before


def test_a_spring_that_is_pressed_harder_along_the_stroke_leans_no_surface():
    """The tool goes deeper by what its spring gives; the surface is where it was."""
    press, made = pressing(), plan(stroke(normal=UP))
    supervisor = press.supervisor
    supervisor.state, supervisor.stiffness = "drawing", 0.8
    press._wanted = np.linspace(2.0, 8.0, len(made))
    felt = []
    press.sense.feel = lambda t, force, position, planned: felt.append(position)
    for index in (100, 180, 260):
        deep = made.position[index] - press.wanted(index) / 0.8 * np.array(UP)
        press.displace(float(index), np.array([0.0, 0.0, 5.0, 0.0, 0.0, 0.0]), 2.0, deep)
    np.testing.assert_allclose(felt, made.position[[100, 180, 260]], atol=1e-9)


@pytest.mark.parametrize(("helps", "ends"), [(False, True), (True, False)])
def test_a_force_across_the_normal_ends_a_stroke_where_it_resists_alone(helps, ends):
    """Twice what friction may be: a wall against the way, or an edge that lets the tool go."""
    press, made = pressing(), plan(stroke(normal=UP))
    press.supervisor.state = "drawing"
    way = made.position[120] - made.position[119]
    side = (1.0 if helps else -1.0) * 8.0 * way / np.linalg.norm(way)
    press.displace(120.0, np.append(side + 5.0 * np.array(UP), np.zeros(3)), 2.4)
    assert (press.supervisor.across is not None) == ends
    assert bool(press.failure) == ends


def test_how_far_the_zero_has_moved_is_told_in_the_tools_axes_once_it_is_clear():
    press = pressing()
    press._zero = np.array([0.1, 0.2, 0.3])
    R = from_euler(np.array([np.pi, 0.4, 1.0]))
    readings = [
        (t, np.append(R @ [0.1, 0.2, 0.3 + off], np.ones(3))) for t, off in ((0, 0.2), (1, 0.4))
    ]
    press.clear(readings, R)
    assert press.drift is None  # it presses still
    press.supervisor.leaves(1.0)
    press.clear([], R)
    assert press.drift is None
    press.clear(readings, R)
    assert press.drift == pytest.approx(0.3)


def test_what_was_felt_reading_by_reading_is_told_from_some_cycles_ago_to_now():
    felt = touch(
        [sample(0.01 * k, float(k)) for k in range(4)], [sample(0.05, 5.0)], [sample(0.06, 6.0)]
    )
    felt.feel(state(), 0.03)
    felt.feel(state(), 0.05)
    told = felt.look_back(state(np.pi).rotation)
    assert [t for t, _ in told] == pytest.approx([0.0, 0.01, 0.02, 0.03, 0.05, 0.06])
    assert [wrench[2] for _, wrench in told] == pytest.approx([0.0, -1.0, -2.0, -3.0, -5.0, -6.0])
    # Of many the last six, and what has come since.
    many = touch([sample(0.001 * k, float(k)) for k in range(9)])
    many.feel(state(), 0.01)
    assert [wrench[2] for _, wrench in many.look_back(state().rotation)] == [3.0, 4, 5, 6, 7, 8]
