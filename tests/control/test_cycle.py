"""One rule for both loops: what is late, what is missed, and what is told."""

from dataclasses import replace

import numpy as np
import pytest

from dmpcli.control.cycle import ReadyArm, StopLimits
from dmpcli.control.drag_loop import Recorder
from dmpcli.control.servo_loop import ServoLoop
from dmpcli.control.signals import Interruption
from dmpcli.errors import RefusedError
from dmpcli.instruments.clock import SimulatedClock
from dmpcli.planning.limits import Limits
from dmpcli.planning.plan import make
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.trajectory import StrokeTrajectory
from tests.control.drag_fakes import FakeServo, drag_settings
from tests.control.fake_sensors import StreamingSensor
from tests.control.test_drag_loop import WEIGHTLESS
from tests.minimum_jerk import minimum_jerk

PERIOD, LOOKAHEAD = 0.02, 0.1
AT = 1.0


class Stalling(SimulatedClock):
    """Oversleeps once, where `asleep`, else whoever computes takes as long."""

    def __init__(self, stall, asleep):
        super().__init__()
        self.stall, self.asleep, self.done = stall, asleep, False

    def sleep_until(self, t):
        stalls = self.asleep and not self.done and t > AT
        self.done = self.done or stalls
        super().sleep_until(t + (self.stall if stalls else 0.0))


class Slow(FakeServo):
    def send(self, position, rotation):
        clock = self.clock
        taken = super().send(position, rotation)
        if not clock.asleep and not clock.done and clock.now() > AT:
            clock.done = True
            SimulatedClock.sleep_until(clock, clock.now() + PERIOD + clock.stall)
        return taken


def recorded(stall, asleep):
    clock = Stalling(stall, asleep)
    servo = Slow(clock, LOOKAHEAD)
    settings = drag_settings(tool_check=1000.0)
    loop = Recorder(servo, StreamingSensor(clock), clock, WEIGHTLESS, settings, 3.0)
    return loop, loop.run().failure


def executed(stall, asleep):
    clock = Stalling(stall, asleep)
    servo = Slow(clock, LOOKAHEAD)
    t = np.arange(0.0, 3.01, PERIOD)
    u = t / t[-1]
    x = 50.0 * minimum_jerk(u)
    still = StrokeTrajectory(t, np.column_stack([x, 0 * x, 0 * x]), None, id="0")
    limits = Limits(250.0, 2250.0, 50_000.0, 0.785, 15.0, 333.0)
    plan = make(still, PERIOD, 1.0, limits, Pose(servo.position, servo.rotation), 20.0)
    arm = ReadyArm(servo, servo.open(), clock)
    loop = ServoLoop(plan, limits, StopLimits(50.0, 0.1, 50.0, 5.0), arm)
    return loop, loop.run(Interruption()).failure


@pytest.mark.slow
@pytest.mark.parametrize("asleep", [True, False])
@pytest.mark.parametrize("stall", [0.015, 0.041, 0.049, 0.051, 0.061, 0.069])
def test_a_stall_ends_both_loops_or_neither_and_they_miss_as_many_deadlines(stall, asleep):
    (one, failed), (other, other_failed) = recorded(stall, asleep), executed(stall, asleep)
    assert type(failed) is type(other_failed)
    assert isinstance(failed, RefusedError) == (stall > LOOKAHEAD / 2.0)
    assert str(failed) == str(other_failed)
    assert one.timing.missed == other.timing.missed == int(stall / PERIOD)


@pytest.mark.parametrize(
    ("late", "words"),
    [(0.1003, "100.3 ms late, over 100 ms"), (0.1000004, "100.0004 ms"), (0.123, "123 ms late")],
)
def test_no_lateness_is_rounded_onto_its_bound(late, words):
    clock = Stalling(late, asleep=True)
    servo = FakeServo(clock, 0.2)
    settings = drag_settings(tool_check=1000.0)
    ending = Recorder(servo, StreamingSensor(clock), clock, WEIGHTLESS, settings, 3.0).run()
    assert words in ending.reason


def test_an_arm_that_is_dragged_by_its_own_teaching_waits_for_nobody():
    class Led(FakeServo):
        def drag(self):
            self.calls.append("drag")

    clock = Stalling(0.53, asleep=True)
    servo = Led(clock, LOOKAHEAD)
    settings = drag_settings(tool_check=1000.0, drag="builtin")
    sensor = StreamingSensor(clock)
    sensor_tool = replace(WEIGHTLESS)
    loop = Recorder(servo, sensor, clock, sensor_tool, settings, 3.0)
    assert loop.run().reason == "duration"
    assert loop.timing.missed == 26
    assert servo.sent == []
