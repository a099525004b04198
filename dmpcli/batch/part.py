"""What a batch is drawn from, and the one function that draws a part of it.

A job and a part travel to other processes and machines, so both hold plain values; wherever and
however often a part is drawn, its file has the same bytes.
"""

import contextlib
import os
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.dmp.drawn_strokes import DrawnBlock, DrawnStroke, GeneralizeOptions
from dmpcli.dmp.generalization import draw_blocks
from dmpcli.dmp.rollout import Pairs
from dmpcli.dmp.skill import Skill
from dmpcli.dmp.tool_speed import LEAST_HELD, held
from dmpcli.errors import InputError
from dmpcli.kinematics.reachability import Reach
from dmpcli.records import file_io, record, trajectory
from dmpcli.records.record import Form, Provenance, Record
from dmpcli.records.schemas import OK
from dmpcli.spatial import output_events
from dmpcli.spatial.output_events import AskedEvent, OutputEvent
from dmpcli.surfaces.surface import LEAVES, Status, Surface


@dataclass(frozen=True)
class Task:
    """What to draw, where and how.

    Attributes
    ----------
    skill : Skill
    surface : Surface or None
    style : GeneralizeOptions
    reach : Reach, optional
        The arm that is to draw, which must be able to follow.
    events : tuple of AskedEvent
        What is switched along each stroke.
    """

    skill: Skill
    surface: Surface | None
    style: GeneralizeOptions
    reach: Reach | None = None
    events: tuple[AskedEvent, ...] = ()


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


PieceEnds = tuple[list[float], list[float], float]
"""Of a piece of a stroke: start and goal, mm, and how long it lasts, s."""


@dataclass(frozen=True)
class Outcome:
    """What became of a part.

    Attributes
    ----------
    number : int
    failed : dict of str
        Why a pair could not be drawn, by its row in the table.
    clipped : dict of float
        How long a stroke lasts whose pair does not tell it, s, by its row: one that ends at the
        border, or whose speed is held.
    pieces : dict of list
        Of a stroke that is split: of each piece start, goal and seconds, by the row.
    unfolded : int
        How many strokes cross a sharp crease.
    slow : int
        How many strokes hold the speed that was asked for on less than `LEAST_HELD` of the path.
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
    pieces: dict[int, list[PieceEnds]] = field(default_factory=dict)
    slow: int = 0

    def fact(self) -> dict[str, Any]:
        """Return what the part's own metadata remember of it."""
        found: dict[str, Any] = {
            "number": self.number,
            "failed": {str(row): why for row, why in self.failed.items()},
            "clipped": {str(row): seconds for row, seconds in self.clipped.items()},
            "unfolded": self.unfolded,
        }
        if self.pieces:
            found["pieces"] = {str(row): ends for row, ends in self.pieces.items()}
        if self.slow:
            found["slow"] = self.slow
        return found


FACT = "part"
"""Name of a part's own fact in its metadata; all else in them is the batch's."""


@dataclass(frozen=True)
class Settled:
    """What is written of a stroke.

    Attributes
    ----------
    ids : list of str
        One, or one for each piece of a stroke that is split.
    strokes : list of DrawnStroke
        As they are to be written, one for each id.
    status : str
        ``ok``, or why it cannot be drawn.
    events : list of tuple of OutputEvent
        What each of the strokes switches; empty where nothing was asked for.
    """

    ids: list[str]
    strokes: list[DrawnStroke]
    status: str
    events: list[tuple[OutputEvent, ...]] = field(default_factory=list)


def settle(task: Task, ids: Sequence[str], strokes: Sequence[DrawnStroke]) -> list[Settled]:
    """Return strokes of these ids as they are to be written, or why they cannot be drawn."""
    found = [_settled(task, name, stroke) for name, stroke in zip(ids, strokes, strict=True)]
    if task.events:
        found = [_switching(task, one) if one.status == OK else one for one in found]
    if task.reach is None:
        return found
    good = [i for i, one in enumerate(found) if one.status == OK]
    of = [i for i in good for _ in found[i].strokes]
    if good:
        parts = [stroke for i in good for stroke in found[i].strokes]
        refusals = task.reach.refusals(parts, task.style.rate)
        for i, refusal in zip(of, refusals, strict=True):
            if refusal and found[i].status == OK:
                found[i] = replace(found[i], status=refusal)
    return found


def _switching(task: Task, one: Settled) -> Settled:
    """Return strokes with the times at which they switch outputs, or why there is none."""
    try:
        events = [
            output_events.placed(task.events, piece.timing.t, piece.position, _height(task, piece))
            for piece in one.strokes
        ]
    except output_events.NotPlacedError as error:
        return replace(one, status=f"--event {error}")
    return replace(one, events=events)


