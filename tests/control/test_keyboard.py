import contextlib
import os
import sys

import pytest

from dmpcli.calibration.by_hand import Keyboard
from dmpcli.control import keyboard

END = b"\x04"  # Ctrl-D


@pytest.fixture
def keys(monkeypatch):
    """A terminal as standard input; returns what types on it."""
    ours, theirs = os.openpty()
    with open(theirs) as terminal:
        monkeypatch.setattr(sys, "stdin", terminal)
        yield lambda typed: os.write(ours, typed)
    with contextlib.suppress(OSError):
        os.close(ours)


def test_only_enter_is_enter(keys):
    assert not keyboard.pressed()
    keys(b"abc" + END)  # handed over without its end
    assert not keyboard.pressed()
    keys(b"\n")
    assert keyboard.pressed()
    assert not keyboard.pressed()
    keys(END)
    assert not keyboard.pressed()


def test_a_keyboard_hands_out_whole_lines_and_q_at_the_end(keys):
    keyboard = Keyboard("--by-hand")
    assert keyboard.line() is None
    keys(b"ab" + END)
    assert keyboard.line() is None
    keys(b"c\n\n")
    assert [keyboard.line() for _ in range(3)] == ["abc", "", None]
    keys(END)
    assert keyboard.line() == "q"
