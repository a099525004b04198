r"""RAPID of ABB, written and read: ``MoveL`` to robtargets, mm and quaternions w, x, y, z.

A move carries its speed (``\V``, mm/s) or its duration (``\T``, s), and the radius of its corner
(``\Z``, mm). Positions are in wobj0, which is the base where base and world agree. Language: RAPID
Instructions, Functions and Data types, ABB.
"""

import re
from dataclasses import replace

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.formats.motion import Motion, MotionStroke
from dmpcli.formats.program_moves import BEGIN, END, NUMBER, ProgramMoves, identifier, spelled
from dmpcli.formats.program_routines import Routines
from dmpcli.formats.text import number, significant
from dmpcli.formats.toolpath import (
    GRAVITY,
    ProgramLeg,
    ProgramOptions,
    centre_on_flange,
    legs,
    parts,
    toolpaths,
)
from dmpcli.records.file_io import Source
from dmpcli.records.rotation_forms import wrong
from dmpcli.records.untrusted import decoder
from dmpcli.spatial.output_events import OutputEvent
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.rotations import from_quaternion, to_quaternion
from dmpcli.spatial.wrench import Tool

LONGEST_NAME = 32
_EXTERNAL = "[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]"


def encode(motion: Motion, options: ProgramOptions, name: str) -> bytes:
    """Return a module whose procedure ``main`` draws all strokes.

    Parameters
    ----------
    motion : Motion
        Poses in the base frame, which the program calls ``wobj0``.
    options : ProgramOptions
        Tolerance, corners, ways to and from the work; with a tool also its data, without one
        the tool that is active on the controller.
    name : str
        Of the module, as `identifier` spells it.

    Returns
    -------
    bytes
        Positions to 1e-4 mm; a procedure for each `options.lines` lines. Where more than one
        output is switched at a corner, the corner is not rounded.

    Raises
    ------
    InputError
        A stroke says no orientation.
    """
    motion.rotation_needed("RAPID")
    body: list[str] = []
    travel = rf"v1000\V:={significant(options.travel)}"
    tail = r"tStroke\WObj:=wobj0;"
    for path in toolpaths(motion, options, 4):
        assert path.rotation is not None
        q = to_quaternion(path.rotation)
        targets = [_target(p, one) for p, one in zip(path.position, q, strict=True)]
        if options.lift:
            body.append(f"MoveL {_target(path.before, q[0])}, {travel}, fine, {tail}")
        body.append(f"MoveL {targets[0]}, {travel}, fine, {tail}")
        body.append(f"! {BEGIN} {spelled(path.id)}")
        body += [_set(event) for event in path.switches.get(0, ())]
        for leg in legs(path, options.blend):
            switches = path.switches.get(leg.index, [])
            if leg.pause:
                body += [f"WaitTime {significant(leg.seconds)};", *map(_set, switches)]
                continue
            if len(switches) == 1 and leg.blend:
                body.append(_flying(targets[leg.index], leg, switches[0]))
                continue
            if switches:  # more than one: only where the arm stops they come one by one
                leg = replace(leg, blend=0.0)
            how = rf"v1000\T:={significant(leg.seconds)}"
            if leg.speed is not None:
                how = rf"v1000\V:={significant(leg.speed)}"
            zone = rf"z1\Z:={number(leg.blend, 3)}" if leg.blend else "fine"
            body.append(f"MoveL {targets[leg.index]}, {how}, {zone}, {tail}")
            body += map(_set, switches)
        body.append(f"! {END} {spelled(path.id)}")
        if options.lift:
            body.append(f"MoveL {_target(path.after, q[-1])}, {travel}, fine, {tail}")
    groups = list(parts(len(body), options.lines))
    lines = [f"MODULE {identifier(name, LONGEST_NAME)}", *_tool(options.tool, options.payload)]
    lines += ["", "  PROC main()", r"    ConfL \Off;", r"    ConfJ \Off;"]
    if options.tool is None:
        lines.append("    tStroke := CTool();")
    lines += [*(f"    Part_{i + 1};" for i in range(len(groups))), "  ENDPROC"]
    for i, group in enumerate(groups):
        lines += ["", f"  PROC Part_{i + 1}()", *(f"    {body[k]}" for k in group), "  ENDPROC"]
    return ("\n".join([*lines, "ENDMODULE", ""])).encode()


def _set(event: OutputEvent) -> str:
    return f"SetDO {event.output}, {int(event.on)};"


def _flying(target: str, leg: ProgramLeg, event: OutputEvent) -> str:
    r"""Return a move that switches an output in the middle of its rounded corner.

    MoveLDO knows neither \V nor \Z: speed and zone stand as data.
    """
    r = number(leg.blend, 3)
    speed = rf"v1000\T:={significant(leg.seconds)}"
    if leg.speed is not None:
        speed = f"[{significant(leg.speed)},500,5000,1000]"
    zone = f"[FALSE,{r},{r},{r},1,{r},1]"
    return (
        rf"MoveLDO {target}, {speed}, {zone}, tStroke\WObj:=wobj0, {event.output}, {int(event.on)};"
    )


def _target(position: Floats, q: Floats) -> str:
    x, y, z, w = q.tolist()
    place = ",".join(number(v, 4) for v in position.tolist())
    return f"[[{place}],[{','.join(number(v, 8) for v in (w, x, y, z))}],{_EXTERNAL}]"


