"""``dmpcli generalize``: a skill and new start-goal pairs in, trajectories out."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from dmpcli.commands.options import SURFACES, Point, Quiet, SurfacePose, SurfaceUnit
from dmpcli.commands.process_options import KeepOut
from dmpcli.errors import InputError, RefusedError
from dmpcli.settings.batch import BatchOptions
from dmpcli.settings.generalize import GeneralizeSettings, PlaceOptions
from dmpcli.settings.options import Given, with_options

if TYPE_CHECKING:
    from dmpcli.commands.surface_input import SurfaceInput
    from dmpcli.primitives.drawing import Style
    from dmpcli.primitives.skill import Skill
    from dmpcli.records.pairs import PairTable
    from dmpcli.surfaces.protocol import Surface

_PLACED = 100
"""Pairs off the surface that are told where it is instead."""


@with_options
def command(
    *,
    skill: Annotated[
        Path, typer.Argument(help="Skill file of fit; - is standard input.", show_default=False)
    ],
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE|DIR",
            help="Trajectory file (Parquet), or with --pairs a folder.",
            show_default=False,
        ),
    ],
    start: Annotated[Point | None, typer.Option(metavar="X Y Z", help="New start, mm.")] = None,
    goal: Annotated[Point | None, typer.Option(metavar="X Y Z", help="New goal, mm.")] = None,
    place: PlaceOptions,
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
        typer.Option(
            metavar="FILE",
            help="Table of pairs: CSV or Parquet with x0 y0 z0 xg yg zg [id duration].",
        ),
    ] = None,
    surface: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help=f"What to draw on: {SURFACES}."),
    ] = None,
    surface_pose: SurfacePose = None,
    surface_unit: SurfaceUnit = None,
    settings: GeneralizeSettings,
    keep_out: KeepOut = None,
    wanted: BatchOptions,
    given: Given,
    robot_model: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Check reach, joint limits and speeds of an arm: ec66."),
    ] = None,
    tool: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Tool file: where the TCP is on the arm's flange."),
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Draw a skill at new start and goal points."""
    from dmpcli.batch.job import Task
    from dmpcli.commands import batches, process_options, single, surface_input
    from dmpcli.commands.generalize_inputs import (
        facing_tool,
        in_base,
        one_pair,
        reach_of,
        style_of,
    )
    from dmpcli.commands.generalize_messages import mark, tell_of_surface
    from dmpcli.commands.messages import tell, warn
    from dmpcli.records import lesson, streams
    from dmpcli.records import skill as skill_file
    from dmpcli.records.record import Provenance

    batches.check(wanted, given, pairs is not None)
    _check_together(pairs, (start_orientation, goal_orientation), surface, given)
    process_options.check(settings, given, surface, keep_out)
    surface_input.check_options(surface, surface_pose, surface_unit)
    _check_frame(place.in_, surface, reproduce)
    _check_destination(output, start, goal, pairs, reproduce)
    if wanted.jobs > 1:
        from dmpcli.batch import nursery

        nursery.begin()
    source = streams.read(skill)
    learned, file = skill_file.decode(source)
    if reproduce:
        start, goal = tuple(learned.frame.start), tuple(learned.frame.goal)
    inputs = [{"role": "skill", "sha256": source.sha256}]
    options = settings.as_options()
    found = read = None
    if surface is not None:
        read = surface_input.read(surface, surface_pose, surface_unit, quiet, summary=True)
        options |= {"surface_unit": read.unit, "on_border": place.on_border} | read.options
        found, inputs = read.surface, inputs + read.inputs
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
        options |= wanted.as_options()
    if place.in_ == "part":
        table, options = in_base(table, read), options | {"in": place.in_}
    _check_asked(learned, table, settings)
    process_options.check_skill(settings, learned, table, keep_out)
    table = process_options.copied(table, settings)
    target = None if found is None else facing_tool(found, learned, table, str(surface), quiet)
    style = style_of(settings.style(), learned, target, settings.contact, settings.offset)
    style = process_options.process_style(
        style, settings, place.on_border, target, keep_out, inputs, quiet
    )
    said = mark(learned, streams.shown(skill))
    if said is not None:
        warn(said)
    keeps = settings.orientation == "keep" and settings.inclination is None
    if learned.surface is not None and learned.oriented and keeps:
        tell(
            "the skill was taught on a surface: its tool turns as it did against that one, about "
            "the axes of the taught start; --orientation surface turns it with this one",
            quiet,
        )
    if target is not None:
        tell_of_surface(learned, style, target, table, str(surface), quiet)
    _judge(learned, table, target, settings, style, wanted.stop, read, place.in_ == "part")
    taught = lesson.of_skill(file).facts()
    provenance = Provenance("generalize", options, tuple(inputs), taught)
    task = Task(learned, target, style, reach)
    lasting = _durations(learned, table, settings)
    if pairs is None:
        single.write(task, table, lasting, provenance, output, quiet)
    else:
        batches.write(task, table, lasting, provenance, output, wanted, quiet)


