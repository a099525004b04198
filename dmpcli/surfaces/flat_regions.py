"""Regions within closed lines on planes, cylinders and spheres, where these can be laid flat.

A plane is flat, a cylinder is unrolled, and a sphere is seen from its centre (the gnomonic
projection): each takes geodesics to straight lines, so that a region is a polygon.
"""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Booleans, Floats
from dmpcli.errors import InputError
from dmpcli.spatial.vectors import any_tangent, cross, unit
from dmpcli.surfaces.cylinder import Cylinder
from dmpcli.surfaces.plane import Plane
from dmpcli.surfaces.sphere import Sphere

_AT_ONCE = 1 << 21
# Cosine of the largest angle from the middle of a sphere's region, near a right one.
_WIDEST = 0.05


@dataclass(frozen=True)
class Flattening:
    """How a surface is laid flat about some place on it.

    Attributes
    ----------
    surface : Plane, Cylinder or Sphere
    axes : array, shape (3, 3)
        Columns e_1, e_2 and the normal at the place: of a cylinder e_2 is its axis.
    origin : array, shape (3,)
        The place on a plane or on a cylinder's axis, the centre of a sphere, mm.
    """

    surface: Plane | Cylinder | Sphere
    axes: Floats
    origin: Floats

    def __call__(self, points: Floats) -> Floats:
        """Flat coordinates (..., 2) of points (..., 3); NaN where there are none."""
        local = (np.asarray(points, dtype=float) - self.origin) @ self.axes
        if isinstance(self.surface, Plane):
            return np.asarray(local[..., :2])
        if isinstance(self.surface, Cylinder):
            angle = np.arctan2(local[..., 0], local[..., 2])
            return np.stack([self.surface.radius * angle, local[..., 1]], axis=-1)
        height = local[..., 2:] / np.linalg.norm(local, axis=-1, keepdims=True)
        with np.errstate(divide="ignore", invalid="ignore"):
            seen = self.surface.radius * local[..., :2] / local[..., 2:]
        return np.asarray(np.where(height > _WIDEST, seen, np.nan))


def flattened(surface: Plane | Cylinder | Sphere, line: Floats) -> Flattening:
    """Lay a surface flat about the middle of a closed line (M, 3) on it.

    Raises
    ------
    InputError
        The line goes around a cylinder, or over half of a sphere.
    """
    normal = surface.closest(line).normal
    if isinstance(surface, Plane):
        n = surface.normal
        e_1 = any_tangent(n)
        return Flattening(surface, np.stack([e_1, cross(n, e_1), n], axis=-1), line[0])
    if isinstance(surface, Sphere):
        n = unit(normal.mean(axis=0))
        if (normal @ n).min() <= _WIDEST:
            raise InputError(
                "goes around half of the sphere or more, so that neither side is its inside; "
                "divide it into smaller ones"
            )
        e_1 = any_tangent(n)
        return Flattening(surface, np.stack([e_1, cross(n, e_1), n], axis=-1), surface.centre)
    return _unrolled(surface, normal)


def _unrolled(surface: Cylinder, normal: Floats) -> Flattening:
    """Unrolled from the middle of the angles that a line with these normals (M, 3) has."""
    around = cross(surface.axis, normal[0])
    angle = np.arctan2(normal @ around, normal @ normal[0])
    steps = np.diff(np.append(angle, angle[0]))
    steps -= 2.0 * np.pi * np.round(steps / (2.0 * np.pi))
    angles = angle[0] + np.concatenate([[0.0], np.cumsum(steps[:-1])])
    if abs(steps.sum()) > 1.0 or np.ptp(angles) >= 2.0 * np.pi:
        raise InputError(
            "goes around the cylinder, so that neither side is its inside; divide it into "
            "smaller ones"
        )
    middle = 0.5 * (angles.min() + angles.max())
    n = np.cos(middle) * normal[0] + np.sin(middle) * around
    axes = np.stack([cross(surface.axis, n), surface.axis, n], axis=-1)
    return Flattening(surface, axes, surface.point)


@dataclass(frozen=True)
class FlatRegion:
    """What a closed line of geodesics encloses, by the even-odd rule; see `Region`.

    Attributes
    ----------
    flat : Flattening
    corners : array, shape (M, 2)
        Of the polygon, mm.
    """

    flat: Flattening
    corners: Floats

    def holds(self, points: Floats) -> Booleans:
        """Tell which samples (B, T, 3) of paths are in it, or beyond it; see `Region`."""
        at = self.flat(points)
        held = np.zeros(at.shape[:2], dtype=bool)
        with np.errstate(invalid="ignore"):
            low, high = np.fmin.reduce(at, axis=1), np.fmax.reduce(at, axis=1)
            meets = (low <= self.corners.max(axis=0)) & (high >= self.corners.min(axis=0))
        rows = np.flatnonzero(meets.all(axis=1))
        for first in range(0, len(rows), size := self._rows_at_once(at)):
            some = rows[first : first + size]
            inside = self._inside(at[some])
            held[some] = inside
            # The step that leads out of it ends outside.
            held[some, 1:] |= self._crossed(at[some]) & ~inside[:, :-1]
        return held

    def _rows_at_once(self, at: Floats) -> int:
        return max(1, _AT_ONCE // int(at.shape[1] * len(self.corners)))

    def _inside(self, at: Floats) -> Booleans:
        """Even-odd rule: how often a line to the right meets the polygon."""
        a, b = self.corners, np.roll(self.corners, -1, axis=0)
        x, y = at[..., :1], at[..., 1:]
        spans = (a[:, 1] <= y) != (b[:, 1] <= y)
        rise = np.where(b[:, 1] == a[:, 1], 1.0, b[:, 1] - a[:, 1])
        with np.errstate(over="ignore", invalid="ignore"):  # of edges that y does not span
            meets = a[:, 0] + (y - a[:, 1]) / rise * (b[:, 0] - a[:, 0])
        return np.asarray((spans & (x < meets)).sum(axis=-1) % 2 == 1)

    def _crossed(self, at: Floats) -> Booleans:
        """Tell which steps (B, T - 1) cross the line."""
        a, b = self.corners, np.roll(self.corners, -1, axis=0)
        p, q = at[:, :-1, None], at[:, 1:, None]
        apart = (_side(p, q, a) > 0.0) != (_side(p, q, b) > 0.0)
        apart &= (_side(a, b, p) > 0.0) != (_side(a, b, q) > 0.0)
        crossed = apart.any(axis=-1)
        if isinstance(self.flat.surface, Cylinder):
            # Where the cylinder is slit open behind the region, a step crosses nothing.
            half = np.pi * self.flat.surface.radius
            crossed &= np.abs(at[:, 1:, 0] - at[:, :-1, 0]) < half
        return np.asarray(crossed & np.isfinite(at[:, 1:, 0]) & np.isfinite(at[:, :-1, 0]))


def _side(a: Floats, b: Floats, p: Floats) -> Floats:
    """On which side of the lines from a to b points p are: positive to the left."""
    along, to = b - a, p - a
    side: Floats = along[..., 0] * to[..., 1] - along[..., 1] * to[..., 0]
    return side
