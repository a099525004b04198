"""URScript, written and read: ``movel(p[x, y, z, rx, ry, rz], a, v, t, r)`` in m, s and rad.

A pose's rotation is a rotation vector in the robot's base frame. Of a move that has both a speed
and a time, the time counts. Language: The URScript Programming Language, Universal Robots.
"""

import re

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.formats.motion import Motion, MotionStroke
from dmpcli.formats.program_moves import (
    BEGIN,
    END,
    NUMBER,
    ProgramMoves,
    identifier,
    output_number,
    spelled,
)
from dmpcli.formats.program_routines import Routines
from dmpcli.formats.text import number, significant
from dmpcli.formats.toolpath import (
    GRAVITY,
    ProgramOptions,
    centre_on_flange,
    legs,
    parts,
    toolpaths,
)
from dmpcli.records.file_io import Source
from dmpcli.records.untrusted import decoder
from dmpcli.spatial.output_events import OutputEvent
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.rotations import exp, log
from dmpcli.spatial.wrench import Tool

DEFAULT_SPEED = 250.0
"""Of movel where the program says none, mm/s."""


def encode(motion: Motion, options: ProgramOptions, name: str) -> bytes:
    """Return a program that draws all strokes.

    Parameters
    ----------
    motion : Motion
        Poses in the base frame.
    options : ProgramOptions
        Tolerance, corners, ways to and from the work; with a tool also its TCP and, where its
        weight is known, its payload.
    name : str
        Of the program's function, as `identifier` spells it.

    Returns
    -------
    bytes
        Poses in m and rad; a function within the program for each `options.lines` lines.

    Raises
    ------
    InputError
        A stroke says no orientation, or switches an output that is not one of the letters ``DO``,
        ``CO`` or ``TO`` and a number.
    """
    motion.rotation_needed("URScript")
    body: list[str] = []
    a = significant(options.acceleration / 1000.0)
    travel = f"a={a}, v={significant(options.travel / 1000.0)}"
    for path in toolpaths(motion, options, 4):
        assert path.rotation is not None
        poses = [
            f"p[{x}]" for x in map(_joined, np.hstack([path.position / 1000.0, log(path.rotation)]))
        ]
        ends = np.stack([path.before, path.after]) / 1000.0
        vectors = log(path.rotation[[0, -1]])
        above = [f"p[{_joined(row)}]" for row in np.hstack([ends, vectors])]
        if options.lift:
            body.append(f"movel({above[0]}, {travel})")
        body += [f"movel({poses[0]}, {travel})", f"# {BEGIN} {spelled(path.id)}"]
        body += [_switch(event) for event in path.switches.get(0, ())]
        for leg in legs(path, options.blend):
            if leg.pause:
                body.append(f"sleep({significant(leg.seconds)})")
            else:
                how = f"t={significant(leg.seconds)}"
                if leg.speed is not None:
                    how = f"v={significant(leg.speed / 1000.0)}"
                blend = f", r={number(leg.blend / 1000.0, 6)}" if leg.blend else ""
                body.append(f"movel({poses[leg.index]}, a={a}, {how}{blend})")
            body += [_switch(event) for event in path.switches.get(leg.index, ())]
        body.append(f"# {END} {spelled(path.id)}")
        if options.lift:
            body.append(f"movel({above[1]}, {travel})")
    lines = [f"def {identifier(name, 40)}():"]
    lines += [f"  {line}" for line in _tool(options.tool, options.payload)]
    groups = list(parts(len(body), options.lines))
    for i, group in enumerate(groups):
        lines.append(f"  def part_{i + 1}():")
        lines += [f"    {body[k]}" for k in group]
        lines.append("  end")
    lines += [f"  part_{i + 1}()" for i in range(len(groups))]
    return ("\n".join([*lines, "end", ""])).encode()


def _joined(row: Floats) -> str:
    position, vector = row[:3].tolist(), row[3:].tolist()
    return ", ".join([*(number(v, 7) for v in position), *(number(v, 8) for v in vector)])


_OUTPUTS = {"DO": "standard", "CO": "configurable", "TO": "tool"}
"""Kinds of outputs, by the letters that their names begin with."""