def _tool(tool: Tool | None, payload: bool) -> list[str]:
    if tool is None:
        empty = "[TRUE,[[0,0,0],[1,0,0,0]],[0.001,[0,0,0.001],[1,0,0,0],0,0,0]]"
        return [
            "  ! The tool is the one that is active on the controller.",
            f"  PERS tooldata tStroke := {empty};",
        ]
    x, y, z, w = to_quaternion(tool.tcp_rotation).tolist()
    place = ",".join(number(v, 4) for v in tool.tcp_position.tolist())
    turn = ",".join(number(v, 8) for v in (w, x, y, z))
    mass, centre = "0.001", "0,0,0.001"
    if payload:
        mass = significant(tool.weight / GRAVITY)
        centre = ",".join(number(v, 3) for v in centre_on_flange(tool).tolist())
    load = f"[{mass},[{centre}],[1,0,0,0],0,0,0]"
    return [f"  PERS tooldata tStroke := [TRUE,[[{place}],[{turn}]],{load}];"]


_N = NUMBER
_LIST = re.compile(_N, re.ASCII)
_MOVE = re.compile(
    rf"MoveL\s+\[\s*\[([^\]]*)\]\s*,\s*\[([^\]]*)\]\s*,[^;]*?\]\s*\]\s*,\s*"
    rf"(?:v({_N}|max)|\[\s*({_N})[^\]]*\])\s*(?:\\([VT])\s*:=\s*({_N}))?\s*,[^;]*;",
    re.ASCII | re.IGNORECASE,
)
_FLYING = re.compile(r"MoveLDO(\s.*),\s*(\w+)\s*,\s*([01])\s*;", re.ASCII | re.IGNORECASE)
_OUT = re.compile(
    r"(?:SetDO\s+(\w+)\s*,\s*([01])|(Set|Reset)\s+(\w+))\s*;", re.ASCII | re.IGNORECASE
)
_WAIT = re.compile(rf"WaitTime\s+({_N})\s*;", re.ASCII | re.IGNORECASE)
_PROC = re.compile(r"(?:LOCAL\s+)?PROC\s+(\w+)\s*\(\s*\)", re.ASCII | re.IGNORECASE)
_CALL = re.compile(r"(\w+)\s*;", re.ASCII)
_MOVES_NOTHING = frozenset({"stop", "break", "tperase"})
_WOBJ = re.compile(r"\\WObj\s*:=\s*(\w+)", re.ASCII | re.IGNORECASE)
_HARMLESS = re.compile(
    r"(MODULE\s+\w+.*|ENDMODULE|ENDPROC|(LOCAL\s+)?(PERS|CONST|VAR|TASK)\s.*;|(ConfL|ConfJ|SingArea|AccSet)\b.*;|"
    r"\w+\s*:=\s*CTool\s*\(\s*\)\s*;|%%%|VERSION:.*|LANGUAGE:.*)",
    re.ASCII | re.IGNORECASE,
)


@decoder
def decode(source: Source) -> list[MotionStroke]:
    """Read a module of straight moves.

    Raises
    ------
    InputError
        It holds what is neither a straight move to a target nor harmless; names the line.
    """
    moves = ProgramMoves(source.name)
    routines = Routines(source.name, "main", _MOVES_NOTHING)
    for line, code in moves.statements(source, "!"):
        begun, called = _PROC.fullmatch(code), _CALL.fullmatch(code)
        if begun:
            routines.begin(line, begun[1])
        elif code.upper() == "ENDPROC":
            routines.end()
        elif called:
            routines.call(line, called[1])
        wait, found = _WAIT.fullmatch(code), None
        if flying := _FLYING.fullmatch(code):
            code = f"MoveL{flying[1]};"
            moves.switch(flying[2], flying[3] == "1", ahead=1)
        if switched := _OUT.fullmatch(code):
            on = switched[2] == "1" if switched[1] else switched[3].lower() == "set"
            moves.switch(switched[1] or switched[4], on)
            continue
        if code[:5].lower() == "movel":
            found = _MOVE.fullmatch(code)
        if wait:
            moves.wait(line, float(wait[1]))
        elif found:
            _move(moves, line, found)
            routines.moved()
        elif not (begun or called) and not _HARMLESS.fullmatch(code):
            raise moves.wrong(
                line,
                f"{code[:60]!r} is not read: only MoveL to robtargets of numbers, WaitTime, and "
                "procedures in the order in which they are called",
            )
    routines.check()
    return moves.strokes(_poses)


def _move(moves: ProgramMoves, line: int, found: re.Match[str]) -> None:
    place, turn = (_numbers(found[i]) for i in (1, 2))
    frame = _WOBJ.search(found[0])
    if frame is not None and frame[1].lower() != "wobj0":
        moves.in_frame(line, f"work object {frame[1]}")
    if len(place) != 3 or len(turn) != 4:
        raise moves.wrong(line, "a robtarget needs 3 coordinates and 4 of a quaternion")
    bad = wrong("wxyz", np.array([turn]))
    if bad is not None:
        raise moves.wrong(line, bad[1])
    if (found[5] or "").upper() == "T":
        moves.move(line, (*place, *turn), seconds=float(found[6]))
        return
    said = found[6] or found[3] or found[4]
    speed = 7000.0 if said.lower() == "max" else float(said)
    moves.move(line, (*place, *turn), speed)


def _numbers(text: str) -> tuple[float, ...]:
    parts_ = [part.strip() for part in text.split(",")]
    if not all(_LIST.fullmatch(part) for part in parts_):
        return ()
    return tuple(map(float, parts_))


def _poses(values: Floats) -> Pose:
    q = values[:, [4, 5, 6, 3]]
    return Pose(values[:, :3], from_quaternion(q / np.linalg.norm(q, axis=1, keepdims=True)))
