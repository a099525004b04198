"""Polygons cut into triangles that cover what their outlines enclose, whatever the first corner.

A fan from one corner is right for convex outlines alone; of the others it covers the notches too.
Those are cut by ear clipping (mapbox/earcut.hpp), seen along the normal that their areas have
(Newell's: M. E. Newell et al., Proc. ACM National Conference 1972, 443-450).
"""

from typing import NamedTuple

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.spatial.vectors import cross, dot, length

LARGEST = 20_000
"""Corners. The work of clipping ears can grow with their square: a comb of so many takes 4 s."""

# A corner that turns by less than this, rad, is taken for straight.
_STRAIGHT = 1e-9
# Corners that are looked at together.
_AT_ONCE = 500_000
# Triangles cover the outline if their areas add up to its own but for this part.
_ROUNDING = 1e-6


class PolygonCut(NamedTuple):
    """Triangles of polygons.

    Attributes
    ----------
    F : array, shape (m, 3)
        In the order of the polygons, wound as those are.
    crossed : array
        Polygons whose outline crosses itself, seen along the normal: what they enclose is unsure.
    """

    F: Integers
    crossed: Integers


def cut(V: Floats, corners: Integers, counts: Integers) -> PolygonCut:
    """Cut polygons into triangles.

    Parameters
    ----------
    V : array, shape (n, 3)
    corners : array, shape (k,)
        Vertices of all polygons, one polygon after the other; all in range.
    counts : array, shape (p,)
        Corners of each, 3 or more; of those that are not convex at most `LARGEST`, see `too_large`.
    """
    start = np.cumsum(counts) - counts
    pieces, owners, crossed = [], [], []
    for which in _batches(counts):
        count = int(counts[which[0]])
        outline = corners[start[which][:, None] + np.arange(count)]
        F, crosses = (outline[:, None], None) if count == 3 else _alike(V, outline)
        pieces.append(F.reshape(-1, 3))
        owners.append(np.repeat(which, count - 2))
        if crosses is not None:
            crossed.append(which[crosses])
    if not pieces:
        return PolygonCut(np.empty((0, 3), dtype=np.int64), np.empty(0, dtype=np.int64))
    F, owner = np.concatenate(pieces), np.concatenate(owners)
    F = F[np.argsort(owner, kind="stable")]
    # Ear clipping leaves straight corners out: its rows that are not needed are marked.
    F = F[F[:, 0] >= 0]
    return PolygonCut(F, np.sort(np.concatenate([np.empty(0, dtype=np.int64), *crossed])))


def too_large(V: Floats, corners: Integers, counts: Integers) -> int | None:
    """Return the first polygon that would take too long to cut; None if there is none.

    Parameters
    ----------
    V, corners, counts : array
        As `cut` takes them. Convex polygons of any size are quick to cut.
    """
    start = np.cumsum(counts) - counts
    for i in np.flatnonzero(counts > LARGEST).tolist():
        outline = corners[start[i] : start[i] + counts[i]][None]
        if not _convex(V[outline], _normals(V[outline]))[0][0]:
            return int(i)
    return None


