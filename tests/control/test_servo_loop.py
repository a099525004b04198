import dataclasses
import signal

import numpy as np
import pytest

from dmpcli.admittance.force_coupling import fast_filter
from dmpcli.control.contact_policy import ContactPolicy
from dmpcli.control.contact_supervisor import ContactSupervisor
from dmpcli.control.cycle import LoopOutcome, ReadyArm, StopLimits
from dmpcli.control.force_sensing import Sensing
from dmpcli.control.force_tracking import ForceInput, ForceTracker
from dmpcli.control.playback import Playback
from dmpcli.control.servo_loop import DONE, ServoLoop
from dmpcli.control.signals import Interruption
from dmpcli.control.stopping import StopOutcome
from dmpcli.errors import InputError, InstrumentError, RefusedError
from dmpcli.instruments.protocols import SensorInfo
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.rotations import exp
from tests.control.fake_sensors import PolledSensor, StreamingSensor
from tests.control.streaming_fakes import (
    PEN_DOWN,
    START,
    WIDE,
    FakeClock,
    FakeServo,
    plan,
    rows_of,
    stroke,
)

WATCH = StopLimits(5.0, 0.1, 50.0, 5.0)
PERIOD = 0.02
# Of what the loop itself watches, the test's touch feels nothing.
NOTHING = np.zeros(6)


class PlateSensor(PolledSensor):
    """Feels a plate of 2 N/mm through the stroke, as long as `plate`; else its `wrench`."""

    def __init__(self, clock, servo):
        super().__init__(clock)
        self.servo, self.plate = servo, START[2]

    def poll(self):
        if self.plate is not None:
            pushes = 2.0 * max(self.plate - self.servo.position[2], 0.0)
            self.wrench = np.array([0.0, 0.0, pushes, 0.0, 0.0, 0.0])
        return super().poll()


class Bench:
    def __init__(self, made=None, jumps=None, at=None, limits=WIDE, presses=False, **servo):
        self.plan = plan() if made is None else made
        self.clock = FakeClock(self.plan.period, jumps)
        self.servo = FakeServo(self.clock, at=at, **servo)
        self.interruption = Interruption()
        arm = ReadyArm(self.servo, self.servo.info, self.clock)
        self.sensor = PlateSensor(self.clock, self.servo) if presses else PolledSensor(self.clock)
        self.loop = ServoLoop(self.plan, limits, WATCH, arm, self.touch() if presses else None)

    def touch(self):
        """Feel in base axes; look for the surface at 2 mm/s."""
        info = SensorInfo("fake", 100.0, np.full(6, 100.0))
        sensing = Sensing(self.sensor, info, 100.0, PERIOD, self.clock)
        supervisor = ContactSupervisor(ContactPolicy(5.0, delay=0.02), PERIOD)
        pressing = ForceTracker(supervisor, fast_filter(5.0, PERIOD), self.plan)
        return ForceInput(sensing, lambda sensed, _: sensed, pressing)

    def run(self):
        return self.loop.run(self.interruption)

    @property
    def rows(self):
        return rows_of(self.loop.log)

    def column(self, name):
        return np.array([getattr(row, name) for row in self.rows])

    def stroke_rows(self):
        return [row for row in self.rows if row.phase == "stroke"]


def test_an_undisturbed_run_sends_the_plan():
    bench = Bench()
    outcome = bench.run()
    assert (outcome.reason, outcome.failure, outcome.signal) == (DONE, None, None)
    assert bench.loop.timing.missed == 0
    sent = np.array([row.sent[0] for row in bench.stroke_rows()])
    assert np.array_equal(sent, bench.plan.position)
    assert np.array_equal(bench.column("deadline"), np.arange(len(bench.rows)) * 0.02)
    assert np.all(bench.column("lateness") < 1e-9)
    assert bench.servo.calls == ["start", "stop"]


def older(state, age):
    return dataclasses.replace(state, t=state.t - age)


def test_a_row_tells_when_the_pose_was_true_not_when_it_was_read():
    bench = Bench()
    state = bench.servo.state
    ages = iter(np.tile([0.008, 0.004, 0.0], 1000))
    bench.servo.state = lambda: older(state(), next(ages))
    bench.run()
    late = bench.column("deadline") - bench.column("t")
    assert set(np.round(late, 9)) == {0.0, 0.004, 0.008}


