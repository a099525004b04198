"""``dmpcli report``: by how much do the drawn strokes differ from the taught one."""

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dmpcli.commands.options import SURFACES, Quiet, SurfacePose, SurfaceUnit
from dmpcli.errors import InputError
from dmpcli.messages import on_terminal
from dmpcli.settings.options import with_options
from dmpcli.settings.recording import RecordingOptions

if TYPE_CHECKING:
    from dmpcli.arrays import Floats
    from dmpcli.records.layouts import Layout
    from dmpcli.reporting.batch import Tables
    from dmpcli.reporting.batch_measures import MeasurementContext
    from dmpcli.reporting.document import DocumentPart
    from dmpcli.reporting.report_surface import ReportSurface
    from dmpcli.reporting.stroke_measures import Row
    from dmpcli.workflows.surface_input import SurfaceInput

_WIDTH = 80
_SHOWN = 3
_WAVES, _STROKES = "wave_heights.csv", "strokes.csv"


@with_options
def command(
    *,
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
        typer.Option(metavar="FILE", help=f"What the strokes lie on: {SURFACES}."),
    ] = None,
    surface_pose: SurfacePose = None,
    surface_unit: SurfaceUnit = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="DIR", help="Also write report.json, CSV and figures here."
        ),
    ] = None,
    form: RecordingOptions,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print JSON instead of the tables.")
    ] = False,
    quiet: Quiet = False,
) -> None:
    """Compare strokes: wave heights, deviation, smoothness, ends, deadlines."""
    on_terminal(quiet)
    from dmpcli.messages import tell, warn
    from dmpcli.records import file_io
    from dmpcli.reporting import batch_measures as many
    from dmpcli.reporting import document, strokes
    from dmpcli.workflows import surface_input

    if files.count("-") > 1:
        raise InputError("-: standard input can be read only once; name the other files")
    surface_input.check_options(surface, surface_pose, surface_unit)
    if output is not None and output.exists() and not output.is_dir():
        raise InputError(f"{output}: is a file, -o needs the name of a folder")
    layout = form.as_layout()
    ground = said = normal = read = None
    if surface is not None:
        read = surface_input.read(surface, surface_pose, surface_unit)
        ground, said, normal = _ground(read)
    labels = strokes.labels_of(files)
    parts = [_part(name, label, normal, layout) for name, label in zip(files, labels, strict=True)]
    parts = _seen(parts, ground)
    if ground is not None:
        parts = _placed(parts, ground)
    if read is not None:
        _warn_of_ends(parts, read)
    with _tables(output, any(part.batch for part in parts)) as tables:
        sight = many.MeasurementContext(document.reference_of(parts), ground, normal)
        parts = _measured(parts, sight, tables)
        report = document.document(parts, said)
        for line in document.warnings(report):
            warn(line)
        if output is not None:
            written = _write(output, report, parts, ground)
    if output is not None:
        tell(f"{output}: wrote {', '.join(written)}")
    if as_json:
        file_io.say(document.as_json(report))
    else:
        file_io.say(document.as_text(report, _width()).encode())


def _part(name: str, label: str, normal: "Floats | None", form: "Layout | None") -> "DocumentPart":
    """Read one input, whatever it is; how recordings are seen, all of them together tell."""
    from dmpcli.errors import about
    from dmpcli.records import file_io, learning_record, record, schemas, skill
    from dmpcli.reporting.document import DocumentPart
    from dmpcli.reporting.ranking import Pupil
    from dmpcli.reporting.recorded import Recorded
    from dmpcli.reporting.strokes import states_of, strokes_of

    if name != file_io.DASH and Path(name).is_dir():
        return _batch(Path(name), label, normal)
    source = file_io.read(name)
    if source.content.lstrip()[:1] == b"{":
        learned, file = skill.decode(source)
        with about(source.name):
            pupil = Pupil(label, learned, file, learning_record.of_skill(file))
        return DocumentPart(label, source.sha256, skill.SCHEMA, pupil=pupil)
    found = record.decode(source) if record.is_ours(source) else None
    if found is None or found.schema is schemas.DEMONSTRATION:
        from dmpcli.workflows.recording import recording as read_recording

        recording = read_recording(source, None if found else form)
        kind = "recording" if found is None else "demonstration"
        recorded = Recorded(recording, label, source.name, source.sha256, normal)
        if found is not None:
            recorded.origin = found.provenance
        return DocumentPart(label, source.sha256, kind, recorded=recorded)
    run = found if found.schema is schemas.RUN else None
    states = None if run is None else states_of(run)
    with about(source.name):
        strokes = strokes_of(found, label, normal)
    return DocumentPart(label, source.sha256, found.schema.name, strokes, run, states=states)


