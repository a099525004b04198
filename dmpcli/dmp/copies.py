"""Strokes side by side: copies that keep the chart of their pair and are shifted along v."""

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp.generalization import charts_of
from dmpcli.dmp.rollout import Pairs
from dmpcli.dmp.skill import Skill
from dmpcli.surfaces.surface import Surface

_AT_ONCE = 10_000


def copied(pairs: Pairs, count: int, spacing: float) -> Pairs:
    """Return each pair `count` times, in turn, shifted by 0, 1, 2, ... times `spacing`, mm.

    Parameters
    ----------
    pairs : Pairs
        B of them; their own shift, if they have one, is not kept.
    count : int
    spacing : float
        Along v of each pair's chart, mm; it may be negative.

    Returns
    -------
    Pairs
        B times `count`; starts and goals are those of the pair, and the shift stands beside them.
    """

    def repeated(values: Floats | None) -> Floats | None:
        return None if values is None else np.repeat(values, count, axis=0)

    return Pairs(
        np.repeat(pairs.start, count, axis=0),
        np.repeat(pairs.goal, count, axis=0),
        repeated(pairs.start_rotation),
        repeated(pairs.goal_rotation),
        np.tile(spacing * np.arange(count), len(pairs)),
    )


def ends(skill: Skill, pairs: Pairs, surface: Surface | None, turn: float) -> tuple[Floats, Floats]:
    """Starts and goals (B, 3) that strokes have themselves: of copies, those beside the pair's.

    Parameters
    ----------
    skill, surface
        As in `draw_blocks`.
    pairs : Pairs
        Those that can be drawn.
    turn : float
        Of a closed stroke's axes about the normal, rad.
    """
    if pairs.shift is None:
        return pairs.start, pairs.goal
    start, goal = pairs.start.copy(), pairs.goal.copy()
    for first in range(0, len(pairs), _AT_ONCE):
        rows = slice(first, first + _AT_ONCE)
        charts = charts_of(skill, pairs[rows], surface, turn)
        coordinates = np.zeros((len(charts), 2, 3))
        coordinates[:, 1] = charts.goals
        coordinates[..., 1] += pairs.shift[rows, None]
        start[rows], goal[rows] = charts.lift(coordinates).position.swapaxes(0, 1)
    return start, goal
