import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.errors import RefusedError
from dmpcli.kinematics import chain
from dmpcli.kinematics.models import model
from dmpcli.simulation.elite_server.motions import (
    DECELERATION,
    JointPath,
    Policies,
    Transmission,
    joint_move,
    line_move,
    trapezoid,
)

EC66 = model("ec66")
T = 0.02
BENT = np.radians([10.0, -100.0, -100.0, -60.0, -90.0, 80.0])


class Arm:
    """What a feed is asked by: a command that goes where the legs lead."""

    def __init__(self, lookahead: float = 0.1, **policies: str) -> None:
        self.alarms: list[str] = []
        self.command = np.zeros(6)
        self.buffer = Transmission(
            lookahead, T, EC66.speeds, Policies(**policies), self.alarms.append
        )

    def put(self, *angles: float) -> list[bool]:
        return [self.buffer.put(np.full(6, a), self.command) for a in angles]

    def run(self) -> list[tuple[float, float]]:
        """All the legs that there are now: angle of joint 1 and time."""
        legs = []
        while (leg := self.buffer.feed(self.command)) is not None:
            self.command = leg[0]
            legs.append((float(leg[0][0]), leg[1]))
        return legs


@pytest.mark.parametrize(
    ("lookahead", "needed"), [(0.1, 5), (0.02, 1), (0.15, 8), (0.06, 3), (0.2, 10)]
)
def test_motion_begins_when_lookahead_over_period_points_are_in(lookahead, needed):
    arm = Arm(lookahead)
    for number in range(1, needed):
        arm.put(0.001 * number)
        assert arm.buffer.feed(arm.command) is None
        assert not arm.buffer.running
    arm.put(0.001 * needed)
    leg = arm.buffer.feed(arm.command)
    assert leg is not None
    assert leg[1] == T
    assert arm.buffer.running
    assert len(arm.buffer) == needed - 1


def test_every_point_takes_one_period():
    arm = Arm()
    arm.put(*(0.01 * k for k in range(1, 8)))
    assert arm.run() == [(pytest.approx(0.01 * k), T) for k in range(1, 8)]


def test_an_empty_buffer_holds_the_last_point_and_fills_up_anew():
    arm = Arm(underrun="hold")
    arm.put(*(0.01 * k for k in range(1, 6)))
    arm.run()
    assert not arm.buffer.running
    assert arm.command[0] == pytest.approx(0.05)
    arm.put(0.06, 0.07, 0.08, 0.09)
    assert arm.run() == []
    arm.put(0.10)
    assert [angle for angle, _ in arm.run()] == pytest.approx([0.06, 0.07, 0.08, 0.09, 0.10])
    assert arm.alarms == []


def test_an_empty_buffer_decelerates_at_the_stated_rate_along_the_last_direction():
    arm = Arm(underrun="decelerate")
    speed = 1.0  # rad/s
    arm.put(*(speed * T * k for k in range(1, 6)))
    legs = arm.run()
    speeds = np.diff([0.0] + [angle for angle, _ in legs]) / T
    np.testing.assert_allclose(speeds[:5], speed, rtol=1e-9)
    np.testing.assert_allclose(np.diff(speeds[4:]), -DECELERATION * T, rtol=1e-6)
    assert 0.0 < speeds[-1] <= DECELERATION * T
    # Between the continuous v² / 2a and one period's way less.
    way = legs[-1][0] - 5 * speed * T
    assert speed**2 / (2 * DECELERATION) - speed * T <= way <= speed**2 / (2 * DECELERATION)


def test_after_a_deceleration_the_way_to_the_next_point_keeps_to_the_joints_speed():
    arm = Arm(underrun="decelerate", jump="clamp")
    arm.put(*(2.0 * T * k for k in range(1, 6)))
    legs = arm.run()
    arm.put(*(legs[-1][0] - 0.1,) * 5)
    before = legs[-1][0]
    for angle, time in arm.run():
        assert abs(angle - before) / time <= EC66.speeds.min() * (1 + 1e-9)
        before = angle


def test_an_empty_buffer_raises_an_alarm():
    arm = Arm(underrun="alarm")
    arm.put(*(0.01 * k for k in range(1, 6)))
    arm.run()
    assert len(arm.alarms) == 1
    assert "ran empty" in arm.alarms[0]


