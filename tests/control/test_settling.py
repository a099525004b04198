"""Arms that come to rest, creep, or never rest: when it is said that they stand still."""

import math

import numpy as np
import pytest

from dmpcli.control import settling
from dmpcli.control.settling import RestWindow, SettlingDetector
from dmpcli.errors import InstrumentError
from dmpcli.instruments.protocols import RobotState, ServoInfo
from dmpcli.spatial.rotations import exp
from tests.control.streaming_fakes import PEN_DOWN, START

PERIOD = 0.01


def at(t, off=0.0, turned=0.0):
    turn = exp(np.array([0.0, turned, 0.0]))
    return RobotState(7.0 + t, START + [0.0, off, 0.0], turn @ PEN_DOWN, "ready")


def first_rest(moves, window=0.1, turns=None):
    """Seconds after which an arm that moves so, each period, is first said to rest."""
    rest = RestWindow(window)
    for i, off in enumerate(moves):
        if rest.rests(at(i * PERIOD, off, 0.0 if turns is None else turns[i])):
            return i * PERIOD
    return None


def test_it_rests_once_it_stood_still_for_the_whole_window():
    assert first_rest(np.zeros(50)) == pytest.approx(0.1)
    # The last step that counts is the one at 0.2 s.
    moves = np.concatenate([np.linspace(0.0, 1.0, 21), np.ones(40)])
    assert first_rest(moves) == pytest.approx(0.3)
    assert first_rest(np.zeros(50), 0.25) == pytest.approx(0.25)


@pytest.mark.parametrize("size", [0.019, 0.021])
def test_less_than_two_hundredths_of_a_millimetre_is_no_motion(size):
    shaking = size * (np.arange(100) % 2)
    assert (first_rest(shaking) is not None) == (size < 0.02)
    # A creep is motion where the window's two ends are further apart, not one step.
    creeping = size * np.arange(100) * PERIOD / 0.1
    assert (first_rest(creeping) is not None) == (size < 0.02)


@pytest.mark.parametrize("angle", [0.95e-3, 1.05e-3])
def test_less_than_a_milliradian_is_no_turn(angle):
    turns = angle * (np.arange(100) % 2)
    assert (first_rest(np.zeros(100), turns=turns) is not None) == (angle < 1e-3)


def test_how_far_it_moved_is_said_over_the_window():
    rest = RestWindow(0.1)
    for i in range(40):
        rest.rests(at(i * PERIOD, 0.5 * i, 0.002 * i))
    assert rest.moved == "moved 5 mm, 0.02 rad in 0.1 s"


def settled(lookahead, moving):
    """Seconds until an arm settles that moves for so long after its last set-point."""
    settling = SettlingDetector(ServoInfo("fake", (0.002, 0.1), lookahead, False), PERIOD)
    for i in range(600):
        t = i * PERIOD
        if settling.reached(at(t, 10.0 * min(t, moving))):
            return t
    raise AssertionError


@pytest.mark.parametrize("lookahead", [0.0, 0.1, 0.3])
def test_what_a_look_ahead_holds_back_is_waited_for(lookahead):
    assert settled(lookahead, 0.0) == pytest.approx(lookahead + 0.05)
    # It then has stood still for 0.05 s, but for the 0.02 mm of its last two steps.
    late = settled(lookahead, lookahead + 0.5)
    assert late == pytest.approx(lookahead + 0.55, abs=0.021)


@pytest.mark.parametrize("lookahead", [0.0, 0.3])
def test_an_arm_that_moves_for_more_than_two_seconds_has_failed(lookahead):
    assert settled(lookahead, lookahead + 1.9) < lookahead + 2.0
    with pytest.raises(InstrumentError, match="does not come to rest"):
        settled(lookahead, 9.0)


@pytest.mark.parametrize(
    ("apart", "still"),
    [
        ((0.02, 0.001), True),
        ((math.nextafter(0.02, 1.0), 0.001), False),
        ((0.02, math.nextafter(0.001, 1.0)), False),
    ],
)
def test_two_hundredths_of_a_millimetre_and_a_milliradian_themselves_are_no_motion(
    monkeypatch, apart, still
):
    monkeypatch.setattr(settling, "_apart", lambda *_: apart)
    assert settling._near(at(0.0), at(0.0)) is still
