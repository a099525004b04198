"""The facets of a mesh as kernels want them: records in the order of a search tree.

What the tree is `tree_order` says. Boxes are rounded outwards to single precision, which halves
what is fetched of them and costs no exactness.
"""

from typing import NamedTuple

import numpy as np

from dmpcli.arrays import Booleans, Floats, Halves, Integers, Singles
from dmpcli.compiled import kernel
from dmpcli.surfaces.kernels.vectors import (
    Vector,
    add,
    at,
    cross,
    dot,
    length,
    put,
    sub,
    times,
    unit,
)

SPLIT = 64
_ON = 1e-9
"""A foot this near to an edge of its facet may as well lie on the next one, mm."""
_SAME = 1e-6
"""Feet no farther apart than this are one place, mm."""
_REACH = 0.29**2
"""Points nearer to the mesh than this, mm², are within reach of any of its facets."""
_BALL = 0.2**2
"""A point that was predicted lies nearer to the mesh than this, mm², or is looked for anywhere."""


class Facets(NamedTuple):
    """Facets of a mesh in the tree's order, and the tree.

    Few arrays: each costs when it is handed on, and what is asked of a facet lies together.

    Attributes
    ----------
    boxes : array of float32, shape (nodes, 6)
        Least and largest corner of what is in a node, mm.
    first : array of int32, shape (leaves + 1,)
        Where the facets of each leaf begin.
    reals : array, shape (m, 40)
        From 0: three corners; `NORMAL`: unit normal; `MAP`: affine map, 3 x 3 and 3, from a
        position, counted from the first corner, to the smooth normal; `EDGES`: unit vectors in the
        plane, square to the edges, outwards, and how far along them the edges lie; `REACH`, mm, and
        less than 0 where neither it nor the map is known yet, `ASKED` where it was wanted;
        then, once known, what `samples.certified` asks: `CLEARANCE`, mm (-1 before), and `SLOPE`.
    numbers : array of int32, shape (m, 16)
        From 0: `Topology.neighbours`, in the tree's order; `FLAGS`: bits 0 to 2 are edges of the
        border, 3 to 5 corners of it, 6: see `in_doubt`; `PART`: component; `FACE`: the mesh's own
        number; `VERTICES`.
    """

    boxes: Singles
    first: Halves
    reals: Floats
    numbers: Halves


NORMAL, MAP, EDGES, REACH, CLEARANCE, SLOPE, REALS = 9, 12, 24, 36, 37, 38, 40
FLAGS, PART, FACE, VERTICES, NUMBERS = 3, 4, 5, 6, 16


UNKNOWN, ASKED = -1.0, -2.0


class FaceArrays(NamedTuple):
    """What is known of all m faces of a mesh: see `Geometry`.

    Corners (m, 3, 3), unit normals (m, 3), neighbours, vertices (m, 3), components (m,), and of the
    vertices (n,) whether they lie on the border.
    """

    corners: Floats
    normals: Floats
    neighbours: Integers
    vertices: Integers
    part: Integers
    border: Booleans


