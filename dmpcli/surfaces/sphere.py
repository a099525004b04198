"""Spheres: geodesics are great circles."""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.spatial.vectors import across, cross, dot, length, unit
from dmpcli.surfaces.sampled_chart import WalkedCharts, walked_charts
from dmpcli.surfaces.surface import ClosestPoints, Connections, Geodesics, Status

# Opposite points within this part of the radius have no one shortest way between them.
OPPOSITE = 1e-6


@dataclass(frozen=True)
class Sphere:
    """A sphere in the robot's base frame; its normals point outwards.

    Attributes
    ----------
    centre : array, shape (3,)
        mm.
    radius : float
        mm.
    """

    centre: Floats
    radius: float

    def closest(self, points: Floats) -> ClosestPoints:
        """Closest points, see `Surface`; to the centre itself, the topmost point."""
        offset = np.asarray(points, dtype=float) - self.centre
        distance = length(offset)
        normal = np.where(distance > 0.0, unit(offset), np.eye(3)[2])
        position = self.centre + self.radius * normal
        return ClosestPoints(
            position,
            normal,
            np.abs(distance[..., 0] - self.radius),
            np.full(position.shape[:-1], -1),
        )

    def walk(self, origin: Floats, direction: Floats, length: Floats) -> Geodesics:
        """Walk great circles, see `Surface`."""
        normal = unit(origin - self.centre)
        heading = across(direction, normal)
        angle = np.asarray(length, dtype=float)[..., None] / self.radius
        c, s = np.cos(angle), np.sin(angle)
        after = c * normal + s * heading
        position = origin + self.radius * (after - normal)
        return Geodesics(
            position, c * heading - s * normal, after, np.ones(position.shape[:-1], dtype=bool)
        )

    def connect(self, start: Floats, goal: Floats) -> Connections:
        """Shorter arcs of great circles, see `Surface`; none between opposite points."""
        a, b = self.closest(start).normal, self.closest(goal).normal
        sine = length(cross(a, b))
        angle = np.arctan2(sine, dot(a, b))
        size = self.radius * angle[..., 0]
        opposite = np.pi - angle[..., 0] < OPPOSITE
        status = np.where(opposite, Status.OPPOSITE, Status.DRAWN)
        return Connections(across(b - a, a), size, np.where(size > 0.0, status, Status.COINCIDENT))

    def charts(
        self, start: Floats, goal: Floats, side: Floats | None = None, closed: Floats | None = None
    ) -> WalkedCharts:
        """Lay charts, see `Surface`; they fold a quarter of a great circle off the line."""
        return walked_charts(self, start, goal, side, closed, reach=np.pi / 2.0 * self.radius)
