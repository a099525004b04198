import dataclasses
from typing import ClassVar

import numpy as np
import pytest

from dmpcli.control.cycle import ReadyArm, StopLimits
from dmpcli.control.force_sensing import Sensing
from dmpcli.control.force_tracking import ForceInput
from dmpcli.control.playback import Playback
from dmpcli.control.servo_loop import DONE
from dmpcli.control.signals import Interruption
from dmpcli.errors import InputError, InstrumentError, RefusedError
from dmpcli.instruments.protocols import Sample, SensorInfo
from dmpcli.spatial.pose import Pose
from tests.control.streaming_fakes import WIDE, FakeClock, FakeServo, plan, rows_of, stroke
from tests.control.test_arrival import line, made, tour

WATCH = StopLimits(5.0, 0.1, 50.0, 5.0)
PERIOD = 0.02


class Player(FakeServo):
    """Plays what was handed over, by its own clock: `delay` s later, `pace` times as fast."""

    delay, pace = 0.06, 1.0
    begun = None
    deeds: ClassVar = {}

    def upload(self, position, rotation, period, meanwhile):
        self.calls.append("upload")
        for number in range(len(position)):
            self.pushed = number
            self.deeds.get(number, lambda: None)()
            meanwhile()
        self.course, self.period = (position, rotation), period

    def play(self):
        self.calls.append("play")
        self.begun = self.clock.now()

    def send(self, position, rotation):
        raise AssertionError("a player takes no set-points")

    def state(self):
        if self.begun is not None and not self.stuck:
            played = self.pace * (self.clock.now() - self.begun - self.delay) / self.period
            at = int(np.clip(played, 0, len(self.course[0]) - 1))
            self.position, self.rotation = self.course[0][at], self.course[1][at]
        return super().state()


class Bench:
    def __init__(self, jumps=None, at=None, **changes):
        self.plan = plan(stroke(duration=3.0, turn=0.3))
        self.clock = FakeClock(PERIOD, jumps)
        self.servo = Player(self.clock, at=at)
        for name, value in changes.items():
            setattr(self.servo, name, value)
        self.interruption = Interruption()
        self.arm = ReadyArm(self.servo, self.servo.info, self.clock)
        self.loop = Playback(self.plan, WIDE, WATCH, self.arm)

    def run(self):
        return self.loop.run(self.interruption)


def test_the_whole_plan_is_handed_over_before_anything_moves():
    bench = Bench()
    assert bench.run().reason == DONE
    assert bench.servo.calls == ["upload", "start", "play", "stop"]
    position, rotation = bench.servo.course
    np.testing.assert_array_equal(position, bench.plan.position)
    np.testing.assert_array_equal(rotation, bench.plan.rotation)
    rows = rows_of(bench.loop.log)
    assert [row.phase for row in rows][-1] == "stop"
    np.testing.assert_allclose(rows[-1].actual[0], bench.plan.position[-1])
    # Seen where it is played to, planned where it should be by now.
    assert np.linalg.norm(rows[75].actual[0] - bench.plan.position[72]) < 1e-9
    np.testing.assert_allclose(rows[75].planned[0], bench.plan.position[75])
    assert bench.loop.drawn == ["0"]


def test_several_plans_are_one():
    first = plan(stroke(duration=2.0))
    end = Pose(first.position[-1], first.rotation[-1])
    second = dataclasses.replace(plan(stroke(duration=2.0), start=end, approach=100.0), id="1")
    clock = FakeClock(PERIOD)
    servo = Player(clock)
    arm = ReadyArm(servo, servo.info, clock)
    loop = Playback(first, WIDE, WATCH, arm, then=[second])
    assert loop.run(Interruption()).reason == DONE
    assert len(servo.course[0]) == len(first) + len(second)
    assert loop.drawn == ["0", "1"]


@pytest.mark.parametrize("pace", [0.985, 1.015])
def test_a_controllers_clock_may_differ_a_little(pace):
    assert Bench(pace=pace).run().reason == DONE


@pytest.mark.parametrize("change", [{"pace": 0.7}, {"pace": 1.3}, {"stuck": True}])
def test_an_arm_that_is_not_where_the_plan_is_by_now_is_stopped(change):
    bench = Bench(**change)
    outcome = bench.run()
    assert isinstance(outcome.failure, RefusedError)
    assert "following error" in outcome.reason
    assert bench.servo.calls[-1] == "stop"


@pytest.mark.parametrize("late", [0, 1, 50])
def test_after_a_late_cycle_the_plan_is_where_it_is_by_then_for_the_controller_did_not_wait(late):
    bench = Bench(jumps={late: 0.31})
    assert bench.run().reason == DONE
    rows = rows_of(bench.loop.log)
    assert rows[late].deadline == pytest.approx((late + 15) * PERIOD)
    assert rows[late].lateness == pytest.approx(0.01)
    assert rows[late + 1].deadline == pytest.approx((late + 16) * PERIOD)
    np.testing.assert_allclose(rows[late].planned[0], bench.plan.position[late + 15])
    assert np.linalg.norm(rows[late].actual[0] - bench.plan.position[late + 12]) < 1e-9
    assert bench.loop.timing.missed == 15


