import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dmpcli.simulation.elite_server.faults import Event
from dmpcli.simulation.elite_server.parameters import RpcError
from dmpcli.simulation.elite_server.visiting_hand import PATIENCE, VisitingHand
from dmpcli.simulation.mock.parameters import PEN, Plate
from tests.simulation.elite_server.virtual_fakes import START, Bench

PERIOD = 0.02


def weight_as_felt(R: np.ndarray) -> np.ndarray:
    """6 N down, hung at PEN's centre of mass, in a sensor whose axes are R's columns."""
    force = R.T @ [0.0, 0.0, -6.0]
    return np.concatenate([force, np.cross(np.array([1.0, -2.0, 45.0]) / 1000.0, force)])


@pytest.mark.parametrize("angles", [(np.pi, 0, 0), (2.8, 0.3, -0.4), (np.pi, -0.5, 1.0)])
def test_in_the_air_the_sensor_feels_its_zero_and_the_tools_weight(angles):
    R = Rotation.from_euler("XYZ", angles).as_matrix()
    bench = Bench(position=START + [0.0, 0.0, 50.0], rotation=R)
    felt = bench.lab.wrench(bench.time.now)
    np.testing.assert_allclose(felt, PEN.zero + weight_as_felt(R), atol=1e-9)


def test_the_felt_weight_follows_the_joints():
    bench = Bench(position=START + [0.0, 0.0, 80.0]).switch_on()
    bench.call("moveByJoint", targetPos=list(bench.degrees + [0, 0, 0, 10, -15, 20]), speed=100)
    bench.wait(3.0)
    R = bench.arm.posture.rotation
    felt = bench.lab.wrench(bench.time.now)
    np.testing.assert_allclose(felt, PEN.zero + weight_as_felt(R), atol=1e-9)


@pytest.mark.parametrize("depth", [0.1, 0.4, 2.0])
def test_a_pen_pressed_in_feels_the_plates_spring(depth):
    plate = Plate(point=START + [0.0, 0.0, depth], stiffness=7.0)
    bench = Bench(ground=plate)
    felt = bench.lab.wrench(bench.time.now) - PEN.zero - weight_as_felt(bench.arm.posture.rotation)
    push = 7.0 * depth
    # The sensor's z points down; tip and sensor are on one line, so there is no torque.
    np.testing.assert_allclose(felt, [0.0, 0.0, -push, 0.0, 0.0, 0.0], atol=1e-9)


def test_a_pen_that_slides_feels_coulomb_friction_against_its_way():
    plate = Plate(point=START + [0.0, 0.0, 0.4], stiffness=5.0, damping=0.0, friction=0.2)
    bench = Bench(ground=plate).begin(lookahead=20)
    pose = bench.call("get_tcp_pose")
    for _ in range(20):
        pose[0] -= 0.5  # 25 mm/s, well over the speed from which friction is full
        bench.call("tt_put_servo_joint_to_buf", targetPose=pose)
    bench.wait(0.211)
    felt = bench.lab.wrench(bench.time.now) - PEN.zero - weight_as_felt(bench.arm.posture.rotation)
    # Base x is the pen's x, as it is turned about x; 2 N push.
    assert felt[0] == pytest.approx(0.4, abs=1e-3)
    assert felt[2] == pytest.approx(-2.0, abs=1e-3)
    # 135 mm from the sensor to the tip.
    assert felt[4] == pytest.approx(0.135 * 0.4, abs=1e-3)


def test_noise_and_drift_are_those_of_the_seed():
    from dmpcli.simulation.mock.parameters import SensorParameters

    def readings(seed: int) -> np.ndarray:
        bench = Bench(sensor=SensorParameters(), seed=seed)
        found = []
        for _ in range(400):
            bench.time.now += 0.01
            found.append(bench.lab.wrench(bench.time.now))
        return np.array(found)

    np.testing.assert_array_equal(readings(5), readings(5))
    first = readings(5)
    assert np.abs(first - readings(6)).min() > 0.0
    spread = (first - first.mean(axis=0)).std(axis=0)
    np.testing.assert_allclose(spread[:3], [0.02, 0.02, 0.06], rtol=0.15)


def test_a_reading_of_the_past_is_one_of_the_present_never_of_a_time_turned_back():
    bench = Bench().begin(lookahead=20)
    bench.put(bench.degrees + 0.1)
    bench.wait(0.01)
    before = bench.degrees
    bench.lab.wrench(bench.time.now - 1.0)
    np.testing.assert_array_equal(bench.degrees, before)


def test_events_happen_at_their_time_whoever_asks_next():
    bench = Bench(events=(Event("estop", 0.05),)).begin(lookahead=20)
    start, step = bench.degrees, np.full(6, 0.2)
    for k in range(1, 40):
        bench.put(start + k * step)
    bench.wait(5.0)
    # Nobody asked in between; still the arm stands where it was at 0.05 s, 2.5 periods.
    np.testing.assert_allclose(bench.degrees, start + 2.5 * step, atol=1e-9)


