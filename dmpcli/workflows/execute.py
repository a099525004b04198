"""`execute`: check trajectories, then stream them, to the mock or to a real arm."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dmpcli.control import (
    execution,
    execution_plan,
    guards,
    outputs,
    ownership,
    preflight_table,
    stopping,
    watching,
    workcell,
)
from dmpcli.control.cycle import LoopOutcome, ReadyArm
from dmpcli.control.execution_plan import CheckedPlan
from dmpcli.control.servo_loop import PlanLoop, ServoLoop
from dmpcli.control.workcell import Workcell
from dmpcli.errors import InputError
from dmpcli.instruments import clock as clocks
from dmpcli.instruments.protocols import OutputSwitching, PlanPlayer
from dmpcli.messages import progress, tell, warn
from dmpcli.planning.limits import limits_of
from dmpcli.records import file_io, stroke_selection, suffixes, tolerance_mark
from dmpcli.records.file_io import Source
from dmpcli.records.record import Provenance, Record, input_of
from dmpcli.records.schemas import RUN
from dmpcli.records.stroke_selection import StrokeSelection
from dmpcli.settings.execute import ExecuteSettings
from dmpcli.spatial.wrench import Tool
from dmpcli.workflows import moving_goals
from dmpcli.workflows.run_output import (
    FinishedRun,
    RunOutput,
    interruptible,
    refuse_replacing,
)
from dmpcli.workflows.told_later import LaterTeller

if TYPE_CHECKING:  # loaded where it is asked for
    from dmpcli.admittance.force_coupling import Filter
    from dmpcli.control.goal_following import GoalFollower
    from dmpcli.kinematics.reachability import Reach


@dataclass(frozen=True)
class ExecutionRequest:
    """What is asked for beside the settings.

    Attributes
    ----------
    trajectory : str or Source
        A trajectory file, the folder of a batch, or ``-``; or the content of a file.
    ids : tuple of str
        Which of several strokes, in this order; all by default.
    output : str or None
        A file's name or ``-``; None keeps the run in memory, which is refused of real instruments.
    robot : str
        URL.
    sensor : str or None
        URL; None where nothing feels a force.
    tool : Path or None
        Tool file.
    robot_model : str or None
        The arm whose joints are checked too.
    presses : bool
        Whether the force coupling, eq. (10), is on.
    realtime : bool
        Pace the mock by the real clock.
    allow_mixed : bool
        Let a real instrument stand beside a mock one.
    force : bool
        Replace an existing run.
    dry_run : bool
        Check, and move nothing.
    allow_file_mode : bool
        Let the controller play the plan, though the arm draws on if the link is lost.
    ignore_events : bool
        Draw without switching the outputs that the file asks for.
    goal_from : str or None
        A file of goals over time or a URL to listen on, where the goal may move.
    """

    trajectory: str | Source
    ids: tuple[str, ...] = ()
    output: str | None = None
    robot: str = workcell.MOCK
    sensor: str | None = None
    tool: Path | None = None
    robot_model: str | None = None
    presses: bool = False
    realtime: bool = False
    allow_mixed: bool = False
    force: bool = False
    dry_run: bool = False
    allow_file_mode: bool = False
    ignore_events: bool = False
    goal_from: str | None = None


@dataclass(frozen=True)
class Execution:
    """What came of it.

    Attributes
    ----------
    checked : list of CheckedPlan
        Each stroke as planned, with its checks.
    run : FinishedRun or None
        None of a dry run.
    """

    checked: list[CheckedPlan]
    run: FinishedRun | None


def check_said(said: Mapping[str, Any], feels: bool, presses: bool) -> None:
    """Refuse options that say nothing without one another.

    Parameters
    ----------
    said : mapping
        Settings that the caller named.
    feels : bool
        Whether a sensor is named.
    presses : bool
        Whether the force coupling is on.

    Raises
    ------
    InputError
        Names the options.
    """
    for option in (
        "force_setpoint",
        "stiffness",
        "delay",
        "on_contact_loss",
        "min_contact",
        "normal_from_force",
    ):
        if option in said and not presses:
            raise InputError(
                f"--{option.replace('_', '-')}: nothing presses without --coupling force"
            )
    for option in ("max_force", "max_torque"):
        if option in said and not (feels or presses):
            raise InputError(
                f"--{option.replace('_', '-')}: nothing feels a force without --sensor URL"
            )


def execute(settings: ExecuteSettings, request: ExecutionRequest) -> Execution:
    """Check all strokes, stream them unless it is a dry run, and tell how it went.

    Raises
    ------
    InputError
        Something is wrong with what was asked for; nothing has moved.
    RefusedError, InstrumentError
        A check failed; or a limit or an instrument ended the run, and what was logged is kept.
    """
    addresses = workcell.check(request.robot, request.sensor, request.allow_mixed)
    if request.sensor is not None:
        workcell.need_tool(addresses[1], request.tool is not None)
    repeatable = workcell.repeatable(addresses)
    check_output(request, repeatable)
    tool_file = None if request.tool is None else file_io.read(request.tool)
    batch = _found(request)
    moving = moving_goals.wanted(request.goal_from, batch, settings)
    _warn_of(batch, _name(request.trajectory))
    # What weighs on the sensor counts only where there is one.
    held = _decoded(tool_file, weighed=request.sensor is not None)
    first = batch.strokes[0]
    above = first.facts.get("end_heights", (0.0, 0.0))[0]
    scene = execution.scene(first, request.presses, above)
    weight = (held or scene.tool).weight
    coupling = None
    if request.presses:
        from dmpcli.control import force_execution

        coupling = force_execution.coupling_of(batch, settings, weight)
    realtime = request.realtime or not repeatable
    clock = clocks.MonotonicClock() if realtime else clocks.SimulatedClock()
    keeper = None
    if not request.dry_run:
        keeper = RunOutput(request.output, realtime, repeatable or request.force)
        keeper.check()
    bench = workcell.connect(
        request.robot,
        request.sensor,
        clock,
        allow_mixed=request.allow_mixed,
        scene=scene,
        tool=held,
    )
    guards.check_playing(bench.robot, request.allow_file_mode or keeper is None)
    moving.check_streams(bench.robot)
    outputs.check(bench.robot, outputs.names_of(batch.strokes))
    if bench.note:
        tell(bench.note)
    robot = bench.robot
    if realtime:
        from dmpcli.control.watchdog import watched

        robot = watched(robot)
    lock = ownership.ArmLock(addresses[0], moves=keeper is not None)
    lock.take()
    waits = request.presses or request.goal_from is not None
    teller = LaterTeller(realtime and waits and keeper is not None)
    try:
        arm = ReadyArm(robot, robot.open(), clock).as_told()
        lock.require_rest(robot, clock)
        guards.check_period(arm.info, settings.period, f"--period {settings.period:g}")
        if coupling is not None and (late := force_execution.slowed(arm.info.lookahead)):
            warn(late)
        reach = execution.reach_of(bench.robot, request.robot_model, held)
        judged = _judged(batch, settings, arm, reach, request)
        if keeper is None:
            tell(preflight_table.table(judged), preflight_table.facts(judged))
        execution_plan.refuse_any(judged)
        if keeper is None:
            return Execution(judged, None)
        moving.open()
        loop = _loop(
            bench,
            arm,
            judged,
            settings,
            request,
            coupling,
            tool_file,
            keeper,
            batch,
            teller,
            moving.follower(judged[0].plan, settings, reach, teller.say),
        )
        simulated = bench.simulated or loop.virtual
        provenance = _provenance(settings, request, batch, tool_file, simulated)
        provenance = moving.noted(provenance)
        provenance.facts.update(execution.facts_of(arm, coupling))
        outcome, made = _stream(loop, provenance, realtime, keeper, reach)
    finally:
        moving.close()
        closing = guards.leave(robot.close, bench.sensor.close, lock.release, teller.close)
    with stopping.outranking(lambda: outcome.stop):
        _tell_of(loop, realtime)
        outcome = outcome.unless(closing)
        if (outcome.failure or outcome.signal) and keeper.kept:
            tell(f"{_output(keeper.output)}: {len(loop.log)} rows kept")
        left = ""
        if closing is None and execution_plan.lifts(batch, settings):
            left = execution_plan.rest_of(batch, loop.drawn)
        return Execution(judged, _finished(outcome, made, request, left))


def _tell_of(loop: PlanLoop, realtime: bool) -> None:
    """Say how punctual the loop was, how hard it pressed and what goals it followed."""
    if realtime:
        tell(str(loop.timing))
    if loop.pressing is not None:
        from dmpcli.control import force_execution

        tell(force_execution.pressed(loop.pressing))
    if loop.goals is not None:
        tell(loop.goals.said())


def _found(request: ExecutionRequest) -> StrokeSelection:
    """Return the strokes that are to be drawn, with the outputs that they are to switch."""
    batch = stroke_selection.find(request.trajectory, request.ids)
    names = outputs.names_of(batch.strokes)
    if not request.ignore_events:
        return batch
    if names:
        warn(f"{', '.join(names)}: not switched, as --ignore-events asks")
    return batch.without_events()


def _name(trajectory: str | Source) -> str:
    return trajectory.name if isinstance(trajectory, Source) else file_io.shown(trajectory)


def _output(name: str | None) -> str:
    return "run" if name is None else file_io.shown(name, output=True)


def _warn_of(batch: StrokeSelection, name: str) -> None:
    """Warn of pairs without trajectory, and of a skill beyond its tolerance."""
    if batch.failed:
        warn(execution_plan.passed_over(batch.failed))
    mark = tolerance_mark.of_facts(batch.strokes[0].facts)
    if mark is not None:
        warn(tolerance_mark.text(name, mark))


def _judged(
    batch: StrokeSelection,
    settings: ExecuteSettings,
    arm: ReadyArm,
    reach: "Reach | None",
    request: ExecutionRequest,
) -> list[CheckedPlan]:
    """Plan and check every stroke from where the arm stands."""
    with progress("checking", len(batch.strokes)) as advance:
        return execution_plan.prepare(batch, settings, arm, request.presses, advance, reach)


def check_output(request: ExecutionRequest, repeatable: bool) -> None:
    """Refuse an output that cannot be written, or that holds what cannot be made again.

    Raises
    ------
    InputError
        Before anything moves.
    """
    if request.dry_run:
        return
    if request.output is not None:
        suffixes.check(request.output, suffixes.PARQUET)
        file_io.check_writable(request.output, here=True)
    why, remedy = "a run cannot be made again", "--force replaces it"
    refuse_replacing(request.output, repeatable, request.force, why, remedy)


def _decoded(tool_file: Source | None, weighed: bool = True) -> Tool | None:
    if tool_file is None:
        return None
    from dmpcli.records import tool as tool_files

    return tool_files.decode(tool_file) if weighed else tool_files.geometry(tool_file)


def _loop(
    bench: Workcell,
    arm: ReadyArm,
    judged: list[CheckedPlan],
    settings: ExecuteSettings,
    request: ExecutionRequest,
    coupling: "Filter | None",
    tool_file: Source | None,
    keeper: RunOutput,
    batch: StrokeSelection,
    teller: LaterTeller,
    goals: "GoalFollower | None",
) -> PlanLoop:
    """Put the loop together; the sensor streams and its zero is known when it returns."""
    touch, plans = None, [one.plan for one in judged]
    if request.sensor is not None:
        from dmpcli.control import force_execution

        tool = _tool(bench, tool_file)
        # The mock's own tool needs no check; a file's may be another tool's.
        check = None if tool_file is None else settings.tool_check
        policy = None
        if coupling is not None:
            policy = force_execution.policy_of(batch, settings, arm.info.lookahead, tool.weight)
        touch = force_execution.touch(
            bench.sensor, tool, plans[0], settings, arm, coupling, check, policy, teller.contact
        )
    watch = execution.watch(settings)
    kind: type[PlanLoop] = ServoLoop
    if isinstance(arm.servo, PlanPlayer):
        from dmpcli.control.playback import Playback

        kind = Playback
    switch = None
    if any(plan.events for plan in plans):
        assert isinstance(arm.servo, OutputSwitching)
        switch = outputs.OutputSwitch(arm.servo, settings.period, arm.info.lookahead)
    limits = limits_of(settings)
    return kind(plans[0], limits, watch, arm, touch, keeper.hindrance, plans[1:], switch, goals)


def _tool(bench: Workcell, tool_file: Source | None) -> Tool:
    tool = _decoded(tool_file)
    if tool is not None:
        return tool
    if bench.lab is None:
        raise InputError("--sensor: without the mock lab the tool is not known: --tool FILE")
    return bench.lab.scene.tool


def _provenance(
    settings: ExecuteSettings,
    request: ExecutionRequest,
    batch: StrokeSelection,
    tool_file: Source | None,
    simulated: bool,
) -> Provenance:
    """Return what is known of the run before it is made."""
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
    if request.ignore_events:
        options["ignore_events"] = True
    facts: dict[str, Any] = {"simulated": simulated}
    if execution_plan.lifts(batch, settings):
        options["id"] = list(request.ids) or None
        facts |= execution_plan.facts_of(batch)
    else:
        options["id"] = batch.strokes[0].id
        facts["trajectory"] = batch.strokes[0].facts
    return Provenance("execute", options, tuple(inputs), facts)


def _stream(
    loop: PlanLoop,
    provenance: Provenance,
    realtime: bool,
    keeper: RunOutput,
    reach: "Reach | None",
) -> tuple[LoopOutcome, Record | None]:
    """Run the loop and write what it logged, whatever ended it."""
    outcome, made = LoopOutcome("a defect of dmpcli"), None
    with stopping.outranking(lambda: loop.stop_outcome), interruptible(realtime) as interruption:
        keeper.begin(loop.log.rows, RUN, provenance)
        if realtime:
            tell("streaming; Ctrl-C decelerates, a second one stops at once")
        try:
            with watching.live(lambda: watching.of_plan(loop), realtime) as ended:
                outcome = loop.run(interruption)
                ended(outcome.reason)
        finally:
            if len(loop.log):
                made = execution.record_of(loop, outcome, provenance, realtime, reach)
                keeper.keep(made, outcome.error())
            else:
                keeper.drop()
    return outcome, made


def _finished(
    outcome: LoopOutcome, made: Record | None, request: ExecutionRequest, left: str
) -> FinishedRun:
    """Say how the run ended, and which strokes are left; a failure is raised."""
    left = left and f"; {left}"
    said, error = outcome.reason + left, outcome.error(after=left)
    if error is not None:
        raise error
    if outcome.signal is not None:
        warn(said)
    else:
        tell(f"{_output(request.output)}: {said}")
    return FinishedRun(made, outcome.signal, said)
