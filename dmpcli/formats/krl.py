"""KRL of KUKA, written and read: ``LIN {X, Y, Z, A, B, C}`` in mm and degrees, ``$VEL.CP`` in m/s.

A, B and C turn about z, y and x: R = Rz(A) Ry(B) Rx(C). Positions are in the robot's own base
(``$BASE = $ROBROOT``). Language: KUKA System Software, Operating and Programming Instructions.
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
from dmpcli.records.rotation_forms import matrices
from dmpcli.records.untrusted import decoder
from dmpcli.spatial.output_events import OutputEvent
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.wrench import Tool

LONGEST_NAME = 24
_FREE_TURN = 200.0
"""Turning speed that is no limit of a move with a speed, °/s."""


def encode(motion: Motion, options: ProgramOptions, name: str) -> bytes:
    """Return a program that draws all strokes; its file must have the program's name.

    Parameters
    ----------
    motion : Motion
        Poses in the base frame, which the program calls ``$ROBROOT``.
    options : ProgramOptions
        Tolerance, corners, ways to and from the work; with a tool also its TCP and, where its
        weight is known, its load.
    name : str
        Of the main routine, as `identifier` spells it.

    Returns
    -------
    bytes
        Positions to 1e-4 mm, angles to 1e-5°; a part routine for each `options.lines` lines.

    Raises
    ------
    InputError
        A stroke says no orientation, or switches an output that is not ``DO`` and a number.
    """
    motion.rotation_needed("KRL")
    body: list[str] = []
    state = {"cp": "", "ori": "", "cdis": ""}

    def speed(mm_s: float) -> None:
        _set(body, state, "cp", "$VEL.CP=", significant(mm_s / 1000.0))

    def turn(deg_s: float) -> None:
        text = significant(deg_s)
        if state["ori"] != text:
            body.extend([f"$VEL.ORI1={text}", f"$VEL.ORI2={text}"])
            state["ori"] = text

    for path in toolpaths(motion, options, 4):
        assert path.rotation is not None
        angles = euler(path.rotation)
        poses = [_frame(p, a) for p, a in zip(path.position, angles, strict=True)]
        turn(_FREE_TURN)
        speed(options.travel)
        if options.lift:
            body.append(f"LIN {_frame(path.before, angles[0])}")
        body += [f"LIN {poses[0]}", f";{BEGIN} {spelled(path.id)}"]
        body += [_switch(event) for event in path.switches.get(0, ())]
        for leg in legs(path, options.blend):
            switched = [_switch(event) for event in path.switches.get(leg.index, ())]
            if leg.pause:
                body += [f"WAIT SEC {significant(leg.seconds)}", *switched]
                continue
            length = float(path.length[leg.index - 1])
            if leg.speed is None:
                turn(float(np.degrees(leg.turn)) / leg.seconds)
                # The slower of both counts: the turn, where it is what takes the time.
                speed(max(length / leg.seconds, 1e-3) if length else options.travel)
            else:
                turn(_FREE_TURN)
                speed(leg.speed)
            if leg.blend:
                _set(body, state, "cdis", "$APO.CDIS=", number(leg.blend, 3))
                # At the move's end, of a rounded one at the middle of its arc.
                body += [f"TRIGGER WHEN DISTANCE=1 DELAY=0 DO {deed}" for deed in switched]
                body.append(f"LIN {poses[leg.index]} C_DIS")
            else:
                body += [f"LIN {poses[leg.index]}", *switched]
        body.append(f";{END} {spelled(path.id)}")
        if options.lift:
            turn(_FREE_TURN)
            speed(options.travel)
            body.append(f"LIN {_frame(path.after, angles[-1])}")
    routine = identifier(name, LONGEST_NAME)
    groups = list(parts(len(body), options.lines))
    lines = ["&ACCESS RVP", f"DEF {routine} ( )", "BAS (#INITMOV,0)", "$BASE=$ROBROOT"]
    lines += _tool(options.tool, options.payload)
    lines += [
        "$ORI_TYPE=#VAR",
        "$IPO_MODE=#BASE",
        f"$ACC.CP={significant(options.acceleration / 1000.0)}",
        "PTP $AXIS_ACT",
        *(f"PART_{i + 1} ( )" for i in range(len(groups))),
        "END",
    ]
    for i, group in enumerate(groups):
        lines += ["", f"DEF PART_{i + 1} ( )", *(body[k] for k in group), "END"]
    return ("\n".join([*lines, ""])).encode()


def _switch(event: OutputEvent) -> str:
    return f"$OUT[{output_number(event.output, 'DO', 'KRL')}]={str(event.on).upper()}"


def _set(body: list[str], state: dict[str, str], key: str, words: str, text: str) -> None:
    if state[key] != text:
        body.append(words + text)
        state[key] = text


def euler(R: Floats) -> Floats:
    """Angles A, B, C of rotations, shape (n, 3), degrees."""
    b = np.arctan2(-R[:, 2, 0], np.hypot(R[:, 0, 0], R[:, 1, 0]))
    level = np.hypot(R[:, 0, 0], R[:, 1, 0]) < 1e-9
    a = np.where(level, np.arctan2(-R[:, 0, 1], R[:, 1, 1]), np.arctan2(R[:, 1, 0], R[:, 0, 0]))
    c = np.where(level, 0.0, np.arctan2(R[:, 2, 1], R[:, 2, 2]))
    return np.asarray(np.degrees(np.column_stack([a, b, c])))


def _frame(position: Floats, angles: Floats) -> str:
    words = [f"{n} {number(v, 4)}" for n, v in zip("XYZ", position.tolist(), strict=True)]
    words += [f"{n} {number(v, 5)}" for n, v in zip("ABC", angles.tolist(), strict=True)]
    return "{" + ",".join(words) + "}"


def _tool(tool: Tool | None, payload: bool) -> list[str]:
    if tool is None:
        return [";the tool is the one that is active on the controller"]
    lines = [f"$TOOL={_frame(tool.tcp_position, euler(tool.tcp_rotation[None])[0])}"]
    if payload:
        centre = _frame(centre_on_flange(tool), np.zeros(3))
        lines += [f"$LOAD.M={significant(tool.weight / GRAVITY)}", f"$LOAD.CM={centre}"]
    return lines


_N = NUMBER
_LIN = re.compile(r"LIN\s*\{([^}]*)\}\s*(C_DIS|C_VEL|C_ORI)?", re.ASCII | re.IGNORECASE)
_ENTRY = re.compile(rf"\s*([A-Z]\d?)\s+({_N})\s*", re.ASCII | re.IGNORECASE)
_VALUE = re.compile(rf"\$VEL\.(CP|ORI1|ORI2)\s*=\s*({_N})", re.ASCII | re.IGNORECASE)
_WAIT = re.compile(rf"WAIT\s+SEC\s+({_N})", re.ASCII | re.IGNORECASE)
_DEF = re.compile(r"(?:GLOBAL\s+)?DEF\s+(\w+)\s*\(\s*\)", re.ASCII | re.IGNORECASE)
_CALL = re.compile(r"(\w+)\s*\(\s*\)", re.ASCII)
_BASE = re.compile(r"\$BASE\s*=\s*(.+)|BAS\s*\(\s*#BASE\s*,(.+)\)", re.ASCII | re.IGNORECASE)
_IS_ROOT = re.compile(
    r"\$ROBROOT|\$NULLFRAME|\{\s*[XYZABC]\s+0(\.0*)?(\s*,\s*[XYZABC]\s+0(\.0*)?)*\s*\}|0",
    re.ASCII | re.IGNORECASE,
)
_OUT = re.compile(
    r"(?:TRIGGER\s+WHEN\s+DISTANCE\s*=\s*([01])\s+DELAY\s*=\s*0\s+DO\s+)?"
    r"\$OUT\s*\[\s*(\d{1,4})\s*\]\s*=\s*(TRUE|FALSE)",
    re.ASCII | re.IGNORECASE,
)
_HARMLESS = re.compile(
    r"(&.*|END|BAS\s*\(.*\)|PTP\s+\$AXIS_ACT|"
    r"PTP\s+\$POS_ACT|\$[\w.\[\]]+\s*=.*|(DECL|INT|REAL|BOOL)\s.*)",
    re.ASCII | re.IGNORECASE,
)
_NAMES = ("X", "Y", "Z", "A", "B", "C")


@decoder
def decode(source: Source) -> list[MotionStroke]:
    """Read a program of straight moves.

    Raises
    ------
    InputError
        It holds what is neither a straight move to a frame nor harmless; names the line.
    """
    moves = ProgramMoves(source.name)
    speed, turn = float("nan"), float("nan")
    routines = Routines(source.name, "", frozenset())
    for line, code in moves.statements(source, ";"):
        begun, called, base = _DEF.fullmatch(code), _CALL.fullmatch(code), _BASE.fullmatch(code)
        if begun:
            routines.begin(line, begun[1])
        elif code.upper() == "END":
            routines.end()
        elif called:
            routines.call(line, called[1])
        elif base and not _IS_ROOT.fullmatch(base[1] or base[2]):
            moves.in_frame(line, f"$BASE {base[1] or base[2]}")
        value, wait, found = _VALUE.fullmatch(code), _WAIT.fullmatch(code), _LIN.fullmatch(code)
        if switched := _OUT.fullmatch(code):
            ahead = int(switched[1] or 0)
            moves.switch(f"DO{int(switched[2])}", switched[3].upper() == "TRUE", ahead)
        elif value:
            if value[1].upper() == "CP":
                speed = float(value[2]) * 1000.0
            else:
                turn = float(np.radians(float(value[2])))
        elif wait:
            moves.wait(line, float(wait[1]))
        elif found:
            moves.move(line, _target(moves, line, found[1]), speed, turn)
            routines.moved()
        elif not (begun or called or base) and not _HARMLESS.fullmatch(code):
            raise moves.wrong(
                line,
                f"{code[:60]!r} is not read: only LIN to frames of numbers, WAIT SEC, speeds, and "
                "routines in the order in which they are called",
            )
    routines.check()
    return moves.strokes(_poses)


def _target(moves: ProgramMoves, line: int, words: str) -> tuple[float, ...]:
    entries: dict[str, float] = {}
    for word in words.split(","):
        entry = _ENTRY.fullmatch(word)
        if entry is None:
            raise moves.wrong(line, f"{word.strip()[:40]!r} is not a coordinate")
        entries[entry[1].upper()] = float(entry[2])
    missing = [name for name in _NAMES if name not in entries]
    if missing:
        raise moves.wrong(line, f"the frame lacks {', '.join(missing)}; all six are needed")
    return tuple(entries[name] for name in _NAMES)


def _poses(values: Floats) -> Pose:
    # Ours are X-Y-Z by name, whatever the order of turning: C about x, B about y, A about z.
    return Pose(values[:, :3], matrices("rpy", np.radians(values[:, [5, 4, 3]])))
