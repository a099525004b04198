"""``dmpcli generalize``: a skill and new start-goal pairs in, trajectories out."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dmpcli.commands.options import ARMS, SURFACES, Point, Quiet, SurfacePose, SurfaceUnit
from dmpcli.commands.process_options import KeepOut
from dmpcli.errors import InputError
from dmpcli.messages import on_terminal, tell
from dmpcli.settings.batch import BatchOptions
from dmpcli.settings.generalize import GeneralizeSettings, PlaceOptions
from dmpcli.settings.options import Given, choice, with_options

if TYPE_CHECKING:
    from dmpcli.records.pair_stream import PairStream
    from dmpcli.records.pairs import PairTable
    from dmpcli.records.storage import Location
    from dmpcli.workflows.generalize import Ready
    from dmpcli.workflows.surface_input import SurfaceInput


@with_options
def command(
    *,
    skill: Annotated[
        str, typer.Argument(help="Skill file of fit; - is standard input.", show_default=False)
    ],
    output: Annotated[
        str,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE|DIR",
            help="Trajectory file (Parquet), or with --pairs a folder; or s3://BUCKET/NAME.",
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
        str | None,
        typer.Option(
            metavar="FILE",
            help="Table of pairs: CSV or Parquet with x0 y0 z0 xg yg zg [id duration] and, of each "
            "pair's own surface, [surface surface_unit pose in offset].",
        ),
    ] = None,
    surface: Annotated[
        str | None,
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
        typer.Option(
            metavar="NAME",
            help="Check reach, joint limits and speeds of an arm: ec66, ur5e.",
            autocompletion=choice(*ARMS),
        ),
    ] = None,
    tool: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Tool file: where the TCP is on the arm's flange."),
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Draw a skill at new start and goal points."""
    on_terminal(quiet)
    from dmpcli.commands import batches as batch_options
    from dmpcli.records import file_io, learned_skill, pair_stream
    from dmpcli.records import pairs as pair_file
    from dmpcli.records.record import encode
    from dmpcli.records.storage import located
    from dmpcli.workflows import batches, process, single, surface_input
    from dmpcli.workflows.generalize import Order, each_alone, prepared
    from dmpcli.workflows.generalize_inputs import one_pair

    batch_options.check(wanted, given, pairs is not None)
    _check_orientations(pairs, (start_orientation, goal_orientation))
    target = located(output)
    pairs_at = None if pairs is None else located(pairs)
    surface_at = None if surface is None else located(surface)
    _check_destination(target, start, goal, pairs, reproduce)
    if wanted.jobs > 1:
        from dmpcli.batch import process_pool

        process_pool.begin()
    table = stream = None
    sha256 = ""
    if pairs_at is not None:
        stream = pair_stream.opened(pairs_at)
        if stream is not None:
            table, sha256 = stream.first(), stream.sha256
        else:
            source = file_io.read(pairs_at)
            table, sha256 = pair_file.read(source), source.sha256
    # A table may name surfaces itself, or some of them.
    named = surface_at or (pairs_at if table is not None and table.places is not None else None)
    _check_together(named, given)
    process.check(settings, given, named, keep_out)
    surface_input.check_options(named, surface_pose, surface_unit)
    _check_frame(place.in_, named, reproduce)
    learned = learned_skill.read(file_io.read(skill))
    if reproduce:
        start, goal = tuple(learned.frame.start), tuple(learned.frame.goal)
    sites = table is not None and table.places is not None
    batch_options.check_surfaces(wanted, given, sites, named is not None)
    read = None
    if surface_at is not None and not sites:
        store = surface_input.store_in(wanted.surface_cache)
        read = surface_input.read(surface_at, surface_pose, surface_unit, True, store)
    settings = _with_means(settings, target, table, stream, read)
    inputs: list[dict[str, str]] = []
    if table is None:
        assert start is not None
        assert goal is not None
        table = one_pair(start, goal, start_orientation, goal_orientation)
        options = {"start_orientation": start_orientation, "goal_orientation": goal_orientation}
    else:
        options = wanted.as_options(sites)
        inputs.append({"role": "pairs", "sha256": sha256})
    order = Order(
        learned,
        table,
        settings,
        read,
        place.in_,
        place.on_border,
        keep_out,
        robot_model,
        tool,
        wanted.stop,
        options,
        inputs,
    )
    if pairs_at is None:
        drawn = single.draw_one(prepared(order))
        file_io.write(target, encode(drawn.record))
        tell(f"{file_io.shown(target, output=True)}: {drawn.said}")
        return

    on = None
    if sites:
        from dmpcli.workflows.table_sites import Otherwise, TableSites

        otherwise = Otherwise(surface, surface_pose, surface_unit, place.in_, settings.offset)
        on = TableSites(Path() if pairs == file_io.DASH else pairs_at.parent, otherwise)

    def ready_of(some: "PairTable") -> "Ready":
        mine = replace(order, table=some, inputs=list(inputs))
        if on is None:
            return prepared(mine)
        from dmpcli.workflows.generalize_sites import prepared_sites

        return prepared_sites(mine, on, wanted.surface_cache)

    if stream is not None:
        batches.write_pieces(stream, ready_of, target, wanted, each_alone(order), on)
        return
    batches.tell_of_unknown(table)
    batches.write(ready_of(table), target, wanted)


