"""Geodesics from A to B found over all headings at once, where shooting along a few did not lead.

The facets about A are unfolded into the plane, outwards from A. What is seen of an edge through the
edges before it is a window, an interval of headings; behind the edge it is parted at the far corner
of the next facet (J. Chen, Y. Han: Shortest paths on a polyhedron. SCG 1990, 360-369). All straight
lines up to a length are followed that way, each once, so that what is not found does not exist.
Windows too far from A and B to be on a line of that length are left out.
"""

from dataclasses import dataclass, fields

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.spatial.vectors import any_tangent, cross, dot, length, unit
from dmpcli.surfaces.triangle_mesh import TriangleMesh

# Lines are looked for up to so many times the chord, one after the other, and then as long as the
# way along the edges, so that the shortest way is among them unless it bends at a corner.
_LENGTHS = (1.1, 2.0, 4.5)
_ALONG_EDGES = 1.01
# A point is nudged into its facet by this part of the way to the middle, so that it is on no edge.
_INTO = 1e-7
# Windows narrower than this, rad, hold no line that could be told from those beside it; goals
# beside a window by no more count as in it.
_NARROW = 1e-9
# So many windows of one pair, and the search gives up.
_MOST = 400_000
_PAIRS_AT_ONCE = 32


def find(mesh: TriangleMesh, origin: Floats, goal: Floats) -> tuple[Floats, Floats, Booleans]:
    """Find the shortest straight line over the facets from each origin to its goal.

    Parameters
    ----------
    mesh : TriangleMesh
    origin, goal : array, shape (B, 3)
        Points of the mesh, mm.

    Returns
    -------
    direction : array, shape (B, 3)
        Unit headings in the facets of the origins.
    length : array, shape (B,)
        mm.
    found : array of bool, shape (B,)
    """
    count = len(origin)
    direction, size, found = np.zeros((count, 3)), np.zeros(count), np.zeros(count, dtype=bool)
    for first in range(0, count, _PAIRS_AT_ONCE):
        rows = np.arange(first, min(first + _PAIRS_AT_ONCE, count))
        pairs = _Pairs.of(mesh, origin[rows], goal[rows])
        chord = length(goal[rows] - origin[rows])[:, 0]
        for times in _LENGTHS:
            left = np.flatnonzero(~found[rows])
            _look(mesh, pairs, left, times * chord, (rows, direction, size, found))
        left = np.flatnonzero(~found[rows])
        if len(left):
            longest = np.zeros(len(rows))
            longest[left] = _ALONG_EDGES * _along_edges(mesh, pairs, left)
            left = left[(longest > _LENGTHS[-1] * chord)[left]]
            _look(mesh, pairs, left, longest, (rows, direction, size, found))
    return direction, size, found


@dataclass(frozen=True)
class _Pairs:
    """Origins and goals (B, 3), their facets (B,), axes of the origins' facets (B, 3)."""

    origin: Floats
    goal: Floats
    face: Integers
    goal_face: Integers
    e_x: Floats
    e_y: Floats

    @classmethod
    def of(cls, mesh: TriangleMesh, origin: Floats, goal: Floats) -> "_Pairs":
        _, face = mesh.search(np.concatenate([origin, goal]))
        face, goal_face = face[: len(origin)], face[len(origin) :]
        inside = origin + _INTO * (mesh.corners[face].mean(axis=1) - origin)
        n = mesh.face_normals[face]
        e_x = any_tangent(n)
        return cls(inside, goal, face, goal_face, e_x, cross(n, e_x))


@dataclass(frozen=True)
class _Windows:
    """Edges as they are seen from the origin, in the plane of its facet.

    Attributes
    ----------
    pair, face, edge : array of int, shape (W,)
        The facet behind the edge, and the edge's number in it.
    a, b : array, shape (W, 2)
        Its ends, clockwise and counter-clockwise, mm, from the origin.
    right, left : array, shape (W, 2)
        Unit headings between which it is seen, clockwise and counter-clockwise.
    """

    pair: Integers
    face: Integers
    edge: Integers
    a: Floats
    b: Floats
    right: Floats
    left: Floats

    def rows(self, rows: Integers | Booleans) -> "_Windows":
        return _Windows(*(getattr(self, field.name)[rows] for field in fields(self)))

    def __len__(self) -> int:
        return len(self.pair)


