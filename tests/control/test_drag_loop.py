import signal
from dataclasses import replace

import numpy as np
import pytest

from dmpcli.control.drag_loop import Recorder
from dmpcli.control.signals import Interruption
from dmpcli.errors import InputError, InstrumentError, RefusedError
from dmpcli.instruments.clock import SimulatedClock
from dmpcli.settings.ranges import WIDEST
from dmpcli.simulation.mock import PEN
from tests.control.drag_fakes import FakeServo, QueueServo, drag_settings
from tests.control.fake_sensors import StreamingSensor

# A sensor in the TCP with nothing on it senses the wrench that moves the tool.
WEIGHTLESS = replace(PEN, tcp_position=PEN.sensor_position, weight=0.0, zero=np.zeros(6))
PULL = np.array([5.0, 0.0, 0.0, 0.0, 0.0, 0.0])
# The recording begins one tenth of a second after the clock's 0: the loop waits for samples first.
BEGAN = 0.1


def bench(
    longest=2.0,
    asked_to_end=lambda: False,
    tool=WEIGHTLESS,
    clock=None,
    signals=None,
    kind=FakeServo,
    **options,
):
    clock = clock or SimulatedClock()
    sensor, servo = StreamingSensor(clock), kind(clock)
    # Pulled from the first sample on, the tool would be taken for another one.
    settings = drag_settings(**{"tool_check": 1000.0} | options)
    recorder = Recorder(servo, sensor, clock, tool, settings, longest, signals, asked_to_end)
    return recorder, sensor, servo


def test_the_recording_lasts_as_long_as_asked_one_row_per_cycle():
    recorder, sensor, servo = bench(longest=2.0)
    ending = recorder.run()
    columns = recorder.log.columns()
    assert (ending.reason, ending.failure, recorder.timing.missed) == ("duration", None, 0)
    np.testing.assert_array_equal(columns["t"], np.round(np.arange(101) * 0.02, 9))
    assert servo.calls[0] == "open"
    assert servo.calls[-2:] == ["stop", "close"]
    assert sensor.closed == 1


def test_a_pull_moves_the_tool_as_the_admittance_says_and_the_file_holds_all():
    recorder, sensor, _ = bench(longest=4.0, dead_band_force=1.0)
    sensor.wrench = lambda t: PULL
    recorder.run()
    columns = recorder.log.columns()
    speed = np.gradient(columns["x_ref"], columns["t"])
    # 4 N past the dead-band, 0.08 N·s/mm.
    assert speed[-2] == pytest.approx(4.0 / 0.08, rel=1e-3)
    np.testing.assert_allclose(columns["fx"][-1], 4.0, rtol=1e-6)
    np.testing.assert_allclose(columns["fx_raw"], 5.0)
    assert (np.diff(columns["sensor_seq"]) == 2).all()
    np.testing.assert_allclose(columns["rx"], np.pi, atol=1e-9)


def test_the_tool_slows_to_rest_before_the_servo_is_left():
    recorder, sensor, servo = bench(longest=1.0, acceleration=200.0)
    sensor.wrench = lambda t: 4 * PULL
    recorder.run()
    t = np.array([when for when, _ in servo.sent])
    speed = np.diff([p[0] for _, p in servo.sent]) / np.diff(t)
    after = speed[t[1:] > BEGAN + 1.0 + 1e-6]
    assert len(after) > 10
    np.testing.assert_allclose(np.diff(after), -200.0 * 0.02, atol=4.1)
    assert after[-1] == pytest.approx(0.0, abs=4.0)


@pytest.mark.parametrize(
    ("lookahead", "drag", "told"),
    [(0.15, "admittance", False), (0.2, "admittance", True), (0.2, "builtin", False)],
)
def test_an_arm_that_lags_much_is_told_of_before_it_moves(lookahead, drag, told):
    class Led(FakeServo):
        def drag(self):
            self.calls.append("drag")

    recorder, _, servo = bench(longest=0.1, drag=drag, kind=lambda clock: Led(clock, lookahead))
    remarks = []
    recorder._remark = lambda text: remarks.append((text, len(servo.sent)))
    recorder.run()
    assert bool(remarks) is told
    assert all("look-ahead of 0.2 s" in text and sent == 0 for text, sent in remarks)


