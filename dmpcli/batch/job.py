"""What a batch is drawn from, and the one function that draws a part of it.

A job and a part travel to other processes and machines, so both hold plain values; wherever and
however often a part is drawn, its file has the same bytes.
"""

import contextlib
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from uuid import uuid4

from dmpcli.arrays import Floats, Integers
from dmpcli.errors import InputError
from dmpcli.primitives.drawing import Block, Stroke, Style, draw_blocks
from dmpcli.primitives.generalization import Pairs
from dmpcli.primitives.reach import Reach
from dmpcli.primitives.skill import Skill
from dmpcli.records import record, trajectory
from dmpcli.records.pairs import OK
from dmpcli.records.record import Form, Provenance, Record
from dmpcli.surfaces.protocol import Status, Surface


@dataclass(frozen=True)
class Task:
    """What to draw, where and how.

    Attributes
    ----------
    skill : Skill
    surface : Surface or None
    style : Style
    on_border : {'fail', 'clip', 'skip'}
        What becomes of a stroke that leaves the surface.
    reach : Reach, optional
        The arm that is to draw, which must be able to follow.
    """

    skill: Skill
    surface: Surface | None
    style: Style
    on_border: str
    reach: Reach | None = None


@dataclass(frozen=True)
class Job:
    """What all parts of a batch share.

    Attributes
    ----------
    task : Task
    stop : bool
        Whether a pair that cannot be drawn ends the batch, and keeps its part from being written.
    provenance : Provenance
        Of every part.
    form : Form
    folder : str
        Where the parts go; every process that draws must see it.
    """

    task: Task
    stop: bool
    provenance: Provenance
    form: Form
    folder: str


@dataclass(frozen=True)
class Part:
    """Some of the pairs, in the order of their table.

    Attributes
    ----------
    number : int
    rows : array of int, shape (n,)
        Of the table.
    ids : list of str, length n
    pairs : Pairs
        n pairs, on the surface.
    duration : array, shape (n,)
        Of each stroke without easing, s.
    """

    number: int
    rows: Integers
    ids: list[str]
    pairs: Pairs
    duration: Floats

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def file(self) -> str:
        """Name of the part's file."""
        return file_of(self.number)


def file_of(number: int) -> str:
    """Return the name of a part's file."""
    return f"part-{number:05d}.parquet"


@dataclass(frozen=True)
class Outcome:
    """What became of a part.

    Attributes
    ----------
    number : int
    failed : dict of str
        Why a pair could not be drawn, by its row in the table.
    clipped : dict of float
        How long a stroke lasts that ends at the border, s, by its row.
    unfolded : int
        How many strokes cross a sharp crease.
    rows, size : int
        Rows and bytes of the part's file; 0 where there is none.
    fatal : bool
        Whether a pair failed that ends the batch; then no file was written.
    """

    number: int
    failed: dict[int, str]
    clipped: dict[int, float]
    unfolded: int
    rows: int = 0
    size: int = 0
    fatal: bool = False

    def fact(self) -> dict[str, Any]:
        """Return what the part's own metadata remember of it."""
        return {
            "number": self.number,
            "failed": {str(row): why for row, why in self.failed.items()},
            "clipped": {str(row): seconds for row, seconds in self.clipped.items()},
            "unfolded": self.unfolded,
        }


FACT = "part"
"""Name of a part's own fact in its metadata; all else in them is the batch's."""


def settle(task: Task, strokes: Sequence[Stroke]) -> list[tuple[Stroke, str]]:
    """Return strokes as they are to be written, each with ``ok`` or why it cannot be drawn."""
    found = [_settled(task, stroke) for stroke in strokes]
    good = [i for i, (_, status) in enumerate(found) if status == OK]
    if task.reach is not None and good:
        refusals = task.reach.refusals([found[i][0] for i in good], task.style.rate)
        for i, refusal in zip(good, refusals, strict=True):
            found[i] = found[i][0], refusal or OK
    return found


def _settled(task: Task, stroke: Stroke) -> tuple[Stroke, str]:
    if stroke.status == Status.DRAWN:
        return stroke, OK
    if stroke.status == Status.BORDER and task.on_border == "clip":
        return stroke.until_border(), OK
    return stroke, stroke.status.said


def draw_part(job: Job, part: Part) -> Outcome:
    """Draw one part and write its file, whole or not at all.

    Parameters
    ----------
    job : Job
    part : Part
        Pairs that `admit` lets pass.

    Returns
    -------
    Outcome
        No file is written where no pair could be drawn, or one could not and `job.stop` is set.

    Raises
    ------
    InputError
        The skill's own numbers overflow, or the folder cannot be written.
    """
    task = job.task
    blocks = list(draw_blocks(task.skill, part.pairs, part.duration, task.surface, task.style))
    if len(blocks) == 1 and task.reach is None and (blocks[0].status == Status.DRAWN).all():
        outcome = Outcome(part.number, {}, {}, int(blocks[0].unfolded.sum()))
        drawn = trajectory.block_record(part.ids, blocks[0], job.provenance)
        return _written(job, part, outcome, drawn)
    raw = _in_order(blocks)
    settled = settle(task, raw)
    outcome = _outcome(job, part, raw, settled)
    kept = [i for i, (_, status) in enumerate(settled) if status == OK]
    if outcome.fatal or not kept:
        return outcome
    ids, strokes = [part.ids[i] for i in kept], [settled[i][0] for i in kept]
    drawn = trajectory.trajectory_record(ids, strokes, job.provenance)
    return _written(job, part, outcome, drawn)


def _in_order(blocks: list[Block]) -> list[Stroke]:
    strokes = [(int(row), block.stroke(i)) for block in blocks for i, row in enumerate(block.rows)]
    return [stroke for _, stroke in sorted(strokes, key=lambda entry: entry[0])]


def _outcome(
    job: Job, part: Part, drawn: list[Stroke], settled: list[tuple[Stroke, str]]
) -> Outcome:
    """What became of a part of which not all strokes are to be written as they were drawn."""
    failed: dict[int, str] = {}
    clipped: dict[int, float] = {}
    unfolded, fatal = 0, False
    for row, before, (stroke, status) in zip(part.rows.tolist(), drawn, settled, strict=True):
        if status != OK:
            failed[row] = status
            asked = stroke.status == Status.BORDER and job.task.on_border == "skip"
            fatal |= job.stop and not asked
            continue
        if len(stroke.position) < len(before.position):
            clipped[row] = float(stroke.timing.t[-1])
        unfolded += 1 if stroke.unfolded else 0
    return Outcome(part.number, failed, clipped, unfolded, fatal=fatal)


def _written(job: Job, part: Part, outcome: Outcome, drawn: Record) -> Outcome:
    facts = drawn.provenance.facts | {FACT: outcome.fact()}
    drawn = replace(drawn, provenance=replace(drawn.provenance, facts=facts))
    file = Path(job.folder) / part.file
    # Another machine may draw the same part: a name that nobody else has.
    temporary = file.with_name(f".{file.name}.{uuid4().hex}.tmp")
    try:
        # Not flushed to the disk one by one: after a power cut a part can be drawn again, and the
        # manifest tells its size.
        record.store(drawn, str(temporary), job.form)
        size = temporary.stat().st_size
        temporary.replace(file)
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else str(error)
        raise InputError(f"{file}: cannot be written: {reason}") from None
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink()
    return replace(outcome, rows=len(drawn.columns["t"]), size=size)
