import threading
import time

import numpy as np
import pytest

from dmpcli.control.watchdog import watched
from dmpcli.errors import InstrumentError
from dmpcli.instruments.protocols import DragTeaching, RobotState, ServoInfo

PERIOD, LOOKAHEAD = 0.002, 0.05
HERE, LEVEL = np.zeros(3), np.eye(3)


class Servo:
    def __init__(self):
        self.calls = []
        self.hang = threading.Event()
        self.hang.set()
        self.stopped = threading.Event()

    def open(self):
        return ServoInfo("fake", (0.001, 0.1), LOOKAHEAD)

    def state(self):
        return RobotState(0.0, HERE, LEVEL, "ready")

    def start(self, period):
        self.calls.append("start")

    def send(self, position, rotation):
        self.calls.append("send")
        self.hang.wait(30.0)
        return True

    def stop(self):
        self.calls.append("stop")
        self.stopped.set()

    def close(self):
        self.calls.append("close")


class Draggable(Servo):
    def drag(self):
        self.calls.append("drag")


class Haltable(Servo):
    def halt(self):
        self.calls.append("halt")
        self.stopped.set()
        return True


class Deaf(Servo):
    """Does not do the first `refusals` stops."""

    refusals = 2

    def stop(self):
        self.calls.append("stop")
        if self.calls.count("stop") <= self.refusals:
            raise InstrumentError("fake: stop: no answer")
        self.stopped.set()


def started(servo):
    dog = watched(servo)
    dog.open()
    dog.start(PERIOD)
    return dog


def verdict(dog):
    """Stay away until the watchdog has acted, then come round."""
    assert dog._settled.wait(30.0)
    dog.state()


@pytest.mark.parametrize(
    ("away", "words"),
    [
        (1000.0, r"did not come round for 1000\.\d+ s.*longer lookahead \(silent\)"),
        (0.0, "^silent$"),
    ],
)
def test_a_state_that_is_old_because_the_loop_was_away_is_the_loops_fault(away, words):
    servo = Servo()
    dog = watched(servo)
    dog.open()
    dog.start(PERIOD)
    dog._done.set()
    dog._thread.join()  # as one that was held up with the rest of the process
    dog._limit = 500.0

    def silent():
        raise InstrumentError("silent")

    servo.state = silent
    dog._barked, dog._seen = "", time.monotonic() - away
    with pytest.raises(InstrumentError, match=words):
        dog.state()


def test_a_loop_that_comes_round_is_left_alone():
    servo = Servo()
    # Patience far beyond what a busy machine may hold this loop up for.
    servo.open = lambda: ServoInfo("fake", (0.001, 0.1), 20.0)
    dog = started(servo)
    for _ in range(100):
        dog.state()
        assert dog.send(HERE, LEVEL)
        time.sleep(PERIOD)
    dog.stop()
    dog.close()
    assert servo.calls == ["start", *["send"] * 100, "stop", "close"]


def test_a_loop_that_stays_away_has_its_arm_stopped_and_is_told():
    servo = Servo()
    dog = started(servo)
    dog.state()
    assert servo.stopped.wait(30.0)
    with pytest.raises(InstrumentError, match=r"the loop did not come round.*the arm was stopped"):
        dog.send(HERE, LEVEL)
    with pytest.raises(InstrumentError, match="watchdog"):
        dog.state()
    assert "send" not in servo.calls
    dog.stop()
    dog.close()


def test_an_arm_that_can_be_halted_is_stopped_while_a_call_of_it_hangs():
    servo = Haltable()
    dog = started(servo)
    servo.hang.clear()
    loop = threading.Thread(target=dog.send, args=(HERE, LEVEL))
    loop.start()
    assert servo.stopped.wait(30.0)
    assert servo.calls == ["start", "send", "halt"]
    servo.hang.set()
    loop.join(30.0)
    dog.stop()


def test_nobody_speaks_into_a_call_that_hangs():
    servo = Servo()
    dog = started(servo)
    servo.hang.clear()
    loop = threading.Thread(target=dog.send, args=(HERE, LEVEL))
    loop.start()
    assert not servo.stopped.wait(10.0 * LOOKAHEAD)
    servo.hang.set()
    loop.join(30.0)
    dog.stop()
    assert servo.calls[-1] == "stop"


@pytest.mark.parametrize("kind", [Servo, Haltable])
def test_an_arm_that_cannot_be_stopped_beside_a_call_that_hangs_is_not_called_stopped(kind):
    servo = kind()
    servo.halt = lambda: False  # has the method, but no way
    dog = started(servo)
    servo.hang.clear()
    loop = threading.Thread(target=dog.send, args=(HERE, LEVEL))
    loop.start()
    with pytest.raises(InstrumentError, match=r"could NOT be stopped.*hangs.*emergency stop"):
        verdict(dog)
    servo.hang.set()
    loop.join(30.0)
    dog.stop()