@pytest.mark.parametrize("lookahead", [0.1, 0.5])
def test_what_a_queue_still_holds_of_the_braking_is_not_cut_off(lookahead):
    recorder, sensor, servo = bench(longest=1.0, kind=lambda clock: QueueServo(clock, lookahead))
    sensor.wrench = lambda t: 4 * PULL
    assert recorder.run().failure is None
    assert servo.speed == pytest.approx(0.0, abs=0.1)
    np.testing.assert_allclose(servo.position, servo.sent[-1][1], atol=1e-9)
    assert servo.position[0] > 20.0


def test_an_arm_that_does_not_come_to_rest_is_told():
    recorder, _, servo = bench(longest=0.5)
    read = servo.state

    def swinging():
        state = read()
        away = np.array([np.sin(20.0 * state.t), 0.0, 0.0])
        return replace(state, position=state.position + away)

    servo.state = swinging
    ending = recorder.run()
    assert isinstance(ending.failure, InstrumentError)
    assert "does not come to rest" in ending.reason
    assert servo.calls[-2:] == ["stop", "close"]


@pytest.mark.slow
@pytest.mark.parametrize("kind", [QueueServo, FakeServo])
def test_a_queue_gets_the_set_points_that_it_is_owed_and_no_other_arm_does(kind):
    class Oversleeping(SimulatedClock):
        def sleep_until(self, t):
            # Once a second, by more than a period.
            super().sleep_until(t + (0.025 if 0.01 < t % 1.0 < 0.03 else 0.0))

    recorder, sensor, servo = bench(longest=20.0, clock=Oversleeping(), kind=kind, workspace=WIDEST)
    sensor.wrench = lambda t: PULL
    assert recorder.run().reason == "duration"
    assert recorder.timing.missed >= 19
    times, places = [t for t, _ in servo.sent], np.array([p[0] for _, p in servo.sent])
    elapsed = round((times[-1] - times[0]) / 0.02) + 1
    owed = recorder.timing.missed if kind is QueueServo else 0
    assert len(places) == elapsed - recorder.timing.missed + owed
    # Every step is one that the admittance makes in a period: none is faster than the steady drag.
    assert np.diff(places).max() <= 0.02 * (4.0 / 0.08) + 1e-6
    if kind is QueueServo:
        assert servo.dry == 0
        assert servo.level >= 4


def test_a_tool_that_moved_while_the_servos_came_on_is_led_from_where_it_is():
    recorder, _, servo = bench(longest=1.0)
    begin = servo.start

    def start(period):
        begin(period)
        servo.position = np.array([0.0, 0.0, -30.0])

    servo.start = start
    assert recorder.run().reason == "duration"
    places = np.array([p for _, p in servo.sent])
    np.testing.assert_allclose(places - [0.0, 0.0, -30.0], 0.0, atol=1e-9)


def test_a_tool_that_left_the_workspace_while_the_servos_came_on_is_not_led():
    recorder, _, servo = bench(longest=1.0, workspace=(-9.0, 9.0, -9.0, 9.0, -9.0, 9.0))
    begin = servo.start

    def start(period):
        begin(period)
        servo.position = np.array([0.0, 0.0, -30.0])

    servo.start = start
    assert "leaves the workspace" in recorder.run().reason
    assert servo.sent == []
    assert servo.calls[-2:] == ["stop", "close"]


def test_a_signal_while_the_servos_come_on_lets_no_motion_begin():
    signals = Interruption()
    recorder, _, servo = bench(signals=signals)
    begin = servo.start

    def start(period):
        begin(period)
        signals.receive(signal.SIGINT)

    servo.start = start
    assert recorder.run().reason == "SIGINT: stopped before anything moved"
    assert servo.sent == []
    assert servo.calls[-2:] == ["stop", "close"]


