"""``dmpcli calibrate``: find the tool's weight, its centre of mass, and the sensor's zero."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from dmpcli.commands.options import AllowMixed, Quiet, Realtime, Robot, Sensor
from dmpcli.errors import InputError, RefusedError, UnconfirmedStopError, counted
from dmpcli.messages import on_terminal
from dmpcli.settings.calibrate import CalibrateSettings
from dmpcli.settings.options import with_options

if TYPE_CHECKING:
    from dmpcli.admittance.payload_identification import Identification
    from dmpcli.control.ownership import ArmLock
    from dmpcli.control.signals import Interruption
    from dmpcli.control.workcell import Workcell
    from dmpcli.instruments.protocols import Clock, SensorInfo
    from dmpcli.records.file_io import Source
    from dmpcli.records.static_poses import StaticPose
    from dmpcli.spatial.wrench import Tool


BESIDE = ".poses.parquet"
"""What is put after the output's name for poses that nobody asked to keep, if all else fails."""


@with_options
def command(
    *,
    output: Annotated[
        str, typer.Option("--output", "-o", metavar="FILE", help="Tool file; - is stdout.")
    ],
    tool: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Tool file: where TCP and sensor sit.  [default: the mock knows its own]",
        ),
    ] = None,
    robot: Robot = "mock:",
    sensor: Sensor = "mock:",
    by_hand: Annotated[
        bool, typer.Option("--by-hand", help="You move the arm; Enter takes a pose, q ends.")
    ] = False,
    from_file: Annotated[
        str | None, typer.Option("--from", metavar="FILE", help="Poses that --save kept.")
    ] = None,
    save: Annotated[
        str | None, typer.Option(metavar="FILE", help="Keep the poses as Parquet.")
    ] = None,
    settings: CalibrateSettings,
    realtime: Realtime = False,
    allow_mixed: AllowMixed = False,
    force: Annotated[
        bool, typer.Option("--force", help="Replace files from real instruments.")
    ] = False,
    quiet: Quiet = False,
) -> None:
    """Identify what hangs on the sensor from static poses, with nothing touching the tool.

    The arm turns the tool about its tip, slowly and in all directions, and comes back; leave room
    for a tilt of 45° all around, or say less with --tilt.
    """
    on_terminal(quiet)
    from dmpcli.records import file_io, suffixes

    if from_file is not None and (by_hand or save is not None):
        raise InputError("--from: reads poses; --by-hand and --save take new ones")
    if "-" in (output, save) and output == save:
        raise InputError("-o - --save -: standard output takes one of them")
    for name, kind in ((output, suffixes.JSON), (save, suffixes.PARQUET)):
        if name is not None:
            suffixes.check(name, kind)
            file_io.check_writable(name, here=True)
    request = CalibrationRequest(
        output,
        tool,
        robot,
        sensor,
        by_hand,
        save,
        realtime,
        allow_mixed,
        force,
        from_file is not None,
    )
    if from_file is None:
        _measure(settings, request)
    else:
        _from_file(settings, request, from_file)


@dataclass(frozen=True)
class CalibrationRequest:
    """What the command line asks for beside the settings."""

    output: str
    tool: Path | None
    robot: str
    sensor: str
    by_hand: bool
    save: str | None
    realtime: bool
    allow_mixed: bool
    force: bool
    from_file: bool

    @property
    def replaces(self) -> bool:
        """Whether a file that appears meanwhile may be replaced."""
        return self.from_file or self.force or self.repeatable

    @property
    def repeatable(self) -> bool:
        """Whether the same can be measured again."""
        from dmpcli.control import workcell

        return workcell.repeatable(workcell.check(self.robot, self.sensor, self.allow_mixed))


def _from_file(settings: "CalibrateSettings", request: CalibrationRequest, name: str) -> None:
    from dmpcli.records import file_io, static_poses
    from dmpcli.records import tool as tool_file

    sources = {"poses": file_io.read(name)}
    taken, facts = static_poses.decode(sources["poses"])
    if request.tool is None:
        geometry, sensor = tool_file.restored(facts, sources["poses"].name)
    else:
        sources["tool"] = file_io.read(request.tool)
        geometry = tool_file.geometry(sources["tool"])
        sensor = tool_file.sensor_of(facts, sources["poses"].name)
    _conclude(taken, geometry, sensor, settings, request, sources, {})


