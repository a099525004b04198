import time

import numpy as np
import pytest

from dmpcli.control import guards, workcell
from dmpcli.control.watchdog import Halting
from dmpcli.errors import DmpError, InputError, InstrumentError, RefusedError
from dmpcli.instruments.clock import MonotonicClock
from dmpcli.instruments.elite import controller, stream_driver
from dmpcli.instruments.elite.controller import Controller
from dmpcli.instruments.elite.frames import FrameBuffer
from dmpcli.instruments.elite.requests import Requests
from tests.instruments.elite.scripted import HOME, WORD, Scripted, frame, refusal

READS = {
    "getRobotState",
    "get_joint_pos",
    "get_tcp_pose",
    "inverseKinematic",
}


def test_connecting_only_reads(robot, arm):
    info = arm(lookahead=0.2).open()
    assert (info.make, info.lookahead, info.period_range) == ("Elite EC66", 0.2, (0.002, 0.1))
    assert info.queues
    assert set(robot.methods()) == READS
    told = dict(robot.asked)
    assert told["get_tcp_pose"] == {"coordinate_num": -1, "tool_num": -1, "unit_type": 0}


def test_the_state_is_that_of_the_monitor(robot, arm):
    servo, before = arm(), time.monotonic()
    servo.open()
    state = servo.state()
    np.testing.assert_allclose(state.joints, np.radians(HOME))
    np.testing.assert_allclose(state.position, robot.pose[:3], atol=1e-6)
    assert (state.mode, state.detail) == ("ready", "")
    # The frame may have been made just before it was asked for.
    assert before - 0.5 <= state.t <= time.monotonic()


def test_a_start_follows_the_makers_order_and_fills_the_buffer_with_the_actual_angles(robot, arm):
    servo = arm(lookahead=0.09)
    servo.open()
    del robot.asked[:]
    servo.start(0.02)
    assert robot.methods() == [
        "getRobotMode",
        "get_estop_status",
        "getRobotState",
        "getMotorStatus",
        "getServoStatus",
        "get_transparent_transmission_state",
        "getRobotState",
        "transparent_transmission_init",
        *["tt_put_servo_joint_to_buf"] * 5,
    ]
    assert robot.begun == {"lookahead": 90, "t": 20, "smoothness": 0.1, "response_enable": 1}
    np.testing.assert_allclose(robot.points, [HOME] * 5)


def test_set_points_are_joint_angles_in_degrees_and_are_acknowledged(robot, arm, monkeypatch):
    waited, ask = [], Requests.yes

    def yes(self, method, params=None, patience=None):
        waited.append(patience)
        return ask(self, method, params, patience)

    monkeypatch.setattr(Requests, "yes", yes)
    servo = arm()
    servo.open()
    state = servo.state()
    assert not servo.send(state.position, state.rotation)
    servo.start(0.02)
    del robot.points[:]
    assert servo.send(state.position + [1.0, 0.0, 0.0], state.rotation)
    assert np.abs(np.subtract(robot.points, HOME)).max() == pytest.approx(0.1, abs=0.09)
    robot.answers["tt_put_servo_joint_to_buf"] = False
    assert not servo.send(state.position, state.rotation)
    robot.answers["tt_put_servo_joint_to_buf"] = None
    with pytest.raises(InstrumentError, match="tt_put_servo_joint_to_buf: no answer"):
        servo.send(state.position, state.rotation)
    assert waited[-1] == 0.1  # the look-ahead


def test_a_refusal_is_not_waited_upon_where_no_frame_comes(robot, arm, monkeypatch):
    waited, listen = [], Controller.fresh_joints

    def fresh(self, patience=None):
        waited.append(patience)
        return listen(self, patience)

    servo = arm(oldest=1.0)
    servo.open()
    servo.start(0.02)
    state = servo.state()
    robot.answers["tt_put_servo_joint_to_buf"] = False
    robot.sends_frames = False
    monkeypatch.setattr(Controller, "fresh_joints", fresh)
    assert not servo.send(state.position, state.rotation)
    assert sum(waited) <= stream_driver.REFUSED == 0.05


