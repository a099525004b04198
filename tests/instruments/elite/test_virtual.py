"""The drivers against the virtual controller: another reading of the same document."""

import re
import threading
import time
from dataclasses import replace

import numpy as np
import pytest

from dmpcli.control import guards, outputs, workcell
from dmpcli.control.cycle import ReadyArm, StopLimits
from dmpcli.control.playback import Playback
from dmpcli.control.servo_loop import DONE, ServoLoop
from dmpcli.control.signals import Interruption
from dmpcli.errors import DmpError, InstrumentError, RefusedError
from dmpcli.instruments.clock import MonotonicClock
from dmpcli.kinematics import chain, models
from dmpcli.planning.limits import Limits
from dmpcli.planning.plan import make
from dmpcli.simulation.elite_server import faults
from dmpcli.simulation.elite_server.lab import LabParameters, VirtualLab
from dmpcli.simulation.elite_server.service import ControllerService
from dmpcli.simulation.mock import PEN
from dmpcli.spatial.output_events import OutputEvent
from dmpcli.spatial.trajectory import StrokeTrajectory

START = np.array([-450.0, -120.0, 150.0])
LIMITS = Limits(250.0, 2250.0, 50_000.0, 0.785, 15.0, 333.0)
PERIOD = 0.02


class Bench:
    """A virtual controller on free ports, and the servo that speaks to it."""

    def __init__(self, *specifications, tool=PEN, **options):
        said = faults.parse(specifications)
        setting = LabParameters(START, habits=said.habits, events=said.events)
        self.lab = VirtualLab(setting)
        self.service = ControllerService(self.lab)
        # Both ends and the loop share one process here: nothing is said about how fast they are.
        slow = {"monitor_port": self.service.monitor_port, "lookahead": 0.5, "oldest": 0.5}
        given = slow | options
        more = "&".join(f"{key}={value}" for key, value in given.items())
        url = f"elite://127.0.0.1:{self.service.robot_port}?{more}"
        self.clock = MonotonicClock()
        self.servo = workcell.connect(url, None, self.clock, tool=tool).robot

    def loop(self, kind=ServoLoop, duration=1.0, events=()):
        info = self.servo.open()
        state = self.servo.state()
        assert state.mode == "ready"
        t = np.linspace(0.0, duration, 101)
        s = t / duration
        u = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
        way = state.position + u[:, None] * [20.0, 10.0, 0.0]
        stroke = StrokeTrajectory(t, way, np.broadcast_to(state.rotation, (101, 3, 3)), id="0")
        stroke = replace(stroke, events=events)
        plan = make(stroke, PERIOD, 1.0, LIMITS, state.pose, 20.0)
        arm = ReadyArm(self.servo, info, self.clock).as_told()
        switch = outputs.OutputSwitch(self.servo, PERIOD, info.lookahead) if events else None
        return kind(plan, LIMITS, StopLimits(5.0, 0.1, 50.0, 5.0), arm, outputs=switch), way

    def close(self):
        self.servo.close()
        self.service.close()


@pytest.fixture
def bench():
    made = []

    def build(*specifications, **options):
        made.append(Bench(*specifications, **options))
        return made[-1]

    yield build
    for each in made:
        guards.leave(each.close)


def stands(state):
    """Check that the arm is at rest once its servos have settled; return where."""
    time.sleep(0.2)
    at = state().position
    time.sleep(0.1)
    np.testing.assert_allclose(state().position, at, atol=0.01)
    return at


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "mode"), [(ServoLoop, "stream"), (Playback, "file")])
@pytest.mark.parametrize("newline", ["yes", "no"])
def test_a_plan_is_drawn_either_way(bench, kind, mode, newline):
    made = bench(f"newline={newline}", mode=mode)
    loop, way = made.loop(kind)
    outcome = loop.run(Interruption())
    assert outcome.reason == DONE
    columns = loop.log.columns()
    actual = np.column_stack([columns[name] for name in "xyz"])
    np.testing.assert_allclose(actual[-1], way[-1], atol=0.05)
    # Wherever it was seen, that was on the way, whose points are 0.42 mm apart at most.
    gaps = np.linalg.norm(actual[:, None] - way[None], axis=2).min(axis=1)
    assert gaps.max() < 0.3
    assert len(actual) > 40
    assert set(columns["state"]) == {"ready"}
    # The joints of each row are those that its pose was made of.
    joints = np.column_stack([columns[f"q{i}"] for i in range(1, 7)])
    at = chain.forward(models.model("ec66"), joints)
    flange, turned = at.position, at.rotation
    np.testing.assert_allclose(flange + turned @ PEN.tcp_position, actual, atol=1e-6)


@pytest.mark.sweep(kept=2)
@pytest.mark.slow
@pytest.mark.parametrize(("kind", "mode"), [(ServoLoop, "stream"), (Playback, "file")])
@pytest.mark.parametrize(
    ("fault", "words", "error"),
    [
        ("estop@0.4", "emergency stop", RefusedError),
        ("collision@0.4", "protective stop.*collision", RefusedError),
        ("mode=teach@0.4", "not ready.*teach mode|not in remote mode", RefusedError),
        ("drop=monitor@0.4", "no new state", InstrumentError),
    ],
)
def test_what_happens_on_the_way_stops_it_with_its_reason(bench, kind, mode, fault, words, error):
    loop, _ = bench(fault, mode=mode).loop(kind)
    outcome = loop.run(Interruption())
    assert isinstance(outcome.failure, error)
    with pytest.raises(DmpError, match=words):
        raise outcome.failure
    assert len(loop.log) < 60


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "mode"), [(ServoLoop, "stream"), (Playback, "file")])
def test_a_dropped_connection_stops_the_arm_over_a_new_one(bench, kind, mode):
    made = bench("drop=robot@0.4", mode=mode)
    loop, way = made.loop(kind)
    outcome = loop.run(Interruption())
    assert re.search("closed the connection|Broken pipe|reset by peer", outcome.reason)
    assert "emergency stop" not in outcome.reason
    assert np.linalg.norm(stands(made.servo.state) - way[-1]) > 2.0


