"""What a batch is drawn from, and the one function that draws a part of it.

A job and a part travel to other processes and machines, so both hold plain values; wherever and
however often a part is drawn, its file has the same bytes.
"""

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.batch.site import Prepare, PreparedSite, Remark, Site
from dmpcli.batch.task import Task
from dmpcli.dmp.drawn_strokes import DrawnBlock, DrawnStroke, GeneralizeOptions
from dmpcli.dmp.generalization import draw, draw_blocks
from dmpcli.dmp.rollout import Pairs
from dmpcli.dmp.tool_speed import LEAST_HELD, held
from dmpcli.errors import DmpError, InputError, RefusedError
from dmpcli.records import file_io, record, trajectory
from dmpcli.records.draft import Draft
from dmpcli.records.record import Form, Provenance, Record
from dmpcli.records.schemas import OK
from dmpcli.records.storage import located
from dmpcli.spatial import output_events
from dmpcli.spatial.output_events import OutputEvent
from dmpcli.surfaces.surface import LEAVES, Status, Surface


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
        Where the parts go, or the URL of an object store; every process that draws must see it.
    prepare : callable, optional
        Makes pairs ready whose table names their surfaces; `task` then has none.
    nested : bool
        Whether there are so many parts that they lie in several folders.
    """

    task: Task
    stop: bool
    provenance: Provenance
    form: Form
    folder: str
    prepare: Prepare | None = None
    nested: bool = False

    def file_of(self, number: int) -> str:
        """Return the name of a part's file."""
        return file_io.part_name(number, self.nested)


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
    sites : tuple of Site
        Where they lie, if the table says it.
    site : array of int, shape (n,), optional
        Which of the sites each pair has.
    """

    number: int
    rows: Integers
    ids: list[str]
    pairs: Pairs
    duration: Floats
    sites: tuple[Site, ...] = ()
    site: Integers | None = None

    def __len__(self) -> int:
        return len(self.rows)


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
    refused : bool
        Whether the first of those that failed did so as a stroke, not for its input.
    placed : dict of list
        Of pairs whose table names their surfaces: start and goal as drawn, and the normal of a
        plane, by the row.
    sites : list of list
        SHA-256 of the files of each site.
    told : list of Remark
        On the sites.
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
    refused: bool = True
    placed: dict[int, list[float]] = field(default_factory=dict)
    sites: list[list[str | None]] = field(default_factory=list)
    told: list[Remark] = field(default_factory=list)

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
        if self.sites:
            found["sites"] = self.sites
            found["placed"] = {str(row): place for row, place in self.placed.items()}
        return found


def outcome_of(fact: Mapping[str, Any], rows: int, size: int) -> Outcome:
    """Return the outcome of a part that was drawn, from its own fact.

    Parameters
    ----------
    fact : mapping
        As JSON gave it.
    rows, size : int
        Rows and bytes of the part's file.

    Raises
    ------
    KeyError, TypeError, ValueError, AttributeError
        It is not what `Outcome.fact` makes.
    """

    def by_row(name: str) -> dict[int, Any]:
        return {int(row): value for row, value in fact.get(name, {}).items()}

    return Outcome(
        int(fact["number"]),
        by_row("failed"),
        by_row("clipped"),
        int(fact["unfolded"]),
        rows,
        size,
        pieces=by_row("pieces"),
        slow=int(fact.get("slow", 0)),
        placed=by_row("placed"),
        sites=list(fact.get("sites", ())),
    )


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
    """Return strokes of these ids as they are to be written, or why they cannot be drawn.

    Parameters
    ----------
    task : Task
        What is switched along each, and the arm that must reach them.
    ids : sequence of str
        Of each stroke.
    strokes : sequence of DrawnStroke
        Of any status.

    Returns
    -------
    list of Settled
        One for each.
    """
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
    if job.prepare is not None:
        return _draw_sites(job, job.prepare, part)
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
    outcome = _outcome(job.stop, task.style, part.number, part.rows, raw, settled)
    return _kept(job, part, outcome, settled, job.provenance)


def _kept(
    job: Job, part: Part, outcome: Outcome, settled: Sequence[Settled], provenance: Provenance
) -> Outcome:
    """Write the strokes of a part that are to be written."""
    kept = [one for one in settled if one.status == OK]
    if outcome.fatal or not kept:
        return outcome
    ids = [name for one in kept for name in one.ids]
    strokes = [stroke for one in kept for stroke in one.strokes]
    events = [switched for one in kept for switched in one.events]
    drawn = trajectory.trajectory_record(ids, strokes, provenance, events)
    return _written(job, part, outcome, drawn)


def _draw_sites(job: Job, prepare: Prepare, part: Part) -> Outcome:
    """Draw a part whose pairs lie on surfaces of their own, one surface after the other."""
    assert part.site is not None
    settled: dict[int, Settled] = {}
    facts: dict[bool, dict[str, Any]] = {}
    outcomes = []
    for number, site in enumerate(part.sites):
        at = np.flatnonzero(part.site == number)
        rows = part.rows[at]
        try:
            one, told = prepare(site, [part.ids[i] for i in at], part.pairs[at], part.duration[at])
        except DmpError as error:
            if None in site.hashes():  # it was there when the table was read
                raise InputError(f"{error}, or this machine does not see it") from None
            failed = dict.fromkeys(rows.tolist(), str(error))
            refused = isinstance(error, RefusedError)
            outcomes.append(Outcome(part.number, failed, {}, 0, fatal=job.stop, refused=refused))
            continue
        # Only what is said of it: its surface is let go before the next one is read.
        if len(one.against) < len(one.pairs):
            facts.setdefault(one.turned, _facts_of(one))
        if one.against:
            failed = {int(rows[i]): said for i, said in one.against.items()}
            refused = bool(one.refused[min(one.against)])
            outcomes.append(Outcome(part.number, failed, {}, 0, fatal=job.stop, refused=refused))
        good = np.array([i for i in range(len(at)) if i not in one.against], dtype=np.int64)
        outcome = Outcome(part.number, {}, {}, 0, told=told)
        if len(good):
            raw = draw(one.task.skill, one.pairs[good], part.duration[at[good]], *_where(one.task))
            some = settle(one.task, [part.ids[i] for i in at[good]], raw)
            outcome = replace(
                _outcome(job.stop, one.task.style, part.number, rows[good], raw, some), told=told
            )
            settled |= dict(zip(at[good].tolist(), some, strict=True))
        outcomes.append(replace(outcome, placed=_placed(one, rows)))
    outcome = _joined(outcomes, [site.hashes() for site in part.sites])
    if not facts:
        return outcome
    # Turned over is what all strokes of a part are, or none is said to be.
    said = facts.get(False) or facts[True]
    provenance = replace(job.provenance, facts=job.provenance.facts | said)
    return _kept(job, part, outcome, [settled[i] for i in sorted(settled)], provenance)


def _where(task: Task) -> tuple[Surface | None, GeneralizeOptions]:
    return task.surface, task.style


def _placed(one: PreparedSite, rows: Integers) -> dict[int, list[float]]:
    """Start, goal and a plane's normal of each pair, by its row."""
    ends = np.hstack([one.start, one.goal]).tolist()
    return {row: place + (one.normal or []) for row, place in zip(rows.tolist(), ends, strict=True)}


