"""``dmpcli execute``: stream a trajectory to the servo interface, after careful checks."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from dmpcli.errors import InputError

if TYPE_CHECKING:
    from dmpcli.instruments.urls import Bench
    from dmpcli.primitives.coupling import Filter
    from dmpcli.primitives.wrench import Tool
    from dmpcli.records.record import Provenance
    from dmpcli.records.streams import Source
    from dmpcli.streaming.loop import Arm, Loop, Outcome
    from dmpcli.streaming.plan import Plan
    from dmpcli.streaming.settings import ExecuteSettings
    from dmpcli.streaming.stroke_file import Found

Box = tuple[float, float, float, float, float, float]


def command(
    trajectory: Annotated[
        str, typer.Argument(metavar="TRAJECTORY", help="File or batch folder; - is stdin.")
    ],
    output: Annotated[
        str | None,
        typer.Option("-o", "--output", metavar="RUN", help="Run file; - is stdout."),
    ] = None,
    robot: Annotated[str, typer.Option(metavar="URL", help="The arm.")] = "mock:",
    sensor: Annotated[
        str | None,
        typer.Option(metavar="URL", help="Force sensor; with --coupling force mock: if not given."),
    ] = None,
    tool: Annotated[Path | None, typer.Option(metavar="FILE", help="Tool file.")] = None,
    coupling: Annotated[
        Literal["force"] | None, typer.Option(help="Press on the surface, eq. (10).")
    ] = None,
    force_setpoint: Annotated[
        float | None, typer.Option(metavar="N", help="Force to press with (5).")
    ] = None,
    speed: Annotated[
        float | None, typer.Option(metavar="F", help="1 as planned, 0.5 at half the speed.")
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Only check; print the verdict, send nothing.")
    ] = False,
    stroke_id: Annotated[
        str | None, typer.Option("--id", metavar="ID", help="Which of several strokes.")
    ] = None,
    period: Annotated[
        float | None, typer.Option(metavar="S", help="Servo period, 0.02 s by default.")
    ] = None,
    approach: Annotated[
        float | None,
        typer.Option(metavar="MM_PER_S", help="Go straight to the start, no faster than this."),
    ] = None,
    start_tolerance: Annotated[
        float | None, typer.Option(metavar="MM", help="How far off the start the arm may stand.")
    ] = None,
    workspace: Annotated[
        Box | None,
        typer.Option(metavar="XMIN XMAX YMIN YMAX ZMIN ZMAX", help="Box to stay in, mm."),
    ] = None,
    max_speed: Annotated[float | None, typer.Option(metavar="MM_PER_S")] = None,
    max_acceleration: Annotated[float | None, typer.Option(metavar="MM_PER_S2")] = None,
    max_jerk: Annotated[float | None, typer.Option(metavar="MM_PER_S3")] = None,
    max_rotation_speed: Annotated[float | None, typer.Option(metavar="RAD_PER_S")] = None,
    max_rotation_acceleration: Annotated[float | None, typer.Option(metavar="RAD_PER_S2")] = None,
    max_rotation_jerk: Annotated[float | None, typer.Option(metavar="RAD_PER_S3")] = None,
    following_error: Annotated[
        float | None, typer.Option(metavar="MM", help="Stop when the arm strays further.")
    ] = None,
    max_force: Annotated[
        float | None, typer.Option(metavar="N", help="Stop at a larger force on the tool.")
    ] = None,
    realtime: Annotated[
        bool, typer.Option("--realtime", help="Pace the mock by the real clock.")
    ] = False,
    allow_mixed: Annotated[
        bool, typer.Option("--allow-mixed", help="A real instrument beside a mock one.")
    ] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing recording.")] = False,
    preset: Annotated[
        str | None, typer.Option(metavar="NAME|FILE.toml", help="[execute] section.")
    ] = None,
    config: Annotated[
        Path | None, typer.Option(metavar="FILE.toml", help="Beats the preset.")
    ] = None,
    quiet: Annotated[bool, typer.Option("-q", "--quiet", help="No messages.")] = False,
) -> None:
    """Check a trajectory, then stream it; Ctrl-C decelerates, a second one stops at once."""
    from dmpcli.records.settings import resolve
    from dmpcli.streaming.settings import ExecuteSettings

    given = {
        "force_setpoint": force_setpoint,
        "speed": speed,
        "period": period,
        "approach": approach,
        "start_tolerance": start_tolerance,
        "workspace": workspace,
        "max_speed": max_speed,
        "max_acceleration": max_acceleration,
        "max_jerk": max_jerk,
        "max_rotation_speed": max_rotation_speed,
        "max_rotation_acceleration": max_rotation_acceleration,
        "max_rotation_jerk": max_rotation_jerk,
        "following_error": following_error,
        "max_force": max_force,
    }
    settings = resolve(ExecuteSettings, "execute", given, preset, config)
    if coupling is None and force_setpoint is not None:
        raise InputError("--force-setpoint: nothing presses without --coupling force")
    if max_force is not None and sensor is None and coupling is None:
        raise InputError("--max-force: nothing feels a force without --sensor URL")
    if output is None and not dry_run:
        raise InputError("-o: name the run file, or ask for the checks alone with --dry-run")
    _execute(
        settings,
        Request(
            trajectory=trajectory,
            stroke_id=stroke_id,
            output=None if dry_run else output,
            robot=robot,
            sensor=sensor or ("mock:" if coupling else None),
            tool=tool,
            presses=coupling is not None,
            realtime=realtime,
            allow_mixed=allow_mixed,
            force=force,
            quiet=quiet,
        ),
    )


@dataclass(frozen=True)
class Request:
    """What the command line asks for beside the settings; no output is a dry run."""

    trajectory: str
    stroke_id: str | None
    output: str | None
    robot: str
    sensor: str | None
    tool: Path | None
    presses: bool
    realtime: bool
    allow_mixed: bool
    force: bool
    quiet: bool


def _execute(settings: "ExecuteSettings", request: Request) -> None:
    from dmpcli.commands.messages import tell
    from dmpcli.instruments import guards, urls
    from dmpcli.instruments.clock import MonotonicClock, SimulatedClock
    from dmpcli.streaming import preflight, session, stroke_file, verdict
    from dmpcli.streaming.loop import Arm

    sensor = request.sensor or urls.MOCK
    addresses = urls.check(request.robot, sensor, request.allow_mixed)
    if request.sensor is not None:
        urls.need_tool(addresses[1], request.tool is not None)
    repeatable = urls.repeatable(addresses)
    _check_output(request, repeatable)
    tool_file = _read(request.tool)
    found = stroke_file.find(request.trajectory, request.stroke_id)
    coupling = None
    if request.presses:
        coupling = session.coupling_filter(found.stroke, found.facts, settings)
    realtime = request.realtime or not repeatable
    clock = MonotonicClock() if realtime else SimulatedClock()
    scene = session.scene(found.stroke, request.presses)
    bench = urls.connect(request.robot, sensor, clock, allow_mixed=request.allow_mixed, scene=scene)
    try:
        arm = Arm(bench.robot, bench.robot.open(), clock)
        session.check_period(arm, settings.period)
        plan, checks = session.prepare(found.stroke, settings, bench.robot.state())
        if request.output is None:
            tell(verdict.table(plan, checks), request.quiet)
        preflight.refuse_any(checks)
        if request.output is None:
            return
        loop = _loop(bench, arm, plan, settings, request, coupling, tool_file)
        provenance = _provenance(settings, request, found, coupling, tool_file, bench.simulated)
        outcome = _stream(loop, provenance, request, realtime)
    finally:
        closing = guards.leave(bench.robot.close, bench.sensor.close)
    if closing is not None and outcome.error is None:
        raise closing
    _end(outcome, request)


def _check_output(request: Request, repeatable: bool) -> None:
    from dmpcli.records import streams

    if request.output is None:
        return
    streams.check_writable(request.output)
    if not repeatable and not request.force and Path(request.output).exists():
        raise InputError(
            f"{request.output}: exists, and a run cannot be made again; --force replaces it"
        )


def _read(tool: Path | None) -> "Source | None":
    from dmpcli.records import streams

    return None if tool is None else streams.read(tool)


def _loop(
    bench: "Bench",
    arm: "Arm",
    plan: "Plan",
    settings: "ExecuteSettings",
    request: Request,
    coupling: "Filter | None",
    tool_file: "Source | None",
) -> "Loop":
    """Put the loop together; the sensor streams and its zero is known when it returns."""
    from dmpcli.streaming import session
    from dmpcli.streaming.loop import Loop

    touch = None
    if request.sensor is not None:
        tool = _tool(bench, tool_file)
        touch = session.touch(bench.sensor, tool, plan, settings, arm.clock, coupling)
    return Loop(plan, settings.limits, session.watch(settings), arm, touch)


def _tool(bench: "Bench", tool_file: "Source | None") -> "Tool":
    from dmpcli.records import tool

    if tool_file is not None:
        return tool.decode(tool_file)
    if bench.lab is None:
        raise InputError("--sensor: without the mock lab the tool is not known: --tool FILE")
    return bench.lab.scene.tool


def _provenance(
    settings: "ExecuteSettings",
    request: Request,
    found: "Found",
    coupling: "Filter | None",
    tool_file: "Source | None",
    simulated: bool,
) -> "Provenance":
    """Return what is known of the run before it is made."""
    from dmpcli.instruments import urls
    from dmpcli.records.record import Provenance, input_of
    from dmpcli.streaming import session

    inputs = [input_of("trajectory", found.source)]
    if tool_file is not None and request.sensor is not None:
        inputs.append(input_of("tool", tool_file))
    options = settings.model_dump(mode="json")
    options |= {
        "robot": urls.in_provenance(request.robot),
        "sensor": urls.in_provenance(request.sensor),
    }
    options |= {"id": found.stroke.id, "coupling": "force" if request.presses else None}
    facts = {"simulated": simulated, "trajectory": found.facts}
    if coupling is not None:
        facts["coupling"] = session.facts_of(coupling)
    return Provenance("execute", options, tuple(inputs), facts)


def _stream(loop: "Loop", provenance: "Provenance", request: Request, realtime: bool) -> "Outcome":
    """Run the loop and write what it logged, whatever ended it."""
    from dmpcli.commands.messages import tell
    from dmpcli.instruments.interruption import Interruption
    from dmpcli.records import record, streams
    from dmpcli.streaming import session
    from dmpcli.streaming.loop import Outcome

    outcome = Outcome("a defect of dmpcli")
    with Interruption() as interruption:
        if realtime:
            tell("streaming; Ctrl-C decelerates, a second one stops at once", request.quiet)
        try:
            outcome = loop.run(interruption)
        finally:
            if loop.log.rows:
                run = session.record_of(loop, outcome, provenance, realtime)
                streams.write(str(request.output), record.encode(run))
    return outcome


def _end(outcome: "Outcome", request: Request) -> None:
    """Say how the run ended, with the exit code that it earns."""
    from dmpcli.commands.messages import tell, warn

    if outcome.error is not None:
        raise outcome.error(outcome.reason)
    if outcome.signal is not None:
        warn(outcome.reason)
        raise typer.Exit(128 + outcome.signal)
    missed = f", {outcome.missed} deadlines missed" if outcome.missed else ""
    tell(f"{request.output}: {outcome.reason}{missed}", request.quiet)
