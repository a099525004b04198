import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dmpcli.simulation.elite_server.behaviour import Behaviour
from dmpcli.simulation.elite_server.faults import Event
from dmpcli.simulation.elite_server.motions import Policies
from dmpcli.simulation.elite_server.parameters import (
    BAD_PARAMS,
    FAILED,
    NO_METHOD,
    NOT_REMOTE,
    RpcError,
)
from dmpcli.simulation.mock.parameters import PEN
from tests.simulation.elite_server.virtual_fakes import START, Bench

STOP, PAUSE, ESTOP, PLAY, ERROR, COLLISION = range(6)


def refused(bench: Bench, method: str, **params) -> int:
    with pytest.raises(RpcError) as caught:
        bench.call(method, **params)
    return caught.value.code


def test_it_stands_in_remote_mode_with_its_servos_off_and_not_synchronised():
    bench = Bench()
    assert bench.call("getRobotState") == STOP
    assert bench.call("getRobotMode") == 2
    assert bench.call("getServoStatus") is False
    assert bench.call("getMotorStatus") is False
    assert bench.call("get_estop_status") == 0
    assert bench.call("get_transparent_transmission_state") == 0


def test_what_the_makers_clients_ask_at_the_start_is_answered():
    """As elirobots 0.0.7 asks, whose enumerations know these numbers; 3, 6 and 12 are arms."""
    bench = Bench()
    assert bench.call("getRobotType") == 62
    assert bench.call("getRobotSubtype") == 6
    for method in ("getCurrentCoord", "getCycleMode", "getToolNumber", "getUserNumber"):
        assert bench.call(method) in range(8)
    assert isinstance(bench.call("getSoftVersion"), str)
    # The key may stand anywhere for what only reads.
    bench.lab.controller.switch(0)
    assert bench.call("getRobotSubtype") == 6


def test_servos_go_on_only_once_the_encoders_are_synchronised():
    bench = Bench()
    assert bench.call("set_servo_status", status=1) is False
    assert bench.call("syncMotorStatus") is True
    assert bench.call("set_servo_status", status=1) is True
    assert bench.call("getServoStatus") is True


def test_nothing_moves_while_the_servos_are_off():
    bench = Bench()
    joints = list(bench.degrees)
    assert bench.call("moveByJoint", targetPos=joints, speed=10) is False
    assert bench.call("transparent_transmission_init", lookahead=100, t=20) is False


@pytest.mark.parametrize("mode", [0, 1])
def test_out_of_remote_mode_it_only_answers_questions(mode):
    bench = Bench(events=(Event("mode", None, mode),))
    assert bench.call("getRobotMode") == mode
    assert len(bench.call("get_joint_pos")) == 6
    for method in ("clearAlarm", "syncMotorStatus", "moveByJoint", "stop", "start_push_pos"):
        assert refused(bench, method) == NOT_REMOTE == -32693


def test_an_unknown_method_is_an_error():
    assert refused(Bench(), "makeCoffee") == NO_METHOD


@pytest.mark.parametrize(
    ("method", "params"),
    [
        ("moveByJoint", {}),
        ("moveByJoint", {"targetPos": [0] * 5, "speed": 10}),
        ("moveByJoint", {"targetPos": ["0"] * 6, "speed": 10}),
        ("moveByJoint", {"targetPos": [0] * 6, "speed": 0}),
        ("moveByJoint", {"targetPos": [10**400] * 6, "speed": 1}),
        ("transparent_transmission_init", {"lookahead": 5, "t": 2}),
        ("transparent_transmission_init", {"lookahead": 100, "t": 101}),
        ("transparent_transmission_init", {"lookahead": 20, "t": 40}),
        ("set_servo_status", {"status": 2}),
        ("set_servo_status", {"status": True}),
        ("get_tcp_pose", {"unit_type": 3}),
    ],
)
def test_wrong_parameters_are_an_error(method, params):
    assert refused(Bench().switch_on(), method, **params) == BAD_PARAMS


def test_joints_are_told_in_degrees_and_the_old_method_tells_eight():
    bench = Bench()
    np.testing.assert_allclose(bench.call("get_joint_pos"), np.degrees(bench.arm.joints), atol=1e-6)
    np.testing.assert_allclose(bench.call("getRobotPos"), [*np.degrees(bench.arm.joints), 0, 0])


