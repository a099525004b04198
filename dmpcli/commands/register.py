"""``dmpcli register``: a part and points touched on it in, its pose in the base frame out."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dmpcli.commands.options import Quiet
from dmpcli.errors import InputError, RefusedError

if TYPE_CHECKING:
    from dmpcli.arrays import Floats
    from dmpcli.records.mesh import MeshFile
    from dmpcli.records.pose import Pose
    from dmpcli.records.touched import Touched
    from dmpcli.surfaces.registration import Registration


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
            help="Touched points: CSV or Parquet with x y z (base frame, mm) [px py pz (part)].",
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
    unit: Annotated[
        str, typer.Option(help="Of the part's file and of px py pz: mm, cm, m or in.")
    ] = "mm",
    max_residual: Annotated[
        float, typer.Option(help="Largest distance of a touched point from the part, mm.")
    ] = 1.0,
    quiet: Quiet = False,
) -> None:
    """Find where a part lies from points touched on it."""
    from dmpcli.commands.messages import about, tell
    from dmpcli.records import mesh, pose, streams
    from dmpcli.records import touched as touched_file

    if not max_residual > 0.0:
        raise InputError(f"--max-residual {max_residual:g}: must be a length above 0")
    streams.check_writable(output)
    sources = {"part": streams.read(part), "touched": streams.read(touched)}
    waiting = mesh.waiting(sources["part"])
    if waiting is not None:
        tell(waiting, quiet)
    found = mesh.decode(sources["part"], unit)
    points = touched_file.read(sources["touched"])
    rough = None
    if initial is not None:
        rough, source = pose.parse(initial, "--initial")
        if source is not None:
            sources["initial"] = source
    for remark in found.remarks:
        tell(f"{part}: {remark}", quiet)
    tell(f"{part}: {mesh.summary(found)}", quiet)
    with about(str(touched)):
        result = _registered(found, points, mesh.UNITS[unit], rough)
    _check_residual(result, points, max_residual)
    conditioning = result.conditioning
    content = pose.encode(
        pose.Pose(result.position, result.rotation),
        pose.Residuals(
            points=len(result.residual), rms=result.rms, largest=float(result.residual.max())
        ),
        pose.Conditioning(
            number=conditioning.number,
            gain=float(conditioning.gains[-1]),
            weakest=conditioning.weakest,
            uncertainty=result.uncertainty,
        ),
        {"unit": unit, "initial": initial if "initial" not in sources else None},
        [{"role": role, "sha256": source.sha256} for role, source in sources.items()],
    )
    streams.write(output, content)
    tell(
        f"{output}: {len(result.residual)} points, residual {result.rms:.4f} mm RMS, "
        f"{result.residual.max():.4f} mm at most; condition number {conditioning.number:.3g}",
        quiet,
    )
    tell(
        f"least certain, to {result.uncertainty:.2g} mm: the part {conditioning.weakest}",
        quiet,
    )


def _registered(
    found: "MeshFile", points: "Touched", scale: float, rough: "Pose | None"
) -> "Registration":
    import numpy as np

    from dmpcli.surfaces.mesh import Mesh
    from dmpcli.surfaces.registration import from_pairs, onto_surface

    paired = points.paired
    if paired.all():
        if rough is not None:
            raise InputError("every row has px py pz, which give the pose; leave --initial out")
        return from_pairs(scale * points.part, points.base)
    rotation, position = np.eye(3), np.zeros(3)
    if rough is not None:
        rotation, position = rough.rotation, rough.position
    elif paired.any():
        first = from_pairs(scale * points.part[paired], points.base[paired])
        rotation, position = first.rotation, first.position
    surface = Mesh(found.V, found.F)

    def closest(at: "Floats") -> "tuple[Floats, Floats]":
        hits = surface.closest(at)
        return hits.position, hits.normal

    return onto_surface(points.base, closest, rotation, position)


def _check_residual(result: "Registration", points: "Touched", limit: float) -> None:
    import numpy as np

    worst = int(np.argmax(result.residual))
    if result.residual[worst] <= limit:
        return
    table = points.table
    raise RefusedError(
        f"{table.name}: {table.at(worst)}: lies {result.residual[worst]:.3f} mm off the part "
        f"(median of all {np.median(result.residual):.3f} mm), more than --max-residual "
        f"{limit:g};\ntouch it again, "
        + (
            "check its px py pz, "
            if points.paired.all()
            else "give a better --initial or px py pz for three points, "
        )
        + "or raise the limit"
    )
