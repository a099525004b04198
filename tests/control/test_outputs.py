"""Outputs along a stroke: switched within a period of the place, and off at every stop."""

import contextlib
import dataclasses
import json
import signal

import numpy as np
import pyarrow.parquet as pq
import pytest

from dmpcli.control import outputs
from dmpcli.control.cycle import ReadyArm, StopLimits
from dmpcli.control.outputs import OutputSwitch
from dmpcli.control.servo_loop import DONE, ServoLoop
from dmpcli.control.signals import Interruption
from dmpcli.errors import InputError, InstrumentError, RefusedError
from dmpcli.spatial.output_events import OutputEvent
from dmpcli.spatial.trajectory import StrokeTrajectory
from tests.commands.running import ended, invoke
from tests.control.streaming_fakes import WIDE, FakeClock, FakeServo, plan, stroke

REFERENCE = "sample_runs/reference.parquet"
PAIR = ["--start", "-701.698", "132.42", "-17.538", "--goal", "-807.597", "129.739", "-17.518"]
WATCH = StopLimits(50.0, 0.1, 50.0, 5.0)


class Switching(FakeServo):
    """A `FakeServo` with outputs, that reaches a set-point one look-ahead after it was sent."""

    def __init__(self, clock, fails=(), **options):
        super().__init__(clock, **options)
        self.fails, self.switched, self.outputs = set(fails), [], {}

    def check_output(self, name):
        pass

    def switch(self, name, on):
        if name in self.fails:
            raise InstrumentError(f"robot: {name}: no answer")
        self.switched.append((self.clock.now(), len(self.sent), name, on))
        self.outputs[name] = on


def with_events(*events, duration=4.0):
    made = stroke(duration=duration)
    return StrokeTrajectory(made.t, made.position, made.rotation, events=tuple(events), id=made.id)


def bench(events, jumps=None, at=None, lookahead=0.2, queues=False, fails=()):
    clock = FakeClock(jumps=jumps)
    servo = Switching(clock, lookahead=lookahead, at=at, queues=queues, fails=fails)
    made = plan(with_events(*events))
    arm = ReadyArm(servo, servo.info, clock)
    switch = OutputSwitch(servo, made.period, lookahead)
    return ServoLoop(made, WIDE, WATCH, arm, outputs=switch), servo, made


TWO = (OutputEvent(1.003, "DO1", on=True), OutputEvent(2.5, "DO1", on=False))


@pytest.mark.parametrize("lookahead", [0.02, 0.1, 0.2, 0.5])
def test_an_output_is_switched_when_the_arm_is_there_to_half_a_period(lookahead):
    loop, servo, made = bench(TWO, lookahead=lookahead)
    assert loop.run(Interruption()).reason == DONE
    begun = 100.0 + made.lead * made.period + lookahead
    times = [when - begun for when, _, _, _ in servo.switched]
    np.testing.assert_allclose(times, [1.003, 2.5], atol=made.period / 2 + 1e-9)


@pytest.mark.parametrize("queues", [False, True])
def test_after_missed_deadlines_it_is_still_the_place_that_counts(queues):
    loop, servo, made = bench(TWO, jumps={20: 0.05, 70: 0.07}, queues=queues)
    assert loop.run(Interruption()).reason == DONE
    # An arm that queues is where its set-points say by its own clock; the other one waits.
    late = 0.0 if queues else 0.04 + 0.06
    begun = 100.0 + made.lead * made.period + 0.2
    off = servo.switched[-1][0] - begun - late
    assert off == pytest.approx(2.5, abs=made.period)


def test_events_at_the_very_ends_are_switched_too():
    ends = (OutputEvent(0.0, "DO1", on=True), OutputEvent(4.0, "DO1", on=False))
    loop, servo, _ = bench(ends)
    assert loop.run(Interruption()).reason == DONE
    assert [(name, on) for _, _, name, on in servo.switched] == [("DO1", True), ("DO1", False)]
    texts = [text for text in loop.log.columns()["event"] if text]
    assert texts == ["on DO1", "off DO1"]


def _estop(servo):
    servo.mode = "emergency stop"


def _refuse(servo):
    servo.accepts = False


def _defect(_):
    raise ZeroDivisionError


@pytest.mark.parametrize("deed", [_estop, _refuse, _defect])
def test_whatever_ends_a_run_what_is_on_goes_off_after_the_arm_was_told(deed):
    loop, servo, _ = bench(TWO[:1], at={100: deed})
    with contextlib.suppress(ZeroDivisionError):
        assert loop.run(Interruption()).failure is not None
    assert servo.outputs == {"DO1": False}
    assert servo.calls[-1] == "stop"


