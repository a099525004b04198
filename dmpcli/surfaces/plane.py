"""Planes, and the chart of a plane along the line from start to goal.

A chart's axes are the columns of C = [e_u e_v n]: along the start-goal line, across it
(e_v = n × e_u), and off the surface. On a plane the chart is one rigid transform.
"""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.spatial.vectors import across, cross, dot, length, turned, unit
from dmpcli.surfaces.surface import (
    ChartImage,
    ClosestPoints,
    Connections,
    Geodesics,
    Status,
    towards,
)

# A stroke this close to its start-goal line, by its extent, does not tell its plane.
STRAIGHT = 1e-3
# A stroke is closed when start and goal are nearer than this part of its extent.
CLOSED = 0.1
# Cosine below which a direction lies in a plane and does not tell its sides apart: about a degree.
UNDECIDED = 0.02


@dataclass(frozen=True)
class Plane:
    """A plane in the robot's base frame.

    Attributes
    ----------
    point : array, shape (3,)
        mm.
    normal : array, shape (3,)
        Unit vector, on the tool's side.
    """

    point: Floats
    normal: Floats

    def facing(self, tool_axis: Floats | None) -> "Plane":
        """Return the plane with its normal turned to the tool's side: n · R e_z < 0, or up.

        A tool (or, without one, a base z axis) that lies nearly in the plane does not decide; the
        normal then stays as it was given.
        """
        toward = self.normal[2] if tool_axis is None else -(self.normal @ tool_axis)
        return Plane(self.point, -self.normal) if toward < -UNDECIDED else self

    def height(self, position: Floats) -> Floats:
        """Signed distance of points (..., 3) along the normal, mm, shape (...,)."""
        height: Floats = (np.asarray(position, dtype=float) - self.point) @ self.normal
        return height

    def closest(self, points: Floats) -> ClosestPoints:
        """Feet of the perpendiculars, see `Surface`."""
        height = self.height(points)
        position = np.asarray(points, dtype=float) - height[..., None] * self.normal
        normal = np.broadcast_to(self.normal, position.shape)
        return ClosestPoints(position, normal, np.abs(height), np.full(height.shape, -1))

    def walk(self, origin: Floats, direction: Floats, length: Floats) -> Geodesics:
        """Walk straight lines, see `Surface`."""
        heading = across(direction, self.normal)
        position = origin + np.asarray(length, dtype=float)[..., None] * heading
        normal = np.broadcast_to(self.normal, position.shape)
        heading = np.broadcast_to(heading, position.shape)
        return Geodesics(position, heading, normal, np.ones(position.shape[:-1], dtype=bool))

    def connect(self, start: Floats, goal: Floats) -> Connections:
        """Straight lines, see `Surface`."""
        way = goal - start
        way = way - dot(way, self.normal) * self.normal
        size = length(way)[..., 0]
        return Connections(unit(way), size, np.where(size > 0.0, Status.DRAWN, Status.COINCIDENT))

    def charts(
        self, start: Floats, goal: Floats, side: Floats | None = None, closed: Floats | None = None
    ) -> "PlaneCharts":
        """Lay charts, see `Surface`; start and goal are moved onto the plane along its normal."""
        start, goal = self.closest(start).position, self.closest(goal).position
        normal = np.broadcast_to(self.normal, start.shape)
        normal = normal * towards(normal, side)
        if closed is None:
            return pair_charts(start, goal, normal, closed=False)
        e_u = across(turned(closed[:, 0], closed[:, 2], normal), normal)
        return PlaneCharts(start, open_axes(e_u, normal), goal, closed=True)


