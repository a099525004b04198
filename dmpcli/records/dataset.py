"""Dataset folders: many strokes as parts in pair order, and a table with a status per pair."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.errors import RefusedError
from dmpcli.primitives.drawing import Stroke, Style, draw
from dmpcli.primitives.generalization import Pairs
from dmpcli.primitives.skill import Skill
from dmpcli.records import record, streams, trajectory
from dmpcli.records.pairs import OK, PairTable
from dmpcli.records.record import Provenance
from dmpcli.surfaces.protocol import Status, Surface

PAIRS_PER_PART = 2000


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
    """

    skill: Skill
    surface: Surface | None
    style: Style
    on_border: str


def settled(task: Task, stroke: Stroke) -> tuple[Stroke, str]:
    """Return a stroke as it is to be written, and ``ok`` or why it cannot be drawn."""
    if stroke.status == Status.DRAWN:
        return stroke, OK
    if stroke.status == Status.BORDER and task.on_border == "clip":
        return stroke.until_border(), OK
    return stroke, stroke.status.reason


def write(
    folder: Path,
    task: Task,
    table: PairTable,
    pairs: Pairs,
    duration: Floats,
    provenance: Provenance,
    stop: bool,
    advance: Callable[[int], None],
) -> int:
    """Draw the good pairs of a table part by part, and last the table itself.

    Parameters
    ----------
    folder : Path
    task : Task
    table : PairTable
        Pairs that cannot be drawn get their status here.
    pairs : Pairs
        Those of the table, on the surface.
    duration : array, shape (B,)
        Of each stroke without easing, s.
    provenance : Provenance
    stop : bool
        Whether the first pair that cannot be drawn ends the run, with nothing written.
    advance : callable
        Told how many pairs are done.

    Returns
    -------
    int
        How many of the strokes cross a sharp crease.

    Raises
    ------
    RefusedError
        A pair cannot be drawn, and `stop` was asked for.
    """
    good = np.flatnonzero(table.good)
    normal = np.full((len(table), 3), np.nan)
    lasting = duration.copy()
    part_of = [""] * len(table)
    unfolded = 0
    provenance = replace(
        provenance, facts=trajectory.facts_of(task.skill) | {"rate": task.style.rate}
    )
    with streams.dataset(folder) as place:
        for number, first in enumerate(range(0, len(good), PAIRS_PER_PART)):
            rows = good[first : first + PAIRS_PER_PART]
            strokes = draw(task.skill, pairs[rows], duration[rows], task.surface, task.style)
            kept = _keep(task, table, rows, strokes, stop)
            name = f"part-{number:05d}.parquet"
            for row, stroke in kept:
                lasting[row] = stroke.timing.t[-1]
                part_of[row] = name
                unfolded += stroke.unfolded
                if stroke.normal is not None and len(stroke.normal) == 1:
                    normal[row] = stroke.normal[0]
            if kept:
                done = trajectory.trajectory_record(
                    [table.ids[row] for row, _ in kept], [stroke for _, stroke in kept], provenance
                )
                streams.write(place / name, record.encode(done))
            advance(len(rows))
        done = trajectory.pairs_record(
            table.ids, pairs, lasting, normal, part_of, table.status, provenance
        )
        streams.write(place / streams.TABLE, record.encode(done))
    return unfolded


def _keep(
    task: Task, table: PairTable, rows: Integers, strokes: list[Stroke], stop: bool
) -> list[tuple[int, Stroke]]:
    """Rows and strokes that can be drawn; the others get their status."""
    kept = []
    for row, drawn in zip(rows, strokes, strict=True):
        stroke, status = settled(task, drawn)
        if status == OK:
            kept.append((int(row), stroke))
            continue
        table.status[row] = f"{table.places[row]}, pair {table.ids[row]}: {status}"
        skipped = task.on_border == "skip" and stroke.status == Status.BORDER
        if stop and not skipped:
            raise RefusedError(
                f"{table.name}: {table.status[row]}; move the pair, or give --on-error skip"
            )
    return kept
