"""A tour in the loop, with an arm that does exactly what it is told: every stop, on every way."""

import signal

import numpy as np
import pytest

from dmpcli.control.cycle import ReadyArm, StopLimits
from dmpcli.control.servo_loop import DONE, ServoLoop
from dmpcli.control.signals import Interruption
from dmpcli.planning import transfers
from dmpcli.planning.transfers import TransferOptions
from dmpcli.spatial.trajectory import StrokeTrajectory
from tests.control.streaming_fakes import PEN_DOWN, WIDE, FakeClock, FakeServo
from tests.minimum_jerk import minimum_jerk

PERIOD = 0.02
WAYS = TransferOptions(20.0, 100.0, 50.0, 20.0, settling=10)


def line(name, start, goal, turn=0.0):
    t = np.arange(101) * PERIOD
    u = minimum_jerk(t / 2.0)[:, None]
    start, goal = np.array(start, float), np.array(goal, float)
    up = np.tile([0.0, 0.0, 1.0], (101, 1))
    return StrokeTrajectory(
        t, start + u * (goal - start), np.tile(PEN_DOWN, (101, 1, 1)), up, id=name
    )


STROKES = [
    line("a", (0, 0, 0), (40, 0, 0)),
    line("b", (90, 20, 0), (90, 60, 0)),
    line("c", (0, 60, 0), (30, 60, 0)),
]
PLANS = list(transfers.plans(STROKES, PERIOD, 1.0, WIDE, STROKES[0].pose(0), True, WAYS))
FIRSTS = np.cumsum([0, *(len(p) for p in PLANS)])


def cycle_of(plan, phase, share=0.5):
    """Number of the cycle at which the loop is on a way of a plan, if nothing delays it."""
    rows = [i for i in range(len(PLANS[plan])) if PLANS[plan].phase_at(i) == phase]
    return int(FIRSTS[plan] + rows[int(share * (len(rows) - 1))])


def run(at=None):
    clock = FakeClock()
    interruption = Interruption()
    deeds = {
        n: (lambda deed: lambda servo: deed(servo, interruption))(d) for n, d in (at or {}).items()
    }
    begin = STROKES[0].pose(0)
    servo = FakeServo(clock, begin.position, begin.rotation, at=deeds)
    arm = ReadyArm(servo, servo.info, clock)
    loop = ServoLoop(PLANS[0], WIDE, StopLimits(5.0, 0.1, 50.0, 5.0), arm, then=PLANS[1:])
    return loop, loop.run(interruption), servo


def ctrl_c(servo, interruption):
    interruption.receive(signal.SIGINT)


def test_every_set_point_of_every_plan_is_sent_once_in_order():
    loop, outcome, servo = run()
    assert outcome.reason == DONE
    expected = np.concatenate([p.position for p in PLANS])
    sent = np.array([position for position, _ in servo.sent])
    np.testing.assert_array_equal(sent[: len(expected)], expected)
    assert loop.drawn == ["a", "b", "c"]


def test_rows_tell_phase_and_stroke():
    columns = run()[0].log.columns()
    drawing = columns["phase"] == "stroke"
    for name in "abc":
        assert np.count_nonzero(columns["id"] == name) == 101
    assert all(name is not None for name in columns["id"][drawing])
    assert all(name is None for name in columns["id"][~drawing])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("plan", "phase", "drawn"),
    [
        (0, "stroke", []),
        (0, "retract", ["a"]),
        (1, "transfer", ["a"]),
        (1, "approach", ["a"]),
        (1, "stroke", ["a"]),
        (2, "approach", ["a", "b"]),
        (2, "retract", ["a", "b", "c"]),
    ],
)
def test_a_signal_on_any_way_comes_to_rest_on_it_within_the_limits(plan, phase, drawn):
    at = cycle_of(plan, phase)
    loop, outcome, servo = run({at: ctrl_c})
    assert outcome.signal == signal.SIGINT
    assert "decelerated along the path" in outcome.reason
    assert loop.drawn == drawn
    sent = np.array([position for position, _ in servo.sent])
    way = np.concatenate([p.position for p in PLANS])
    np.testing.assert_array_equal(sent[:at], way[:at])
    held = np.pad(sent, ((0, 2), (0, 0)), mode="edge")
    acceleration = np.linalg.norm(np.diff(held, 2, axis=0), axis=1) / PERIOD**2
    assert acceleration.max() <= WIDE.acceleration
    tail = sent[at:]
    # The ways are straight: what is sent after the signal lies between two points of the way.
    on = way[at - 1 : FIRSTS[plan + 1]]
    ends = np.stack([on[:-1], on[1:]])
    step = ends[1] - ends[0]
    square = np.maximum(np.sum(step**2, axis=-1), 1e-12)
    for point in tail:
        share = np.clip(np.sum((point - ends[0]) * step, axis=-1) / square, 0.0, 1.0)
        assert np.linalg.norm(ends[0] + share[:, None] * step - point, axis=-1).min() < 1e-3
    assert len(tail) < 60
    assert loop.log.columns()["phase"][-1] == "stop"


@pytest.mark.slow
@pytest.mark.parametrize("plan", [0, 1])
def test_a_signal_where_one_plan_ends_and_the_next_begins_stops_there(plan):
    for at in range(FIRSTS[plan + 1] - 2, FIRSTS[plan + 1] + 2):
        loop, outcome, servo = run({int(at): ctrl_c})
        assert outcome.signal == signal.SIGINT
        assert loop.drawn == ["a", "b"][: plan + 1]
        sent = np.array([position for position, _ in servo.sent])
        np.testing.assert_allclose(
            sent[at:], np.tile(PLANS[plan].position[-1], (len(sent) - at, 1)), atol=0.05
        )


def stop_button(servo, _):
    servo.mode = "emergency stop"


@pytest.mark.parametrize(
    ("deed", "behind", "drawn"),
    [(stop_button, 3, []), (stop_button, 12, ["a"]), (ctrl_c, 3, ["a"])],
)
def test_a_stroke_counts_only_once_the_arm_has_arrived_at_its_end(deed, behind, drawn):
    """The arm may lag by ten set-points; brought to rest it arrives all the same."""
    assert run({PLANS[0].last + behind: deed})[0].drawn == drawn


def test_a_second_signal_in_a_transfer_stops_at_once():
    at = cycle_of(1, "transfer")
    loop, outcome, servo = run({at: ctrl_c, at + 2: ctrl_c})
    assert "second signal" in outcome.reason
    assert len(servo.sent) == at + 2
    assert servo.calls[-1] == "stop"
    assert loop.drawn == ["a"]


def test_an_emergency_stop_in_a_transfer_ends_the_run():
    loop, outcome, servo = run({cycle_of(2, "transfer"): stop_button})
    assert "emergency stop" in outcome.reason
    assert outcome.failure is not None
    assert loop.drawn == ["a", "b"]
    assert servo.calls[-1] == "stop"
