"""Regions within closed lines on meshes.

A line is traced from facet to facet, each of its parts in the plane through its two points and the
mean normal about there. Each edge of the mesh is crossed an even or an odd number of times: from
vertex to vertex that tells the sides of the line apart, whatever the shape of the part. Within a
facet the line's own segments do.
"""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.errors import InputError
from dmpcli.spatial.vectors import cross, dot, length, unit
from dmpcli.surfaces.mesh import Mesh

_MOST_FACETS = 20_000
# Points are moved off edges and vertices by this part of the way to the facet's middle.
_OFF_EDGE = 1e-6
# Between samples the mesh is looked at so often, mm.
_STEP = 0.25
_MOST_BETWEEN = 32


@dataclass(frozen=True)
class TracedLine:
    """A closed line on a mesh.

    Attributes
    ----------
    face : array of int, shape (S,)
        Facets of its segments.
    begin, end : array, shape (S, 3)
        mm.
    crossed : array of int, shape (C, 2)
        Vertices of the edges that it crosses, one row for each time.
    """

    face: Integers
    begin: Floats
    end: Floats
    crossed: Integers


def traced(mesh: Mesh, line: Floats) -> TracedLine:
    """Trace a closed line of points (M, 3) on a mesh; the last is joined to the first.

    Raises
    ------
    InputError
        The line leaves the mesh, or does not find from one point to the next.
    """
    point, face = mesh.search(line)
    point = point + _OFF_EDGE * (mesh.corners[face].mean(axis=1) - point)
    goal, last = np.roll(point, -1, axis=0), np.roll(face, -1)
    n = mesh.face_normals
    # Between two points on the edges of a facet the facet's own normal counts most.
    middle = mesh.search(0.5 * (point + goal))[1]
    normal = unit(n[middle] + 0.5 * (n[face] + n[last]))
    side = cross(goal - point, normal)
    faces: list[Integers] = []
    begins: list[Floats] = []
    ends: list[Floats] = []
    crossed: list[Integers] = []
    active = np.arange(len(point))
    at, entry, now = point.copy(), np.full(len(point), -1), face.copy()
    for _ in range(_MOST_FACETS):
        f = now[active]
        there = f == last[active]
        if there.any():
            done = active[there]
            faces.append(now[done])
            begins.append(at[done])
            ends.append(goal[done])
            active, f = active[~there], f[~there]
        if len(active) == 0:
            begin, end = np.concatenate(begins), np.concatenate(ends)
            return TracedLine(np.concatenate(faces), begin, end, _pairs(crossed))
        edge, meets = _exit(mesh, f, point[active], goal[active], side[active], entry[active])
        after = mesh.topology.neighbours[f, edge]
        lost = (after < 0) | (after == face[active])
        if lost.any():
            _refuse(active[lost], after[lost] < 0, len(line))
        faces.append(f)
        begins.append(at[active])
        ends.append(meets)
        crossed.append(np.stack([mesh.F[f, edge], mesh.F[f, (edge + 1) % 3]], axis=1))
        entry[active] = np.argmax(mesh.topology.neighbours[after] == f[:, None], axis=1)
        at[active], now[active] = meets, after
    _refuse(active, np.zeros(len(active), dtype=bool), len(line))
    raise AssertionError("a line that does not arrive is refused")


def _pairs(crossed: list[Integers]) -> Integers:
    return np.concatenate(crossed) if crossed else np.empty((0, 2), dtype=np.int64)


def _refuse(parts: Integers, off: Booleans, count: int) -> None:
    first = int(np.argmin(parts))
    a, b = int(parts[first]) + 1, (int(parts[first]) + 1) % count + 1
    what = "leaves the mesh" if off[first] else "does not find along the mesh"
    raise InputError(f"{what} between its points {a} and {b}; give more points between them")


