"""Charts inverted: from positions beside a surface back to u, v along it and w off it.

The foot of a position is where the normal that the chart draws with leads to it, so that `lift`
gives the position back. On a mesh that normal turns smoothly over the facets: 5 mm off a bumpy
field the closest point of the mesh lies up to 0.16 mm beside the foot.
"""

from dataclasses import dataclass, replace

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.surfaces import strip_inverse
from dmpcli.surfaces.mesh_charts import MeshCharts
from dmpcli.surfaces.plane import PlaneCharts
from dmpcli.surfaces.strip_inverse import Nearest
from dmpcli.surfaces.strip_settling import Course
from dmpcli.surfaces.surface import Charts, Status
from dmpcli.surfaces.tangential import NEAR, Sought, solved

ASTRAY = NEAR
"""Coordinates that lead to a point farther than this from the one sought are none, mm."""

FOLDS = 0.02
"""Where so little of an area is left as far off the surface as the position, feet are not told
apart: beyond the surface's centre of curvature there are several."""

# Nodes of the centre line and of the grid that first guesses are taken from, mm; how many at most.
_LINE_STEP, _GRID_STEP = 3.0, 6.5
_MOST_NODES = 600
_GRID_SHARE = 3.0
# A way on a surface is longer than its chord, by half a circle's at most while it does not return.
_ARC = 0.5 * np.pi
# A foot is the nearest place of the chart, but for what its curvature between the nodes hides, mm.
_FARTHER = 0.5
# Neighbours whose coordinates differ by more than so many times their distance, and by more than
# so many mm, are of different turns about the part.
_JUMP, _LEAST_JUMP = 5.0, 10.0
_MOST_JUMPS = 40
_TRIES = 2


@dataclass(frozen=True)
class Inverse:
    """Chart coordinates of positions.

    Attributes
    ----------
    coordinates : array, shape (B, T, 3)
        u, v, w, mm; NaN where the chart does not reach.
    axes : array, shape (B, T, 3, 3)
        C at the feet, as `Charts.lift` gives them there; NaN where the chart does not reach.
    reached : array of bool, shape (B, T)
    miss : array, shape (B, T)
        Distance of what `Charts.lift` makes of the coordinates to the position, mm.
    status : array of int, shape (B,)
        `Status` of the chart, or of its lift to these coordinates; where that says DRAWN and
        samples are not reached, BORDER if they are beside the surface, else FOLDED.
    """

    coordinates: Floats
    axes: Floats
    reached: Booleans
    miss: Floats
    status: Integers

    @property
    def complete(self) -> Booleans:
        """Strokes all of whose samples were reached, shape (B,)."""
        return np.asarray(self.reached.all(axis=1))


def invert(charts: Charts, position: Floats) -> Inverse:
    """Find chart coordinates of positions on or off a surface.

    On planes exactly. Strokes on a mesh, within `strip_inverse.HIGHEST` of it, are found on the
    nodes of their strips, see there; all others, and those that are not found so as a whole, by a
    search that lifts what it tries: u and v are sought until the line along the chart's normal
    meets it, by damped Newton steps on the gap's parts along e_u and e_v. They begin at the
    nearest point of the centre line; where that fails, at the nearest of a grid over the chart,
    then beside neighbours that were found. Turns about a part are counted on along the stroke.

    Where the surface is smooth, `lift` gives positions back within 1e-6 mm, from closer to it
    than its radius of curvature there. On a mesh the normal has kinks at the facets' edges, which
    cost steps, not accuracy. What `lift` misses by more than `ASTRAY` is told as not reached.

    Strokes do not depend on those beside them. On a mesh the samples of one stroke share a grid
    that is as wide as it swings: of a part of them the coordinates are others, by the grid's error
    of some thousandths of a mm.

    Parameters
    ----------
    charts : Charts
        B charts, of open or closed strokes.
    position : array, shape (B, T, 3)
        Along each stroke, mm; finite. Fill up shorter strokes with their last position.

    Returns
    -------
    Inverse
    """
    position = np.asarray(position, dtype=float)
    if isinstance(charts, PlaneCharts):
        return _flat(charts, position)
    shape = position.shape[:2]
    rows = np.flatnonzero(charts.status == Status.DRAWN)
    if len(rows) == len(position) > 0 and shape[1]:
        return _curved(charts, position)
    result = Inverse(
        np.full((*shape, 3), np.nan),
        np.full((*shape, 3, 3), np.nan),
        np.zeros(shape, dtype=bool),
        np.full(shape, np.nan),
        charts.status.copy(),
    )
    if len(rows) and shape[1]:
        part = _curved(charts.rows(rows), position[rows])
        result.coordinates[rows], result.axes[rows] = part.coordinates, part.axes
        result.reached[rows], result.miss[rows] = part.reached, part.miss
        result.status[rows] = part.status
    return result


