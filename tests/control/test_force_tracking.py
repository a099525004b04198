from collections import deque

import numpy as np
import pytest

from dmpcli.admittance import model
from dmpcli.admittance.force_coupling import CouplingLaw, fast_filter
from dmpcli.control.force_sensing import Sensing
from dmpcli.control.force_tracking import SETTLED_TIME, ForceInput, ForceTracker
from dmpcli.instruments.clock import SimulatedClock
from dmpcli.instruments.protocols import RobotState, Sample, SensorInfo
from dmpcli.planning import transfers
from dmpcli.settings.execute import ExecuteSettings
from dmpcli.spatial.rotations import from_euler
from tests.control.fake_sensors import BatchSensor
from tests.control.streaming_fakes import START, WIDE, plan, stroke

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


def law(clamp=5.0):
    one = model.AdmittanceLaw(np.array([0.08]), np.array([2.0]), np.zeros(1), PERIOD)
    return CouplingLaw(one, 5.0, clamp, 0.5, 0.1, 10.0)


def pressing(normal=UP, clamp=5.0):
    return ForceTracker(law(clamp), fast_filter(5.0, PERIOD), plan(stroke(normal=normal)))


def push(normal, force):
    return np.concatenate([force * np.asarray(normal), np.zeros(3)])


@pytest.mark.parametrize("normal", [UP, (0.6, 0.0, 0.8)])
def test_it_moves_along_the_normal_only_and_away_when_pressed_hard(normal):
    press = pressing(normal)
    for _ in range(20):
        moved = press.displace(0.0, push(normal, 9.0))
    assert moved @ np.asarray(normal) > 0.1
    np.testing.assert_allclose(np.cross(moved, normal), 0.0, atol=1e-12)


def test_held_the_displacement_does_not_grow():
    press = pressing()
    for _ in range(20):
        moved = press.displace(0.0, push(UP, 0.0))
    assert moved[2] < -0.1
    for _ in range(20):
        np.testing.assert_array_equal(press.hold(0.0), moved)


def test_forces_along_the_surface_do_not_move_it():
    press = pressing()
    still = pressing()
    for _ in range(20):
        a = press.displace(0.0, push(UP, 5.0) + np.array([8.0, -3.0, 0, 0, 0, 0]))
        b = still.displace(0.0, push(UP, 5.0))
    np.testing.assert_array_equal(a, b)


def test_it_has_settled_after_a_while_near_the_set_point_and_not_before():
    press = pressing()
    for _ in range(4):
        press.displace(0.0, push(UP, 5.2))
    assert not press.settled
    press.displace(0.0, push(UP, 6.0))
    for _ in range(5):
        press.displace(0.0, push(UP, 4.8))
    assert press.settled


def test_it_gives_up_where_there_is_no_surface():
    press = pressing(clamp=2.0)
    for _ in range(30):
        press.displace(0.0, np.zeros(6))
    assert press.given_up == ""
    for _ in range(60):
        press.displace(0.0, np.zeros(6))
    assert press.given_up == "no contact within 2 mm of the plan"
    assert press.e == -2.0


def test_it_gives_up_where_the_force_never_settles():
    press = pressing()
    for _ in range(round(11 / PERIOD)):
        press.displace(0.0, push(UP, 2.0))
    assert "does not settle" in press.given_up


def test_it_gives_up_in_the_end_however_slow_it_is():
    press = pressing(clamp=1e6)
    for _ in range(round(61 / PERIOD)):
        press.displace(0.0, push(UP, 2.0))
    assert "does not settle" in press.given_up


class LateArm:
    """Presses on a plate of 5 N/mm that lies 0.2 mm deeper than the plan says."""

    def __init__(self, lookahead, gap=0.2):
        law = ExecuteSettings(force_setpoint=3.0).law(lookahead)
        self.press = ForceTracker(law, fast_filter(5.0, PERIOD), plan(stroke(normal=UP)), lookahead)
        # Beside its look-ahead an arm lags by a period or two, and so does the sensor.
        self.underway = deque([0.0] * (round(lookahead / PERIOD) + 3))
        self.gap, self.force = gap, 0.0

    def step(self):
        self.underway.append(self.press.displace(0.0, push(UP, self.force))[2])
        self.force = 5.0 * max(-self.gap - self.underway.popleft(), 0.0)
        return self.force

    def settle(self):
        """Forces until it has settled."""
        forces = []
        while not self.press.settled:
            assert self.press.given_up == ""
            forces.append(self.step())
        return forces