@dataclass(frozen=True)
class PlaneCharts:
    """Charts of planes, one per start-goal pair.

    Attributes
    ----------
    origin : array, shape (B, 3)
        Where u = v = w = 0: the start, mm.
    axes : array, shape (B, 3, 3)
        C, columns e_u, e_v, n.
    goal : array, shape (B, 3), optional
        mm; the start where it is not given.
    closed : bool
        Whether the axes are those of closed strokes.
    """

    origin: Floats
    axes: Floats
    goal: Floats | None = None
    closed: bool = False

    def __len__(self) -> int:
        return len(self.origin)

    def rows(self, rows: Integers) -> "PlaneCharts":
        """Return the charts of some of the pairs."""
        goal = None if self.goal is None else self.goal[rows]
        return PlaneCharts(self.origin[rows], self.axes[rows], goal, self.closed)

    @property
    def normal(self) -> Floats:
        """Unit normals, shape (B, 3)."""
        return self.axes[..., 2]

    @property
    def goals(self) -> Floats:
        """Chart coordinates of the goals, shape (B, 3), mm."""
        goal = self.origin if self.goal is None else self.goal
        return self.coordinates(goal[:, None])[:, 0]

    @property
    def lengths(self) -> Floats:
        """Distances from start to goal, mm, shape (B,); 0 for closed strokes."""
        return np.zeros(len(self)) if self.closed else self.goals[:, 0]

    @property
    def status(self) -> Integers:
        """`Status` of each pair, shape (B,)."""
        if self.closed:
            return np.full(len(self), Status.DRAWN)
        return np.where(self.lengths <= 0.0, Status.COINCIDENT, Status.DRAWN)

    def coordinates(self, position: Floats) -> Floats:
        """Chart coordinates (B, T, 3) of positions (B, T, 3), mm."""
        coordinates: Floats = (position - self.origin[:, None]) @ self.axes
        return coordinates

    def over(self, points: Floats) -> Booleans:
        """All of points (B, T, 3): there is no border."""
        return np.ones(points.shape[:2], dtype=bool)

    def lift(self, coordinates: Floats) -> ChartImage:
        """Carry chart coordinates (B, T, 3), mm, to the plane: one rigid transform per pair."""
        position = self.origin[:, None] + coordinates @ np.swapaxes(self.axes, -1, -2)
        samples = coordinates.shape[:2]
        return ChartImage(
            position,
            np.broadcast_to(self.axes[:, None], (*samples, 3, 3)),
            np.zeros(samples, dtype=bool),
            self.status,
            np.zeros(len(self), dtype=bool),
        )


def extent(position: Floats) -> float:
    """Diagonal of the bounding box of positions (T, 3), mm."""
    return float(np.linalg.norm(np.ptp(position, axis=0)))


def is_closed(position: Floats) -> bool:
    """Tell whether a stroke (T, 3) ends where it began, within `CLOSED` of its extent."""
    gap = np.linalg.norm(position[-1] - position[0])
    return bool(gap < CLOSED * extent(position))


def stroke_axes(position: Floats, tool_axis: Floats | None = None) -> Floats:
    """Chart axes of a demonstrated stroke.

    Of all planes that contain the start-goal line the one that fits the stroke best; for a nearly
    straight stroke the one across the tool axis, without orientation across base z. A closed
    stroke has no such line: the best-fitting plane through its centroid, with e_u along base x
    projected into it (base y where x is normal to it).

    Parameters
    ----------
    position : array, shape (T, 3)
        mm.
    tool_axis : array, shape (3,), optional
        Unit vector along the tool into the work, R e_z.

    Returns
    -------
    array, shape (3, 3)
        C. The normal points to the tool's side, n · R e_z < 0; with no orientation towards base
        +z.
    """
    offsets = position - position[0]
    size = extent(position)
    if is_closed(position):
        centred = position - position.mean(axis=0)
        _, spread, directions = np.linalg.svd(centred, full_matrices=False)
        flat = spread[1] > STRAIGHT * np.sqrt(len(position)) * size
        normal = directions[2] if flat else _across(directions[0], tool_axis)
        return closed_axes(_towards_tool(normal, tool_axis))
    e_u = offsets[-1] / np.linalg.norm(offsets[-1])
    across = offsets - np.outer(offsets @ e_u, e_u)
    _, spread, directions = np.linalg.svd(across, full_matrices=False)
    if spread[0] > STRAIGHT * np.sqrt(len(position)) * size:
        normal = np.cross(e_u, directions[0])
    else:
        normal = _across(e_u, tool_axis)
    return open_axes(e_u, _towards_tool(normal, tool_axis))


