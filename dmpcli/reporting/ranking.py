"""Skills ranked by how well they give back what was recorded."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from rich.table import Table

from dmpcli.dmp.basis_search import Quality
from dmpcli.dmp.recall import recalled, recalled_as_paper
from dmpcli.dmp.skill import Skill
from dmpcli.records.learning_record import Lesson
from dmpcli.records.skill import Reproduction, SkillFile
from dmpcli.reporting import tables
from dmpcli.reporting.recorded import Recorded
from dmpcli.reporting.stroke_measures import Row

RECORDING, FILE = "recording", "file"


@dataclass(frozen=True)
class Pupil:
    """A skill of the report.

    Attributes
    ----------
    label : str
    skill : Skill
    file : SkillFile
    lesson : Lesson
    """

    label: str
    skill: Skill
    file: SkillFile
    lesson: Lesson


def ranking(pupils: Sequence[Pupil], recordings: Sequence[Recorded]) -> list[Row]:
    """Hold each skill against its recordings, and list the best first.

    Parameters
    ----------
    pupils : sequence of Pupil
    recordings : sequence of Recorded
        Those of the report. A skill none of whose recordings is among them stands there with what
        its file says.

    Returns
    -------
    list of dict
        Of several recordings the root mean square of the RMS, and the worst of all else. Lengths in
        mm, angles in degrees; None where a figure does not exist.
    """
    return sorted((_row(pupil, recordings) for pupil in pupils), key=lambda row: row["rms"])


def _row(pupil: Pupil, recordings: Sequence[Recorded]) -> Row:
    found = list(_qualities(pupil, recordings))
    held = RECORDING if found else FILE
    if not found:
        found = [_said(part) for part in pupil.file.reproduction]
    waves = [q.wave for q in found if q.wave is not None and q.wave[0] > 0.0]
    worst = max(waves, key=lambda w: abs(w[1] / w[0] - 1.0), default=None)
    reached = pupil.skill.reached
    return {
        "skill": pupil.label,
        "held_against": held,
        "recordings": len(found),
        "learning": pupil.skill.learning,
        "rms": math.sqrt(float(np.mean([q.rms**2 for q in found]))),
        "largest": max(q.largest for q in found),
        "end": max(q.end for q in found),
        "wave": None if worst is None else list(worst),
        "wave_kept": None if worst is None else worst[1] / worst[0],
        "angle": math.degrees(max(q.angle for q in found)) if pupil.skill.oriented else None,
        "basis": len(pupil.skill.basis),
        "passes": pupil.skill.passes,
        "tolerance": None if reached is None else reached.tolerance,
        "within": None if reached is None else reached.within,
    }


def _qualities(pupil: Pupil, recordings: Sequence[Recorded]) -> Iterator[Quality]:
    lesson = pupil.lesson
    for recorded in recordings:
        if recorded.sha256 not in lesson.recordings:
            continue
        if lesson.learning == "paper":
            choices = lesson.choices(pupil.skill.model)
            seen = recorded.seen(lesson)
            yield recalled_as_paper(pupil.skill, recorded.recording, seen, choices)
            continue
        taught = recorded.taught(lesson)
        if taught is not None:
            yield recalled(pupil.skill, taught)


def _said(part: Reproduction) -> Quality:
    return Quality(part.rms, part.largest, part.end, part.wave, part.angle)


def table(rows: Sequence[Row]) -> Table:
    """Return the ranking as a table."""
    made = Table(
        title="Skills, the nearest to what was recorded first, mm and degrees",
        title_justify="left",
        box=None,
        pad_edge=False,
    )
    made.add_column("skill", overflow="fold")
    for name in ("N", "passes", "RMS", "max", "end", "wave kept", "angle"):
        made.add_column(name, justify="right", no_wrap=True)
    made.add_column("within", no_wrap=True)
    for row in rows:
        kept = row["wave_kept"]
        made.add_row(
            row["skill"] + ("" if row["held_against"] == RECORDING else " *"),
            str(row["basis"]),
            str(row["passes"]),
            *(tables.number(row[key], 4) for key in ("rms", "largest", "end")),
            "-" if kept is None else f"{100.0 * kept:.2f} %",
            tables.number(row["angle"], 3),
            _within(row),
        )
    return made


def _within(row: Row) -> str:
    if row["within"] is None:
        return "-"
    return f"{row['tolerance']:.3g}" if row["within"] else f"not {row['tolerance']:.3g}"


def notes(rows: Sequence[Row]) -> list[str]:
    """Say what stands beside the table."""
    own = [row["skill"] for row in rows if row["held_against"] == FILE]
    if not own:
        return []
    return [
        "* As the skill's file says: its recordings, or the surface that it was taught on, are not "
        "at hand."
    ]
