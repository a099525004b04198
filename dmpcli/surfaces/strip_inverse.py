"""Strip charts of a mesh inverted on their own nodes, without a look at the mesh at each step.

The foot of a position is found first: the point of the mesh whose smooth normal leads to it. Then u
and v are sought until the spline through the strip's nodes stands over the foot, along the normal
of the foot's facet: a few Newton steps of all samples at once, on nodes that are walked once. The
nodes are those that `strip_chart.lift` walks for the coordinates that were found, so they are
walked again, at most `_PASSES` times, until these no longer change.

Which u, v a foot has on an edge: closest points of all that stands over a convex edge lie on it, so
that several u, v lead to one foot there. The one over the facet that the search names is taken. The
others lie beside it by no more than the spline's height over the mesh times the angle at the edge,
and every one of them leads to the position.
"""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.spatial.vectors import cross, dot, length
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
        return Found(
            self.rows[which], self.coordinates[which], self.axes[which], self.miss[which]
        )


def found(charts: MeshCharts, position: Floats, guess: Floats, which: Booleans) -> Found:
    """Find chart coordinates of strokes on the mesh or next to it; only of those found whole.

    Parameters
    ----------
    charts : MeshCharts
    position : array, shape (B, T, 3)
        mm.
    guess : array, shape (B, T, 2)
        u, v, mm.
    which : array of bool, shape (B,)
        Strokes to look at.
    """
    rows = np.flatnonzero(which & ~charts.creased & (charts.status == Status.DRAWN))
    foot, facet, height = _feet(charts.rows(rows), position[rows])
    near = (np.abs(height) <= HIGHEST).all(axis=1) & np.isfinite(foot).all(axis=(1, 2))
    rows, foot, facet, height = rows[near], foot[near], facet[near], height[near]
    some, at = charts.rows(rows), guess[rows].copy()
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


def _settled(charts: MeshCharts, at: Floats, foot: Floats, facet: Floats) -> Booleans:
    """Move coordinates (R, T, 2) over their feet; which strokes came to rest, shape (R,)."""
    good = np.zeros(len(at), dtype=bool)
    left = np.arange(len(at))
    for _ in range(_PASSES):
        if len(left) == 0:
            break
        before = at[left].copy()
        still = _passed(charts.rows(left), at, left, foot, facet)
        change = np.abs(at[left] - before).max(axis=(1, 2))
        sane = np.isfinite(change) & (np.abs(at[left]).max(axis=(1, 2)) < 1e4)
        done = still & (change < _SAME_NODES)
        good[left[done]] = True
        left = left[~done & sane]
    return good


def _passed(
    charts: MeshCharts, at: Floats, rows: Integers, foot: Floats, facet: Floats
) -> Booleans:
    """Walk the nodes of strokes anew and move their coordinates on them; which came to rest."""
    u, v = at[rows, :, 0], at[rows, :, 1]
    width = np.maximum(np.abs(v).max(axis=1), strip_chart.LEAST_WIDTH)[:, None]
    cross_step = width / np.ceil(width / strip_chart.STEP - 1e-6)
    shapes = strip_chart._grids(u / charts.centre.step, v / cross_step)
    kinds, kind = np.unique(shapes, axis=0, return_inverse=True)
    still = np.zeros(len(rows), dtype=bool)
    for number, shape in enumerate(kinds):
        members = np.flatnonzero(kind.reshape(-1) == number)
        for first in range(0, len(members), strip_chart.PAIRS_AT_ONCE):
            some = members[first : first + strip_chart.PAIRS_AT_ONCE]
            strip = _Strip(charts.rows(some), Grid(*shape.tolist()), cross_step[some], at[rows[some]])
            at[rows[some]], still[some] = strip.moved(foot[rows[some]], facet[rows[some]])
    return still


