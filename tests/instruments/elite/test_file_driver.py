import numpy as np
import pytest

from dmpcli.errors import InstrumentError, RefusedError
from dmpcli.instruments.elite import controller
from dmpcli.instruments.protocols import PlanPlayer
from tests.instruments.elite.scripted import HOME, refusal


def handed(arm, count=5):
    servo = arm(mode="file")
    servo.open()
    state = servo.state()
    position = state.position + np.arange(count)[:, None] * [0.5, 0.0, 0.0]
    return servo, position, np.broadcast_to(state.rotation, (count, 3, 3))


def test_a_plan_is_sent_with_time_stamps_from_zero_and_checked_before_it_may_run(robot, arm):
    servo, position, rotation = handed(arm)
    assert isinstance(servo, PlanPlayer)
    del robot.asked[:]
    servo.upload(position, rotation, 0.02)
    assert robot.methods() == [
        "get_transparent_transmission_state",
        "start_push_pos",
        *["push_pos"] * 5,
        "stop_push_pos",
        "check_trajectory",
    ]
    head, *points = [params for _, params in robot.asked[1:7]]
    assert (head["path_lenth"], head["pos_type"], head["ret_flag"]) == (5, 0, 1)
    assert head["ref_frame"] == [0.0] * 6
    assert [point["timestamp"] for point in points] == [0.0, 0.02, 0.04, 0.06, 0.08]
    np.testing.assert_allclose(points[0]["pos"], HOME, atol=1e-9)
    np.testing.assert_allclose(head["ref_joint_pos"], HOME, atol=1e-9)
    del robot.asked[:]
    servo.start(0.02)
    assert "getRobotMode" in robot.methods()
    assert "transparent_transmission_init" not in robot.methods()
    servo.play()
    assert robot.asked[-1] == ("start_trajectory", {"speed_percent": 100})


@pytest.mark.slow
@pytest.mark.parametrize(
    ("answers", "error", "words"),
    [
        ({"check_trajectory": -1}, InstrumentError, "refuses the 5 points: their number"),
        ({"check_trajectory": -2}, InstrumentError, "their form"),
        ({"check_trajectory": -3}, InstrumentError, "their times"),
        ({"check_trajectory": -4}, InstrumentError, "no whole number from -3 to 0"),
        ({"stop_push_pos": False}, InstrumentError, "did not do stop_push_pos"),
        ({"push_pos": False}, InstrumentError, "did not do push_pos"),
        (
            {"start_push_pos": refusal(0).replace(b"0}", b"{id}}")},
            RefusedError,
            "not in remote mode",
        ),
    ],
)
def test_points_that_it_does_not_take_are_told(robot, arm, answers, error, words):
    servo, position, rotation = handed(arm)
    robot.answers |= answers
    with pytest.raises(error, match=words):
        servo.upload(position, rotation, 0.02)


def test_what_comes_up_meanwhile_ends_the_upload_and_nothing_has_to_be_stopped(robot, arm):
    """Asked for each of five points as it is converted, and again as it is sent."""
    servo, position, rotation = handed(arm)
    asked = []

    def meanwhile():
        asked.append(len(robot.methods()))
        if len(asked) == 8:
            raise InstrumentError("the disk is full")

    with pytest.raises(InstrumentError, match="the disk is full"):
        servo.upload(position, rotation, 0.02, meanwhile)
    assert robot.methods().count("push_pos") == 2
    del robot.asked[:]
    servo.stop()
    assert not robot.asked


def test_it_stops_only_what_it_played_and_takes_no_set_points(robot, arm):
    servo, position, rotation = handed(arm)
    servo.upload(position, rotation, 0.02)
    servo.start(0.02)
    servo.stop()
    assert "stop" not in robot.methods()
    assert not servo.send(position[0], rotation[0])
    servo.play()
    servo.stop()
    servo.stop()
    assert robot.methods()[-2:] == ["stop_trajectory", "stop"]
    assert robot.methods().count("stop") == 1
    servo.halt()
    assert robot.methods().count("stop_trajectory") == 2


def test_a_connection_that_goes_while_it_plays_is_noticed_in_the_state(robot, arm):
    servo, position, rotation = handed(arm)
    servo.upload(position, rotation, 0.02)
    servo.start(0.02)
    servo.play()
    assert servo.state().mode == "ready"
    robot.hang_up_next("getRobotMode")
    with pytest.raises(InstrumentError):
        servo._driver._controller.requests.whole("getRobotMode", 0, 2)
    with pytest.raises(InstrumentError, match="the connection is gone"):
        servo.state()
    servo.stop()
    assert robot.methods()[-2:] == ["stop_trajectory", "stop"]


def test_a_stop_that_fails_is_tried_again(robot, arm, monkeypatch):
    monkeypatch.setattr(controller, "_STILL_TIME", 0.02)
    monkeypatch.setattr(controller, "_STOP_TIME", 0.05)
    robot.monitor = {"state": 3}
    servo, position, rotation = handed(arm)
    servo.upload(position, rotation, 0.02)
    servo.start(0.02)
    servo.play()
    robot.answers["stop"] = False
    for _ in range(2):
        with pytest.raises(InstrumentError, match=r"did not do stop.*press its emergency stop"):
            servo.stop()
    assert robot.methods().count("stop") == 2
