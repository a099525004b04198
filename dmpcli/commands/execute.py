"""``dmpcli execute``: stream a trajectory to the servo interface, after careful checks."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from dmpcli.commands.options import SENSORS, AllowMixed, Quiet, Realtime, Robot
from dmpcli.errors import InputError
from dmpcli.messages import on_terminal
from dmpcli.settings.execute import ExecuteSettings
from dmpcli.settings.options import Given, with_options

if TYPE_CHECKING:
    from dmpcli.admittance.force_coupling import Filter
    from dmpcli.control.cycle import LoopOutcome, ReadyArm
    from dmpcli.control.execution_plan import CheckedPlan
    from dmpcli.control.servo_loop import PlanLoop
    from dmpcli.control.stroke_file import StrokeSelection
    from dmpcli.control.workcell import Workcell
    from dmpcli.kinematics.reachability import Reach
    from dmpcli.records.file_io import Source
    from dmpcli.records.record import Provenance
    from dmpcli.spatial.wrench import Tool
    from dmpcli.workflows.run_output import RunOutput


@with_options
def command(
    *,
    trajectory: Annotated[
        str, typer.Argument(metavar="TRAJECTORY", help="File or batch folder; - is stdin.")
    ],
    output: Annotated[
        str | None,
        typer.Option("-o", "--output", metavar="FILE", help="Run file; - is stdout."),
    ] = None,
    robot: Robot = "mock:",
    sensor: Annotated[
        str | None,
        typer.Option(metavar="URL", help=f"With --coupling force mock: if not given. {SENSORS}"),
    ] = None,
    tool: Annotated[Path | None, typer.Option(metavar="FILE", help="Tool file.")] = None,
    robot_model: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Check the joints of this arm too: ec66."),
    ] = None,
    coupling: Annotated[
        Literal["force"] | None,
        typer.Option(metavar="force", help="Press on the surface, eq. (10)."),
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Only check; print the verdict, send nothing.")
    ] = False,
    stroke_ids: Annotated[
        list[str] | None,
        typer.Option(
            "--id", metavar="ID", help="Which of several strokes, in this order; all by default."
        ),
    ] = None,
    settings: ExecuteSettings,
    given: Given,
    realtime: Realtime = False,
    allow_mixed: AllowMixed = False,
    allow_file_mode: Annotated[
        bool,
        typer.Option(
            "--allow-file-mode",
            help="Let the controller play the plan, though the arm draws on if the link is lost.",
        ),
    ] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing recording.")] = False,
    quiet: Quiet = False,
) -> None:
    """Check a trajectory, then stream it; Ctrl-C decelerates, a second one stops at once."""
    on_terminal(quiet)
    if coupling is None and "force_setpoint" in given:
        raise InputError("--force-setpoint: nothing presses without --coupling force")
    for option in ("max_force", "max_torque"):
        if option in given and sensor is None and coupling is None:
            raise InputError(
                f"--{option.replace('_', '-')}: nothing feels a force without --sensor URL"
            )
    if output is None and not dry_run:
        raise InputError("-o: name the run file, or ask for the checks alone with --dry-run")
    _execute(
        settings,
        ExecutionRequest(
            trajectory=trajectory,
            ids=tuple(stroke_ids or ()),
            output=None if dry_run else output,
            robot=robot,
            sensor=sensor or ("mock:" if coupling else None),
            tool=tool,
            robot_model=robot_model,
            presses=coupling is not None,
            realtime=realtime,
            allow_mixed=allow_mixed,
            allow_file_mode=allow_file_mode,
            force=force,
        ),
    )


@dataclass(frozen=True)
class ExecutionRequest:
    """What the command line asks for beside the settings; no output is a dry run."""

    trajectory: str
    ids: tuple[str, ...]
    output: str | None
    robot: str
    sensor: str | None
    tool: Path | None
    robot_model: str | None
    presses: bool
    realtime: bool
    allow_mixed: bool
    allow_file_mode: bool
    force: bool


def _execute(settings: "ExecuteSettings", request: ExecutionRequest) -> None:
    from dmpcli.control import (
        execution,
        execution_plan,
        guards,
        ownership,
        preflight_table,
        stopping,
        stroke_file,
        workcell,
    )
    from dmpcli.control.cycle import ReadyArm
    from dmpcli.control.watchdog import watched
    from dmpcli.instruments.clock import MonotonicClock, SimulatedClock
    from dmpcli.messages import tell, warn
    from dmpcli.records import file_io
    from dmpcli.workflows.run_output import RunOutput

    addresses = workcell.check(request.robot, request.sensor, request.allow_mixed)
    if request.sensor is not None:
        workcell.need_tool(addresses[1], request.tool is not None)
    repeatable = workcell.repeatable(addresses)
    _check_output(request, repeatable)
    tool_file = _read(request.tool)
    batch = stroke_file.find(request.trajectory, request.ids)
    _warn_of(batch, file_io.shown(request.trajectory))
    coupling = execution.coupling_of(batch, settings) if request.presses else None
    realtime = request.realtime or not repeatable
    clock = MonotonicClock() if realtime else SimulatedClock()
    keeper = None
    if request.output is not None:
        keeper = RunOutput(request.output, realtime)
        keeper.check()
    first = batch.found[0]
    above = first.facts.get("end_heights", (0.0, 0.0))[0]
    scene = execution.scene(first.stroke, request.presses, above)
    # What weighs on the sensor counts only where there is one.
    held = _decoded(tool_file, weighed=request.sensor is not None)
    bench = workcell.connect(
        request.robot,
        request.sensor,
        clock,
        allow_mixed=request.allow_mixed,
        scene=scene,
        tool=held,
    )
    guards.check_playing(bench.robot, request.allow_file_mode or keeper is None)
    if bench.note:
        tell(bench.note)
    robot = watched(bench.robot) if realtime else bench.robot
    lock = ownership.ArmLock(addresses[0], moves=keeper is not None)
    lock.take()
    try:
        arm = ReadyArm(robot, robot.open(), clock)
        lock.require_rest(robot, clock)
        guards.check_period(arm.info, settings.period, f"--period {settings.period:g}")
        if coupling is not None and (late := execution.slowed(arm.info.lookahead)):
            warn(late)
        reach = execution.reach_of(bench.robot, request.robot_model, held)
        judged = _judged(batch, settings, arm, reach, request)
        if keeper is None:
            tell(preflight_table.table(judged))
        execution_plan.refuse_any(judged)
        if keeper is None:
            return
        loop = _loop(bench, arm, judged, settings, request, coupling, tool_file, keeper)
        simulated = bench.simulated or loop.virtual
        provenance = _provenance(settings, request, batch, tool_file, simulated)
        provenance.facts.update(execution.facts_of(arm, coupling, settings))
        outcome = _stream(loop, provenance, realtime, keeper)
    finally:
        closing = guards.leave(robot.close, bench.sensor.close, lock.release)
    with stopping.outranking(lambda: outcome.stop):
        if realtime:
            tell(str(loop.timing))
        if loop.pressing is not None:
            tell(execution.pressed(loop.pressing))
        outcome = outcome.unless(closing)
        if (outcome.failure or outcome.signal) and keeper.kept:
            name = file_io.shown(keeper.output, output=True)
            tell(f"{name}: {len(loop.log)} rows kept")
        left = ""
        if closing is None and execution_plan.lifts(batch, settings):
            left = execution_plan.rest_of(batch, loop.drawn)
        _end(outcome, request, left)


def _warn_of(batch: "StrokeSelection", name: str) -> None:
    """Warn of pairs without trajectory, and of a skill beyond its tolerance."""
    from dmpcli.control import execution_plan
    from dmpcli.messages import warn
    from dmpcli.records import tolerance_mark

    if batch.failed:
        warn(execution_plan.passed_over(batch.failed))
    mark = tolerance_mark.of_facts(batch.found[0].facts)
    if mark is not None:
        warn(tolerance_mark.text(name, mark))


def _judged(
    batch: "StrokeSelection",
    settings: "ExecuteSettings",
    arm: "ReadyArm",
    reach: "Reach | None",
    request: ExecutionRequest,
) -> "list[CheckedPlan]":
    """Plan and check every stroke from where the arm stands."""
    from dmpcli.control import execution_plan
    from dmpcli.messages import progress

    with progress("checking", len(batch.found)) as advance:
        return execution_plan.prepare(batch, settings, arm, request.presses, advance, reach)


def _check_output(request: ExecutionRequest, repeatable: bool) -> None:
    from dmpcli.records import file_io

    if request.output is None:
        return
    file_io.check_writable(request.output)
    if not repeatable and not request.force and Path(request.output).exists():
        raise InputError(
            f"{request.output}: exists, and a run cannot be made again; --force replaces it"
        )


def _read(tool: Path | None) -> "Source | None":
    from dmpcli.records import file_io

    return None if tool is None else file_io.read(tool)


def _decoded(tool_file: "Source | None", weighed: bool = True) -> "Tool | None":
    from dmpcli.records import tool

    if tool_file is None:
        return None
    return tool.decode(tool_file) if weighed else tool.geometry(tool_file)


def _loop(
    bench: "Workcell",
    arm: "ReadyArm",
    judged: "list[CheckedPlan]",
    settings: "ExecuteSettings",
    request: ExecutionRequest,
    coupling: "Filter | None",
    tool_file: "Source | None",
    keeper: "RunOutput",
) -> "PlanLoop":
    """Put the loop together; the sensor streams and its zero is known when it returns."""
    from dmpcli.control import execution
    from dmpcli.control.playback import Playback
    from dmpcli.control.servo_loop import ServoLoop
    from dmpcli.instruments.protocols import PlanPlayer
    from dmpcli.planning.limits import limits_of

    touch, plans = None, [one.plan for one in judged]
    if request.sensor is not None:
        tool = _tool(bench, tool_file)
        # The mock's own tool needs no check; a file's may be another tool's.
        check = None if tool_file is None else settings.tool_check
        touch = execution.touch(bench.sensor, tool, plans[0], settings, arm, coupling, check)
    watch = execution.watch(settings)
    kind = Playback if isinstance(arm.servo, PlanPlayer) else ServoLoop
    return kind(plans[0], limits_of(settings), watch, arm, touch, keeper.hindrance, plans[1:])


def _tool(bench: "Workcell", tool_file: "Source | None") -> "Tool":
    tool = _decoded(tool_file)
    if tool is not None:
        return tool
    if bench.lab is None:
        raise InputError("--sensor: without the mock lab the tool is not known: --tool FILE")
    return bench.lab.scene.tool


def _provenance(
    settings: "ExecuteSettings",
    request: ExecutionRequest,
    batch: "StrokeSelection",
    tool_file: "Source | None",
    simulated: bool,
) -> "Provenance":
    """Return what is known of the run before it is made."""
    from dmpcli.control import execution_plan, workcell
    from dmpcli.records.record import Provenance, input_of

    inputs = list(batch.entries)
    changes = request.sensor is not None or not request.robot.startswith(workcell.MOCK)
    if tool_file is not None and changes:
        inputs.append(input_of("tool", tool_file))
    options = settings.as_options()
    options |= {
        "robot": workcell.in_provenance(request.robot),
        "sensor": workcell.in_provenance(request.sensor),
    }
    options |= {"coupling": "force" if request.presses else None}
    facts: dict[str, Any] = {"simulated": simulated}
    if execution_plan.lifts(batch, settings):
        options["id"] = list(request.ids) or None
        facts |= execution_plan.facts_of(batch)
    else:
        options["id"] = batch.found[0].stroke.id
        facts["trajectory"] = batch.found[0].facts
    return Provenance("execute", options, tuple(inputs), facts)


def _stream(
    loop: "PlanLoop", provenance: "Provenance", realtime: bool, keeper: "RunOutput"
) -> "LoopOutcome":
    """Run the loop and write what it logged, whatever ended it."""
    from dmpcli.control import execution, stopping
    from dmpcli.control.cycle import LoopOutcome
    from dmpcli.control.signals import Interruption
    from dmpcli.messages import tell
    from dmpcli.records.schemas import RUN

    outcome = LoopOutcome("a defect of dmpcli")
    with stopping.outranking(lambda: loop.stop_outcome), Interruption() as interruption:
        keeper.begin(loop.log.rows, RUN, provenance)
        if realtime:
            tell("streaming; Ctrl-C decelerates, a second one stops at once")
        try:
            outcome = loop.run(interruption)
        finally:
            if len(loop.log):
                keeper.keep(
                    execution.record_of(loop, outcome, provenance, realtime), outcome.error()
                )
            else:
                keeper.drop()
    return outcome


def _end(outcome: "LoopOutcome", request: ExecutionRequest, left: str) -> None:
    """Say how the run ended, with the exit code that it earns, and which strokes are left."""
    from dmpcli.messages import tell, warn

    left = left and f"; {left}"
    said, error = outcome.reason + left, outcome.error(after=left)
    if error is not None:
        raise error
    if outcome.signal is not None:
        warn(said)
        raise typer.Exit(128 + outcome.signal)
    tell(f"{request.output}: {said}")