def test_what_was_felt_while_the_servos_came_on_is_checked_and_then_forgotten():
    recorder, sensor, servo = bench(longest=1.0)
    begin = servo.start

    def start(period):
        begin(period)
        servo.clock.sleep_until(5.0)

    servo.start = start
    sensor.wrench = lambda t: 4 * PULL if 1.0 < t < 4.9 else np.zeros(6)
    assert recorder.run().reason == "duration"
    np.testing.assert_array_equal(recorder.log.columns()["fx"], 0.0)
    recorder, sensor, servo = bench(longest=1.0)
    begin, servo.start = servo.start, start
    sensor.wrench = lambda t: np.full(6, np.nan) if 2.0 < t < 2.1 else np.zeros(6)
    assert "not a number" in recorder.run().reason
    assert servo.sent == []


def test_a_robot_that_only_plays_whole_plans_is_refused_before_it_is_opened():
    recorder, _, servo = bench()
    servo.upload = servo.play = lambda *_: None
    with pytest.raises(InputError, match="mode=file only plays whole plans; leave it out"):
        recorder.run()
    assert servo.calls == []


def test_silence_for_two_cycles_brakes_and_for_a_tenth_of_a_second_stops():
    recorder, sensor, servo = bench(longest=5.0)
    sensor.wrench = lambda t: PULL
    sensor.silent = lambda t: t > 1.0
    ending = recorder.run()
    assert isinstance(ending.failure, InstrumentError)
    assert "silent" in ending.reason
    last = servo.sent[-1][0]
    assert 1.0 < last <= 1.1 + 1e-9
    # From the third cycle without a sample on, the reference slows down.
    speeds = np.diff([p[0] for _, p in servo.sent]) / 0.02
    assert speeds[-1] < 0.2 * speeds.max()
    assert servo.calls[-2:] == ["stop", "close"]
    assert len(recorder.log) > 40  # kept


def test_one_late_sample_is_forgiven():
    recorder, sensor, _ = bench(longest=2.0)
    sensor.wrench = lambda t: PULL
    sensor.silent = lambda t: 1.0 < t < 1.025
    assert recorder.run().reason == "duration"


@pytest.mark.parametrize(
    ("wrench", "words"),
    [
        (np.array([81.0, 0, 0, 0, 0, 0]), "Fx = 81 is over 80% of its range"),
        (np.array([0, 0, 0, 0, -85.0, 0]), "Ty = -85 is over 80% of its range"),
    ],
)
def test_a_reading_near_the_end_of_the_range_stops(wrench, words):
    recorder, sensor, servo = bench()
    sensor.wrench = lambda t: wrench if t > 1.0 else np.zeros(6)
    ending = recorder.run()
    assert isinstance(ending.failure, InstrumentError)
    assert words in ending.reason
    assert servo.sent[-1][0] <= 1.02


def test_an_unhealthy_sample_stops():
    recorder, sensor, _ = bench()
    sensor.healthy = False
    with pytest.raises(InstrumentError, match="faulty"):
        recorder.run()


@pytest.mark.parametrize("mode", ["emergency stop", "protective stop", "fault", "stopped"])
def test_a_robot_that_is_not_ready_is_not_started(mode):
    recorder, _, servo = bench()
    servo.mode = mode
    with pytest.raises(RefusedError, match=mode):
        recorder.run()
    assert "start" not in servo.calls
    assert not servo.sent
    assert servo.calls[-1] == "close"


def test_an_emergency_stop_on_the_way_ends_the_recording_and_keeps_it():
    recorder, _, servo = bench()
    servo.mode = lambda t: "ready" if t < 1.0 else "emergency stop"
    ending = recorder.run()
    assert isinstance(ending.failure, RefusedError)
    assert len(recorder.log) == 45
    assert "stop" in servo.calls


def test_a_refused_set_point_ends_the_recording():
    recorder, _, servo = bench()
    servo.accepts = lambda t: t < 1.0
    ending = recorder.run()
    assert isinstance(ending.failure, InstrumentError)
    assert "refused a set-point" in ending.reason


