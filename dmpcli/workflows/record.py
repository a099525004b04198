"""`record`: one stroke that a hand drags the tool along, on the mock or on real instruments."""

from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from dmpcli.control import keyboard, ownership, stopping, watching, workcell
from dmpcli.control.cycle import LoopOutcome
from dmpcli.control.drag_loop import DEFECT, Recorder
from dmpcli.control.watchdog import watched
from dmpcli.errors import InputError
from dmpcli.instruments import clock as clocks
from dmpcli.messages import tell, warn
from dmpcli.records import file_io, suffixes
from dmpcli.records import tool as tool_file
from dmpcli.records.file_io import Source
from dmpcli.records.record import Provenance, Record, input_of
from dmpcli.records.schemas import DEMONSTRATION
from dmpcli.settings.record import ROOM, TUTOR, RecordSettings, check
from dmpcli.simulation import reference_strokes, rehearsal
from dmpcli.simulation.mock import PEN
from dmpcli.simulation.reference_strokes import Reference
from dmpcli.workflows.run_output import (
    FinishedRun,
    RunOutput,
    interruptible,
    refuse_replacing,
)
from dmpcli.workflows.told_later import LaterTeller


@dataclass(frozen=True)
class RecordingRequest:
    """What is asked for beside the settings.

    Attributes
    ----------
    output : str or None
        A file's name or ``-``; None keeps it in memory, which is refused of real instruments.
    sensor, robot : str
        URLs.
    tool : Path, optional
        Tool file; the mock knows its own.
    realtime : bool
        Pace the mock by the real clock.
    allow_mixed : bool
        Let a real instrument stand beside a mock one.
    force : bool
        Replace a recording from real instruments.
    """

    output: str | None
    sensor: str = workcell.MOCK
    robot: str = workcell.MOCK
    tool: Path | None = None
    realtime: bool = False
    allow_mixed: bool = False
    force: bool = False


def record(
    settings: RecordSettings, request: RecordingRequest, said: Mapping[str, Any]
) -> FinishedRun:
    """Record one stroke, write it where a file is named, and tell how it went.

    Parameters
    ----------
    settings : RecordSettings
    request : RecordingRequest
    said : mapping
        Those of the settings that the caller named.

    Raises
    ------
    InputError
        Something is wrong with what was asked for; nothing has moved.
    InstrumentError, RefusedError
        An instrument or a limit ended it; what was recorded until then is kept.
    """
    check(settings)
    addresses = workcell.check(request.robot, request.sensor, request.allow_mixed)
    repeatable = workcell.repeatable(addresses)
    _check_tutored(said, all(address.simulated for address in addresses))
    workcell.need_tool(addresses[1], request.tool is not None)
    realtime = request.realtime or not repeatable
    if settings.drag == "admittance" and settings.coasting > 1.0:
        tell(f"this tool coasts: M/D = {settings.coasting:g} s; --preset drag is light")
    check_output(request.output, repeatable, request.force)
    tool_source = None if request.tool is None else file_io.read(request.tool)
    held = None if tool_source is None else tool_file.decode(tool_source)
    stroke = reference_strokes.build(settings)
    keeper = RunOutput(request.output, realtime, repeatable or request.force)
    keeper.check()
    clock = clocks.MonotonicClock() if realtime else clocks.SimulatedClock()
    bench = workcell.connect(
        request.robot,
        request.sensor,
        clock,
        allow_mixed=request.allow_mixed,
        scene=rehearsal.scene(stroke, settings),
        tool=held,
    )
    if bench.note:
        tell(bench.note)
    rehearsed = rehearsal.rehearse(bench.lab, stroke, settings)
    if not realtime and rehearsed.longest == float("inf"):
        raise InputError("--duration: say how long, for in simulated time nobody presses Enter")
    outcome, made = LoopOutcome(DEFECT), None
    options = {
        "robot": workcell.in_provenance(request.robot),
        "sensor": workcell.in_provenance(request.sensor),
        "realtime": realtime,
    }
    # Beside a real instrument a person draws, and nobody knows what.
    tutored = None if bench.lab is None else stroke
    provenance = provenance_of(settings, options, bench.simulated, tool_source, tutored)
    # Entered until the file is there: a signal meanwhile must not cost the recording.
    with (
        ownership.ArmLock(addresses[0]) as lock,
        interruptible(realtime) as signals,
        closing(LaterTeller(realtime)) as teller,
    ):
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
            lock.shared,
            teller.say,
        )
        if settings.workspace is None:
            tell(f"stays within {ROOM:g} mm of the start in x, y and z; --workspace says otherwise")
        keeper.begin(recorder.log.rows, DEMONSTRATION, provenance)
        with stopping.outranking(lambda: recorder.stop_outcome):
            try:
                if realtime:
                    tell("recording; Enter ends it")
                with watching.live(lambda: _view(recorder, settings), realtime) as ended:
                    outcome = recorder.run()
                    ended(_ending(outcome))
            finally:
                if len(recorder.log):
                    made = _recording(recorder, provenance, outcome, realtime)
                    keeper.keep(made, outcome.error())
                else:
                    keeper.drop()
    with stopping.outranking(lambda: outcome.stop):
        # What was refused before the first row is one line.
        if made is not None or outcome.failure is None:
            if realtime:
                tell(str(recorder.timing))
            tell(_summary(keeper.output, recorder, outcome))
        if (error := outcome.error()) is not None:
            raise error
    if signals.number is not None:
        warn(outcome.reason)
    return FinishedRun(made, signals.number, outcome.reason)