def test_events_count_from_the_first_entry_into_servo_mode():
    bench = Bench(events=(Event("collision", 1.0),)).switch_on()
    bench.wait(10.0)
    assert bench.call("getRobotState") == 0
    bench.call("transparent_transmission_init", lookahead=100, t=20)
    bench.call("tt_clear_servo_joint_buf")
    bench.wait(0.9)
    assert bench.call("getRobotState") == 0
    bench.wait(0.2)
    assert bench.call("getRobotState") == 5


def test_a_dropped_connection_is_asked_for_at_its_time():
    bench = Bench(events=(Event("drop", 0.5, "monitor"),)).begin()
    dropped = []
    bench.lab.drop = dropped.append
    bench.wait(0.4)
    assert dropped == []
    bench.wait(0.2)
    assert dropped == ["monitor"]


def test_from_the_beginning_is_before_the_first_request():
    bench = Bench(events=(Event("estop", None), Event("mode", None, 0)))
    assert bench.call("get_estop_status") == 1
    with pytest.raises(RpcError):
        bench.call("syncMotorStatus")


def test_every_frame_is_of_now():
    import struct

    bench = Bench().begin(lookahead=20)
    bench.put(bench.degrees + 0.1)
    start = bench.degrees
    bench.time.now += 0.01
    joints = struct.unpack(">8d", bench.lab.frame()[13:77])
    np.testing.assert_allclose(joints[:6], start + 0.05, atol=1e-9)


class Pull:
    """A hand that pulls with 3 N along x, and knows when it took hold."""

    def __init__(self) -> None:
        self.began: list[float] = []

    def begin(self, t: float) -> None:
        self.began.append(t)

    def wrench(self, t, position, rotation, velocity):
        return np.array([3.0, 0.0, 0.0, 0.0, 0.0, 0.0])


class Dragging(Bench):
    """Fed with the same point over and over, or one that wanders off."""

    def __init__(self, strokes: int = 1, **changes):
        self.pull = Pull()
        self.hand = VisitingHand(self.pull, START, 2.0, strokes)
        super().__init__(self.hand, **changes)
        self.begin(lookahead=40)
        self.point = self.degrees
        self.put(self.point)
        self.put(self.point)

    def feed(self, seconds: float, step: float = 0.0) -> None:
        for _ in range(round(seconds / PERIOD)):
            self.point = self.point + [step, 0, 0, 0, 0, 0]
            self.put(self.point)
            self.wait(PERIOD)

    def pulls(self) -> bool:
        own = PEN.zero + weight_as_felt(self.arm.posture.rotation)
        return bool(np.abs(self.lab.wrench(self.time.now) - own).max() > 1.0)


def test_the_hand_takes_hold_of_an_arm_that_stands_in_servo_mode_at_the_start():
    lab = Dragging()
    lab.feed(PATIENCE - 0.1)
    assert not lab.pulls()
    lab.feed(0.2)
    assert lab.pulls()
    assert len(lab.pull.began) == 1


def test_the_hand_leaves_alone_an_arm_that_moves_by_itself():
    lab = Dragging()
    for _ in range(20):
        lab.feed(0.1, step=0.01)
        lab.feed(PATIENCE - 0.2)
    assert lab.pull.began == []


def test_the_hand_leaves_alone_an_arm_that_stands_elsewhere():
    lab = Dragging(position=START + [0.0, 4.0, 0.0])
    lab.feed(2.0)
    assert lab.pull.began == []


def test_the_hand_does_not_grip_an_arm_that_is_not_in_servo_mode():
    pull = Pull()
    bench = Bench(VisitingHand(pull, START, 2.0, 1)).switch_on()
    for _ in range(100):
        bench.wait(0.05)
    assert pull.began == []


def test_the_hand_draws_as_often_as_it_was_told():
    lab = Dragging(strokes=2)
    for stroke in (1, 2):
        lab.feed(PATIENCE + 2.2)
        assert lab.pulls()
        lab.call("tt_clear_servo_joint_buf", clear=0)
        lab.wait(PERIOD)
        assert not lab.pulls()
        assert lab.hand.drawn == stroke
        lab.call("transparent_transmission_init", lookahead=40, t=20)
    lab.feed(3.0)
    assert len(lab.pull.began) == 2


def test_a_stroke_that_was_cut_short_does_not_count():
    lab = Dragging(strokes=1)
    lab.feed(PATIENCE + 0.5)
    lab.call("stop")
    lab.wait(PERIOD)
    assert lab.hand.drawn == 0
    lab.call("transparent_transmission_init", lookahead=40, t=20)
    lab.feed(PATIENCE + 0.2)
    assert len(lab.pull.began) == 2


def test_a_short_gap_in_the_set_points_does_not_make_the_hand_let_go():
    lab = Dragging()
    lab.feed(PATIENCE + 0.2)
    lab.wait(0.3)
    assert not lab.controller.transmission.running
    assert lab.pulls()
    lab.wait(PATIENCE)
    assert not lab.pulls()


def test_what_the_hand_drew_is_kept_while_it_held_the_tool():
    lab = Dragging()
    assert not lab.pulls()
    lab.feed(PATIENCE + 0.1)
    for _ in range(3):
        lab.feed(0.1, step=0.05)
        lab.pulls()
    times, positions, _ = zip(*lab.hand.track, strict=True)
    assert len(times) == 3
    assert np.all(np.diff(times) > 0.0)
    np.testing.assert_allclose(positions[-1], lab.arm.posture.position)