def _exit(
    mesh: Mesh, face: Integers, start: Floats, goal: Floats, side: Floats, entry: Integers
) -> tuple[Integers, Floats]:
    """Edges (A,) through which planes leave facets, not by `entry`, and where (A, 3)."""
    corners = mesh.corners[face]
    # One sign for each vertex, in whichever facet it is met: that is what keeps a walk together.
    height = dot(corners - start[:, None], side[:, None])[..., 0]
    above = height >= 0.0
    following = np.roll(above, -1, axis=1)
    rows = np.arange(len(face))
    leaves = above != following
    leaves[rows[entry >= 0], entry[entry >= 0]] = False
    ahead = np.roll(height, -1, axis=1)
    share = np.clip(height / np.where(leaves, height - ahead, 1.0), 0.0, 1.0)
    places = corners + share[..., None] * (np.roll(corners, -1, axis=1) - corners)
    along = dot(places - start[:, None], (goal - start)[:, None])[..., 0]
    edge = np.argmax(np.where(leaves, along, -np.inf), axis=1)
    return edge, places[rows, edge]


@dataclass(frozen=True)
class MeshRegion:
    """What a closed line on a mesh encloses; see `Region`.

    Of the two sides of an open mesh that is inside which has less of the border, of a closed one
    that with less area.

    Attributes
    ----------
    mesh : Mesh
    face, begin, end
        Segments of the line in the order of their facets; see `TracedLine`.
    within : array of bool, shape (n,)
        Vertices inside.
    low, high : array, shape (3,)
        A box about the region, mm.
    """

    mesh: Mesh
    face: Integers
    begin: Floats
    end: Floats
    within: Booleans
    low: Floats
    high: Floats

    def holds(self, points: Floats) -> Booleans:
        """Tell which samples (B, T, 3) of paths are in it, or beyond it; see `Region`."""
        held = np.zeros(points.shape[:2], dtype=bool)
        low, high = points.min(axis=1), points.max(axis=1)
        near = np.all((low <= self.high) & (high >= self.low), axis=1)
        for row in np.flatnonzero(near):
            held[row] = self._path(points[row])
        return held

    def _path(self, points: Floats) -> Booleans:
        """As `holds`, for one path (T, 3): looked at between its samples too."""
        steps = length(np.diff(points, axis=0))[:, 0]
        parts = np.clip(np.ceil(steps / _STEP).astype(np.int64), 1, _MOST_BETWEEN)
        ends = np.concatenate([[0], np.cumsum(parts)])
        sample = np.repeat(np.arange(len(steps)), parts)
        share = (np.arange(ends[-1]) - ends[sample] + 1) / parts[sample]
        fine = points[sample] + share[:, None] * (points[sample + 1] - points[sample])
        inside = self.inside(np.concatenate([points[:1], fine]))
        between = np.logical_or.reduceat(inside[1:], ends[:-1])
        held: Booleans = inside[ends]
        # The step that leads out of it ends outside.
        held[1:] |= between & ~held[:-1]
        return held

    def inside(self, points: Floats) -> Booleans:
        """Tell which points (N, 3) near the mesh are inside."""
        foot, face = self.mesh.search(points)
        foot = foot + _OFF_EDGE * (self.mesh.corners[face].mean(axis=1) - foot)
        corner = self.mesh.F[face, 0]
        inside: Booleans = self.within[corner].copy()
        first = np.searchsorted(self.face, face, side="left")
        count = np.searchsorted(self.face, face, side="right") - first
        some = np.flatnonzero(count)
        if len(some) == 0:
            return inside
        of = np.repeat(some, count[some])
        offset = np.arange(len(of)) - np.repeat(np.cumsum(count[some]) - count[some], count[some])
        segment = first[of] + offset
        # In the facet's plane: without the coordinate that its normal has most of.
        drop = np.argmax(np.abs(self.mesh.face_normals[face[of]]), axis=1)
        keep = np.array([[1, 2], [0, 2], [0, 1]])[drop]

        def flat(p: Floats) -> Floats:
            return np.take_along_axis(p, keep, axis=1)

        ends = flat(self.begin[segment]), flat(self.end[segment])
        crossed = _cross(*ends, flat(foot[of]), flat(self.mesh.V[corner[of]]))
        odd = np.bincount(of, crossed, len(points)).astype(np.int64) % 2 == 1
        return np.asarray(inside ^ odd)