def test_the_state_after_a_refusal_tells_why(robot, arm):
    servo = arm()
    servo.open()
    servo.start(0.02)
    state = servo.state()

    def refuse(_):
        robot.monitor = {"estop": 1}
        return False

    robot.answers["tt_put_servo_joint_to_buf"] = refuse
    assert not servo.send(state.position, state.rotation)
    assert servo.state().mode == "emergency stop"


def test_without_responses_set_points_are_only_sent(robot, arm):
    servo = arm(responses="no")
    servo.open()
    servo.start(0.02)
    assert robot.begun["response_enable"] == 0
    state = servo.state()
    assert servo.send(state.position, state.rotation)
    servo.stop()  # answered, so all before it has arrived
    assert len(robot.points) == 6


def test_servos_come_on_when_motion_begins_and_not_before(robot, arm):
    robot.monitor = {"servo": 0, "synced": 0}
    status = robot.answers | {"getMotorStatus": False, "getServoStatus": False}

    def switch(params):
        robot.answers["getServoStatus"] = True
        robot.monitor = {}
        return True

    robot.answers = status | {"syncMotorStatus": True, "set_servo_status": switch}
    servo = arm()
    servo.open()
    assert servo.state().mode == "ready"
    assert "set_servo_status" not in robot.methods()
    servo.start(0.02)
    asked = robot.methods()
    assert asked.index("syncMotorStatus") < asked.index("set_servo_status")
    robot.monitor = {"servo": 0}
    time.sleep(0.05)
    state = servo.state()
    assert (state.mode, state.detail) == ("not ready", "its servos are off")


def test_servos_that_are_off_stay_off_where_that_is_asked_for(robot, arm):
    robot.monitor = {"servo": 0}
    robot.answers["getServoStatus"] = False
    servo = arm(servo="manual")
    servo.open()
    assert servo.state().mode == "not ready"
    with pytest.raises(RefusedError, match=r"servos are off.*servo=auto"):
        servo.start(0.02)
    assert "set_servo_status" not in robot.methods()


def test_servos_that_do_not_come_on_are_an_instruments_failure(robot, arm, monkeypatch):
    monkeypatch.setattr("dmpcli.instruments.elite.controller._POWER_TIME", 0.1)
    robot.answers |= {"getServoStatus": False, "set_servo_status": True}
    servo = arm()
    servo.open()
    with pytest.raises(InstrumentError, match="servos do not come on"):
        servo.start(0.02)


def test_a_program_that_runs_on_the_controller_is_not_cut_into(robot, arm, monkeypatch):
    monkeypatch.setattr("dmpcli.instruments.elite.controller._STOP_TIME", 0.05)
    robot.answers["getRobotState"] = 3
    servo = arm()
    servo.open()
    with pytest.raises(RefusedError, match="a program is running; stop it on the pendant"):
        servo.start(0.02)
    assert "transparent_transmission_init" not in robot.methods()
    assert robot.points == []


def test_an_arm_that_still_slows_down_is_waited_for(robot, arm):
    told = iter([3, 3, 0])
    robot.answers["getRobotState"] = 0
    servo = arm()
    servo.open()
    robot.answers["getRobotState"] = lambda _: next(told)
    servo.start(0.02)
    assert "transparent_transmission_init" in robot.methods()


def test_an_older_transmission_is_left_first(robot, arm):
    robot.running = 1
    robot.answers["getRobotState"] = lambda _: 3 if robot.running else 0
    servo = arm()
    servo.open()
    servo.start(0.02)
    asked = robot.methods()
    cleared = asked.index("tt_clear_servo_joint_buf")
    assert cleared < asked.index("transparent_transmission_init")
    assert ("tt_clear_servo_joint_buf", {"clear": 0}) in robot.asked


def test_a_transmission_in_which_the_arm_moves_is_somebodys(robot, arm):
    robot.running = 1
    servo = arm()
    servo.open()

    fresh = servo._driver._controller.fresh_joints

    def moving(*waited):
        robot.joints[0] += 0.1
        return fresh(*waited)

    servo._driver._controller.fresh_joints = moving
    with pytest.raises(RefusedError, match="moves in a transmission of another program"):
        servo.start(0.02)
    assert "tt_clear_servo_joint_buf" not in robot.methods()


def test_what_was_taken_over_is_told(robot, arm, caplog):
    robot.running = 1
    servo = arm()
    servo.open()
    servo.start(0.02)
    assert "took over a transmission that was left open" in caplog.text