def test_it_holds_the_goal_until_the_look_ahead_has_passed():
    bench = Bench()
    bench.run()
    held = [row for row in bench.rows if row.phase == "stop"]
    assert len(held) * 0.02 >= 0.2
    assert all(np.array_equal(row.sent[0], bench.plan.position[-1]) for row in held)


def test_a_small_delay_is_not_carried_on():
    bench = Bench(jumps={100: 0.015})
    bench.run()
    assert bench.loop.timing.missed == 0
    late = bench.column("lateness")
    assert late[100] == pytest.approx(0.015)
    assert np.delete(late, 100).max() < 1e-9
    assert len(bench.stroke_rows()) == 501


def test_after_a_late_cycle_the_plan_goes_on_from_where_it_is():
    """65 ms late at deadline 100: deadlines 101-103 are gone, and the stroke ends 60 ms later."""
    bench = Bench(jumps={100: 0.065})
    outcome = bench.run()
    assert (outcome.reason, bench.loop.timing.missed) == (DONE, 3)
    np.testing.assert_allclose(
        bench.column("deadline")[98:103], [1.96, 1.98, 2.0, 2.08, 2.1], atol=1e-9
    )
    assert bench.rows[100].lateness == pytest.approx(0.065)
    assert np.array_equal([row.sent[0] for row in bench.stroke_rows()], bench.plan.position)
    assert np.all(np.diff(bench.column("t")) > 0)
    assert bench.stroke_rows()[-1].deadline == pytest.approx(10.0 + 0.06)


def test_lateness_breaks_no_limit_that_was_checked_before():
    """At 128 mm/s four set-points at once would be 512 mm/s; the limit is 250."""
    bench = Bench(plan(stroke(duration=1.6)), jumps={30: 0.07, 40: 0.045, 50: 0.09})
    bench.run()
    assert bench.loop.timing.missed == 3 + 2 + 4
    sent = np.array([row.sent[0] for row in bench.rows])
    step = np.diff(sent, axis=0)
    assert np.linalg.norm(step, axis=1).max() / PERIOD <= WIDE.speed
    assert np.linalg.norm(np.diff(step, axis=0), axis=1).max() / PERIOD**2 <= WIDE.acceleration


def test_a_late_first_cycle_begins_at_the_first_set_point():
    bench = Bench(jumps={0: 0.045})
    bench.run()
    assert bench.loop.timing.missed == 2
    assert np.array_equal(bench.rows[0].sent[0], bench.plan.position[0])
    assert bench.rows[1].deadline == pytest.approx(0.06)


def test_no_two_set_points_leave_in_one_period_after_a_delay():
    bench = Bench(jumps={100: 0.065})
    bench.run()
    at = bench.column("deadline") + bench.column("lateness")
    assert np.diff(at).min() > 0.0149


def test_later_than_half_the_look_ahead_stops():
    bench = Bench(jumps={100: 0.11})
    outcome = bench.run()
    assert isinstance(outcome.failure, RefusedError)
    assert "110 ms late" in outcome.reason
    assert "look-ahead" in outcome.reason
    assert len(bench.servo.sent) == 100
    assert len(bench.rows) == 101
    assert bench.servo.calls[-1] == "stop"


def test_without_a_look_ahead_a_period_is_allowed():
    assert Bench(jumps={100: 0.019}, lookahead=0.0).run().failure is None
    assert isinstance(Bench(jumps={100: 0.021}, lookahead=0.0).run().failure, RefusedError)


@pytest.mark.parametrize("mode", ["emergency stop", "protective stop", "fault", "not ready"])
def test_any_mode_but_ready_stops_at_once(mode):
    bench = Bench(at={200: lambda servo: setattr(servo, "mode", mode)})
    outcome = bench.run()
    assert isinstance(outcome.failure, RefusedError)
    assert mode in outcome.reason
    assert len(bench.servo.sent) == 200
    last = bench.rows[-1]
    assert last.state == mode
    assert len(bench.rows) == 201
    assert np.array_equal(last.sent[0], bench.servo.sent[-1][0])


def test_a_refused_set_point_stops():
    bench = Bench(at={150: lambda servo: setattr(servo, "accepts", False)})
    outcome = bench.run()
    assert isinstance(outcome.failure, InstrumentError)
    assert "refused" in outcome.reason
    assert len(bench.servo.sent) == 150
    assert bench.servo.calls == ["start", "stop"]