def _cross(a: Floats, b: Floats, p: Floats, q: Floats) -> Booleans:
    """Tell which segments from a to b cross those from p to q, all (N, 2)."""

    def left(a: Floats, b: Floats, p: Floats) -> Booleans:
        along, to = b - a, p - a
        return np.asarray(along[:, 0] * to[:, 1] - along[:, 1] * to[:, 0] > 0.0)

    return np.asarray((left(a, b, p) != left(a, b, q)) & (left(p, q, a) != left(p, q, b)))


def mesh_region(mesh: Mesh, line: Floats) -> MeshRegion:
    """Return what a closed line of points (M, 3) on a mesh encloses.

    Raises
    ------
    InputError
        As of `traced`; or the line does not part the mesh in two.
    """
    found = traced(mesh, line)
    part = mesh.components[found.face[0]]
    member = np.zeros(len(mesh.V), dtype=bool)
    member[mesh.F[mesh.components == part]] = True
    other = _sides(mesh, found.crossed, member)
    within = other if _is_inside(mesh, other, part) else member & ~other
    order = np.argsort(found.face, kind="stable")
    box = np.concatenate([mesh.V[within], found.begin])
    face, begin, end = found.face[order], found.begin[order], found.end[order]
    # Over a curved part a lifted sample may be a little outside of the box.
    room = 1.0 + 0.05 * np.ptp(box, axis=0)
    return MeshRegion(
        mesh, face, begin, end, within, box.min(axis=0) - room, box.max(axis=0) + room
    )


def _sides(mesh: Mesh, crossed: Integers, member: Booleans) -> Booleans:
    """Vertices (n,) on the other side of the line than the first of its component."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    n = len(mesh.V)
    edges = np.concatenate([mesh.F[:, [0, 1]], mesh.F[:, [1, 2]], mesh.F[:, [2, 0]]])
    edges = np.unique(np.sort(edges, axis=1), axis=0)
    keys, times = np.unique(np.sort(crossed, axis=1) @ np.array([n, 1]), return_counts=True)
    odd = np.isin(edges @ np.array([n, 1]), keys[times % 2 == 1])
    # Two copies of each vertex; an edge that is crossed leads from one copy to the other.
    a, b = edges.T
    here, there = b + n * odd, b + n * ~odd
    links = np.ones(2 * len(edges), dtype=bool)
    ends = np.concatenate([a, a + n]), np.concatenate([here, there])
    _, label = connected_components(coo_array((links, ends), shape=(2 * n, 2 * n)), directed=False)
    first = int(np.argmax(member))
    if label[first] == label[first + n]:
        raise InputError(
            "does not part the mesh in two, as a line around a handle does not; divide the region"
        )
    return np.asarray(member & (label[:n] != label[first]))


def _is_inside(mesh: Mesh, other: Booleans, part: int) -> bool:
    """Tell whether a side of the line, by its vertices, is the inside."""
    faces = np.flatnonzero(mesh.components == part)
    F, corners = mesh.F[faces], mesh.corners[faces]
    weight = np.where(
        mesh.topology.border[faces], length(np.roll(corners, -1, axis=1) - corners)[..., 0], 0.0
    )
    if weight.any():
        share = 0.5 * (other[F].astype(float) + other[np.roll(F, -1, axis=1)])
    else:
        area = length(cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
        weight, share = np.repeat(area, 3, axis=1), other[F].astype(float)
    return bool((weight * share).sum() <= 0.5 * weight.sum())
