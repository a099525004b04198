"""How ``generalize`` draws one pair, its copies and pieces, into one record."""

from dataclasses import dataclass, replace

import numpy as np

from dmpcli.batch.settled import settle
from dmpcli.dmp.contact_heights import end_heights
from dmpcli.dmp.copies import ends as own_ends
from dmpcli.dmp.feasibility import snapped
from dmpcli.dmp.generalization import draw, seen_from
from dmpcli.errors import RefusedError, about, counted
from dmpcli.messages import tell, warn
from dmpcli.records import trajectory
from dmpcli.records.record import Record
from dmpcli.records.schemas import OK
from dmpcli.surfaces.surface import LEAVES
from dmpcli.workflows.generalize import Ready
from dmpcli.workflows.process import pieces, warn_of_speed

CREASE = "the stroke crosses a sharp crease, where no tool can follow the surface"
"""What is told of a stroke that was walked facet by facet over one."""


@dataclass(frozen=True)
class DrawnPair:
    """One pair as drawn.

    Attributes
    ----------
    record : Record
        Its trajectory file.
    said : str
        What was drawn, in words.
    """

    record: Record
    said: str


def draw_one(ready: Ready) -> DrawnPair:
    """Draw the stroke of one pair, with its copies and pieces, and tell what is doubtful.

    Raises
    ------
    RefusedError
        It cannot be drawn, or one of its copies cannot.
    """
    task, table = ready.task, ready.table
    given = task.surface
    pairs = table.pairs if given is None else snapped(table.pairs, given)
    with about("skill"):
        drawn = draw(task.skill, pairs, ready.duration, given, task.style)
    settled = settle(task, table.ids, drawn)
    skipped = set()
    if task.style.on_border == "skip" and any(one.status == OK for one in settled):
        skipped = {i for i, one in enumerate(drawn) if one.status in LEAVES}
    for i, one in enumerate(settled):
        which = f"copy {table.ids[i]}: " if len(table) > 1 else ""
        if i in skipped:
            warn(f"{which}skipped: {one.status}")
        elif one.status != OK:
            whole = one.status == drawn[i].status.said
            remedy = "" if whole else f"; {_remedy(one.status, given is not None)}"
            raise RefusedError(f"{which}{one.status}{remedy}")
    settled = [one for i, one in enumerate(settled) if i not in skipped]
    strokes = [stroke for one in settled for stroke in one.strokes]
    seen, heights = seen_from(task.skill, task.style, pairs, given)
    facts = ready.provenance.facts | trajectory.facts_of(seen, task.style, heights)
    start, goal = own_ends(task.skill, pairs, given, task.style.turn)
    if len(strokes) == len(table) == 1 and not drawn[0].cuts:
        facts |= trajectory.facts_of_stroke(strokes[0], task.style.rate, start[0], goal[0])
    else:
        facts |= trajectory.facts_of_several(strokes[0], task.style.rate)
    ids = [name for one in settled for name in one.ids]
    events = [switched for one in settled for switched in one.events]
    origin = replace(ready.provenance, facts=facts)
    record = trajectory.trajectory_record(ids, strokes, origin, events)
    if given is not None:
        moved = np.linalg.norm(
            [pairs.start - table.pairs.start, pairs.goal - table.pairs.goal], axis=2
        )
        tell(f"start moved {moved[0, 0]:.3f} mm and goal {moved[1, 0]:.3f} mm onto the surface")
    if any(stroke.unfolded for stroke in strokes):
        warn(CREASE)
    warn_of_speed(strokes, ids, task.style)
    rate, model = task.style.rate, task.skill.model
    split = any(stroke.cuts for stroke in drawn)
    if len(strokes) > 1 or split:
        return DrawnPair(record, f"{model} DMP, {pieces(strokes, ids, rate, split)}")
    [stroke] = strokes
    if len(stroke.position) < len(drawn[0].position):
        warn(f"clipped at the border: {len(stroke.position)} of {len(drawn[0].position)} poses")
    above = stroke.above(goal[0], end_heights(seen, heights)[1])
    miss = np.linalg.norm(stroke.position[-1] - above)
    return DrawnPair(
        record,
        f"{model} DMP, {counted(len(stroke.position), 'pose')}, {stroke.timing.t[-1]:.3f} s at "
        f"{rate:g} Hz, ends {miss:.4f} mm from the goal",
    )


def _remedy(status: str, on_surface: bool) -> str:
    """What to do about a stroke that the arm cannot reach or follow."""
    if "duration" in status:  # too fast for a joint
        return "give a longer --duration"
    return "move start and goal" + (", or choose another surface" if on_surface else "")
