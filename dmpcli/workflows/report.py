"""`report`: by how much do the drawn strokes differ from the taught one."""

import contextlib
import csv
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import InputError, about
from dmpcli.messages import progress, tell, warn
from dmpcli.records import dataset, file_io, learning_record, schemas
from dmpcli.records import record as records
from dmpcli.records import skill as skills
from dmpcli.records.atomic_text import growing
from dmpcli.records.file_io import Source
from dmpcli.records.layouts import Layout
from dmpcli.records.learning_record import surface_key
from dmpcli.records.storage import Location, located
from dmpcli.reporting import document, pose_errors, provenance
from dmpcli.reporting.batch import STROKES, Tables, measure
from dmpcli.reporting.document import (
    FAR,
    MOST_ROWS,
    WAVES,
    DocumentPart,
    lesson_for,
    reference_of,
    write_waves,
)
from dmpcli.reporting.measurement_context import MeasurementContext
from dmpcli.reporting.ranking import Pupil
from dmpcli.reporting.recorded import Recorded
from dmpcli.reporting.report_surface import AT_ONCE, ReportSurface, placed
from dmpcli.reporting.stroke import ReportedStroke
from dmpcli.reporting.stroke_measures import Row
from dmpcli.reporting.strokes import labels_of, pairs_of, states_of, strokes_of
from dmpcli.settings.report import ReportOptions
from dmpcli.spatial.trajectory import Trajectory
from dmpcli.workflows import kernels, recording
from dmpcli.workflows.report_jobs import ReportProcesses
from dmpcli.workflows.report_sites import SiteGrounds
from dmpcli.workflows.surface_input import SurfaceInput

if TYPE_CHECKING:
    from dmpcli.reporting import figures

WIDTH = 80
"""Columns that tables are printed in where no terminal says otherwise."""

_SHOWN = 3
_DEFAULTS = ReportOptions()
_WAVES, _STROKES = "wave_heights.csv", "strokes.csv"


@dataclass(frozen=True)
class StrokeReport:
    """What was measured, as plain values.

    Attributes
    ----------
    document : dict
        As in ``report.json``: docs/report.md tells what stands where.
    """

    document: Row

    def __str__(self) -> str:
        """Return the tables."""
        return self.text()

    def text(self, width: int = WIDTH) -> str:
        """Return it as tables for people, without terminal codes."""
        return document.as_text(self.document, width)

    def json(self) -> bytes:
        """Return it as the file ``report.json``."""
        return document.as_json(self.document)

    @property
    def strokes(self) -> list[Row]:
        """The rows of all strokes that have one, in the order of the inputs."""
        return [row for entry in self.document["files"] for row in entry["strokes"]]


def check_output(output: Location | None) -> None:
    """Refuse the name of a folder that is a file's.

    Raises
    ------
    InputError
    """
    if output is not None and output.exists() and not output.is_dir():
        raise InputError(f"{output}: is a file, -o needs the name of a folder")


