"""``dmpcli record``: drag the tool along a stroke once, and keep what it did."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from dmpcli.commands.messages import tell
from dmpcli.errors import InputError

if TYPE_CHECKING:
    from dmpcli.drag.loop import Ending, Recorder
    from dmpcli.drag.settings import RecordSettings
    from dmpcli.records.streams import Source

Box = tuple[float, float, float, float, float, float]


def command(
    output: Annotated[str, typer.Option("--output", "-o", help="Demonstration; - is stdout.")],
    sensor: Annotated[str, typer.Option(metavar="URL", help="mock: for now.")] = "mock:",
    robot: Annotated[str, typer.Option(metavar="URL", help="mock: for now.")] = "mock:",
    tool: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Tool file; the mock knows its own.")
    ] = None,
    drag: Annotated[
        str | None, typer.Option(metavar="admittance|builtin", help="Who moves the arm.")
    ] = None,
    preset: Annotated[
        str, typer.Option(metavar="NAME|FILE.toml", help="drag, paper, or your own.")
    ] = "drag",
    config: Annotated[Path | None, typer.Option(help="TOML that beats the preset.")] = None,
    duration: Annotated[float | None, typer.Option(help="End after so many s.")] = None,
    until_rest: Annotated[
        float | None, typer.Option(help="End once the tool has moved and rested for so many s.")
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Of the mock's hand and sensor.")] = None,
    reference: Annotated[
        str | None,
        typer.Option(metavar="sine|line|circle|FILE.csv", help="What the mock tutor draws."),
    ] = None,
    start: Annotated[
        tuple[float, float, float] | None, typer.Option(metavar="X Y Z", help="Of it, mm.")
    ] = None,
    goal: Annotated[
        tuple[float, float, float] | None, typer.Option(metavar="X Y Z", help="Of it, mm.")
    ] = None,
    wave_height: Annotated[
        float | None, typer.Option(help="Of the sine, peak to trough, mm.")
    ] = None,
    periods: Annotated[float | None, typer.Option(help="Of the sine.")] = None,
    following_error: Annotated[
        float | None, typer.Option(metavar="MM", help="Stop when the arm strays further.")
    ] = None,
    workspace: Annotated[
        Box | None,
        typer.Option(metavar="XMIN XMAX YMIN YMAX ZMIN ZMAX", help="Box to stay in, mm."),
    ] = None,
    realtime: Annotated[bool, typer.Option("--realtime", help="Pace the mock.")] = False,
    allow_mixed: Annotated[
        bool, typer.Option("--allow-mixed", help="Let a real instrument stand beside a mock one.")
    ] = False,
    force: Annotated[
        bool, typer.Option("--force", help="Replace a recording from real instruments.")
    ] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Say nothing.")] = False,
) -> None:
    """Record one stroke that a hand drags the tool along."""
    from dmpcli.drag import enter, references, rehearsal
    from dmpcli.drag.loop import DEFECT, Ending, Recorder
    from dmpcli.drag.settings import RecordSettings, check
    from dmpcli.instruments import urls
    from dmpcli.instruments.clock import MonotonicClock, SimulatedClock
    from dmpcli.instruments.interruption import Interruption
    from dmpcli.instruments.mock import PEN
    from dmpcli.records import settings as layers
    from dmpcli.records import streams
    from dmpcli.records import tool as tool_file

    given = {
        "drag": drag,
        "duration": duration,
        "until_rest": until_rest,
        "seed": seed,
        "reference": reference,
        "start": start,
        "goal": goal,
        "wave_height": wave_height,
        "periods": periods,
        "following_error": following_error,
        "workspace": workspace,
    }
    settings = layers.resolve(RecordSettings, "record", given, preset, config)
    check(settings)
    addresses = urls.check(robot, sensor, allow_mixed)
    urls.need_tool(addresses[1], tool is not None)
    repeatable = urls.repeatable(addresses)
    realtime = realtime or not repeatable
    if settings.drag == "admittance" and settings.coasting > 1.0:
        tell(f"this tool coasts: M/D = {settings.coasting:g} s; --preset drag is light", quiet)
    check_output(output, repeatable, force)
    tool_source = streams.read(tool) if tool else None
    stroke = references.build(settings)
    clock = MonotonicClock() if realtime else SimulatedClock()
    bench = urls.connect(
        robot, sensor, clock, allow_mixed=allow_mixed, scene=rehearsal.scene(stroke, settings)
    )
    rehearsed = rehearsal.rehearse(bench.lab, stroke, settings)
    ending = Ending(DEFECT)
    # Entered until the file is there: a signal meanwhile must not cost the recording.
    with Interruption() as signals:
        recorder = Recorder(
            bench.robot,
            bench.sensor,
            clock,
            tool_file.decode(tool_source) if tool_source else PEN.with_zero(None),
            settings,
            rehearsed.longest,
            signals,
            lambda: realtime and enter.pressed(),
            rehearsed.begin,
            rehearsed.lead_in,
        )
        try:
            with _status(realtime and not quiet):
                ending = recorder.run()
        finally:
            if len(recorder.log):
                options = {
                    "robot": urls.in_provenance(robot),
                    "sensor": urls.in_provenance(sensor),
                    "realtime": realtime,
                }
                facts = {
                    "simulated": bench.simulated,
                    "reference": stroke.facts,
                    "ended": ending.reason,
                }
                content = _file(recorder, settings, options, facts, tool_source, stroke.source)
                streams.write(output, content)
    tell(_summary(output, recorder, ending), quiet)
    if ending.failure is not None:
        raise ending.failure
    if signals.number is not None:
        raise typer.Exit(128 + signals.number)


def check_output(output: str, repeatable: bool, force: bool) -> None:
    """Refuse an output that cannot be written, or that holds what cannot be recorded again.

    Raises
    ------
    InputError
        Before anything moves.
    """
    from dmpcli.records import streams

    streams.check_writable(output)
    if not repeatable and not force and output != streams.DASH and Path(output).exists():
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


def _file(
    recorder: "Recorder",
    settings: "RecordSettings",
    options: dict[str, Any],
    facts: dict[str, Any],
    tool: "Source | None",
    reference: "Source | None",
) -> bytes:
    from dmpcli.records.record import Provenance, Record, encode, input_of
    from dmpcli.records.schemas import DEMONSTRATION

    settled = settings.model_dump(mode="json")
    # The reference's name may be a path; what it holds stands in the inputs.
    settled["reference"] = facts["reference"]["shape"]
    sources = [("tool", tool), ("reference", reference)]
    provenance = Provenance(
        "record",
        options=options | settled,
        inputs=tuple(input_of(role, source) for role, source in sources if source),
        facts=facts,
    )
    return encode(Record(DEMONSTRATION, recorder.log.columns(), provenance))


def _summary(output: str, recorder: "Recorder", ending: "Ending") -> str:
    endings = {
        "duration": "its time was over",
        "rest": "the tool came to rest",
        "asked": "it was asked to end",
    }
    name = "standard output" if output == "-" else output
    late = f", {ending.missed} cycles missed" if ending.missed else ""
    why = endings.get(ending.reason, "an instrument failed")
    log = recorder.log
    return f"{name}: {len(log)} rows, {log.duration:.2f} s{late}; ended because {why}"
