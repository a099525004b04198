"""G-code: written for machines that move XYZ alone, and read as the path of a pen.

RS274/NGC as LinuxCNC documents it: G0, G1, G2 and G3 (in the plane of G17), G20 and G21, G90 and
G91, F per minute. Read, straight rapid moves (G0) before, after and between the cuts are travel:
the first and last are no part of the stroke.
"""

import math
import re
from dataclasses import dataclass, field

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import InputError
from dmpcli.formats import program_moves
from dmpcli.formats.motion import Motion, MotionStroke
from dmpcli.formats.program_moves import BEGIN, END, ProgramMoves, spelled
from dmpcli.formats.text import number, significant
from dmpcli.formats.toolpath import ProgramOptions, legs, toolpaths
from dmpcli.records.file_io import Source
from dmpcli.records.untrusted import decoder

INCH = 25.4
LONGEST_ARC = 100_000
"""Points of one arc: more is no arc that a machine draws."""


def encode(motion: Motion, options: ProgramOptions) -> bytes:
    """Return a program of G1 moves, each with its feed; the tool's orientation is not in it.

    Raises
    ------
    InputError
        A tool leans further from straight down than the options allow.
    """
    _upright(motion, options)
    lines = ["(unit mm, base axes, Z up; no machine has run this program)"]
    lines.append("G17 G21 G90 G94")
    if options.tolerance:
        lines.append(f"G64 P{number(options.tolerance, 4)}")
    paths = toolpaths(motion, options, 4)
    high = max(float(path.position[:, 2].max()) for path in paths) + options.lift
    for path in paths:
        first = path.position[0]
        lines.append(f"G0 Z{number(high, 4)}")
        lines.append(f"G0 X{number(float(first[0]), 4)} Y{number(float(first[1]), 4)}")
        feed = significant(60.0 * options.travel)
        lines += [f"G1 {_point(first)} F{feed}", f"({BEGIN} {spelled(path.id)})"]
        for leg in legs(path, options.blend):
            if leg.pause:
                lines.append(f"G4 P{significant(leg.seconds)}")
                continue
            length = float(path.length[leg.index - 1])
            if length > 0.0:
                feed = significant(60.0 * length / leg.seconds)
                lines.append(f"G1 {_point(path.position[leg.index])} F{feed}")
            else:  # it only turns, which XYZ does not show
                lines.append(f"G4 P{significant(leg.seconds)}")
        lines += [f"({END} {spelled(path.id)})", f"G0 Z{number(high, 4)}"]
    return ("\n".join([*lines, "M2", ""])).encode()


def _upright(motion: Motion, options: ProgramOptions) -> None:
    for one in motion.strokes:
        if one.rotation is None:
            continue
        down = -np.asarray(one.rotation)[:, 2, 2]
        lean = float(np.degrees(np.arccos(np.clip(down, -1.0, 1.0)).max()))
        if lean > np.degrees(options.tilt):
            raise InputError(
                f"{motion.name}: stroke {one.id!r}: the tool leans {lean:.1f}° from straight down, "
                f"and G-code holds XYZ alone; --tilt {math.ceil(lean)} writes it nevertheless"
            )


def _point(position: Floats) -> str:
    return " ".join(f"{n}{number(v, 4)}" for n, v in zip("XYZ", position.tolist(), strict=True))


_WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))", re.ASCII)
_COMMENT = re.compile(r"\(([^)]*)\)|;(.*)")
_MOTIONS = {0: "G0", 1: "G1", 2: "G2", 3: "G3"}
_HARMLESS = {4, 17, 20, 21, 40, 49, 54, 61, 61.1, 64, 80, 90, 91, 91.1, 94, 98, 99}