def report(
    inputs: Sequence[str | Source],
    names: Sequence[str] | None,
    layout: Layout | None,
    read: SurfaceInput | None,
    output: Location | None,
    grounds: SiteGrounds | None = None,
    paper: bool = False,
    view: bool = False,
    png: bool = False,
    how: ReportOptions = _DEFAULTS,
) -> StrokeReport:
    """Compare strokes, write the report's folder where one is named, and tell what is doubtful.

    Parameters
    ----------
    inputs : sequence of str or Source
        Demonstrations, trajectories, batch folders, runs and skills, by file or by content; the
        first demonstration is what the others are compared with.
    names : sequence of str, optional
        What tables call them; by default their files' names.
    layout : Layout, optional
        How recordings of other programs are read.
    read : SurfaceInput, optional
        What the strokes lie on.
    output : Path or ObjectPath, optional
        Folder of the page, JSON, CSV and figures.
    grounds : SiteGrounds, optional
        What the strokes of batches lie on, each on its own.
    paper : bool
        Whether to set the paper's tables beside ours and to draw its figures instead of ours.
    view : bool
        Whether to write a part that can be turned, too.
    png : bool
        Whether to write the figures as PNG, too.
    how : ReportOptions
        In how many processes, on which no figure depends, and by what means large batches are
        measured.

    Raises
    ------
    InputError
        One cannot be read, or holds nothing to report.
    """
    ground = normal = None
    said = None if grounds is None else grounds.said
    if read is not None:
        ground, said, normal = _ground(read)
    files = [each.name if isinstance(each, Source) else each for each in inputs]
    labels = labels_of(files) if names is None else names
    parts = [
        _part(each, label, normal, layout, grounds)
        for each, label in zip(inputs, labels, strict=True)
    ]
    parts = _seen(parts, ground)
    if ground is not None:
        parts = _placed(parts, ground)
    if grounds is not None:
        parts = _placed_apart(parts, grounds)
    if read is not None:
        _warn_of_ends(parts, read)
    with _tables(output, any(part.batch for part in parts)) as tables:
        compiled = _by_kernels(parts, ground, grounds, how)
        reference = reference_of(parts)
        sight = MeasurementContext(reference, ground, normal, grounds=grounds, compiled=compiled)
        parts = _measured(parts, sight, tables, how.jobs)
        if not paper:
            parts = _compared(parts)
        made = document.document(parts, said, paper)
        for line in document.warnings(made):
            warn(line)
        if output is not None:
            written = _write(output, made, parts, ground, paper, view, png)
    if output is not None:
        tell(f"{output}: wrote {written}")
    return StrokeReport(made)


def _part(
    given: str | Source,
    label: str,
    normal: Floats | None,
    form: Layout | None,
    grounds: SiteGrounds | None,
) -> DocumentPart:
    """Read one input, whatever it is; how recordings are seen, all of them together tell."""
    if isinstance(given, str) and given != file_io.DASH and (folder := located(given)).is_dir():
        return _batch(folder, label, normal, grounds)
    source = given if isinstance(given, Source) else file_io.read(given)
    if source.content.lstrip()[:1] == b"{":
        learned, file = skills.decode(source)
        with about(source.name):
            pupil = Pupil(label, learned, file, learning_record.of_skill(file))
        origin = provenance.of_skill(file)
        return DocumentPart(label, source.sha256, skills.SCHEMA, pupil=pupil, origin=origin)
    found = records.decode(source) if records.is_ours(source) else None
    if found is None or found.schema is schemas.DEMONSTRATION:
        seen = recording.whole(source, None if found else form, wrench=True)
        kind = "recording" if found is None else "demonstration"
        recorded = Recorded(
            seen.stroke,
            label,
            source.name,
            source.sha256,
            normal,
            force=None if seen.wrench is None else seen.wrench[:, :3],
            began=seen.began,
        )
        if found is not None:
            recorded.origin = found.provenance
        return DocumentPart(label, source.sha256, kind, recorded=recorded, origin=recorded.origin)
    run = found if found.schema is schemas.RUN else None
    states = None if run is None else states_of(run)
    with about(source.name):
        strokes = strokes_of(found, label, normal)
    name, origin = found.schema.name, found.provenance
    return DocumentPart(label, source.sha256, name, strokes, run, states=states, origin=origin)


def _batch(
    folder: Location, label: str, normal: Floats | None, grounds: SiteGrounds | None
) -> DocumentPart:
    """Read a batch: all strokes of a small one; of a large one what its parts say of themselves."""
    batch, odd = dataset.read(folder)
    for remark in odd:
        tell(remark)
    if grounds is not None:
        grounds.belongs(batch)
    if len(batch) > MOST_ROWS:
        with about(str(folder)):
            drawn_by = learning_record.of_facts(dataset.facts_of(batch))
        return DocumentPart(
            label,
            batch.sha256,
            schemas.PAIRS.name,
            batch=batch,
            lesson=drawn_by,
            origin=batch.provenance,
        )
    pairs = records.decode(file_io.read_table(folder), schemas.PAIRS)
    known, states = pairs_of(pairs)
    strokes, ids = [], []
    for name in batch.files:
        part = records.decode(file_io.read(folder / name), schemas.TRAJECTORY)
        with about(part.name):
            strokes += strokes_of(part, label, normal, known)
        ids += list(dict.fromkeys(part.columns["id"]))
    name, origin = schemas.PAIRS.name, pairs.provenance
    return DocumentPart(label, pairs.sha256, name, strokes, states=states, ids=ids, origin=origin)