def _switch(event: OutputEvent) -> str:
    letters = event.output[:2] if event.output[:2] in _OUTPUTS else "DO"
    number_ = output_number(event.output, letters, "URScript")
    return f"set_{_OUTPUTS[letters]}_digital_out({number_}, {event.on})"


def _tool(tool: Tool | None, payload: bool) -> list[str]:
    if tool is None:
        return ["# the tool is the one that is active on the controller"]
    tcp = _joined(np.concatenate([tool.tcp_position / 1000.0, log(tool.tcp_rotation)]))
    lines = [f"set_tcp(p[{tcp}])"]
    if payload:
        centre = ", ".join(number(v / 1000.0, 6) for v in centre_on_flange(tool).tolist())
        lines.append(f"set_payload({significant(tool.weight / GRAVITY)}, [{centre}])")
    return lines


_N = NUMBER
_POSE = rf"p\s*\[\s*({_N}(?:\s*,\s*{_N}){{5}})\s*\]"
_MOVE = re.compile(rf"(movel|movep)\s*\(\s*{_POSE}\s*((?:,[^)]*)?)\)", re.ASCII)
_SLEEP = re.compile(rf"sleep\s*\(\s*({_N})\s*\)", re.ASCII)
_SAID = re.compile(rf"\s*(?:([avtr])\s*=)?\s*({_N})\s*", re.ASCII)
_DEF = re.compile(r"def\s+(\w+)\s*\(\s*\)\s*:", re.ASCII)
_CALL = re.compile(r"(\w+)\s*\(\s*\)", re.ASCII)
_MOVES_NOTHING = frozenset({"sync", "zero_ftsensor", "end_force_mode"})
_OUT = re.compile(
    r"set_(?:(standard|configurable|tool)_)?digital_out\s*\(\s*(\d{1,3})\s*,\s*(True|False)\s*\)",
    re.ASCII,
)
_HARMLESS = re.compile(
    r"(end|(set_|textmsg|popup|sync|stopl|stopj)\w*\s*\(.*\)|global\s.*)",
    re.ASCII,
)


@decoder
def decode(source: Source) -> list[MotionStroke]:
    """Read a program of straight moves.

    Raises
    ------
    InputError
        It holds what is neither a straight move to a pose nor harmless; names the line.
    """
    moves = ProgramMoves(source.name)
    routines = Routines(source.name, "", _MOVES_NOTHING)
    for line, code in moves.statements(source, "#"):
        begun, called = _DEF.fullmatch(code), _CALL.fullmatch(code)
        if begun:
            routines.begin(line, begun[1])
        elif code == "end":
            routines.end()
        elif called:
            routines.call(line, called[1])
        if switched := _OUT.fullmatch(code):
            letters = {kind: name for name, kind in _OUTPUTS.items()}[switched[1] or "standard"]
            moves.switch(f"{letters}{int(switched[2])}", switched[3] == "True")
        if begun or called or _HARMLESS.fullmatch(code):
            continue
        slept = _SLEEP.fullmatch(code)
        if slept:
            moves.wait(line, float(slept[1]))
            continue
        found = _MOVE.fullmatch(code)
        if found is None:
            raise moves.wrong(
                line,
                f"{code[:60]!r} is not read: only movel and movep to poses of numbers, sleep, and "
                "functions in the order in which they are called",
            )
        said: dict[str, float] = {}
        for place, word in enumerate(filter(None, found[3].split(","))):
            entry = _SAID.fullmatch(word)
            if entry is None:
                raise moves.wrong(line, f"{word.strip()[:40]!r} is not a number with a name")
            said[entry[1] or "avtr"[min(place, 3)]] = float(entry[2])
        seconds = said.get("t", 0.0)
        target = tuple(float(v) for v in found[2].split(","))
        speed = said.get("v", DEFAULT_SPEED / 1000.0) * 1000.0
        moves.move(line, target, **_how(speed, seconds))
        routines.moved()
    routines.check()
    return moves.strokes(_poses)


def _how(speed: float, seconds: float) -> dict[str, float]:
    return {"seconds": seconds} if seconds else {"speed": speed}


def _poses(values: Floats) -> Pose:
    return Pose(values[:, :3] * 1000.0, exp(values[:, 3:]))