@dataclass
class _Machine:
    """What a G-code interpreter remembers."""

    moves: ProgramMoves
    tolerance: float
    travel: float
    place: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    known: set[str] = field(default_factory=set)
    unit: float = 1.0
    feed: float = math.nan
    motion: int | None = None
    absolute: bool = True
    rapid: list[bool] = field(default_factory=list)

    def line(self, number_: int, words: list[tuple[str, float]]) -> None:
        """Take one line's words."""
        codes = [value for letter, value in words if letter == "G"]
        values = {letter: value for letter, value in words if letter not in "GMNOST"}
        for code in codes:
            if code in _MOTIONS:
                self.motion = int(code)
            elif code in (20, 21):
                self.unit = INCH if code == 20 else 1.0
            elif code in (90, 91):
                self.absolute = code == 90
            elif code not in _HARMLESS:
                raise self.moves.wrong(
                    number_,
                    f"G{code:g} is not read: only G0 to G4, G17, G20, G21, G90, G91 and what "
                    "does not change the path",
                )
        if "F" in values:
            if not values["F"] > 0.0:
                raise self.moves.wrong(number_, "a feed must be above 0")
            self.feed = values["F"] * self.unit / 60.0
        if 4 in codes:
            if "P" not in values:
                raise self.moves.wrong(number_, "G4 needs a time, P")
            self.moves.wait(number_, values["P"])
            self.rapid += [False] * (len(self.moves.targets) - len(self.rapid))
        elif values.keys() & set("XYZ"):
            self._to(number_, values)
        extra = sorted(values.keys() & set("ABCUVW"))
        if extra:
            raise self.moves.wrong(number_, f"axis {extra[0]} is not read: only X, Y and Z")

    def _to(self, line: int, values: dict[str, float]) -> None:
        if self.motion is None:
            raise self.moves.wrong(line, "coordinates before G0 or G1 say how to go there")
        goal = list(self.place)
        for i, axis in enumerate("XYZ"):
            if axis in values:
                step = values[axis] * self.unit
                goal[i] = step if self.absolute else goal[i] + step
                if self.absolute or axis in self.known:
                    self.known.add(axis)
        points = [goal]
        if self.motion in (2, 3):
            points = self._arc(line, goal, values)
        self.place = goal
        if not self.known >= set("XY"):
            return  # nobody knows where the machine is
        rapid = self.motion == 0
        for point in points:
            self.moves.move(line, tuple(point), self.travel if rapid else self.feed)
            self.rapid.append(rapid)

    def _arc(self, line: int, goal: list[float], values: dict[str, float]) -> list[list[float]]:
        """Points of an arc about z, no chord further off than the tolerance."""
        x0, y0, z0 = self.place
        x1, y1, z1 = goal
        if "R" in values:
            cx, cy = self._centre(line, goal, values["R"] * self.unit)
        elif values.keys() & set("IJ"):
            cx = x0 + values.get("I", 0.0) * self.unit
            cy = y0 + values.get("J", 0.0) * self.unit
        else:
            raise self.moves.wrong(line, "an arc needs its centre, I and J, or its radius, R")
        r0, r1 = math.hypot(x0 - cx, y0 - cy), math.hypot(x1 - cx, y1 - cy)
        if r0 <= 0.0 or abs(r1 - r0) > max(0.05, 1e-3 * r0):
            raise self.moves.wrong(
                line, f"start and end lie {r0:.4g} and {r1:.4g} mm from the centre: no arc"
            )
        begin = math.atan2(y0 - cy, x0 - cx)
        sweep = (math.atan2(y1 - cy, x1 - cx) - begin) % (2.0 * math.pi)
        if self.motion == 2:
            sweep -= 2.0 * math.pi
        if abs(sweep) < 1e-9 or abs(abs(sweep) - 2.0 * math.pi) < 1e-9:
            sweep = 2.0 * math.pi if self.motion == 3 else -2.0 * math.pi
        step = 2.0 * math.acos(max(1.0 - self.tolerance / r0, -1.0)) or 1.0
        count = max(2, math.ceil(abs(sweep) / step))
        if count > LONGEST_ARC:
            raise self.moves.wrong(line, f"an arc of {count} points; give a coarser --tolerance")
        share = np.arange(1, count + 1) / count
        angle, radius = begin + sweep * share, r0 + (r1 - r0) * share
        points = np.column_stack(
            [cx + radius * np.cos(angle), cy + radius * np.sin(angle), z0 + (z1 - z0) * share]
        )
        points[-1] = goal
        return [list(point) for point in points.tolist()]

    def _centre(self, line: int, goal: list[float], radius: float) -> tuple[float, float]:
        dx, dy = goal[0] - self.place[0], goal[1] - self.place[1]
        chord = math.hypot(dx, dy)
        if chord == 0.0 or abs(radius) < chord / 2.0 * (1.0 - 1e-6):
            raise self.moves.wrong(line, f"no arc of radius {radius:g} mm joins its ends")
        height = math.sqrt(max(radius * radius - chord * chord / 4.0, 0.0))
        # A radius below 0 means the longer of both arcs.
        side = (1.0 if self.motion == 3 else -1.0) * math.copysign(1.0, radius)
        return (
            self.place[0] + dx / 2.0 - side * height * dy / chord,
            self.place[1] + dy / 2.0 + side * height * dx / chord,
        )


@decoder
def decode(source: Source, tolerance: float = 0.01, travel: float = 50.0) -> list[MotionStroke]:
    """Read the path of a pen, mm; time by the feeds.

    Parameters
    ----------
    source : Source
    tolerance : float
        How far a chord may lie off its arc, mm.
    travel : float
        Speed of G0, mm/s.

    Raises
    ------
    InputError
        A code that changes the path and is not read, a move without feed, text that is no G-code;
        names the line.
    """
    moves = ProgramMoves(source.name)
    machine = _Machine(moves, tolerance, travel)
    ours = False
    for line, text in enumerate(program_moves.lines_of(source), 1):
        for found in _COMMENT.finditer(text):
            moves.mark(found[1] or found[2] or "")
        code = _COMMENT.sub(" ", text).strip().upper()
        if not code or code[0] in "%/":
            continue
        rest = _WORD.sub(" ", code).strip()
        if rest:
            raise moves.wrong(line, f"{rest[:40]!r} is no word of G-code")
        machine.line(line, [(word[1], float(word[2])) for word in _WORD.finditer(code)])
        if len(moves.targets) > program_moves.MOST_MOVES:
            raise moves.wrong(line, "more moves than are read; give a coarser --tolerance")
        ours = ours or bool(moves.marks)
    if not any(not rapid for rapid in machine.rapid):
        raise InputError(f"{source.name}: holds no cut (G1, G2, G3), only rapid moves or none")
    if not ours:
        _cuts(moves, machine.rapid)
    return moves.strokes()


def _cuts(moves: ProgramMoves, rapid: list[bool]) -> None:
    """Leave travel before the first and after the last cut out of the stroke."""
    first = rapid.index(False)
    last = len(rapid) - 1 - rapid[::-1].index(False)
    moves.marks += [(first, ""), (last + 1, None)]
