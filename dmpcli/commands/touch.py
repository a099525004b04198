"""``dmpcli touch``: write down where the tool's tip is, point by point."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dmpcli.commands.options import Quiet, Realtime, Robot
from dmpcli.errors import InputError, counted
from dmpcli.messages import on_terminal
from dmpcli.settings.options import with_options
from dmpcli.settings.touch import TouchOptions

if TYPE_CHECKING:
    from dmpcli.arrays import Floats
    from dmpcli.calibration.by_hand import Keyboard
    from dmpcli.control.signals import Interruption
    from dmpcli.instruments.protocols import Clock, Servo
    from dmpcli.records.points import PointFile


@with_options
def command(
    *,
    output: Annotated[
        str, typer.Option("--output", "-o", metavar="FILE", help="Points; - is stdout.")
    ],
    robot: Robot = "mock:",
    tool: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Tool file: where the tip is.")
    ] = None,
    pairs: Annotated[
        bool, typer.Option("--pairs", help="Starts and goals in turn, for generalize --pairs.")
    ] = False,
    angles: Annotated[
        bool, typer.Option("--angles", help="With --pairs: the tool's orientations too.")
    ] = False,
    part: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="px py pz of the part's points, in order, for register."),
    ] = None,
    settings: TouchOptions,
    realtime: Realtime = False,
    force: Annotated[bool, typer.Option("--force", help="Replace points of a real arm.")] = False,
    quiet: Quiet = False,
) -> None:
    """Lead the tip to a point by pendant or hand; Enter takes it, at rest, and q ends."""
    on_terminal(quiet)
    from dmpcli.calibration.by_hand import Keyboard
    from dmpcli.control import guards, workcell
    from dmpcli.control.signals import Interruption
    from dmpcli.instruments.clock import MonotonicClock, SimulatedClock
    from dmpcli.messages import tell
    from dmpcli.records import file_io, suffixes
    from dmpcli.records import tool as tool_file

    every, count = settings.every, settings.count
    _check(pairs, angles, part, every, count)
    repeatable = workcell.repeatable(workcell.check(robot, None))
    suffixes.check(output, suffixes.CSV)
    file_io.check_writable(output, here=True)
    if output != "-" and not (repeatable or force) and Path(output).exists():
        raise InputError(
            f"{output}: exists, and points cannot be touched again alike; choose another name, or "
            "give --force"
        )
    points = _points(output, pairs, angles, None if part is None else _part(part))
    keyboard = None if every is not None else Keyboard("touch without --every S --count N")
    realtime = realtime or keyboard is not None or not repeatable
    clock = MonotonicClock() if realtime else SimulatedClock()
    geometry = None if tool is None else tool_file.geometry(file_io.read(tool))
    bench = workcell.connect(robot, None, clock, tool=geometry)
    if bench.note:
        tell(bench.note)
    try:
        with Interruption() as signals:
            bench.robot.open()
            _take(bench.robot, clock, points, keyboard, every, count, signals)
    finally:
        closing = guards.leave(bench.robot.close)
        points.close()
    if closing is not None:
        raise closing
    _end(points, output, signals)


def _check(
    pairs: bool, angles: bool, part: Path | None, every: float | None, count: int | None
) -> None:
    if pairs and part is not None:
        raise InputError("--part: points of a part are for register; leave --pairs out")
    if angles and not pairs:
        raise InputError("--angles: belongs to --pairs; points always have theirs")
    if every is not None and count is None and part is None:
        raise InputError("--every: needs --count N, or it would never end")


def _part(path: Path) -> "Floats":
    import numpy as np

    from dmpcli.records import file_io, tables
    from dmpcli.records.touched import PART

    table = tables.read(file_io.read(path))
    return np.stack([table.numbers(name) for name in PART], axis=1)


def _points(output: str, pairs: bool, angles: bool, part: "Floats | None") -> "PointFile":
    from dmpcli.records.points import PairFile, PointFile

    return PairFile(output, angles) if pairs else PointFile(output, part)


def _take(
    robot: "Servo",
    clock: "Clock",
    points: "PointFile",
    keyboard: "Keyboard | None",
    every: float | None,
    count: int | None,
    signals: "Interruption",
) -> None:
    from dmpcli.calibration import touching
    from dmpcli.calibration.resting import Watcher
    from dmpcli.messages import tell

    watcher = Watcher(robot, clock)

    def say(message: str) -> None:
        tell(message)

    if keyboard is not None:
        touching.by_hand(watcher, keyboard, points, count, signals, say)
    elif every is not None:
        touching.in_time(watcher, clock, every, count, points, signals, say)


def _end(points: "PointFile", output: str, signals: "Interruption") -> None:
    from dmpcli.messages import tell, warn
    from dmpcli.records import file_io
    from dmpcli.records.points import PairFile

    if isinstance(points, PairFile) and points.open:
        warn(f"pair {points.count // 2 + 1} has no goal: touch it, or remove the row")
    name = file_io.shown(output, output=True)
    if points.count == 0:
        tell(f"{name}: no point was taken, nothing written")
    else:
        tell(f"{name}: {counted(points.count, 'point')}")
    if signals.number is not None:
        raise typer.Exit(128 + signals.number)
