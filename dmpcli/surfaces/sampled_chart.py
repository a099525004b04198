"""Charts lifted by walking every sample: along the centre line, then at a right angle off it.

Exact wherever the walk is: closed forms on planes, cylinders and spheres, unfolding on meshes.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.spatial.vectors import across, cross, turned
from dmpcli.surfaces.surface import ChartImage, Geodesics, Status, Surface, towards

Walk = Callable[[Floats, Floats, Floats], Geodesics]


@dataclass(frozen=True)
class WalkedCharts:
    """Charts whose lift is two walks.

    Attributes
    ----------
    walk : callable
        See `Surface.walk`.
    origin, direction : array, shape (B, 3)
        Start, mm, and e_u there.
    sign : array, shape (B, 1)
        Turns the surface's normal to the tool's side.
    lengths : array, shape (B,)
        mm.
    goals : array, shape (B, 3)
        Chart coordinates, mm.
    status : array of int, shape (B,)
    reach : float
        The chart folds where |v| comes to this, mm.
    """

    walk: Walk
    origin: Floats
    direction: Floats
    sign: Floats
    lengths: Floats
    goals: Floats
    status: Integers
    reach: float = np.inf

    def __len__(self) -> int:
        return len(self.origin)

    def rows(self, rows: Integers) -> "WalkedCharts":
        """Return the charts of some of the pairs."""
        return WalkedCharts(
            self.walk,
            self.origin[rows],
            self.direction[rows],
            self.sign[rows],
            self.lengths[rows],
            self.goals[rows],
            self.status[rows],
            self.reach,
        )

    def over(self, points: Floats) -> Booleans:
        """All of points (B, T, 3): there is no border."""
        return np.ones(points.shape[:2], dtype=bool)

    def lift(self, coordinates: Floats) -> ChartImage:
        """Carry chart coordinates (B, T, 3), mm, to the surface."""
        position, axes, arrived = walk_samples(
            self.walk, self.origin, self.direction, self.sign, coordinates
        )
        folded = np.any(np.abs(coordinates[..., 1]) >= self.reach, axis=1)
        status = np.where((self.status == Status.DRAWN) & folded, Status.FOLDED, self.status)
        outside = ~arrived
        left = (status == Status.DRAWN) & np.any(outside, axis=1)
        return ChartImage(
            position,
            axes,
            outside,
            np.where(left, Status.BORDER, status),
            np.zeros(len(self), dtype=bool),
        )


def walk_samples(
    walk: Walk, origin: Floats, direction: Floats, sign: Floats, coordinates: Floats
) -> tuple[Floats, Floats, np.ndarray]:
    """Positions, axes and arrival of chart coordinates.

    Parameters
    ----------
    walk : callable
        See `Surface.walk`.
    origin, direction : array, shape (B, 3)
        Starts on the surface, mm, and unit e_u there.
    sign : array, shape (B, 1)
        Turns the surface's normals to the tool's side.
    coordinates : array, shape (B, T, 3)
        u, v, w, mm.

    Returns
    -------
    position : array, shape (B, T, 3)
        w off the surface, mm.
    axes : array, shape (B, T, 3, 3)
        Columns e_u, e_v, n.
    arrived : array of bool, shape (B, T)
        Whether both walks stayed on the surface.
    """
    shape = coordinates.shape
    spread = np.broadcast_to
    along = walk(
        spread(origin[:, None], shape), spread(direction[:, None], shape), coordinates[..., 0]
    )
    e_v = cross(sign[:, None] * along.normal, along.direction)
    off = walk(along.position, e_v, coordinates[..., 1])
    normal = sign[:, None] * off.normal
    axes = np.stack([cross(off.direction, normal), off.direction, normal], axis=-1)
    position = off.position + coordinates[..., 2:] * normal
    return position, axes, along.arrived & off.arrived


def walked_charts(
    surface: Surface,
    start: Floats,
    goal: Floats,
    side: Floats | None,
    closed: Floats | None,
    reach: float = np.inf,
) -> WalkedCharts:
    """Charts of an exact surface; see `Surface.charts`."""
    origin, target = surface.closest(start), surface.closest(goal)
    sign = towards(origin.normal, side)
    link = surface.connect(origin.position, target.position)
    direction, lengths, status = link.direction, link.length, link.status
    goals = np.stack([lengths, 0 * lengths, 0 * lengths], axis=-1)
    if closed is not None:
        direction = closed_direction(closed, sign * origin.normal)
        lengths, status = np.zeros_like(lengths), np.zeros_like(status)
        goals = np.zeros_like(goals)
    charts = WalkedCharts(
        surface.walk, origin.position, direction, sign, lengths, goals, status, reach
    )
    if closed is None:
        return charts
    return WalkedCharts(
        surface.walk,
        origin.position,
        direction,
        sign,
        lengths,
        goal_coordinates(charts.lift, target.position),
        status,
        reach,
    )


def closed_direction(closed: Floats, normal: Floats) -> Floats:
    """e_u of closed strokes: that of their plane, turned to the normals with the least turn.

    Parameters
    ----------
    closed : array, shape (3, 3)
        Axes C of the plane that the strokes are in, as columns.
    normal : array, shape (B, 3)
        At the starts, on the tool's side.

    Returns
    -------
    array, shape (B, 3)
        Tangent, of length 1.
    """
    return across(turned(closed[:, 0], closed[:, 2], normal), normal)


def goal_coordinates(lift: Callable[[Floats], ChartImage], goal: Floats) -> Floats:
    """Chart coordinates of goals near the start, by a few Newton steps.

    Parameters
    ----------
    lift : callable
        Of the charts: from coordinates (B, 1, 3), mm, to the surface.
    goal : array, shape (B, 3)
        On the surface, mm.

    Returns
    -------
    array, shape (B, 3)
        u, v, mm, and w = 0.
    """
    found = np.zeros((len(goal), 1, 3))
    for _ in range(4):
        there = lift(found)
        gap = (goal[:, None] - there.position)[..., None, :] @ there.axes
        found[..., :2] += gap[..., 0, :2]
    return found[:, 0]
