from dataclasses import replace

import numpy as np
import pytest

from dmpcli.errors import InstrumentError
from dmpcli.instruments.clock import SimulatedClock
from dmpcli.instruments.protocols import DragTeaching as TeachesByDrag
from dmpcli.simulation.mock import PEN, PEN_DOWN, Faults, Lab, MockSensor, MockServo, Plate, Scene
from dmpcli.simulation.mock.arms import DraggedArm
from dmpcli.simulation.mock.contact import contact
from dmpcli.simulation.mock.parameters import DragParameters, SensorParameters, ServoParameters
from dmpcli.spatial import wrench
from dmpcli.spatial.rotations import exp, log
from tests.instruments.instrument_conformance import check_sensor, check_servo

HOME = np.zeros(3)
SILENT_NOISE = SensorParameters(noise=np.zeros(6), drift=np.zeros(6))


def bench(**scene):
    clock = SimulatedClock(start=7.0)
    lab = Lab(clock, Scene(**({"position": HOME} | scene)))
    return clock, lab, MockServo(lab), MockSensor(lab)


def waiting(clock):
    return lambda seconds: clock.sleep_until(clock.now() + seconds)


def started(period=0.02, **scene):
    clock, lab, servo, sensor = bench(**scene)
    servo.open()
    servo.start(period)
    return clock, lab, servo, sensor


class Pull:
    """A hand that pulls with one wrench."""

    def __init__(self, *value):
        self.value = np.array(value, dtype=float)

    def wrench(self, t, position, rotation, velocity):
        return self.value


def test_the_mock_sensor_obeys_the_protocol():
    clock, _, _, sensor = bench()
    check_sensor(sensor, clock, waiting(clock))


def test_the_mock_robot_obeys_the_protocol():
    clock, _, servo, _ = bench()
    check_servo(servo, clock, waiting(clock))


def test_a_ramp_is_followed_one_period_and_one_lag_late():
    clock, lab, servo, _ = started(servo=ServoParameters(lag=0.05))
    for k in range(200):
        clock.sleep_until(7.0 + 0.02 * k)
        servo.send(np.array([2.0 * k, 0, 0]), PEN_DOWN)
    # 100 mm/s: at the moment of sending set-point k the arm is (0.02 + 0.05) s behind it.
    assert servo.state().position[0] == pytest.approx(2.0 * 199 - 100.0 * 0.07, abs=1e-6)
    assert lab.arm.velocity[0] == pytest.approx(100.0)


def test_the_step_response_is_that_of_a_first_order_lag_behind_a_ramp_of_one_period():
    clock, _, servo, _ = started(servo=ServoParameters(lag=0.03))
    servo.send(np.array([1.0, 0, 0]), PEN_DOWN)
    ramp = 1.0 / 0.02
    at_end = 1.0 - ramp * 0.03 * (1.0 - np.exp(-0.02 / 0.03))
    for after in (0.0, 0.013, 0.05, 0.2):
        clock.sleep_until(7.02 + after)
        left = (1.0 - at_end) * np.exp(-after / 0.03)
        assert servo.state().position[0] == pytest.approx(1.0 - left, abs=1e-9)


def test_reading_more_often_does_not_change_the_motion():
    ends = []
    for reads in (1, 7):
        clock, _, servo, sensor = started(plate=Plate(point=HOME))
        sensor.start(100.0)
        for k in range(100):
            servo.send(np.array([0.3 * k, 0.0, -0.01 * k]), exp(np.array([0, 0, 0.01 * k])))
            for part in range(1, reads + 1):
                clock.sleep_until(7.0 + 0.02 * (k + part / reads))
                servo.state()
        state = servo.state()
        ends.append((state.position, state.rotation, sensor.poll()[-1].wrench))
    for one, other in zip(*ends, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9)


def test_speed_and_turning_rate_are_limited():
    clock, lab, servo, _ = started(servo=ServoParameters(speed=100.0, turning=0.5))
    servo.send(np.array([50.0, 0, 0]), exp(np.array([0.0, 0.0, 0.2])) @ PEN_DOWN)
    for _ in range(60):
        clock.sleep_until(clock.now() + 0.01)
        servo.state()
        assert np.linalg.norm(lab.arm.velocity[:3]) <= 100.0 + 1e-9
        assert np.linalg.norm(lab.arm.velocity[3:]) <= 0.5 + 1e-9
    clock.sleep_until(clock.now() + 1.0)
    np.testing.assert_allclose(servo.state().position, [50.0, 0, 0], atol=1e-6)


def test_the_arm_turns_along_the_shortest_arc():
    clock, _, servo, _ = started()
    goal = exp(np.array([0.0, 0.3, 0.4])) @ PEN_DOWN
    servo.send(HOME, goal)
    for _ in range(80):
        clock.sleep_until(clock.now() + 0.01)
        turned = log(servo.state().rotation @ PEN_DOWN.T)
        np.testing.assert_allclose(np.cross(turned, [0.0, 0.3, 0.4]), 0.0, atol=1e-9)
    np.testing.assert_allclose(servo.state().rotation, goal, atol=1e-3)


def test_a_pressed_pen_feels_spring_and_friction_and_a_lifted_one_nothing():
    plate = Plate(point=np.array([0, 0, 2.0]), stiffness=5.0, damping=0.0, friction=0.2)
    sliding = np.array([30.0, 40.0, 0, 0, 0, 0])
    np.testing.assert_allclose(contact(plate, np.array([9.0, 9.0, 2.1]), sliding), 0.0)
    felt = contact(plate, np.array([9.0, 9.0, 1.0]), sliding)
    np.testing.assert_allclose(felt, [-0.6, -0.8, 5.0, 0, 0, 0], atol=1e-12)