@pytest.mark.parametrize("state", [1, 3])
def test_another_motion_is_ended_only_where_that_is_asked_for(robot, arm, caplog, state):
    told = [state]
    robot.answers["getRobotState"] = lambda _: told[0]

    def stop(_):
        told[0] = 0
        return True

    robot.answers["stop"] = stop
    servo = arm(take_over="yes")
    servo.open()
    servo.start(0.02)
    assert "ended a motion that was left under way" in caplog.text
    servo.stop()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("monitor", "mode", "detail"),
    [
        ({"estop": 1}, "emergency stop", ""),
        ({"state": 2}, "emergency stop", ""),
        ({"collision": 1}, "protective stop", "collision"),
        ({"state": 5}, "protective stop", "collision"),
        ({"state": 4}, "fault", "alarm"),
        ({"mode": 0}, "not ready", "teach mode, not in remote"),
        ({"mode": 1}, "not ready", "play mode, not in remote"),
        ({"state": 1}, "stopped", "paused"),
        ({"state": 3}, "ready", ""),
    ],
)
def test_what_forbids_motion_is_a_mode_and_its_detail(robot, arm, monitor, mode, detail):
    robot.monitor = monitor
    servo = arm()
    servo.open()
    state = servo.state()
    assert state.mode == mode
    assert detail in state.detail
    if mode != "ready":
        with pytest.raises(RefusedError, match=mode):
            guards.check_state(state)


@pytest.mark.parametrize(
    ("flag", "mode"), [({"estop": 1}, "emergency stop"), ({"collision": 1}, "protective stop")]
)
def test_a_flag_in_one_frame_is_seen_at_any_period_and_stays(robot, arm, flag, mode):
    servo = arm()
    servo.open()
    servo.start(0.02)
    (shown,) = FrameBuffer().feed(frame(**flag), servo._clock.now())
    servo._driver._controller._monitor._take(shown)
    servo._driver._controller.fresh_joints()
    for _ in range(2):
        state = servo.state()
        assert state.mode == mode
        assert "shown for a moment, and gone again" in state.detail
    servo.stop()
    begun = robot.methods().count("transparent_transmission_init")
    with pytest.raises(RefusedError, match=f"{mode}.* since it was connected; make sure"):
        servo.start(0.02)
    assert robot.methods().count("transparent_transmission_init") == begun


def test_an_alarm_that_was_cleared_on_demand_is_forgotten(robot, arm):
    robot.monitor = {"state": 4}
    robot.answers["getRobotState"] = lambda _: robot.monitor["state"]

    def clear(_):
        robot.monitor["state"] = 0
        return True

    robot.answers["clearAlarm"] = clear
    servo = arm(clear_alarm="yes")
    servo.open()
    assert servo.state().mode == "ready"
    servo.start(0.02)


@pytest.mark.parametrize(
    ("answers", "words"),
    [
        ({"getRobotMode": 0}, "in teach mode; turn the key to remote"),
        ({"get_estop_status": 1}, "emergency stop"),
        ({"getRobotState": 4}, "alarm; clear it.*clear_alarm=yes"),
        ({"getRobotState": 5}, "collision; clear it"),
        ({"getRobotState": 1}, "paused"),
        ({"transparent_transmission_init": refusal(0).replace(b"0}", b"{id}}")}, "not in remote"),
    ],
)
def test_a_robot_that_must_not_move_is_not_started(robot, arm, answers, words):
    robot.answers |= answers
    servo = arm()
    servo.open()
    with pytest.raises(RefusedError, match=words):
        servo.start(0.02)
    assert robot.points == []


@pytest.mark.parametrize(
    ("answers", "words"),
    [
        ({"getRobotMode": 3}, "no whole number from 0 to 2: 3"),
        ({"getRobotMode": True}, "no whole number"),
        ({"getServoStatus": "on"}, "neither true nor false"),
        ({"transparent_transmission_init": False}, "did not do transparent_transmission_init"),
        ({"tt_put_servo_joint_to_buf": False}, "refuses to be held where it is; see its pendant"),
        ({"getMotorStatus": refusal(0, -1, "broken").replace(b"0}", b"{id}}")}, "broken .code -1"),
    ],
)
def test_a_start_that_goes_wrong_is_an_instruments_failure(robot, arm, answers, words):
    robot.answers |= answers
    servo = arm()
    servo.open()
    with pytest.raises(InstrumentError, match=words):
        servo.start(0.02)