def _batch(folder: Path, label: str, normal: "Floats | None") -> "DocumentPart":
    """Read a batch: all strokes of a small one; of a large one what its parts say of themselves."""
    from dmpcli.errors import about
    from dmpcli.messages import tell
    from dmpcli.records import dataset, file_io, learning_record, record, schemas
    from dmpcli.reporting.document import MOST_ROWS, DocumentPart
    from dmpcli.reporting.strokes import pairs_of, strokes_of

    batch, odd = dataset.read(folder)
    for remark in odd:
        tell(remark)
    if len(batch) > MOST_ROWS:
        with about(str(folder)):
            drawn_by = learning_record.of_facts(dataset.facts_of(batch))
        return DocumentPart(label, batch.sha256, schemas.PAIRS.name, batch=batch, lesson=drawn_by)
    pairs = record.decode(file_io.read_table(folder), schemas.PAIRS)
    known, states = pairs_of(pairs)
    strokes = []
    for name in batch.files:
        part = record.decode(file_io.read(folder / name), schemas.TRAJECTORY)
        with about(part.name):
            strokes += strokes_of(part, label, normal, known)
    return DocumentPart(label, pairs.sha256, schemas.PAIRS.name, strokes, states=states)


def _ground(read: "SurfaceInput") -> "tuple[ReportSurface, Row, Floats | None]":
    """Return the surface as figures see it, what the report says of it, and a plane's normal."""
    from dmpcli.records.learning_record import surface_key
    from dmpcli.reporting.report_surface import ReportSurface
    from dmpcli.surfaces.mesh import Mesh
    from dmpcli.surfaces.plane import Plane

    path = read.path
    found, key = read.surface, surface_key(read.facts)
    if isinstance(found, Mesh):
        return ReportSurface(path.name, found, found.V, found.F, key), read.said, None
    normal = found.normal if isinstance(found, Plane) else None
    return ReportSurface(path.name, found, key=key), read.said, normal


def _seen(parts: "list[DocumentPart]", ground: "ReportSurface | None") -> "list[DocumentPart]":
    """Let recordings be seen as the skills did that learned from them."""
    from dataclasses import replace

    from dmpcli.errors import about
    from dmpcli.reporting.document import lesson_for

    pupils = [part.pupil for part in parts if part.pupil]
    done = []
    for part in parts:
        recorded = part.recorded
        if recorded is None:
            done.append(part)
            continue
        recorded.skills = [(pupil.lesson, pupil.skill) for pupil in pupils]
        recorded.surfaces = {} if ground is None else {ground.key: ground.surface}
        with about(recorded.name):
            stroke = recorded.stroke(lesson_for(parts, part.sha256))
        done.append(replace(part, strokes=[stroke]))
    return done


def _placed(parts: "list[DocumentPart]", ground: "ReportSurface") -> "list[DocumentPart]":
    """Measure how every trajectory and run lies on the surface."""
    from dataclasses import replace

    from dmpcli.messages import progress
    from dmpcli.reporting.document import reference_of
    from dmpcli.reporting.report_surface import AT_ONCE, placed

    reference = reference_of(parts)
    done = []
    with progress("measuring", sum(len(part.strokes) for part in parts)) as advance:
        for part in parts:
            strokes = []
            for first in range(0, len(part.strokes), AT_ONCE):
                some = part.strokes[first : first + AT_ONCE]
                strokes += placed(some, ground, reference)
                advance(len(some))
            done.append(replace(part, strokes=strokes))
    return done


