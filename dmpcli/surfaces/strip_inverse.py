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

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.spatial.vectors import cross, dot, length, unit
from dmpcli.surfaces import strip_chart
from dmpcli.surfaces.mesh_charts import MeshCharts
from dmpcli.surfaces.strip_chart import WalkedStrips
from dmpcli.surfaces.strip_grid import CentreLines, Grid, Nodes, corners, walk_nodes
from dmpcli.surfaces.surface import Status
from dmpcli.surfaces.tangential import SETTLED

HIGHEST = 0.5
"""Positions farther off the mesh are left to `tangential`, mm: their normals spread."""

_PASSES, _STEPS, _FEET = 4, 8, 6
# Where coordinates change by less than this the nodes need not be walked again, mm: a change of
# 1e-4 mm would leave an error of up to 1e-7 mm. The last pass may leave the second.
_SAME_NODES = (1e-9, 1e-4)
# Widths of strips whose nodes need not be walked again differ by no more than this, mm. And so
# much, in nodes, may coordinates move that are guessed so well, or known.
_SAME_WIDTH, _BESIDE = (2e-7, 1e-4), (0.1, 0.02)
# Samples that tell the width.
_FARTHEST = 8
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
    walked = None
    if charts.mesh.compiled:
        at, good, walked = _settled_at_once(some, foot, facet)
    else:
        at = _guessed(some, foot)
        good = _settled(some, at, foot, facet)
    rows, height, at = rows[good], height[good], at[good]
    coordinates = np.concatenate([at, height[..., None]], axis=-1)
    if len(rows) == 0:
        shape = 0, position.shape[1]
        return Found(rows, coordinates, np.zeros((*shape, 3, 3)), np.zeros(shape))
    lift = charts.rows(rows).lift(coordinates, walked)
    gap = np.einsum("btj,btjk->btk", position[rows] - lift.position, lift.axes)
    coordinates[..., 2] += gap[..., 2]
    miss = np.hypot(gap[..., 0], gap[..., 1])
    whole = ((miss <= SETTLED) & ~lift.outside).all(axis=1)
    whole &= (lift.status == Status.DRAWN) & ~lift.unfolded
    return Found(rows, coordinates, lift.axes, miss).rows_of(whole)


def _feet(charts: MeshCharts, position: Floats) -> tuple[Floats, Floats, Floats]:
    """Feet (R, T, 3) by the smooth normal, normals of their facets, and heights (R, T), mm."""
    if not charts.mesh.compiled:
        return _feet_sought(charts, position)
    from dmpcli.surfaces.kernels import inverse

    foot, facet = np.empty((2, *position.shape))
    height, doubt = np.empty(position.shape[:2]), np.empty(len(position), dtype=bool)
    limits = inverse.FootLimits(_FEET, _ON_FOOT)
    position = np.ascontiguousarray(position)
    sign = charts.centre.sign
    inverse.feet(charts.mesh.facets, position, sign, limits, foot, facet, height, doubt)
    rows = np.flatnonzero(doubt)
    if len(rows):
        some = _feet_sought(charts.rows(rows), position[rows])
        foot[rows], facet[rows], height[rows] = some
    return foot, facet, height


def _feet_sought(charts: MeshCharts, position: Floats) -> tuple[Floats, Floats, Floats]:
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
    at = np.zeros((*foot.shape[:2], 2))
    ends = np.stack(_along_chord(charts, foot), axis=1)
    nodes = np.stack([ends, 0.0 * ends], axis=-1)
    for some, strip in _strips(charts, nodes, along=True):
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


def _along_chord(charts: MeshCharts, foot: Floats) -> tuple[Floats, Floats]:
    """From which to which u, (R,) each, strokes lie beside their centre lines by their chords, mm.

    At least from start to goal, at most as far again beyond either.
    """
    chord = charts.target - charts.centre.origin
    e_u = unit(chord)[:, None]
    u = dot(foot - charts.centre.origin[:, None], e_u)[..., 0]
    least, most = np.minimum(u.min(axis=1), 0.0), np.maximum(u.max(axis=1), charts.lengths)
    return np.maximum(least, -charts.lengths), np.minimum(most, 2.0 * charts.lengths)