@kernel
def fill(reals: Floats, numbers: Halves, faces: FaceArrays, order: Halves, rows: Halves) -> None:
    """Fill in what corners, neighbours and borders tell of all facets; shapes are `UNKNOWN`."""
    for i in range(len(order)):
        face = order[i]
        for k in range(9):
            reals[i, k] = faces.corners[face, k // 3, k % 3]
        for k in range(3):
            reals[i, NORMAL + k] = faces.normals[face, k]
        reals[i, REACH], reals[i, CLEARANCE] = UNKNOWN, -1.0
        n, flags = flat_normal(reals, i), 0
        for k in range(3):
            a = corner(reals, i, k)
            outward = cross(unit(sub(corner(reals, i, (k + 1) % 3), a)), n)
            at = EDGES + 3 * k
            reals[i, at], reals[i, at + 1], reals[i, at + 2] = outward
            reals[i, EDGES + 9 + k] = dot(outward, a)
            across, vertex = faces.neighbours[face, k], faces.vertices[face, k]
            numbers[i, k] = rows[across] if across >= 0 else across
            numbers[i, VERTICES + k] = vertex
            flags |= (1 << k) if across == -1 else 0
            flags |= (8 << k) if faces.border[vertex] else 0
        numbers[i, FLAGS], numbers[i, PART], numbers[i, FACE] = flags, faces.part[face], face


@kernel
def split(vertices: Halves, normals: Floats, lying: Booleans) -> Booleans:
    """Facets (k,), with vertices (k, 3), at which there are others with normals of their own.

    Or other vertices, which are `lying` (n,) where they are. Normals (k, 3, 3) are of corners.
    """
    one = np.empty((len(lying), 3))
    apart, found = lying.copy(), np.empty(len(vertices), dtype=np.bool_)
    for i in range(len(vertices)):
        for k in range(3):
            put(one, vertices[i, k], at(normals[i], k))
    for i in range(len(vertices)):
        for k in range(3):
            for c in range(3):
                if abs(normals[i, k, c] - one[vertices[i, k], c]) > 1e-12:
                    apart[vertices[i, k]] = True
    for i in range(len(vertices)):
        found[i] = apart[vertices[i, 0]] or apart[vertices[i, 1]] or apart[vertices[i, 2]]
    return found


@kernel
def shape(facets: Facets, rows: Integers, normals: Floats, reach: Floats, split: Booleans) -> None:
    """Fill in maps, reach and `SPLIT` of some facets, whose corners have normals (k, 3, 3)."""
    reals = facets.reals
    for j in range(len(rows)):
        i = rows[j]
        a, b, c = corner(reals, i, 0), corner(reals, i, 1), corner(reals, i, 2)
        opposite = (sub(c, b), sub(a, c), sub(b, a))
        # Gradients of the barycentric coordinates: exact on slivers too.
        area = cross(opposite[0], opposite[1])
        size = dot(area, area)
        g0 = times(1.0 / size, cross(area, opposite[0]))
        g1 = times(1.0 / size, cross(area, opposite[1]))
        g2 = times(1.0 / size, cross(area, opposite[2]))
        for k in range(3):
            slope = add(times(normals[j, 0, k], g0), times(normals[j, 1, k], g1))
            slope = add(slope, times(normals[j, 2, k], g2))
            at = MAP + 3 * k
            reals[i, at], reals[i, at + 1], reals[i, at + 2] = slope
            reals[i, MAP + 9 + k] = normals[j, 0, k]
        reals[i, REACH] = reach[j]
        if split[j]:
            facets.numbers[i, FLAGS] |= SPLIT


@kernel
def corner(reals: Floats, row: int, k: int) -> Vector:
    """Corner k of a facet.

    Parameters
    ----------
    reals : array, shape (m, 40)
        Of `Facets`, mm; `row` is in its order, k from 0.
    """
    return reals[row, 3 * k], reals[row, 3 * k + 1], reals[row, 3 * k + 2]


@kernel
def flat_normal(reals: Floats, row: int) -> Vector:
    """Unit normal of a facet."""
    return reals[row, NORMAL], reals[row, NORMAL + 1], reals[row, NORMAL + 2]


@kernel
def outward_of(reals: Floats, row: int, k: int) -> Vector:
    """Unit vector in a facet's plane, square to an edge.

    Parameters
    ----------
    reals : array, shape (m, 40)
        Of `Facets`; edge k runs from corner k to the next.
    """
    at = EDGES + 3 * k
    return reals[row, at], reals[row, at + 1], reals[row, at + 2]


@kernel
def smooth_normal(reals: Floats, p: Vector, row: int) -> Vector:
    """Unit normal at a point of a facet, interpolated between the corners'.

    Parameters
    ----------
    reals : array, shape (m, 40)
        Of `Facets`.
    p : tuple of float
        mm; off the facet's plane it counts by its foot there.
    """
    x, y, z = p[0] - reals[row, 0], p[1] - reals[row, 1], p[2] - reals[row, 2]
    m = MAP
    return unit(
        (
            reals[row, m] * x + reals[row, m + 1] * y + reals[row, m + 2] * z + reals[row, m + 9],
            reals[row, m + 3] * x
            + reals[row, m + 4] * y
            + reals[row, m + 5] * z
            + reals[row, m + 10],
            reals[row, m + 6] * x
            + reals[row, m + 7] * y
            + reals[row, m + 8] * z
            + reals[row, m + 11],
        )
    )


@kernel
def on_facet(reals: Floats, row: int, p: Vector) -> Vector:
    """Closest point of a facet (C. Ericson: Real-time collision detection, 2005, sec. 5.1.5).

    Parameters
    ----------
    reals : array, shape (m, 40)
        Of `Facets`.
    p : tuple of float
        mm.
    """
    a = corner(reals, row, 0)
    b = corner(reals, row, 1)
    c = corner(reals, row, 2)
    ab, ac, ap = sub(b, a), sub(c, a), sub(p, a)
    d1, d2 = dot(ab, ap), dot(ac, ap)
    if d1 <= 0.0 and d2 <= 0.0:
        return a
    bp = sub(p, b)
    d3, d4 = dot(ab, bp), dot(ac, bp)
    if d3 >= 0.0 and d4 <= d3:
        return b
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        return add(a, times(d1 / (d1 - d3), ab))
    cp = sub(p, c)
    d5, d6 = dot(ab, cp), dot(ac, cp)
    if d6 >= 0.0 and d5 <= d6:
        return c
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        return add(a, times(d2 / (d2 - d6), ac))
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        return add(b, times((d4 - d3) / ((d4 - d3) + (d5 - d6)), sub(c, b)))
    share = 1.0 / (va + vb + vc)
    return add(add(a, times(vb * share, ab)), times(vc * share, ac))


@kernel
def _off_box(boxes: Singles, node: int, p: Vector) -> float:
    """Squared distance of a point from a box."""
    x = max(boxes[node, 0] - p[0], p[0] - boxes[node, 3], 0.0)
    y = max(boxes[node, 1] - p[1], p[1] - boxes[node, 4], 0.0)
    z = max(boxes[node, 2] - p[2], p[2] - boxes[node, 5], 0.0)
    return float(x * x + y * y + z * z)


@kernel
def _lower(reals: Floats, row: int, p: Vector) -> float:
    """What the squared distance from a facet is at least: over its plane, or beside an edge."""
    off = abs(dot(flat_normal(reals, row), sub(p, corner(reals, row, 0))))
    for k in range(3):
        off = max(off, dot(outward_of(reals, row, k), p) - reals[row, EDGES + 9 + k])
    return float(off * off)


@kernel
def _within(
    facets: Facets, p: Vector, bound: float, nodes: Halves, offs: Floats
) -> tuple[Vector, int]:
    """Closest point nearer than a squared bound, and its row; -1 without one."""
    best, foot, row = bound, p, -1
    inner = len(facets.first) - 2
    nodes[0], offs[0] = 0, _off_box(facets.boxes, 0, p)
    held = 1
    while held > 0:
        held -= 1
        node = nodes[held]
        if offs[held] >= best:
            continue
        while node < inner:
            left, right = 2 * node + 1, 2 * node + 2
            near, far = _off_box(facets.boxes, left, p), _off_box(facets.boxes, right, p)
            if far < near:
                left, right, near, far = right, left, far, near
            if far < best:
                nodes[held], offs[held] = right, far
                held += 1
            if near >= best:
                node = -1
                break
            node = left
        if node < 0:
            continue
        leaf = node - inner
        for i in range(facets.first[leaf], facets.first[leaf + 1]):
            if _lower(facets.reals, i, p) >= best:
                continue
            q = on_facet(facets.reals, i, p)
            gap = sub(p, q)
            off = dot(gap, gap)
            if off < best:
                best, foot, row = off, q, i
    return foot, row


@kernel
def stack() -> tuple[Halves, Floats]:
    """Room for one search after another."""
    return np.empty(64, dtype=np.int32), np.empty(64)


@kernel
def closest(facets: Facets, p: Vector, nodes: Halves, offs: Floats) -> tuple[Vector, int]:
    """Closest point of the mesh, and its row.

    Parameters
    ----------
    p : tuple of float
        mm.
    nodes, offs : array
        Room, of `stack`.
    """
    foot, row = _within(facets, p, _BALL, nodes, offs)
    if row < 0:
        foot, row = _within(facets, p, np.inf, nodes, offs)
    return foot, max(row, 0)


@kernel
def in_doubt(facets: Facets, p: Vector, foot: Vector, row: int) -> bool:
    """Tell whether it matters which facet a point of the mesh is taken to lie on, and is chance.

    At creases, where sheets touch, and far off the mesh the answer hangs on which of several facets
    at the same distance a search comes upon. Then numpy's way decides, so that both ways agree.
    A facet whose shape is not known is asked for: see `TriangleMesh.made_known`.

    Parameters
    ----------
    p, foot : tuple of float
        A point and its closest one, which lies on the facet of this row, mm.
    """
    if facets.reals[row, REACH] < 0.0:
        facets.reals[row, REACH] = ASKED
        return True
    gap = sub(p, foot)
    if not facets.numbers[row, FLAGS] & SPLIT and dot(gap, gap) < _REACH:
        return False
    for k in range(3):
        beside = dot(outward_of(facets.reals, row, k), foot) - facets.reals[row, EDGES + 9 + k]
        if beside > -_ON:
            return True
    return False


@kernel
def nothing_else(facets: Facets, p: Vector, foot: Vector, nodes: Halves) -> bool:
    """Tell whether nothing of the mesh but what meets at a foot is as near to a point.

    Parameters
    ----------
    p, foot : tuple of float
        A point and its closest one, mm.
    nodes : array
        Room, of `stack`.
    """
    gap = sub(p, foot)
    reach = length(gap) + _ON
    bound, inner = reach * reach, len(facets.first) - 2
    nodes[0], held = 0, 1
    while held > 0:
        held -= 1
        node = nodes[held]
        if _off_box(facets.boxes, node, p) > bound:
            continue
        if node < inner:
            nodes[held], nodes[held + 1] = 2 * node + 1, 2 * node + 2
            held += 2
            continue
        leaf = node - inner
        for i in range(facets.first[leaf], facets.first[leaf + 1]):
            if _lower(facets.reals, i, p) > bound:
                continue
            q = on_facet(facets.reals, i, p)
            if length(sub(p, q)) <= reach and length(sub(q, foot)) > _SAME:
                return False
    return True


@kernel
def search(facets: Facets, points: Floats) -> tuple[Floats, Integers, Booleans]:
    """Closest points (N, 3), mm, their faces (N,), and which are `in_doubt`."""
    nodes, offs = stack()
    feet, face = np.empty_like(points), np.empty(len(points), dtype=np.int64)
    doubt = np.empty(len(points), dtype=np.bool_)
    for i in range(len(points)):
        p = points[i, 0], points[i, 1], points[i, 2]
        foot, row = closest(facets, p, nodes, offs)
        feet[i, 0], feet[i, 1], feet[i, 2] = foot
        face[i], doubt[i] = facets.numbers[row, FACE], in_doubt(facets, p, foot, row)
    return feet, face, doubt


@kernel
def beyond_border(facets: Facets, p: Vector, foot: Vector, row: int, least: float) -> bool:
    """Tell whether a point lies beside the mesh; see `TriangleMesh.beyond_border`."""
    reals, flags = facets.reals, facets.numbers[row, FLAGS]
    if flags & 63 == 0:
        return False
    gap, n = sub(p, foot), flat_normal(reals, row)
    if length(sub(gap, times(dot(gap, n), n))) <= least:
        return False
    for k in range(3):
        a = corner(reals, row, k)
        offset = sub(foot, a)
        if flags & (8 << k) and length(offset) < 1e-6:
            return True
        if flags & (1 << k):
            edge = sub(corner(reals, row, (k + 1) % 3), a)
            along = min(max(dot(offset, edge) / dot(edge, edge), 0.0), 1.0)
            if length(sub(offset, times(along, edge))) < 1e-6:
                return True
    return False
