"""The report as one document of plain values, and its forms: JSON, tables, wave heights as CSV."""

import csv
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TextIO

from rich.table import Table

from dmpcli.errors import printable
from dmpcli.records import tolerance_mark
from dmpcli.records.dataset import BatchFolder
from dmpcli.records.learning_record import Lesson
from dmpcli.records.record import Provenance, Record
from dmpcli.records.schemas import OK
from dmpcli.reporting import (
    contact,
    paper_tables,
    pose_errors,
    provenance,
    ranking,
    stroke_measures,
    summary,
    tables,
)
from dmpcli.reporting.batch import MeasuredBatch
from dmpcli.reporting.pose_errors import Compared
from dmpcli.reporting.ranking import Pupil
from dmpcli.reporting.recorded import Recorded
from dmpcli.reporting.stroke import ReportedStroke
from dmpcli.reporting.stroke_measures import Row
from dmpcli.version import __version__

NAME, VERSION = "report", 1
UNITS = {
    "length": "mm",
    "time": "s",
    "speed": "mm/s",
    "ldlj": "1",
    "sparc": "1",
    "tilt": "degree",
    "stretch": "1",
}

MOST_ROWS = 20
"""A file of more strokes than this is reported by its statistics."""

LEAST_LIFT = 5e-4
"""Heights over the demonstration's plane below this are not spoken of, mm."""

FAR = 1.0
"""Strokes planned to start or end farther than this from the surface are spoken of, mm."""


@dataclass(frozen=True)
class DocumentPart:
    """One input of the report.

    Attributes
    ----------
    name : str
        What tables call it.
    sha256 : str
    schema : str
    strokes : list of ReportedStroke
    run : Record, optional
        The record itself, where it is a run.
    pupil : Pupil, optional
        The skill, where it is one.
    recorded : Recorded, optional
        The recording, where it is one.
    lesson : Lesson, optional
        Of a batch: how its skill saw the recordings.
    states : dict, optional
        Of a batch: how many pairs ended in each status.
    batch : BatchFolder, optional
        Of more than `MOST_ROWS` strokes.
    many : MeasuredBatch, optional
        Such a batch as measured; then `strokes` are those of them that are drawn.
    origin : Provenance, optional
        Where one of our own files comes from.
    compared : Compared, optional
        Pose by pose with the first of its kind, or with its plan.
    ids : list of str
        Of the strokes of a smaller batch.
    """

    name: str
    sha256: str
    schema: str
    strokes: list[ReportedStroke] = field(default_factory=list)
    run: Record | None = None
    pupil: Pupil | None = None
    recorded: Recorded | None = None
    lesson: Lesson | None = None
    states: dict[str, int] | None = None
    batch: BatchFolder | None = None
    many: MeasuredBatch | None = None
    origin: Provenance | None = None
    compared: Compared | None = None
    ids: list[str] = field(default_factory=list)


def lesson_for(parts: Sequence[DocumentPart], sha256: str) -> Lesson | None:
    """Return how a recording is seen on its own: as the first skill did that learned from it.

    A skill's file tells it, else a trajectory or run that was drawn with one.
    """
    said = [part.pupil.lesson for part in parts if part.pupil]
    said += [part.lesson for part in parts if part.lesson]
    said += [s.lesson for part in parts for s in part.strokes if s.lesson is not None]
    return next((lesson for lesson in said if sha256 in lesson.recordings), None)


def reference_of(parts: Sequence[DocumentPart]) -> ReportedStroke | None:
    """Return the demonstration that deviations are taken from: the first, built-in drag last."""
    taught = [s for part in parts for s in part.strokes if s.kind == "demonstration"]
    return next((s for s in taught if s.role == "demonstration"), taught[0] if taught else None)


def document(parts: Sequence[DocumentPart], surface: Row | None = None, paper: bool = False) -> Row:
    """Measure everything; the same inputs give the same document.

    Parameters
    ----------
    parts : sequence of DocumentPart
        In the order of the command line.
    surface : dict, optional
        Name and provenance of the surface that the strokes were placed on.
    paper : bool
        Whether to set the paper's tables beside ours.
    """
    reference = reference_of(parts)
    strokes = [stroke for part in parts for stroke in part.strokes]
    made = {
        "schema": NAME,
        "version": VERSION,
        "tool": __version__,
        "summary": [],
        "units": UNITS,
        "reference": reference.label if reference else None,
        "surface": surface,
        "files": [_entry(part, reference) for part in parts],
        "skills": ranking.ranking(
            [part.pupil for part in parts if part.pupil],
            [part.recorded for part in parts if part.recorded],
        ),
        "paper": paper_tables.comparisons(strokes) if paper else [],
    }
    made["summary"] = summary.sentences(made)
    return made


