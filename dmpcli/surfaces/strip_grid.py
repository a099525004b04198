"""The nodes of strip charts: a grid walked along and across the geodesics from start to goal."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.spatial.vectors import cross, dot, unit
from dmpcli.surfaces import compiled_stepping, geodesic_stepping
from dmpcli.surfaces.triangle_mesh import TriangleMesh
from dmpcli.surfaces.walked_nodes import WalkedNodes

# Central fourth-order differences, and their one-sided forms for the two nodes at either end.
_SLOPES = (
    np.array(
        [
            [-25.0, 48.0, -36.0, 16.0, -3.0],
            [-3.0, -10.0, 18.0, -6.0, 1.0],
            [1.0, -8.0, 0.0, 8.0, -1.0],
            [-1.0, 6.0, -18.0, 10.0, 3.0],
            [3.0, -16.0, 36.0, -48.0, 25.0],
        ]
    )
    / 12.0
)


@dataclass(frozen=True)
class Centre:
    """Centre lines of B charts.

    Attributes
    ----------
    origin, normal, direction : array, shape (B, 3)
        Start, mm; n on the tool's side and e_u there.
    step : array, shape (B, 1)
        Of the nodes along u, mm.
    sign : array, shape (B, 1)
    part : array of int, shape (B,)
    course : WalkedNodes, optional
        Nodes ahead that were walked to find the goal.
    """

    origin: Floats
    normal: Floats
    direction: Floats
    step: Floats
    sign: Floats
    part: Integers
    course: WalkedNodes | None = None

    def rows(self, rows: Integers) -> "Centre":
        """Return some of the charts."""
        return Centre(
            self.origin[rows],
            self.normal[rows],
            self.direction[rows],
            self.step[rows],
            self.sign[rows],
            self.part[rows],
            None if self.course is None else self.course.rows(rows),
        )


@dataclass(frozen=True)
class Grid:
    """Nodes that a stroke needs: numbers before and after the start, and on either side."""

    behind: int
    ahead: int
    right: int
    left: int


@dataclass(frozen=True)
class Nodes:
    """Nodes of strips: axes are pair, u, v.

    Attributes
    ----------
    values : array, shape (B, nu, nv, 12)
        Position, and its derivatives in v, u and both, per step.
    normal : array, shape (B, nu, nv, 3)
    stretch : array, shape (B, nu, nv)
        Distance of neighbouring cross lines, by that at the centre line.
    away : array, shape (B, nu - 1, nv - 1)
        How far off the mesh the nodes were walked that a cell's values come from, mm.
    sharp, back : array of bool, shape (B, nu, nv)
        See `geodesic_stepping.Marks`.
    """

    values: Floats
    normal: Floats
    stretch: Floats
    away: Floats
    sharp: Booleans
    back: Booleans

    def rows(self, rows: Integers | Booleans) -> "Nodes":
        """Return the nodes of some of the strips."""
        return Nodes(
            self.values[rows],
            self.normal[rows],
            self.stretch[rows],
            self.away[rows],
            self.sharp[rows],
            self.back[rows],
        )


@dataclass(frozen=True)
class CentreLines:
    """Nodes of the centre lines of B charts, which their strips have in common.

    Attributes
    ----------
    position, across, normal : array, shape (B, nu, 3)
        mm; e_v and n.
    behind, ahead : array of int, shape (B,)
        How many there are on either side of the start.
    zero : int
        The node at the start.
    """

    _lines: "_Lines"
    behind: Integers
    ahead: Integers
    zero: int

    @classmethod
    def walked(
        cls, mesh: TriangleMesh, centre: Centre, behind: Integers, ahead: Integers
    ) -> "CentreLines":
        """Walk so many nodes of each line.

        Parameters
        ----------
        mesh : TriangleMesh
        centre : Centre
            Of B charts; nodes are its `step` apart.
        behind, ahead : array of int, shape (B,)
            Nodes on either side of the start.
        """
        zero = int(behind.max(initial=0))
        along = _Lines(len(behind), zero + int(ahead.max(initial=0)) + 1)
        along.set(zero, centre.origin, centre.direction, centre.normal)
        course = centre.course
        if course is not None and course.begin_as(centre.direction, centre.step):
            along.follow(mesh, zero, (ahead, behind), centre, course)
        else:
            along.walk(mesh, zero, (ahead, behind), centre.step, centre.sign, centre.part)
        return cls(along, behind, ahead, zero)

    @property
    def position(self) -> Floats:
        """Of the nodes."""
        return self._lines.position

    @property
    def across(self) -> Floats:
        """e_v at the nodes."""
        return cross(self._lines.normal, self._lines.direction)

    @property
    def normal(self) -> Floats:
        """Unit normals at the nodes."""
        return self._lines.normal

    def rows(self, rows: Integers) -> "CentreLines":
        """Return some of the lines."""
        return CentreLines(self._lines.part(rows), self.behind[rows], self.ahead[rows], self.zero)

    def of(self, grid: Grid) -> "_Lines | None":
        """Return the nodes that a grid has, if all of them were walked."""
        if (self.behind < grid.behind).any() or (self.ahead < grid.ahead).any():
            return None
        return self._lines.part(
            slice(None), slice(self.zero - grid.behind, self.zero + grid.ahead + 1)
        )


def walk_nodes(
    mesh: TriangleMesh,
    centre: Centre,
    grid: Grid,
    cross_step: Floats,
    cells: Booleans,
    walked: CentreLines | None = None,
) -> Nodes:
    """Walk the centre line both ways, then the cross lines from its nodes, both ways.

    Only the nodes that the cells with samples need are walked to; the others stay zero.

    Parameters
    ----------
    mesh : TriangleMesh
    centre : Centre
        Of B charts.
    grid : Grid
        One for all of them.
    cross_step : array, shape (B, 1)
        From node to node across, mm.
    cells : array of bool, shape (B, nu - 1, nv - 1)
        Which cells have samples.
    walked : CentreLines, optional
        Of the same charts; where it reaches far enough no centre line is walked again.
    """
    B, nu, nv = len(centre.step), grid.behind + grid.ahead + 1, grid.right + grid.left + 1
    along = None if walked is None else walked.of(grid)
    if along is None:
        counts = np.full(B, grid.behind), np.full(B, grid.ahead)
        along = CentreLines.walked(mesh, centre, *counts).of(grid)
        assert along is not None
    e_v = cross(along.normal, along.direction)

    lines = _Lines(B * nu, nv)
    lines.set(grid.right, *(a.reshape(-1, 3) for a in (along.position, e_v, along.normal)))
    source = _last_on(along.away, grid.behind)
    needs = _needs(cells, grid)
    if along.away.any():
        # Lines that begin off the mesh look to others.
        needs = (np.full(B * nu, grid.left), np.full(B * nu, grid.right))
    lines.walk(
        mesh,
        grid.right,
        needs,
        np.repeat(cross_step, nu, axis=0),
        np.repeat(centre.sign, nu, axis=0),
        np.repeat(centre.part, nu),
        source,
    )
    grid_of = (B, nu, nv)
    position = lines.position.reshape(*grid_of, 3)
    e_v = lines.direction.reshape(*grid_of, 3)
    normal = lines.normal.reshape(*grid_of, 3)
    values = np.empty((*grid_of, 12))
    values[..., :3] = position
    values[..., 3:6] = e_v * cross_step[:, None, None]
    values[..., 6:] = _slopes(values[..., :6])
    stretch = dot(values[..., 6:9], cross(e_v, normal))[..., 0] / centre.step[:, None]
    # A crease or another side met on the centre line concerns all cross lines from there.
    sharp = lines.sharp.reshape(grid_of) | along.sharp[:, :, None]
    back = lines.back.reshape(grid_of) | along.back[:, :, None]
    away = _cells(np.maximum(lines.away.reshape(grid_of), along.away[:, :, None]))
    return Nodes(values, normal, stretch, away, sharp, back)


def corners(cells: Booleans) -> Booleans:
    """Nodes (B, nu, nv) at the corners of cells (B, nu - 1, nv - 1)."""
    wide = np.pad(cells, ((0, 0), (1, 1), (1, 1)))
    return wide[:, 1:, 1:] | wide[:, 1:, :-1] | wide[:, :-1, 1:] | wide[:, :-1, :-1]


def _needs(cells: Booleans, grid: Grid) -> tuple[Integers, Integers]:
    """How many nodes the cells need of each cross line (B nu,), to its left and to its right."""
    j = np.arange(cells.shape[2])
    needs = []
    for number in (j + 1 - grid.right, grid.right - j):
        cell = np.max(np.where(cells, number, 0), axis=2)
        # The slope at a node comes from two nodes on either side, at the ends from five in all.
        cell[:, 1] = np.maximum(cell[:, 0], cell[:, 1])
        cell[:, -2] = np.maximum(cell[:, -1], cell[:, -2])
        wide = np.pad(cell, ((0, 0), (3, 3)))
        node = np.lib.stride_tricks.sliding_window_view(wide, 6, axis=1).max(axis=2)
        needs.append(node.reshape(-1))
    return needs[0], needs[1]


def _last_on(away: Floats, start: int) -> Integers:
    """For each centre node (B, nu) the last one on the mesh on the way to it, as a flat index."""
    nu = away.shape[1]
    source = np.broadcast_to(np.arange(nu), away.shape).copy()
    for nodes, back in ((range(start + 1, nu), 1), (range(start - 1, -1, -1), -1)):
        for i in nodes:
            source[:, i] = np.where(away[:, i] > 0.0, source[:, i - back], i)
    first = nu * np.arange(len(away))[:, None]
    return np.asarray((source + first).reshape(-1))


def _cells(nodes: Floats) -> Floats:
    """Largest of the values at a cell's nodes and at those that their u-slopes are taken from."""
    reach = np.pad(nodes, ((0, 0), (2, 2), (0, 0)), mode="edge")
    along = np.lib.stride_tricks.sliding_window_view(reach, 6, axis=1).max(axis=-1)
    largest: Floats = np.maximum(along[:, :, :-1], along[:, :, 1:])
    return largest