def test_a_run_that_ends_with_an_output_on_has_it_off():
    loop, servo, _ = bench(TWO[:1])
    assert loop.run(Interruption()).reason == DONE
    assert servo.outputs == {"DO1": False}


def test_at_the_first_signal_it_goes_off_at_once_while_the_arm_comes_to_rest():
    loop, servo, _ = bench(TWO[:1])
    interruption = Interruption()
    servo.at[100] = lambda _: interruption.receive(signal.SIGINT)
    outcome = loop.run(interruption)
    assert "decelerated" in outcome.reason
    _, sent, _, on = servo.switched[-1]
    assert not on
    assert len(servo.sent) > sent + 3  # the arm went on to rest
    assert "off DO1" in [text for text in loop.log.columns()["event"] if text]


def test_what_cannot_be_switched_off_is_told_last_and_fails_the_run():
    loop, servo, _ = bench(TWO[:1])
    servo.at[150] = lambda fake: fake.fails.add("DO1")
    outcome = loop.run(Interruption())
    assert isinstance(outcome.failure, InstrumentError)
    assert "MAY STILL BE ON: DO1" in str(outcome.failure)
    assert "pendant" in outcome.reason


def test_what_cannot_be_switched_on_stops_the_arm():
    loop, servo, _ = bench(TWO, fails=["DO1"])
    outcome = loop.run(Interruption())
    assert "no answer" in outcome.reason
    assert servo.calls[-1] == "stop"
    assert len(servo.sent) < 120


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    folder = tmp_path_factory.mktemp("events")
    ended("fit", REFERENCE, "-o", folder / "s.json")
    events = ["--event", "on@12.5mm:DO1", "--event", "off@end:DO1", "--event", "on@60mm:DO2"]
    said = ended(
        *("generalize", folder / "s.json", "-o", folder / "t.parquet", *PAIR),
        *("--ease-in", 0.5, "--ease-out", 0.5, *events),
    )
    assert "DO2 is switched on and never off" in said.stderr
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("speed", [0.5, 1.0])
def test_the_mock_arm_is_within_a_period_of_the_place(drawn, tmp_path, speed):
    ended("execute", drawn / "t.parquet", "-o", tmp_path / "r.parquet", "--speed", speed, "-q")
    table = pq.read_table(tmp_path / "r.parquet").to_pydict()
    rows = {text: i for i, text in enumerate(table["event"]) if text}
    assert list(rows) == ["on DO1", "on DO2", "off DO1"]
    drawn_way = pq.read_table(drawn / "t.parquet").to_pydict()
    way = np.column_stack([drawn_way[name] for name in "xyz"])
    gone = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1))])
    actual = np.column_stack([table[name] for name in "xyz"])
    for text, distance in (("on DO1", 12.5), ("on DO2", 60.0), ("off DO1", gone[-1])):
        place = np.array([np.interp(distance, gone, axis) for axis in way.T])
        row = rows[text]
        step = np.linalg.norm(actual[row] - actual[row - 1])  # of one period
        assert np.linalg.norm(actual[row] - place) <= max(step, 0.02)


def test_the_file_says_what_is_switched_and_is_of_a_version_that_old_readers_refuse(drawn):
    table = pq.read_table(drawn / "t.parquet")
    header = json.loads(table.schema.metadata[b"dmpcli"])
    assert header["version"] == 2
    assert header["options"]["event"] == ["on@12.5mm:DO1", "off@end:DO1", "on@60mm:DO2"]
    assert sum(text is not None for text in table["event"].to_pylist()) == 3


def test_a_file_without_events_is_of_the_first_version_and_says_nothing_of_them(drawn, tmp_path):
    ended("generalize", drawn / "s.json", "-o", tmp_path / "t.parquet", *PAIR, "-q")
    table = pq.read_table(tmp_path / "t.parquet")
    header = json.loads(table.schema.metadata[b"dmpcli"])
    assert header["version"] == 1
    assert "event" not in header["options"]
    assert "event" not in table.column_names


