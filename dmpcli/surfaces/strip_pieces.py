"""Strips of charts of one shape, walked, and coordinates on their splines: see `strip_inverse`."""

import dataclasses
from collections.abc import Iterator

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.spatial.vectors import cross, dot
from dmpcli.surfaces import strip_chart
from dmpcli.surfaces.mesh_charts import MeshCharts
from dmpcli.surfaces.strip_chart import WalkedStrips
from dmpcli.surfaces.strip_grid import CentreLines, Grid, Nodes, corners, walk_nodes

_STEPS = 8
# What a step leaves, mm, and on nodes that will be walked again.
_STILL, _ROUGH = 1e-9, 1e-2
# A step is no longer than this, mm: farther ahead the strip has curved away.
_LONGEST = 5.0
# The chart has folded where less of an area is left.
_LEAST_AREA = 0.05


def strips(
    charts: MeshCharts,
    at: Floats,
    reach: Floats | None = None,
    lines: CentreLines | None = None,
    beside: float | None = None,
    along: bool = False,
) -> Iterator[tuple[Integers, "Strip"]]:
    """Strips as `strip_chart.lift` walks them for coordinates (R, T, 2), those of a shape together.

    They are as wide as these swing, or as far as they `reach`, see `_extent`. Their nodes are
    those of the cells about the coordinates' own, or of cells no farther than so many nodes
    `beside` these; with `along`, all from the least u to the largest.
    """
    reach = at if reach is None else reach
    for some, grid, cross_step in strip_chart.shapes(charts.centre, reach[..., 0], reach[..., 1]):
        yield (
            some,
            Strip(
                charts.rows(some),
                grid,
                cross_step,
                at[some],
                lines and lines.rows(some),
                beside,
                along,
            ),
        )


class Strip:
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
        """Tell which strokes would have the same nodes walked for them again, shape (R,).

        Parameters
        ----------
        extent, reach : array, shape (R, 2, 2)
            Least and largest u, v, mm: as they are now, and those that the strips were walked for.
        same_width : float
            By which the two widths may differ, mm.
        """
        near = np.abs(_width(extent) - _width(reach)) < same_width
        grid = strip_chart.grids_of(self.centre, extent[..., 0], extent[..., 1])[0]
        return np.asarray((grid == dataclasses.astuple(self.grid)).all(axis=1) & near)

    def walked(self, rows: Integers, kept: Integers) -> WalkedStrips:
        """Return some of the strips, which are those of `rows`, with their nodes.

        Parameters
        ----------
        rows, kept : array of int, shape (k,)
            What the pairs are called outside, and their places among these strips.
        """
        return WalkedStrips(rows, self.grid, self.cross_step[kept], self.nodes.rows(kept))

    def _where(self, at: Floats, step: Floats) -> tuple[Integers, Integers, Floats, Floats]:
        """Cells (R, T) of coordinates along u and v, and the shares within them."""
        place = at / step + self.zero
        cell = np.clip(np.floor(place).astype(np.int64), 0, np.array(self.shape) - 1)
        share = place - cell
        return cell[..., 0], cell[..., 1], share[..., 0], share[..., 1]

    def moved(self, foot: Floats, facet: Floats, rough: bool) -> tuple[Floats, Booleans]:
        """Coordinates over feet along the normals of their facets; which are at rest.

        Parameters
        ----------
        foot, facet : array, shape (R, T, 3)
            Feet, mm, and unit normals.
        rough : bool
            Whether the nodes will be others anyhow, so that it need not be exact; by kernels each
            sample then begins where its neighbour leads.

        Returns
        -------
        array, shape (R, T, 2)
            u, v, mm.
        array of bool, shape (R,)
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
        limits = inverse.NewtonLimits(_STEPS, _STILL, _LONGEST, _LEAST_AREA)
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


def _width(at: Floats) -> Floats:
    """How far coordinates (R, T, 2) or their extents swing, shape (R,), mm."""
    return strip_chart.widths(at[..., 1])[:, 0]


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
