"""``dmpcli generalize``: a skill and new start-goal pairs in, trajectories out."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from dmpcli.errors import InputError, RefusedError

if TYPE_CHECKING:
    from dmpcli.primitives.admission import Admission
    from dmpcli.primitives.skill import Skill
    from dmpcli.records.generalize_settings import GeneralizeSettings
    from dmpcli.records.pairs import PairTable
    from dmpcli.records.record import Provenance
    from dmpcli.surfaces.protocol import Surface

SHOWN = 20
"""Bad pairs that are named on the terminal; all are in the dataset's table."""

Point = tuple[float, float, float]


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
    start: Annotated[Point | None, typer.Option(help="New start X Y Z, mm.")] = None,
    goal: Annotated[Point | None, typer.Option(help="New goal X Y Z, mm.")] = None,
    reproduce: Annotated[
        bool, typer.Option("--reproduce", help="At the demonstrated start and goal.")
    ] = False,
    start_orientation: Annotated[
        Point | None, typer.Option(help="Tool orientation at the start, RX RY RZ, rad.")
    ] = None,
    goal_orientation: Annotated[
        Point | None, typer.Option(help="Tool orientation at the goal, RX RY RZ, rad.")
    ] = None,
    pairs: Annotated[
        Path | None,
        typer.Option(help="Table of pairs: CSV or Parquet with x0 y0 z0 xg yg zg [id duration]."),
    ] = None,
    surface: Annotated[
        Path | None,
        typer.Option(help="What to draw on: plane.json (point and normal), or an STL, OBJ or PLY."),
    ] = None,
    surface_pose: Annotated[
        str | None,
        typer.Option(
            metavar="X Y Z RX RY RZ|pose.json",
            help="Where the surface's own frame lies in the base frame, mm and rad.",
        ),
    ] = None,
    surface_unit: Annotated[
        str | None, typer.Option(help="Unit of a mesh file: mm (default), cm, m or in.")
    ] = None,
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
    preset: Annotated[
        str | None, typer.Option(help="TOML file with a [generalize] section.")
    ] = None,
    config: Annotated[Path | None, typer.Option(help="The same; beats the preset.")] = None,
    quiet: Annotated[bool, typer.Option("-q", "--quiet", help="Say nothing.")] = False,
) -> None:
    """Draw a skill at new start and goal points."""
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
    if on_error is not None and pairs is None:
        raise InputError("--on-error: belongs to --pairs; leave it out")
    on_error = on_error or "stop"
    if on_error not in ("stop", "skip"):
        raise InputError(f"--on-error {on_error}: must be stop or skip")
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
    source = streams.read(skill)
    learned, _ = skill_file.decode(source)
    if reproduce:
        start, goal = tuple(learned.frame.start), tuple(learned.frame.goal)
    inputs = [{"role": "skill", "sha256": source.sha256}]
    options = settings.model_dump()
    found = None
    if surface is not None:
        options |= {"surface_unit": surface_unit or "mm", "on_border": on_border}
        found = _surface(surface, surface_pose, surface_unit, options, inputs, quiet)
    if pairs is None:
        assert start is not None
        assert goal is not None
        table = _one_pair(start, goal, start_orientation, goal_orientation)
        options |= {"start_orientation": start_orientation, "goal_orientation": goal_orientation}
    else:
        from dmpcli.records import pairs as pair_file

        pairs_source = streams.read(pairs)
        table = pair_file.read(pairs_source)
        inputs.append({"role": "pairs", "sha256": pairs_source.sha256})
        options["on_error"] = on_error
    _check_asked(learned, table, settings)
    given = None if found is None else _facing(found, learned, table, str(surface), quiet)
    _judge(learned, table, given, settings, on_error)
    provenance = Provenance("generalize", options, tuple(inputs))
    if pairs is None:
        _write_one(learned, table, given, settings, provenance, output, on_border, quiet)
    else:
        _write_batch(
            learned, table, given, settings, provenance, output, on_error, on_border, quiet
        )


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


def _one_pair(
    start: Point, goal: Point, start_orientation: Point | None, goal_orientation: Point | None
) -> "PairTable":
    import numpy as np

    from dmpcli import rotations
    from dmpcli.commands.options import within
    from dmpcli.primitives.generalization import Pairs
    from dmpcli.records.pairs import LARGEST_ANGLE, OK, PairTable

    def rotation(name: str, angles: Point | None) -> Any:
        if angles is None:
            return None
        within(name, angles, LARGEST_ANGLE)
        return rotations.from_euler(np.array([angles]))

    return PairTable(
        "--start and --goal",
        ["1"],
        Pairs(
            np.array([start]),
            np.array([goal]),
            rotation("--start-orientation", start_orientation),
            rotation("--goal-orientation", goal_orientation),
        ),
        [""],
        np.array([np.nan]),
        [OK],
    )


