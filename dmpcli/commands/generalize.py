"""``dmpcli generalize``: a skill and new start-goal pairs in, trajectories out."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from dmpcli.commands.options import SURFACES, Config, Point, Quiet, SurfacePose, SurfaceUnit
from dmpcli.commands.process_options import (
    Copies,
    KeepOut,
    Lead,
    Margin,
    Spacing,
    Tilt,
    ToolAcceleration,
    ToolSpeed,
)
from dmpcli.errors import InputError
from dmpcli.messages import on_terminal, tell

if TYPE_CHECKING:
    pass

_PLACED = 100
"""Pairs off the surface that are told where it is instead."""


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
    in_: Annotated[
        str,
        typer.Option(
            "--in",
            metavar="base|part",
            help="Axes of start, goal and pairs: the base's, or the surface's own.",
        ),
    ] = "base",
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
        typer.Option(metavar="FILE", help=f"What to draw on: {SURFACES}."),
    ] = None,
    surface_pose: SurfacePose = None,
    surface_unit: SurfaceUnit = None,
    on_border: Annotated[
        str,
        typer.Option(
            help="A stroke that leaves the surface: fail, clip it there, split it, or skip it."
        ),
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
    contact: Annotated[
        float | None,
        typer.Option(
            metavar="MM",
            help="How near to the surface the pen touches; drawn on it, deeper is refused (1).",
        ),
    ] = None,
    offset: Annotated[
        float | None,
        typer.Option(metavar="MM", help="Off the surface: stand-off, or negative, engraving."),
    ] = None,
    scale: Annotated[
        float | None, typer.Option(metavar="F", help="Size of a closed stroke (1).")
    ] = None,
    turn: Annotated[
        float | None, typer.Option(metavar="DEG", help="Turn of a closed stroke, degrees (0).")
    ] = None,
    allow_stretch: Annotated[
        bool | None,
        typer.Option(
            "--allow-stretch",
            help="Start and goal at any distance, however it distorts.",
            show_default=False,
        ),
    ] = None,
    lead: Lead = None,
    tilt: Tilt = None,
    tool_speed: ToolSpeed = None,
    tool_acceleration: ToolAcceleration = None,
    border_margin: Margin = None,
    keep_out: KeepOut = None,
    copies: Copies = None,
    spacing: Spacing = None,
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
    on_terminal(quiet)
    from dmpcli.commands import batches as batch_options
    from dmpcli.records import learned_skill, streams
    from dmpcli.records import pairs as pair_file
    from dmpcli.records.generalize_settings import GeneralizeSettings
    from dmpcli.records.record import encode
    from dmpcli.records.settings import resolve
    from dmpcli.workflows import batches, process, single, surface_input
    from dmpcli.workflows.generalize import Order, prepared
    from dmpcli.workflows.generalize_inputs import one_pair

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
            "contact": contact,
            "offset": offset,
            "scale": scale,
            "turn": turn,
            "allow_stretch": allow_stretch,
            "lead": lead,
            "tilt": tilt,
            "tool_speed": tool_speed,
            "tool_acceleration": tool_acceleration,
            "border_margin": border_margin,
            "copies": copies,
            "spacing": spacing,
        },
        preset,
        config,
    )
    wanted = batch_options.asked(
        pairs, on_error, jobs, cluster, shard, pairs_per_part, float32, compression
    )
    _check_together(
        pairs,
        (start_orientation, goal_orientation),
        surface,
        {
            "--contact": contact,
            "--offset": offset,
        },
    )
    leaving = process.leaving(on_border)
    process.check(settings, orientation, surface, keep_out)
    surface_input.check_options(surface, surface_pose, surface_unit)
    frame = _frame(in_, surface, reproduce)
    _check_destination(output, start, goal, pairs, reproduce)
    if wanted.jobs > 1:
        from dmpcli.batch import nursery

        nursery.begin()
    learned = learned_skill.read(streams.read(skill))
    if reproduce:
        start, goal = tuple(learned.frame.start), tuple(learned.frame.goal)
    read = None
    if surface is not None:
        read = surface_input.read(surface, surface_pose, surface_unit, summary=True)
    inputs: list[dict[str, str]] = []
    if pairs is None:
        assert start is not None
        assert goal is not None
        table = one_pair(start, goal, start_orientation, goal_orientation)
        options = {"start_orientation": start_orientation, "goal_orientation": goal_orientation}
    else:
        source = streams.read(pairs)
        table, options = pair_file.read(source), wanted.options
        inputs.append({"role": "pairs", "sha256": source.sha256})
    ready = prepared(
        Order(
            learned,
            table,
            settings,
            read,
            frame,
            leaving,
            keep_out,
            robot_model,
            tool,
            wanted.stop,
            options,
            inputs,
        )
    )
    if pairs is None:
        drawn = single.draw_one(ready)
        streams.write(output, encode(drawn.record))
        tell(f"{streams.shown(output, output=True)}: {drawn.said}")
    else:
        batches.write(ready, output, wanted)


def _check_together(
    pairs: Path | None,
    orientations: tuple[Point | None, Point | None],
    surface: Path | None,
    of_surface: dict[str, Any],
) -> None:
    """Refuse options that say nothing without one another, or say it twice."""
    if pairs is not None and any(orientations):
        raise InputError(
            "--pairs names the orientations (rx0 ry0 rz0, rxg ryg rzg); leave "
            "--start-orientation and --goal-orientation out"
        )
    alone = [name for name, value in of_surface.items() if value is not None]
    if surface is None and alone:
        raise InputError(f"{' and '.join(alone)}: what is said of a --surface; name one")


def _frame(in_: str, surface: Path | None, reproduce: bool) -> 'Literal["base", "part"]':
    if in_ not in ("base", "part"):
        raise InputError(f"--in {in_}: must be base or part")
    if in_ == "part" and surface is None:
        raise InputError("--in part: the axes of which part? Name it with --surface")
    if in_ == "part" and reproduce:
        raise InputError("--reproduce takes the demonstrated ends, in the base; leave --in out")
    return "part" if in_ == "part" else "base"


def _check_destination(
    output: Path, start: Point | None, goal: Point | None, pairs: Path | None, reproduce: bool
) -> None:
    from dmpcli.records import record, streams
    from dmpcli.records.pairs import FARTHEST
    from dmpcli.workflows.ranges import within

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
