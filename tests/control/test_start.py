"""Before the first set-point: the arm stands where the plan begins, and is still wanted to move."""

import dataclasses
import signal

import numpy as np
import pytest

from dmpcli.control.cycle import ReadyArm, StopLimits
from dmpcli.control.servo_loop import DONE, ServoLoop
from dmpcli.control.signals import Interruption
from dmpcli.errors import InstrumentError, RefusedError
from dmpcli.spatial.rotations import exp
from tests.control.streaming_fakes import PEN_DOWN, START, WIDE, FakeClock, FakeServo, plan, stroke

WATCH = StopLimits(5.0, 0.1, 50.0, 5.0)


def bench(made=None, limits=WIDE, hindrance=lambda: None, **servo):
    made = plan(stroke(duration=2.0)) if made is None else made
    clock = FakeClock(made.period)
    robot = FakeServo(clock, **servo)
    return ServoLoop(
        made, limits, WATCH, ReadyArm(robot, robot.info, clock), hindrance=hindrance
    ), robot


def moved(by, turn=(0.0, 0.0, 0.0)):
    """By a hand, or as its brakes were released: between the start and the first set-point."""

    def deed(servo):
        servo.position = servo.position + np.array(by)
        servo.rotation = exp(np.array(turn)) @ servo.rotation

    return {-1: deed}


@pytest.mark.parametrize(
    "move", [moved([0.0, 0.0, 0.6]), moved([0.0] * 3, [0.0, 0.006, 0.0]), moved([np.nan] * 3)]
)
def test_an_arm_that_no_longer_stands_at_the_first_set_point_gets_none(move):
    loop, servo = bench(at=move)
    outcome = loop.run(Interruption())
    assert isinstance(outcome.failure, RefusedError | InstrumentError)
    assert (servo.sent, servo.calls) == ([], ["start", "stop"])


def test_the_gap_and_what_is_allowed_are_told():
    outcome = bench(position=START + [0.0, 0.0, 60.0])[0].run(Interruption())
    assert "the arm stands 60 mm, 0 rad from the first set-point, over 0.5 mm" in outcome.reason
    assert "run it again" in outcome.reason


def test_an_arm_that_sank_a_little_is_led_from_where_it_was():
    loop, servo = bench(at=moved([0.0, 0.0, -0.4], [0.004, 0.0, 0.0]))
    assert loop.run(Interruption()).reason == DONE
    np.testing.assert_array_equal(servo.sent[0][0], START)


@pytest.mark.parametrize(("speed", "passes"), [(10.0, True), (4.0, False)])
def test_the_gap_is_no_more_than_the_arm_may_go_in_a_period(speed, passes):
    """0.1 mm in 20 ms are 5 mm/s."""
    still = dataclasses.replace(plan(stroke(duration=2.0)))
    still.position[:] = START
    limits = dataclasses.replace(WIDE, speed=speed)
    outcome = bench(still, limits, at=moved([0.0, 0.1, 0.0]))[0].run(Interruption())
    assert (outcome.failure is None) == passes


@pytest.mark.parametrize(("number", "count"), [(signal.SIGINT, 1), (signal.SIGHUP, 2)])
def test_a_signal_before_the_start_starts_nothing(number, count):
    loop, servo = bench()
    interruption = Interruption()
    for _ in range(count):
        interruption.receive(number)
    outcome = loop.run(interruption)
    assert outcome.signal == number
    assert outcome.reason == f"{number.name}: stopped before anything moved"
    assert (servo.sent, servo.calls) == ([], ["stop"])


def test_a_signal_while_the_servos_are_switched_on_moves_nothing():
    loop, servo = bench()
    interruption = Interruption()

    def start(_):
        servo.calls.append("start")
        interruption.receive(signal.SIGTERM)

    servo.start = start
    outcome = loop.run(interruption)
    assert (outcome.signal, outcome.failure) == (signal.SIGTERM, None)
    assert (servo.sent, servo.calls) == ([], ["start", "stop"])


def test_what_hinders_a_run_before_it_starts_is_what_it_ends_with():
    full = InstrumentError("run.journal: No space left on device")
    loop, servo = bench(hindrance=lambda: full)
    assert loop.run(Interruption()).failure is full
    assert (servo.sent, servo.calls) == ([], ["stop"])


def test_the_pose_at_the_start_is_the_plans():
    loop, servo = bench(rotation=exp(np.array([0.0, 0.0, 0.5])) @ PEN_DOWN)
    assert "0.5 rad from the first" in loop.run(Interruption()).reason
    assert servo.sent == []