def test_a_stop_that_fails_is_tried_again_until_it_is_done():
    servo = Deaf()
    dog = started(servo)
    assert servo.stopped.wait(30.0)
    assert servo.calls == ["start", "stop", "stop", "stop"]
    dog.stop()


def test_a_stop_that_fails_is_told_and_tried_again_by_the_loop():
    servo = Deaf()
    servo.refusals = 10**9
    dog = started(servo)
    with pytest.raises(
        InstrumentError, match=r"could NOT be stopped: fake: stop: no answer; press its emergency"
    ):
        verdict(dog)
    tried = servo.calls.count("stop")
    with pytest.raises(InstrumentError, match="no answer"):
        dog.stop()
    assert servo.calls.count("stop") > tried


def test_a_defect_in_a_stop_is_told_as_a_failure():
    servo = Servo()
    servo.stop = lambda: 1 / 0
    dog = started(servo)
    with pytest.raises(InstrumentError, match=r"could NOT be stopped: .*division"):
        verdict(dog)
    with pytest.raises(ZeroDivisionError):
        dog.stop()


def test_before_the_start_and_after_the_stop_nothing_is_awaited():
    servo = Servo()
    dog = watched(servo)
    dog.open()
    time.sleep(4.0 * LOOKAHEAD)
    assert dog.state().mode == "ready"
    dog.start(PERIOD)
    dog.stop()
    time.sleep(4.0 * LOOKAHEAD)
    assert dog.state().mode == "ready"
    assert servo.calls == ["start", "stop"]


def test_it_offers_what_the_arm_offers():
    assert isinstance(watched(Draggable()), DragTeaching)
    assert not isinstance(watched(Servo()), DragTeaching)
    servo = Draggable()
    watched(servo).drag()
    assert servo.calls == ["drag"]


class Player(Servo):
    def upload(self, position, rotation, period, meanwhile):
        self.calls.append(("upload", position, rotation, period))
        meanwhile()

    def play(self):
        self.calls.append("play")

    def check_output(self, name):
        self.calls.append(f"check {name}")

    def switch(self, name, on):
        self.calls.append((name, on))


def test_all_that_the_arm_offers_is_passed_on():
    servo, meanwhile = Player(), []
    dog = watched(servo)
    before = dog._seen
    dog.upload(HERE, LEVEL, PERIOD, lambda: meanwhile.append(1))
    assert dog._seen > before
    before, dog._seen = dog._seen, 0.0
    dog.play()
    assert dog._seen >= before
    dog.check_output("DO1")
    dog.switch("DO1", True)
    dog.switch("DO1", True)
    assert dog._outputs == ["DO1"]
    dog.switch("DO2", False)
    dog.switch("DO1", False)
    assert dog._outputs == []
    assert servo.calls == [
        ("upload", HERE, LEVEL, PERIOD), "play", "check DO1",
        ("DO1", True), ("DO1", True), ("DO2", False), ("DO1", False),
    ]  # fmt: skip
    assert meanwhile == [1]
    for name in ("upload", "play", "switch", "check_output", "drag"):
        assert not hasattr(watched(Servo()), name)


def test_outputs_that_are_on_go_off_with_the_arm_and_none_goes_on_after():
    servo = Player()
    dog = watched(servo)
    dog.open()
    dog.start(PERIOD)
    dog.switch("DO1", True)
    dog.switch("DO2", True)
    assert dog._settled.wait(30.0)
    assert servo.calls[-3:] == ["stop", ("DO1", False), ("DO2", False)]
    with pytest.raises(InstrumentError, match="did not come round"):
        dog.switch("DO3", True)
    dog.switch("DO1", False)
    dog._done.set()  # the loop has stopped the arm too
    dog.switch("DO3", True)
    assert servo.calls[-1] == ("DO1", False)
    dog.stop()


@pytest.mark.parametrize(("period", "limit"), [(0.002, 0.05), (0.02, 0.1)])
def test_it_waits_for_five_periods_or_a_look_ahead(period, limit):
    dog = watched(Servo())
    dog.open()
    dog.start(period)
    assert dog._limit == pytest.approx(limit)
    dog.stop()
    assert dog._thread is None


def test_once_the_arm_was_stopped_a_set_point_does_not_even_wait_for_its_turn():
    class Busy:
        def __enter__(self):
            raise AssertionError("waits for a call that may hang")

        def __exit__(self, *_):
            pass

    servo = Servo()
    dog = watched(servo)
    dog._barked, dog._lock = "the arm was stopped", Busy()
    dog._settled.set()
    with pytest.raises(InstrumentError, match="the arm was stopped"):
        dog.send(HERE, LEVEL)
    assert servo.calls == []