def _warn_of_ends(parts: "list[DocumentPart]", read: "SurfaceInput") -> None:
    """Say of strokes that were planned to begin or end off the surface where it is instead."""
    from dmpcli.messages import warn
    from dmpcli.reporting.document import FAR
    from dmpcli.workflows import off_surface

    lines = []
    for stroke in (stroke for part in parts for stroke in part.strokes):
        lies = stroke.footing
        if lies is None:
            continue
        ends = {"start": (lies.start_off, stroke.start), "goal": (lies.goal_off, stroke.goal)}
        far = {name: end for name, end in ends.items() if end[0] > FAR}
        if not far:
            continue
        said = off_surface.distances({name: off for name, (off, _) in far.items()})
        lines.append((stroke.label, said, {name: point for name, (_, point) in far.items()}))
    for label, said, points in lines[:_SHOWN]:
        warn(f"{label}: {said} {read.path.name}; {off_surface.remedy(points, read)}")
    if len(lines) > _SHOWN:
        warn(f"and {len(lines) - _SHOWN} more strokes that begin or end off {read.path.name}")


@contextlib.contextmanager
def _tables(output: Path | None, batches: bool) -> "Iterator[Tables | None]":
    """Open the tables that grow with the strokes; without a folder there are none."""
    if output is None:
        yield None
        return
    import csv

    from dmpcli.records.atomic_text import growing
    from dmpcli.reporting.batch import STROKES, Tables
    from dmpcli.reporting.document import WAVES

    heads = {_WAVES: WAVES} | ({_STROKES: STROKES} if batches else {})
    with growing(output, list(heads)) as (waves, *strokes):
        for sink, head in zip((waves, *strokes), heads.values(), strict=True):
            csv.writer(sink, lineterminator="\n").writerow(head)
        yield Tables(waves, strokes[0] if strokes else None)


def _measured(
    parts: "list[DocumentPart]", sight: "MeasurementContext", tables: "Tables | None"
) -> "list[DocumentPart]":
    """Measure large batches, and write down the wave heights of all strokes."""
    from dataclasses import replace

    from dmpcli.messages import progress
    from dmpcli.reporting.batch import measure
    from dmpcli.reporting.document import write_waves

    done = []
    total = sum(len(part.batch) for part in parts if part.batch)
    with progress("measuring", total) as advance:
        for part in parts:
            if part.batch is None:
                done.append(part)
                if tables is not None:
                    write_waves(part.strokes, tables.waves)
                continue
            many = measure(part.batch, part.name, sight, tables, advance)
            done.append(replace(part, strokes=many.shown, many=many))
    return done


def _write(
    output: Path, report: "Row", parts: "list[DocumentPart]", ground: "ReportSurface | None"
) -> list[str]:
    """Write each file whole; return their names."""
    from dmpcli.records import file_io
    from dmpcli.reporting import document
    from dmpcli.reporting.batch_figures import batch_figures
    from dmpcli.reporting.figures import gallery, spreads

    strokes = [stroke for part in parts for stroke in part.strokes]
    files = {
        "report.json": document.as_json(report),
        **gallery(strokes, ground),
        **spreads([part.pupil.skill for part in parts if part.pupil]),
        **batch_figures([part.many for part in parts if part.many]),
    }
    # Figures of an earlier report that this one does not draw would be taken for its own.
    ours = ("fig[0-9]_*.*", "batch_*.*", "spread_*.*")
    for old in [path for name in ours for path in output.glob(name)]:
        if old.name not in files and old.suffix in (".svg", ".png"):
            old.unlink()
    batches = any(part.many for part in parts)
    if not batches:
        (output / _STROKES).unlink(missing_ok=True)
    for name, content in files.items():
        file_io.write(output / name, content)
    return [*files, _WAVES, *([_STROKES] if batches else [])]


def _width() -> int:
    """Columns to print in: the terminal's, and always the same into a file or a pipe."""
    import shutil
    import sys

    if sys.stdout is None or not sys.stdout.isatty():
        return _WIDTH
    return max(shutil.get_terminal_size().columns, _WIDTH)