@pytest.mark.slow
def test_an_arm_that_draws_on_after_its_link_is_gone_is_said_to(bench):
    made = bench(mode="file")
    loop, _ = made.loop(Playback, duration=8.0)
    state = made.servo.state

    def cut():
        if len(loop.log) == 20:
            made.service._robot.close()
        return state()

    made.servo.state = cut
    outcome = loop.run(Interruption())
    assert re.search("closed the connection|Broken pipe|reset by peer", outcome.reason)
    assert outcome.error().exit_code == 4
    last = str(outcome.error()).splitlines()[-1]
    assert last.startswith("THE ARM MAY STILL MOVE: it could not be told to stop")
    made.service._lab.controller.stop()


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "mode"), [(ServoLoop, "stream"), (Playback, "file")])
def test_a_controller_that_only_acknowledges_its_stop_is_found_out(bench, kind, mode):
    made = bench(mode=mode)
    loop, _ = made.loop(kind, duration=8.0)
    controller, state = made.service._lab.controller, made.servo.state
    interruption = Interruption()

    def asked():
        if len(loop.log) == 20:
            for method in ("stop", "stop_trajectory", "tt_clear_servo_joint_buf"):
                controller._methods[method] = lambda _: True
            interruption.receive(2)
            interruption.receive(2)
        return state()

    made.servo.state = asked
    outcome = loop.run(interruption)
    assert outcome.stop.kind == "not seen at rest"
    assert outcome.error().exit_code == 4
    controller.stop()


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "mode"), [(ServoLoop, "stream"), (Playback, "file")])
def test_a_signal_ends_it_and_the_arm_stands(bench, kind, mode):
    made = bench(mode=mode)
    loop, way = made.loop(kind)
    interruption = Interruption()
    state = made.servo.state

    def counted():
        if len(loop.log) == 20:
            interruption.receive(2)
        return state()

    made.servo.state = counted
    loop._arm.servo.state = counted
    outcome = loop.run(interruption)
    ends = {"stream": "decelerated along the path", "file": "stopped by the controller"}
    assert outcome.reason == f"SIGINT: {ends[mode]}"
    assert np.linalg.norm(stands(state) - way[-1]) > 2.0


def test_euler_angles_of_the_other_kind_are_found_out_and_can_be_chosen(bench):
    with pytest.raises(RefusedError, match="euler=zyx"):
        bench("euler=zyx").servo.open()
    bench("euler=zyx", euler="zyx").servo.open()


def test_a_tool_that_the_controller_does_not_know_is_refused(bench):
    with pytest.raises(RefusedError, match=r"apart; .*tool=N"):
        bench(tool=None).servo.open()
    bench(tool=None, check=0).servo.open()


@pytest.mark.slow
@pytest.mark.parametrize("habit", ["alarm", "hold", "decelerate"])
def test_an_arm_that_gets_no_more_set_points_stands_or_says_so(bench, habit):
    made = bench(f"underrun={habit}")
    made.servo.open()
    made.servo.start(PERIOD)
    at = made.servo.state().position
    time.sleep(0.9)
    state = made.servo.state()
    np.testing.assert_allclose(state.position, at, atol=0.05)
    assert (state.mode == "fault") == (habit == "alarm")


@pytest.mark.slow
def test_outputs_are_switched_on_the_way_and_off_at_its_end(bench):
    made = bench()
    loop, way = made.loop(
        events=(OutputEvent(0.3, "DO1", on=True), OutputEvent(0.7, "DO4", on=True))
    )
    assert loop.run(Interruption()).reason == DONE
    assert made.lab.controller.outputs == {1: 0, 4: 0}
    columns = loop.log.columns()
    rows = {text: i for i, text in enumerate(columns["event"]) if text}
    assert list(rows) == ["on DO1", "on DO4"]
    actual = np.column_stack([columns[name] for name in "xyz"])
    # 24 mm in a second: 0.9 mm in a period at the fastest, the monitor is 8 ms behind, and on a
    # busy machine a cycle wakes some milliseconds late.
    for text, sample in (("on DO1", 30), ("on DO4", 70)):
        assert np.linalg.norm(actual[rows[text]] - way[sample]) < 2.0


@pytest.mark.slow
def test_an_output_that_is_on_goes_off_with_an_emergency_stop(bench):
    made = bench()
    loop, _ = made.loop(duration=2.0, events=(OutputEvent(0.05, "DO1", on=True),))
    seen, running = [], threading.Event()
    running.set()

    def press():
        while not seen and running.is_set():
            with made.lab.lock:
                if made.lab.controller.outputs.get(1):
                    seen.append(True)
                    made.lab.controller.press_estop()
            time.sleep(0.005)

    hand = threading.Thread(target=press)
    hand.start()
    outcome = loop.run(Interruption())
    running.clear()
    hand.join()
    assert seen
    assert isinstance(outcome.failure, RefusedError)
    assert made.lab.controller.outputs == {1: 0}