def test_the_pose_is_told_in_mm_and_rad_or_degrees():
    bench = Bench()
    pose = bench.call("get_tcp_pose")
    np.testing.assert_allclose(pose[:3], START, atol=1e-6)
    assert abs(pose[3]) == pytest.approx(np.pi, abs=1e-6)
    degrees = bench.call("get_tcp_pose", unit_type=0)
    np.testing.assert_allclose(degrees[3:], np.degrees(pose[3:]), atol=1e-4)


def test_tool_number_zero_is_the_flange():
    pose = Bench().call("get_tcp_pose", tool_num=0)
    np.testing.assert_allclose(pose[:3], START + [0.0, 0.0, 160.0], atol=1e-6)


@pytest.mark.parametrize(("euler", "scipys"), [("xyz", "XYZ"), ("zyx", "xyz")])
def test_the_euler_angles_are_those_of_the_chosen_convention(euler, scipys):
    # scipy: capitals turn about the moving axes, small letters about the fixed ones.
    R = Rotation.from_euler("XYZ", [3.0, 0.2, -0.3]).as_matrix()
    bench = Bench(habits=Behaviour(euler=euler), rotation=R)
    angles = bench.call("get_tcp_pose")[3:]
    np.testing.assert_allclose(Rotation.from_euler(scipys, angles).as_matrix(), R, atol=1e-5)
    # And back, by its own inverse kinematics.
    found = bench.call("inverseKinematic", targetPose=[*START, *angles])
    np.testing.assert_allclose(found, bench.degrees, atol=1e-3)


def test_its_kinematics_undo_each_other_and_stay_near_the_reference():
    bench = Bench()
    q = bench.degrees + [3.0, -2.0, 4.0, 5.0, -6.0, 7.0]
    pose = bench.call("positiveKinematic", targetPos=list(q))
    found = bench.call("inverseKinematic", targetPose=pose, referencePos=list(q))
    np.testing.assert_allclose(found, q, atol=1e-3)
    turned = q - [0.0, 0.0, 0.0, 0.0, 0.0, 360.0]
    found = bench.call("inverseKinematic", targetPose=pose, referencePos=list(turned - 10.0))
    np.testing.assert_allclose(found, turned, atol=1e-3)


