"""The kernels of one mesh: its facets, made ready for them, and what they are called with."""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
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
    middle: Floats


def facets_of(mesh: Geometry) -> Facets:
    """Make facets ready: a record of each, in the order of a search tree."""
    order, first = tree.ordered(mesh.corners, tree.depth_of(len(mesh.faces)))
    m = len(order)
    corners = np.empty((m, 12))
    corners[:, :9] = mesh.corners[order].reshape(m, 9)
    corners[:, 9:] = mesh.face_normals[order]
    exact = tree.boxes_of(corners, first)
    boxes = exact.astype(np.float32)
    low, high = np.float32(-np.inf), np.float32(np.inf)
    boxes[:, :3], boxes[:, 3:] = (
        np.nextafter(boxes[:, :3], low),
        np.nextafter(boxes[:, 3:], high),
    )
    maps, edges = np.empty((m, 12)), np.empty((m, 12))
    tree.fill(corners, mesh.corner_normals[order], mesh.middle, maps, edges)
    rows = np.empty_like(order)
    rows[order] = np.arange(m, dtype=order.dtype)
    across = mesh.neighbours[order]
    across = np.where(across >= 0, rows[across], across).astype(np.int32)
    bits = np.array([1, 2, 4])
    flags = mesh.border[order] @ bits + 8 * (mesh.border_vertices[mesh.faces[order]] @ bits)
    limits = np.stack([mesh.reach[order], np.full(m, -1.0), np.zeros(m)], axis=1)
    return Facets(
        boxes,
        first,
        corners,
        maps,
        edges,
        limits,
        across,
        flags.astype(np.uint8),
        mesh.components[order].astype(np.int32),
        order,
        rows,
        mesh.faces[order].astype(np.int32),
        np.ascontiguousarray(mesh.middle),
    )
