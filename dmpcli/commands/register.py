"""``dmpcli register``: a part and points touched on it in, its pose in the base frame out."""

from pathlib import Path
from typing import Annotated

import typer

from dmpcli.commands.options import Quiet
from dmpcli.errors import InputError
from dmpcli.messages import on_terminal

LARGE = 100_000
"""Faces on which the search takes some seconds."""


def command(
    part: Annotated[
        Path,
        typer.Argument(
            help="Mesh of the part (STL, OBJ, PLY, OFF) in its own axes.", show_default=False
        ),
    ],
    touched: Annotated[
        Path,
        typer.Argument(
            help="Touched points: CSV or Parquet with x y z (base frame, mm) [px py pz (part)] "
            "[ax ay az (how the tip came) or rx ry rz].",
            show_default=False,
        ),
    ],
    output: Annotated[
        Path, typer.Option("-o", "--output", help="Pose file (JSON).", show_default=False)
    ],
    initial: Annotated[
        str | None,
        typer.Option(
            metavar="X Y Z RX RY RZ|FILE",
            help="Rough pose to begin from, mm and rad. Default: that of px py pz, or no motion.",
        ),
    ] = None,
    guess: Annotated[
        str,
        typer.Option(
            metavar="near|none",
            help="Search near the rough pose, or with none in all orientations.",
        ),
    ] = "near",
    unit: Annotated[
        str, typer.Option(help="Of the part's file and of px py pz: mm, cm, m or in.")
    ] = "mm",
    max_residual: Annotated[
        float, typer.Option(help="Largest distance of a touched point from the part, mm.")
    ] = 1.0,
    max_error: Annotated[
        float,
        typer.Option(help="Largest error left at any point of the part, with 95 %, mm."),
    ] = 1.5,
    quiet: Quiet = False,
) -> None:
    """Find where a part lies from points touched on it."""
    on_terminal(quiet)
    from dmpcli.commands import register_checks
    from dmpcli.errors import about
    from dmpcli.messages import tell
    from dmpcli.records import mesh, pose, streams
    from dmpcli.records import touched as touched_file
    from dmpcli.spatial.pose import Pose
    from dmpcli.surfaces.mesh import Mesh
    from dmpcli.surfaces.registration import LIMIT, Part
    from dmpcli.workflows.pose_hints import warn_of_angles

    _check(max_residual, max_error, guess, initial)
    streams.check_writable(output)
    sources = {"part": streams.read(part), "touched": streams.read(touched)}
    waiting = mesh.waiting(sources["part"])
    if waiting is not None:
        tell(waiting)
    found = mesh.decode(sources["part"], unit)
    points = touched_file.read(sources["touched"])
    rough = None
    if initial is not None:
        rough, source = pose.parse(initial, "--initial")
        if source is None:
            warn_of_angles("--initial", [float(word) for word in initial.split()[3:]])
        if source is not None:
            sources["initial"] = source
    for remark in found.remarks:
        tell(f"{part}: {remark}")
    tell(f"{part}: {mesh.summary(found)}")
    if len(found.F) > LARGE:
        tell(f"{part}: the search on {len(found.F)} faces takes a while")
    part_shape = Part.of(Mesh(found.V, found.F))
    scale = mesh.UNITS[unit]
    with about(str(touched)):
        first = register_checks.rough_pose(points, scale, rough, guess)
        result = register_checks.registered(points, part_shape, scale, first, max_error)
    register_checks.refuse_unsure(
        result, points, part_shape, first, max_residual, max_error, initial is not None
    )
    conditioning = result.conditioning
    content = pose.encode(
        Pose(result.position, result.rotation),
        pose.Residuals(
            points=len(result.residual), rms=result.rms, largest=float(result.residual.max())
        ),
        pose.Conditioning(
            number=conditioning.number,
            gain=float(conditioning.gains[-1]),
            weakest=conditioning.weakest,
            uncertainty=result.uncertainty,
        ),
        {"unit": unit, "initial": initial if "initial" not in sources else None}
        | ({} if guess == "near" else {"guess": guess})
        | ({} if max_error == LIMIT else {"max_error": max_error}),
        [{"role": role, "sha256": source.sha256} for role, source in sources.items()],
        unit,
        register_checks.runner_up(result),
    )
    streams.write(output, content)
    register_checks.tell_of(result, points, str(output), first)


def _check(max_residual: float, max_error: float, guess: str, initial: str | None) -> None:
    for option, value in (("--max-residual", max_residual), ("--max-error", max_error)):
        if not value > 0.0:
            raise InputError(f"{option} {value:g}: must be a length above 0")
    if guess not in ("near", "none"):
        raise InputError(f"--guess {guess}: must be near or none")
    if guess == "none" and initial is not None:
        raise InputError("--guess none searches all orientations; leave --initial out")
