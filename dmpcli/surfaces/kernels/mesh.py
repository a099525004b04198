"""The kernels of one mesh: its facets, made ready for them, and what they are called with."""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers, Singles
from dmpcli.surfaces.kernels import tree
from dmpcli.surfaces.kernels.tree import Facets


@dataclass(frozen=True)
class Geometry:
    """What kernels need to know of a mesh of m faces; see `TriangleMesh`."""

    faces: Integers
    corners: Floats
    face_normals: Floats
    corner_normals: Floats
    reach: Floats
    components: Integers
    neighbours: Integers
    border: Booleans
    border_vertices: Booleans


@dataclass(frozen=True)
class Compiled:
    """Facets, and where those of the mesh lie in their order, shape (m,)."""

    facets: Facets
    rows: Integers


def compiled(mesh: Geometry) -> Compiled:
    """Make facets ready: a record of each, in the order of a search tree."""
    order, first = tree.ordered(mesh.corners, tree.depth_of(len(mesh.faces)))
    m = len(order)
    reals = np.zeros((m, tree.REALS))
    reals[:, : tree.NORMAL] = mesh.corners[order].reshape(m, 9)
    reals[:, tree.NORMAL : tree.MAP] = mesh.face_normals[order]
    reals[:, tree.REACH], reals[:, tree.CLEARANCE] = mesh.reach[order], -1.0
    tree.fill(reals, mesh.corner_normals[order])
    rows = np.empty(m, dtype=np.int64)
    rows[order] = np.arange(m)
    numbers = np.zeros((m, tree.NUMBERS), dtype=np.int32)
    across = mesh.neighbours[order]
    numbers[:, :3] = np.where(across >= 0, rows[across], across)
    bits = np.array([1, 2, 4])
    ends = mesh.border_vertices[mesh.faces[order]]
    numbers[:, tree.FLAGS] = mesh.border[order] @ bits + 8 * (ends @ bits)
    numbers[:, tree.FLAGS] += 64 * _split(mesh)[mesh.faces[order]].any(axis=1)
    numbers[:, tree.PART], numbers[:, tree.FACE] = mesh.components[order], order
    numbers[:, tree.VERTICES : tree.VERTICES + 3] = mesh.faces[order]
    return Compiled(Facets(_outwards(tree.boxes_of(reals, first)), first, reals, numbers), rows)


def _split(mesh: Geometry) -> Booleans:
    """Vertices (n,) about which facets have normals of their own, or that lie on one another."""
    at, count = mesh.faces.reshape(-1), len(mesh.border_vertices)
    normals = mesh.corner_normals.reshape(-1, 3)
    one = np.zeros((count, 3))
    one[at] = normals
    split = np.zeros(count, dtype=bool)
    split[at[(np.abs(normals - one[at]) > 1e-12).any(axis=1)]] = True
    points = np.zeros((count, 3))
    points[at] = mesh.corners.reshape(-1, 3)
    # What lies at one point has one number; others may have it too, which does no harm.
    number = points @ np.array([0.6180339887, 1.4142135624, 1.7320508076])
    order = np.argsort(number, kind="stable")
    same = np.diff(number[order]) <= 1e-9 * max(1.0, float(np.abs(number).max()))
    split[order[1:][same]] = split[order[:-1][same]] = True
    return split


def _outwards(boxes: Floats) -> Singles:
    """Boxes in single precision that hold these."""
    rounded = boxes.astype(np.float32)
    for corner, way in ((slice(3), -np.inf), (slice(3, 6), np.inf)):
        rounded[:, corner] = np.nextafter(rounded[:, corner], np.float32(way))
    return rounded