def test_an_arm_that_stands_still_is_a_following_error():
    bench = Bench(at={200: lambda servo: setattr(servo, "stuck", True)})
    outcome = bench.run()
    assert isinstance(outcome.failure, RefusedError)
    assert "following error" in outcome.reason
    moved = np.linalg.norm(bench.servo.sent[-1][0] - bench.servo.position)
    assert WATCH.following_error < moved < 20.0


def test_an_arm_that_strays_is_a_following_error():
    def push(servo):
        servo.stuck = True
        servo.position = servo.sent[-1][0] + np.array([0.0, 0.0, 5.1])

    outcome = Bench(at={200: push}).run()
    assert isinstance(outcome.failure, RefusedError)
    assert "following error 5.1" in outcome.reason


def test_an_arm_that_twists_is_a_following_error():
    def twist(servo):
        servo.stuck = True
        servo.rotation = exp(np.array([0.0, 0.15, 0.0])) @ PEN_DOWN

    outcome = Bench(at={200: twist}).run()
    assert isinstance(outcome.failure, RefusedError)
    assert "0.150 rad" in outcome.reason


def test_the_delay_of_the_look_ahead_is_no_following_error():
    """A stroke at 150 mm/s behind 0.2 s lags by 30 mm, along its own path."""

    class Delayed(FakeServo):
        def state(self):
            state = super().state()
            if len(self.sent) > 10:
                self.position, self.rotation = self.sent[-11]
                return type(state)(state.t, self.position, self.rotation, state.mode)
            return type(state)(state.t, START, PEN_DOWN, state.mode)

    bench = Bench(plan(stroke(duration=2.5)))
    servo = Delayed(bench.clock)
    loop = ServoLoop(bench.plan, WIDE, WATCH, ReadyArm(servo, servo.info, bench.clock))
    assert loop.run(bench.interruption).reason == DONE
    lag = np.linalg.norm([r.sent[0] - r.actual[0] for r in rows_of(loop.log)], axis=1)
    assert lag.max() > 3 * WATCH.following_error
    assert lag[-1] < 1e-9


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("at", [5, 200, 499])
def test_a_signal_decelerates_along_the_path(number, at):
    bench = Bench()
    bench.servo.at[at] = lambda servo: bench.interruption.receive(number)
    outcome = bench.run()
    assert (outcome.signal, outcome.failure) == (number, None)
    assert "decelerated" in outcome.reason
    sent = np.array([row.sent[0] for row in bench.rows])
    acceleration = np.diff(sent, 2, axis=0) / 0.02**2
    assert np.linalg.norm(acceleration, axis=1).max() <= WIDE.acceleration
    u = np.unwrap(np.arctan2(0, 1) + (START[0] - sent[:, 0]))
    on_path = START[1] + 25.0 * np.sin(2 * np.pi * u / 109.0)
    np.testing.assert_allclose(sent[:, 1], on_path, atol=1e-4)
    assert {row.phase for row in bench.rows[at + 1 :]} <= {"stop"}
    np.testing.assert_allclose(bench.rows[-1].actual[0], sent[-1])
    if at < 499:
        assert START[0] - sent[-1, 0] < 108.99


def test_a_second_signal_stops_at_once():
    bench = Bench(plan(stroke(duration=1.6)))
    bench.servo.at[40] = lambda servo: bench.interruption.receive(signal.SIGINT)
    bench.servo.at[42] = lambda servo: bench.interruption.receive(signal.SIGINT)
    outcome = bench.run()
    assert outcome.signal == signal.SIGINT
    assert "second signal" in outcome.reason
    assert len(bench.servo.sent) == 42
    assert bench.servo.calls[-1] == "stop"


@pytest.mark.parametrize("at", [501, 505, 510])
def test_a_signal_after_the_last_set_point_ends_no_run_early(at):
    bench = Bench(at={at: lambda servo: bench.interruption.receive(signal.SIGINT)})
    outcome = bench.run()
    assert (outcome.reason, outcome.signal, outcome.failure) == (DONE, None, None)
    assert bench.loop.drawn == ["0"]


def test_a_signal_while_the_arm_is_stopped_after_its_end_is_none():
    bench = Bench()
    bench.servo.stop = lambda: bench.interruption.receive(signal.SIGINT)
    assert (bench.run().reason, bench.interruption.count) == (DONE, 1)


def test_a_second_signal_stops_at_once_at_the_end_too():
    def twice(servo):
        bench.interruption.receive(signal.SIGINT)
        bench.interruption.receive(signal.SIGINT)

    bench = Bench(at={505: twice})
    outcome = bench.run()
    assert outcome.signal == signal.SIGINT
    assert "second signal" in outcome.reason