def on_strips(
    charts: MeshCharts,
    position: Floats,
    course: Course | None = None,
    nearest: Nearest | None = None,
) -> Inverse:
    """Find coordinates as `invert` does, of the strokes that are found on strips alone.

    If they are one skill's they may have one course: see `strip_inverse.found`.
    """
    shape = position.shape[:2]
    rows = np.flatnonzero(charts.status == Status.DRAWN)
    if len(rows) == 0 or shape[1] == 0:
        return _of_strips(_nothing(shape[1]), shape)
    every = len(rows) == len(position)
    if not every:
        charts, position = charts.rows(rows), position[rows]
        nearest = nearest and (nearest[0][rows], nearest[1][rows])
    whole = _whole(charts, position, course, nearest)
    if len(whole.rows) == shape[0]:
        return _all_of_strips(whole)
    return _of_strips(replace(whole, rows=rows[whole.rows]), shape)


def _whole(
    charts: MeshCharts,
    given: Floats,
    course: Course | None = None,
    nearest: Nearest | None = None,
) -> strip_inverse.Found:
    """Strokes that are found on strips, and stay on one turn about the part."""
    whole = strip_inverse.found(charts, given, course, nearest)
    there = given if len(whole.rows) == len(given) else given[whole.rows]
    return whole.rows_of(~_jumps(whole.coordinates, there))


def _nothing(samples: int) -> strip_inverse.Found:
    none = np.empty(0, dtype=np.int64)
    shape = 0, samples
    return strip_inverse.Found(
        none, np.empty((*shape, 3)), np.empty((*shape, 3, 3)), np.empty(shape)
    )


def _all_of_strips(whole: strip_inverse.Found) -> Inverse:
    every = np.ones(whole.miss.shape, dtype=bool)
    status = np.full(len(every), np.int64(Status.DRAWN))
    return Inverse(whole.coordinates, whole.axes, every, whole.miss, status)


def _flat(charts: PlaneCharts, position: Floats) -> Inverse:
    good = charts.status == Status.DRAWN
    found = np.where(good[:, None, None], charts.coordinates(position), np.nan)
    axes = np.where(good[:, None, None, None], charts.axes[:, None], np.nan)
    return Inverse(
        found,
        np.broadcast_to(axes, (*found.shape, 3)),
        np.repeat(good[:, None], found.shape[1], axis=1),
        np.where(good[:, None], 0.0, np.zeros(found.shape[:2]) + np.nan),
        charts.status,
    )


def _curved(charts: Charts, given: Floats) -> Inverse:
    if not isinstance(charts, MeshCharts):
        return _by_steps(charts, given)
    whole = _whole(charts, given)
    if len(whole.rows) == len(given):
        return _all_of_strips(whole)
    rest = np.setdiff1d(np.arange(len(given)), whole.rows)
    result = _of_strips(whole, given.shape[:2])
    if len(rest):
        part = _by_steps(charts.rows(rest), given[rest])
        result.coordinates[rest], result.axes[rest] = part.coordinates, part.axes
        result.reached[rest], result.miss[rest] = part.reached, part.miss
        result.status[rest] = part.status
    return result


def _of_strips(whole: strip_inverse.Found, shape: tuple[int, ...]) -> Inverse:
    """Put strokes that were found on strips where they belong among others."""
    result = Inverse(
        np.full((*shape, 3), np.nan),
        np.full((*shape, 3, 3), np.nan),
        np.zeros(shape, dtype=bool),
        np.full(shape, np.nan),
        np.full(shape[0], np.int64(Status.DRAWN)),
    )
    result.coordinates[whole.rows], result.miss[whole.rows] = whole.coordinates, whole.miss
    result.axes[whole.rows], result.reached[whole.rows] = whole.axes, True
    return result


def _jumps(coordinates: Floats, position: Floats) -> Booleans:
    """Tell which strokes (R, T, 3) seem to go on at another turn about the part, shape (R,)."""
    step = np.diff(coordinates[..., :2], axis=1)
    # Of most strokes no step is so long that the way need be known.
    found = np.abs(step).max(axis=(1, 2)) > _LEAST_JUMP / np.sqrt(2.0)
    rows = np.flatnonzero(found)
    if len(rows):
        way = np.linalg.norm(np.diff(position[rows], axis=1), axis=-1)
        jumps = np.linalg.norm(step[rows], axis=-1) > _JUMP * way + _LEAST_JUMP
        found[rows] = jumps.any(axis=1)
    return np.asarray(found)


