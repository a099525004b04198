"""The one function that draws a part of a batch.

Wherever and however often a part is drawn, its file has the same bytes.
"""

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dmpcli.arrays import Integers
from dmpcli.batch.part import FACT, Job, Outcome, Part, PieceEnds
from dmpcli.batch.settled import Settled, is_slow, settle
from dmpcli.batch.site import Prepare, PreparedSite
from dmpcli.batch.task import Task
from dmpcli.dmp.drawn_strokes import DrawnBlock, DrawnStroke, GeneralizeOptions
from dmpcli.dmp.generalization import draw, draw_blocks
from dmpcli.errors import DmpError, InputError, RefusedError
from dmpcli.records import record, trajectory
from dmpcli.records.draft import Draft
from dmpcli.records.record import Provenance, Record
from dmpcli.records.schemas import OK
from dmpcli.records.storage import located
from dmpcli.surfaces.surface import LEAVES, Status, Surface


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