def test_a_pose_out_of_reach_is_an_error():
    pose = [2000.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    assert refused(Bench(), "inverseKinematic", targetPose=pose) == FAILED


def test_a_joint_move_plays_until_it_has_arrived():
    bench = Bench(lag=0.02).switch_on()
    goal = bench.degrees + [20.0, -5.0, 0.0, 0.0, 0.0, 10.0]
    assert bench.call("moveByJoint", targetPos=[*goal, 0.0, 0.0], speed=50, acc=80, dec=80)
    bench.wait(0.05)
    assert bench.call("getRobotState") == PLAY
    assert bench.call("moveByJoint", targetPos=list(goal), speed=50) is False  # one at a time
    bench.wait(2.0)
    assert bench.call("getRobotState") == STOP
    np.testing.assert_allclose(bench.degrees, goal, atol=1e-2)


def test_a_move_beyond_a_joints_limit_is_not_made():
    bench = Bench().switch_on()
    goal = bench.degrees
    goal[2] = 161.0
    assert bench.call("moveByJoint", targetPos=list(goal), speed=50) is False


def test_a_line_move_takes_the_tcp_to_the_joints_given():
    bench = Bench().switch_on()
    goal = bench.degrees + [4.0, 2.0, -3.0, 1.0, 0.0, 4.0]
    assert bench.call("moveByLine", targetPos=list(goal), speed=200, speed_type=0)
    bench.wait(3.0)
    np.testing.assert_allclose(bench.degrees, goal, atol=1e-6)


def test_a_paused_move_waits_and_goes_on():
    bench = Bench().switch_on()
    goal = bench.degrees + [20.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    assert bench.call("pause") is False
    bench.call("moveByJoint", targetPos=list(goal), speed=20)
    bench.wait(0.3)
    assert bench.call("pause") is True
    assert bench.call("getRobotState") == PAUSE
    held = bench.degrees
    bench.wait(5.0)
    np.testing.assert_array_equal(bench.degrees, held)
    assert bench.call("run") is True
    bench.wait(5.0)
    np.testing.assert_allclose(bench.degrees, goal, atol=1e-9)
    assert bench.call("run") is False


def test_stop_stands_still_at_once():
    bench = Bench(lag=0.02).switch_on()
    bench.call("moveByJoint", targetPos=list(bench.degrees + 20.0), speed=50)
    bench.wait(0.4)
    assert bench.call("stop") is True
    held = bench.degrees
    bench.wait(1.0)
    np.testing.assert_array_equal(bench.degrees, held)
    assert bench.call("getRobotState") == STOP


def test_the_emergency_stop_is_brief_in_the_state_and_lasting_in_its_own_status():
    bench = Bench(events=(Event("estop", 0.2),)).begin()
    bench.wait(0.19)
    assert bench.call("get_estop_status") == 0
    bench.wait(0.02)
    assert bench.call("getRobotState") == ESTOP
    assert bench.call("getServoStatus") is False
    bench.wait(1.0)
    assert bench.call("getRobotState") == STOP
    assert bench.call("get_estop_status") == 1
    assert bench.call("clearAlarm") is False
    assert bench.call("set_servo_status", status=1) is False


def test_a_collision_stands_until_the_alarm_is_cleared():
    bench = Bench(events=(Event("collision", 0.1),)).begin()
    bench.wait(0.2)
    assert bench.call("getRobotState") == COLLISION
    assert bench.call("get_transparent_transmission_state") == 0
    assert bench.call("clearAlarm") is True
    assert bench.call("getRobotState") == STOP


def test_the_key_turned_while_it_moves_stops_it():
    bench = Bench(events=(Event("mode", 0.15, 0),)).begin()
    step = np.array([0.5, 0.0, 0.0, 0.0, 0.0, 0.0])
    start = bench.degrees
    for k in range(1, 30):
        bench.put(start + k * step)
    bench.wait(0.15)
    held = bench.degrees
    bench.wait(0.2)
    np.testing.assert_allclose(bench.degrees, held)
    assert refused(bench, "tt_put_servo_joint_to_buf", targetPos=list(held)) == NOT_REMOTE


def test_points_move_the_arm_once_the_lookahead_is_full_and_then_one_a_period():
    bench = Bench().begin(lookahead=100, t=20)
    assert bench.call("get_transparent_transmission_state") == 1
    start, step = bench.degrees, np.full(6, 0.1)
    for k in range(1, 5):
        assert bench.put(start + k * step) is True
    bench.wait(0.5)
    np.testing.assert_array_equal(bench.degrees, start)
    bench.put(start + 5 * step)
    bench.wait(0.03)
    np.testing.assert_allclose(bench.degrees, start + 1.5 * step, atol=1e-9)
    bench.wait(0.07)
    np.testing.assert_allclose(bench.degrees, start + 5 * step, atol=1e-9)


def test_an_init_within_a_transmission_is_refused_until_the_buffer_is_cleared():
    bench = Bench().begin()
    assert bench.call("transparent_transmission_init", lookahead=100, t=20) is False
    assert bench.call("tt_clear_servo_joint_buf", clear=0) is True
    assert bench.call("get_transparent_transmission_state") == 0
    assert bench.call("transparent_transmission_init", lookahead=100, t=20) is True


def test_without_response_a_point_is_not_answered():
    bench = Bench().begin(response=0)
    assert bench.put(bench.degrees) is None


def test_a_point_without_a_transmission_is_not_taken():
    bench = Bench().switch_on()
    assert bench.put(bench.degrees) is False


def test_a_point_may_be_a_pose():
    bench = Bench().begin(lookahead=20)
    pose = bench.call("get_tcp_pose")
    pose[0] += 1.0
    assert bench.call("tt_put_servo_joint_to_buf", targetPose=pose) is True
    bench.wait(0.1)
    np.testing.assert_allclose(bench.arm.posture.position, START + [1.0, 0.0, 0.0], atol=1e-4)


def test_a_point_beyond_a_joints_limit_raises_an_alarm():
    bench = Bench().begin()
    point = bench.degrees
    point[0] = 361.0
    assert bench.put(point) is False
    assert bench.call("getRobotState") == ERROR
    assert bench.call("getServoStatus") is False
    assert bench.call("clearAlarm") is True
    assert bench.call("getRobotState") == STOP


@pytest.mark.parametrize(("underrun", "state"), [("hold", PLAY), ("alarm", ERROR)])
def test_an_empty_buffer_does_what_was_chosen(underrun, state):
    bench = Bench(policies=Policies(underrun=underrun)).begin()
    for k in range(1, 6):
        bench.put(bench.degrees + 0.01 * k)
    bench.wait(0.2)
    assert bench.call("getRobotState") == state


def test_a_jump_raises_an_alarm_and_ends_the_transmission():
    bench = Bench(policies=Policies(jump="alarm")).begin()
    assert bench.put(bench.degrees + 10.0) is False
    assert bench.call("getRobotState") == ERROR
    assert "over its speed" in bench.controller.alarm
    assert bench.call("get_transparent_transmission_state") == 0


def test_a_controller_that_refuses_takes_no_points():
    bench = Bench(events=(Event("refuse", 0.1),)).begin()
    assert bench.put(bench.degrees) is True
    bench.wait(0.1)
    assert bench.put(bench.degrees) is False
    assert bench.call("getRobotState") == PLAY


def pushed(bench: Bench, times: list[float], length: int | None = None) -> np.ndarray:
    start = bench.degrees
    points = start + np.outer(np.arange(len(times)), [0.5, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert bench.call("start_push_pos", path_lenth=length or len(times), pos_type=0)
    for time, point in zip(times, points, strict=True):
        assert bench.call("push_pos", timestamp=time, pos=list(point))
    assert bench.call("stop_push_pos")
    return points


def test_a_time_stamped_file_is_played_at_its_times():
    bench = Bench().switch_on()
    points = pushed(bench, [0.0, 0.1, 0.2, 0.4])
    assert bench.call("check_trajectory") == 0
    assert bench.call("start_trajectory", speed_percent=100)
    bench.wait(0.15)
    assert bench.call("getRobotState") == PLAY
    np.testing.assert_allclose(bench.degrees, 0.5 * (points[1] + points[2]), atol=1e-4)
    bench.wait(0.15)
    np.testing.assert_allclose(bench.degrees, 0.5 * (points[2] + points[3]), atol=1e-4)
    bench.wait(0.2)
    np.testing.assert_allclose(bench.degrees, points[3], atol=1e-9)
    assert bench.call("getRobotState") == STOP


def test_a_time_stamped_file_at_half_speed_takes_twice_as_long():
    bench = Bench().switch_on()
    points = pushed(bench, [0.0, 0.1, 0.2])
    bench.call("start_trajectory", speed_percent=50)
    bench.wait(0.2)
    np.testing.assert_allclose(bench.degrees, points[1], atol=1e-4)


@pytest.mark.parametrize(
    ("times", "length", "verdict"),
    [([0.0, 0.1], 3, -1), ([0.1, 0.2], None, -3), ([0.0, 0.2, 0.2], None, -3)],
)
def test_a_wrong_file_is_named_by_its_check_and_not_played(times, length, verdict):
    bench = Bench().switch_on()
    pushed(bench, times, length)
    assert bench.call("check_trajectory") == verdict
    assert bench.call("start_trajectory", speed_percent=100) is False


def test_a_file_with_a_damaged_point_is_of_a_wrong_format():
    bench = Bench().switch_on()
    bench.call("start_push_pos", path_lenth=2, pos_type=0)
    bench.call("push_pos", timestamp=0.0, pos=list(bench.degrees))
    assert bench.call("push_pos", timestamp=0.1, pos=[1, 2, 3]) is False
    bench.call("stop_push_pos")
    assert bench.call("check_trajectory") == -2


def test_a_file_may_hold_poses():
    bench = Bench().switch_on()
    pose = bench.call("get_tcp_pose")
    bench.call("start_push_pos", path_lenth=2, pos_type=1, ref_joint_pos=list(bench.degrees))
    for k in range(2):
        assert bench.call("push_pos", timestamp=0.1 * k, pos=[pose[0] + k, *pose[1:]])
    bench.call("stop_push_pos")
    assert bench.call("start_trajectory", speed_percent=100)
    bench.wait(0.3)
    np.testing.assert_allclose(bench.arm.posture.position, START + [1.0, 0.0, 0.0], atol=1e-4)


@pytest.mark.parametrize(
    ("jump", "started"), [("alarm", False), ("ignore", False), ("clamp", True)]
)
def test_a_file_that_begins_elsewhere_does_what_was_chosen(jump, started):
    bench = Bench(policies=Policies(jump=jump)).switch_on()
    pushed(bench, [0.0, 0.1])
    bench.call("moveByJoint", targetPos=list(bench.degrees + 5.0), speed=100)
    bench.wait(3.0)
    assert bench.call("start_trajectory", speed_percent=100) is started
    assert (bench.call("getRobotState") == ERROR) is (jump == "alarm")


def test_the_tool_is_the_labs():
    assert Bench().arm.tool is PEN
