"""Exact geodesics of a triangle mesh: straight through each facet, unfolded across each edge.

Straightest geodesics (K. Polthier, M. Schmies: Straightest geodesics on polyhedral surfaces.
Mathematical Visualization, Springer 1998, 135-150). Exact at folds, where stepping along a smooth
normal is not; on curved parts they jitter, because neighbours pass a vertex on different sides.
"""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.spatial.vectors import across, cross, dot, turned, unit
from dmpcli.surfaces.surface import Geodesics
from dmpcli.surfaces.triangle_mesh import TriangleMesh

# More facets than this in one walk mean that it runs round and round.
MOST_FACETS = 20_000


def walk(mesh: TriangleMesh, origin: Floats, direction: Floats, length: Floats) -> Geodesics:
    """Walk geodesics facet by facet, all walks in step; see `Surface.walk`.

    Where a walk meets a border, or an edge of three or more facets, it stops there and has not
    arrived.
    """
    shape = np.shape(origin)
    hits = mesh.closest(np.asarray(origin, dtype=float).reshape(-1, 3))
    size = np.broadcast_to(length, shape[:-1]).reshape(-1)
    backward = np.where(size < 0.0, -1.0, 1.0)[:, None]
    tangent = across(np.broadcast_to(direction, shape).reshape(-1, 3), hits.normal)
    flat = mesh.face_normals[hits.face]
    heading = across(turned(tangent, hits.normal, flat), flat) * backward
    state = GeodesicState(hits.position.copy(), heading, hits.face.copy())
    arrived = (_run_compiled if mesh.compiled else _run)(mesh, state, np.abs(size))
    normal = mesh.smooth_normals(state.position, state.face)
    flat = mesh.face_normals[state.face]
    ahead = across(turned(state.heading, flat, normal), normal) * backward
    return Geodesics(
        state.position.reshape(shape),
        ahead.reshape(shape),
        normal.reshape(shape),
        arrived.reshape(shape[:-1]),
    )


@dataclass
class GeodesicState:
    """Where M walks are: position (M, 3), unit heading in the facet (M, 3), facet (M,)."""

    position: Floats
    heading: Floats
    face: Integers


def _run(mesh: TriangleMesh, state: GeodesicState, remaining: Floats) -> Booleans:
    """Walk the remaining lengths (M,) and tell which walks got there."""
    neighbours = mesh.topology.neighbours
    arrived = np.zeros(len(remaining), dtype=bool)
    remaining = remaining.copy()
    active = np.arange(len(remaining))
    entry = np.full(len(remaining), -1)
    for _ in range(MOST_FACETS):
        if len(active) == 0:
            break
        p, d, f = state.position[active], state.heading[active], state.face[active]
        edge, way, along = _exit(mesh, p, d, f, entry[active])
        ends = remaining[active] <= way
        step = np.minimum(way, remaining[active])
        state.position[active] = p + step[:, None] * d
        remaining[active] -= step
        arrived[active[ends]] = True
        after = neighbours[f, edge]
        goes_on = ~ends & (after >= 0)
        active, after, along = active[goes_on], after[goes_on], along[goes_on]
        before, edge, d = f[goes_on], edge[goes_on], d[goes_on]
        # Keep the part along the edge; the part across it goes on into the next facet.
        part = dot(d, along)
        out = dot(d, cross(along, mesh.face_normals[before]))
        state.heading[active] = unit(part * along + out * cross(along, mesh.face_normals[after]))
        state.face[active] = after
        entry[active] = np.argmax(neighbours[after] == before[:, None], axis=1)
    return arrived


def _run_compiled(mesh: TriangleMesh, state: GeodesicState, remaining: Floats) -> Booleans:
    from dmpcli.surfaces.kernels import facet_walks, tree

    facets, order = mesh.for_kernels.facets, mesh.for_kernels.rows
    rows = order[state.face]
    walks = state.position, state.heading, rows, remaining
    arrived = facet_walks.run(facets.reals, facets.numbers, *walks, MOST_FACETS)
    state.face = facets.numbers[rows, tree.FACE].astype(np.int64)
    return arrived


def _exit(
    mesh: TriangleMesh, p: Floats, d: Floats, face: Integers, entry: Integers
) -> tuple[Integers, Floats, Floats]:
    """Edge (M,) through which each walk leaves its facet, the way to it (M,), the edge's unit."""
    corners = mesh.corners[face]
    edges = unit(np.roll(corners, -1, axis=1) - corners)
    outward = cross(edges, mesh.face_normals[face][:, None])
    speed = np.einsum("nij,nj->ni", outward, d)
    room = np.einsum("nij,nij->ni", outward, corners - p[:, None])
    speed[np.arange(len(face)), entry] = np.where(
        entry >= 0, -1.0, speed[np.arange(len(face)), entry]
    )
    way = np.where(
        speed > 1e-14, np.maximum(room, 0.0) / np.where(speed > 1e-14, speed, 1.0), np.inf
    )
    edge = np.argmin(way, axis=1)
    rows = np.arange(len(face))
    return edge, way[rows, edge], edges[rows, edge]