@pytest.mark.parametrize(
    ("answers", "words"),
    [
        ({"get_joint_pos": [1.0] * 5}, "no list of 6 numbers"),
        ({"get_joint_pos": [1.0] * 5 + [800.0]}, "no number within ±720"),
        ({"get_joint_pos": [31.0, *HOME[1:]]}, "joint 1 is at 31.00° by JSON-RPC and at 30.00°"),
        ({"get_tcp_pose": [1e9] * 6}, "no number within"),
        ({"get_tcp_pose": [0.0] * 6}, "apart; .*tool=N"),
        ({"inverseKinematic": list(HOME)}, "inverse kinematics and ours differ"),
        ({"getRobotState": None}, "getRobotState: no answer"),
    ],
)
def test_what_it_says_at_the_start_is_not_believed_blindly(robot, arm, answers, words):
    robot.answers |= answers
    servo = arm(patience=0.3)
    with pytest.raises(DmpError, match=words) as error:
        servo.open()
    assert "\n" not in str(error.value)


def test_older_controllers_send_eight_angles(robot, arm):
    robot.answers["get_joint_pos"] = [*HOME, 0.0, 0.0]
    arm().open()


def test_a_monitor_in_radians_is_told_by_an_option(robot, arm):
    robot.answers["get_joint_pos"] = list(HOME)
    robot.joints = np.radians(HOME).tolist()
    with pytest.raises(InstrumentError, match="see monitor_angle"):
        arm().open()
    servo = arm(monitor_angle="rad")
    servo.open()
    np.testing.assert_allclose(servo.state().joints, np.radians(HOME))


def test_options_reach_the_wire(robot, arm):
    robot.monitor["word"] = WORD + 1
    arm(tool=3, coordinate=0, word="no").open()
    told = dict(robot.asked)
    assert told["get_tcp_pose"] == {"coordinate_num": 0, "tool_num": 3, "unit_type": 0}
    del robot.asked[:]
    robot.pose = [0.0] * 6
    arm(check=0, word="no").open()
    assert not {"get_tcp_pose", "inverseKinematic"} & set(robot.methods())


def test_an_alarm_is_cleared_only_where_that_is_asked_for(robot, arm):
    robot.answers |= {"getRobotState": 4, "clearAlarm": True}
    arm().open()
    assert "clearAlarm" not in robot.methods()
    arm(clear_alarm="yes").open()
    assert robot.methods().count("clearAlarm") == 1


def test_a_stop_empties_the_buffer_first_and_is_done_once(robot, arm):
    servo = arm()
    servo.open()
    servo.stop()
    assert "stop" not in robot.methods()  # it was never started, so it may be another's motion
    servo.start(0.02)
    del robot.asked[:]
    servo.stop()
    servo.stop()
    servo.close()
    assert robot.asked == [("tt_clear_servo_joint_buf", {"clear": 0}), ("stop", {})]


def test_a_stop_goes_over_a_new_connection_where_the_old_one_is_gone(robot, arm):
    servo = arm()
    servo.open()
    servo.start(0.02)
    robot.answers["tt_put_servo_joint_to_buf"] = OSError
    state = servo.state()
    with pytest.raises(InstrumentError, match="closed the connection"):
        servo.send(state.position, state.rotation)
    servo.stop()
    assert robot.methods()[-2:] == ["tt_clear_servo_joint_buf", "stop"]


def test_a_stop_whose_connection_goes_only_then_is_done_over_a_new_one(robot, arm):
    servo = arm()
    servo.open()
    servo.start(0.02)
    robot.monitor = {"state": 3}
    robot.hang_up_next("tt_clear_servo_joint_buf")
    servo.stop()
    assert robot.methods()[-3:] == ["tt_clear_servo_joint_buf"] * 2 + ["stop"]