def _facts_of(one: PreparedSite) -> dict[str, Any]:
    """What strokes say of their skill: turned over where all of them are."""
    skill, style = one.task.skill, one.task.style
    if one.turned:
        return trajectory.facts_of(skill.turned_over(), style, style.heights_over)
    return trajectory.facts_of(skill, style, style.heights)


def _joined(outcomes: Sequence[Outcome], hashes: list[list[str | None]]) -> Outcome:
    """Return what became of all sites of a part."""
    bad = [one for one in outcomes if one.failed]
    first = min(bad, key=lambda one: min(one.failed), default=None)

    def by_row(values: Iterable[Mapping[int, Any]]) -> dict[int, Any]:
        return dict(sorted((row, one) for each in values for row, one in each.items()))

    return replace(
        outcomes[0],
        failed=by_row(one.failed for one in outcomes),
        clipped=by_row(one.clipped for one in outcomes),
        unfolded=sum(one.unfolded for one in outcomes),
        fatal=any(one.fatal for one in outcomes),
        pieces=by_row(one.pieces for one in outcomes),
        slow=sum(one.slow for one in outcomes),
        refused=first is None or first.refused,
        placed=by_row(one.placed for one in outcomes),
        sites=hashes,
        told=[remark for one in outcomes for remark in one.told],
    )


def _in_order(blocks: list[DrawnBlock]) -> list[DrawnStroke]:
    strokes = [(int(row), block.stroke(i)) for block in blocks for i, row in enumerate(block.rows)]
    return [stroke for _, stroke in sorted(strokes, key=lambda entry: entry[0])]


def _outcome(
    stop: bool,
    style: GeneralizeOptions,
    number: int,
    rows: Integers,
    drawn: list[DrawnStroke],
    settled: list[Settled],
) -> Outcome:
    """What became of a part of which not all strokes are to be written as they were drawn."""
    failed: dict[int, str] = {}
    clipped: dict[int, float] = {}
    pieces: dict[int, list[PieceEnds]] = {}
    unfolded, slow, fatal = 0, 0, False
    for row, before, one in zip(rows.tolist(), drawn, settled, strict=True):
        if one.status != OK:
            failed[row] = one.status
            asked = before.status in LEAVES and style.on_border == "skip"
            fatal |= stop and not asked
            continue
        if before.cuts:
            pieces[row] = [_ends(piece) for piece in one.strokes]
        elif style.pace is not None or len(one.strokes[0].position) < len(before.position):
            clipped[row] = float(one.strokes[0].timing.t[-1])
        unfolded += 1 if one.strokes[0].unfolded else 0
        slow += any(is_slow(stroke, style) for stroke in one.strokes)
    return Outcome(number, failed, clipped, unfolded, fatal=fatal, pieces=pieces, slow=slow)


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
    file = located(job.folder) / job.file_of(part.number)
    draft: Draft | None = None
    try:
        # Another machine may draw the same part: a name that nobody else has. Not flushed to the
        # disk one by one: after a power cut a part can be drawn again, and the manifest tells its
        # size.
        if job.nested:
            file.parent.mkdir(exist_ok=True)
        draft = Draft(file)
        record.store(drawn, draft.stream, job.form)
        size = draft.keep()
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else str(error)
        if isinstance(error, FileNotFoundError):
            reason = "somebody removed its folder, or what was written; the same command goes on"
        raise InputError(f"{file}: cannot be written: {reason}") from None
    finally:
        if draft is not None:
            draft.drop()
    return replace(outcome, rows=len(drawn.columns["t"]), size=size)
