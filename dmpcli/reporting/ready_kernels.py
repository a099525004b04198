"""All kernels that a report needs, compiled before it begins: then its processes only load them."""

import numpy as np

from dmpcli.metrics.deviation import Taught
from dmpcli.metrics.kernels import lying, polyline, smoothness, strokes
from dmpcli.metrics.many_on_surface import TaughtHeights
from dmpcli.metrics.motion import motions
from dmpcli.metrics.wave_height import many_waves
from dmpcli.reporting import decimals
from dmpcli.surfaces.kernels import inverse
from dmpcli.surfaces.kernels import ready as surfaces
from dmpcli.surfaces.mesh import Mesh

_STROKES = (
    *(polyline.deviations, polyline.heights_there),
    *(strokes.charted, strokes.ways, smoothness.smoothness, smoothness.arcs),
    *(strokes.turning_points, strokes.swings, decimals.written),
    *(lying.tilts, lying.over_plane, lying.spreads, lying.over_feet, lying.stretched_lengths),
)
_ON_MESHES = (
    *(inverse.closest_along, inverse.feet, inverse.guesses, inverse.extents, inverse.mark),
    *(inverse.settle, inverse.missed),
)


def files() -> list[tuple[str, str]]:
    """Folder where each kernel is kept, and what the names of its files hold; empty where none."""
    own = [surfaces.file_of(entry) for entry in (*_STROKES, *_ON_MESHES)]
    return own + surfaces.files()


def load() -> None:
    """Call each kernel once, on the least that there is."""
    _load_strokes()
    surfaces.load()
    _load_on_meshes()


def _load_strokes() -> None:
    t = np.linspace(0.0, 1.0, 9)
    p = np.ascontiguousarray(np.stack([t, t * t, 0.0 * t])[:, None])
    v, one, axes = np.zeros((1, 3)), np.ones(1), np.eye(3)[None].copy()
    smoothness.arcs(v, v, one, 1.0, 1, np.empty(1))
    place = strokes.charted(p, v, axes)
    motions(t, p, v, v, compiled=True)
    Taught(t, p[:, 0].T, compiled=True).deviations(t, place, one)
    TaughtHeights(t, np.stack([t, 0.0 * t, t], axis=1), compiled=True).at(t, p[:2], one)
    many_waves(np.sin(9.0 * t)[None], one, np.zeros(1, dtype=bool), compiled=True)
    height, length, normal = np.empty((1, 9)), np.empty(1), np.tile([0.0, 0.0, 1.0], (1, 9, 1))
    points = np.ascontiguousarray(p.transpose(1, 2, 0))
    lying.over_plane(p, v[0], v[0], one, height, length)
    lying.over_feet(points, points, normal, height, length)
    lying.spreads(height, height, length, length)
    lying.tilts(height, height, normal, length, length)
    lying.stretched_lengths(points[0], one)
    decimals.rows(["a"], v)


def _load_on_meshes() -> None:
    mesh = Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]])).with_kernels
    mesh.closest_along(np.zeros((1, 1, 3)))
    v, one, two = np.zeros((1, 1, 3)), np.ones((1, 1)), np.zeros(2)
    none = np.zeros(1, dtype=np.int64)
    limits = inverse.FootLimits(1, 1.0)
    near = v, np.zeros((1, 1), dtype=np.int64)
    inverse.feet(mesh.facets, v, near, one, limits, v, v, one, np.zeros((1, 1), dtype=bool))
    at = inverse.guesses(v, v, v, none, none, 0, one[0], v)
    inverse.extents(at)
    inverse.missed(v, v, np.zeros((1, 1, 3, 3)), v, np.zeros((1, 1)))
    step, nodes = np.ones((1, 2)), np.zeros((1, 2, 2, 12))
    inverse.mark(np.zeros((1, 1, 1), dtype=bool), at, step, two, 0.0)
    inverse.settle(nodes, step, two, at, v, v, inverse.NewtonLimits(1, 1.0, 1.0, 1.0), True)
