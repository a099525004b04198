"""``dmpcli report``: by how much do the drawn strokes differ from the taught one."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dmpcli.errors import InputError

if TYPE_CHECKING:
    from dmpcli.arrays import Floats
    from dmpcli.figures.document import Part
    from dmpcli.figures.footing import Ground
    from dmpcli.figures.measured import Row

_WIDTH = 80


def command(
    files: Annotated[
        list[str],
        typer.Argument(
            metavar="FILE...",
            help="Demonstrations, trajectories, batch folders, runs and skills; - is standard "
            "input. The first demonstration is what the others are compared with.",
            show_default=False,
        ),
    ],
    surface: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="What the strokes lie on: plane.json, or an STL, OBJ or PLY."
        ),
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
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="DIR", help="Also write report.json, CSV and figures here."
        ),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print JSON instead of the tables.")
    ] = False,
    quiet: Annotated[bool, typer.Option("-q", "--quiet", help="No messages.")] = False,
) -> None:
    """Compare strokes: wave heights, deviation, smoothness, ends, deadlines."""
    from dmpcli.commands.messages import tell
    from dmpcli.figures import document, stroke
    from dmpcli.records import streams

    if files.count("-") > 1:
        raise InputError("-: standard input can be read only once; name the other files")
    if surface is None and (surface_pose is not None or surface_unit is not None):
        raise InputError("--surface-pose and --surface-unit say where a --surface lies; name one")
    if output is not None and output.exists() and not output.is_dir():
        raise InputError(f"{output}: is a file, -o needs the name of a folder")
    ground, said, normal = None, None, None
    if surface is not None:
        ground, said, normal = _ground(surface, surface_pose, surface_unit, quiet)
    labels = stroke.labels_of(files)
    parts = [_part(name, label, normal) for name, label in zip(files, labels, strict=True)]
    if ground is not None:
        parts = _placed(parts, ground, quiet)
    report = document.document(parts, said)
    if output is not None:
        _make_folder(output)
        written = _write(output, report, parts, ground)
        tell(f"{output}: wrote {', '.join(written)}", quiet)
    if as_json:
        streams.say(document.as_json(report))
    else:
        streams.say(document.as_text(report, _width()).encode())


def _part(name: str, label: str, normal: "Floats | None") -> "Part":
    """Read one input, whatever it is."""
    from dmpcli.commands.messages import about
    from dmpcli.figures.document import Part
    from dmpcli.figures.stroke import demonstrated, strokes_of
    from dmpcli.records import record, recordings, schemas, skill, streams

    if name != streams.DASH and Path(name).is_dir():
        return _batch(Path(name), label, normal)
    source = streams.read(name)
    if source.content.lstrip()[:1] == b"{":
        return Part(label, source.sha256, skill.SCHEMA, skill=skill.decode(source)[1])
    found = record.decode(source) if record.is_ours(source) else None
    if found is None or found.schema is schemas.DEMONSTRATION:
        recording = recordings.stroke(source)
        kind, origin = ("recording", None) if found is None else ("demonstration", found.provenance)
        with about(source.name):
            return Part(
                label, source.sha256, kind, [demonstrated(recording, label, normal, origin)]
            )
    run = found if found.schema is schemas.RUN else None
    with about(source.name):
        return Part(label, source.sha256, found.schema.name, strokes_of(found, label, normal), run)


def _batch(folder: Path, label: str, normal: "Floats | None") -> "Part":
    """Read a batch: the pairs, and the parts that they name."""
    from dmpcli.commands.messages import about
    from dmpcli.figures.document import Part
    from dmpcli.figures.stroke import pairs_of, strokes_of
    from dmpcli.records import record, schemas, streams

    source = streams.read(folder / streams.TABLE)
    pairs = record.decode(source, schemas.PAIRS)
    known, states = pairs_of(pairs)
    strokes = []
    for name in dict.fromkeys(part for part in pairs.columns.get("part", ()) if part):
        part = record.decode(streams.read(folder / name), schemas.TRAJECTORY)
        with about(part.name):
            strokes += strokes_of(part, label, normal, known)
    return Part(label, source.sha256, schemas.PAIRS.name, strokes, states=states)


def _ground(
    path: Path, pose: str | None, unit: str | None, quiet: bool
) -> "tuple[Ground, Row, Floats | None]":
    """Read the surface and place it; also what the report says of it, and a plane's normal."""
    from dmpcli.commands.messages import tell
    from dmpcli.figures.footing import Ground
    from dmpcli.records import pose as pose_file
    from dmpcli.records import streams, surface
    from dmpcli.surfaces.mesh import Mesh
    from dmpcli.surfaces.plane import Plane

    source = streams.read(path)
    said: Row = {"file": path.name, "sha256": source.sha256, "unit": unit or "mm", "pose": None}
    placed = None
    if pose is not None:
        placed, pose_source = pose_file.parse(pose, "--surface-pose")
        if pose_source is None:
            said["pose"] = [float(word) for word in pose.split()]
        else:
            said["pose"] = {"sha256": pose_source.sha256}
    found = surface.load(source, unit, placed)
    if isinstance(found, Plane):
        return Ground(path.name, found), said, found.normal
    for remark in found.remarks:
        tell(f"{path}: {remark}", quiet)
    mesh = Mesh(found.V, found.F)
    return Ground(path.name, mesh, mesh.V, mesh.F), said, None


def _placed(parts: "list[Part]", ground: "Ground", quiet: bool) -> "list[Part]":
    """Measure how every trajectory and run lies on the surface."""
    from dataclasses import replace

    from dmpcli.commands.messages import progress
    from dmpcli.figures.document import reference_of
    from dmpcli.figures.footing import AT_ONCE, placed

    reference = reference_of(parts)
    done = []
    with progress("measuring", sum(len(part.strokes) for part in parts), quiet) as advance:
        for part in parts:
            strokes = []
            for first in range(0, len(part.strokes), AT_ONCE):
                some = part.strokes[first : first + AT_ONCE]
                strokes += placed(some, ground, reference)
                advance(len(some))
            done.append(replace(part, strokes=strokes))
    return done


def _make_folder(output: Path) -> None:
    """Make the folder of the report, or say why not."""
    try:
        output.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise InputError(f"{output}: is a file, -o needs the name of a folder") from None
    except OSError as error:
        raise InputError(f"{output}: cannot be made: {error.strerror}") from None


def _write(output: Path, report: "Row", parts: "list[Part]", ground: "Ground | None") -> list[str]:
    """Write each file whole; return their names."""
    from dmpcli.figures import document
    from dmpcli.figures.gallery import gallery
    from dmpcli.records import streams

    strokes = [stroke for part in parts for stroke in part.strokes]
    files = {
        "report.json": document.as_json(report),
        "wave_heights.csv": document.as_csv(parts),
        **gallery(strokes, ground),
    }
    # Figures of an earlier report that this one does not draw would be taken for its own.
    for old in output.glob("fig[0-9]_*.*"):
        if old.name not in files:
            old.unlink()
    for name, content in files.items():
        streams.write(output / name, content)
    return list(files)


def _width() -> int:
    """Columns to print in: the terminal's, and always the same into a file or a pipe."""
    import shutil
    import sys

    if sys.stdout is None or not sys.stdout.isatty():
        return _WIDTH
    return max(shutil.get_terminal_size().columns, _WIDTH)