def test_an_emergency_stop_outweighs_a_signal():
    def both(servo):
        bench.interruption.receive(signal.SIGINT)
        servo.mode = "emergency stop"

    bench = Bench(at={60: both})
    outcome = bench.run()
    assert (type(outcome.failure), outcome.signal) == (RefusedError, None)


def test_an_instrument_that_fails_keeps_the_rows_and_stops_the_arm():
    def fail(servo):
        raise InstrumentError("fake: connection lost")

    bench = Bench(at={123: fail})
    outcome = bench.run()
    assert isinstance(outcome.failure, InstrumentError)
    assert outcome.reason == "fake: connection lost"
    assert len(bench.rows) == 123
    assert bench.servo.calls[-1] == "stop"


def test_an_arm_that_cannot_be_stopped_is_a_failure_with_its_rows():
    def unreachable():
        raise InstrumentError("fake: does not answer")

    bench = Bench()
    bench.servo.stop = unreachable
    outcome = bench.run()
    assert "could not be told to stop: fake: does not answer" in outcome.reason
    assert isinstance(outcome.failure, InstrumentError)
    assert len(bench.rows) > 500


def test_a_defect_is_raised_but_the_arm_is_stopped():
    def defect(servo):
        raise ZeroDivisionError

    bench = Bench(at={10: defect})
    with pytest.raises(ZeroDivisionError):
        bench.run()
    assert bench.servo.calls[-1] == "stop"
    assert len(bench.rows) == 10


def test_an_arm_that_never_rests_is_reported():
    def shake(servo):
        servo.stuck = True
        servo.position = servo.sent[-1][0] + np.array([0.0, 0.0, 0.2 * (-1) ** servo.reads])
        servo.at[servo.reads] = shake

    outcome = Bench(at={502: shake}).run()
    assert isinstance(outcome.failure, InstrumentError)
    assert "does not come to rest" in outcome.reason


# --- with the force coupling

UP = (0.0, 0.0, 1.0)


def pressing(**options):
    return Bench(plan(stroke(normal=UP)), presses=True, **options)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_while_it_seeks_contact_ends_the_seeking(number):
    """Seeking goes on towards the surface; from the signal on nothing may move."""
    bench = pressing(at={140: lambda servo: bench.interruption.receive(number)})
    bench.sensor.plate = None
    outcome = bench.run()
    assert (outcome.signal, outcome.failure) == (number, None)
    assert bench.rows[139].contact == "seeking"
    height = np.array([row.sent[0][2] for row in bench.rows]) - START[2]
    assert 0.0 < height[139] < height[100]
    np.testing.assert_array_equal(height[140:], height[139])
    assert len(height) < 140 + 50


def drawing(cycles=100):
    """Number of the cycle that many after the stroke has begun, in a run that nothing disturbs."""
    calm = pressing()
    assert calm.run().reason == DONE
    return next(i for i, row in enumerate(calm.rows) if row.phase == "stroke") + cycles


def test_a_coupled_run_holds_its_force_and_leaves_the_work_clear():
    bench = pressing()
    assert bench.run().reason == DONE
    rows = bench.rows
    seen = list(dict.fromkeys(row.contact for row in rows))
    assert seen == ["free", "seeking", "landing", "drawing", "retreating"]
    drawn = [row for row in rows if row.phase == "stroke" and row.contact == "drawing"]
    np.testing.assert_allclose([row.wrench[2] for row in drawn], 5.0, atol=0.25)
    assert {row.force for row in drawn} == {5.0}
    assert bench.loop.drawn == ["0"]
    assert bench.servo.position[2] > START[2] + 5.5


@pytest.mark.slow
def test_a_stroke_in_the_air_does_not_count_as_drawn():
    """The part ends: its contact is waited for, and the stroke ends in the air."""
    at = drawing()
    bench = pressing(at={at: lambda servo: setattr(bench.sensor, "plate", -1000.0)})
    policy = bench.loop.pressing.supervisor.policy
    bench.loop.pressing.supervisor.policy = dataclasses.replace(policy, on_loss="hold")
    outcome = bench.run()
    assert isinstance(outcome.failure, RefusedError)
    assert "under 95 % (--min-contact)" in outcome.reason
    assert bench.loop.drawn == []


