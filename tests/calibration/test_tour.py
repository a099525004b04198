from dataclasses import replace

import numpy as np
import pytest

from dmpcli.admittance.compensation import Compensation
from dmpcli.calibration import result
from dmpcli.calibration.orientations import around
from dmpcli.calibration.tour import Interrupted, Tour
from dmpcli.control.cycle import ReadyArm
from dmpcli.control.force_sensing import Sensing
from dmpcli.control.signals import Interruption
from dmpcli.errors import InputError, InstrumentError, RefusedError
from dmpcli.instruments.clock import SimulatedClock
from dmpcli.kinematics import chain
from dmpcli.kinematics.models import model
from dmpcli.kinematics.reachability import Reach
from dmpcli.settings.calibrate import CalibrateSettings
from dmpcli.simulation.mock import PEN, Lab, MockSensor, MockServo, Scene
from dmpcli.simulation.mock.parameters import Faults, ServoParameters
from dmpcli.spatial.pose import Pose


class Bench:
    """A tour through the mock lab."""

    def __init__(self, scene=None, reach=None, joints=None, interrupt_at=None, **settings):
        clock = self.clock = SimulatedClock()
        lab = self.lab = Lab(clock, Scene() if scene is None else scene)
        servo, sensor = MockServo(lab), MockSensor(lab)
        if joints is not None:
            plain = servo.state
            servo.state = lambda: replace(plain(), joints=joints)
        self.settings = CalibrateSettings(**settings)
        info = sensor.open()
        sensor.start(100.0)
        sensing = Sensing(sensor, info, 100.0, 0.02, clock)
        sensing.first(0.3)
        self.taken, self.interruption, self.ticks = [], Interruption(), 0
        self.home = lab.arm.rotation.copy()
        self.tour = Tour(
            ReadyArm(servo, servo.open(), clock),
            sensing,
            self.settings,
            self.interruption,
            self.taken,
            reach,
            self.tick,
        )
        self.interrupt_at = interrupt_at

    def tick(self):
        self.ticks += 1
        if self.ticks == self.interrupt_at:
            self.interruption.receive(2)

    def run(self):
        self.tour.run()
        return self


@pytest.mark.slow
def test_every_pose_is_taken_at_rest_and_the_tool_comes_back_to_where_it_stood():
    done = Bench(poses=6).run()
    assert done.ticks == len(done.taken) == 6
    np.testing.assert_allclose(done.lab.arm.rotation, done.home, atol=1e-3)
    for pose in done.taken:
        np.testing.assert_allclose(pose.position, Scene().position, atol=0.01)
        assert pose.samples == 100
        cosine = pose.rotation[:, 2] @ done.home[:, 2]
        assert np.degrees(np.arccos(cosine)) == pytest.approx(45.0, abs=0.1)


@pytest.mark.slow
def test_the_tip_stays_and_no_turn_is_faster_than_allowed():
    bench = Bench(poses=4, max_rotation_speed=0.2)
    seen = []
    plain = bench.lab.arm.advance

    def watched(dt):
        plain(dt)
        seen.append((bench.lab.arm.position.copy(), bench.lab.arm.velocity.copy()))

    bench.lab.arm.advance = watched
    bench.run()
    positions, velocities = (np.array(part) for part in zip(*seen, strict=True))
    assert np.abs(positions - Scene().position).max() < 0.01
    assert np.linalg.norm(velocities[:, 3:], axis=1).max() < 0.2 * 1.02


@pytest.mark.slow
def test_a_signal_stops_between_poses_and_what_was_taken_stays():
    bench = Bench(poses=6, interrupt_at=3)
    with pytest.raises(Interrupted, match="SIGINT") as stopped:
        bench.run()
    assert stopped.value.number == 2
    assert len(bench.taken) == 3