def test_an_arm_that_was_braked_by_something_else_has_stopped(robot, arm, monkeypatch):
    """No stop was done; it still plays at first, and turns, and then stands."""
    monkeypatch.setattr(controller, "_STILL_TIME", 0.02)
    servo = arm()
    servo.open()
    servo.start(0.02)
    robot.answers["stop"] = False
    robot.monitor = {"state": 3}
    waits = []

    def sleep_until(_):
        time.sleep(0.02)
        waits.append(robot.joints[0])
        robot.monitor = {} if len(waits) > 2 else {"state": 3}
        robot.joints[0] += 1.0 if len(waits) < 5 else 0.0

    monkeypatch.setattr(servo._driver._controller._clock, "sleep_until", sleep_until, raising=False)
    servo.stop()
    assert len(waits) >= 6


def test_a_stop_that_was_not_done_is_told_unless_the_robot_stands_anyway(robot, arm, monkeypatch):
    monkeypatch.setattr(controller, "_STILL_TIME", 0.02)
    monkeypatch.setattr(controller, "_STOP_TIME", 0.05)
    servo = arm()
    servo.open()
    servo.start(0.02)
    robot.answers["stop"] = False
    robot.monitor = {"state": 3}
    for _ in range(2):  # what failed is tried again
        with pytest.raises(InstrumentError, match=r"did not do stop.*press its emergency stop"):
            servo.stop()
    assert robot.methods().count("stop") == 2
    servo.start(0.02)
    robot.monitor = {"estop": 1}
    time.sleep(0.05)
    servo.stop()


def test_it_can_be_stopped_while_a_call_hangs(robot, arm):
    servo = arm()
    servo.open()
    servo.start(0.02)
    assert isinstance(servo, Halting)
    servo.halt()
    assert robot.methods()[-2:] == ["tt_clear_servo_joint_buf", "stop"]
    assert not servo.send(servo.state().position, servo.state().rotation)


def test_a_look_ahead_that_it_cannot_be_told_is_refused_before_connecting(robot, arm):
    with pytest.raises(InputError, match=r"lookahead = 0\.0995 s: must be a whole number of ms"):
        arm(lookahead=0.0995).open()
    assert not robot.methods()


@pytest.mark.parametrize(
    ("options", "period", "words"),
    [
        ({"lookahead": 0.031}, 0.016, "two servo periods or more, 0.032 s"),
        ({}, 0.0205, "whole number of ms"),
    ],
)
def test_times_that_do_not_fit_are_the_users_mistake(arm, options, period, words):
    servo = arm(**options)
    longest = servo.open().period_range[1]
    assert longest == pytest.approx(min(0.1, options.get("lookahead", 0.1) / 2.0))
    with pytest.raises(InputError, match=words):
        servo._driver.start(period)


@pytest.mark.parametrize(
    ("query", "words"),
    [
        ("lookahead=200", "lookahead = '200': a number from 0.01 to 1 s"),
        ("lookahead=nan", "a number from 0.01 to 1 s"),
        ("smoothness=2", "a number from 0 to 1"),
        ("tool=8", "a whole number from -1 to 7"),
        ("tool=1.5", "a whole number"),
        ("monitor_port=0", "a whole number from 1 to 65535"),
        ("euler=abc", "one of xyz, zyx"),
        ("servo=on", "one of auto, manual"),
        ("clear_alarm=maybe", "one of yes, no"),
        ("base_turn=45", "one of 0, 90, 180, 270"),
        ("check=-1", "a number from 0 to 100 mm"),
        ("mode=both", "one of stream, file"),
        ("look=1", "look: there is no such option; elite has monitor_port, mode, lookahead"),
    ],
)
def test_a_wrong_option_is_refused_with_what_would_do(query, words):
    with pytest.raises(InputError, match=words) as error:
        workcell.connect(f"elite://10.0.0.1?{query}", None, MonotonicClock())
    assert str(error.value).startswith("--robot elite://10.0.0.1: ")


def test_a_robot_that_is_not_there_is_one_line():
    with Scripted() as gone:
        query = gone.query
    with pytest.raises(InstrumentError, match="cannot be reached") as error:
        workcell.connect(f"elite://{query}", None, MonotonicClock()).robot.open()
    assert "\n" not in str(error.value)


def test_a_monitor_port_that_is_not_there_is_named(robot, arm):
    with pytest.raises(InstrumentError, match=r"\(monitor\): cannot be reached"):
        arm(monitor_port=1).open()
