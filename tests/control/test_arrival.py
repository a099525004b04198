"""An arm that acknowledges everything has drawn nothing until it is seen to have done so."""

import numpy as np
import pytest

from dmpcli.control.arrival import ArrivalMonitor
from dmpcli.control.cycle import ReadyArm, StopLimits
from dmpcli.control.playback import Playback
from dmpcli.control.servo_loop import DONE, ServoLoop
from dmpcli.control.signals import Interruption
from dmpcli.errors import InstrumentError
from dmpcli.instruments.protocols import RobotState
from dmpcli.planning import transfers
from dmpcli.planning.transfers import TransferOptions
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.rotations import exp_one
from dmpcli.spatial.trajectory import StrokeTrajectory
from tests.control.streaming_fakes import PEN_DOWN, START, WIDE, FakeClock, FakeServo, plan

WATCH = StopLimits(5.0, 0.1, 50.0, 5.0)
T = np.linspace(0.0, 2.0, 101)
U = (T / 2.0) ** 3 * (10.0 - 15.0 * T / 2.0 + 6.0 * (T / 2.0) ** 2)


def made(way, turn=None, name="0"):
    rotation = np.broadcast_to(PEN_DOWN, (101, 3, 3))
    if turn is not None:
        rotation = np.array([exp_one(np.array([0.0, 0.0, a])) @ PEN_DOWN for a in turn])
    return StrokeTrajectory(T, START + way, rotation, np.tile([0.0, 0.0, 1.0], (101, 1)), id=name)


def line(length):
    return U[:, None] * [length, 0.0, 0.0]


def circle(diameter):
    turn = 2.0 * np.pi * U
    return diameter / 2.0 * np.stack([np.cos(turn) - 1.0, np.sin(turn), 0.0 * U], axis=1)


class Player(FakeServo):
    """Is asked nothing and stands wherever its plan is by now, or where `at` leads it."""

    def upload(self, position, rotation, period, meanwhile):
        self.way, self.turns, self.period = position, rotation, period

    def play(self):
        self.begun = self.clock.now()

    def state(self):
        if hasattr(self, "begun") and not self.stuck:
            k = min(round((self.clock.now() - self.begun) / self.period), len(self.way) - 1)
            self.sent = [(self.way[k], self.turns[k])]
        return super().state()


def run(first, *then, kind=ServoLoop, at=None, arm=None, watch=WATCH):
    clock = FakeClock()
    servo = (arm or (Player if kind is Playback else FakeServo))(clock, at=at)
    loop = kind(first, WIDE, watch, ReadyArm(servo, servo.info, clock), then=list(then))
    return loop, loop.run(Interruption()), servo


def stuck(servo):
    servo.stuck = True


@pytest.mark.parametrize("kind", [ServoLoop, Playback])
@pytest.mark.parametrize(
    "stroke",
    [made(line(4.0)), made(circle(4.0)), made(line(1.5)), made(line(0.0), 0.09 * U)],
    ids=["line", "closed", "short", "turn"],
)
def test_an_arm_that_only_acknowledges_has_drawn_nothing(kind, stroke):
    loop, outcome, _ = run(plan(stroke), kind=kind, at={0: stuck})
    assert isinstance(outcome.failure, InstrumentError)
    assert "took every set-point of stroke 0 and has not moved" in outcome.reason
    assert loop.drawn == []


@pytest.mark.parametrize("kind", [ServoLoop, Playback])
@pytest.mark.parametrize(
    "stroke", [made(line(4.0)), made(circle(4.0)), made(line(0.0), 0.09 * U), made(line(0.05))]
)
def test_an_arm_that_draws_is_believed(kind, stroke):
    loop, outcome, _ = run(plan(stroke), kind=kind)
    assert outcome.reason == DONE
    assert loop.drawn == ["0"]


class Short(FakeServo):
    """Stays behind a line of 4 mm by `off` mm in the end, and is turned by `turn` rad."""

    off, turn = 0.0, 0.0

    def state(self):
        told = super().state()
        share = (told.position[0] - START[0]) / 4.0
        position = told.position - share * np.array([self.off, 0.0, 0.0])
        turned = exp_one(np.array([0.0, 0.0, share * self.turn])) @ told.rotation
        return RobotState(told.t, position, turned, told.mode)