def _settled_at_once(
    charts: MeshCharts, foot: Floats, facet: Floats
) -> tuple[Floats, Booleans, list[WalkedStrips]]:
    """Coordinates (R, T, 2) over feet, by kernels; which came to rest, and their strips.

    Nodes depend on a stroke by how far it swings alone: once that is known they need not be walked
    again, for the lift neither.
    """
    from dmpcli.surfaces.kernels import inverse

    lines, step = _centre_lines(charts, *_along_chord(charts, foot)), charts.centre.step[:, 0]
    nodes = lines.position, lines.across, lines.normal, lines.behind, lines.ahead
    at = inverse.guesses(*nodes, lines.zero, step.copy(), foot)
    good, left = np.zeros(len(at), dtype=bool), np.arange(len(at))
    reach, walked = _extent(at), []
    for number in range(_PASSES):
        if len(left) == 0:
            break
        guessed, beside = at[left], _BESIDE[min(number, 1)]
        strayed = np.zeros(len(left), dtype=bool)
        for some, strip in _strips(charts.rows(left), guessed, reach, lines.rows(left), beside):
            rows = left[some]
            at[rows], still = strip.moved(foot[rows], facet[rows], rough=number == 0)
            strayed[some] = ~still | ~strip.covers(at[rows])
            same = strip.same(_extent(at[rows]), reach[some], _SAME_WIDTH[number == _PASSES - 1])
            kept = np.flatnonzero(~strayed[some] & same)
            good[rows[kept]] = True
            if len(kept):
                walked.append(strip.walked(rows[kept], kept))
        rows = left[strayed]
        if len(rows):
            # Nodes that were not walked led them astray: once more, with those all around.
            at[rows] = guessed[strayed]
            for some, strip in _strips(charts.rows(rows), at[rows], reach[strayed]):
                at[rows[some]], _ = strip.moved(foot[rows[some]], facet[rows[some]], rough=True)
        left = left[~good[left]]
        # What is no number is not below it either.
        left = left[(np.abs(_extent(at[left])) < _FAR).all(axis=(1, 2))]
        if number == 0 and len(left):
            _narrow(charts, at, left, foot, facet, lines)
        reach = _extent(at[left])
    # As they are counted among the good ones alone.
    number_of = np.cumsum(good) - 1
    return at, good, [replace(strips, rows=number_of[strips.rows]) for strips in walked]


def _centre_lines(charts: MeshCharts, least: Floats, most: Floats) -> CentreLines:
    """Walk the centre lines from u to u, (R,) each, mm, and a node beyond."""
    step = charts.centre.step[:, 0]
    behind = np.ceil(np.maximum(-least, 0.0) / step).astype(np.int64) + 1
    ahead = np.ceil(np.maximum(most, 0.0) / step).astype(np.int64) + 1
    return CentreLines.walked(charts.mesh, charts.centre, behind, np.maximum(ahead, 4))


def _narrow(
    charts: MeshCharts,
    at: Floats,
    rows: Integers,
    foot: Floats,
    facet: Floats,
    lines: CentreLines,
) -> None:
    """Move the coordinates that swing farthest once more: they tell the width of the strips."""
    at_once = min(_FARTHEST, at.shape[1])
    far = np.argpartition(-np.abs(at[rows, :, 1]), at_once - 1, axis=1)[:, :at_once]
    row = rows[:, None]
    some_at, some_foot, some_facet = at[row, far], foot[row, far], facet[row, far]
    some_charts, reach = charts.rows(rows), _extent(at[rows])
    for some, strip in _strips(some_charts, some_at, reach, lines.rows(rows), _BESIDE[1]):
        moved, still = strip.moved(some_foot[some], some_facet[some], rough=False)
        some_at[some[still]] = moved[still]
    at[row, far] = some_at


def _width(at: Floats) -> Floats:
    """How far coordinates (R, T, 2) or their extents swing, shape (R,), mm."""
    return strip_chart.widths(at[..., 1])[:, 0]


def _extent(at: Floats) -> Floats:
    """Least and largest u and v of coordinates (R, T, 2), shape (R, 2, 2), mm; by kernels."""
    from dmpcli.surfaces.kernels import inverse

    return inverse.extents(at)


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
        done = still & (change < _SAME_NODES[number == _PASSES - 1])
        good[left[done]] = True
        left = left[~done & sane]
    return good