def as_json(report: Row) -> bytes:
    """Return the document as a JSON file."""
    text = json.dumps(report, indent=2, ensure_ascii=False, allow_nan=False)
    return f"{printable(text)}\n".encode()


WAVES = ["stroke", "role", "wave", "height_mm", "from_t_s", "to_t_s", "from_v_mm", "to_v_mm"]
"""Header of the CSV file with a row per wave height."""


def write_waves(strokes: Sequence[ReportedStroke], sink: TextIO) -> None:
    """Write every wave height of the strokes as a row of a CSV file."""
    rows = csv.writer(sink, lineterminator="\n")
    for stroke in strokes:
        wave = stroke.wave
        t = wave.at(stroke.t)
        for i, height in enumerate(wave.heights):
            values = (height, t[i], t[i + 1], wave.value[i], wave.value[i + 1])
            rows.writerow([stroke.label, stroke.role, i + 1, *(f"{x:.6f}" for x in values)])


def warnings(report: Row) -> list[str]:
    """What a person must know of the files: a line each."""
    lines = []
    for entry in report["files"]:
        mark = entry["beyond_tolerance"] or (entry["skill"] or {}).get("beyond_tolerance")
        if mark:
            lines.append(tolerance_mark.text(entry["file"], mark))
        if any(row["elsewhere"] for row in entry["strokes"]):
            lines.append(
                f"{entry['file']}: was taught on a surface that is not at hand, so that nothing is "
                "compared with it: name that one with --surface, or give the skill's file too"
            )
    return lines


def _counted(states: Mapping[str, int]) -> str:
    """Say how many pairs were drawn, and of the others how many and one reason."""
    drawn = states.get(OK, 0)
    bad = {status: n for status, n in states.items() if status != OK}
    if not bad:
        return f"{drawn} drawn"
    return f"{drawn} drawn, {sum(bad.values())} not; the first: {next(iter(bad))}"


def as_text(report: Row, width: int) -> str:
    """Return the document as tables for people, `width` columns wide, without terminal codes."""
    parts: list[Table | str] = []
    for group in groups(report):
        parts += [*group, ""]
    return tables.plain(parts[:-1], width)


def groups(report: Row) -> Iterator[list[Table | str]]:
    """Yield the document's tables, each with what there is to say of it."""
    rows = _rows(report)
    if rows:
        yield [tables.shape(rows), *_remarks(report, rows)]
        for table in (tables.waves(rows), tables.motion(rows), tables.drag(rows)):
            if table:
                yield [table]
        yield from _on_surface(report, rows)
    said = warnings(report)
    if said:
        yield list(said)
    for entry in report["files"]:
        yield from _batch(entry)
    yield from _runs(report)
    if report["skills"]:
        yield [ranking.table(report["skills"]), *ranking.notes(report["skills"])]
    for comparison in report["paper"]:
        yield [tables.paper(comparison), *comparison["notes"]]


def _batch(entry: Row) -> Iterator[list[Table | str]]:
    """Tables of a file of many strokes, and what became of its pairs."""
    if entry["statistics"]:
        yield [tables.statistics(entry["file"], entry)]
    if entry["worst"]:
        yield [tables.worst(entry["file"], entry)]
    if entry["failures"]:
        yield [tables.failures(entry["file"], entry["failures"])]
    if entry["states"]:
        yield [f"{entry['file']}: {_counted(entry['states'])}"]


def _runs(report: Row) -> Iterator[list[Table | str]]:
    """Tables of deadlines, contact and pose errors."""
    runs = [(e["file"], e["deadlines"]) for e in report["files"] if e["deadlines"]]
    if runs:
        yield [tables.deadlines(runs)]
    pressed = [(e["file"], e["contact"]) for e in report["files"] if e["contact"]]
    if pressed:
        yield [contact.table(pressed)]
        held = contact.coupled_table(pressed)
        if held is not None:
            yield [held]
    pairs = [entry["pose_error"] for entry in report["files"] if entry["pose_error"]]
    if pairs:
        yield [pose_errors.table(pairs), *pose_errors.remarks(pairs)]


