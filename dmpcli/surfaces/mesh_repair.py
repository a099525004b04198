"""Triangles as people have them, made into a surface: oriented, edge and vertex manifold.

What is safe is mended and said: it moves no face by more than `MERGE` of the mesh's size. The rest
is refused by name. What libigl would crash on is looked for before libigl sees anything.
"""

from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

import igl
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.errors import InputError
from dmpcli.surfaces.coincident import distinct
from dmpcli.surfaces.mesh_edges import Edges, corners_at
from dmpcli.surfaces.topology import Adjacency

MERGE = 1e-6
"""Points nearer than this part of the largest coordinate are one: some roundings of a float32."""

_AT_ONCE = 1_000_000
"""Pairs of border edge and near vertex that are looked at together."""

LARGEST = 1e7
"""mm. A part that reaches further has its unit misstated."""


@dataclass(frozen=True)
class Mended:
    """A mesh that libigl and the charts can work on.

    Attributes
    ----------
    V : array, shape (n, 3)
        Vertices, all referenced, no two at one point unless sheets touch there: along an edge that
        three faces or more shared, which is a border of each of them now, or in one point.
    F : array, shape (m, 3)
        Faces with area, none twice, every edge between two at most, wound consistently within each
        component.
    remarks : list of str
        What was mended.
    adjacency : Adjacency
    """

    V: Floats
    F: Integers
    remarks: list[str]
    adjacency: Adjacency


def mended(V: Floats, F: Integers) -> Mended:
    """Check and mend a triangle mesh.

    Parameters
    ----------
    V : array, shape (n, 3)
        Vertices, mm.
    F : array, shape (m, 3)
        Indices into V, any integers.

    Returns
    -------
    Mended

    Raises
    ------
    InputError
        No faces, an index out of range, a coordinate that is not finite or too large, or a
        one-sided component that cannot be cut; says which and where.
    """
    draft, remark = _checked(V, F)
    remarks = [remark]
    tolerance = MERGE * float(np.abs(draft.V).max())
    steps = (
        _merged,
        _welded,
        _without_thin_faces,
        _without_twins,
        _stitched,
        _forked,
        _parted,
        _oriented,
    )
    for step in steps:
        draft, remark = step(draft, tolerance)
        remarks.append(remark)
        if len(draft.F) == 0:
            raise InputError("no face has any area; export the part again")
    neighbours = draft.edges.neighbours
    draft, _ = _referenced(draft)
    adjacency = Adjacency.of(neighbours, draft.F)
    return Mended(draft.V, draft.F, [remark for remark in remarks if remark], adjacency)


def components(F: Integers) -> int:
    """Return the number of pieces of a mended mesh: no two of them share a vertex."""
    pairs = np.concatenate([F[:, :2], F[:, 1:]])
    return _groups(int(F.max()) + 1, pairs)[0]


