from dataclasses import replace

import numpy as np
import pytest

from dmpcli.control import guards
from dmpcli.control.guards import FollowingErrorMonitor
from dmpcli.errors import InputError, InstrumentError, RefusedError
from dmpcli.instruments.protocols import RobotState, ServoInfo
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.rotations import exp

BOX = (-1.0, 1.0, -2.0, 2.0, -3.0, 3.0)
INFO = ServoInfo("fake", (0.002, 0.1), 0.2)
PLACE, LEVEL = np.array([0.5, -1.5, 2.5]), np.eye(3)
NAN = np.array([0.0, np.nan, 0.0])


def state(position=PLACE, rotation=LEVEL, mode="ready"):
    return RobotState(0.0, position, rotation, mode)


def test_an_arm_that_is_ready_and_inside_may_go_on():
    guards.check_state(state(), BOX)
    guards.check_state(state(1e9 * PLACE), None)


@pytest.mark.parametrize(
    ("bad", "error", "words"),
    [
        (state(mode="protective stop"), RefusedError, "protective stop"),
        (state(NAN), InstrumentError, "not a number"),
        (state(rotation=np.full((3, 3), np.inf)), InstrumentError, "not a number"),
        (state(PLACE + [0.6, 0, 0]), RefusedError, r"the tool at x = 1\.100 mm"),
        (state(PLACE - [0, 0.6, 0]), RefusedError, r"the tool at y = -2\.100 mm"),
    ],
)
def test_another_may_not(bad, error, words):
    with pytest.raises(error, match=words):
        guards.check_state(bad, BOX)


def test_only_a_pose_inside_is_sent():
    guards.check_setpoint(Pose(PLACE, LEVEL), BOX)
    for position, rotation in ((NAN, LEVEL), (PLACE, LEVEL * np.nan), (2 * PLACE, LEVEL)):
        with pytest.raises(RefusedError, match="next set-point"):
            guards.check_setpoint(Pose(position, rotation), BOX)


def test_a_period_out_of_the_robots_range_is_the_users_mistake():
    for period in (0.002, 0.1):
        guards.check_period(INFO, period, "--period")
    for period in (0.001, 0.2):
        with pytest.raises(
            InputError, match=r"--period: the fake robot .* 0\.002 to 0\.1 s .*500 Hz"
        ):
            guards.check_period(INFO, period, "--period")


def test_a_period_between_two_of_the_robots_steps_is_the_users_mistake():
    info = replace(INFO, period_step=0.001)
    for period in (1.0 / 50.0, 1.0 / 250.0, 0.003, 0.007):
        guards.check_period(info, period, "--period")
    for period in (1.0 / 60.0, 0.0205):
        with pytest.raises(InputError, match="whole multiples of 1 ms"):
            guards.check_period(info, period, "--period")


@pytest.mark.parametrize(("lookahead", "limit"), [(0.2, 0.1), (0.0, 0.02)])
def test_half_the_look_ahead_or_a_period_is_late(lookahead, limit):
    info = ServoInfo("fake", (0.002, 0.1), lookahead)
    guards.check_late(limit, info, 0.02)
    for late in (limit + 0.001, np.nan):
        with pytest.raises(RefusedError, match="late"):
            guards.check_late(late, info, 0.02)


def test_the_trail_reaches_back_over_the_look_ahead_and_no_further():
    trail = FollowingErrorMonitor(INFO, 0.02, 5.0, 0.1)
    trail.check(state())
    for i in range(17):
        trail.add(Pose(PLACE + [10.0 * i, 0.0, 0.0], LEVEL))
    # 0.2 s of look-ahead and 0.1 s more: the last sixteen.
    trail.check(state(PLACE + [10.0, 4.9, 0.0]))
    with pytest.raises(RefusedError, match=r"following error 10\.00 mm"):
        trail.check(state(PLACE))
    with pytest.raises(RefusedError, match=r"0\.200 rad"):
        trail.check(state(PLACE + [10.0, 0.0, 0.0], exp(np.array([0.0, 0.2, 0.0]))))


def test_everything_is_left_whatever_one_of_them_raises():
    done = []

    def fail(name, error):
        done.append(name)
        raise error(name)

    first = guards.leave(
        lambda: fail("stop", InstrumentError),
        lambda: fail("close", InstrumentError),
        lambda: done.append("sensor"),
    )
    assert done == ["stop", "close", "sensor"]
    assert str(first) == "stop"
    done.clear()
    with pytest.raises(ZeroDivisionError):
        guards.leave(lambda: fail("stop", ZeroDivisionError), lambda: done.append("sensor"))
    assert done == ["stop", "sensor"]
    assert guards.leave() is None


