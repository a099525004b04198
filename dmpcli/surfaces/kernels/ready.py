"""All kernels that a job needs, compiled before it begins: then its processes only load them."""

import numpy as np

from dmpcli.spatial import rotations
from dmpcli.spatial.kernels import euler_of_products
from dmpcli.surfaces.kernels import (
    checks,
    facet_walks,
    samples,
    shape,
    smoothing,
    stepping,
    tree,
    tree_order,
)
from dmpcli.surfaces.kernels.mesh import Compiled, Geometry

_ENTRIES = (
    tree_order.ordered,
    tree_order.boxes_of,
    tree.fill,
    tree.shape,
    tree.split,
    tree.search,
    stepping.start,
    stepping.ends,
    stepping.lines,
    samples.lift,
    samples.frames,
    checks.sound,
    facet_walks.run,
    smoothing.smoothed,
    euler_of_products,
    shape.face_normals,
    shape.dihedrals,
    shape.tilted,
    shape.leaning_back,
    shape.leans,
    shape.heights,
    shape.reach,
)


def files() -> list[tuple[str, str]]:
    """Folder where each kernel is kept, and what the names of its files hold; empty where none."""
    return [file_of(entry) for entry in _ENTRIES]


def file_of(entry: object) -> tuple[str, str]:
    """Return the same of one kernel."""
    stats, name = getattr(entry, "stats", None), getattr(entry, "__name__", "")
    return getattr(stats, "cache_path", None) or "", f".{name}-"


def load() -> None:
    """Call each kernel once, on the least that there is: two facets, nothing to walk."""
    corners = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0], [0, 1, 0]]])
    faces = np.array([[0, 1, 2], [1, 3, 2]])
    n = np.tile([0.0, 0.0, 1.0], (2, 1))
    none = np.zeros((2, 3), dtype=bool)
    neighbours = np.array([[-1, 1, -1], [-1, -1, 0]])
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    parts, border = np.zeros(2, dtype=np.int64), np.zeros(4, dtype=bool)
    mesh = Geometry(points, faces, corners, n, parts, neighbours, border)
    known = Compiled(mesh, tree_order.TreeOrder.of(corners))
    normals = np.repeat(n[:, None], 3, axis=1)
    known.learn(np.arange(2), normals, np.ones(2), np.ones(2, dtype=bool))
    facets = known.facets
    facing, means = shape.face_normals(corners), np.tile(n[:1], (4, 1))
    angles = shape.dihedrals(facing, neighbours)
    shape.tilted(facing, means, faces, angles, 0.0, 0.6)
    shape.leaning_back(normals, facing, angles, np.zeros(2), 5.0, 2.0, 0.3)
    shape.leans(means, faces, facing, 0.9)
    high = shape.heights(corners, means, faces, neighbours, angles, 0.5)
    shape.reach(faces, high, np.zeros(2), 4, 0.3)
    v, one, number, mark = np.empty((0, 3)), np.empty((0, 1)), np.empty(0, np.int64), none[:0, 0]
    tree.search(facets, v)
    walks = stepping.Walks(v, v, v, v, one, one, number, v, one[:, 0])
    limits = stepping.WalkLimits(0.9, -0.5, 0.3, 0.05, 0.01)
    stepping.start(facets, limits, walks, walks, mark)
    stepping.ends(facets, limits, walks, number, mark, mark, mark)
    line = np.empty((0, 1, 3))
    nodes = stepping.NodeArrays(line, line, line, one, none[:0, :1], none[:0, :1])
    stepping.lines(facets, limits, walks, number, number, 0, 1, nodes, mark)
    cell = np.empty((0, 2, 2))
    strip = samples.StripNodes(np.empty((0, 2, 2, 12)), np.empty((0, 2, 2, 3)), cell, cell)
    flat, flags = np.empty((0, 1)), none[:0, :1]
    feet = samples.SampleFeet(
        line, line, line, flat.astype(np.int64), flat, flags, flags, flags, flags, line, line
    )
    where = samples.SampleLimits(0.01, 0.05)
    samples.lift(facets, strip, flat, flat, one, number, where, feet)
    samples.frames(line, line, np.empty((0, 1, 3, 3)))
    checked = checks.CheckedStrokes(line, line, line, flat.astype(np.int64), flat, flags, v, v, v)
    checks.sound(facets.reals, number, checked, checks.CheckLimits(3.0, 0.3, 1e-3, 0.9, 1e-6, 0.01))
    facet_walks.run(facets.reals, facets.numbers, v, v, number, one[:, 0], 1)
    frame = np.tile(np.eye(3), (1, 3, 1, 1))
    smoothing.smoothed(frame, np.zeros((1, 3, 3)), 1.0, 1, 0.1)
    rotations.euler_of_paths(frame[:, :1], frame)