def test_a_sensor_that_never_speaks_is_named_before_anything_moves():
    recorder, sensor, servo = bench()
    sensor.silent = lambda t: True
    with pytest.raises(InstrumentError, match="sends nothing"):
        recorder.run()
    assert not servo.sent
    assert sensor.closed == 1


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (
            {"control_rate": 5.0},
            "control_rate = 5 Hz: the fake robot .*10 to 500 Hz",
        ),
        ({"sensor_rate": 2000.0}, "sensor_rate = 2000 Hz: the fake sensor sends at most 1000"),
    ],
)
def test_rates_that_the_instruments_do_not_take_are_refused(options, words):
    recorder, _, servo = bench(**options)
    with pytest.raises(InputError, match=words):
        recorder.run()
    assert not servo.sent


def test_asking_ends_the_recording():
    left = iter([False] * 30 + [True])
    recorder, _, _ = bench(longest=np.inf, asked_to_end=lambda: next(left))
    assert recorder.run().reason == "asked"
    assert len(recorder.log) == 31


def test_until_rest_waits_for_motion_and_then_for_rest():
    recorder, sensor, _ = bench(longest=20.0, until_rest=0.6)
    sensor.wrench = lambda t: PULL if 3.0 < t < 4.0 else np.zeros(6)
    assert recorder.run().reason == "rest"
    # Coasting takes a few M/D = 62 ms; then 0.6 s of rest.
    assert 4.5 < BEGAN + recorder.log.duration < 5.2


def test_until_rest_does_not_end_before_the_tool_has_moved():
    recorder, _, _ = bench(longest=3.0, until_rest=0.5)
    assert recorder.run().reason == "duration"


def test_the_zero_is_taken_at_rest_where_the_tool_has_none():
    zero = np.array([3.0, -2.0, 1.0, 0.1, 0.2, -0.3])
    recorder, sensor, servo = bench(tool=replace(WEIGHTLESS, zero=None), bias_time=0.4)
    sensor.wrench = lambda t: zero
    recorder.run()
    np.testing.assert_allclose(servo.position, 0.0, atol=1e-9)
    np.testing.assert_allclose(recorder.log.columns()["fx"], 0.0, atol=1e-9)


def test_a_late_loop_skips_cycles_and_never_sends_a_burst():
    class Oversleeping(SimulatedClock):
        def sleep_until(self, t):
            super().sleep_until(t + (0.07 if 1.01 < t < 1.03 else 0.0))

    recorder, _, servo = bench(longest=2.0, clock=Oversleeping())
    ending = recorder.run()
    assert (ending.reason, recorder.timing.missed) == ("duration", 3)
    assert np.diff([t for t, _ in servo.sent]).min() > 0.009


def test_a_loop_that_is_late_by_more_than_half_the_look_ahead_stops():
    class Oversleeping(SimulatedClock):
        def sleep_until(self, t):
            super().sleep_until(t + (0.11 if 1.01 < t < 1.03 else 0.0))

    recorder, _, servo = bench(longest=2.0, clock=Oversleeping())
    ending = recorder.run()
    assert isinstance(ending.failure, RefusedError)
    assert "110 ms late" in ending.reason
    assert servo.sent[-1][0] < 1.01
    assert servo.calls[-2:] == ["stop", "close"]


def test_a_cycle_that_computes_too_long_counts_as_late():
    recorder, _, servo = bench(longest=2.0)
    read = servo.state

    def slow():
        if 1.01 < recorder._clock.now() < 1.03:
            recorder._clock.sleep_until(1.2)
        return read()

    servo.state = slow
    ending = recorder.run()
    assert isinstance(ending.failure, RefusedError)
    assert "late" in ending.reason


def test_a_stale_sensor_zeroes_the_force_that_is_believed():
    """The pull goes on, but nobody has said so for three cycles."""
    recorder, sensor, _ = bench(longest=2.0)
    sensor.wrench = lambda t: PULL
    sensor.silent = lambda t: 1.0 < t < 1.085
    assert recorder.run().reason == "duration"
    columns = recorder.log.columns()
    t, fx, speed = BEGAN + columns["t"], columns["fx"], np.gradient(columns["x_ref"]) / 0.02
    stale = (t > 1.045) & (t < 1.085)
    assert stale.sum() == 2
    np.testing.assert_array_equal(fx[stale], 0.0)
    assert (fx[~stale & (t > 0.5)] > 3.5).all()
    assert speed[stale][-1] < speed[t < 1.0].max()