def borders(F: Integers) -> tuple[int, int]:
    """Return the numbers of border edges of a mended mesh and of the rims that they make up."""
    ends = np.sort(np.stack([F, np.roll(F, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    edges, uses = np.unique(ends, axis=0, return_counts=True)
    rim = edges[uses == 1]
    if len(rim) == 0:
        return 0, 0
    _, corners = np.unique(rim, return_inverse=True)
    corners = corners.reshape(-1, 2)
    return len(rim), _groups(int(corners.max()) + 1, corners)[0]


@dataclass(frozen=True)
class _Draft:
    """Vertices and faces between two steps, and the vertices of edges that were crowded."""

    V: Floats
    F: Integers
    forks: Integers = field(default_factory=lambda: np.empty(0, dtype=np.int64))

    @cached_property
    def edges(self) -> Edges:
        return Edges.of(self.F)

    @cached_property
    def lengths(self) -> Floats:
        """Lengths of the edges opposite to the corners of each face, shape (m, 3), mm."""
        lengths: Floats = igl.edge_lengths(self.V, self.F)
        return lengths


def _count(number: int, thing: str, several: str = "") -> str:
    return f"{number} {thing if number == 1 else several or thing + 's'}"


def _checked(V: Floats, F: Integers) -> tuple[_Draft, str]:
    if len(F) == 0:
        raise InputError("holds no faces; a surface needs triangles")
    if F.min() < 0 or F.max() >= len(V):
        wrong = (F < 0) | (len(V) <= F)
        face = int(np.argmax(wrong.any(axis=1)))
        raise InputError(
            f"face {face + 1} names vertex {F[face][wrong[face]][0] + 1}, but there are {len(V)}; "
            "export the part again"
        )
    draft, remark = _referenced(_Draft(V, F))
    largest = float(max(draft.V.max(), -draft.V.min()))  # NaN where there is one
    if not np.isfinite(largest):
        bad: Booleans = np.asarray(~np.isfinite(draft.V).all(axis=1))
        face = int(np.argmax(bad[draft.F].any(axis=1)))
        corners = draft.F[face]
        x, y, z = draft.V[corners[bad[corners]][0]]
        raise InputError(
            f"face {face + 1} has a vertex at ({x:g}, {y:g}, {z:g}), which is no place "
            f"({_count(int(bad.sum()), 'such vertex', 'such vertices')}); export the part again"
        )
    if largest > LARGEST:
        raise InputError(f"its coordinates reach {largest:.3g} mm; check the unit of length")
    return draft, remark


def _referenced(draft: _Draft) -> tuple[_Draft, str]:
    used = np.zeros(len(draft.V), dtype=bool)
    used[draft.F] = True
    if used.all():
        return draft, ""
    number = np.cumsum(used) - 1
    left = len(used) - int(used.sum())
    remark = f"{_count(left, 'vertex', 'vertices')} of no face left out"
    return _Draft(draft.V[used], number[draft.F]), remark


def _merged(draft: _Draft, _: float) -> tuple[_Draft, str]:
    """Make one vertex of those at exactly the same point."""
    first, number = distinct(draft.V)
    merged = len(draft.V) - len(first)
    if merged == 0:
        return draft, ""
    soup = np.array_equal(draft.F.ravel(), np.arange(len(draft.V)))  # as in any STL
    remark = f"{_count(merged, 'duplicate vertex', 'duplicate vertices')} merged"
    F = number.reshape(-1, 3) if soup else number[draft.F]
    return _Draft(draft.V[first], F), "" if soup else remark


def _welded(draft: _Draft, tolerance: float) -> tuple[_Draft, str]:
    """Close cracks: make one of border vertices, or ends of an edge, within the tolerance."""
    V, edges = draft.V, draft.edges
    border = np.unique(edges.half[edges.border])
    pairs = border[cKDTree(V[border]).query_pairs(tolerance, output_type="ndarray")]
    ends_apart = edges.half[:, 0] != edges.half[:, 1]
    short = edges.half[(draft.lengths.T.ravel() <= tolerance) & ends_apart]
    joined = np.concatenate([pairs, short])
    if len(joined) == 0:
        return draft, ""
    _, group = _groups(len(V), joined)
    _, first, number = np.unique(group, return_index=True, return_inverse=True)
    gone = _count(len(V) - len(first), "vertex", "vertices")
    remark = f"{gone} merged that lay within {tolerance:.2g} mm of another"
    return _Draft(V[first], number[draft.F]), remark


def _groups(n: int, pairs: Integers) -> tuple[int, Integers]:
    """Return how many groups pairs (k, 2) of n things make, and the group of each thing (n,)."""
    graph = coo_array((np.ones(len(pairs), dtype=bool), tuple(pairs.T)), shape=(n, n))
    number, group = connected_components(graph, directed=False)
    return int(number), np.asarray(group, dtype=np.int64)


def _without_thin_faces(draft: _Draft, tolerance: float) -> tuple[_Draft, str]:
    """Leave out faces whose corners lie on a line; `_stitched` closes what they leave."""
    F = draft.F
    thin = igl.doublearea(draft.V, F) <= tolerance * draft.lengths.max(axis=1)
    for k in range(3):
        thin |= F[:, k] == F[:, k - 1]
    gone = int(thin.sum())
    if gone == 0:
        return draft, ""
    return _Draft(draft.V, F[~thin]), f"{_count(gone, 'face')} without area left out"


def _without_twins(draft: _Draft, _: float) -> tuple[_Draft, str]:
    """Leave out faces of the same three corners as an earlier one, whatever their winding."""
    F, edges = draft.F, draft.edges
    m = len(F)
    apex = F.T.ravel()
    one, other = edges.one, edges.other
    alike = apex[one] == apex[other]
    suspects = np.concatenate([one[alike] % m, other[alike] % m, edges.crowded % m])
    if len(suspects) == 0:
        return draft, ""
    suspects = np.unique(suspects)
    corners = np.sort(F[suspects], axis=1)
    first = np.unique(corners, axis=0, return_index=True)[1]
    twin = np.zeros(m, dtype=bool)
    twin[suspects] = True
    twin[suspects[first]] = False
    gone = int(twin.sum())
    if gone == 0:
        return draft, ""
    return _Draft(draft.V, draft.F[~twin]), f"{_count(gone, 'duplicate face')} left out"


def _stitched(draft: _Draft, tolerance: float) -> tuple[_Draft, str]:
    """Split border edges at the border vertices that lie on them (T-junctions)."""
    split = 0
    while hits := _on_border_edges(draft, tolerance):
        faces = draft.F.tolist()
        for face, (a, b, opposite, on) in hits.items():
            chain = [a, *on, b]
            pieces = [[p, q, opposite] for p, q in pairwise(chain)]
            faces[face] = pieces[0]
            faces += pieces[1:]
            split += len(on)
        draft = _Draft(draft.V, np.array(faces, dtype=np.int64))
    return draft, f"{_count(split, 'T-junction')} stitched" if split else ""


def _on_border_edges(draft: _Draft, tolerance: float) -> dict[int, tuple[int, int, int, list[int]]]:
    """Per face at most one border edge that vertices lie on: (a, b, opposite, vertices a → b)."""
    V, F, edges = draft.V, draft.F, draft.edges
    half = edges.border
    if len(half) == 0:
        return {}
    a, b = edges.half[half].T
    border = np.unique(edges.half[half])
    tree = cKDTree(V[border])
    middle, reach = (V[a] + V[b]) / 2.0, np.linalg.norm(V[b] - V[a], axis=1) / 2.0 + tolerance
    opposite = F[half % len(F), half // len(F)]
    found: list[tuple[float, int, int]] = []
    # Long edges have many vertices near: as many edges at a time as memory bears.
    counts = tree.query_ball_point(middle, reach, return_length=True)
    for edges_here in np.split(
        np.arange(len(half)), np.flatnonzero(np.diff(np.cumsum(counts) // _AT_ONCE)) + 1
    ):
        near = tree.query_ball_point(middle[edges_here], reach[edges_here])
        row = np.repeat(edges_here, counts[edges_here])
        vertex = border[np.concatenate([np.asarray(n, dtype=np.int64) for n in near])]
        along, before, behind = V[b[row]] - V[a[row]], V[vertex] - V[a[row]], V[b[row]] - V[vertex]
        square = np.sum(along**2, axis=1)
        place = np.sum(before * along, axis=1) / square
        distance = np.linalg.norm(before - place[:, None] * along, axis=1)
        # Both pieces are shorter than the edge, so that splitting comes to an end.
        between = np.maximum(np.sum(before**2, axis=1), np.sum(behind**2, axis=1)) < square
        own = (vertex == a[row]) | (vertex == b[row]) | (vertex == opposite[row])
        on = (distance <= tolerance) & between & ~own
        found += zip(place[on].tolist(), row[on].tolist(), vertex[on].tolist(), strict=True)
    hits: dict[int, tuple[int, int, int, list[int]]] = {}
    edge_of: dict[int, int] = {}
    for _, edge, on_it in sorted(found):
        face = int(half[edge]) % len(F)
        if edge_of.setdefault(face, edge) == edge:
            ends = (int(a[edge]), int(b[edge]), int(opposite[edge]))
            hits.setdefault(face, (*ends, []))[3].append(on_it)
    return hits


def _oriented(draft: _Draft, _: float) -> tuple[_Draft, str]:
    """Turn faces over so that neighbours agree; each component keeps what most of it had."""
    if not draft.edges.at_odds.any():
        return draft, ""
    turned, component = igl.bfs_orient(draft.F)
    over = (turned != draft.F).any(axis=1)
    against = 2 * np.bincount(component, weights=over) > np.bincount(component)
    turned = np.where(against[component][:, None], turned[:, ::-1], turned)
    over ^= against[component]
    done = _Draft(draft.V, turned)
    remark = f"{_count(int(over.sum()), 'face')} turned over to agree with the others"
    if not done.edges.at_odds.any():
        return done, remark
    cut, where = _cut(done)
    if cut.edges.at_odds.any():
        raise InputError(
            "is one-sided somewhere, so that no normal can be chosen; cut it, or mend it in the "
            "program that made it"
        )
    return cut, f"{remark}; {where}" if over.any() else where


def _cut(draft: _Draft) -> tuple[_Draft, str]:
    """Cut what is one-sided along the edges where it does not agree with itself.

    About a vertex there is an even number of them, so that they part its faces into fans.
    """
    odd = draft.edges.half[draft.edges.one[draft.edges.at_odds]]
    x, y, z = draft.V[odd[0]].mean(axis=0)
    cut, _ = _split(draft, _fans(draft, over_odds=False))
    remark = (
        f"one-sided, like a Möbius strip, and cut along {_count(len(odd), 'edge')}, the first at "
        f"({x:.6g}, {y:.6g}, {z:.6g}) mm, where no stroke is drawn across"
    )
    return cut, remark


def _forked(draft: _Draft, _: float) -> tuple[_Draft, str]:
    """Make edges of three faces or more borders of each of these, which `_parted` takes apart.

    Two of the faces may be joined about both ends of such an edge, as the faces of a solid that
    touches another one along it are: parting leaves them their common edge. They get a vertex of
    their own each in its middle.
    """
    crowded = draft.edges.half[draft.edges.crowded]
    if len(crowded) == 0:
        return draft, ""
    number = len(np.unique(np.sort(crowded, axis=1), axis=0))
    x, y, z = draft.V[crowded[0]].mean(axis=0)
    draft = _Draft(draft.V, draft.F, np.unique(crowded))
    while len(half := _still_joined(draft)):
        V, F, m = draft.V, draft.F, len(draft.F)
        face, first = np.unique(half % m, return_index=True)
        half = half[first]
        (a, b), opposite = draft.edges.half[half].T, F[face, half // m]
        middle = len(V) + np.arange(len(half))
        F = F.copy()
        F[face] = np.stack([a, middle, opposite], axis=1)
        F = np.concatenate([F, np.stack([middle, b, opposite], axis=1)])
        draft = _Draft(np.concatenate([V, (V[a] + V[b]) / 2.0]), F, draft.forks)
    remark = (
        f"{_count(number, 'edge')} of three faces or more, the first at ({x:.6g}, {y:.6g}, "
        f"{z:.6g}) mm: sheets touch there, and no stroke is drawn across"
    )
    return draft, remark


def _still_joined(draft: _Draft) -> Integers:
    """Half edges of crowded edges that another one runs along between the same two fans."""
    edges, m = draft.edges, len(draft.F)
    half = edges.crowded
    if len(half) == 0:
        return half
    fan = _fans(draft)
    ends = np.stack([fan[corners_at(half, k, m)] for k in (1, 2)], axis=1)
    _, of, uses = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True, return_counts=True)
    return half[uses[of.reshape(-1)] > 1]


def _fans(draft: _Draft, over_odds: bool = True) -> Integers:
    """Number the fans of faces about vertices, joined by edges of two faces: of each corner (3m,).

    Corners are numbered as half edges are: k m + i for corner k of face i. Edges whose faces are
    wound at odds join them only `over_odds`.
    """
    F, edges, m = draft.F, draft.edges, len(draft.F)
    one, other = edges.one, edges.other
    start, end = (corners_at(one, k, m) for k in (1, 2))
    there = [corners_at(other, k, m) for k in (1, 2)]
    odd = edges.at_odds
    pairs = np.concatenate(
        [
            np.stack([start, np.where(odd, there[0], there[1])], axis=1),
            np.stack([end, np.where(odd, there[1], there[0])], axis=1),
        ]
    )
    if not over_odds:
        pairs = pairs[~np.tile(odd, 2)]
    return _groups(3 * m, pairs)[1] if len(F) else np.empty(0, dtype=np.int64)


def _parted(draft: _Draft, _: float) -> tuple[_Draft, str]:
    """Give every fan of faces its own vertex where sheets touch (bow-ties, crowded edges)."""
    at = np.zeros(len(draft.V), dtype=bool)
    at[draft.F] = True
    if draft.edges.fans == np.count_nonzero(at):
        return draft, ""  # one about each vertex
    draft, added = _split(draft, _fans(draft))
    ties = int((~np.isin(added, draft.forks)).sum())
    remark = f"{_count(ties, 'bow-tie')} parted: sheets that touch in one point" if ties else ""
    return draft, remark


def _split(draft: _Draft, fan: Integers) -> tuple[_Draft, Integers]:
    """Give fans of corners (3m,) vertices of their own; also those that were there before, once."""
    V, F, m = draft.V, draft.F, len(draft.F)
    owner = np.empty(int(fan.max()) + 1, dtype=np.int64)
    owner[fan] = F.T.ravel()
    number = np.full(len(owner), -1)
    used, keeps = np.unique(owner, return_index=True)
    number[keeps] = used
    added = np.flatnonzero(number < 0)
    if len(added) == 0:
        return draft, added  # whose edges are known already
    number[added] = len(V) + np.arange(len(added))
    V = np.concatenate([V, V[owner[added]]])
    return _Draft(V, number[fan].reshape(3, m).T.copy(), draft.forks), owner[added]
