"""Nodes that shots walked: the last shot from start to goal is the chart's centre line."""

from dataclasses import dataclass, fields
from typing import Self

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.surfaces.geodesic_stepping import Front, Marks


@dataclass(frozen=True)
class WalkedNodes:
    """Nodes of B walks, S at most, the first of them one step from the start.

    Attributes
    ----------
    position, direction, normal : array, shape (B, S, 3)
        mm; unit vectors.
    away : array, shape (B, S)
        mm off the mesh.
    sharp, back : array of bool, shape (B, S)
        See `Marks`.
    trend : array, shape (B, 3)
        `Front.trend` at the last node.
    heading, step : array, shape (B, 3) and (B, 1)
        What the walks began with; a step of 0 where nothing is known.
    behind_before, behind_trend : array, shape (B, 3)
        What a walk the other way begins with, see `Front`.
    count : array of int, shape (B,)
        Nodes walked.
    """

    position: Floats
    direction: Floats
    normal: Floats
    away: Floats
    sharp: Booleans
    back: Booleans
    trend: Floats
    heading: Floats
    step: Floats
    behind_before: Floats
    behind_trend: Floats
    count: Integers

    @classmethod
    def unknown(cls, walks: int, nodes: int) -> Self:
        """Return courses to be filled in."""
        position, direction, normal = np.zeros((3, walks, nodes, 3))
        sharp, back = np.zeros((2, walks, nodes), dtype=bool)
        trend, heading, before, behind = np.zeros((4, walks, 3))
        step, count = np.zeros((walks, 1)), np.zeros(walks, dtype=np.int64)
        away = np.zeros((walks, nodes))
        return cls(
            position, direction, normal, away, sharp, back, trend, heading, step, before, behind,
            count,
        )  # fmt: skip

    @classmethod
    def begun(cls, ahead: Front, behind: Front, count: Integers) -> Self:
        """Return courses of so many nodes (B,) of walks that stand at their start."""
        made = cls.unknown(len(count), int(count.max(initial=0)))
        made.heading[:], made.step[:], made.count[:] = ahead.direction, ahead.step, count
        made.behind_before[:], made.behind_trend[:] = behind.before, behind.trend
        return made

    def add(self, rows: Integers, node: int, front: Front, marks: Marks) -> None:
        """Note where some of the walks stand after a step."""
        self.position[rows, node], self.direction[rows, node] = front.position, front.direction
        self.normal[rows, node], self.away[rows, node] = front.normal, front.away
        self.sharp[rows, node], self.back[rows, node] = marks.sharp, marks.back
        self.trend[rows] = front.trend

    def fill(self, rows: Integers, other: "WalkedNodes | None", which: Booleans) -> None:
        """Put some rows of other courses into these; without any, forget these rows."""
        if other is None:
            self.step[rows] = 0.0
            return
        nodes = min(self.away.shape[1], other.away.shape[1])
        for field in fields(self):
            mine, theirs = getattr(self, field.name), getattr(other, field.name)
            if mine.ndim > 1 and mine.shape[1] == self.away.shape[1]:
                mine[rows, :nodes] = theirs[which, :nodes]
            else:
                mine[rows] = theirs[which]

    def rows(self, rows: Integers) -> "WalkedNodes":
        """Return some of the courses."""
        return WalkedNodes(*(getattr(self, field.name)[rows] for field in fields(self)))

    def begin_as(self, heading: Floats, step: Floats) -> bool:
        """Tell whether all walks of these headings (B, 3) and steps (B, 1), mm, are known."""
        return bool((self.heading == heading).all() and (self.step == step).all())

    def end(self, rows: Integers, sign: Floats, part: Integers) -> Front:
        """Return some of the walks as they stand at their last nodes."""
        last = self.count[rows] - 1
        return Front(
            self.position[rows, last],
            self.direction[rows, last],
            self.normal[rows, last],
            self.normal[rows, last - 1],
            self.step[rows],
            sign[rows],
            part[rows],
            self.trend[rows],
            self.away[rows, last],
        )
