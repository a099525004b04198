"""``dmpcli report``: by how much do the drawn strokes differ from the taught one."""

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dmpcli.errors import InputError

if TYPE_CHECKING:
    from dmpcli.arrays import Floats
    from dmpcli.figures.batch import Tables
    from dmpcli.figures.document import Part
    from dmpcli.figures.footing import Ground
    from dmpcli.figures.many import Sight
    from dmpcli.figures.measured import Row

_WIDTH = 80
_WAVES, _STROKES = "wave_heights.csv", "strokes.csv"


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
    from dmpcli.figures import document, many, stroke
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
    parts = [_part(name, label, normal, quiet) for name, label in zip(files, labels, strict=True)]
    if ground is not None:
        parts = _placed(parts, ground, quiet)
    with _tables(output, any(part.batch for part in parts)) as tables:
        sight = many.Sight(document.reference_of(parts), ground, normal)
        parts = _measured(parts, sight, tables, quiet)
        report = document.document(parts, said)
        if output is not None:
            written = _write(output, report, parts, ground)
    if output is not None:
        tell(f"{output}: wrote {', '.join(written)}", quiet)
    if as_json:
        streams.say(document.as_json(report))
    else:
        streams.say(document.as_text(report, _width()).encode())


def _part(name: str, label: str, normal: "Floats | None", quiet: bool) -> "Part":
    """Read one input, whatever it is."""
    from dmpcli.commands.messages import about
    from dmpcli.figures.document import Part
    from dmpcli.figures.stroke import demonstrated, states_of, strokes_of
    from dmpcli.records import record, recordings, schemas, skill, streams

    if name != streams.DASH and Path(name).is_dir():
        return _batch(Path(name), label, normal, quiet)
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
    states = None if run is None else states_of(run)
    with about(source.name):
        strokes = strokes_of(found, label, normal)
    return Part(label, source.sha256, found.schema.name, strokes, run, states=states)


def _batch(folder: Path, label: str, normal: "Floats | None", quiet: bool) -> "Part":
    """Read a batch: all strokes of a small one; of a large one what its parts say of themselves."""
    from dmpcli.commands.messages import about, tell
    from dmpcli.figures.document import MOST_ROWS, Part
    from dmpcli.figures.stroke import pairs_of, strokes_of
    from dmpcli.records import dataset, record, schemas, streams

    batch, odd = dataset.read(folder)
    for remark in odd:
        tell(remark, quiet)
    if len(batch) > MOST_ROWS:
        return Part(label, batch.sha256, schemas.PAIRS.name, batch=batch)
    pairs = record.decode(streams.read_table(folder), schemas.PAIRS)
    known, states = pairs_of(pairs)
    strokes = []
    for name in batch.files:
        part = record.decode(streams.read(folder / name), schemas.TRAJECTORY)
        with about(part.name):
            strokes += strokes_of(part, label, normal, known)
    return Part(label, pairs.sha256, schemas.PAIRS.name, strokes, states=states)


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


@contextlib.contextmanager
def _tables(output: Path | None, batches: bool) -> "Iterator[Tables | None]":
    """Open the tables that grow with the strokes; without a folder there are none."""
    if output is None:
        yield None
        return
    import csv

    from dmpcli.figures.batch import STROKES, Tables
    from dmpcli.figures.document import WAVES
    from dmpcli.records.growing import growing

    heads = {_WAVES: WAVES} | ({_STROKES: STROKES} if batches else {})
    with growing(output, list(heads)) as (waves, *strokes):
        for sink, head in zip((waves, *strokes), heads.values(), strict=True):
            csv.writer(sink, lineterminator="\n").writerow(head)
        yield Tables(waves, strokes[0] if strokes else None)


def _measured(
    parts: "list[Part]", sight: "Sight", tables: "Tables | None", quiet: bool
) -> "list[Part]":
    """Measure large batches, and write down the wave heights of all strokes."""
    from dataclasses import replace

    from dmpcli.commands.messages import progress
    from dmpcli.figures.batch import measure
    from dmpcli.figures.document import write_waves

    done = []
    total = sum(len(part.batch) for part in parts if part.batch)
    with progress("measuring", total, quiet) as advance:
        for part in parts:
            if part.batch is None:
                done.append(part)
                if tables is not None:
                    write_waves(part.strokes, tables.waves)
                continue
            many = measure(part.batch, part.name, sight, tables, advance)
            done.append(replace(part, strokes=many.shown, many=many))
    return done


def _write(output: Path, report: "Row", parts: "list[Part]", ground: "Ground | None") -> list[str]:
    """Write each file whole; return their names."""
    from dmpcli.figures import document
    from dmpcli.figures.batch_figures import batch_figures
    from dmpcli.figures.gallery import gallery
    from dmpcli.records import streams

    strokes = [stroke for part in parts for stroke in part.strokes]
    files = {
        "report.json": document.as_json(report),
        **gallery(strokes, ground),
        **batch_figures([part.many for part in parts if part.many]),
    }
    # Figures of an earlier report that this one does not draw would be taken for its own.
    for old in (*output.glob("fig[0-9]_*.*"), *output.glob("batch_*.*")):
        if old.name not in files and old.suffix in (".svg", ".png"):
            old.unlink()
    batches = any(part.many for part in parts)
    if not batches:
        (output / _STROKES).unlink(missing_ok=True)
    for name, content in files.items():
        streams.write(output / name, content)
    return [*files, _WAVES, *([_STROKES] if batches else [])]


def _width() -> int:
    """Columns to print in: the terminal's, and always the same into a file or a pipe."""
    import shutil
    import sys

    if sys.stdout is None or not sys.stdout.isatty():
        return _WIDTH
    return max(shutil.get_terminal_size().columns, _WIDTH)
