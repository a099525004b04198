"""What a robot program says, move by move, and the strokes that come of it.

Our programs mark where a stroke begins and ends in a comment; the moves between are the stroke, and
it begins where the move before the mark has led. A program without marks is one stroke.
"""

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import InputError
from dmpcli.formats.motion import MotionStroke
from dmpcli.messages import warn
from dmpcli.records.columns import LARGEST
from dmpcli.records.file_io import Source
from dmpcli.spatial.output_events import OutputEvent
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.rotations import log

Poses = Callable[[Floats], Pose]
"""From the numbers of a program's targets, shape (n, k), to positions, mm, and rotations."""

BEGIN, END = "stroke", "end of stroke"

NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
"""A number as these languages write it, as a pattern."""

MOST_MOVES = 5_000_000


@dataclass
class ProgramMoves:
    """Targets in order, and how each is reached: by speed, turning speed or in a time.

    Attributes
    ----------
    name : str
        Of the file.
    targets : list of tuple of float
        As they stand in the program.
    lines : list of int
    speed, turn, seconds : list of float
        mm/s, rad/s and s; NaN where it is not said.
    marks : list of (int, str or None)
        Before which move a stroke begins, or None: ends.
    switches : list of (int, str, bool)
        After which move an output is switched, which, and whether on.
    frame : (int, str) or None
        The first line that names another frame than the robot's base, and the frame.
    """

    name: str
    targets: list[tuple[float, ...]] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    speed: list[float] = field(default_factory=list)
    turn: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    marks: list[tuple[int, str | None]] = field(default_factory=list)
    switches: list[tuple[int, str, bool]] = field(default_factory=list)
    frame: tuple[int, str] | None = None

    def statements(self, source: Source, comment: str) -> Iterator[tuple[int, str]]:
        """Yield line number and code of each line that holds any; comments are taken as marks.

        Parameters
        ----------
        source : Source
        comment : str
            What a comment begins with.

        Raises
        ------
        InputError
            It is not text.
        """
        for line, text in enumerate(lines_of(source), 1):
            code, _, said = text.partition(comment)
            if said:
                self.mark(said)
            if code := code.strip():
                yield line, code

    def in_frame(self, line: int, frame: str) -> None:
        """Remember that positions are in a frame that is not the robot's base."""
        self.frame = self.frame or (line, frame)

    def move(
        self,
        line: int,
        target: tuple[float, ...],
        speed: float = math.nan,
        turn: float = math.nan,
        seconds: float = math.nan,
    ) -> None:
        """Take one move.

        Parameters
        ----------
        line : int
            Of the program, from 1; messages name it.
        target : tuple of float
            As it stands in the program; `strokes` makes poses of all targets together.
        speed, turn : float
            mm/s and rad/s; NaN where the move does not say it.
        seconds : float
            How long the move takes; NaN where it does not say it.

        Raises
        ------
        InputError
            A number is beyond what any quantity is, a speed not above 0, or a time below 0.
        """
        if not all(abs(value) <= LARGEST for value in target):
            raise self.wrong(line, f"a coordinate is not a number, or beyond {LARGEST:g}")
        if speed <= 0.0 or turn <= 0.0 or seconds < 0.0:
            raise self.wrong(line, "a speed must be above 0, a time at least 0")
        if not _reasonable(speed) or not _reasonable(turn) or seconds > LARGEST:
            raise self.wrong(line, f"a speed or time is beyond {LARGEST:g}, or as small")
        self.targets.append(target)
        self.lines.append(line)
        self.speed.append(speed)
        self.turn.append(turn)
        self.seconds.append(seconds)

    def wait(self, line: int, seconds: float) -> None:
        """Take a pause; before the first move it is none of a stroke."""
        if self.targets:
            self.move(line, self.targets[-1], seconds=seconds)

    def switch(self, output: str, on: bool, ahead: int = 0) -> None:
        """Take an output that is switched where the last move has led, or one that is to come.

        Parameters
        ----------
        output : str
        on : bool
        ahead : int
            How many moves on: 1 where a trigger stands before the move at whose end it acts.
        """
        self.switches.append((len(self.targets) - 1 + ahead, output, on))

    def mark(self, comment: str) -> None:
        """Take what a comment says, if it is one of ours."""
        found = _MARK.fullmatch(comment.strip())
        if found:
            self.marks.append((len(self.targets), None if found[1] == END else found[2].strip()))

    def wrong(self, line: int, what: str) -> InputError:
        """Return the error that says what is wrong with a line."""
        return InputError(f"{self.name}: line {line}: {what}")

    def strokes(self, poses: Poses | None = None) -> list[MotionStroke]:
        """Return the strokes, each with time from 0; without `poses` targets are positions.

        Raises
        ------
        InputError
            There is no move, or one whose speed nothing says.
        """
        if len(self.targets) < 2:
            raise InputError(f"{self.name}: holds no moves that could be a stroke")
        if self.frame is not None:
            line, frame = self.frame
            warn(
                f"{self.name}: line {line}: positions are in {frame}, and are taken as they stand; "
                "in the robot's base they lie elsewhere"
            )
        position, rotation = np.array(self.targets, dtype=float), None
        if poses is not None:
            made = poses(position)
            position, rotation = made.position, made.rotation
        seconds = self._seconds(position, rotation)
        found = []
        for number, (first, last, name) in enumerate(self._spans()):
            if last - first < 1:
                continue
            t = np.concatenate([[0.0], np.cumsum(seconds[first:last])])
            kept = np.concatenate([[True], np.diff(t) > 0.0])
            if kept.sum() < 2:
                continue
            rows = np.arange(first, last + 1)[kept]
            R = None if rotation is None else rotation[rows]
            events = tuple(
                OutputEvent(float(t[at - first]), output, on)
                for at, output, on in self.switches
                if first <= at <= last
            )
            name = name or str(number + 1)
            stroke = MotionStroke(t[kept], position[rows], R, id=name, events=events)
            found.append(stroke)
        if not found:
            raise InputError(f"{self.name}: holds no moves that could be a stroke")
        return found

    def _seconds(self, position: Floats, rotation: Floats | None) -> Floats:
        """Duration of the leg that leads to each move from the second on, shape (n - 1,), s."""
        length = np.linalg.norm(np.diff(position, axis=0), axis=1)
        turned = np.zeros(len(length))
        if rotation is not None:
            step = np.swapaxes(rotation[:-1], 1, 2) @ rotation[1:]
            turned = np.linalg.norm(log(step), axis=1)
        said, speed, turn = (np.array(v)[1:] for v in (self.seconds, self.speed, self.turn))
        by_turn = np.where(turned > 0.0, turned / turn, 0.0)
        # A leg that does not lead anywhere takes as long as it turns.
        moved = np.where(length > 0.0, length / speed, by_turn)
        seconds = np.where(np.isnan(said), moved, said)
        for first, last, _ in self._spans():
            bad = np.flatnonzero(~np.isfinite(seconds[first:last]))
            if len(bad):
                raise self.wrong(
                    self.lines[first + int(bad[0]) + 1], "nothing says how fast this move is"
                )
        return seconds

    def _spans(self) -> list[tuple[int, int, str]]:
        """First and last move of each stroke, and its name."""
        last = len(self.targets) - 1
        if not any(name is not None for _, name in self.marks):
            return [(0, last, "")]
        spans: list[tuple[int, int, str]] = []
        begun: tuple[int, str] | None = None
        for at, name in [*self.marks, (len(self.targets), None)]:
            if begun is not None:
                spans.append((begun[0], at - 1, begun[1]))
            begun = None if name is None else (max(at - 1, 0), name)
        return spans


