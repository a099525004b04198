"""Strip charts of a mesh inverted on their own nodes, without a look at the mesh at each step.

The foot of a position is found first: the point of the mesh whose smooth normal leads to it. Then u
and v are sought until the spline through the strip's nodes stands over the foot, along the normal
of the foot's facet: a few Newton steps of all samples at once, on nodes that are walked once. The
nodes are those that `strip_chart.lift` walks for the coordinates that were found, so they are
walked again, at most `_PASSES` times, until these no longer change.

Which u, v a foot has on an edge: closest points of all that stands over a convex edge lie on it, so
that several u, v lead to one foot there. The one over the facet that the search names is taken. The
others lie beside it by no more than the spline's height over the mesh times the angle at the edge,
and every one of them leads to the position. Where the spline runs under a convex edge, or over a
concave one, none leads to points of the edge; such strokes are left to `tangential`, which comes as
near as it can.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.spatial.vectors import cross, dot, length, unit
from dmpcli.surfaces import strip_chart
from dmpcli.surfaces.mesh_charts import MeshCharts
from dmpcli.surfaces.strip_grid import Grid, Nodes, corners, walk_nodes
from dmpcli.surfaces.surface import Status
from dmpcli.surfaces.tangential import SETTLED

HIGHEST = 0.5
"""Positions farther off the mesh are left to `tangential`, mm: their normals spread."""

_PASSES, _STEPS, _FEET = 4, 8, 6
# Where coordinates change by less than this the nodes need not be walked again, mm.
_SAME_NODES = 1e-4
# What a step leaves, and how near a foot must come, mm.
_STILL, _ON_FOOT = 1e-9, 1e-8
# What is left on nodes that will be walked again, mm.
_ROUGH = 1e-2
# Coordinates beyond this are astray, mm.
_FAR = 1e4
# A step is no longer than this, mm: farther ahead the strip has curved away.
_LONGEST = 5.0
# The chart has folded where less of an area is left.
_LEAST_AREA = 0.05


@dataclass(frozen=True)
class Found:
    """Coordinates of strokes that were found whole.

    Attributes
    ----------
    rows : array of int, shape (R,)
        Of the charts.
    coordinates : array, shape (R, T, 3)
        u, v, w, mm.
    axes : array, shape (R, T, 3, 3)
        As `Charts.lift` gives them there.
    miss : array, shape (R, T)
        Distance of what `Charts.lift` makes of the coordinates to the positions, mm.
    """

    rows: Integers
    coordinates: Floats
    axes: Floats
    miss: Floats

    def rows_of(self, which: Booleans) -> "Found":
        """Return some of them."""
        return Found(self.rows[which], self.coordinates[which], self.axes[which], self.miss[which])


def found(charts: MeshCharts, position: Floats) -> Found:
    """Find chart coordinates of strokes on the mesh or next to it; only of those found whole.

    Parameters
    ----------
    charts : MeshCharts
    position : array, shape (B, T, 3)
        mm.
    """
    open_ = charts.lengths > 0.0
    rows = np.flatnonzero(open_ & ~charts.creased & (charts.status == Status.DRAWN))
    foot, facet, height = _feet(charts.rows(rows), position[rows])
    near = (np.abs(height) <= HIGHEST).all(axis=1) & np.isfinite(foot).all(axis=(1, 2))
    rows, foot, facet, height = rows[near], foot[near], facet[near], height[near]
    some = charts.rows(rows)
    at = _guessed(some, foot)
    good = _settled(some, at, foot, facet)
    rows, height, at = rows[good], height[good], at[good]
    coordinates = np.concatenate([at, height[..., None]], axis=-1)
    if len(rows) == 0:
        shape = 0, position.shape[1]
        return Found(rows, coordinates, np.zeros((*shape, 3, 3)), np.zeros(shape))
    lift = charts.rows(rows).lift(coordinates)
    gap = np.einsum("btj,btjk->btk", position[rows] - lift.position, lift.axes)
    coordinates[..., 2] += gap[..., 2]
    miss = np.hypot(gap[..., 0], gap[..., 1])
    whole = ((miss <= SETTLED) & ~lift.outside).all(axis=1)
    whole &= (lift.status == Status.DRAWN) & ~lift.unfolded
    return Found(rows, coordinates, lift.axes, miss).rows_of(whole)


def _feet(charts: MeshCharts, position: Floats) -> tuple[Floats, Floats, Floats]:
    """Feet (R, T, 3) by the smooth normal, normals of their facets, and heights (R, T), mm."""
    mesh, shape = charts.mesh, position.shape
    sign = np.repeat(charts.centre.sign, shape[1], axis=0)
    given = position.reshape(-1, 3)
    foot, face = mesh.search(given)
    height = np.zeros(len(given))
    left = np.arange(len(given))
    for step in range(_FEET):
        normal = sign[left] * mesh.smooth_normals(foot[left], face[left])
        height[left] = dot(given[left] - foot[left], normal)[:, 0]
        below = given[left] - height[left, None] * normal
        off = length(below - foot[left])[:, 0] > _ON_FOOT
        left, below = left[off], below[off]
        if len(left) == 0:
            break
        if step == _FEET - 1:
            foot[left] = np.nan
            break
        foot[left], face[left] = mesh.search(below)
    facet = mesh.face_normals[face]
    return foot.reshape(shape), facet.reshape(shape), height.reshape(shape[:2])


def _guessed(charts: MeshCharts, foot: Floats) -> Floats:
    """Guesses (R, T, 2) beside the nearest nodes of the centre lines, in their axes, mm."""
    chord = charts.target - charts.centre.origin
    e_u = unit(chord)[:, None]
    u = dot(foot - charts.centre.origin[:, None], e_u)[..., 0]
    least, most = np.minimum(u.min(axis=1), 0.0), np.maximum(u.max(axis=1), charts.lengths)
    at = np.zeros((*foot.shape[:2], 2))
    ends = np.stack([np.maximum(least, -charts.lengths), np.minimum(most, 2.0 * charts.lengths)], 1)
    for some, strip in _strips(charts, np.stack([ends, 0.0 * ends], axis=-1), along=True):
        line = strip.nodes.values[:, :, strip.zero[1]]
        normal = strip.nodes.normal[:, :, strip.zero[1]]
        step = strip.step[:, 0, 0]
        for k, i in enumerate(some.tolist()):
            gap = foot[i, :, None] - line[k, :, :3]
            node = np.argmin(np.einsum("tni,tni->tn", gap, gap), axis=1)
            gap = gap[np.arange(len(node)), node]
            e_v = unit(line[k, node, 3:6])
            at[i, :, 0] = (node - strip.zero[0]) * step[k]
            at[i, :, 0] += dot(gap, cross(e_v, normal[k, node]))[:, 0]
            at[i, :, 1] = dot(gap, e_v)[:, 0]
    return at


def _settled(charts: MeshCharts, at: Floats, foot: Floats, facet: Floats) -> Booleans:
    """Move coordinates (R, T, 2) over their feet; which strokes came to rest, shape (R,)."""
    good = np.zeros(len(at), dtype=bool)
    left = np.arange(len(at))
    for number in range(_PASSES):
        if len(left) == 0:
            break
        before = at[left].copy()
        still = np.zeros(len(left), dtype=bool)
        for some, strip in _strips(charts.rows(left), before):
            rows = left[some]
            at[rows], still[some] = strip.moved(foot[rows], facet[rows], rough=number == 0)
        change = np.abs(at[left] - before).max(axis=(1, 2))
        sane = np.isfinite(change) & (np.abs(at[left]).max(axis=(1, 2)) < _FAR)
        done = still & (change < _SAME_NODES)
        good[left[done]] = True
        left = left[~done & sane]
    return good


def _strips(
    charts: MeshCharts, at: Floats, along: bool = False
) -> Iterator[tuple[Integers, "_Strip"]]:
    """Strips as `strip_chart.lift` walks them for coordinates (R, T, 2), those of a shape together.

    With `along` they have all nodes from the least u to the largest.
    """
    u, v = at[..., 0], at[..., 1]
    width = np.maximum(np.abs(v).max(axis=1), strip_chart.LEAST_WIDTH)[:, None]
    cross_step = width / np.ceil(width / strip_chart.STEP - 1e-6)
    shapes = strip_chart.grids(u / charts.centre.step, v / cross_step)
    kinds, kind = np.unique(shapes, axis=0, return_inverse=True)
    for number, shape in enumerate(kinds):
        members = np.flatnonzero(kind.reshape(-1) == number)
        for first in range(0, len(members), strip_chart.PAIRS_AT_ONCE):
            some = members[first : first + strip_chart.PAIRS_AT_ONCE]
            grid = Grid(*shape.tolist())
            yield some, _Strip(charts.rows(some), grid, cross_step[some], at[some], along)


class _Strip:
    """Strips of one shape, and coordinates (R, T, 2) on them."""

    def __init__(
        self, charts: MeshCharts, grid: Grid, cross_step: Floats, at: Floats, along: bool
    ) -> None:
        self.at, self.shape = at, (grid.behind + grid.ahead, grid.right + grid.left)
        self.step = np.stack([charts.centre.step[:, 0], cross_step[:, 0]], axis=1)[:, None]
        self.zero = np.array([grid.behind, grid.right])
        cells = np.zeros((len(at), *self.shape), dtype=bool)
        pair = np.arange(len(at))[:, None]
        i, j, _, _ = self._where(at, self.step)
        cells[pair, i, j] = True
        # A step may lead into the next cell.
        node = corners(cells)
        cells = node[:, 1:, 1:] | node[:, 1:, :-1] | node[:, :-1, 1:] | node[:, :-1, :-1]
        if along:
            cells[:] = True
        self.nodes: Nodes = walk_nodes(charts.mesh, charts.centre, grid, cross_step, cells)

    def _where(self, at: Floats, step: Floats) -> tuple[Integers, Integers, Floats, Floats]:
        """Cells (R, T) of coordinates along u and v, and the shares within them."""
        place = at / step + self.zero
        cell = np.clip(np.floor(place).astype(np.int64), 0, np.array(self.shape) - 1)
        share = place - cell
        return cell[..., 0], cell[..., 1], share[..., 0], share[..., 1]

    def moved(self, foot: Floats, facet: Floats, rough: bool) -> tuple[Floats, Booleans]:
        """Coordinates over feet (R, T, 3) along the normals of their facets; which are at rest.

        `rough` ones need not be: their nodes will be others.
        """
        at, still = self.at.copy(), np.zeros(len(self.at), dtype=bool)
        size = max(1, strip_chart.SAMPLES_AT_ONCE // at.shape[1])
        for first in range(0, len(at), size):
            rows = np.arange(first, min(first + size, len(at)))
            still[rows] = self._move(at, rows, foot[rows], facet[rows], _ROUGH if rough else _STILL)
        return at, still

    def _move(
        self, at: Floats, rows: Integers, foot: Floats, facet: Floats, enough: float
    ) -> Booleans:
        """Move the coordinates of some strokes; tell which came to rest."""
        here, step = at[rows], self.step[rows]
        spline = StripSpline(self.nodes.values)
        # Each stroke on its own: one that rests must not move on because others do.
        rest = np.zeros(len(rows), dtype=bool)
        for _ in range(_STEPS):
            i, j, r, s = self._where(here, step)
            point, by_u, by_v = spline.at(rows[:, None], i, j, r, s)
            by_u /= step[..., :1]
            by_v /= step[..., 1:]
            e = foot - point
            area = dot(facet, cross(by_u, by_v))[..., 0]
            sound = np.abs(area) > _LEAST_AREA
            scale = 1.0 / np.where(sound, area, 1.0)
            du = dot(facet, cross(e, by_v))[..., 0] * scale
            dv = dot(facet, cross(by_u, e))[..., 0] * scale
            size = np.hypot(du, dv)
            short = np.minimum(1.0, _LONGEST / np.maximum(size, 1e-300))
            short *= sound & ~rest[:, None]
            here[..., 0] += short * du
            here[..., 1] += short * dv
            rest |= (sound & (size < enough)).all(axis=1)
            if rest.all():
                break
        at[rows] = here
        return rest


class StripSpline:
    """Bicubic pieces between the nodes of strips.

    Parameters
    ----------
    values : array, shape (B, nu, nv, 12)
        As `Nodes` has them.
    """

    def __init__(self, values: Floats) -> None:
        self.nu, self.nv = values.shape[1:3]
        # Two nodes side by side are one piece: position and slope along v, and their u-slopes.
        self._table = np.lib.stride_tricks.sliding_window_view(values.reshape(-1), 24)[::12]
        self._cell, self._patch = np.empty(0, dtype=np.int64), np.empty((0, 4, 12))

    def at(
        self, pair: Integers, i: Integers, j: Integers, r: Floats, s: Floats
    ) -> tuple[Floats, Floats, Floats]:
        """Positions and their derivatives per node along u and v, (R, T, 3) each.

        Parameters
        ----------
        pair, i, j : array of int, shape (R, T)
            Strips and cells.
        r, s : array, shape (R, T)
            Shares within them.
        """
        cell = ((pair * self.nu + i) * self.nv + j).reshape(-1)
        if len(cell) != len(self._cell):
            self._cell, self._patch = np.full(len(cell), -1), np.empty((len(cell), 4, 12))
        new = np.flatnonzero(cell != self._cell)
        for part, node in ((slice(0, 2), cell[new]), (slice(2, 4), cell[new] + self.nv)):
            near = self._table[node].reshape(-1, 2, 2, 6).transpose(0, 2, 1, 3)
            self._patch[new, part] = near.reshape(-1, 2, 12)
        self._cell = cell
        along = np.stack(_hermite(r.reshape(-1)), axis=1)
        over = np.stack(_hermite(s.reshape(-1)), axis=1)
        line = (along @ self._patch).reshape(-1, 2, 4, 3)
        point, by_u = over @ line[:, 0], over[:, :1] @ line[:, 1]
        shape = (*r.shape, 3)
        return point[:, 0].reshape(shape), by_u[:, 0].reshape(shape), point[:, 1].reshape(shape)


def _hermite(s: Floats) -> tuple[Floats, Floats]:
    """Weights (N, 4) of value and slope at 0 and at 1, and their derivatives in s."""
    s2, s3 = s * s, s * s * s
    value = np.stack([1 - 3 * s2 + 2 * s3, s - 2 * s2 + s3, 3 * s2 - 2 * s3, s3 - s2], axis=-1)
    slope = np.stack([6 * (s2 - s), 1 - 4 * s + 3 * s2, 6 * (s - s2), 3 * s2 - 2 * s], axis=-1)
    return value, slope