@pytest.mark.slow
@pytest.mark.parametrize(
    ("faults", "error", "words"),
    [
        (Faults(estop_at=12.0), RefusedError, "emergency stop"),
        (Faults(silent_at=12.0), InstrumentError, "silent"),
        (Faults(refuse_at=12.0), InstrumentError, "refused a set-point"),
    ],
)
def test_a_fault_ends_the_tour_and_what_was_taken_stays(faults, error, words):
    bench = Bench(replace(Scene(), faults=faults))
    with pytest.raises(error, match=words):
        bench.run()
    assert 1 <= len(bench.taken) < 12


def test_an_obstacle_stops_the_arm():
    bench = Bench()

    class Side:
        """Something that the tool's side runs into once it has turned."""

        def wrench(self, t, position, rotation, velocity):
            return np.array([0, 0, 40.0 if rotation[2, 2] > -0.9 else 0.0, 0, 0, 0])

    bench.lab.hand = Side()
    with pytest.raises(RefusedError, match=r"pose 1: .*over 30 N"):
        bench.run()
    assert bench.taken == []


def test_too_little_tilt_is_refused_before_anything_moves():
    bench = Bench(tilt=np.radians(8.0))
    with pytest.raises(RefusedError, match="tilt the tool further"):
        bench.run()
    np.testing.assert_array_equal(bench.lab.arm.rotation, bench.home)


def test_a_period_that_the_robot_does_not_take_is_refused():
    with pytest.raises(InputError, match=r"--period 0\.5"):
        Bench(period=0.5).run()


def test_a_tool_outside_the_workspace_is_refused():
    with pytest.raises(RefusedError, match="workspace"):
        Bench(workspace=(0.0, 1.0, 0.0, 1.0, 0.0, 1.0)).run()


def standing(joints):
    """An EC66 with the flange as its TCP, in a lab of the mock's."""
    arm = model("ec66")
    at = chain.forward(arm, joints)
    position, rotation = at.position, at.rotation
    return Reach(arm), replace(Scene(), position=position, rotation=rotation, plate=None)


@pytest.mark.slow
def test_an_arm_that_can_reach_all_poses_may_go():
    joints = np.radians([10.0, -80.0, 100.0, -110.0, -90.0, 20.0])
    reach, scene = standing(joints)
    assert len(Bench(scene, reach, joints, poses=4).run().taken) == 4


def test_an_arm_that_cannot_is_refused_before_anything_moves():
    joints = np.radians([10.0, -20.0, 5.0, -60.0, -90.0, 20.0])  # nearly stretched
    reach, scene = standing(joints)
    bench = Bench(scene, reach, joints, poses=4)
    with pytest.raises(RefusedError, match="cannot turn the tool through all poses from here"):
        bench.run()
    np.testing.assert_array_equal(bench.lab.arm.rotation, bench.home)


def test_an_arm_that_never_settles_is_named():
    scene = replace(Scene(), servo=replace(ServoParameters(), lag=0.03))
    bench = Bench(scene, poses=4, patience=0.4)
    plain, rng = bench.tour._watcher._servo.state, np.random.default_rng(0)

    def shaking():
        state = plain()
        return replace(state, position=state.position + 0.3 * rng.standard_normal(3))

    bench.tour._watcher._servo = type("Shaking", (), {"state": staticmethod(shaking)})()
    with pytest.raises(RefusedError, match="pose 1: the arm does not come to rest"):
        bench.run()


@pytest.mark.sweep(kept=1)
@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_what_compensation_leaves_of_a_later_motion_is_below_a_tenth_of_a_newton(seed):
    """Ten seconds right after, with the mock's noise and a zero that drifts all the while."""
    bench = Bench(replace(Scene(), seed=seed)).run()
    found, _ = result.identified(bench.taken, PEN, 10.0, 0.3)
    compensate = Compensation(result.with_payload(PEN, found))
    left = []
    bench.tour._change = lambda sensed, rotation: left.append((sensed, rotation)) or np.zeros(6)
    for R in around(bench.home, 4, 0.4):
        bench.tour._go(Pose(Scene().position, R), "a free motion")
    assert len(left) > 500
    force = np.array([compensate(*each)[:3] for each in left[:500]])
    assert np.sqrt(np.mean(np.sum(force**2, axis=1))) < 0.1