class _Lines:
    """Nodes of M walks, `count` in each, filled from one of them outwards."""

    def __init__(self, walks: int, count: int) -> None:
        self.position, self.direction, self.normal = (np.zeros((walks, count, 3)) for _ in range(3))
        self.away = np.zeros((walks, count))
        self.sharp, self.back = (np.zeros((walks, count), dtype=bool) for _ in range(2))

    def part(self, rows: Integers | slice, nodes: slice = slice(None)) -> "_Lines":
        """Return some nodes of some walks."""
        some = _Lines(0, 0)
        for name, values in vars(self).items():
            setattr(some, name, values[rows, nodes])
        return some

    def set(self, at: int, position: Floats, direction: Floats, normal: Floats) -> None:
        """Fill the node that the walks start at."""
        self.position[:, at], self.direction[:, at], self.normal[:, at] = (
            position,
            direction,
            normal,
        )

    def walk(
        self,
        mesh: TriangleMesh,
        at: int,
        counts: tuple[Integers, Integers],
        step: Floats,
        sign: Floats,
        part: Integers,
        source: Integers | None = None,
    ) -> None:
        """Fill `counts` (M,) nodes after node `at`, and before it.

        Walks that begin off the mesh are bent as walk `source` (M,) is, which begins on it.
        """
        rows = np.flatnonzero((counts[0] > 0) | (counts[1] > 0))
        begin = compiled_stepping.start if mesh.compiled else geodesic_stepping.start
        fronts = begin(
            mesh,
            self.position[rows, at],
            self.normal[rows, at],
            self.direction[rows, at],
            step[rows],
            sign[rows],
            part[rows],
        )
        walks = []
        for way, front, count in zip((1, -1), fronts, counts, strict=True):
            if source is not None and len(rows) == len(source):
                _borrow_trends(front, source)
            some = rows
            if mesh.compiled:
                out = self.position, self.direction, self.normal, self.away, self.sharp, self.back
                doubt = compiled_stepping.walk_lines(mesh, front, (rows, count), (at, way), out)
                front, some = front.rows(doubt), rows[doubt]
            walks.append(_Walks(way, front, some, count[some], np.full(len(some), at)))
        self._fill(mesh, walks)

    def follow(
        self,
        mesh: TriangleMesh,
        at: int,
        counts: tuple[Integers, Integers],
        centre: Centre,
        course: WalkedNodes,
    ) -> None:
        """Fill nodes as `walk` does, those ahead with what was walked before as far as it goes."""
        ahead, behind = counts
        nodes = min(int(ahead.max(initial=0)), course.away.shape[1])
        known = np.arange(1, nodes + 1) <= np.minimum(ahead, course.count)[:, None]
        for name in ("position", "direction", "normal", "away", "sharp", "back"):
            mine = getattr(self, name)[:, at + 1 : at + 1 + nodes]
            mine[known] = getattr(course, name)[:, :nodes][known]
        on, back = np.flatnonzero(ahead > course.count), np.flatnonzero(behind > 0)
        begin = geodesic_stepping.Front(
            centre.origin,
            -centre.direction,
            centre.normal,
            course.behind_before,
            centre.step,
            centre.sign,
            centre.part,
            course.behind_trend,
            np.zeros(len(behind)),
        )
        end, done = course.end(on, centre.sign, centre.part), course.count[on]
        self._fill(
            mesh,
            (
                _Walks(1, end, on, ahead[on] - done, at + done),
                _Walks(-1, begin.rows(back), back, behind[back], np.full(len(back), at)),
            ),
        )

    def _fill(self, mesh: TriangleMesh, walks: "Sequence[_Walks]") -> None:
        """Walk all of them at once, for a step costs by its calls."""
        front = geodesic_stepping.Front.joined([one.front for one in walks])
        way = np.concatenate([np.full(len(one.rows), one.way) for one in walks])
        rows, count, at = (
            np.concatenate([getattr(one, name) for one in walks])
            for name in ("rows", "count", "at")
        )
        for k in range(1, int(count.max(initial=0)) + 1):
            on = count >= k
            if not on.all():
                front, rows, way = front.rows(on), rows[on], way[on]
                count, at = count[on], at[on]
            front, marks = geodesic_stepping.advance(mesh, front)
            node = at + way * k
            self.position[rows, node] = front.position
            self.direction[rows, node] = way[:, None] * front.direction
            self.normal[rows, node] = front.normal
            self.away[rows, node] = front.away
            self.sharp[rows, node], self.back[rows, node] = marks.sharp, marks.back