def _check_tutored(said: Mapping[str, Any], simulated: bool) -> None:
    """Refuse what only the mock's tutor understands where a person drags a real tool."""
    alone = next((key for key in TUTOR if key in said), None)
    if alone is not None and not simulated:
        raise InputError(
            f"--{alone.replace('_', '-')}: is of the mock's hand, and a person drags a real tool; "
            "leave it out"
        )


def check_output(output: str | None, repeatable: bool, force: bool) -> None:
    """Refuse an output that cannot be written, or that holds what cannot be recorded again.

    Parameters
    ----------
    output : str or None
        A file's name, or ``-``; None: the recording stays in memory.
    repeatable : bool
        Whether the same command records the same again, as in simulated time.
    force : bool
        Whether a file of that name may be lost.

    Raises
    ------
    InputError
        Before anything moves.
    """
    if output is not None:
        suffixes.check(output, suffixes.PARQUET)
        file_io.check_writable(output, here=True)
    refuse_replacing(output, repeatable, force, "a recording cannot be made again")


def provenance_of(
    settings: RecordSettings,
    options: dict[str, Any],
    simulated: bool,
    tool: Source | None,
    tutored: Reference | None,
) -> Provenance:
    """Return what is known of the recording before it is made; of the stroke only by the tutor.

    Parameters
    ----------
    settings : RecordSettings
    options : dict
        Those that only the command knows: which instruments.
    simulated : bool
    tool : Source or None
        Of the tool file.
    tutored : Reference or None
        What the simulated hand draws; without it the tutor's settings are left out.
    """
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
    recorder: Recorder, known: Provenance, outcome: LoopOutcome, realtime: bool
) -> Record:
    """Return the recording; how punctual it was is a fact only where a clock ran."""
    facts = known.facts | {"ended": outcome.reason} | (recorder.timing.facts() if realtime else {})
    facts |= recorder.stop_outcome.facts()
    if recorder.chatter.alarms:
        facts["chatter"] = recorder.chatter.alarms
    if recorder.sensor_info.virtual:
        facts["simulated"] = True
    return Record(DEMONSTRATION, recorder.log.columns(), replace(known, facts=facts))


def _view(recorder: Recorder, settings: RecordSettings) -> watching.RunView:
    """What is seen of a recording while it goes on; of its end only what a duration says."""
    period = 1.0 / settings.control_rate
    return watching.RunView("recording", recorder.log.rows, period, settings.duration)


def _ending(outcome: LoopOutcome) -> str:
    endings = {
        "duration": "its time was over",
        "rest": "the tool came to rest",
        "asked": "it was asked to end",
    }
    unless = "an instrument or a limit stopped it" if outcome.failure else "a signal came"
    return endings.get(outcome.reason, unless)


def _summary(output: str | None, recorder: Recorder, outcome: LoopOutcome) -> str:
    name = "recording" if output is None else file_io.shown(output, output=True)
    log = recorder.log
    return f"{name}: {len(log)} rows, {log.duration:.2f} s; ended because {_ending(outcome)}"
