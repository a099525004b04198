"""``dmpcli simulate``: a virtual lab on loopback, to rehearse with no hardware."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dmpcli.commands.options import (
    SURFACES,
    Quiet,
    SurfacePose,
    SurfaceUnit,
)
from dmpcli.errors import InputError, beside
from dmpcli.messages import on_terminal, tell, warn
from dmpcli.settings.options import Only, with_options
from dmpcli.settings.record import TUTOR, RecordSettings, check
from dmpcli.settings.simulate import SimulateOptions

if TYPE_CHECKING:
    from dmpcli.simulation.elite_server.faults import LabFaults
    from dmpcli.simulation.elite_server.lab import LabParameters
    from dmpcli.simulation.elite_server.visiting_hand import VisitingHand
    from dmpcli.spatial.wrench import Tool


CLEARANCE = 0.1
"""mm between the parked pen and the plate: `calibrate` must touch nothing."""


@with_options
def command(
    *,
    served: SimulateOptions,
    surface: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help=f"What the tool touches: {SURFACES}.  [default: a flat plate]"
        ),
    ] = None,
    surface_pose: SurfacePose = None,
    surface_unit: SurfaceUnit = None,
    tool: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The tool as it truly is.  [default: a pen]")
    ] = None,
    drawn: Annotated[
        str | None,
        typer.Option(metavar="FILE", help="Keep where the hand truly drew; a demonstration file."),
    ] = None,
    settings: Annotated[RecordSettings, Only("duration", *TUTOR)],
    as_json: Annotated[
        bool, typer.Option("--json", help="Say that it is ready, and its URLs, as a line of JSON.")
    ] = False,
    quiet: Quiet = False,
) -> None:
    """Serve a force/torque sensor and an EC66 arm that share one physics, until Ctrl-C."""
    on_terminal(quiet)
    import time

    from dmpcli.control.drag_loop import LONGEST_LOOKAHEAD
    from dmpcli.control.signals import Interruption
    from dmpcli.records import file_io
    from dmpcli.simulation.elite_server import faults as fault_words
    from dmpcli.simulation.elite_server.lab import VirtualLab
    from dmpcli.simulation.elite_server.lab_server import LabServer, Ports, loopback

    check(settings)
    if served.lookahead > LONGEST_LOOKAHEAD:
        said = beside(served.lookahead, LONGEST_LOOKAHEAD, ".6g")
        warn(
            f"--lookahead {said}: above {LONGEST_LOOKAHEAD:g} s the drag swings to and fro, "
            "however well the hand has practised"
        )
    faults = fault_words.parse(served.fault)
    if drawn is not None:
        if drawn == file_io.DASH:
            raise InputError("--drawn -: standard output holds what is ready; name a file")
        file_io.check_writable(drawn, here=True)
    setting, hand = _scene(settings, faults, tool, served.strokes, served.lookahead)
    if surface is not None:
        setting = _on(surface, surface_pose, surface_unit, setting)
    elif surface_pose is not None or surface_unit is not None:
        raise InputError("--surface-pose, --surface-unit: say which surface with --surface")
    if served.physics == "mujoco":
        from dataclasses import replace

        from dmpcli.bench.lab_arm import BenchArm

        setting = replace(setting, physics=BenchArm)
    ports = Ports(
        served.sensor_port,
        served.http_port,
        served.tcp_port,
        served.robot_port,
        served.monitor_port,
    )
    with Interruption() as signals:
        with LabServer(
            VirtualLab(setting, hand), faults, served.host, ports, settings.seed
        ) as serving:
            line = f"ready sensor={serving.sensor_url} robot={serving.robot_url}"
            if as_json:
                ready = {"schema": "lab", "version": 1}
                ready |= {"sensor": serving.sensor_url, "robot": serving.robot_url}
                line = json.dumps(ready)
            print(line, flush=True)  # noqa: T201
            if not loopback(served.host):
                warn(
                    f"--host {served.host}: whoever reaches this computer there can move the "
                    "simulated arm and set the sensor, with no password; leave --host out to serve "
                    "this computer alone"
                )
            tell("serving; Ctrl-C ends it")
            while signals.number is None:
                time.sleep(0.1)
        if drawn is not None and hand.track:
            file_io.write(drawn, _track(hand, settings))
        tell(f"strokes drawn by the hand: {hand.drawn}")
    raise typer.Exit(128 + signals.number)


def _scene(
    settings: "RecordSettings",
    faults: "LabFaults",
    tool: Path | None,
    strokes: int,
    lookahead: float,
) -> "tuple[LabParameters, VisitingHand]":
    """Lay the plate under the stroke, park the pen over it, and call the hand that draws it."""
    from dmpcli.simulation import reference_strokes, rehearsal
    from dmpcli.simulation.elite_server.joint_arm import LAG
    from dmpcli.simulation.elite_server.lab import LabParameters
    from dmpcli.simulation.elite_server.visiting_hand import VisitingHand
    from dmpcli.simulation.mock import PEN

    stroke = reference_strokes.build(settings)
    scene = rehearsal.scene(stroke, settings)
    # A set-point waits for its turn, then in the buffer, and the servos lag behind it.
    delay = 1.0 / settings.control_rate + lookahead + LAG
    tutor, lead_in = rehearsal.practised(stroke, scene.rotation, settings, delay)
    setting = LabParameters(
        position=scene.position + CLEARANCE * stroke.normal,
        rotation=scene.rotation,
        tool=PEN if tool is None else _weighed(tool),
        ground=scene.plate,
        habits=faults.habits,
        events=faults.events,
        seed=settings.seed,
    )
    return setting, VisitingHand(tutor, stroke.start, lead_in + tutor.duration, strokes)


def _weighed(path: Path) -> "Tool":
    """Read a tool whose weight is known: what hangs on a simulated sensor must weigh something."""
    from dmpcli.records import file_io
    from dmpcli.records import tool as tool_file

    source = file_io.read(path)
    try:
        return tool_file.decode(source)
    except InputError:
        tool_file.geometry(source)  # anything else that is wrong with it is told first
        raise InputError(
            f"--tool {path}: needs a weight: give payload with weight and centre_of_mass, as in "
            "sample_runs/pen.json"
        ) from None


def _on(
    path: Path, pose: str | None, unit: str | None, setting: "LabParameters"
) -> "LabParameters":
    """Put a surface in the place of the plate."""
    from dataclasses import replace

    from dmpcli.simulation.elite_server.workpiece import facing
    from dmpcli.workflows import surface_input

    shape = surface_input.read(path, pose, unit).surface
    return replace(setting, ground=facing(shape, setting.position, setting.rotation[:, 2]))


def _track(hand: "VisitingHand", settings: "RecordSettings") -> bytes:
    """What the hand drew, as a demonstration file."""
    import numpy as np

    from dmpcli.records.record import Provenance, Record, encode
    from dmpcli.records.schemas import DEMONSTRATION
    from dmpcli.spatial.rotations import to_euler

    times, positions, rotations = (np.array(each) for each in zip(*hand.track, strict=True))
    rows = np.column_stack([times - times[0], positions, to_euler(rotations)])
    columns = dict(zip(("t", "x", "y", "z", "rx", "ry", "rz"), rows.T, strict=True))
    options = settings.as_options()
    return encode(Record(DEMONSTRATION, columns, Provenance("simulate", options=options)))
