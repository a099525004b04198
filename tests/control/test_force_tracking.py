import dataclasses
import tracemalloc
from collections import deque

import numpy as np
import pytest

from dmpcli.admittance.force_coupling import fast_filter
from dmpcli.control.contact_policy import ContactPolicy
from dmpcli.control.contact_supervisor import ContactSupervisor
from dmpcli.control.force_sensing import Sensing
from dmpcli.control.force_tracking import ForceInput, ForceTracker
from dmpcli.instruments.clock import SimulatedClock
from dmpcli.instruments.protocols import RobotState, Sample, SensorInfo
from dmpcli.spatial.rotations import from_euler
from tests.control.fake_sensors import BatchSensor
from tests.control.streaming_fakes import PEN_DOWN, START, plan, stroke

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
    start = (START + [0.0, 0.0, 20.0], PEN_DOWN)
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