def _look(
    mesh: TriangleMesh,
    pairs: _Pairs,
    left: Integers,
    longest: Floats,
    results: tuple[Integers, Floats, Floats, Booleans],
) -> None:
    """Look for lines no longer than `longest` from some of the pairs, and note what is found."""
    if len(left) == 0:
        return
    rows, direction, size, found = results
    best, heading = np.full(len(longest), np.inf), np.zeros((len(longest), 2))
    spent = np.zeros(len(longest), dtype=np.int64)
    windows, seen = _first(mesh, pairs, left), left
    flat = _plane(pairs, left, pairs.goal[left])
    same = pairs.goal_face[left] == pairs.face[left]
    best[seen[same]], heading[seen[same]] = _size(flat[same]), _unit(flat[same])
    while len(windows):
        spent += np.bincount(windows.pair, minlength=len(spent))
        goal = np.flatnonzero(windows.face == pairs.goal_face[windows.pair])
        _note(mesh, pairs, windows.rows(goal), best, heading)
        limit = np.minimum(longest, best)
        limit[spent > _MOST] = 0.0
        windows = _behind(mesh, pairs, windows, limit)
    hit = left[best[left] <= longest[left]]
    along = heading[hit, :1] * pairs.e_x[hit] + heading[hit, 1:] * pairs.e_y[hit]
    direction[rows[hit]], size[rows[hit]], found[rows[hit]] = along, best[hit], True


def _plane(pairs: _Pairs, pair: Integers, points: Floats) -> Floats:
    """Points (W, 3) of the origins' facets in their planes, (W, 2), from the origins."""
    off = points - pairs.origin[pair]
    return np.stack([dot(off, pairs.e_x[pair])[:, 0], dot(off, pairs.e_y[pair])[:, 0]], axis=1)


def _first(mesh: TriangleMesh, pairs: _Pairs, left: Integers) -> _Windows:
    """Windows of the edges of the origins' own facets."""
    pair, edge = np.repeat(left, 3), np.tile(np.arange(3), len(left))
    face = pairs.face[pair]
    a = _plane(pairs, pair, mesh.corners[face, edge])
    b = _plane(pairs, pair, mesh.corners[face, (edge + 1) % 3])
    return _crossed(mesh, _Windows(pair, face, edge, a, b, _unit(a), _unit(b)))


def _crossed(mesh: TriangleMesh, seen: _Windows) -> _Windows:
    """Windows as seen from the facets behind their edges, numbered in those; borders end them."""
    after = mesh.topology.neighbours[seen.face, seen.edge]
    wide = _cross(seen.right, seen.left) > _NARROW
    on = np.flatnonzero((after >= 0) & wide)
    edge = np.argmax(mesh.topology.neighbours[after[on]] == seen.face[on, None], axis=1)
    some = seen.rows(on)
    return _Windows(some.pair, after[on], edge, some.a, some.b, some.right, some.left)


def _note(
    mesh: TriangleMesh, pairs: _Pairs, windows: _Windows, best: Floats, heading: Floats
) -> None:
    """Note goals that are seen through windows of their facets, nearer than any before."""
    if len(windows) == 0:
        return
    at = _unfolded(mesh, windows, pairs.goal[windows.pair])
    size = _size(at)
    way = _unit(at)
    seen = (_cross(windows.right, way) > -_NARROW) & (_cross(way, windows.left) > -_NARROW)
    # The farthest first, so that the nearest stays.
    order = np.flatnonzero(seen)[np.argsort(-size[seen], kind="stable")]
    closer = order[size[order] < best[windows.pair[order]]]
    best[windows.pair[closer]], heading[windows.pair[closer]] = size[closer], way[closer]


def _unfolded(mesh: TriangleMesh, windows: _Windows, points: Floats) -> Floats:
    """Points (W, 3) of the facets behind the windows, unfolded into the plane, (W, 2)."""
    # The edge runs from b to a in the facet behind it.
    b = mesh.corners[windows.face, windows.edge]
    a = mesh.corners[windows.face, (windows.edge + 1) % 3]
    along = unit(b - a)
    off = points - a
    x = dot(off, along)
    y = dot(off, cross(mesh.face_normals[windows.face], -along))
    e = _unit(windows.b - windows.a)
    result: Floats = windows.a + x * e + y * np.stack([e[:, 1], -e[:, 0]], axis=1)
    return result


