"""Cylinders: unrolled, every geodesic is a straight line."""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.spatial.vectors import any_tangent, cross, dot, length, unit
from dmpcli.surfaces.sampled_chart import WalkedCharts, walked_charts
from dmpcli.surfaces.surface import ClosestPoints, Connections, Geodesics, Status


@dataclass(frozen=True)
class Cylinder:
    """An endless cylinder in the robot's base frame; its normals point outwards.

    Attributes
    ----------
    point : array, shape (3,)
        On the axis, mm.
    axis : array, shape (3,)
        Unit vector.
    radius : float
        mm.
    """

    point: Floats
    axis: Floats
    radius: float

    def closest(self, points: Floats) -> ClosestPoints:
        """Closest points, see `Surface`; on the axis itself, some point beside it."""
        offset = np.asarray(points, dtype=float) - self.point
        height = dot(offset, self.axis)
        radial = offset - height * self.axis
        off_axis = length(radial)
        normal = np.where(off_axis > 0.0, unit(radial), any_tangent(self.axis))
        position = self.point + height * self.axis + self.radius * normal
        return ClosestPoints(
            position,
            normal,
            np.abs(off_axis[..., 0] - self.radius),
            np.full(position.shape[:-1], -1),
        )

    def walk(self, origin: Floats, direction: Floats, length: Floats) -> Geodesics:
        """Walk helices, see `Surface`."""
        normal = self.closest(origin).normal
        around = cross(self.axis, normal)
        along = np.stack(
            [np.sum(direction * around, axis=-1), np.sum(direction * self.axis, axis=-1)], axis=-1
        )
        along = along / np.linalg.norm(along, axis=-1, keepdims=True)
        way = np.asarray(length, dtype=float)[..., None] * along
        angle = way[..., :1] / self.radius
        c, s = np.cos(angle), np.sin(angle)
        after, tangent = c * normal + s * around, c * around - s * normal
        position = origin + self.radius * (after - normal) + way[..., 1:] * self.axis
        heading = along[..., :1] * tangent + along[..., 1:] * self.axis
        return Geodesics(position, heading, after, np.ones(position.shape[:-1], dtype=bool))

    def connect(self, start: Floats, goal: Floats) -> Connections:
        """Shortest helices, see `Surface`."""
        a, b = self.closest(start), self.closest(goal)
        around = cross(self.axis, a.normal)
        angle = np.arctan2(dot(b.normal, around), dot(b.normal, a.normal))
        height = dot(b.position - a.position, self.axis)
        way = self.radius * angle * around + height * self.axis
        size = length(way)[..., 0]
        status = np.where(size > 0.0, Status.DRAWN, Status.COINCIDENT)
        return Connections(unit(way), size, status)

    def charts(
        self, start: Floats, goal: Floats, side: Floats | None = None, closed: Floats | None = None
    ) -> WalkedCharts:
        """Lay charts, see `Surface`."""
        return walked_charts(self, start, goal, side, closed)
