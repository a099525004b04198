"""A person at the terminal who leads the arm: Enter takes a pose, q and Enter ends."""

import signal
import sys
from collections.abc import Callable, Iterator

import numpy as np

from dmpcli.admittance.payload_identification import FEWEST, condition
from dmpcli.calibration.resting import Watcher, at_rest
from dmpcli.calibration.tour import Interrupted
from dmpcli.control import keyboard
from dmpcli.control.signals import Interruption
from dmpcli.errors import InputError, counted
from dmpcli.records.static_poses import StaticPose
from dmpcli.settings.calibrate import CalibrateSettings

MOVES = "not taken: the arm moves; wait until it rests, then press Enter again"


class Keyboard:
    """Lines of a terminal, read without waiting.

    Parameters
    ----------
    option : str
        What needs a person, for the message.

    Raises
    ------
    InputError
        Standard input is no terminal: nobody sits there.
    """

    def __init__(self, option: str) -> None:
        if not sys.stdin or not sys.stdin.isatty():
            raise InputError(f"{option} waits for Enter, and standard input is no terminal")
        self._typed = b""

    def line(self) -> str | None:
        """Return a line that was typed, ``q`` at the terminal's end, or None for nothing yet."""
        if b"\n" not in self._typed:
            more = keyboard.typed()
            if more == b"":
                return "q"
            self._typed += more or b""
        line, end, rest = self._typed.partition(b"\n")
        if not end:
            return None
        self._typed = rest
        return line.decode(errors="replace").strip()


def enters(
    keyboard: Keyboard, look: Callable[[], object], asked_to_end: Callable[[], bool]
) -> Iterator[None]:
    """Yield once for each Enter, until q and Enter, or until asked to end.

    Parameters
    ----------
    keyboard : Keyboard
    look : callable
        Called between two looks at the keyboard; takes a little time, and may raise.
    asked_to_end : callable
    """
    while not asked_to_end():
        line = keyboard.line()
        if line is not None and line.lower().startswith("q"):
            return
        if line is not None:
            yield
        look()


def lead(
    watcher: Watcher,
    keyboard: Keyboard,
    settings: CalibrateSettings,
    interruption: Interruption,
    taken: list[StaticPose],
    say: Callable[[str], None],
) -> None:
    """Take the poses to which a person leads the arm.

    Parameters
    ----------
    watcher : Watcher
    keyboard : Keyboard
    settings : CalibrateSettings
    interruption : Interruption
    taken : list of StaticPose
        Filled.
    say : callable
        Tells the person how it stands.

    Raises
    ------
    Interrupted
        A signal came.
    InstrumentError
        An instrument fails.
    """
    say("lead the tool to a pose and let go of it; Enter takes the pose, q and Enter ends")

    def asked() -> bool:
        return interruption.count > 0

    for _ in enters(keyboard, watcher.look, asked):
        if not watcher.rests(settings.settle, 2.0 * settings.settle, asked):
            say(MOVES)
            continue
        pose = watcher.dwell(settings.dwell)
        if not at_rest(pose.moved, pose.turned):
            say(MOVES)
            continue
        taken.append(pose)
        say(f"pose {len(taken)} taken{_so_far(taken)}")
    if interruption.number is not None:
        name = signal.Signals(interruption.number).name
        raise Interrupted(interruption.number, f"{name}: ended after {counted(len(taken), 'pose')}")


def _so_far(taken: list[StaticPose]) -> str:
    if len(taken) < FEWEST:
        return ""
    return f"; condition number {condition(np.array([pose.rotation for pose in taken])):.3g}"