def _behind(mesh: TriangleMesh, pairs: _Pairs, windows: _Windows, limit: Floats) -> _Windows:
    """Windows of the other two edges of the facets behind, where lines up to `limit` (B,) come."""
    windows = windows.rows(_within(mesh, pairs, windows, limit))
    far = mesh.corners[windows.face, (windows.edge + 2) % 3]
    c = _unfolded(mesh, windows, far)
    to = _unit(c)
    # c may stand to the right of what is seen, to its left, or in it.
    from_right, from_left = _cross(windows.right, to), _cross(to, windows.left)
    right_of, left_of = (from_right > 0.0)[:, None], (from_left > 0.0)[:, None]
    right = np.where(right_of, to, windows.right)
    left = np.where(left_of, to, windows.left)
    pair, face, edge = windows.pair, windows.face, windows.edge
    near = _Windows(pair, face, (edge + 1) % 3, windows.a, c, windows.right, left)
    beyond = _Windows(pair, face, (edge + 2) % 3, c, windows.b, right, windows.left)
    near, beyond = near.rows(right_of[:, 0]), beyond.rows(left_of[:, 0])
    both = (
        np.concatenate([getattr(near, field.name), getattr(beyond, field.name)])
        for field in fields(_Windows)
    )
    return _crossed(mesh, _Windows(*both))


def _within(mesh: TriangleMesh, pairs: _Pairs, windows: _Windows, limit: Floats) -> Booleans:
    """Tell which windows a line no longer than `limit` can pass on its way to the goal."""
    step = windows.b - windows.a
    start, end = (
        np.clip(_cross(windows.a, way) / _no_zero(_cross(way, step)), 0.0, 1.0)[:, None]
        for way in (windows.right, windows.left)
    )
    p, q = windows.a + start * step, windows.a + end * step
    to_origin = _off_segment(p, q - p, np.zeros(2))
    # In the facet the edge runs from b to a.
    b = mesh.corners[windows.face, windows.edge]
    a = mesh.corners[windows.face, (windows.edge + 1) % 3]
    p, q = a + start * (b - a), a + end * (b - a)
    to_goal = _off_segment(p, q - p, pairs.goal[windows.pair])
    return np.asarray(to_origin + to_goal <= limit[windows.pair])


def _off_segment(p: Floats, way: Floats, point: Floats) -> Floats:
    """Distances (W,) of points from segments that begin at p."""
    off = point - p
    share = np.sum(off * way, axis=1) / np.maximum(np.sum(way * way, axis=1), 1e-300)
    rest: Floats = np.linalg.norm(off - np.clip(share, 0.0, 1.0)[:, None] * way, axis=1)
    return rest


def _along_edges(mesh: TriangleMesh, pairs: _Pairs, rows: Integers) -> Floats:
    """Lengths of the shortest ways along the edges, shape (R,), mm; 0 where there is none."""
    a, b = mesh.F.reshape(-1), np.roll(mesh.F, -1, axis=1).reshape(-1)
    sizes = length(mesh.V[b] - mesh.V[a])[:, 0]
    first = np.unique(np.minimum(a, b) * len(mesh.V) + np.maximum(a, b), return_index=True)[1]
    shape = (len(mesh.V), len(mesh.V))
    graph = csr_array((sizes[first], (a[first], b[first])), shape=shape)
    ways = np.zeros(len(rows))
    for k, row in enumerate(rows):
        near, far = mesh.F[pairs.face[row]], mesh.F[pairs.goal_face[row]]
        out = length(mesh.V[near] - pairs.origin[row])
        back = length(mesh.V[far] - pairs.goal[row])[:, 0]
        between = dijkstra(graph, directed=False, indices=near)[:, far]
        ways[k] = np.min(out + between + back)
    return np.where(np.isfinite(ways), ways, 0.0)


def _cross(a: Floats, b: Floats) -> Floats:
    product: Floats = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return product


def _size(a: Floats) -> Floats:
    return np.hypot(a[:, 0], a[:, 1])


def _unit(a: Floats) -> Floats:
    size = _size(a)[:, None]
    return np.asarray(a / np.where(size > 0.0, size, 1.0))


def _no_zero(a: Floats) -> Floats:
    return np.where(np.abs(a) > 1e-300, a, 1e-300)
