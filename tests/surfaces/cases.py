"""Strokes on surfaces with a known truth: pairs, meshes and the true curves."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from dmpcli.surfaces.cylinder import Cylinder
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.sphere import Sphere
from tests.surfaces import fields

LENGTH = 109.0
EXACT = {
    "cylinder": Cylinder(np.array([0.0, 0.0, -60.0]), np.array([0.0, 1.0, 0.0]), 60.0),
    "sphere": Sphere(np.array([0.0, 0.0, -150.0]), 150.0),
}
FIELDS = {"saddle": fields.saddle(), "bumpy": fields.bumpy()}
SURFACES = [*EXACT, *FIELDS]


@dataclass(frozen=True)
class Case:
    """Start and goal (B, 3), chart coordinates, true positions and axes (B, T, ...)."""

    start: np.ndarray
    goal: np.ndarray
    coordinates: np.ndarray
    position: np.ndarray
    axes: np.ndarray


@cache
def mesh(name, faces):
    """Return a mesh of the surface with about so many faces, large enough for the strokes."""
    n = round(np.sqrt(faces / 2)) + 1

    def cylinder(a, y):
        return np.stack([60 * np.sin(a), y, 60 * np.cos(a) - 60], axis=-1)

    def cap(x, y):
        return np.stack([x, y, np.sqrt(150.0**2 - x * x - y * y) - 150], axis=-1)

    if name == "cylinder":
        return Mesh(*fields.grid(cylinder, n, n, (-1.8, 1.8), (-100, 100)))
    if name == "sphere":
        return Mesh(*fields.grid(cap, n, n, (-90, 90), (-90, 90)))
    return Mesh(*fields.square(FIELDS[name], faces))


def distance(name, points):
    """Distance of points to the true surface."""
    if name in EXACT:
        return EXACT[name].closest(points).distance
    return FIELDS[name].distance(points)


def largest_error(name, mesh):
    """Largest distance of a mesh to the true surface, seen at its edges' and facets' middles."""
    middles = 0.5 * (mesh.corners + np.roll(mesh.corners, -1, axis=1))
    return max(distance(name, middles).max(), distance(name, mesh.corners.mean(axis=1)).max())


@cache
def case(name, headings=32, samples=500, periods=2):
    """Strokes about the middle of the surface in so many headings."""
    heading = np.linspace(0, 2 * np.pi, headings, endpoint=False) + 0.1
    half = np.full(headings, LENGTH / 2)
    coordinates = fields.strokes(2 * half, samples, periods)
    if name in EXACT:
        surface = EXACT[name]
        top = np.zeros((headings, 3))
        t = np.stack([np.cos(heading), np.sin(heading), 0 * heading], axis=-1)
        start, goal = surface.walk(top, t, -half).position, surface.walk(top, t, half).position
        lift = surface.charts(start, goal).lift(coordinates)
        return Case(start, goal, coordinates, lift.position, lift.axes)
    field = FIELDS[name]
    middle = np.zeros((headings, 2))
    t = field.tangent(middle, heading)
    xy, back = field.walk(middle, -t, half)
    end, _ = field.walk(middle, t, half)
    position, e_v, n = field.strip(xy, -back, coordinates)
    axes = np.stack([np.cross(e_v, n), e_v, n], axis=-1)
    return Case(field.point(*xy.T), field.point(*end.T), coordinates, position, axes)


def drawn(mesh, case):
    """Charts and lift of a case on a mesh, u scaled to the length on the mesh as strokes are."""
    charts = mesh.charts(case.start, case.goal)
    coordinates = case.coordinates.copy()
    coordinates[..., 0] *= (charts.lengths / LENGTH)[:, None]
    return charts, charts.lift(coordinates)


def turns(axes):
    """Angles between the frames of neighbouring samples, degrees, shape (B, T - 1)."""
    cosine = (np.einsum("btij,btij->bt", axes[:, 1:], axes[:, :-1]) - 1) / 2
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))