def _reasonable(rate: float) -> bool:
    """Tell a rate that can be divided by, or one that is not said: NaN."""
    return not abs(math.log10(rate)) > math.log10(LARGEST)


_MARK = re.compile(r"(stroke|end of stroke) (.{0,200})")


def lines_of(source: Source) -> list[str]:
    """Return the lines of a program's text.

    Raises
    ------
    InputError
        It is not text.
    """
    try:
        text = source.content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = source.content.decode("latin-1")
    if "\x00" in text:
        raise InputError(f"{source.name}: is not a program in text")
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def spelled(name: str) -> str:
    """Return a stroke's name as a comment may hold it."""
    return re.sub(r"[^\w.+\-]+", "_", name) or "_"


def output_number(name: str, letters: str, form: str) -> int:
    """Return the number of an output that a language names by number.

    Parameters
    ----------
    name : str
        As the stroke's events have it, such as ``DO3``.
    letters : str
        What the name must begin with.
    form : str
        What messages call the language.

    Raises
    ------
    InputError
        Its name is not those letters and a number of at most four digits.
    """
    found = re.fullmatch(rf"{letters}(\d{{1,4}})", name, re.ASCII)
    if found is None:
        raise InputError(f"output {name}: {form} numbers its outputs; call it {letters}1 or so")
    return int(found[1])


def identifier(name: str, most: int) -> str:
    """Return a name as a program's routine may have it."""
    clean = re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_") or "stroke"
    return (clean if clean[0].isalpha() else f"s_{clean}")[:most]