@pytest.mark.slow
def test_where_contact_is_lost_for_good_it_comes_to_rest_and_says_so():
    at = drawing()
    bench = pressing(at={at: lambda servo: setattr(bench.sensor, "plate", -1000.0)})
    outcome = bench.run()
    assert isinstance(outcome.failure, RefusedError)
    assert "not found again within 6 mm" in outcome.reason
    assert bench.rows[-1].phase == "stop"
    assert bench.loop.stop_outcome.confirmed


def test_a_wall_is_told_by_what_is_felt_until_the_arm_stands():
    """800 N/s for 60 ms, from 5 ms before a reading on: the cycle that ends it feels a part."""
    met = []

    def feel(t):
        height = bench.servo.position[2]
        side = 800.0 * min(max(t - met[0], 0.0), 0.06) if met else 0.0
        return np.array([side, 0.0, 2.0 * max(START[2] - height, 0.0), 0.0, 0.0, 0.0])

    at = drawing()
    bench = pressing(at={at: lambda servo: met.append(bench.clock.now() + 0.005)})
    streaming = StreamingSensor(bench.clock, feel)
    streaming.start(100.0)
    bench.sensor.poll = streaming.poll
    outcome = bench.run()
    assert isinstance(outcome.failure, RefusedError)
    wall = bench.loop.pressing.facts()["contact"]["wall"]
    assert wall["largest"] == pytest.approx(48.0, abs=0.1)
    assert wall["across"] < 16.0
    # The sensor's interval, the delay and a period.
    reaction = bench.loop.pressing.supervisor.delay + PERIOD + 0.01
    assert wall["unavoidable"] == pytest.approx(800.0 * reaction, rel=0.01)
    x = bench.plan.position[:, 0]
    speed = np.abs(np.diff(x)).max() / PERIOD
    assert 0.3 * speed < wall["speed"] <= speed
    assert wall["stiffness"] == pytest.approx(800.0 / wall["speed"], rel=0.01)
    assert f"{wall['unavoidable']:.1f} N are unavoidable" in outcome.reason


@pytest.mark.parametrize("drift", [0.0, 0.03])
def test_how_far_the_zero_has_moved_is_seen_where_the_tool_is_clear_at_last(drift):
    def feel(t):
        push = 2.0 * max(START[2] - bench.servo.position[2], 0.0)
        return np.array([0.0, 0.0, push + drift * (t - 100.0), 0.0, 0.0, 0.0])

    bench = pressing()
    streaming = StreamingSensor(bench.clock, feel)
    streaming.start(100.0)
    bench.sensor.poll = streaming.poll
    assert bench.run().reason == DONE
    seeks = next(row.t for row in bench.rows if row.contact == "seeking")
    found = bench.loop.pressing.facts()["contact"]["zero_drift"]
    assert found == pytest.approx(drift * (bench.rows[-1].t - seeks), abs=0.02)


@pytest.mark.slow
def test_a_wall_stops_it_in_the_cycle_that_feels_it():
    at = drawing()
    bench = pressing()

    def wall(servo):
        bench.sensor.plate = None
        bench.sensor.wrench = np.array([9.0, 0.0, 5.0, 0.0, 0.0, 0.0])

    bench.servo.at = {at: wall}
    outcome = bench.run()
    assert "has met a wall or an edge" in outcome.reason
    assert len(bench.servo.sent) == at


@pytest.mark.slow
def test_a_signal_on_the_stroke_freezes_the_displacement():
    at = drawing()
    bench = pressing(at={at: lambda servo: bench.interruption.receive(signal.SIGINT)})
    assert bench.run().signal == signal.SIGINT
    off = np.array([row.sent[0][2] - row.planned[0][2] for row in bench.rows])
    assert bench.rows[at - 1].phase == "stroke"
    np.testing.assert_allclose(off[at:], off[at - 1], atol=1e-12)


def test_a_stale_sensor_does_not_drive_the_coupling():
    """Four cycles of silence are no contact lost: the displacement waits for the next sample."""
    at = drawing()
    bench = pressing()

    def silent(servo):
        bench.sensor.silent = True
        bench.sensor.plate -= 0.5

    bench.servo.at = {
        at: silent,
        at + 4: lambda servo: setattr(bench.sensor, "silent", False),
    }
    bench.run()
    rows = bench.rows
    felt = [row.wrench is None for row in rows[at : at + 5]]
    assert felt == [False, False, True, True, False]
    assert rows[at + 2].coupling == rows[at + 3].coupling == rows[at + 1].coupling
    assert rows[at + 6].coupling < rows[at + 3].coupling