class _Strip:
    """Strips of one shape, and coordinates (R, T, 2) on them."""

    def __init__(self, charts: MeshCharts, grid: Grid, cross_step: Floats, at: Floats) -> None:
        self.at, self.shape = at, (grid.behind + grid.ahead, grid.right + grid.left)
        self.step = np.stack([charts.centre.step[:, 0], cross_step[:, 0]], axis=1)[:, None]
        self.zero = np.array([grid.behind, grid.right])
        cells = np.zeros((len(at), *self.shape), dtype=bool)
        pair = np.arange(len(at))[:, None]
        i, j, _, _ = self._where(at)
        cells[pair, i, j] = True
        # A step may lead into the next cell.
        node = corners(cells)
        cells = node[:, 1:, 1:] | node[:, 1:, :-1] | node[:, :-1, 1:] | node[:, :-1, :-1]
        self.nodes: Nodes = walk_nodes(charts.mesh, charts.centre, grid, cross_step, cells)

    def _where(self, at: Floats) -> tuple[Integers, Integers, Floats, Floats]:
        """Cells (R, T) of coordinates along u and v, and the shares within them."""
        place = at / self.step + self.zero
        cell = np.clip(np.floor(place).astype(np.int64), 0, np.array(self.shape) - 1)
        share = place - cell
        return cell[..., 0], cell[..., 1], share[..., 0], share[..., 1]

    def moved(self, foot: Floats, facet: Floats) -> tuple[Floats, Booleans]:
        """Coordinates over feet (R, T, 3) along the normals of their facets; which are at rest."""
        at = self.at.copy()
        pair = np.arange(len(at))[:, None]
        still = np.zeros(at.shape[:2], dtype=bool)
        for _ in range(_STEPS):
            i, j, r, s = self._where(at)
            point, by_u, by_v = bicubic(self.nodes.values, pair, i, j, r, s)
            by_u /= self.step[..., :1]
            by_v /= self.step[..., 1:]
            e = foot - point
            area = dot(facet, cross(by_u, by_v))[..., 0]
            sound = np.abs(area) > _LEAST_AREA
            scale = 1.0 / np.where(sound, area, 1.0)
            du = dot(facet, cross(e, by_v))[..., 0] * scale
            dv = dot(facet, cross(by_u, e))[..., 0] * scale
            size = np.hypot(du, dv)
            short = np.minimum(1.0, _LONGEST / np.maximum(size, 1e-300)) * sound
            at[..., 0] += short * du
            at[..., 1] += short * dv
            still = sound & (size < _STILL)
            if still.all():
                break
        return at, still.all(axis=1)


def bicubic(
    values: Floats, pair: Integers, i: Integers, j: Integers, r: Floats, s: Floats
) -> tuple[Floats, Floats, Floats]:
    """Positions of a strip's spline and its derivatives per node along u and v, (B, T, 3) each.

    Parameters
    ----------
    values : array, shape (B, nu, nv, 12)
        As `Nodes` has them.
    pair, i, j : array of int, shape (B, T)
        Strips and cells.
    r, s : array, shape (B, T)
        Shares within them.
    """
    nu, nv = values.shape[1:3]
    at = ((pair * nu + i) * nv + j).reshape(-1)
    # Two nodes side by side are one piece: (node, slope along u, slope along v, xyz).
    table = np.lib.stride_tricks.sliding_window_view(values.reshape(-1), 24)[::12]
    patch = np.empty((len(at), 4, 12))
    patch[:, :2] = table[at].reshape(-1, 2, 2, 6).transpose(0, 2, 1, 3).reshape(-1, 2, 12)
    patch[:, 2:] = table[at + nv].reshape(-1, 2, 2, 6).transpose(0, 2, 1, 3).reshape(-1, 2, 12)
    along = np.stack(_hermite(r.reshape(-1)), axis=1)
    over = np.stack(_hermite(s.reshape(-1)), axis=1)
    line = (along @ patch).reshape(-1, 2, 4, 3)
    point = over @ line[:, 0]
    by_u = np.matmul(over[:, :1], line[:, 1])
    shape = (*r.shape, 3)
    return point[:, 0].reshape(shape), by_u[:, 0].reshape(shape), point[:, 1].reshape(shape)


def _hermite(s: Floats) -> tuple[Floats, Floats]:
    """Weights (N, 4) of value and slope at 0 and at 1, and their derivatives in s."""
    s2, s3 = s * s, s * s * s
    value = np.stack([1 - 3 * s2 + 2 * s3, s - 2 * s2 + s3, 3 * s2 - 2 * s3, s3 - s2], axis=-1)
    slope = np.stack([6 * (s2 - s), 1 - 4 * s + 3 * s2, 6 * (s - s2), 3 * s2 - 2 * s], axis=-1)
    return value, slope