def _surface(
    path: Path,
    pose: str | None,
    unit: str | None,
    options: dict[str, Any],
    inputs: list[dict[str, str]],
    quiet: bool,
) -> "Surface":
    """Read the surface, place it in the base frame, and say what is odd about it."""
    from dmpcli.commands.messages import tell
    from dmpcli.records import mesh as mesh_file
    from dmpcli.records import pose as pose_file
    from dmpcli.records import streams, surface
    from dmpcli.surfaces.mesh import Mesh
    from dmpcli.surfaces.plane import Plane

    source = streams.read(path)
    inputs.append({"role": "surface", "sha256": source.sha256})
    placed = None
    if pose is not None:
        placed, pose_source = pose_file.parse(pose, "--surface-pose")
        if pose_source is None:
            options["surface_pose"] = [float(word) for word in pose.split()]
        else:
            inputs.append({"role": "surface-pose", "sha256": pose_source.sha256})
    found = surface.load(source, unit, placed)
    if isinstance(found, Plane):
        return found
    for remark in found.remarks:
        tell(f"{path}: {remark}", quiet)
    tell(f"{path}: {mesh_file.summary(found)}", quiet)
    return Mesh(found.V, found.F)


def _facing(
    surface: "Surface", skill: "Skill", table: "PairTable", name: str, quiet: bool
) -> "Surface":
    """Turn a plane's normal to the tool's side, and say so where that flips it."""
    from dmpcli.commands.messages import tell
    from dmpcli.primitives.admission import tool_axis
    from dmpcli.surfaces.plane import Plane

    if not isinstance(surface, Plane):
        return surface  # the charts of a mesh look for the tool's side at each start
    facing = surface.facing(tool_axis(skill, table.pairs[table.good.nonzero()[0]]))
    if facing.normal @ surface.normal < 0:
        tell(f"{name}: the normal is flipped: it must point to the tool's side", quiet)
    return facing


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
    on_error: str,
) -> None:
    """Write what stands against a pair into its status; with `stop` the first one ends all."""
    import numpy as np

    from dmpcli.primitives.admission import admit
    from dmpcli.records.pairs import OK

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
        place = f"{table.places[row]}, pair {table.ids[row]}: " if table.places[row] else ""
        table.status[row] = place + _reason(verdict, int(i), settings.snap_tol)
    if on_error == "skip":
        return
    upright = {int(rows[i]) for i in np.flatnonzero(verdict.upright)}
    for row, status in enumerate(table.status):
        if status != OK:
            raise (RefusedError if row in upright else InputError)(f"{table.name}: {status}")


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


def _write_one(
    skill: "Skill",
    table: "PairTable",
    given: "Surface | None",
    settings: "GeneralizeSettings",
    provenance: "Provenance",
    output: Path,
    on_border: str,
    quiet: bool,
) -> None:
    from dataclasses import replace

    import numpy as np

    from dmpcli.commands.messages import about, tell, warn
    from dmpcli.primitives.admission import snapped
    from dmpcli.primitives.drawing import draw
    from dmpcli.records import dataset, record, streams, trajectory
    from dmpcli.records.pairs import OK

    pairs = table.pairs if given is None else snapped(table.pairs, given)
    duration = _durations(skill, table, settings)
    task = dataset.Task(skill, given, settings.style(), on_border)
    with about("skill"):
        drawn = draw(skill, pairs, duration, given, task.style)[0]
    stroke, status = dataset.settled(task, drawn)
    if status != OK:
        raise RefusedError(f"{status}; move start and goal, or choose another surface")
    facts = trajectory.facts_of(skill) | trajectory.facts_of_stroke(
        stroke, settings.rate, pairs.start[0], pairs.goal[0]
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
        f"{streams.shown(output, output=True)}: {skill.model} DMP, {len(stroke.position)} poses, "
        f"{stroke.timing.t[-1]:.3f} s at {settings.rate:g} Hz, ends {miss:.4f} mm from the goal",
        quiet,
    )


def _write_batch(
    skill: "Skill",
    table: "PairTable",
    given: "Surface | None",
    settings: "GeneralizeSettings",
    provenance: "Provenance",
    output: Path,
    on_error: str,
    on_border: str,
    quiet: bool,
) -> None:
    from dmpcli.commands.messages import about, progress, tell, warn
    from dmpcli.primitives.admission import snapped
    from dmpcli.records import dataset, streams
    from dmpcli.records.pairs import OK

    if not table.good.any():
        raise InputError(f"{table.name}: no pair can be drawn; the first: {table.status[0]}")
    pairs = table.pairs if given is None else snapped(table.pairs, given)
    task = dataset.Task(skill, given, settings.style(), on_border)
    with progress("drawing", int(table.good.sum()), quiet) as advance, about("skill"):
        unfolded = dataset.write(
            output,
            task,
            table,
            pairs,
            _durations(skill, table, settings),
            provenance,
            on_error == "stop",
            advance,
        )
    if unfolded:
        warn(f"{unfolded} strokes cross a sharp crease, where no tool can follow the surface")
    bad = [status for status in table.status if status != OK]
    for status in bad[:SHOWN]:
        tell(f"{table.name}: skipped: {status}", quiet)
    if len(bad) > SHOWN:
        tell(
            f"{table.name}: and {len(bad) - SHOWN} more; {output}/{streams.TABLE} names all", quiet
        )
    summary = f"{output}: {len(table) - len(bad)} strokes drawn, {len(bad)} pairs skipped"
    if bad:
        warn(summary)
    else:
        tell(summary, quiet)
