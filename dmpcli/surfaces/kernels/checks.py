"""What most strokes on a mesh hold, compiled: those that `last_check` need not look at."""

import math
from typing import NamedTuple

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.compiled import kernel
from dmpcli.surfaces.kernels.tree import corner, flat_normal
from dmpcli.surfaces.kernels.vectors import Vector, dot, length, sub

_ROOM = 1e-6
"""Strokes nearer to a limit than this part of it are for numpy to decide on."""


class CheckLimits(NamedTuple):
    """What `last_check` calls by these names."""

    times: float
    more: float
    on: float
    tilted: float
    same: float
    met: float


class CheckedStrokes(NamedTuple):
    """What `last_check.Feet` has of B strokes, and start, goal and goal's coordinates (B, 3)."""

    coordinates: Floats
    position: Floats
    normal: Floats
    face: Integers
    stretch: Floats
    outside: Booleans
    start: Floats
    goal: Floats
    goals: Floats


@kernel
def _misses(
    s: CheckedStrokes, b: int, k: int, point: Vector, u: float, v: float, met: float, same: float
) -> bool:
    """Tell whether a sample with given coordinates is off the point that has them."""
    beside = max(abs(s.coordinates[b, k, 0] - u), abs(s.coordinates[b, k, 1] - v))
    here = s.position[b, k, 0], s.position[b, k, 1], s.position[b, k, 2]
    return bool(beside < same and length(sub(here, point)) > met)


@kernel
def sound(reals: Floats, rows: Integers, strokes: CheckedStrokes, limits: CheckLimits) -> Booleans:
    """Tell which strokes are surely not refused by `last_check.refusals`, shape (B,).

    `rows` tells where the faces of the mesh lie among `reals`, see `tree.Facets`.
    """
    s, room = strokes, 1.0 - _ROOM
    found = np.zeros(len(s.face), dtype=np.bool_)
    for b in range(len(s.face)):
        good, last = True, s.face.shape[1] - 1
        before = (0.0, 0.0, 0.0)
        for k in range(last + 1):
            if s.outside[b, k] or s.face[b, k] < 0:
                good = False
                break
            row = rows[s.face[b, k]]
            here = s.position[b, k, 0], s.position[b, k, 1], s.position[b, k, 2]
            n = s.normal[b, k, 0], s.normal[b, k, 1], s.normal[b, k, 2]
            flat = flat_normal(reals, row)
            good = abs(dot(flat, sub(here, corner(reals, row, 0)))) < limits.on * room
            good = good and abs(dot(flat, n)) > limits.tilted * (1.0 + _ROOM)
            if k > 0:
                du = s.coordinates[b, k, 0] - s.coordinates[b, k - 1, 0]
                dv = s.coordinates[b, k, 1] - s.coordinates[b, k - 1, 1]
                du *= max(abs(s.stretch[b, k]), abs(s.stretch[b, k - 1]))
                far = limits.times * math.sqrt(du * du + dv * dv) + limits.more
                good = good and length(sub(here, before)) < far * room
            before = here
            if not good:
                break
        if good:
            start = s.start[b, 0], s.start[b, 1], s.start[b, 2]
            goal = s.goal[b, 0], s.goal[b, 1], s.goal[b, 2]
            met, same = limits.met * room, limits.same * (1.0 + _ROOM)
            good = not _misses(s, b, 0, start, 0.0, 0.0, met, same)
            u, v = s.goals[b, 0], s.goals[b, 1]
            good = good and not _misses(s, b, last, goal, u, v, met, same)
        found[b] = good
    return found