def _batches(counts: Integers) -> list[Integers]:
    """Group polygons of equally many corners, no more at a time than memory bears."""
    groups = []
    for count in np.unique(counts).tolist():
        which, some = np.flatnonzero(counts == count), max(1, _AT_ONCE // count)
        groups += [which[i : i + some] for i in range(0, len(which), some)]
    return groups


def _alike(V: Floats, outline: Integers) -> tuple[Integers, Booleans]:
    """Triangles (p, n - 2, 3) of outlines (p, n), and which of them cross themselves (p,)."""
    P = V[outline]
    P = P - P.mean(axis=1, keepdims=True)
    normal = _normals(P)
    convex, first = _convex(P, normal)
    count = outline.shape[1]
    if count == 4:
        # Four corners have two fans: one suits every outline that does not cross itself.
        convex = np.ones(len(P), dtype=bool)
    at = (first[:, None] + np.arange(count)) % count
    fan = np.take_along_axis(outline, at, axis=1)
    F = np.stack([np.broadcast_to(fan[:, :1], fan[:, 2:].shape), fan[:, 1:-1], fan[:, 2:]], axis=-1)
    flat = _flattened(P, normal)
    if not convex.all():
        F = F.copy()
        for i in np.flatnonzero(~convex).tolist():
            F[i] = _clipped(flat[i], outline[i])
    return F, _crossed(V, F, P, normal)


def _normals(P: Floats) -> Floats:
    """Normals of outlines (p, n, 3), twice their areas long, shape (p, 3)."""
    spokes = P - P[:, :1]
    return np.asarray(cross(spokes[:, 1:-1], spokes[:, 2:]).sum(axis=1))


def _convex(P: Floats, normal: Floats) -> tuple[Booleans, Integers]:
    """Tell which outlines (p, n, 3) turn left at all corners, once round; and where fans start.

    Those of four corners start where the outline turns least, or at the shorter diagonal.
    """
    edges = np.roll(P, -1, axis=1) - P
    before = np.roll(edges, 1, axis=1)
    size = length(normal)
    up = normal / np.where(size > 0.0, size, 1.0)
    turn = np.arctan2(dot(cross(before, edges), up[:, None])[..., 0], dot(before, edges)[..., 0])
    bent = turn.min(axis=1) < _STRAIGHT
    convex = ~bent & (turn.sum(axis=1) < 3.0 * np.pi)
    first = np.zeros(len(P), dtype=np.int64)
    if P.shape[1] == 4:
        diagonals = length(P[:, [0, 1]] - P[:, [2, 3]])[..., 0]
        shorter = (diagonals[:, 1] < diagonals[:, 0]).astype(np.int64)
        first = np.where(bent, np.argmin(turn, axis=1), shorter)
    return convex, first


def _flattened(P: Floats, normal: Floats) -> Floats:
    """Outlines (p, n, 3) seen along their normals (p, 3), counter-clockwise, shape (p, n, 2)."""
    size = length(normal)
    up = np.where(size > 0.0, normal / np.where(size > 0.0, size, 1.0), [0.0, 0.0, 1.0])
    aside = np.eye(3)[np.argmin(np.abs(up), axis=1)]
    x = cross(aside, up)
    x = x / length(x)
    seen: Floats = np.einsum("pni,pki->pnk", P, np.stack([x, cross(up, x)], axis=1))
    return seen


def _clipped(flat: Floats, outline: Integers) -> Integers:
    """Triangles (n - 2, 3) of one outline (n, 2) by ear clipping; rows of -1 are not needed."""
    from mapbox_earcut import triangulate_float64

    ring = np.array([len(flat)], dtype=np.uint32)
    found = triangulate_float64(np.ascontiguousarray(flat), ring).reshape(-1, 3).astype(np.int64)
    a, b, c = (flat[found[:, k]] for k in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    found = outline[np.where((area < 0.0)[:, None], found[:, ::-1], found)]
    F = np.full((len(outline) - 2, 3), -1)
    F[: len(found)] = found[: len(F)]
    return F


def _crossed(V: Floats, F: Integers, P: Floats, normal: Floats) -> Booleans:
    """Tell whose triangles (p, n - 2, 3) do not cover just what the outline encloses (p,)."""
    a, b, c = np.moveaxis(V[F], 2, 0)
    size = length(normal)
    up = np.where(size > 0.0, normal / np.where(size > 0.0, size, 1.0), [0.0, 0.0, 1.0])
    doubled = np.abs(dot(cross(b - a, c - a), up[:, None])[..., 0])
    covered = np.where(F[..., 0] >= 0, doubled, 0.0).sum(axis=1)
    extent = np.ptp(P, axis=1).max(axis=1)
    allowed = _ROUNDING * covered + 1e-12 * extent**2
    return np.asarray(np.abs(covered - size[:, 0]) > allowed)