def test_a_displacement_out_of_the_workspace_is_not_sent():
    box = (-900.0, 0.0, 0.0, 900.0, START[2] - 1.5, 100.0)
    bench = pressing(limits=dataclasses.replace(WIDE, workspace=box))
    bench.sensor.plate = None
    outcome = bench.run()
    assert isinstance(outcome.failure, RefusedError)
    assert "workspace" in outcome.reason
    assert min(p[2] for p, _ in bench.servo.sent) >= box[4]
    assert len(bench.rows) == len(bench.servo.sent) + 1


def test_a_displacement_faster_than_the_limit_is_not_sent():
    limits = dataclasses.replace(WIDE, speed=2.0)
    outcome = pressing(limits=limits).run()
    assert isinstance(outcome.failure, RefusedError)
    assert "next set-point would take" in outcome.reason


def test_an_arm_outside_the_workspace_stops():
    box = (-900.0, 0.0, 0.0, 900.0, START[2] - 1.0, START[2] + 1.0)

    def push(servo):
        servo.stuck = True
        servo.position = servo.sent[-1][0] + np.array([0.0, 0.0, 1.2])

    bench = Bench(limits=dataclasses.replace(WIDE, workspace=box), at={200: push})
    outcome = bench.run()
    assert isinstance(outcome.failure, RefusedError)
    assert "the tool at z" in outcome.reason
    assert len(bench.servo.sent) == 200


# --- what is not a number passes no guard


@pytest.mark.parametrize("attribute", ["position", "rotation"])
def test_a_pose_that_is_not_a_number_stops(attribute):
    def lost(servo):
        servo.stuck = True
        setattr(servo, attribute, np.full_like(getattr(servo, attribute), np.nan))

    bench = Bench(at={200: lost})
    outcome = bench.run()
    assert isinstance(outcome.failure, InstrumentError)
    assert "not a number" in outcome.reason
    assert len(bench.servo.sent) == 200


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_wrench_that_is_not_a_number_stops(value):
    bench = pressing()
    bench.sensor.plate = None
    wrench = np.array([0.0, 0.0, value, 0.0, 0.0, 0.0])
    bench.servo.at = {30: lambda servo: setattr(bench.sensor, "wrench", wrench)}
    outcome = bench.run()
    assert isinstance(outcome.failure, InstrumentError)
    assert len(bench.servo.sent) == 30


def test_a_set_point_that_is_not_a_number_is_never_sent():
    made = plan()
    made.position[300] = np.nan
    bench = Bench(made)
    outcome = bench.run()
    assert isinstance(outcome.failure, RefusedError)
    assert len(bench.servo.sent) == 300
    assert bench.servo.calls[-1] == "stop"


def test_the_first_failure_is_the_one_told():
    def unreachable():
        raise InstrumentError("fake: does not answer")

    bench = Bench(at={200: lambda servo: setattr(servo, "mode", "fault")})
    bench.servo.stop = unreachable
    assert "fault" in bench.run().reason


# --- limits in motion, and what hinders the run


def test_a_set_point_that_would_accelerate_too_much_is_not_sent():
    """A set-point 0.9 mm off its path is 45 mm/s of speed, and 2250 mm/s² twice over."""
    made = plan()
    made.position[300] += [0.0, 0.0, 0.99]
    bench = Bench(made)
    outcome = bench.run()
    assert isinstance(outcome.failure, RefusedError)
    assert "mm/s²" in outcome.reason
    assert len(bench.servo.sent) == 300


@pytest.mark.sweep(kept=5)
@pytest.mark.slow
@pytest.mark.parametrize("at", range(3, 78, 5))
def test_braking_never_breaks_the_limit_that_the_plan_keeps(at):
    """A stroke that takes nearly all of its acceleration, stopped anywhere on it."""
    made = plan(stroke(duration=1.6))
    most = float(made.sizes[1][:, 0].max())
    bench = Bench(made, limits=dataclasses.replace(WIDE, acceleration=1.001 * most))
    bench.servo.at[at] = lambda servo: bench.interruption.receive(signal.SIGINT)
    outcome = bench.run()
    assert (outcome.failure, outcome.signal) == (None, signal.SIGINT)