@pytest.mark.slow
def test_a_batch_switches_in_every_stroke_and_refuses_the_pair_that_is_too_short(drawn, tmp_path):
    pairs = tmp_path / "pairs.csv"
    pairs.write_text("id,x0,y0,z0,xg,yg,zg\na,0,0,0,110,0,0\nb,0,50,0,12,50,0\nc,0,90,0,90,90,0\n")
    said = ended(
        *("generalize", drawn / "s.json", "-o", tmp_path / "two", "--pairs", pairs),
        *("--event", "on@120mm:DO3", "--event", "off@end:DO3", "--on-error", "skip"),
        *("--ease-in", 0.5, "--ease-out", 0.5),
    )
    assert "pair b: --event on@120mm:DO3: the path ends after 101.171 mm" in said.stderr
    ended("execute", tmp_path / "two", "-o", tmp_path / "r.parquet", "-q")
    texts = [text for text in pq.read_table(tmp_path / "r.parquet")["event"].to_pylist() if text]
    assert texts == ["on DO3", "off DO3"] * 2
    ended("export", tmp_path / "two", "-o", tmp_path / "two.script", "-q")
    text = (tmp_path / "two.script").read_text()
    assert text.count("set_standard_digital_out(3, True)") == 2
    again = ended(
        *("generalize", drawn / "s.json", "-o", tmp_path / "two", "--pairs", pairs),
        *("--event", "on@120mm:DO3", "--event", "off@end:DO3", "--on-error", "skip"),
        *("--ease-in", 0.5, "--ease-out", 0.5),
    )
    assert "1 part" in again.stderr or "there" in again.stderr


def test_outputs_that_a_robot_has_not_are_refused_unless_they_are_to_be_ignored(drawn, tmp_path):
    out = tmp_path / "r.parquet"
    ended(
        *("generalize", drawn / "s.json", "-o", tmp_path / "t.parquet", *PAIR),
        *("--event", "on@start:glue", "--ease-in", 0.5, "--ease-out", 0.5),
    )
    said = ended("execute", tmp_path / "t.parquet", "-o", out, expect=2).stderr
    assert "has no output glue" in said
    assert "--ignore-events draws without them" in said
    assert not out.exists()
    done = invoke("execute", tmp_path / "t.parquet", "-o", out, "--ignore-events")
    assert done.exit_code == 0, done.stderr
    assert "glue: not switched, as --ignore-events asks" in done.stderr


class Told:
    """Remembers what it was told; fails for the names in `fails`."""

    def __init__(self, fails=()):
        self.fails, self.calls = set(fails), []

    def check_output(self, name):
        if name in self.fails:
            raise InputError(f"robot: has no output {name}")

    def switch(self, name, on):
        self.calls.append((name, on))
        if name in self.fails:
            raise InstrumentError(f"no answer of {name}")


def test_what_was_switched_on_twice_goes_off_once():
    servo = Told()
    switch = OutputSwitch(servo, 0.02, 0.0)
    made = plan(with_events(*(OutputEvent(0.02 * k, "DO1", on=True) for k in range(3))))
    for index in range(3):
        switch.reach(made, float(index), 0.02 * index)
        assert switch.act(0.02 * index) == ("on DO1", None)
    assert switch.off() == "off DO1"
    assert servo.calls == [("DO1", True)] * 3 + [("DO1", False)]
    assert switch.off() == ""
    switch.leave()
    assert (switch.left, len(servo.calls)) == ("", 4)


def test_what_is_off_already_may_be_switched_off():
    servo = Told()
    switch = OutputSwitch(servo, 0.02, 0.0)
    switch.reach(plan(with_events(OutputEvent(0.0, "DO2", on=False))), 0.0, 0.0)
    assert switch.act(0.0) == ("off DO2", None)
    assert switch.off() == ""


@pytest.mark.parametrize(("early", "due"), [(0.01, True), (0.0101, False)])
def test_an_event_is_due_in_the_cycle_that_is_nearest_to_it(early, due):
    """Set-point 10 at 1.5 s, one look-ahead of 0.25 s before the arm is there."""
    switch = OutputSwitch(Told(), 0.02, 0.25)
    made = plan(with_events(OutputEvent(0.2, "DO1", on=True)))
    switch.reach(made, 9.0, 1.48)
    assert not switch.waiting
    switch.reach(made, 10.0, 1.5)
    assert switch.waiting
    assert bool(switch.act(1.75 - early)[0]) == due
    assert switch.waiting != due