def _measure(settings: "CalibrateSettings", request: CalibrationRequest) -> None:
    from dmpcli.calibration import result
    from dmpcli.calibration.by_hand import Keyboard
    from dmpcli.calibration.tour import Interrupted
    from dmpcli.control import guards, ownership, workcell
    from dmpcli.control.signals import Interruption
    from dmpcli.instruments.clock import MonotonicClock, SimulatedClock
    from dmpcli.messages import tell, warn
    from dmpcli.records import file_io
    from dmpcli.records import tool as tool_file
    from dmpcli.simulation.mock import PEN

    addresses = workcell.check(request.robot, request.sensor, request.allow_mixed)
    workcell.need_tool(addresses[1], request.tool is not None)
    repeatable = workcell.repeatable(addresses)
    _check_existing(request, repeatable)
    keyboard = Keyboard("--by-hand") if request.by_hand else None
    source = None if request.tool is None else file_io.read(request.tool)
    geometry = PEN if source is None else tool_file.geometry(source)
    realtime = request.realtime or request.by_hand or not repeatable
    clock = MonotonicClock() if realtime else SimulatedClock()
    bench = workcell.connect(
        request.robot, request.sensor, clock, allow_mixed=request.allow_mixed, tool=geometry
    )
    if keyboard is None:
        guards.check_streams(bench.robot)
    if bench.note:
        tell(bench.note)
    lock = ownership.ArmLock(addresses[0], moves=keyboard is None)
    lock.take()
    taken: list[StaticPose] = []
    info: SensorInfo | None = None
    failed = True
    moving: UnconfirmedStopError | None = None
    options = {"robot": workcell.in_provenance(request.robot), "by_hand": request.by_hand}
    options |= {"sensor": workcell.in_provenance(request.sensor), "realtime": realtime}
    try:
        with Interruption() as interruption:
            info = bench.sensor.open()
            _take(bench, info, clock, settings, interruption, keyboard, taken, lock)
        failed = False
    except Interrupted as stop:
        warn(str(stop))
        raise typer.Exit(128 + stop.number) from None
    except UnconfirmedStopError as error:
        moving = error
        raise
    finally:
        # What was measured is kept, whatever ended it.
        closing = guards.leave(bench.robot.close, bench.sensor.close, lock.release)
        if taken and info is not None:
            try:
                name = _poses_name(request, failed or closing is not None)
                _save(taken, geometry, info, settings, request, source, options, name)
            except InputError as error:
                if moving is None:
                    raise
                warn(str(error))  # an arm that may still move is told last
                raise moving from None
    if closing is not None:
        raise closing
    sources = {} if source is None else {"tool": source}
    try:
        _conclude(taken, geometry, result.identity(info), settings, request, sources, options)
    except RefusedError:
        if request.save is None and info is not None:
            name = _poses_name(request, failed=True)
            _save(taken, geometry, info, settings, request, source, options, name)
        raise


def _take(
    bench: "Workcell",
    info: "SensorInfo",
    clock: "Clock",
    settings: "CalibrateSettings",
    interruption: "Interruption",
    keyboard: Any,
    taken: "list[StaticPose]",
    lock: "ArmLock",
) -> None:
    """Fill `taken`, by the arm's own motion or as a person leads it."""
    from dmpcli.calibration.resting import Watcher
    from dmpcli.calibration.tour import Tour
    from dmpcli.control import execution
    from dmpcli.control.cycle import ReadyArm
    from dmpcli.control.force_sensing import Sensing
    from dmpcli.control.watchdog import watched
    from dmpcli.messages import progress, tell

    rate = min(settings.sensor_rate, info.rate)
    robot = bench.robot if bench.lock_step else watched(bench.robot)
    arm = ReadyArm(robot, robot.open(), clock)
    lock.require_rest(robot, clock)
    bench.sensor.start(rate)
    sensing = Sensing(bench.sensor, info, rate, settings.period, clock)
    sensing.first(settings.settle)
    if keyboard is None:
        reach = execution.reach_of(bench.robot, None, None)
        with progress("poses", settings.poses) as step:
            tour = Tour(arm, sensing, settings, interruption, taken, reach, lambda: step(1))
            tour.run()
        return
    from dmpcli.calibration.by_hand import lead

    lead(
        Watcher(arm.servo, clock, sensing),
        keyboard,
        settings,
        interruption,
        taken,
        lambda message: tell(message),
    )