def open_axes(e_u: Floats, normal: Floats) -> Floats:
    """Axes of the plane that contains `e_u` and is closest to parallel to the one of `normal`.

    Parameters
    ----------
    e_u : array, shape (..., 3)
        Unit vectors along the start-goal lines.
    normal : array, shape (..., 3)
        Unit normals, not along e_u.

    Returns
    -------
    array, shape (..., 3, 3)
        C = [e_u, n × e_u, n].
    """
    n = normal - np.sum(normal * e_u, axis=-1, keepdims=True) * e_u
    n = n / np.linalg.norm(n, axis=-1, keepdims=True)
    return np.stack([np.broadcast_to(e_u, n.shape), cross(n, e_u), n], axis=-1)


def closed_axes(normal: Floats) -> Floats:
    """Axes of a closed stroke's plane: e_u is base x projected into it, or y where x is normal.

    Parameters
    ----------
    normal : array, shape (3,)
        Unit normal.

    Returns
    -------
    array, shape (3, 3)
    """
    x, y = np.eye(3)[0], np.eye(3)[1]
    e_u = y if abs(normal @ x) > 1.0 - 1e-6 else x
    e_u = e_u - (e_u @ normal) * normal
    return open_axes(e_u / np.linalg.norm(e_u), normal)


def pair_charts(start: Floats, goal: Floats, normal: Floats, closed: bool) -> PlaneCharts:
    """Charts of new start-goal pairs.

    Parameters
    ----------
    start, goal : array, shape (B, 3)
        mm.
    normal : array, shape (3,) or, for open strokes, (B, 3)
        Unit normal of the plane to draw on, or of the demonstration's: then each pair has its own
        plane, the one through its line that is closest to parallel to it.
    closed : bool
        Whether the stroke is closed.

    Returns
    -------
    PlaneCharts
        Undefined for an open stroke whose line is the normal's; the caller refuses such pairs.
    """
    if closed:
        axes = np.broadcast_to(closed_axes(normal), (len(start), 3, 3))
        return PlaneCharts(start, axes, goal, closed=True)
    e_u = goal - start
    e_u = e_u / np.linalg.norm(e_u, axis=-1, keepdims=True)
    return PlaneCharts(start, open_axes(e_u, normal), goal)


def across_line(direction: Floats, preferred: Floats) -> Floats:
    """Return the normal across a line that is closest to a preferred one.

    Parameters
    ----------
    direction, preferred : array, shape (3,)
        Unit vectors; where they are parallel, base z and then base y is preferred instead.

    Returns
    -------
    array, shape (3,)
        Unit vector.
    """
    for axis in (preferred, np.eye(3)[2], np.eye(3)[1]):
        normal = axis - (axis @ direction) * direction
        length = np.linalg.norm(normal)
        if length > 1e-3:
            return np.asarray(normal / length)
    raise AssertionError("one of two perpendicular axes is always across a direction")


def _across(direction: Floats, tool_axis: Floats | None) -> Floats:
    """Return the normal of the plane along `direction` that lies most across the tool axis."""
    return across_line(direction, np.eye(3)[2] if tool_axis is None else -tool_axis)


def _towards_tool(normal: Floats, tool_axis: Floats | None) -> Floats:
    return normal * side(normal, tool_axis)


def side(normal: Floats, tool_axis: Floats | None) -> float:
    """Sign (±1) that turns `normal` to the tool's side: n · R e_z < 0, or towards base +z.

    Where that does not decide (a plane along the tool axis, or a vertical one without
    orientation) the largest component of the normal is made positive: mirrored strokes would
    otherwise follow from rounding.

    Parameters
    ----------
    normal : array, shape (3,)
        Of length 1, base axes.
    tool_axis : array, shape (3,), or None
        R e_z, which points into the work.
    """
    toward = normal[2] if tool_axis is None else -(normal @ tool_axis)
    if abs(toward) < UNDECIDED:
        toward = normal[int(np.argmax(np.abs(normal)))]
    return 1.0 if toward > 0 else -1.0
