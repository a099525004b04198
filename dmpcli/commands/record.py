"""``dmpcli record``: drag the tool along a stroke once, and keep what it did."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from dmpcli.commands.options import AllowMixed, Quiet, Realtime, Robot, Sensor
from dmpcli.errors import InputError
from dmpcli.messages import on_terminal, tell, wanted, warn
from dmpcli.settings.options import Given, with_options
from dmpcli.settings.record import ROOM, TUTOR, RecordSettings, check

if TYPE_CHECKING:
    from dmpcli.control.cycle import LoopOutcome
    from dmpcli.control.drag_loop import Recorder
    from dmpcli.records.file_io import Source
    from dmpcli.records.record import Provenance, Record
    from dmpcli.simulation.reference_strokes import Reference


@with_options
def command(
    *,
    output: Annotated[
        str, typer.Option("--output", "-o", metavar="FILE", help="Demonstration; - is stdout.")
    ],
    sensor: Sensor = "mock:",
    robot: Robot = "mock:",
    tool: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Tool file; the mock knows its own.")
    ] = None,
    settings: RecordSettings,
    given: Given,
    realtime: Realtime = False,
    allow_mixed: AllowMixed = False,
    force: Annotated[
        bool, typer.Option("--force", help="Replace a recording from real instruments.")
    ] = False,
    quiet: Quiet = False,
) -> None:
    """Record one stroke that a hand drags the tool along."""
    on_terminal(quiet)
    from dmpcli.control import keyboard, workcell
    from dmpcli.control.cycle import LoopOutcome
    from dmpcli.control.drag_loop import DEFECT, Recorder
    from dmpcli.control.signals import Interruption
    from dmpcli.control.watchdog import watched
    from dmpcli.instruments.clock import MonotonicClock, SimulatedClock
    from dmpcli.records import file_io
    from dmpcli.records import tool as tool_file
    from dmpcli.records.schemas import DEMONSTRATION
    from dmpcli.simulation import reference_strokes, rehearsal
    from dmpcli.simulation.mock import PEN
    from dmpcli.workflows.run_output import RunOutput

    check(settings)
    addresses = workcell.check(robot, sensor, allow_mixed)
    repeatable = workcell.repeatable(addresses)
    _check_tutored(given, all(address.simulated for address in addresses))
    workcell.need_tool(addresses[1], tool is not None)
    realtime = realtime or not repeatable
    if settings.drag == "admittance" and settings.coasting > 1.0:
        tell(f"this tool coasts: M/D = {settings.coasting:g} s; --preset drag is light")
    check_output(output, repeatable, force)
    tool_source = file_io.read(tool) if tool else None
    held = tool_file.decode(tool_source) if tool_source else None
    stroke = reference_strokes.build(settings)
    keeper = RunOutput(output, realtime, replaces=repeatable or force)
    keeper.check()
    clock = MonotonicClock() if realtime else SimulatedClock()
    bench = workcell.connect(
        robot,
        sensor,
        clock,
        allow_mixed=allow_mixed,
        scene=rehearsal.scene(stroke, settings),
        tool=held,
    )
    if bench.note:
        tell(bench.note)
    rehearsed = rehearsal.rehearse(bench.lab, stroke, settings)
    if not realtime and rehearsed.longest == float("inf"):
        raise InputError("--duration: say how long, for in simulated time nobody presses Enter")
    ending = LoopOutcome(DEFECT)
    options = {
        "robot": workcell.in_provenance(robot),
        "sensor": workcell.in_provenance(sensor),
        "realtime": realtime,
    }
    # Beside a real instrument a person draws, and nobody knows what.
    tutored = None if bench.lab is None else stroke
    provenance = _provenance(settings, options, bench.simulated, tool_source, tutored)
    # Entered until the file is there: a signal meanwhile must not cost the recording.
    with Interruption() as signals:
        recorder = Recorder(
            watched(bench.robot) if realtime else bench.robot,
            bench.sensor,
            clock,
            held or PEN.with_zero(None),
            settings,
            rehearsed.longest,
            signals,
            lambda: realtime and keyboard.pressed(),
            rehearsed.begin,
            rehearsed.lead_in,
            keeper.hindrance,
            warn,
        )
        if settings.workspace is None:
            tell(f"stays within {ROOM:g} mm of the start in x, y and z; --workspace says otherwise")
        keeper.begin(recorder.log.rows, DEMONSTRATION, provenance)
        try:
            with _status(realtime and wanted()):
                ending = recorder.run()
        finally:
            if len(recorder.log):
                keeper.keep(_recording(recorder, provenance, ending, realtime), ending.failure)
            else:
                keeper.drop()
    # What was refused before the first row is one line.
    if len(recorder.log) or ending.failure is None:
        if realtime:
            tell(str(recorder.timing))
        tell(_summary(output, recorder, ending))
    if ending.failure is not None:
        raise ending.failure
    if signals.number is not None:
        warn(ending.reason)
        raise typer.Exit(128 + signals.number)


def _check_tutored(given: Given, simulated: bool) -> None:
    """Refuse what only the mock's tutor understands where a person drags a real tool."""
    alone = next((key for key in TUTOR if key in given), None)
    if alone is not None and not simulated:
        raise InputError(
            f"--{alone.replace('_', '-')}: is of the mock's hand, and a person drags a real tool; "
            "leave it out"
        )


