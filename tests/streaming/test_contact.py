import numpy as np
import pytest
from streaming_fakes import START, plan, stroke

from dmpcli.errors import InstrumentError
from dmpcli.instruments.protocols import RobotState, Sample
from dmpcli.primitives import admittance
from dmpcli.primitives.coupling import Law, fast_filter
from dmpcli.rotations import from_euler
from dmpcli.streaming.contact import Pressing, Sensing, at_rest

PERIOD = 0.02
UP = (0.0, 0.0, 1.0)


class FakeSensor:
    def __init__(self, *batches):
        self.batches = list(batches)

    def poll(self):
        return self.batches.pop(0) if self.batches else []


class Clock:
    def __init__(self):
        self.t = 0.0

    def now(self):
        return self.t

    def sleep_until(self, t):
        self.t = t


def sample(t, force, healthy=True):
    return Sample(t, 1, np.array([0.0, 0.0, force, 0.0, 0.0, 0.0]), healthy, 0)


def state(t=0.0, angle=0.0):
    return RobotState(t, START, from_euler(np.array([angle, 0.0, 0.0])), "ready")


def turned(sensed, rotation):
    return np.concatenate([rotation @ sensed[:3], rotation @ sensed[3:]])


def test_the_mean_since_the_last_cycle_is_read():
    sensing = Sensing(FakeSensor([sample(0.0, 4.0), sample(0.01, 6.0)]), turned, np.zeros(6))
    assert sensing.read(state(0.01))[2] == 5.0


def test_without_fresh_samples_the_last_one_stays():
    sensing = Sensing(FakeSensor([sample(0.0, 4.0)]), turned, np.full(6, 1.0))
    sensing.read(state(0.0))
    assert sensing.read(state(0.05))[2] == 4.0


def test_before_the_first_sample_the_reading_at_rest_holds():
    assert Sensing(FakeSensor(), turned, np.full(6, 3.0)).read(state(7.0))[2] == 3.0


def test_the_wrench_is_compensated_for_the_pose_of_the_moment():
    sensing = Sensing(FakeSensor([sample(0.0, 4.0)]), turned, np.zeros(6))
    np.testing.assert_allclose(sensing.read(state(angle=np.pi))[2], -4.0)


def test_a_silent_sensor_is_a_failure():
    sensing = Sensing(FakeSensor([sample(1.0, 4.0)]), turned, np.zeros(6))
    sensing.read(state(1.0))
    sensing.read(state(1.09))
    with pytest.raises(InstrumentError, match=r"silent for 0\.12 s"):
        sensing.read(state(1.12))


def test_a_sensor_that_never_speaks_is_a_failure():
    sensing = Sensing(FakeSensor(), turned, np.zeros(6))
    sensing.read(state(5.0))
    with pytest.raises(InstrumentError, match="silent"):
        sensing.read(state(5.2))


def test_an_unhealthy_sample_is_a_failure():
    sensing = Sensing(FakeSensor([sample(0.0, 1.0), sample(0.0, 1.0, False)]), turned, np.zeros(6))
    with pytest.raises(InstrumentError, match="saturated"):
        sensing.read(state(0.0))


def test_rest_needs_samples():
    clock = Clock()
    assert at_rest(FakeSensor([sample(0.0, 2.0)]), clock, long=True).shape == (1, 6)
    assert clock.t == 0.5
    with pytest.raises(InstrumentError, match="sends nothing"):
        at_rest(FakeSensor(), clock, long=False)


def law(clamp=5.0):
    one = admittance.Law(np.array([0.08]), np.array([2.0]), np.zeros(1), PERIOD)
    return Law(one, 5.0, clamp, 0.5, 0.1, 10.0)


def pressing(normal=UP, clamp=5.0):
    return Pressing(law(clamp), fast_filter(5.0, PERIOD), plan(stroke(normal=normal)))


def push(normal, force):
    return np.concatenate([force * np.asarray(normal), np.zeros(3)])


@pytest.mark.parametrize("normal", [UP, (0.6, 0.0, 0.8)])
def test_it_moves_along_the_normal_only_and_away_when_pressed_hard(normal):
    press = pressing(normal)
    for _ in range(20):
        moved = press.displace(0.0, push(normal, 9.0))
    assert moved @ np.asarray(normal) > 0.1
    np.testing.assert_allclose(np.cross(moved, normal), 0.0, atol=1e-12)


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


def test_a_plan_that_lifts_off_releases_e():
    """Faster along the normal than the coupling could follow, 5 N / 2 N·s/mm = 2.5 mm/s."""
    rising = stroke(normal=(-0.8, 0.0, 0.6))  # the stroke runs towards -x, up to 20 mm/s
    press = Pressing(law(), fast_filter(5.0, PERIOD), plan(rising))
    for _ in range(10):
        press.displace(0.0, push((-0.8, 0.0, 0.6), 2.0))
    pulled = press.e
    assert pulled < 0
    for i in range(10):
        press.displace(250.0 + i, np.zeros(6))
    assert press.e > pulled
