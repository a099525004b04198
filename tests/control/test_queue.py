"""An arm that takes set-points from a queue by its own clock gets those that it is owed."""

import dataclasses
import signal

import numpy as np
import pytest

from dmpcli.control.cycle import ReadyArm, StopLimits
from dmpcli.control.servo_loop import DONE, ServoLoop
from dmpcli.control.signals import Interruption
from dmpcli.errors import InstrumentError
from dmpcli.instruments.protocols import RobotState
from dmpcli.spatial.pose import Pose
from tests.control.streaming_fakes import WIDE, FakeClock, FakeServo, plan, stroke

WATCH = StopLimits(5.0, 0.1, 50.0, 5.0)
PERIOD, LOOKAHEAD = 0.02, 0.1
NEEDED = 5


class Queue(FakeServo):
    """Begins with a full queue of where it stands; one set-point leaves it in every period."""

    def __init__(self, clock, queues=True):
        super().__init__(clock, lookahead=LOOKAHEAD, queues=queues)
        self.queue, self.empty, self.fullest = [], 0, 0
        self.on_send = {}

    def start(self, period):
        super().start(period)
        self.queue = [(self.position, self.rotation)] * NEEDED
        self.begun, self.taken = self.clock.now(), 0

    def _run(self):
        due = int((self.clock.now() - self.begun) / PERIOD + 1e-6)
        for _ in range(due - self.taken):
            if self.queue:
                self.position, self.rotation = self.queue.pop(0)
            else:
                self.empty += 1
        self.taken = due

    def state(self):
        self._run()
        deed = self.at.pop(self.reads, None)
        self.reads += 1
        if deed is not None:
            deed(self)
        return RobotState(self.clock.now(), self.position, self.rotation, self.mode)

    def send(self, position, rotation):
        self._run()
        deed = self.on_send.pop(len(self.sent), None)
        if deed is not None:
            deed()
        if self.accepts:
            self.sent.append((np.array(position), np.array(rotation)))
            self.queue.append(self.sent[-1])
            self.fullest = max(self.fullest, len(self.queue))
        return self.accepts


def run(jumps, made=None, queues=True, prepare=lambda servo, interruption: None, **options):
    made = plan(stroke(duration=10.0)) if made is None else made
    clock = FakeClock(PERIOD, jumps)
    servo = Queue(clock, queues)
    interruption = Interruption()
    prepare(servo, interruption)
    loop = ServoLoop(made, WIDE, WATCH, ReadyArm(servo, servo.info, clock), **options)
    return loop, loop.run(interruption), servo


# One cycle in 50 comes 25 ms late, and misses a deadline.
OFTEN = {50 * k: 0.025 for k in range(1, 10)}


def test_a_queue_that_is_owed_nothing_does_not_run_empty():
    loop, outcome, servo = run(OFTEN)
    assert (outcome.reason, loop.timing.missed) == (DONE, 9)
    assert servo.empty == 0
    assert servo.fullest <= NEEDED + 1


def test_an_arm_that_says_nothing_of_a_queue_gets_one_set_point_a_cycle():
    loop, outcome, servo = run(OFTEN, queues=False)
    assert (outcome.reason, loop.timing.missed) == (DONE, 9)
    assert len(servo.sent) == len(loop.log)
    assert servo.empty > 0


@pytest.mark.parametrize("late", [{0: 0.045}, {100: 0.045}, {480: 0.045, 484: 0.03}])
def test_every_set_point_of_the_plan_is_sent_once_in_order(late):
    loop, outcome, servo = run(late)
    assert outcome.reason == DONE
    sent = np.array([position for position, _ in servo.sent])
    np.testing.assert_array_equal(sent[:501], loop.plan.position)
    np.testing.assert_array_equal(sent[501:], np.tile(sent[500], (len(sent) - 501, 1)))
    assert servo.empty == 0
    assert loop.drawn == ["0"]
    # The plan is where it would be had no cycle been late; the row of one holds what it sent last.
    rows = loop.log.rows
    at = np.round(rows.numbers("deadline")[:450] / PERIOD).astype(int)
    first = next(iter(late))
    expected = loop.plan.position[np.where(at == first, at + 2, at)]
    np.testing.assert_array_equal(rows.numbers("sent")[:450], expected)


def held(made, count):
    """Wait at its end for the arm, which comes one look-ahead later."""
    more = {
        name: np.concatenate([values, np.repeat(values[-1:], count, axis=0)])
        for name in ("t", "position", "rotation")
        for values in [getattr(made, name)]
    }
    return dataclasses.replace(made, **more)


def test_several_plans_follow_each_other():
    first = held(plan(stroke(duration=2.0)), 5)
    end = Pose(first.position[-1], first.rotation[-1])
    second = dataclasses.replace(plan(stroke(duration=2.0), start=end, approach=100.0), id="1")
    loop, outcome, servo = run({99: 0.045, 102: 0.045}, first, then=[second])
    assert outcome.reason == DONE
    expected = np.concatenate([first.position, second.position])
    sent = np.array([position for position, _ in servo.sent])
    np.testing.assert_array_equal(sent[: len(expected)], expected)
    assert loop.drawn == ["0", "1"]


def signal_in_send(number, count=1):
    def prepare(servo, interruption):
        def deed():
            for _ in range(count):
                interruption.receive(signal.SIGINT)

        servo.on_send[number] = deed

    return prepare


def test_a_signal_between_two_that_are_owed_brakes_at_once_within_the_limits():
    loop, outcome, servo = run({40: 0.045}, plan(stroke(duration=1.6)), prepare=signal_in_send(40))
    assert outcome.signal == signal.SIGINT
    assert loop.timing.missed == 2
    sent = np.array([position for position, _ in servo.sent])
    way = plan(stroke(duration=1.6)).position
    np.testing.assert_array_equal(sent[:42], way[:42])
    assert np.linalg.norm(sent[42] - way[42]) > 1e-3
    assert np.linalg.norm(np.diff(sent, 2, axis=0), axis=1).max() / PERIOD**2 <= WIDE.acceleration
    assert servo.empty == 0


def test_a_second_signal_between_two_that_are_owed_sends_no_more():
    _, outcome, servo = run({40: 0.045}, prepare=signal_in_send(41, count=2))
    assert "second signal" in outcome.reason
    assert len(servo.sent) == 42


def test_one_that_is_owed_and_refused_stops():
    def prepare(servo, _):
        servo.on_send[41] = lambda: setattr(servo, "accepts", False)

    loop, outcome, servo = run({40: 0.045}, prepare=prepare)
    assert isinstance(outcome.failure, InstrumentError)
    assert len(servo.sent) == 41
    assert len(loop.log) == 41
    np.testing.assert_array_equal(loop.log.rows.numbers("sent")[-1], servo.sent[-1][0])


def test_each_that_is_owed_is_checked():
    made = plan()
    made.position[101] += [0.0, 0.0, 5.0]
    _, outcome, servo = run({100: 0.045}, made)
    assert "next set-point would take" in outcome.reason
    assert len(servo.sent) == 101