@pytest.mark.parametrize(("off", "turn", "words"), [(1.2, 0.0, "1.2"), (0.0, 0.03, "0.03")])
def test_an_arm_that_rests_beside_its_end_has_not_arrived(off, turn, words):
    kind = type("Off", (Short,), {"off": off, "turn": turn})
    loop, outcome, _ = run(plan(made(line(4.0))), arm=kind)
    assert isinstance(outcome.failure, InstrumentError)
    assert "did not come to the end of stroke 0" in outcome.reason
    assert words in outcome.reason
    assert "--arrival-tolerance" in outcome.reason
    assert loop.drawn == []
    wide = StopLimits(5.0, 0.1, 50.0, 5.0, arrival=1.3, arrival_angle=0.04)
    assert run(plan(made(line(4.0))), arm=kind, watch=wide)[1].reason == DONE


def tour(*strokes):
    ways = TransferOptions(3.0, 100.0, 50.0, 20.0, settling=10)
    start = Pose(START, PEN_DOWN)
    return list(transfers.plans(strokes, 0.02, 1.0, WIDE, start, True, ways))


@pytest.mark.parametrize("kind", [ServoLoop, Playback])
def test_of_several_strokes_only_those_that_were_drawn_count(kind):
    plans = tour(made(line(2.0), name="a"), made(line(4.0), name="b"))
    loop, outcome, _ = run(*plans, kind=kind)
    assert (outcome.reason, loop.drawn) == (DONE, ["a", "b"])
    begins = len(plans[0]) + plans[1].lead
    loop, outcome, _ = run(*plans, kind=kind, at={begins + 5: stuck})
    assert outcome.error().exit_code == 4
    assert "stroke b" in outcome.reason or "following error" in outcome.reason
    assert loop.drawn == ["a"]


def test_under_a_force_coupling_only_what_lies_across_the_normal_counts():
    drawn = plan(made(line(4.0)))
    pressed = ArrivalMonitor(drawn, 1.0, 0.0175, coupled=True)
    free = ArrivalMonitor(drawn, 1.0, 0.0175)
    for index in (0, 50, drawn.last):
        at = RobotState(0.02 * index, drawn.position[index] - [0, 0, 3.0], PEN_DOWN, "ready")
        pressed.see(at, index)
        free.see(at, index)
    assert pressed.arrived
    assert not free.arrived
    pressed.check_rest(at, drawn.at(drawn.last))
    with pytest.raises(InstrumentError, match=r"3\.00 mm"):
        free.check_rest(at, drawn.at(drawn.last))


def at(position, turn=0.0, t=0.0):
    return RobotState(t, position, exp_one(np.array([0.0, 0.0, turn])) @ PEN_DOWN, "ready")


def test_an_arm_at_the_end_of_a_stroke_has_not_arrived_before_that_was_sent():
    """A closed stroke ends where it begins."""
    drawn = plan(made(circle(4.0)))
    monitor = ArrivalMonitor(drawn, 1.0, 0.0175)
    for index in range(drawn.last):
        monitor.see(at(drawn.position[index]), index)
        assert (monitor.near, monitor.looked, monitor.arrived) == (False, False, False)
    monitor.see(at(drawn.position[-1]), drawn.last)
    assert (monitor.near, monitor.looked, monitor.arrived) == (True, True, True)
    # Once it was seen there, that counts.
    monitor.see(at(drawn.position[-1] + 3.0), drawn.last + 1)
    assert monitor.arrived


@pytest.mark.parametrize(("moved", "started"), [(1.99, False), (2.0, True)])
def test_half_as_far_as_the_stroke_leads_is_a_beginning(moved, started):
    drawn = plan(made(line(4.0)))
    drawn.position[drawn.last] = START + [4.0, 0.0, 0.0]
    monitor = ArrivalMonitor(drawn, 1.0, 0.0175)
    monitor.see(at(START), 0)
    monitor.see(at(START + [0.0, moved, 0.0]), 50)
    assert monitor.started is started


@pytest.mark.parametrize(("turn", "started"), [(0.0449, False), (0.0451, True)])
def test_half_as_far_as_it_turns_is_a_beginning_too(turn, started):
    monitor = ArrivalMonitor(plan(made(line(0.0), 0.09 * U)), 1.0, 0.0175)
    monitor.see(at(START), 0)
    monitor.see(at(START, turn), 50)
    assert monitor.started is started