def _by_steps(charts: Charts, given: Floats) -> Inverse:
    """Find coordinates by steps with a lift each."""
    over = charts.over(given)
    # A search for what lies beside the surface would lead far off it: neighbours stand in.
    position = _between(given, over)
    none = ~over.any(axis=1)
    if none.any():
        position[none] = charts.lift(np.zeros((len(given), 1, 3))).position[none]
    low, high = _swing(charts, position)
    at, near = _beside_centre_line(charts, position, low, high)
    wide = _ARC * near.max(axis=1) + _GRID_STEP
    least, most = _ARC * low, charts.lengths + _ARC * (high - charts.lengths)
    box = np.stack([least, -wide], axis=-1)[:, None], np.stack([most, wide], axis=-1)[:, None]
    found = solved(charts, position, at, np.ones(near.shape, dtype=bool), box)
    bad = ~_right(found, near)
    again = np.flatnonzero(bad.any(axis=1))
    if len(again):
        found = _searched(charts, position, found, near, box, again)
    found = _counted_on(charts, position, found)
    return _judged(charts, position, found, over)


def _right(found: Sought, near: Floats) -> Booleans:
    """Tell which feet, at most as far as other places of the chart (B, T), were found."""
    return np.asarray(found.good & (np.abs(found.height) <= near + _FARTHER))


def _searched(
    charts: Charts,
    position: Floats,
    found: Sought,
    near: Floats,
    box: tuple[Floats, Floats],
    rows: Integers,
) -> Sought:
    """Seek again what was not found of some strokes: from a grid's nodes, then from neighbours."""
    some, there = charts.rows(rows), position[rows]
    part, inner = found.rows(rows), (box[0][rows], box[1][rows])
    bad = ~_right(part, near[rows])
    at, close = _on_grid(some, there, near[rows], inner)
    at = np.where(bad[..., None], at, part.at)
    part = part.better(solved(some, there, at, bad, inner), bad)
    for _ in range(_TRIES):
        good = _right(part, close)
        open_ = np.asarray((~good).any(axis=1) & good.any(axis=1))
        if not open_.any():
            break
        bad = ~good & open_[:, None]
        at = _between(part.at, good)
        part = part.better(solved(some, there, at, bad, inner), bad)
    # What is still not found must not widen the grid that the others lie on.
    good = _right(part, close)
    part = part.without(~good, _between(part.at, good))
    lost = np.flatnonzero(~good.all(axis=1))
    if len(lost):
        free = good[lost]
        last = solved(charts.rows(rows[lost]), there[lost], part.at[lost], free)
        part.put(lost, part.rows(lost).better(last, free, replace=True))
    found.put(rows, part)
    return found


def _counted_on(charts: Charts, position: Floats, found: Sought) -> Sought:
    """Carry coordinates on over the places where neighbours are of different turns."""
    for i in range(len(position)):
        good = np.flatnonzero(found.good[i])
        way = np.linalg.norm(np.diff(position[i, good], axis=0), axis=1)
        for _ in range(_MOST_JUMPS):
            step = np.linalg.norm(np.diff(found.at[i, good], axis=0), axis=1)
            jumps = np.flatnonzero(step > _JUMP * way + _LEAST_JUMP)
            if len(jumps) == 0:
                break
            first = jumps[0]
            last = jumps[1] if len(jumps) > 1 else len(good) - 1
            piece = good[first + 1 : last + 1]
            at = found.at[i : i + 1].copy()
            at[0, piece] += at[0, good[first]] - at[0, piece[0]]
            free = np.zeros((1, position.shape[1]), dtype=bool)
            free[0, piece] = True
            row = np.array([i])
            moved = solved(charts.rows(row), position[row], at, free)
            same = np.abs(moved.height - found.height[row]) <= _FARTHER
            if not (moved.good & same)[0, piece].all():
                way[first] = np.inf  # not another turn: a fold, or a gap in the recording
                continue
            found.put(row, found.rows(row).better(moved, free, replace=True))
    return found


def _judged(charts: Charts, position: Floats, found: Sought, over: Booleans) -> Inverse:
    """Lift what was found, and tell how well that gives the positions back."""
    coordinates = np.concatenate([found.at, found.height[..., None]], axis=-1)
    known = np.where(found.good[..., None], coordinates, coordinates * [1.0, 1.0, 0.0])
    lift = charts.lift(known)
    miss = np.linalg.norm(lift.position - position, axis=-1)
    usable = np.isin(lift.status, (Status.DRAWN, Status.BORDER))[:, None]
    reached = over & found.good & usable & ~lift.outside & (miss < ASTRAY) & (found.area > FOLDS)
    beside = np.where((~over | lift.outside).any(axis=1), Status.BORDER, Status.FOLDED)
    short = (lift.status == Status.DRAWN) & ~reached.all(axis=1)
    status = np.where(short, beside, lift.status)
    return Inverse(
        np.where(reached[..., None], coordinates, np.nan),
        np.where(reached[..., None, None], lift.axes, np.nan),
        reached,
        np.where(over & found.good & ~lift.outside, miss, np.nan),
        status,
    )