def _entry(part: DocumentPart, reference: ReportedStroke | None) -> Row:
    # A batch measured part by part says the same of its strokes together, and more.
    rows = (
        [] if part.many else [stroke_measures.row_of(stroke, reference) for stroke in part.strokes]
    )
    many = len(rows) > MOST_ROWS
    entry = {
        "file": part.name,
        "sha256": part.sha256,
        "schema": part.schema,
        "count": len(rows),
        "strokes": [] if many else rows,
        "statistics": stroke_measures.statistics_of(rows) if many else None,
        "histograms": None,
        "worst": None,
        "states": part.states,
        "failures": None,
        "beyond_tolerance": _mark(part),
        "deadlines": stroke_measures.deadlines_of(part.run) if part.run else None,
        "contact": contact.contact_of(part.run) if part.run else None,
        "skill": stroke_measures.skill_of(part.pupil.file) if part.pupil else None,
        "pose_error": pose_errors.row_of(part.compared) if part.compared else None,
        "provenance": provenance.row_of(part.origin),
    }
    return entry | (part.many.entry() if part.many else {})


def _mark(part: DocumentPart) -> dict[str, float] | None:
    """By how much the skill that drew the strokes of a file misses its tolerance."""
    return next((stroke.mark for stroke in part.strokes if stroke.mark), None)


def _rows(report: Row) -> list[Row]:
    return [row for entry in report["files"] for row in entry["strokes"]]


def _on_surface(report: Row, rows: Sequence[Row]) -> Iterator[list[Table | str]]:
    """Tables of how the strokes lie on the surface, and what there is to say about them."""
    if report["surface"] is None:
        return
    for table in (tables.on_surface(report["surface"]["file"], rows), tables.along_surface(rows)):
        if table:
            yield [table]
    remarks: list[Table | str] = []
    for row in rows:
        lies = row["surface"]
        if lies and lies["remark"]:
            remarks.append(f"{row['stroke']}: no wave height along the surface: {lies['remark']}.")
        if lies and max(lies["start_off"], lies["goal_off"]) > FAR:
            remarks.append(
                f"{row['stroke']}: planned to start {lies['start_off']:.1f} mm and to end "
                f"{lies['goal_off']:.1f} mm off this surface: is it the one it was drawn on?"
            )
        if lies:
            remarks += _contact(row, lies)
    if remarks:
        yield remarks


def _contact(row: Row, lies: Row) -> list[str]:
    """Say what of a stroke touches the surface; none that knows no surface does."""
    if row["role"].startswith("original"):
        return []
    said = []
    if lies["offset"]:
        side = "off" if lies["offset"] > 0.0 else "inside"
        said.append(f"drawn {abs(lies['offset']):.4g} mm {side} the surface on purpose")
    if lies["contact_share"] < 1.0:
        said.append(f"in contact over {100.0 * lies['contact_share']:.0f} % of the path")
    if lies["contact_lift"] > 0.0:
        said.append(f"lifted by up to {lies['contact_lift']:.2f} mm")
    lines = [f"{row['stroke']}: {', '.join(said)}."] if said else []
    if not lies["contact_lift"] and (lies["lifted_max"] or 0.0) >= LEAST_LIFT:
        lines.append(
            f"{row['stroke']}: off the surface after taking off the demonstration's own height "
            f"over its plane, up to {lies['lifted_max']:.4f} mm."
        )
    return lines


def _remarks(report: Row, rows: Sequence[Row]) -> list[str]:
    remarks = []
    if report["reference"] and any(row["deviation"] for row in rows):
        remarks.append(f"Deviation from {report['reference']}, start and goal aligned.")
    for row in rows:
        raw = row["as_recorded"]
        if raw:
            height = raw["wave_height"]
            said = "" if height is None else f"as recorded the height is {height:.3f}, "
            kind = "simulated demonstration" if row["simulated"] else "demonstration"
            remarks.append(
                f"{row['stroke']}: {kind}, smoothed as fit does; {said}smoothing took off "
                f"{raw['removed_rms']:.3f} RMS."
            )
        if row["by_skill"]:
            remarks.append(
                f"{row['stroke']}: the surface that it was taught on is not at hand; its skill's "
                "curve stands for it, and how far that strays from the recording is added."
            )
        if row["closed"]:
            remarks.append(f"{row['stroke']}: closed, so there is no line to measure waves from.")
    return remarks