def test_forces_count_against_the_force_and_torques_against_the_torque_alone():
    force, torque = np.array([0.0, 3.0, -4.0]), np.array([-0.3, 0.0, 0.4])
    guards.check_wrench(np.concatenate([force, torque]), 5.01, 0.51)
    guards.check_wrench(np.concatenate([0.0 * force, 20.0 * torque]), 5.0, 10.1)
    guards.check_wrench(np.concatenate([20.0 * force, 0.0 * torque]), 101.0, 0.1)
    for limits in ((4.99, 0.51), (5.01, 0.49)):
        with pytest.raises(RefusedError):
            guards.check_wrench(np.concatenate([force, torque]), *limits)


def test_what_is_met_exactly_is_kept_at_every_limit():
    low, high = np.array(BOX[::2]), np.array(BOX[1::2])
    for axis in range(3):
        for border, out in ((low, -np.inf), (high, np.inf)):
            place = 0.5 * (low + high)
            place[axis] = border[axis]
            guards.check_inside(place, BOX, "the tool")
            place[axis] = np.nextafter(border[axis], out)
            with pytest.raises(RefusedError, match=f"the tool at {'xyz'[axis]} = "):
                guards.check_inside(place, BOX, "the tool")
    wrench = np.array([0.0, 3.0, -4.0, 0.0, 0.75, 1.0])
    guards.check_wrench(wrench, 5.0, 1.25)
    with pytest.raises(RefusedError, match=r"force 5 N .* over 5 N|--max-force"):
        guards.check_wrench(wrench, np.nextafter(5.0, 0.0), 1.25)
    with pytest.raises(RefusedError, match="--max-torque"):
        guards.check_wrench(wrench, 5.0, np.nextafter(1.25, 0.0))


def test_the_following_error_is_that_of_the_nearest_set_point_up_to_its_limits():
    trail = FollowingErrorMonitor(INFO, 0.02, 5.0, 0.1)
    assert trail.strayed(state(PLACE + 99.0)) == (0.0, 0.0)
    assert trail.last is None
    trail.add(Pose(PLACE, LEVEL))
    trail.add(Pose(PLACE + [8.0, 0.0, 0.0], exp(np.array([0.0, 0.0, 0.3]))))
    assert trail.last.position[0] == PLACE[0] + 8.0
    trail.check(state(PLACE + [0.0, 3.0, 4.0]))
    with pytest.raises(RefusedError, match=r"following error 5\.0"):
        trail.check(state(PLACE + [0.0, 3.0, 4.0078125]))
    # Place and attitude may be those of different ones.
    distance, angle = trail.strayed(state(PLACE, exp(np.array([0.0, 0.0, 0.25]))))
    assert (distance, angle) == (0.0, pytest.approx(0.05))
    trail.check(state(PLACE, exp(np.array([0.0, 0.0, -0.0999]))))
    with pytest.raises(RefusedError, match="following error"):
        trail.check(state(PLACE, exp(np.array([0.0, 0.0, -0.1001]))))
    with pytest.raises(RefusedError):
        trail.check(state(NAN))


@pytest.mark.parametrize(("lookahead", "kept"), [(0.0, 6), (0.1, 11), (0.105, 12)])
def test_it_remembers_the_look_ahead_and_a_tenth_of_a_second(lookahead, kept):
    trail = FollowingErrorMonitor(ServoInfo("fake", (0.002, 0.1), lookahead), 0.02, 5.0, 0.1)
    for i in range(50):
        trail.add(Pose(np.array([10.0 * i, 0.0, 0.0]), LEVEL))
    oldest = 10.0 * (50 - kept)
    assert trail.strayed(state(np.array([oldest, 0.0, 0.0])))[0] == 0.0
    assert trail.strayed(state(np.array([oldest - 10.0, 0.0, 0.0])))[0] == 10.0


def test_why_an_arm_is_not_ready_is_told_with_what_to_do():
    with pytest.raises(RefusedError) as stopped:
        guards.check_ready(state(mode="emergency stop"))
    assert str(stopped.value) == (
        "robot: emergency stop; release it and clear it on the pendant and try again"
    )
    with pytest.raises(RefusedError) as fault:
        guards.check_ready(replace(state(mode="fault"), detail="axis 3"))
    assert str(fault.value) == "robot: fault (axis 3); clear it on the pendant and try again"


class Playing:
    def upload(self, *_):
        pass

    def play(self):
        pass


def test_who_plays_whole_plans_is_asked_for_on_purpose():
    guards.check_streams(object())
    guards.check_playing(object(), allowed=False)
    guards.check_playing(Playing(), allowed=True)
    with pytest.raises(InputError, match="mode=file only plays"):
        guards.check_streams(Playing())
    with pytest.raises(InputError, match="--allow-file-mode"):
        guards.check_playing(Playing(), allowed=False)