@dataclass(frozen=True)
class _Walks:
    """Walks of some rows this way (1) or that (-1): `count` nodes on from node `at` of each."""

    way: int
    front: geodesic_stepping.Front
    rows: Integers
    count: Integers
    at: Integers


def _borrow_trends(front: geodesic_stepping.Front, source: Integers) -> None:
    """Give walks the curvature of others, (M,) flat indices, in their own axes."""
    rows = np.flatnonzero(source != np.arange(len(source)))
    if len(rows) == 0:
        return
    of = source[rows]
    side = cross(front.normal, front.direction)
    along, twist = dot(front.trend, front.direction)[of], dot(front.trend, side)[of]
    front.trend[rows] = along * front.direction[rows] + twist * side[rows]
    front.away[rows] = front.step[rows, 0]
    front.before[rows] = unit(front.normal[rows] - front.step[rows] * front.trend[rows])


def _slopes(values: Floats) -> Floats:
    """Derivatives along axis 1, per step, of fourth order; at least five nodes."""
    slopes = np.empty_like(values)
    slopes[:, 2:-2] = (
        8.0 * (values[:, 3:-1] - values[:, 1:-3]) - (values[:, 4:] - values[:, :-4])
    ) / 12.0
    for node, k in ((0, 0), (1, 1), (-2, 3), (-1, 4)):
        ends = values[:, :5] if node >= 0 else values[:, -5:]
        slopes[:, node] = np.einsum("k,bk...->b...", _SLOPES[k], ends)
    return slopes