def check_output(output: str, repeatable: bool, force: bool) -> None:
    """Refuse an output that cannot be written, or that holds what cannot be recorded again.

    Raises
    ------
    InputError
        Before anything moves.
    """
    from dmpcli.records import file_io

    file_io.check_writable(output)
    if not repeatable and not force and output != file_io.DASH and Path(output).exists():
        raise InputError(
            f"{output}: exists, and a recording cannot be made again; choose another name, or "
            "give --force"
        )


def _status(wanted: bool) -> Any:
    """A line on the terminal while a recording runs in real time."""
    import contextlib
    import sys

    if not wanted or not sys.stderr.isatty():
        return contextlib.nullcontext()
    from rich.console import Console

    return Console(stderr=True).status("recording; Enter ends it")


def _provenance(
    settings: "RecordSettings",
    options: dict[str, Any],
    simulated: bool,
    tool: "Source | None",
    tutored: "Reference | None",
) -> "Provenance":
    """Return what is known of the recording before it is made; of the stroke only by the tutor."""
    from dmpcli.records.record import Provenance, input_of

    settled = settings.as_options()
    facts: dict[str, Any] = {"simulated": simulated}
    sources = [("tool", tool)]
    if tutored is None:
        settled = {key: value for key, value in settled.items() if key not in TUTOR}
    else:
        facts["reference"] = tutored.facts
        # The reference's name may be a path; what it holds stands in the inputs.
        settled["reference"] = tutored.facts["shape"]
        sources.append(("reference", tutored.source))
    inputs = tuple(input_of(role, source) for role, source in sources if source)
    return Provenance("record", options | settled, inputs, facts)


def _recording(
    recorder: "Recorder", known: "Provenance", ending: "LoopOutcome", realtime: bool
) -> "Record":
    """Return the recording; how punctual it was is a fact only where a clock ran."""
    from dataclasses import replace

    from dmpcli.records.record import Record
    from dmpcli.records.schemas import DEMONSTRATION

    facts = known.facts | {"ended": ending.reason} | (recorder.timing.facts() if realtime else {})
    if recorder.sensor_info.virtual:
        facts["simulated"] = True
    return Record(DEMONSTRATION, recorder.log.columns(), replace(known, facts=facts))


def _summary(output: str, recorder: "Recorder", ending: "LoopOutcome") -> str:
    endings = {
        "duration": "its time was over",
        "rest": "the tool came to rest",
        "asked": "it was asked to end",
    }
    name = "standard output" if output == "-" else output
    unless = "an instrument or a limit stopped it" if ending.failure else "a signal came"
    why = endings.get(ending.reason, unless)
    log = recorder.log
    return f"{name}: {len(log)} rows, {log.duration:.2f} s; ended because {why}"