def test_a_jump_raises_an_alarm_that_names_the_joint():
    arm = Arm(jump="alarm")
    point = np.zeros(6)
    point[2] = EC66.speeds[2] * T * 1.01
    assert not arm.buffer.put(point, arm.command)
    assert len(arm.alarms) == 1
    assert "joint 3" in arm.alarms[0]


def test_a_step_at_a_joints_speed_is_no_jump():
    arm = Arm(jump="alarm")
    assert arm.buffer.put(EC66.speeds * T, arm.command)
    assert arm.buffer.put(2 * EC66.speeds * T, arm.command)
    assert arm.alarms == []


def test_a_jump_is_ignored_and_the_next_near_point_taken():
    arm = Arm(lookahead=T, jump="ignore")
    assert arm.put(0.01, 1.0, 0.02) == [True, False, True]
    assert [angle for angle, _ in arm.run()] == pytest.approx([0.01, 0.02])
    assert arm.alarms == []


def test_a_jump_is_clamped_to_each_joints_speed():
    arm = Arm(lookahead=T, jump="clamp")
    assert arm.put(1.0) == [True]
    leg = arm.buffer.feed(arm.command)
    assert leg is not None
    np.testing.assert_allclose(leg[0], EC66.speeds * T)


def test_a_full_buffer_takes_no_more():
    arm = Arm(lookahead=1.0)
    taken = arm.put(*[0.0] * 1001)
    assert taken == [True] * 1000 + [False]


@given(st.floats(1e-3, 1e3), st.floats(1e-3, 1e3))
def test_a_trapezoid_goes_from_rest_to_rest_within_its_bounds(speed, acceleration):
    times, share = trapezoid(speed, acceleration)
    assert share[0] == pytest.approx(0.0, abs=1e-12)
    assert share[-1] == pytest.approx(1.0, abs=1e-9)
    assert np.all(np.diff(share) >= -1e-12)
    velocity = np.diff(share) / np.diff(times)
    assert velocity.max() <= speed * (1 + 1e-9)
    slope = np.abs(np.diff(velocity)) / (times[2] - times[0]) * 2 if len(times) > 2 else [0.0]
    assert np.max(slope) <= acceleration * (1 + 1e-6)
    # The least time that these bounds allow.
    ramp = min(speed / acceleration, acceleration**-0.5)
    assert times[-1] == pytest.approx(1.0 / min(speed, acceleration**0.5) + ramp)


def drive(path: JointPath, command: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    times, joints = [0.0], [command]
    while (leg := path.feed(joints[-1])) is not None:
        joints.append(leg[0])
        times.append(times[-1] + leg[1])
    assert path.finished
    return np.array(times), np.array(joints)


def test_a_joint_move_keeps_every_joints_speed_and_arrives():
    goal = BENT + np.radians([30.0, -10.0, 5.0, 0.0, 0.0, 60.0])
    times, joints = drive(joint_move(BENT, goal, 0.5 * EC66.speeds, np.full(6, 3.0)), BENT)
    np.testing.assert_allclose(joints[-1], goal, atol=1e-9)
    speeds = np.abs(np.diff(joints, axis=0))[1:] / np.diff(times)[1:, None]
    assert np.all(speeds <= 0.5 * EC66.speeds * (1 + 1e-9))
    assert speeds.max() > 0.4 * EC66.speeds.min()


def test_a_line_move_keeps_the_flange_on_the_line_at_its_speed():
    goal = BENT + np.radians([12.0, 4.0, -6.0, 2.0, 0.0, 12.0])
    times, joints = drive(line_move(EC66, BENT, goal, 100.0, 500.0, turning=False), BENT)
    at = chain.forward(EC66, joints)
    positions, rotations = at.position, at.rotation
    at = chain.forward(EC66, goal)
    end, turned = at.position, at.rotation
    along = (end - positions[0]) / np.linalg.norm(end - positions[0])
    off = (positions - positions[0]) - np.outer((positions - positions[0]) @ along, along)
    assert np.abs(off).max() < 1e-6
    np.testing.assert_allclose(positions[-1], end, atol=1e-6)
    np.testing.assert_allclose(rotations[-1], turned, atol=1e-9)
    speed = np.linalg.norm(np.diff(positions, axis=0), axis=1)[1:] / np.diff(times)[1:]
    assert speed.max() == pytest.approx(100.0, rel=1e-6)


def test_a_line_move_with_a_speed_of_the_wrong_kind_is_refused():
    with pytest.raises(RefusedError):
        line_move(EC66, BENT, BENT, 100.0, 500.0, turning=True)