def test_between_two_set_points_it_is_due_by_its_share_of_the_period():
    switch = OutputSwitch(Told(), 0.02, 0.0)
    made = plan(with_events(OutputEvent(0.215, "DO1", on=True)))  # three quarters from 10 to 11
    switch.reach(made, 10.0, 1.5)
    switch.reach(made, 11.0, 1.52)
    # Three quarters of a period after 1.5 s; a cycle may come half a period before.
    assert switch.act(1.5049 - 1e-6)[0] == ""
    assert switch.act(1.5051)[0] == "on DO1"
    # After missed deadlines the way between two set-points is no longer than a period.
    late = OutputSwitch(Told(), 0.02, 0.0)
    late.reach(made, 8.0, 1.46)
    late.reach(made, 11.0, 1.52)
    assert late.act(1.52 - 0.01 - 0.005 / 3.0 - 1e-6)[0] == ""
    assert late.act(1.52 - 0.01 - 0.005 / 3.0 + 1e-6)[0] == "on DO1"


def test_another_plan_is_reached_from_its_first_set_point_and_one_that_goes_on_is_not():
    made = plan(with_events(OutputEvent(0.0, "DO1", on=True)))
    again = dataclasses.replace(made)
    for follows, count in ((False, 2), (True, 1)):
        servo = Told()
        switch = OutputSwitch(servo, 0.02, 0.0)
        switch.reach(made, 0.0, 0.0)
        if follows:
            switch.follow(again)
        switch.reach(again, 1.0, 0.02)
        switch.act(1.0)
        assert len(servo.calls) == count
    OutputSwitch(Told(), 0.02, 0.0).follow(made)  # before anything was reached


def test_what_cannot_be_switched_leaves_the_rest_undone_and_told():
    servo = Told(["DO2"])
    switch = OutputSwitch(servo, 0.02, 0.0)
    names = ("DO1", "DO2", "DO3")
    switch.reach(plan(with_events(*(OutputEvent(0.0, n, on=True) for n in names))), 0.0, 0.0)
    done, failure = switch.act(0.0)
    assert (done, str(failure)) == ("on DO1", "no answer of DO2")
    assert switch.waiting
    with pytest.raises(InstrumentError, match="DO2"):
        switch.off()
    assert not switch.waiting
    switch.leave()
    assert switch.left == "MAY STILL BE ON: DO2 (no answer of DO2); switch it off on the pendant"
    assert servo.calls == [
        ("DO1", True),
        ("DO2", True),
        ("DO1", False),
        ("DO2", False),
        ("DO2", False),
    ]


def test_how_a_run_ended_is_told_before_what_may_still_be_on():
    assert outputs.failed("done", None, "") == ("done", None)
    reason, failure = outputs.failed("done", None, "MAY STILL BE ON: DO1")
    assert (reason, type(failure)) == ("done; MAY STILL BE ON: DO1", InstrumentError)
    reason, failure = outputs.failed("stop", RefusedError("stop"), "MAY STILL BE ON: DO1")
    assert (str(failure), type(failure)) == (reason, RefusedError)


def test_outputs_that_a_robot_cannot_switch_are_refused_before_it_moves():
    outputs.check(FakeServo(FakeClock()), [])
    with pytest.raises(InputError, match=r"switches no outputs \(a, b\); --ignore-events"):
        outputs.check(FakeServo(FakeClock()), ["a", "b"])
    outputs.check(Told(), ["a"])
    with pytest.raises(InputError, match="has no output b; --ignore-events draws without"):
        outputs.check(Told(["b"]), ["a", "b"])
    player = Told()
    player.upload = player.play = lambda *_: None
    with pytest.raises(InputError, match="plays the plan by itself"):
        outputs.check(player, ["a"])
    strokes = [with_events(*TWO), with_events(OutputEvent(0.0, "x", on=True), *TWO)]
    assert outputs.names_of(strokes) == ["DO1", "x"]


@pytest.mark.parametrize("queues", [True, False])
def test_set_points_that_are_owed_are_reached_a_period_after_one_another(queues):
    """An arm that queues takes one in every period, whatever comes late."""
    loop, _, made = bench(TWO, jumps={20: 0.05, 70: 0.07}, queues=queues)
    reached, reach = {}, loop._outputs.reach

    def noted(plan, index, when):
        reached.setdefault(index, when)
        reach(plan, index, when)

    loop._outputs.reach = noted
    assert loop.run(Interruption()).reason == DONE
    whens = np.array([reached[float(i)] for i in range(len(made))])
    if queues:
        late = np.zeros(len(made))
    else:
        # Two and three deadlines were missed, and those cycles came late themselves.
        late = np.where(np.arange(len(made)) > 20, 0.04, 0.0)
        late = np.where(np.arange(len(made)) > 68, 0.1, late)
        late[20], late[68] = 0.05, 0.04 + 0.07
    np.testing.assert_allclose(whens, 0.02 * np.arange(len(made)) + late, atol=1e-9)