def _check_together(
    pairs: Path | None,
    orientations: tuple[Point | None, Point | None],
    surface: Path | None,
    given: Given,
) -> None:
    """Refuse options that say nothing without one another, or say it twice."""
    if pairs is not None and any(orientations):
        raise InputError(
            "--pairs names the orientations (rx0 ry0 rz0, rxg ryg rzg); leave "
            "--start-orientation and --goal-orientation out"
        )
    alone = [f"--{name}" for name in ("contact", "offset") if name in given]
    if surface is None and alone:
        raise InputError(f"{' and '.join(alone)}: what is said of a --surface; name one")


def _check_frame(in_: str, surface: Path | None, reproduce: bool) -> None:
    if in_ == "part" and surface is None:
        raise InputError("--in part: the axes of which part? Name it with --surface")
    if in_ == "part" and reproduce:
        raise InputError("--reproduce takes the demonstrated ends, in the base; leave --in out")


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
    if not skill.closed and (settings.scale != 1.0 or settings.turn != 0.0):
        raise InputError(
            "--scale and --turn: the size and heading of an open stroke are those of its start and "
            "goal; leave them out"
        )
    if skill.closed and settings.amplitude == "scale":
        raise InputError(
            "--amplitude scale: a closed stroke has no start-goal distance to scale with; "
            "leave it out, or give its size with --scale"
        )


def _judge(
    skill: "Skill",
    table: "PairTable",
    given: "Surface | None",
    settings: "GeneralizeSettings",
    style: "Style",
    stop: bool,
    read: "SurfaceInput | None",
    in_part: bool,
) -> None:
    """Write what stands against a pair into its status; with `stop` the first one ends all."""
    import numpy as np

    from dmpcli.commands.generalize_inputs import ENDS, where_instead
    from dmpcli.commands.generalize_messages import reason, tell_of_stretch
    from dmpcli.primitives.admission import admit

    rows = np.flatnonzero(table.good)
    verdict = admit(
        skill,
        table.pairs[rows],
        _durations(skill, table, settings)[rows],
        style,
        given,
        settings.snap_tol,
    )
    for i in np.flatnonzero(~verdict.admitted):
        row = int(rows[i])
        place = f"{table.place(row)}, pair {table.ids[row]}: " if table.name != ENDS else ""
        # To place each of very many would take longer than to draw them.
        few = int(np.count_nonzero(verdict.far[:i])) < _PLACED
        where = where_instead(table, row, read, in_part) if read is not None and few else None
        table.status[row] = place + reason(verdict, int(i), settings.snap_tol, skill, where)
    bad = np.flatnonzero(~table.good)
    if stop and len(bad):
        shape = verdict.upright | verdict.deep | verdict.stretched
        refused = bad[0] in rows[shape & ~verdict.far]
        raise (RefusedError if refused else InputError)(f"{table.name}: {table.status[bad[0]]}")
    tell_of_stretch(verdict, np.flatnonzero(verdict.admitted), skill, table.name)


def _durations(skill: "Skill", table: "PairTable", settings: "GeneralizeSettings") -> Any:
    import numpy as np

    default = settings.duration or skill.duration
    return np.where(np.isnan(table.duration), default, table.duration)
