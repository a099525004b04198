"""``dmpcli generalize``: a skill and new start-goal pairs in, trajectories out."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from dmpcli.commands.options import Config, Point, Quiet, SurfacePose, SurfaceUnit
from dmpcli.errors import InputError, RefusedError, counted

if TYPE_CHECKING:
    from dmpcli.batch.job import Task
    from dmpcli.primitives.admission import Admission
    from dmpcli.primitives.skill import Skill
    from dmpcli.records.generalize_settings import GeneralizeSettings
    from dmpcli.records.pairs import PairTable
    from dmpcli.records.record import Provenance
    from dmpcli.surfaces.protocol import Surface


def command(
    skill: Annotated[
        Path, typer.Argument(help="Skill file of fit; - is standard input.", show_default=False)
    ],
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            help="Trajectory file (Parquet), or with --pairs a folder.",
            show_default=False,
        ),
    ],
    start: Annotated[Point | None, typer.Option(metavar="X Y Z", help="New start, mm.")] = None,
    goal: Annotated[Point | None, typer.Option(metavar="X Y Z", help="New goal, mm.")] = None,
    reproduce: Annotated[
        bool, typer.Option("--reproduce", help="At the demonstrated start and goal.")
    ] = False,
    start_orientation: Annotated[
        Point | None,
        typer.Option(metavar="RX RY RZ", help="Tool orientation at the start, rad."),
    ] = None,
    goal_orientation: Annotated[
        Point | None,
        typer.Option(metavar="RX RY RZ", help="Tool orientation at the goal, rad."),
    ] = None,
    pairs: Annotated[
        Path | None,
        typer.Option(help="Table of pairs: CSV or Parquet with x0 y0 z0 xg yg zg [id duration]."),
    ] = None,
    surface: Annotated[
        Path | None,
        typer.Option(help="What to draw on: plane.json (point and normal), or an STL, OBJ or PLY."),
    ] = None,
    surface_pose: SurfacePose = None,
    surface_unit: SurfaceUnit = None,
    on_border: Annotated[
        str,
        typer.Option(help="A stroke that leaves the surface: fail, clip it there, or skip it."),
    ] = "fail",
    duration: Annotated[
        float | None, typer.Option(help="Of the stroke, s. Default: as demonstrated.")
    ] = None,
    rate: Annotated[float | None, typer.Option(help="Samples per second, Hz (50).")] = None,
    amplitude: Annotated[
        str | None, typer.Option(help="keep the wave height, or scale it with the distance.")
    ] = None,
    orientation: Annotated[
        str | None,
        typer.Option(help="keep the tool's turn in base axes, or turn with the surface."),
    ] = None,
    ease_in: Annotated[float | None, typer.Option(help="Soft start, s.")] = None,
    ease_out: Annotated[float | None, typer.Option(help="Soft end, s.")] = None,
    snap_tol: Annotated[
        float | None, typer.Option(help="How far start and goal may lie off the surface, mm (1).")
    ] = None,
    on_error: Annotated[
        str | None,
        typer.Option(
            metavar="stop|skip",
            help="A bad pair stops all before anything is written (default), or is skipped.",
        ),
    ] = None,
    jobs: Annotated[
        int | None, typer.Option(help="Processes that draw a table of pairs (1).")
    ] = None,
    cluster: Annotated[
        str | None,
        typer.Option(metavar="tcp://HOST:PORT", help="Draw on a Dask cluster."),
    ] = None,
    shard: Annotated[
        str | None,
        typer.Option(metavar="I/N", help="Draw only every N-th part, from the I-th on."),
    ] = None,
    pairs_per_part: Annotated[
        int | None, typer.Option(help="Pairs in one file of the folder (2000).")
    ] = None,
    float32: Annotated[
        bool, typer.Option("--float32", help="Store poses in single precision.")
    ] = False,
    compression: Annotated[
        str | None, typer.Option(metavar="zstd|lz4|snappy|none", help="Of the parts (zstd).")
    ] = None,
    robot_model: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Check reach, joint limits and speeds of an arm: ec66."),
    ] = None,
    tool: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Tool file: where the TCP is on the arm's flange."),
    ] = None,
    preset: Annotated[
        str | None, typer.Option(help="TOML file with a [generalize] section.")
    ] = None,
    config: Config = None,
    quiet: Quiet = False,
) -> None:
    """Draw a skill at new start and goal points."""
    from dmpcli.batch.job import Task
    from dmpcli.commands import batches
    from dmpcli.commands.generalize_inputs import facing_tool, one_pair, reach_of, surface_at
    from dmpcli.records import skill as skill_file
    from dmpcli.records import streams
    from dmpcli.records.generalize_settings import GeneralizeSettings
    from dmpcli.records.record import Provenance
    from dmpcli.records.settings import resolve

    settings = resolve(
        GeneralizeSettings,
        "generalize",
        {
            "duration": duration,
            "rate": rate,
            "amplitude": amplitude,
            "orientation": orientation,
            "ease_in": ease_in,
            "ease_out": ease_out,
            "snap_tol": snap_tol,
        },
        preset,
        config,
    )
    wanted = batches.asked(
        pairs, on_error, jobs, cluster, shard, pairs_per_part, float32, compression
    )
    if pairs is not None and (start_orientation or goal_orientation):
        raise InputError(
            "--pairs names the orientations (rx0 ry0 rz0, rxg ryg rzg); leave "
            "--start-orientation and --goal-orientation out"
        )
    if on_border not in ("fail", "clip", "skip"):
        raise InputError(f"--on-border {on_border}: must be fail, clip or skip")
    if surface is None and (surface_pose is not None or surface_unit is not None):
        raise InputError("--surface-pose and --surface-unit say where a --surface lies; name one")
    _check_destination(output, start, goal, pairs, reproduce)
    if wanted.jobs > 1:
        from dmpcli.batch import nursery

        nursery.begin()
    source = streams.read(skill)
    learned, _ = skill_file.decode(source)
    if reproduce:
        start, goal = tuple(learned.frame.start), tuple(learned.frame.goal)
    inputs = [{"role": "skill", "sha256": source.sha256}]
    options = settings.model_dump()
    found = None
    if surface is not None:
        options |= {"surface_unit": surface_unit or "mm", "on_border": on_border}
        found = surface_at(surface, surface_pose, surface_unit, options, inputs, quiet)
    reach = reach_of(robot_model, tool, learned.oriented, options, inputs, quiet)
    if pairs is None:
        assert start is not None
        assert goal is not None
        table = one_pair(start, goal, start_orientation, goal_orientation)
        options |= {"start_orientation": start_orientation, "goal_orientation": goal_orientation}
    else:
        from dmpcli.records import pairs as pair_file

        pairs_source = streams.read(pairs)
        table = pair_file.read(pairs_source)
        inputs.append({"role": "pairs", "sha256": pairs_source.sha256})
        options |= wanted.options
    _check_asked(learned, table, settings)
    given = None if found is None else facing_tool(found, learned, table, str(surface), quiet)
    _judge(learned, table, given, settings, wanted.stop)
    provenance = Provenance("generalize", options, tuple(inputs))
    task = Task(learned, given, settings.style(), on_border, reach)
    lasting = _durations(learned, table, settings)
    if pairs is None:
        _write_one(task, table, lasting, provenance, output, quiet)
    else:
        batches.write(task, table, lasting, provenance, output, wanted, quiet)


def _check_destination(
    output: Path, start: Point | None, goal: Point | None, pairs: Path | None, reproduce: bool
) -> None:
    from dmpcli.commands.options import within
    from dmpcli.records import record, streams
    from dmpcli.records.pairs import FARTHEST

    if reproduce:
        if any(given is not None for given in (start, goal, pairs)):
            raise InputError("--reproduce takes the demonstrated ends; leave other ends out")
        streams.check_writable(output)
        return
    if pairs is None:
        if start is None or goal is None:
            raise InputError(
                "give --start X Y Z and --goal X Y Z, --reproduce, or a table with --pairs"
            )
        within("--start", start, FARTHEST)
        within("--goal", goal, FARTHEST)
        streams.check_writable(output)
        return
    if start is not None or goal is not None:
        raise InputError("--pairs names the starts and goals; leave --start and --goal out")
    streams.check_folder(output)
    foreign = record.foreign_parts(output)
    if foreign:
        raise InputError(
            f"{output}: holds {foreign[0]}, which is not of dmpcli; choose another folder"
        )


def _check_asked(skill: "Skill", table: "PairTable", settings: "GeneralizeSettings") -> None:
    """Refuse what this skill cannot give, rather than pass over it."""
    asked = (table.pairs.start_rotation, table.pairs.goal_rotation)
    if not skill.oriented and any(rotation is not None for rotation in asked):
        raise InputError(
            f"{table.name}: asks for tool orientations, but the skill was demonstrated without; "
            "leave them out, or fit a demonstration that has them"
        )
    if skill.model == "original" and settings.orientation == "surface":
        raise InputError("--orientation surface: the original DMP knows no surface; leave it out")
    if skill.model == "original" and settings.amplitude == "scale":
        raise InputError("--amplitude scale: the original DMP scales by eq. (7); leave it out")
    if skill.closed and settings.amplitude == "scale":
        raise InputError(
            "--amplitude scale: a closed stroke has no start-goal distance to scale with; "
            "leave it out"
        )


def _judge(
    skill: "Skill",
    table: "PairTable",
    given: "Surface | None",
    settings: "GeneralizeSettings",
    stop: bool,
) -> None:
    """Write what stands against a pair into its status; with `stop` the first one ends all."""
    import numpy as np

    from dmpcli.commands.generalize_inputs import ENDS
    from dmpcli.primitives.admission import admit

    rows = np.flatnonzero(table.good)
    verdict = admit(
        skill,
        table.pairs[rows],
        _durations(skill, table, settings)[rows],
        settings.style(),
        given,
        settings.snap_tol,
    )
    for i in np.flatnonzero(~verdict.admitted):
        row = int(rows[i])
        place = f"{table.place(row)}, pair {table.ids[row]}: " if table.name != ENDS else ""
        table.status[row] = place + _reason(verdict, int(i), settings.snap_tol)
    if not stop:
        return
    bad = np.flatnonzero(~table.good)
    if len(bad):
        upright = bad[0] in rows[verdict.upright]
        raise (RefusedError if upright else InputError)(f"{table.name}: {table.status[bad[0]]}")


def _durations(skill: "Skill", table: "PairTable", settings: "GeneralizeSettings") -> Any:
    import numpy as np

    default = settings.duration or skill.duration
    return np.where(np.isnan(table.duration), default, table.duration)


def _reason(verdict: "Admission", i: int, tolerance: float) -> str:
    from dmpcli.primitives.admission import MOST_SAMPLES

    if verdict.coincident[i]:
        return "start and goal are one point, and the stroke is open; set them apart"
    if verdict.short[i]:
        return (
            "--ease-in and --ease-out together are longer than twice the stroke; "
            "shorten them, or give a longer --duration"
        )
    if verdict.endless[i]:
        return f"more than {MOST_SAMPLES} samples; shorten --duration or lower --rate"
    if verdict.far[i]:
        return (
            f"start or goal lies {verdict.distance[i]:.3f} mm off the surface, more than "
            f"--snap-tol {tolerance:g}; move the point, or raise the tolerance"
        )
    return (
        "the line from start to goal stands upright on the plane, so that no chart follows; "
        "give the plane to draw on with --surface plane.json"
    )


def _remedy(status: str, on_surface: bool) -> str:
    if "duration" in status:  # too fast for a joint
        return "give a longer --duration"
    return "move start and goal" + (", or choose another surface" if on_surface else "")


def _write_one(
    task: "Task",
    table: "PairTable",
    duration: Any,
    provenance: "Provenance",
    output: Path,
    quiet: bool,
) -> None:
    from dataclasses import replace

    import numpy as np

    from dmpcli.batch.job import settle
    from dmpcli.commands.messages import about, tell, warn
    from dmpcli.primitives.admission import snapped
    from dmpcli.primitives.drawing import draw
    from dmpcli.records import record, streams, trajectory
    from dmpcli.records.pairs import OK

    given = task.surface
    pairs = table.pairs if given is None else snapped(table.pairs, given)
    with about("skill"):
        [drawn] = draw(task.skill, pairs, duration, given, task.style)
    [(stroke, status)] = settle(task, [drawn])
    if status != OK:
        raise RefusedError(f"{status}; {_remedy(status, given is not None)}")
    facts = trajectory.facts_of(task.skill) | trajectory.facts_of_stroke(
        stroke, task.style.rate, pairs.start[0], pairs.goal[0]
    )
    done = trajectory.trajectory_record(table.ids, [stroke], replace(provenance, facts=facts))
    streams.write(output, record.encode(done))
    if given is not None:
        moved = np.linalg.norm(
            [pairs.start - table.pairs.start, pairs.goal - table.pairs.goal], axis=2
        )
        tell(
            f"start moved {moved[0, 0]:.3f} mm and goal {moved[1, 0]:.3f} mm onto the surface",
            quiet,
        )
    if stroke.unfolded:
        warn("the stroke crosses a sharp crease, where no tool can follow the surface")
    if len(stroke.position) < len(drawn.position):
        warn(f"clipped at the border: {len(stroke.position)} of {len(drawn.position)} poses")
    miss = np.linalg.norm(stroke.position[-1] - pairs.goal[0])
    tell(
        f"{streams.shown(output, output=True)}: {task.skill.model} DMP, "
        f"{counted(len(stroke.position), 'pose')}, {stroke.timing.t[-1]:.3f} s at "
        f"{task.style.rate:g} Hz, ends {miss:.4f} mm from the goal",
        quiet,
    )