@pytest.mark.parametrize("signals_sent", [1, 2])
def test_a_signal_brakes_and_a_second_one_stops_at_once(signals_sent):
    signals = Interruption()
    recorder, sensor, servo = bench(longest=np.inf, signals=signals, acceleration=200.0)
    sensor.wrench = lambda t: 4 * PULL
    read = servo.state

    def state():
        if servo.clock.now() > 1.0 and not signals.count:
            for _ in range(signals_sent):
                signals.receive(signal.SIGINT)
        return read()

    servo.state = state
    ending = recorder.run()
    how = "after braking to rest" if signals_sent == 1 else "at once at the second signal"
    assert (ending.reason, ending.failure) == (f"SIGINT: stopped {how}", None)
    assert len(recorder.log) == 47
    braking = [t for t, _ in servo.sent if t > 1.03]
    assert (len(braking) > 10) == (signals_sent == 1)
    assert servo.calls[-2:] == ["stop", "close"]


def test_a_signal_before_the_motion_lets_none_begin():
    signals = Interruption()
    signals.receive(signal.SIGTERM)
    recorder, _, servo = bench(signals=signals)
    assert recorder.run().reason == "SIGTERM: stopped before anything moved"
    assert "start" not in servo.calls
    assert not servo.sent


@pytest.mark.parametrize("deed", ["stop", "close"])
def test_an_arm_that_cannot_be_left_is_a_failure_with_its_recording(deed):
    def unreachable():
        raise InstrumentError("fake: does not answer")

    recorder, sensor, servo = bench()
    setattr(servo, deed, unreachable)
    ending = recorder.run()
    told = {"stop": "THE ARM MAY STILL MOVE: it could not be told to stop: ", "close": ""}
    assert ending.reason.startswith(f"{told[deed]}fake: does not answer")
    assert isinstance(ending.error(), InstrumentError)
    assert len(recorder.log) == 101
    assert sensor.closed == 1


def test_the_first_failure_is_the_one_told():
    def unreachable():
        raise InstrumentError("fake: does not answer")

    recorder, _, servo = bench()
    servo.stop = servo.close = unreachable
    servo.mode = lambda t: "ready" if t < 1.0 else "emergency stop"
    assert "emergency stop" in recorder.run().reason


def test_a_defect_is_raised_but_the_arm_is_stopped_and_the_log_kept():
    recorder, sensor, servo = bench()
    recorder._asked_to_end = lambda: len(recorder.log) == 45 and 1 / 0
    with pytest.raises(ZeroDivisionError):
        recorder.run()
    assert servo.calls[-2:] == ["stop", "close"]
    assert sensor.closed == 1
    assert len(recorder.log) == 45


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_wrench_that_is_not_a_number_stops(value):
    recorder, sensor, servo = bench()
    sensor.wrench = lambda t: np.full(6, value) if t > 1.0 else PULL
    ending = recorder.run()
    assert isinstance(ending.failure, InstrumentError)
    assert np.isfinite([p for _, p in servo.sent]).all()
    assert servo.sent[-1][0] <= 1.02


@pytest.mark.parametrize("attribute", ["position", "rotation"])
def test_a_pose_that_is_not_a_number_stops(attribute):
    recorder, _, servo = bench()
    read = servo.state

    def state():
        if servo.clock.now() > 1.0:
            setattr(servo, attribute, np.full_like(getattr(servo, attribute), np.nan))
        return read()

    servo.state = state
    ending = recorder.run()
    assert isinstance(ending.failure, InstrumentError)
    assert "not a number" in ending.reason
    assert np.isfinite([p for _, p in servo.sent]).all()