def _check_existing(request: CalibrationRequest, repeatable: bool) -> None:
    for name in (request.output, request.save):
        if name not in (None, "-") and not (repeatable or request.force) and Path(name).exists():
            raise InputError(
                f"{name}: exists, and a measurement cannot be made again; choose another name, or "
                "give --force"
            )


def _poses_name(request: CalibrationRequest, failed: bool) -> str | None:
    """Return where the poses are kept: as asked, or beside the output where they would be lost."""
    if request.save is not None or not failed:
        return request.save
    if request.output == "-" or not (request.by_hand or not request.repeatable):
        return None
    return f"{request.output}{BESIDE}"


def _save(
    taken: "list[StaticPose]",
    geometry: "Tool",
    info: "SensorInfo",
    settings: "CalibrateSettings",
    request: CalibrationRequest,
    source: "Source | None",
    options: dict[str, Any],
    name: str | None,
) -> None:
    """Keep the poses under a name; None where nobody asked, and they can be measured again."""
    from dmpcli.calibration import result
    from dmpcli.messages import warn
    from dmpcli.records import static_poses
    from dmpcli.records import tool as tool_file
    from dmpcli.records.record import Provenance, input_of
    from dmpcli.workflows.run_output import kept_as, write_once

    if name is None:
        return
    facts = {
        "geometry": tool_file.transforms(geometry),
        "sensor": result.identity(info).model_dump(),
    }
    inputs = () if source is None else (input_of("tool", source),)
    provenance = Provenance("calibrate", options | settings.as_options(), inputs, facts)
    content = static_poses.encode(taken, provenance)
    if name == request.save:
        write_once(name, content, request.replaces)
        return
    found = kept_as(name, content, replaces=False)
    warn(f"{counted(len(taken), 'pose')} kept in {found}: calibrate --from reads them")


def _conclude(
    taken: "list[StaticPose]",
    geometry: "Tool",
    sensor: Any,
    settings: "CalibrateSettings",
    request: CalibrationRequest,
    sources: "dict[str, Source]",
    options: dict[str, Any],
) -> None:
    """Identify, say what came out, write the tool file."""
    from dmpcli.calibration import result
    from dmpcli.messages import tell, wanted
    from dmpcli.records import file_io
    from dmpcli.records import tool as tool_file
    from dmpcli.workflows.run_output import write_once

    found, remarks = result.identified(taken, geometry, settings.condition, settings.max_residual)
    calibration = tool_file.calibrated(
        found,
        sensor,
        options | settings.as_options(),
        [{"role": role, "sha256": source.sha256} for role, source in sources.items()],
    )
    written = tool_file.encode(result.with_payload(geometry, found), calibration)
    write_once(request.output, written, request.replaces)
    for remark in remarks:
        tell(remark)
    if wanted():
        _show(found)
    tell(f"{file_io.shown(request.output, output=True)}: {result.verdict(found)}")


def _show(found: "Identification") -> None:
    import io

    from rich.console import Console
    from rich.table import Table

    from dmpcli.calibration import result
    from dmpcli.messages import tell

    table = Table(box=None, pad_edge=False)
    table.add_column("")
    table.add_column("identified", justify="right", no_wrap=True)
    table.add_column("± / largest", justify="right", no_wrap=True)
    table.add_column("unit")
    for row in result.table(found):
        table.add_row(*row)
    sink = io.StringIO()
    Console(file=sink, width=80, highlight=False, color_system=None).print(table)
    tell(sink.getvalue().rstrip("\n"))