def _beside_centre_line(
    charts: Charts, position: Floats, low: Floats, high: Floats
) -> tuple[Floats, Floats]:
    """Guesses (B, T, 2) beside the centre line from low to high (B,), and distances (B, T), mm."""
    counts = np.minimum(_MOST_NODES, np.ceil((high - low) / _LINE_STEP).astype(np.int64) + 2)
    # Each stroke has its own nodes, whatever those beside it need; the last one fills up.
    share = np.minimum(1.0, np.arange(counts.max()) / (counts[:, None] - 1.0))
    u = low[:, None] + (high - low)[:, None] * share
    return _beside(charts, position, np.stack([u, 0.0 * u, 0.0 * u], axis=-1))


def _swing(charts: Charts, position: Floats) -> tuple[Floats, Floats]:
    """From where to where strokes may swing along u, shape (B,) each, mm."""
    ends = charts.lift(np.stack([0.0 * charts.goals, charts.goals], axis=1)).position
    away = np.linalg.norm(position[:, :, None] - ends[:, None], axis=-1)
    beyond = away.min(axis=-1).max(axis=-1)
    return -beyond - _LINE_STEP, charts.lengths + beyond + _LINE_STEP


def _on_grid(
    charts: Charts, position: Floats, near: Floats, box: tuple[Floats, Floats]
) -> tuple[Floats, Floats]:
    """Guesses (B, T, 2) beside the nodes of a grid over a box, and distances (B, T), mm."""
    at, found = np.zeros((*near.shape, 2)), near.copy()
    for i in range(len(position)):
        (low, _), (high, wide) = box[0][i, 0], box[1][i, 0]
        along, aside = np.ceil((high - low) / _GRID_STEP) + 1, np.ceil(wide / _GRID_STEP)
        # A coarser grid rather than an endless one.
        shrink = min(1.0, np.sqrt(_MOST_NODES / along / (2.0 * aside + 1.0)) * _GRID_SHARE)
        u = np.linspace(low, high, max(2, int(along * shrink)))
        v = np.linspace(-wide, wide, 2 * max(1, int(aside * shrink)) + 1)
        nodes = np.stack([*(a.reshape(-1) for a in np.meshgrid(u, v)), np.zeros(u.size * v.size)])
        row = slice(i, i + 1)
        at[row], there = _beside(charts.rows(np.array([i])), position[row], nodes.T[None])
        found[row] = np.minimum(near[row], there)
    return at, found


def _beside(charts: Charts, position: Floats, nodes: Floats) -> tuple[Floats, Floats]:
    """Guesses (B, T, 2) beside the nearest of nodes (B, N, 3) of the chart, and distances (B, T).

    Of nodes as near as each other the one least beside the line from start to goal.
    """
    from scipy.spatial import cKDTree

    lift = charts.lift(nodes)
    excess = np.abs(nodes[..., 1]) + np.maximum(
        np.maximum(-nodes[..., 0], nodes[..., 0] - charts.lengths[:, None]), 0.0
    )
    spread = np.zeros((*position.shape[:2], 2))
    distance = np.full(position.shape[:2], np.inf)
    for i, where in enumerate(position):
        on = np.flatnonzero(~lift.outside[i] & np.isfinite(lift.position[i]).all(axis=1))
        if len(on) == 0:
            continue
        nearest = cKDTree(lift.position[i, on]).query(where, k=min(8, len(on)))
        gap = np.reshape(nearest[0], (len(where), -1))
        node = on[np.reshape(nearest[1], (len(where), -1))]
        tied = gap <= gap[:, :1] + 0.5 * _LINE_STEP
        best = np.argmin(np.where(tied, excess[i, node], np.inf), axis=1)
        chosen = node[np.arange(len(where)), best]
        offset = where - lift.position[i, chosen]
        local = np.einsum("tj,tjk->tk", offset, lift.axes[i, chosen, :, :2])
        spread[i], distance[i] = nodes[i, chosen, :2] + local, gap[:, 0]
    return spread, distance


def _between(at: Floats, good: Booleans) -> Floats:
    """Coordinates (B, T, n) with those that are not good put between good ones beside them."""
    filled = at.copy()
    for i in np.flatnonzero(good.any(axis=1) & ~good.all(axis=1)):
        known = np.flatnonzero(good[i])
        for k in range(at.shape[2]):
            filled[i, :, k] = np.interp(np.arange(at.shape[1]), known, at[i, known, k])
    filled[~good.any(axis=1)] = 0.0
    return filled