def _strips(
    charts: MeshCharts,
    at: Floats,
    reach: Floats | None = None,
    lines: CentreLines | None = None,
    beside: float | None = None,
    along: bool = False,
) -> Iterator[tuple[Integers, "_Strip"]]:
    """Strips as `strip_chart.lift` walks them for coordinates (R, T, 2), those of a shape together.

    They are as wide as these swing, or as far as they `reach`, see `_extent`. Their nodes are
    those of the cells about the coordinates' own, or of cells no farther than so many nodes
    `beside` these; with `along`, all from the least u to the largest.
    """
    reach = at if reach is None else reach
    for some, grid, cross_step in strip_chart.shapes(charts.centre, reach[..., 0], reach[..., 1]):
        yield (
            some,
            _Strip(
                charts.rows(some),
                grid,
                cross_step,
                at[some],
                lines and lines.rows(some),
                beside,
                along,
            ),
        )


class _Strip:
    """Strips of one shape, and coordinates (R, T, 2) on them."""

    def __init__(
        self,
        charts: MeshCharts,
        grid: Grid,
        cross_step: Floats,
        at: Floats,
        lines: CentreLines | None = None,
        beside: float | None = None,
        along: bool = False,
    ) -> None:
        self.compiled = charts.mesh.compiled
        self.grid, self.cross_step, self.centre = grid, cross_step, charts.centre
        self.at, self.shape = at, (grid.behind + grid.ahead, grid.right + grid.left)
        self.step = np.stack([charts.centre.step[:, 0], cross_step[:, 0]], axis=1)[:, None]
        self.zero = np.array([grid.behind, grid.right])
        cells = np.zeros((len(at), *self.shape), dtype=bool)
        if self.compiled:
            self._mark(cells, at, beside or 0.0)
        else:
            pair = np.arange(len(at))[:, None]
            i, j, _, _ = self._where(at, self.step)
            cells[pair, i, j] = True
        if beside is None:
            # A step may lead into the next cell.
            node = corners(cells)
            cells = node[:, 1:, 1:] | node[:, 1:, :-1] | node[:, :-1, 1:] | node[:, :-1, :-1]
        if along:
            cells[:] = True
        self.cells = cells
        self.nodes: Nodes = walk_nodes(charts.mesh, charts.centre, grid, cross_step, cells, lines)

    def _mark(self, cells: Booleans, at: Floats, beside: float) -> None:
        """Mark the cells of coordinates, and of places so many nodes beside them."""
        from dmpcli.surfaces.kernels import inverse

        zero = self.zero.astype(float)
        inverse.mark(cells, np.ascontiguousarray(at), self.step[:, 0].copy(), zero, beside)

    def covers(self, at: Floats) -> Booleans:
        """Tell which strokes (R, T, 2) lie on nodes that were walked, shape (R,)."""
        cells = np.zeros_like(self.cells)
        self._mark(cells, at, 0.0)
        return np.asarray(~(cells & ~self.cells).any(axis=(1, 2)))

    def same(self, extent: Floats, reach: Floats, same_width: float) -> Booleans:
        """Tell which strokes would have the same nodes walked for them again, shape (R,)."""
        near = np.abs(_width(extent) - _width(reach)) < same_width
        grid = strip_chart.grids_of(self.centre, extent[..., 0], extent[..., 1])[0]
        return np.asarray((grid == dataclasses.astuple(self.grid)).all(axis=1) & near)

    def walked(self, rows: Integers, kept: Integers) -> WalkedStrips:
        """Return some of the strips, which are those of `rows`, with their nodes."""
        return WalkedStrips(rows, self.grid, self.cross_step[kept], self.nodes.rows(kept))

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
        if self.compiled:
            return self._moved_by_kernels(foot, facet, rough)
        at, still = self.at.copy(), np.zeros(len(self.at), dtype=bool)
        size = max(1, strip_chart.SAMPLES_AT_ONCE // at.shape[1])
        for first in range(0, len(at), size):
            rows = np.arange(first, min(first + size, len(at)))
            still[rows] = self._move(at, rows, foot[rows], facet[rows], _ROUGH if rough else _STILL)
        return at, still

    def _moved_by_kernels(
        self, foot: Floats, facet: Floats, seeded: bool
    ) -> tuple[Floats, Booleans]:
        from dmpcli.surfaces.kernels import inverse

        at, step = self.at.copy(), self.step[:, 0].copy()
        limits = inverse.StepLimits(_STEPS, _STILL, _LONGEST, _LEAST_AREA)
        zero = self.zero.astype(float)
        still = inverse.settle(self.nodes.values, step, zero, at, foot, facet, limits, seeded)
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