def test_a_stroke_that_hardly_leads_anywhere_needs_no_beginning():
    for way, turn, needs in (
        (line(0.099), None, False),
        (line(0.101), None, True),
        (line(0.0), 0.0099 * U, False),
        (line(0.0), 0.0101 * U, True),
    ):
        assert ArrivalMonitor(plan(made(way, turn)), 1.0, 0.0175).started is not needs


def test_what_lies_before_the_stroke_is_no_beginning_of_it():
    drawn = plan(made(line(4.0)), start=Pose(START - [9.0, 0.0, 0.0], PEN_DOWN))
    monitor = ArrivalMonitor(drawn, 1.0, 0.0175)
    monitor.see(at(drawn.position[0]), 0)
    monitor.see(at(START), drawn.lead)
    monitor.see(at(START + [1.9, 0.0, 0.0]), drawn.lead + 1)
    assert not monitor.started


@pytest.mark.parametrize(
    ("off", "turn", "near"),
    [(1.0, 0.0, True), (1.0001, 0.0, False), (0.0, 0.0174, True), (0.0, 0.0176, False)],
)
def test_it_has_arrived_within_its_tolerances_and_rests_there(off, turn, near):
    drawn = plan(made(line(4.0)))
    monitor = ArrivalMonitor(drawn, 1.0, 0.0175)
    end = drawn.at(drawn.last)
    state = at(end.position + [0.0, off, 0.0], turn)
    monitor.see(state, drawn.last)
    assert monitor.near is near
    if near:
        monitor.check_rest(state, end)
        return
    with pytest.raises(InstrumentError, match="rests elsewhere than at its last set-point"):
        monitor.check_rest(state, end)


def test_a_goal_that_comes_nearer_asks_half_of_what_is_left():
    monitor = ArrivalMonitor(plan(made(line(8.0))), 1.0, 0.0175)
    monitor.see(at(START), 0)
    monitor.follow(plan(made(line(2.0))))
    monitor.see(at(START + [1.01, 0.0, 0.0]), 40)
    assert monitor.started
    fresh = ArrivalMonitor(plan(made(line(8.0))), 1.0, 0.0175)
    fresh.follow(plan(made(line(0.05))))
    assert fresh.started


def test_who_has_seen_nothing_says_that_it_has_not_moved():
    monitor = ArrivalMonitor(plan(made(line(0.0))), 1.0, 0.0175)
    assert monitor.started
    with pytest.raises(InstrumentError, match="has not moved as they ask"):
        monitor.refuse()
    monitor.see(at(START + [0.0, 0.0, 2.5]), 100)
    with pytest.raises(
        InstrumentError, match=r"did not come to the end of stroke 0: it is 2\.50 mm"
    ):
        monitor.refuse()


def test_under_a_force_coupling_a_way_along_the_normal_asks_for_no_motion():
    """A stroke that only lifts and sets down by 3 mm, and one that goes aside too."""
    bob = np.outer(np.sin(np.pi * U), [0.0, 0.0, 3.0])
    for aside, coupled, asks in ((0.0, True, False), (0.0, False, True), (4.0, True, True)):
        monitor = ArrivalMonitor(plan(made(bob + line(aside))), 1.0, 0.0175, coupled)
        assert monitor.started is not asks
    # Half of the way aside is a beginning.
    monitor = ArrivalMonitor(plan(made(bob + line(4.0))), 1.0, 0.0175, coupled=True)
    monitor.see(at(START), 0)
    monitor.see(at(START + [2.01, 0.0, 0.0]), 50)
    assert monitor.started


def test_how_far_a_stroke_turns_counts_from_its_very_first_set_point():
    drawn = plan(made(line(0.0), 0.0099 * U))
    assert ArrivalMonitor(drawn, 1.0, 0.0175).started
    drawn.rotation[drawn.lead :] = at(START, 0.006).rotation
    drawn.rotation[drawn.lead], drawn.rotation[drawn.last] = PEN_DOWN, at(START, 0.012).rotation
    assert not ArrivalMonitor(drawn, 1.0, 0.0175).started