def test_the_plate_never_pulls():
    plate = Plate(point=np.zeros(3), damping=1.0)
    away = np.array([0.0, 0.0, 100.0, 0, 0, 0])
    np.testing.assert_allclose(contact(plate, np.array([0, 0, -0.1]), away), 0.0)


def test_the_sensor_feels_hand_plate_weight_and_zero_through_its_lever():
    attitude = exp(np.array([0.3, -0.2, 0.5])) @ PEN_DOWN
    clock, lab, _, sensor = bench(rotation=attitude, sensor=SILENT_NOISE)
    lab.hand = Pull(1.0, 2.0, 3.0, 0.1, 0.2, 0.3)
    sensor.open()
    sensor.start(100.0)
    clock.sleep_until(7.01)
    (sample,) = sensor.poll()
    R = attitude @ PEN.sensor_in_tcp
    weight = wrench.of_weight(R, np.array([0, 0, -PEN.weight]), PEN.centre)
    outside = wrench.to_tcp(sample.wrench - PEN.zero - weight, R, PEN.lever)
    np.testing.assert_allclose(outside, lab.hand.value, atol=1e-12)


@pytest.mark.slow
def test_noise_has_the_stated_spread_and_the_seed_decides_it():
    def readings(seed):
        clock, _, _, sensor = bench(seed=seed)
        sensor.open()
        sensor.start(100.0)
        clock.sleep_until(27.0)
        return np.array([s.wrench for s in sensor.poll()])

    first = readings(3)
    np.testing.assert_array_equal(first, readings(3))
    assert not np.array_equal(first, readings(4))
    # Differences of neighbours: the drift drops out.
    spread = np.diff(first, axis=0).std(axis=0) / np.sqrt(2.0)
    np.testing.assert_allclose(spread, SensorParameters().noise, rtol=0.1)


def test_the_zero_drifts_slowly():
    clock, _, _, sensor = bench(sensor=replace(SILENT_NOISE, drift=np.full(6, 0.01)))
    sensor.open()
    sensor.start(100.0)
    clock.sleep_until(17.0)
    read = np.array([s.wrench for s in sensor.poll()])
    moved = read[-1] - read[0]
    assert (moved != 0.0).all()
    assert np.abs(moved).max() < 5 * 0.01 * 10.0
    np.testing.assert_allclose(read[500] - read[0], moved * 500 / (len(read) - 1), atol=1e-9)


def test_a_reading_beyond_the_range_is_clipped_and_flagged():
    clock, lab, _, sensor = bench(sensor=SILENT_NOISE)
    lab.hand = Pull(400.0, 0, 0, 0, 0, 0)
    sensor.open()
    sensor.start(100.0)
    clock.sleep_until(7.01)
    (sample,) = sensor.poll()
    assert not sample.healthy
    assert np.abs(sample.wrench).max() == 145.0


def test_an_emergency_stop_freezes_the_arm_and_refuses_set_points():
    clock, _, servo, _ = started(faults=Faults(estop_at=0.5))
    for k in range(25):
        clock.sleep_until(7.0 + 0.02 * k)
        assert servo.send(np.array([2.0 * k, 0, 0]), PEN_DOWN)
    assert servo.state().mode == "ready"
    clock.sleep_until(7.51)
    stopped = servo.state()
    assert stopped.mode == "emergency stop"
    assert not servo.send(HOME, PEN_DOWN)
    clock.sleep_until(8.0)
    np.testing.assert_array_equal(servo.state().position, stopped.position)
    with pytest.raises(InstrumentError, match="emergency stop"):
        servo.start(0.02)


def test_a_silent_sensor_sends_nothing_from_then_on():
    clock, _, _, sensor = bench(faults=Faults(silent_at=0.3))
    sensor.open()
    sensor.start(100.0)
    clock.sleep_until(8.0)
    samples = sensor.poll()
    assert len(samples) == 29
    assert samples[-1].t == pytest.approx(7.29)


def test_a_refusing_controller_takes_no_set_points_from_then_on():
    clock, _, servo, _ = started(faults=Faults(refuse_at=0.1))
    assert servo.send(HOME, PEN_DOWN)
    clock.sleep_until(7.1)
    assert not servo.send(HOME, PEN_DOWN)
    assert servo.state().mode == "ready"


def test_drag_teaching_sticks_then_slips_and_friction_never_drives():
    teaching = DragParameters()
    for force, moves in ((0.99 * 6.0, False), (1.01 * 6.0, True)):
        arm = DraggedArm(HOME, PEN_DOWN, teaching)
        arm.wrench = np.array([force, 0, 0, 0, 0, 0])
        for _ in range(50):
            arm.advance(0.01)
        assert (arm.position[0] > 1.0) == moves
    speed = arm.velocity[0]
    arm.wrench = np.zeros(6)
    for _ in range(300):
        before, arm_speed = speed, arm.velocity[0]
        arm.advance(0.01)
        speed = arm.velocity[0]
        assert 0.0 <= speed <= max(before, arm_speed)
    assert speed == 0.0


def test_drag_teaching_takes_no_set_points_and_servo_mode_no_drag():
    clock, lab, servo, _ = bench()
    assert isinstance(servo, TeachesByDrag)
    lab.hand = Pull(20.0, 0, 0, 0, 0, 0)
    servo.drag()
    clock.sleep_until(8.0)
    assert servo.state().position[0] > 10.0
    assert not servo.send(HOME, PEN_DOWN)
    with pytest.raises(InstrumentError, match="drag teaching"):
        servo.start(0.02)