@pytest.mark.parametrize("lookahead", [0.02, 0.1, 0.2, 0.3, 0.5])
def test_the_force_settles_without_losing_contact_however_long_the_look_ahead(lookahead):
    arm = LateArm(lookahead)
    forces = np.array(arm.settle() + [arm.step() for _ in range(500)])
    touched = np.flatnonzero(forces)[0]
    assert forces[touched + 1 :].min() > 0.0
    assert forces.max() < 4.5
    np.testing.assert_allclose(forces[-250:], 3.0, atol=0.1)


def test_a_contact_that_is_lost_before_the_force_has_settled_is_sought_again():
    arm = LateArm(0.1)
    while arm.force < 1.0:
        arm.step()
    arm.step()
    arm.gap += 0.5
    arm.settle()
    assert abs(arm.force - 3.0) <= 0.3


def test_a_contact_that_is_lost_later_is_left():
    arm = LateArm(0.1)
    arm.settle()
    arm.step()
    arm.gap = 100.0
    for _ in range(200):
        arm.step()
    assert arm.press.e == 0.0


def test_the_force_has_settled_only_once_it_stayed_for_the_look_ahead():
    late = ForceTracker(law(), fast_filter(5.0, PERIOD), plan(stroke(normal=UP)), 0.4)
    for _ in range(19):
        late.displace(0.0, push(UP, 5.0))
    assert not late.settled
    assert 19 * PERIOD > SETTLED_TIME
    late.displace(0.0, push(UP, 5.0))
    late.displace(0.0, push(UP, 5.0))
    assert late.settled


def test_a_force_that_does_not_settle_behind_a_long_look_ahead_is_blamed_on_it():
    late = ForceTracker(law(), fast_filter(5.0, PERIOD), plan(stroke(normal=UP)), 0.4)
    for _ in range(round(11 / PERIOD)):
        late.displace(0.0, push(UP, 2.0))
    assert "behind a look-ahead of 0.4 s" in late.given_up


def test_a_plan_that_lifts_off_releases_e():
    """Faster along the normal than the coupling could follow, 5 N / 2 N·s/mm = 2.5 mm/s."""
    rising = stroke(normal=(-0.8, 0.0, 0.6))  # the stroke runs towards -x, up to 20 mm/s
    press = ForceTracker(law(), fast_filter(5.0, PERIOD), plan(rising))
    for _ in range(10):
        press.displace(0.0, push((-0.8, 0.0, 0.6), 2.0))
    pulled = press.e
    assert pulled < 0
    for i in range(10):
        press.displace(250.0 + i, np.zeros(6))
    assert press.e > pulled


def test_on_the_way_off_the_work_the_displacement_goes_with_the_way_that_is_left():
    source = stroke(normal=UP)
    led = transfers.plans(
        [source], PERIOD, 1.0, WIDE, (source.position[0], source.rotation[0]), True,
        transfers.TransferOptions(20.0, 100.0, 50.0, 20.0),
    )  # fmt: skip
    made = next(iter(led))
    press = ForceTracker(law(), fast_filter(5.0, PERIOD), made)
    for _ in range(10):
        press.displace(0.0, push(UP, 2.0))
    whole = press.leave(made.last)
    assert whole[:2].tolist() == [0.0, 0.0]
    assert whole[2] < 0.0
    risen = made.position[made.last :, 2] - made.position[made.last, 2]
    assert risen.max() == pytest.approx(20.0)
    for index in range(made.last, len(made), 7):
        left = 1.0 - risen[index - made.last] / 20.0
        assert press.leave(index) == pytest.approx(left * whole, abs=1e-9)