def _ground(read: SurfaceInput) -> tuple[ReportSurface, Row, Floats | None]:
    """Return the surface as figures see it, what the report says of it, and a plane's normal."""
    from dmpcli.surfaces.mesh import Mesh  # loads libigl
    from dmpcli.surfaces.plane import Plane

    path = read.path
    found, key = read.surface, surface_key(read.facts)
    if isinstance(found, Mesh):
        return ReportSurface(path.name, found, found.V, found.F, key), read.said, None
    normal = found.normal if isinstance(found, Plane) else None
    return ReportSurface(path.name, found, key=key), read.said, normal


def _seen(parts: list[DocumentPart], ground: ReportSurface | None) -> list[DocumentPart]:
    """Let recordings be seen as the skills did that learned from them."""
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


def _placed(parts: list[DocumentPart], ground: ReportSurface) -> list[DocumentPart]:
    """Measure how every trajectory and run lies on the surface, those of all files together."""
    reference = reference_of(parts)
    every = [stroke for part in parts for stroke in part.strokes]
    found: list[ReportedStroke] = []
    with progress("measuring", len(every)) as advance:
        for first in range(0, len(every), AT_ONCE):
            some = every[first : first + AT_ONCE]
            found += placed(some, ground, reference)
            advance(len(some))
    lying = iter(found)
    return [replace(part, strokes=[next(lying) for _ in part.strokes]) for part in parts]


def _placed_apart(parts: list[DocumentPart], grounds: SiteGrounds) -> list[DocumentPart]:
    """Measure how the strokes of small batches lie on their own surfaces."""
    reference = reference_of(parts)
    done = []
    for part in parts:
        strokes = list(part.strokes)
        if part.ids:
            on = grounds.of(part.ids)
            for number in np.unique(on).tolist():
                rows = np.flatnonzero(on == number).tolist()
                some = placed([strokes[i] for i in rows], grounds.ground(number), reference)
                for i, one in zip(rows, some, strict=True):
                    strokes[i] = one
        done.append(replace(part, strokes=strokes))
    return done


def _warn_of_ends(parts: list[DocumentPart], read: SurfaceInput) -> None:
    """Say of strokes that were planned to begin or end off the surface where it is instead."""
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
def _tables(output: Location | None, batches: bool) -> Iterator[Tables | None]:
    """Open the tables that grow with the strokes; without a folder there are none."""
    if output is None:
        yield None
        return
    heads = {_WAVES: WAVES} | ({_STROKES: STROKES} if batches else {})
    with growing(output, list(heads)) as (waves, *strokes):
        for sink, head in zip((waves, *strokes), heads.values(), strict=True):
            csv.writer(sink, lineterminator="\n").writerow(head)
        yield Tables(waves, strokes[0] if strokes else None)


def _by_kernels(
    parts: list[DocumentPart],
    ground: ReportSurface | None,
    grounds: SiteGrounds | None,
    how: ReportOptions,
) -> bool:
    """Choose whether kernels measure large batches, and have them ready."""
    from dmpcli.surfaces.mesh import Mesh

    total = sum(len(part.batch) for part in parts if part.batch)
    if not total:
        return False
    on_mesh = grounds is not None or (ground is not None and isinstance(ground.surface, Mesh))
    if kernels.to_measure(how.kernels, total, on_mesh) == "pure":
        return False
    from dmpcli.reporting import ready_kernels

    # Other processes load what is kept; here it is needed only where this one measures.
    if how.jobs == 1 or not kernels.kept(ready_kernels):
        kernels.get_ready(ready_kernels)
    return True


def _measured(
    parts: list[DocumentPart], sight: MeasurementContext, tables: Tables | None, jobs: int
) -> list[DocumentPart]:
    """Measure large batches, and write down the wave heights of all strokes."""
    elsewhere = ReportProcesses(jobs) if jobs > 1 else None
    done = []
    total = sum(len(part.batch) for part in parts if part.batch)
    with progress("measuring", total) as advance:
        for part in parts:
            if part.batch is None:
                done.append(part)
                if tables is not None:
                    write_waves(part.strokes, tables.waves)
                continue
            many = measure(part.batch, part.name, sight, tables, advance, elsewhere)
            done.append(replace(part, strokes=many.shown, many=many))
    return done