def test_a_torque_over_the_limit_stops():
    bench = pressing()
    bench.sensor.plate = None
    wrench = np.array([0.0, 0.0, 2.0, 0.0, 5.1, 0.0])
    bench.servo.at = {30: lambda servo: setattr(bench.sensor, "wrench", wrench)}
    outcome = bench.run()
    assert isinstance(outcome.failure, RefusedError)
    assert "torque 5.1 N·m on the tool is over 5 N·m" in outcome.reason
    assert len(bench.servo.sent) == 30


def test_a_hindrance_decelerates_and_is_what_the_run_ends_with():
    bench = Bench()
    full = InstrumentError("run.journal: No space left on device")
    loop = ServoLoop(
        bench.plan,
        WIDE,
        WATCH,
        ReadyArm(bench.servo, bench.servo.info, bench.clock),
        hindrance=lambda: full if len(bench.servo.sent) >= 200 else None,
    )
    outcome = loop.run(bench.interruption)
    assert outcome.failure is full
    rows = rows_of(loop.log)
    assert {row.phase for row in rows[200:]} == {"stop"}
    sent = np.array([row.sent[0] for row in rows])
    assert np.linalg.norm(np.diff(sent, 2, axis=0), axis=1).max() / PERIOD**2 <= WIDE.acceleration
    assert len(rows) < 300


def test_why_a_set_point_was_not_taken_is_asked_of_the_arm():
    """Between its look at the arm and the set-point it was stopped."""
    bench = Bench()
    send = bench.servo.send

    def refusing(position, rotation):
        if len(bench.servo.sent) < 100:
            return send(position, rotation)
        bench.servo.mode = "emergency stop"
        return False

    bench.servo.send = refusing
    outcome = bench.run()
    assert isinstance(outcome.failure, RefusedError)
    assert "emergency stop" in outcome.reason
    last = bench.rows[-1]
    assert last.state == "ready"
    np.testing.assert_array_equal(last.sent[0], bench.plan.position[100])


def test_a_row_says_what_was_planned_sent_and_felt_in_its_cycle():
    made = plan(stroke(2.0, normal=(0, 0, 1)), start=Pose(START + [0.0, 0.0, 2.0], PEN_DOWN))
    bench = Bench(made, presses=True)
    bench.servo.position = made.position[0]
    bench.sensor.plate = START[2] - 0.5
    assert bench.run().reason == DONE
    first = bench.rows[0]
    np.testing.assert_array_equal(first.actual[0], made.position[0])
    drawn = [row for row in bench.rows if row.id]
    assert {row.id for row in drawn} == {"0"}
    assert [row.id for row in bench.rows[: made.lead]] == [None] * made.lead
    for row in drawn:
        off = row.sent[0] - row.planned[0]
        np.testing.assert_allclose(off[:2], 0.0, atol=1e-12)
        assert row.force == 5.0
    # Off the stroke no coupling counts, and no force is wanted.
    for row in bench.rows[: made.lead]:
        assert (row.coupling, row.force) == (0.0, 0.0)
    assert any(row.coupling for row in drawn)
    # It waits at the stroke's start, in the approach, until it presses.
    states = list(dict.fromkeys(row.contact for row in bench.rows))
    assert states == ["free", "seeking", "landing", "drawing", "retreating"]
    waiting = [row for row in drawn if row.phase == "approach"]
    assert {row.t_plan for row in waiting} == {0.0}
    settled = next(i for i, row in enumerate(bench.rows) if row.contact == "drawing")
    pressed = [row.wrench[2] for row in bench.rows[settled:] if row.phase == "stroke"]
    assert min(pressed) > 4.0


def test_a_stroke_counts_as_drawn_by_its_share_in_contact():
    for least, counts in ((0.6, True), (0.9, False)):
        bench = Bench(plan(stroke(4.0, normal=(0, 0, 1))), presses=True)
        supervisor = bench.loop.pressing.supervisor
        supervisor.policy = dataclasses.replace(
            supervisor.policy, on_loss="hold", least_share=least
        )

        def lifted(_, bench=bench):
            bench.sensor.plate = START[2] - 60.0

        def back(servo, bench=bench):
            bench.sensor.plate = servo.position[2] + 2.5

        begun = _landed(bench)
        bench.servo.at = {begun + 60: lifted, begun + 110: back}
        outcome = bench.run()
        share = bench.loop.pressing.tally.share("0")
        assert 0.6 < share < 0.9
        assert (bench.loop.drawn == ["0"]) is counts
        assert (outcome.failure is None) is counts
        if not counts:
            assert f"{100.0 * share:.1f} % of it, under 90 % (--min-contact)" in outcome.reason