def test_a_signal_is_a_stop_by_the_controller():
    bench = Bench(at={40: lambda servo: bench.interruption.receive(2)})
    outcome = bench.run()
    assert (outcome.reason, outcome.signal) == ("SIGINT: stopped by the controller", 2)
    assert len(bench.loop.log) == 41
    assert bench.servo.calls[-1] == "stop"


@pytest.mark.parametrize("count", [1, 2])
def test_a_signal_during_the_upload_ends_it_and_starts_nothing(count):
    def receive():
        for _ in range(count):
            bench.interruption.receive(1)

    bench = Bench(deeds={17: receive})
    outcome = bench.run()
    assert (outcome.reason, outcome.signal) == ("SIGHUP: stopped before anything moved", 1)
    assert (bench.servo.calls, bench.servo.pushed) == (["upload", "stop"], 17)
    assert len(bench.loop.log) == 0


def test_a_signal_while_the_servos_are_switched_on_plays_nothing():
    bench = Bench()
    bench.servo.start = lambda _: bench.interruption.receive(2)
    assert bench.run().signal == 2
    assert bench.servo.calls == ["upload", "stop"]


def test_what_hinders_during_the_upload_ends_it():
    bench = Bench()
    full = InstrumentError("the disk is full")
    found = []
    bench.servo.deeds = {30: lambda: found.append(full)}
    loop = Playback(
        bench.plan, WIDE, WATCH, bench.arm, hindrance=lambda: found[0] if found else None
    )
    assert loop.run(Interruption()).failure is full
    assert bench.servo.calls == ["upload", "stop"]


def test_an_arm_that_was_moved_during_the_upload_does_not_play():
    bench = Bench()
    bench.servo.deeds = {30: lambda: setattr(bench.servo, "position", bench.plan.position[40])}
    outcome = bench.run()
    assert isinstance(outcome.failure, RefusedError)
    assert "from the first set-point" in outcome.reason
    assert bench.servo.calls == ["upload", "start", "stop"]


def test_the_sensor_is_heard_during_the_upload():
    """It would fill a mailbox meanwhile; and what it says must be believed now, not in motion."""

    class Sensor:
        polls = 0

        def poll(self):
            self.polls += 1
            return [Sample(bench.clock.now(), self.polls, np.zeros(6), self.polls < 20, 0, "cold")]

    bench, sensor = Bench(), Sensor()
    info = SensorInfo("fake", 100.0, np.full(6, 100.0))
    touch = ForceInput(Sensing(sensor, info, 100.0, PERIOD, bench.clock), lambda wrench, _: wrench)
    loop = Playback(bench.plan, WIDE, WATCH, bench.arm, touch)
    assert "sample 20: cold" in loop.run(Interruption()).reason
    assert bench.servo.calls == ["upload", "stop"]


def test_what_hinders_stops_it_with_its_reason():
    bench = Bench()
    full = InstrumentError("the disk is full")
    loop = Playback(
        bench.plan, WIDE, WATCH, bench.arm, hindrance=lambda: full if len(loop.log) > 30 else None
    )
    outcome = loop.run(Interruption())
    assert outcome.failure is full
    assert len(loop.log) == 32


def test_a_mode_that_forbids_motion_stops_it():
    bench = Bench(at={30: lambda servo: setattr(servo, "mode", "emergency stop")})
    outcome = bench.run()
    assert isinstance(outcome.failure, RefusedError)
    assert "emergency stop" in outcome.reason


def test_a_force_coupling_needs_set_points():
    bench = Bench()
    with pytest.raises(InputError, match="leave mode=file out"):
        Playback(bench.plan, WIDE, WATCH, bench.arm, ForceInput(None, None, pressing=object()))


def test_an_arm_whose_clock_is_behind_ours_has_that_much_longer_to_arrive():
    """It is 0.14 s late, 0.09 s more than its look-ahead, and then at the end to a nanometre."""
    first, second = tour(made(line(4.0), name="a"), made(line(4.0), name="b"))
    clock = FakeClock(PERIOD)
    servo = Player(clock, lookahead=0.05)
    servo.delay = 0.14
    arm = ReadyArm(servo, servo.info, clock)
    watch = dataclasses.replace(WATCH, arrival=1e-6)
    loop = Playback(first, WIDE, watch, arm, then=[second])
    assert loop.run(Interruption()).reason == DONE
    assert loop.drawn == ["a", "b"]
