"""An arm that may still move is told last and decides the exit code, whatever else went wrong."""

import numpy as np
import pytest

from dmpcli.control import execution, stopping
from dmpcli.control.stopping import StopOutcome
from dmpcli.errors import InstrumentError, RefusedError, UnconfirmedStopError
from dmpcli.instruments.protocols import RobotState
from dmpcli.records.record import Provenance
from tests.control import test_drag_loop as drag
from tests.control.streaming_fakes import FakeClock, FakeServo
from tests.control.test_servo_loop import Bench

ESTOP = {200: lambda servo: setattr(servo, "mode", "emergency stop")}


def fails(text="fake: no answer"):
    def call(*_):
        raise InstrumentError(text)

    return call


def drifts(servo):
    """The arm moves on at 1 mm/s from now on, whatever it is told."""
    state, begun = servo.state, servo.clock.now()

    def moving():
        told = state()
        away = (servo.clock.now() - begun) * np.array([1.0, 0.0, 0.0])
        return RobotState(told.t, told.position + away, told.rotation, told.mode)

    servo.state = moving


@pytest.mark.parametrize(
    "at",
    [ESTOP, {200: lambda servo: setattr(servo, "accepts", False)}, {}],
    ids=["refused", "failed", "done"],
)
def test_a_stop_that_could_not_be_told_outranks_what_ended_the_run(at):
    bench = Bench(at=at)
    bench.servo.stop = fails()
    outcome = bench.run()
    error = outcome.error(after="; 2 of 4 strokes are drawn")
    assert error.exit_code == 4
    last = str(error).splitlines()[-1]
    assert last.startswith("THE ARM MAY STILL MOVE: it could not be told to stop: fake: no answer")
    assert "emergency stop" in last
    if at:
        assert str(error).splitlines()[0].startswith(str(outcome.failure))
    known = Provenance("execute", {}, (), {})
    made = execution.record_of(bench.loop, outcome, known, False).provenance.facts
    assert made["stop"] == {"outcome": "not told", "why": "fake: no answer"}


def test_an_arm_that_moves_on_after_its_stop_is_not_said_to_stand():
    bench = Bench(at={200: lambda servo: (drifts(servo), setattr(servo, "accepts", False))})
    outcome = bench.run()
    assert "refused a set-point" in outcome.reason
    assert outcome.stop.kind == "not seen at rest"
    assert outcome.error().exit_code == 4
    assert "was not seen at rest: moved 0.2 mm" in str(outcome.error()).splitlines()[-1]
    assert bench.clock.now() - bench.rows[-1].deadline - 100.0 > stopping.PATIENCE


def test_an_arm_that_tells_nothing_after_its_stop_is_not_said_to_stand():
    bench = Bench()
    bench.servo.at[200] = lambda servo: setattr(servo, "state", fails("fake: silent"))
    assert bench.run().stop == StopOutcome("not seen at rest", "fake: silent")


def test_a_state_that_does_not_change_its_time_shows_no_rest():
    clock = FakeClock()
    servo = FakeServo(clock)
    servo.state = lambda: RobotState(100.0, servo.position, servo.rotation, "ready")
    assert stopping.stop(servo, clock).kind == "not seen at rest"


def test_a_controller_that_says_it_is_in_motion_is_not_at_rest():
    clock = FakeClock()
    servo = FakeServo(clock)
    servo.state = lambda: RobotState(
        clock.now(), servo.position, servo.rotation, "ready", busy=True
    )
    assert "in motion" in stopping.stop(servo, clock).why
    servo.state = lambda: RobotState(
        clock.now(), servo.position, servo.rotation, "ready", busy=False
    )
    assert stopping.stop(servo, clock).confirmed


def test_an_arm_that_stands_is_seen_so_and_its_run_says_nothing_of_it():
    bench = Bench(at=ESTOP)
    outcome = bench.run()
    assert outcome.stop.confirmed
    assert isinstance(outcome.error(), RefusedError)
    assert "\n" not in str(outcome.error())
    known = Provenance("execute", {}, (), {})
    made = execution.record_of(bench.loop, outcome, known, False).provenance.facts
    assert "stop" not in made


def test_an_arm_that_was_never_moved_is_not_waited_for():
    bench = Bench()
    bench.interruption.receive(15)
    begun = bench.clock.now()
    assert bench.run().stop.confirmed
    assert bench.clock.now() == begun


def test_a_signal_does_not_hide_it_either():
    bench = Bench()
    bench.servo.at[200] = lambda servo: bench.interruption.receive(2)
    bench.servo.stop = fails()
    error = bench.run().error()
    assert error.exit_code == 4
    assert str(error).splitlines()[0] == "SIGINT: decelerated along the path"
    assert "MAY STILL MOVE" in str(error).splitlines()[1]


def test_a_defect_keeps_its_traceback_and_is_outranked():
    bench = Bench(at={200: lambda servo: 1 / 0})
    bench.servo.stop = fails()
    with pytest.raises(UnconfirmedStopError, match="MAY STILL MOVE") as caught:
        bench.run()
    assert isinstance(caught.value.__cause__, ZeroDivisionError)
    assert not bench.loop.stop_outcome.confirmed


def test_a_defect_in_the_stop_itself_is_a_stop_that_was_not_told():
    bench = Bench(at=ESTOP)
    bench.servo.stop = lambda: 1 / 0
    error = bench.run().error()
    assert error.exit_code == 4
    assert "ZeroDivisionError" in str(error).splitlines()[-1]
    assert isinstance(error.__cause__, ZeroDivisionError)


def test_a_recording_says_it_too():
    recorder, _, servo = drag.bench()
    servo.stop = servo.close = fails()
    servo.mode = lambda t: "ready" if t < 1.0 else "emergency stop"
    ending = recorder.run()
    assert "emergency stop" in ending.reason
    assert ending.error().exit_code == 4
    assert "MAY STILL MOVE" in str(ending.error()).splitlines()[-1]


def test_nothing_that_fails_afterwards_outranks_it():
    left = StopOutcome("not told", "no answer")
    with (
        pytest.raises(UnconfirmedStopError, match=r"^disk full\nTHE ARM MAY STILL MOVE"),
        stopping.outranking(lambda: left),
    ):
        raise RefusedError("disk full")
    with (
        pytest.raises(RefusedError, match="disk full"),
        stopping.outranking(lambda: stopping.AT_REST),
    ):
        raise RefusedError("disk full")