def _compared(parts: list[DocumentPart]) -> list[DocumentPart]:
    """Set recordings beside the first recording, strokes beside the first, runs beside their plans.

    A trajectory is not set beside a recording: what it differs by is first of all where and when it
    was to be drawn.
    """
    recorded = [part for part in parts if part.recorded]
    planned = [part for part in parts if part.strokes and not part.recorded and not part.run]
    done = []
    for part in parts:
        found = None
        if part.run is not None:
            found = pose_errors.followed(part.run, part.name)
        elif part.recorded and part is not recorded[0]:
            here, there = _by_one_clock(part.recorded, recorded[0])
            found = pose_errors.compared(part.name, recorded[0].name, here, there)
            if found is None:
                tell(pose_errors.apart(part.name, recorded[0].name, here, there))
        elif len(part.strokes) == 1 and not recorded and part is not planned[0]:
            first = planned[0]
            if len(first.strokes) == 1:
                found = pose_errors.compared(
                    part.name, first.name, part.strokes[0].poses, first.strokes[0].poses
                )
        done.append(replace(part, compared=found))
    return done


def _by_one_clock(one: Recorded, first: DocumentPart) -> tuple[Trajectory, Trajectory]:
    """Return two recordings with times of one clock; of their own where a file tells none."""
    assert first.recorded is not None
    here, there = one.recording, first.recorded.recording
    if one.began is None or first.recorded.began is None:
        return here, there
    return replace(here, t=here.t + (one.began - first.recorded.began)), there


def _write(
    output: Location,
    report: Row,
    parts: list[DocumentPart],
    ground: ReportSurface | None,
    paper: bool,
    view: bool,
    png: bool,
) -> str:
    """Write each file whole; return their names."""
    from dmpcli.reporting import figures, page  # load matplotlib

    files = {"report.json": document.as_json(report)}
    drawn = figures.gallery(_shown(report, parts, ground, png or paper))
    if paper:
        strokes = [stroke for part in parts for stroke in part.strokes]
        drawn = [figure for figure in drawn if figure.name.startswith(("batch", "spread"))]
        from dmpcli.reporting import paper_figures

        files |= paper_figures.gallery(strokes, ground)
    else:
        files["report.html"] = page.page(report, drawn)
    for figure in drawn:
        files |= {f"{figure.name}.{suffix}": content for suffix, content in figure.files.items()}
    if view:
        from dmpcli.reporting import turnable

        strokes = [stroke for part in parts for stroke in part.strokes]
        files["view.html"] = turnable.page(strokes, ground, [p.run for p in parts if p.run])
    # What an earlier report wrote and this one does not would be taken for its own.
    ours = ("fig[0-9]_*", "batch_*", *(f"{name}*" for name in figures.NAMES))
    old: list[Location] = [
        path for name in ours for path in output.glob(name) if path.suffix in (".svg", ".png")
    ]
    old += [output / name for name in ("report.html", "view.html")]
    for path in old:
        if path.name not in files:
            path.unlink(missing_ok=True)
    batches = any(part.many for part in parts)
    if not batches:
        (output / _STROKES).unlink(missing_ok=True)
    for name, content in files.items():
        file_io.write(output / name, content)
    return ", ".join([*files, _WAVES, *([_STROKES] if batches else [])])


def _shown(
    report: Row, parts: list[DocumentPart], ground: ReportSurface | None, png: bool
) -> "figures.Shown":
    from dmpcli.reporting import figures

    entries = list(zip(parts, report["files"], strict=True))
    return figures.Shown(
        [stroke for part in parts for stroke in part.strokes],
        ground,
        [(part.name, part.run, entry["contact"]) for part, entry in entries if part.run],
        [part.compared for part in parts if part.compared and not part.run],
        [(part.name, part.pupil.skill) for part in parts if part.pupil],
        [part.many for part in parts if part.many],
        png,
    )