def test_the_reference_does_not_run_away_from_an_arm_that_is_blocked():
    recorder, sensor, servo = bench(longest=5.0, following_error=4.0)
    sensor.wrench = lambda t: PULL
    accept = servo.send

    def blocked(position, rotation):
        here = servo.position
        taken = accept(position, rotation)
        servo.position = here if servo.clock.now() > 1.0 else position
        return taken

    servo.send = blocked
    ending = recorder.run()
    assert isinstance(ending.failure, RefusedError)
    assert "following error" in ending.reason
    # At 50 mm/s the reference gains 1 mm a cycle; the trail reaches back 0.3 s, 15 mm.
    assert np.linalg.norm(servo.sent[-1][1] - servo.position) < 4.0 + 15.0 + 2.0


def test_the_tool_is_not_led_out_of_the_workspace():
    box = (-100.0, 20.0, -100.0, 100.0, -100.0, 100.0)
    recorder, sensor, servo = bench(longest=9.0, workspace=box)
    sensor.wrench = lambda t: PULL
    ending = recorder.run()
    assert isinstance(ending.failure, RefusedError)
    assert "workspace" in ending.reason
    assert 18.0 < max(p[0] for _, p in servo.sent) <= 20.0


def test_a_tool_outside_the_workspace_is_not_started():
    recorder, _, servo = bench(workspace=(1.0, 2.0, -9.0, 9.0, -9.0, 9.0))
    with pytest.raises(RefusedError, match="workspace"):
        recorder.run()
    assert not servo.sent


def test_a_robot_without_drag_teaching_cannot_be_dragged_by_its_own():
    recorder, _, _ = bench(drag="builtin")
    with pytest.raises(InputError, match="no drag teaching"):
        recorder.run()


def test_a_hindrance_brakes_and_is_what_the_recording_ends_with():
    full = InstrumentError("demo.journal: No space left on device")
    clock = SimulatedClock()
    sensor, servo = StreamingSensor(clock), FakeServo(clock)
    recorder = Recorder(
        servo,
        sensor,
        clock,
        WEIGHTLESS,
        drag_settings(),
        5.0,
        hindrance=lambda: full if clock.now() > 1.0 else None,
    )
    ending = recorder.run()
    assert ending.failure is full
    assert ending.reason == str(full)
    assert len(recorder.log) == 47


@pytest.mark.parametrize(
    ("wrench", "words"),
    [
        (np.array([0.0, 21.0, 0.0, 0.0, 0.0, 0.0]), "force 21 N on the tool is over 20 N"),
        (np.array([0.0, 0.0, 0.0, 0.0, 0.0, 2.1]), "torque 2.1 N·m on the tool is over 2 N·m"),
    ],
)
def test_more_force_or_torque_than_the_tool_may_meet_stops(wrench, words):
    recorder, sensor, servo = bench(max_force=20.0, max_torque=2.0)
    sensor.wrench = lambda t: wrench if t > 1.0 else np.zeros(6)
    ending = recorder.run()
    assert isinstance(ending.failure, RefusedError)
    assert words in ending.reason
    assert servo.sent[-1][0] <= 1.02


@pytest.mark.slow
@pytest.mark.parametrize("workspace", [None, (-50.0, 50.0, -900.0, 900.0, -900.0, 900.0), WIDEST])
def test_an_arm_that_runs_away_is_held_in_a_room_about_its_start(workspace):
    """Whatever pulls it, for as long as it likes: a bias that nobody has noticed, for one."""
    recorder, sensor, servo = bench(longest=40.0, workspace=workspace)
    servo.position = np.array([700.0, 0.0, 0.0]) if workspace is None else np.zeros(3)
    begin = servo.position
    sensor.wrench = lambda t: PULL
    ending = recorder.run()
    away = float(np.abs(servo.position - begin).max())
    if workspace == WIDEST:
        assert (ending.reason, away > 600.0) == ("duration", True)
    else:
        assert "leaves the workspace" in ending.reason
        assert away <= (500.0 if workspace is None else 50.0)


def test_where_the_arm_tells_nothing_new_there_is_no_new_row():
    """The same report again, or one that differs by the rounding of a clock's sums."""
    recorder, _, servo = bench(longest=1.0)
    read, held = servo.state, []

    def state():
        told = read()
        # Every third report comes again, a third of a nanosecond younger.
        if len(held) % 3 == 2:
            told = replace(told, t=held[-1].t + 3e-10)
        held.append(told)
        return told

    servo.state = state
    assert recorder.run().failure is None
    t = recorder.log.columns()["t"]
    assert np.diff(t).min() > 1e-3
    assert 20 < len(t) < 40