def _height(task: Task, stroke: DrawnStroke) -> Floats | None:
    """Height of each sample over the work, mm: over the surface, else over the stroke's start."""
    if not any(event.place in ("lift", "touch") for event in task.events):
        return None
    x = stroke.position
    offset = 0.0 if task.style.heights is None else task.style.heights.offset
    if task.surface is not None:
        found = task.surface.closest(x)
        # On which side of the surface the tool is, the stroke itself tells.
        normal = found.normal if stroke.normal is None else stroke.normal
        return np.asarray(np.sum((x - found.position) * normal, axis=-1) - offset)
    return None if stroke.normal is None else np.asarray((x - x[0]) @ stroke.normal[0])


def _settled(task: Task, name: str, stroke: DrawnStroke) -> Settled:
    if stroke.status == Status.DRAWN:
        return Settled([name], [stroke], OK)
    if stroke.cuts:
        names = [f"{name}.{i}" for i in range(1, len(stroke.cuts) + 1)]
        return Settled(names, stroke.pieces(), OK)
    if stroke.status in LEAVES and task.style.on_border == "clip":
        clipped = stroke.until_border()
        # One pose is no stroke; of one that begins outside not even that is there.
        if len(clipped.position) > 1:
            return Settled([name], [clipped], OK)
    return Settled([name], [stroke], stroke.status.said)


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
    plain = len(blocks) == 1 and task.reach is None and task.style.pace is None
    plain = plain and not task.events
    if plain and (blocks[0].status == Status.DRAWN).all():
        outcome = Outcome(part.number, {}, {}, int(blocks[0].unfolded.sum()))
        drawn = trajectory.block_record(part.ids, blocks[0], job.provenance)
        return _written(job, part, outcome, drawn)
    raw = _in_order(blocks)
    settled = settle(task, part.ids, raw)
    outcome = _outcome(job, part, raw, settled)
    kept = [one for one in settled if one.status == OK]
    if outcome.fatal or not kept:
        return outcome
    ids = [name for one in kept for name in one.ids]
    strokes = [stroke for one in kept for stroke in one.strokes]
    events = [switched for one in kept for switched in one.events]
    drawn = trajectory.trajectory_record(ids, strokes, job.provenance, events)
    return _written(job, part, outcome, drawn)


def _in_order(blocks: list[DrawnBlock]) -> list[DrawnStroke]:
    strokes = [(int(row), block.stroke(i)) for block in blocks for i, row in enumerate(block.rows)]
    return [stroke for _, stroke in sorted(strokes, key=lambda entry: entry[0])]


def _outcome(job: Job, part: Part, drawn: list[DrawnStroke], settled: list[Settled]) -> Outcome:
    """What became of a part of which not all strokes are to be written as they were drawn."""
    failed: dict[int, str] = {}
    clipped: dict[int, float] = {}
    pieces: dict[int, list[PieceEnds]] = {}
    style = job.task.style
    unfolded, slow, fatal = 0, 0, False
    for row, before, one in zip(part.rows.tolist(), drawn, settled, strict=True):
        if one.status != OK:
            failed[row] = one.status
            asked = before.status in LEAVES and style.on_border == "skip"
            fatal |= job.stop and not asked
            continue
        if before.cuts:
            pieces[row] = [_ends(piece) for piece in one.strokes]
        elif style.pace is not None or len(one.strokes[0].position) < len(before.position):
            clipped[row] = float(one.strokes[0].timing.t[-1])
        unfolded += 1 if one.strokes[0].unfolded else 0
        slow += any(is_slow(stroke, style) for stroke in one.strokes)
    return Outcome(part.number, failed, clipped, unfolded, fatal=fatal, pieces=pieces, slow=slow)


def is_slow(stroke: DrawnStroke, style: GeneralizeOptions) -> bool:
    """Tell whether a stroke holds the speed that was asked for on less than `LEAST_HELD` of it."""
    if style.pace is None:
        return False
    return held(stroke.position, style.rate, style.pace.speed)[0] < LEAST_HELD


def _ends(piece: DrawnStroke) -> PieceEnds:
    x, t = piece.position, piece.timing.t
    return x[0].tolist(), x[-1].tolist(), float(t[-1] - t[0])


def _written(job: Job, part: Part, outcome: Outcome, drawn: Record) -> Outcome:
    facts = drawn.provenance.facts | {FACT: outcome.fact()}
    drawn = replace(drawn, provenance=replace(drawn.provenance, facts=facts))
    file = Path(job.folder) / part.file
    temporary: Path | None = None
    try:
        # Another machine may draw the same part: a name that nobody else has. Not flushed to the
        # disk one by one: after a power cut a part can be drawn again, and the manifest tells its
        # size.
        temporary, stream = file_io.temporary_of(file)
        with stream:
            record.store(drawn, stream, job.form)
        size = temporary.stat().st_size
        temporary.replace(file)
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else str(error)
        raise InputError(f"{file}: cannot be written: {reason}") from None
    finally:
        if temporary is not None:
            with contextlib.suppress(OSError):
                temporary.unlink()
    return replace(outcome, rows=len(drawn.columns["t"]), size=size)