def _landed(bench):
    """After how many cycles a run of the same plan draws."""
    trial = Bench(bench.plan, presses=True)
    trial.run()
    return next(i for i, row in enumerate(trial.rows) if row.contact == "drawing")


def test_strokes_that_were_hardly_touched_are_told_with_how_many_there_are():
    bench = Bench(plan(stroke(1.0, normal=(0, 0, 1))), presses=True)
    loop = bench.loop
    loop._short = {"a": 0.5}
    assert "stroke a was in contact on 50.0 % of it, under 95 % (--min-contact): it" in str(
        loop._untouched()
    )
    loop._short = {"a": 0.5, "b": 0.4, "c": 0.3}
    assert "(--min-contact), and 2 more: it does not count" in str(loop._untouched())
    loop._interruption.receive(2)
    assert loop._untouched() is None


def test_how_long_all_plans_take_is_told_before_and_with_a_goal_that_moves():
    first, second = plan(stroke(1.0)), plan(stroke(2.0))
    clock = FakeClock()
    servo = FakeServo(clock)
    arm = ReadyArm(servo, servo.info, clock, 6)
    loop = ServoLoop(first, WIDE, WATCH, arm, then=[second])
    assert (loop.period, loop.duration) == (0.02, pytest.approx(0.02 * (51 + 101)))
    assert "joints" in loop.log.rows.groups
    assert loop.pressing is None
    assert not loop.virtual
    loop._follow(second)
    assert loop.duration == pytest.approx(0.02 * (101 + 101))


def test_what_feels_belongs_to_a_virtual_lab_or_not():
    bench = Bench(plan(stroke(normal=(0, 0, 1))), presses=True)
    assert not bench.loop.virtual
    info = dataclasses.replace(bench.loop._touch.sensing.info, serial="virtual")
    bench.loop._touch.sensing.info = info
    assert bench.loop.virtual


def test_an_arm_that_plays_by_itself_is_neither_coupled_nor_led_to_another_goal():
    bench = Bench(plan(stroke(1.0, normal=(0, 0, 1))), presses=True)
    arm = ReadyArm(bench.servo, bench.servo.info, bench.clock)
    with pytest.raises(InputError, match="--coupling force: corrects each set-point"):
        Playback(bench.plan, WIDE, WATCH, arm, bench.loop._touch)
    with pytest.raises(InputError, match="--goal-from: moves each set-point"):
        Playback(bench.plan, WIDE, WATCH, arm, goals=object())


def test_an_arm_says_how_many_joints_it_tells():
    clock = FakeClock()
    servo = FakeServo(clock)
    arm = ReadyArm(servo, servo.info, clock)
    assert arm.as_told().joints == 0
    state = servo.state
    servo.state = lambda: dataclasses.replace(state(), joints=np.zeros(6))
    assert arm.as_told() == ReadyArm(servo, servo.info, clock, 6)


def test_the_first_failure_counts_and_an_arm_that_may_move_comes_last():
    first, second = RefusedError("first"), InstrumentError("second")
    plain = LoopOutcome("done", signal=2)
    assert plain.unless(None) is plain
    failed = plain.unless(first)
    assert (failed.reason, failed.failure, failed.signal) == ("first", first, None)
    assert failed.unless(second) is failed
    assert plain.error() is None
    told = failed.error("before ", " after")
    assert (type(told), str(told)) == (RefusedError, "before first after")
    left = StopOutcome("not told", "no answer")
    both = LoopOutcome("first", first, stop=left)
    assert str(both.error("", "; 1 of 2")) == f"first; 1 of 2\n{left}"
    alone = LoopOutcome(str(left), left.error(), stop=left)
    assert str(alone.error("", "; 1 of 2")) == f"1 of 2\n{left}"


def test_a_coupled_stroke_is_counted_once_its_end_has_passed_the_look_ahead():
    """0.2 s of it; from 0.1 s later on the arm must have come."""
    loop = Bench(plan(stroke(2.0, normal=(0, 0, 1))), presses=True).loop
    asked = []
    loop._count = lambda over: asked.append(over)
    for gone, wanted in ((0.16, []), (0.18, [False]), (0.26, [False]), (0.32, [True])):
        asked.clear()
        loop._over = gone
        assert not loop._clear()
        assert asked == wanted
    # Led off by its plan, or brought to rest, it is clear.
    loop.plan = dataclasses.replace(loop.plan, last=loop.plan.last - 1)
    assert loop._clear()
    assert asked == [True]