@pytest.mark.parametrize("early", [0.009, 0.011])
def test_a_recording_begins_half_a_period_before_its_time_and_not_earlier(early):
    """A report that is so much older than its cycle: after the lead-in it is the first row."""
    recorder, _, servo = bench(longest=1.0)
    recorder._lead_in = 0.2
    read = servo.state
    servo.state = lambda: replace(read(), t=servo.clock.now() - early)
    assert recorder.run().reason == "duration"
    t = recorder.log.columns()["t"]
    assert t[0] == pytest.approx(-early if early < 0.01 else 0.02 - early)
    assert t[-1] <= 1.0 + 0.01


def test_the_newest_reading_stands_beside_what_was_made_of_it():
    recorder, sensor, _ = bench(longest=1.0, low_pass=49.0, dead_band_force=0.0)
    sensor.wrench = lambda t: np.array([np.sin(3.0 * t), 0.0, 0.0, 0.0, 0.0, 0.0])
    recorder.run()
    columns = recorder.log.columns()
    newest = columns["t"] + BEGAN
    np.testing.assert_allclose(columns["fx_raw"], np.sin(3.0 * newest), atol=1e-9)
    # The first cycle has felt nothing yet; from then on the low-pass lags by half a millisecond.
    lag = np.abs(columns["fx"] - columns["fx_raw"])[1:]
    assert 1e-4 < lag.max() < 2e-3
    np.testing.assert_array_equal(columns["lost"], 0)


def test_it_ends_for_the_first_reason_that_there_is():
    recorder, _, _ = bench(longest=2.0)
    assert recorder._reason_to_end(1.9899) == ""
    assert recorder._reason_to_end(1.9901) == "duration"
    recorder._asked_to_end = lambda: True
    assert recorder._reason_to_end(9.0) == "asked"
    recorder._asked_to_end = lambda: False
    recorder._interruption.receive(2)
    assert recorder._reason_to_end(0.0) == "asked"
    recorder._hindrance = lambda: InstrumentError("disk full")
    assert recorder._reason_to_end(0.0) == "disk full"


def test_a_chatter_makes_the_drag_heavier_along_the_tool_and_is_told():
    """Pushed to and fro by 6 N at 2 Hz along the tool."""
    recorder, sensor, _ = bench(longest=3.0)
    said = []
    recorder._noticed = said.append
    sensor.wrench = lambda t: np.array([0.0, 0.0, 6.0 * np.sin(12.6 * t), 0.0, 0.0, 0.0])
    before = recorder._law
    recorder.run()
    alarms = recorder.chatter.alarms
    assert len(said) == len(alarms) >= 1
    grown = 1.6 ** len(alarms)
    np.testing.assert_allclose(recorder._law.damping / before.damping, [1, 1, grown, 1, 1, 1])
    # Across the tool nothing chatters.
    recorder, sensor, _ = bench(longest=3.0)
    sensor.wrench = lambda t: np.array([6.0 * np.sin(12.6 * t), 0.0, 0.0, 0.0, 0.0, 0.0])
    recorder.run()
    assert recorder.chatter.alarms == []


def test_where_others_may_move_the_arm_it_must_stand_still_when_it_is_taken():
    for shared, drag, waits in ((True, "admittance", True), (False, "admittance", False)):
        recorder, _, servo = bench(longest=0.2, drag=drag)
        recorder._shared = shared
        begun = servo.clock.now()
        recorder.run()
        assert (servo.sent[0][0] - begun > 0.25) is waits


@pytest.mark.parametrize(("rate", "fits"), [(1000.0, True), (1000.5, False)])
def test_a_sensor_may_be_asked_for_all_that_it_sends_and_no_more(rate, fits):
    """A thousand samples a second."""
    recorder, _, _ = bench(longest=0.1, sensor_rate=rate)
    if fits:
        assert recorder.run().reason == "duration"
        return
    with pytest.raises(InputError, match="the fake sensor sends at most 1000"):
        recorder.run()
