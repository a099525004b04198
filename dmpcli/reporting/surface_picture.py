"""What a figure shows of a surface: the part near the strokes, in triangles few enough to draw."""

from collections.abc import Sequence

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.reporting.report_surface import ReportSurface
from dmpcli.spatial.vectors import any_tangent, unit
from dmpcli.surfaces.cylinder import Cylinder
from dmpcli.surfaces.sphere import Sphere

MOST_FACES = 2500
"""Triangles drawn at most, more or less; finer meshes are made coarser."""

DARK, LIGHT = 0.70, 0.96
"""Greys of a triangle seen edge-on by the light, and facing it."""

LEAST_CORNERS = 3

_STEPS = 34

_FINEST, _COARSER = 70.0, 1.2


def picture(ground: ReportSurface, low: Floats, high: Floats) -> list[Floats]:
    """Return the polygons of a surface within a box, corners (k, 3) each, mm.

    Parameters
    ----------
    ground : ReportSurface
    low, high : array, shape (3,)
        Corners of the box, mm.
    """
    size = float(np.linalg.norm(high - low))
    if ground.V is None or ground.F is None:
        corners = sheet(ground, low, high)
    else:
        corners = _near(ground.V[ground.F], low, high)
        if len(corners) > MOST_FACES:
            corners = _coarser(corners, size)
    return _within(corners, low, high)


def shades(polygons: Sequence[Floats], light: Floats) -> Floats:
    """Return light greys of m polygons under a light from `light` (3,), shape (m, 3)."""
    # Twice the area vector: clipped corners may lie close together.
    area = np.array([np.cross(p[1:-1] - p[0], p[2:] - p[0]).sum(axis=0) for p in polygons])
    facing = np.abs(unit(area.reshape(-1, 3)) @ light)
    return np.repeat(DARK + (LIGHT - DARK) * facing[:, None], 3, axis=1)


def sheet(ground: ReportSurface, low: Floats, high: Floats) -> Floats:
    """Triangles of an exact surface that cover its part in the box: two of a plane.

    Of a cylinder and a sphere a chart's grid about the point nearest to the middle of the box.

    Parameters
    ----------
    ground : ReportSurface
        A plane, a cylinder or a sphere.
    low, high : array, shape (3,)
        Corners of the box, base frame, mm.

    Returns
    -------
    array, shape (m, 3, 3)
        Corners of triangles, mm; they may lie beyond the box.
    """
    surface, middle = ground.surface, 0.5 * (low + high)
    hit = surface.closest(middle)
    e_u = any_tangent(hit.normal)
    along = half = float(0.5 * np.linalg.norm(high - low))
    steps = 1
    if isinstance(surface, Cylinder | Sphere):
        steps = _STEPS
        # Whatever is in the box is no farther from that point, as the crow flies.
        chord = half + float(hit.distance)
        angle = 2.0 * np.arcsin(min(1.0, chord / (2.0 * surface.radius)))
        along = surface.radius * angle
        half = surface.radius * min(angle, 0.5 * np.pi)
    if isinstance(surface, Cylinder):
        e_u, half = np.cross(surface.axis, hit.normal), chord
    u, v = np.meshgrid(*(r * np.linspace(-1.0, 1.0, steps + 1) for r in (along, half)))
    shape = (*u.shape, 3)
    origin, e_u = np.broadcast_to(hit.position, shape), np.broadcast_to(e_u, shape)
    line = surface.walk(origin, e_u, u)
    corners = surface.walk(line.position, np.cross(line.normal, line.direction), v).position
    a, b, c, d = corners[:-1, :-1], corners[:-1, 1:], corners[1:, 1:], corners[1:, :-1]
    pairs = np.stack([np.stack([a, b, c], axis=-2), np.stack([a, c, d], axis=-2)])
    return pairs.reshape(-1, 3, 3)


def _near(corners: Floats, low: Floats, high: Floats) -> Floats:
    inside: Booleans = np.all((corners.max(axis=1) >= low) & (corners.min(axis=1) <= high), axis=1)
    return corners[inside]


def _coarser(corners: Floats, size: float) -> Floats:
    """Merge corners that share a cell of a grid, as coarse as it takes."""
    points = corners.reshape(-1, 3)
    cell = size / _FINEST
    while True:
        _, group = np.unique(np.floor(points / cell).astype(np.int64), axis=0, return_inverse=True)
        group = group.reshape(-1)
        count = np.bincount(group)
        merged = np.stack([np.bincount(group, points[:, i]) / count for i in range(3)], axis=1)
        faces: Integers = np.unique(np.sort(group.reshape(-1, 3), axis=1), axis=0)
        faces = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2])]
        if len(faces) <= MOST_FACES:
            return merged[faces]
        cell *= _COARSER


def _within(corners: Floats, low: Floats, high: Floats) -> list[Floats]:
    """Clip triangles to a box (I. Sutherland, G. Hodgman: CACM 17 (1974) 32-42)."""
    clear = np.all((corners >= low) & (corners <= high), axis=(1, 2))
    polygons = list(corners[clear])
    for polygon in corners[~clear]:
        for i in range(3):
            polygon = _clipped(polygon, polygon[:, i] - low[i])
            polygon = _clipped(polygon, high[i] - polygon[:, i])
        if len(polygon) >= LEAST_CORNERS:
            polygons.append(polygon)
    return polygons


def _clipped(polygon: Floats, inside: Floats) -> Floats:
    """Return the part of a polygon (k, 3) where `inside` (k,), linear over it, is not negative."""
    kept = []
    for i, here in enumerate(inside):
        before = inside[i - 1]
        if (here >= 0.0) != (before >= 0.0):
            share = before / (before - here)
            kept.append(polygon[i - 1] + share * (polygon[i] - polygon[i - 1]))
        if here >= 0.0:
            kept.append(polygon[i])
    return np.array(kept).reshape(-1, 3)