def _with_means(
    settings: GeneralizeSettings,
    output: "Location",
    table: "PairTable | None",
    stream: "PairStream | None",
    read: "SurfaceInput | None",
) -> GeneralizeSettings:
    """Decide by what means all of the job is drawn; a stroke alone is as it always was."""
    if table is None and settings.kernels != "compiled":
        return settings
    from dmpcli.surfaces.triangle_mesh import TriangleMesh
    from dmpcli.workflows import kernels

    rows = 1 if table is None else len(table) if stream is None else stream.rows
    mesh = read is not None and isinstance(read.surface, TriangleMesh)
    if table is not None and table.places is not None:
        # What a surface is its file tells, which is read where it is drawn on.
        mesh = not all(place.surface.lower().endswith(".json") for place in table.places.places)
    turning = settings.orientation == "surface" or settings.inclination is not None
    means = kernels.means(settings.kernels, rows, mesh, turning, output)
    if means == "compiled":
        kernels.get_ready()
    return replace(settings, kernels=means)


def _check_orientations(pairs: str | None, orientations: tuple[Point | None, Point | None]) -> None:
    """Refuse orientations of one pair where a table names those of many."""
    if pairs is not None and any(orientations):
        raise InputError(
            "--pairs names the orientations (rx0 ry0 rz0, rxg ryg rzg); leave "
            "--start-orientation and --goal-orientation out"
        )


def _check_together(surface: "Location | None", given: Given) -> None:
    """Refuse options that say nothing without a surface."""
    alone = [f"--{name}" for name in ("contact", "offset") if name in given]
    if surface is None and alone:
        raise InputError(f"{' and '.join(alone)}: what is said of a --surface; name one")


def _check_frame(in_: str, surface: "Location | None", reproduce: bool) -> None:
    if in_ == "part" and surface is None:
        raise InputError("--in part: the axes of which part? Name it with --surface")
    if in_ == "part" and reproduce:
        raise InputError("--reproduce takes the demonstrated ends, in the base; leave --in out")


def _check_destination(
    output: "Location",
    start: Point | None,
    goal: Point | None,
    pairs: str | None,
    reproduce: bool,
) -> None:
    from dmpcli.records import file_io, record, suffixes
    from dmpcli.records.columns import FARTHEST
    from dmpcli.records.object_store import ObjectPath
    from dmpcli.workflows.ranges import within

    if reproduce:
        if any(given is not None for given in (start, goal, pairs)):
            raise InputError("--reproduce takes the demonstrated ends; leave other ends out")
        suffixes.check(output, suffixes.PARQUET)
        file_io.check_writable(output)
        return
    if pairs is None:
        if start is None or goal is None:
            raise InputError(
                "give --start X Y Z and --goal X Y Z, --reproduce, or a table with --pairs"
            )
        within("--start", start, FARTHEST)
        within("--goal", goal, FARTHEST)
        suffixes.check(output, suffixes.PARQUET)
        file_io.check_writable(output)
        return
    if start is not None or goal is not None:
        raise InputError("--pairs names the starts and goals; leave --start and --goal out")
    file_io.check_folder(output)
    known: set[str] = set()
    if isinstance(output, ObjectPath):  # to ask each takes its time
        from dmpcli.batch import ledger

        known = ledger.told_in(output, file_io.parts_of(output))
    foreign = record.foreign_parts(output, known)
    if foreign:
        raise InputError(
            f"{output}: holds {foreign[0]}, which is not of dmpcli; choose another folder"
        )
