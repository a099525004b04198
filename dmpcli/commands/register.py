"""``dmpcli register``: a part and points touched on it in, its pose in the base frame out."""

from pathlib import Path
from typing import Annotated

import typer

from dmpcli.commands.options import Quiet
from dmpcli.errors import InputError
from dmpcli.messages import on_terminal
from dmpcli.settings.options import with_options
from dmpcli.settings.register import RegisterOptions

LARGE = 100_000
"""Faces on which the search takes some seconds."""


@with_options
def command(
    *,
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
        Path,
        typer.Option(
            "-o", "--output", metavar="FILE", help="Pose file (JSON).", show_default=False
        ),
    ],
    initial: Annotated[
        str | None,
        typer.Option(
            metavar="X Y Z RX RY RZ|FILE",
            help="Rough pose to begin from, mm and rad.  [default: that of px py pz, or no motion]",
        ),
    ] = None,
    settings: RegisterOptions,
    quiet: Quiet = False,
) -> None:
    """Find where a part lies from points touched on it."""
    on_terminal(quiet)
    from dmpcli.commands import register_checks
    from dmpcli.errors import about
    from dmpcli.messages import tell
    from dmpcli.records import file_io, mesh, pose, suffixes
    from dmpcli.records import touched as touched_file
    from dmpcli.spatial.pose import Pose
    from dmpcli.surfaces.mesh import Mesh
    from dmpcli.surfaces.registration import RegisteredPart
    from dmpcli.workflows.pose_hints import warn_of_angles

    guess, unit, max_error = settings.guess, settings.unit, settings.max_error
    if guess == "none" and initial is not None:
        raise InputError("--guess none searches all orientations; leave --initial out")
    suffixes.check(output, suffixes.JSON)
    file_io.check_writable(output)
    sources = {"part": file_io.read(part), "touched": file_io.read(touched)}
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
    part_shape = RegisteredPart.of(Mesh(found.V, found.F))
    scale = mesh.UNITS[unit]
    with about(str(touched)):
        first = register_checks.rough_pose(points, scale, rough, guess)
        result = register_checks.registered(points, part_shape, scale, first, max_error)
    register_checks.refuse_unsure(
        result, points, part_shape, first, settings.max_residual, max_error, initial is not None
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
        | ({} if max_error == RegisterOptions.max_error else {"max_error": max_error}),
        [{"role": role, "sha256": source.sha256} for role, source in sources.items()],
        unit,
        register_checks.runner_up(result),
    )
    file_io.write(output, content)
    register_checks.tell_of(result, points, str(output), first)
