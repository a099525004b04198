"""What is written of strokes that were drawn: whole, cut, clipped, with outputs, or not at all."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.batch.task import Task
from dmpcli.dmp.drawn_strokes import DrawnStroke, GeneralizeOptions
from dmpcli.dmp.tool_speed import LEAST_HELD, held
from dmpcli.records.schemas import OK
from dmpcli.spatial import output_events
from dmpcli.spatial.output_events import OutputEvent
from dmpcli.surfaces.surface import LEAVES, Status


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


def is_slow(stroke: DrawnStroke, style: GeneralizeOptions) -> bool:
    """Tell whether a stroke holds the speed that was asked for on less than `LEAST_HELD` of it."""
    if style.pace is None:
        return False
    return held(stroke.position, style.rate, style.pace.speed)[0] < LEAST_HELD
