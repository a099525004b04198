"""The samples of strips, compiled: bicubic patch, closest point, smooth normal.

Neighbouring samples lie on one facet or on the next. A sample is followed from facet to facet, and
its foot is certified where nothing else of the mesh can be as near; the tree is asked otherwise.
"""

import math
from typing import NamedTuple

import numpy as np

from dmpcli.arrays import Booleans, Floats, Halves, Integers
from dmpcli.compiled import kernel
from dmpcli.surfaces.kernels.tree import (
    CLEARANCE,
    EDGES,
    FACE,
    PART,
    REACH,
    SLOPE,
    VERTICES,
    Facets,
    beyond_border,
    closest,
    corner,
    flat_normal,
    in_doubt,
    on_facet,
    outward_of,
    smooth_normal,
    stack,
)
from dmpcli.surfaces.kernels.vectors import (
    Vector,
    across,
    add,
    cross,
    dot,
    length,
    sub,
    times,
    unit,
)

_NEAR = 0.3
"""Samples further from their facet are looked for in the tree, mm."""

_MOST = 8
"""Facets that a sample is followed over."""

_ROOM = 1e-9
"""So much is kept to be certain in spite of rounding, mm."""


@kernel
def _beside(reals: Floats, row: int, k: int, p: Vector) -> float:
    """How far a point lies beyond the line of an edge, in the facet's plane."""
    return float(dot(outward_of(reals, row, k), p) - reals[row, EDGES + 9 + k])


@kernel
def _steepness(reals: Floats, numbers: Halves, row: int, other: int) -> float:
    """How steep a facet that shares a corner leaves the plane of another, by the way outwards.

    Over any point of it lies at most so much more height over the plane per distance from the
    facet; infinite where its projection may fall back onto the facet.
    """
    n = flat_normal(reals, row)
    steepest = np.inf
    for mode in range(6):
        k = mode % 3
        way = outward_of(reals, row, k)
        if mode >= 3:  # beyond the corner between two edges
            way = unit(add(way, outward_of(reals, row, (k + 1) % 3)))
        shared = numbers[row, VERTICES + (k + 1) % 3]
        start = corner(reals, row, (k + 1) % 3)
        worst = 0.0
        for j in range(3):
            v = numbers[other, VERTICES + j]
            if v == shared or (mode < 3 and v == numbers[row, VERTICES + k]):
                continue
            gap = sub(corner(reals, other, j), start)
            out, up = dot(way, gap), abs(dot(n, gap))
            worst = max(worst, up / out) if out > 1e-12 else np.inf
        steepest = min(steepest, worst)
    return steepest


@kernel
def _apart(reals: Floats, row: int, other: int) -> float:
    """Distance that two facets have at least: along edges, corners and normal of the first."""
    n = flat_normal(reals, row)
    a = corner(reals, row, 0)
    least, most = np.inf, -np.inf
    for j in range(3):
        up = dot(n, sub(corner(reals, other, j), a))
        least, most = min(least, up), max(most, up)
    apart = max(least, -most, 0.0)
    for mode in range(6):
        k = mode % 3
        way = outward_of(reals, row, k)
        if mode >= 3:
            way = unit(add(way, outward_of(reals, row, (k + 1) % 3)))
        start = corner(reals, row, (k + 1) % 3)
        out = np.inf
        for j in range(3):
            out = min(out, dot(way, sub(corner(reals, other, j), start)))
        apart = max(apart, out)
    return apart


@kernel
def _know(facets: Facets, row: int, nodes: Halves) -> None:
    """Find clearance and slope of a facet, see `certified`."""
    reals, numbers = facets.reals, facets.numbers
    reach = 2.0 * _NEAR
    low = np.empty(3)
    high = np.empty(3)
    for k in range(3):
        a, b, c = reals[row, k], reals[row, 3 + k], reals[row, 6 + k]
        low[k], high[k] = min(a, b, c) - reach, max(a, b, c) + reach
    clearance, steepest = reach, 0.0
    inner = len(facets.first) - 2
    nodes[0], held = 0, 1
    while held > 0:
        held -= 1
        node = nodes[held]
        box = facets.boxes[node]
        outside = False
        for k in range(3):
            outside |= box[k] > high[k] or box[3 + k] < low[k]
        if outside:
            continue
        if node < inner:
            nodes[held], nodes[held + 1] = 2 * node + 1, 2 * node + 2
            held += 2
            continue
        leaf = node - inner
        for other in range(facets.first[leaf], facets.first[leaf + 1]):
            if other == row:
                continue
            touches = False
            for i in range(3):
                for j in range(3):
                    touches |= numbers[row, VERTICES + i] == numbers[other, VERTICES + j]
            if touches:
                steepest = max(steepest, _steepness(reals, numbers, row, other))
            else:
                clearance = min(clearance, _apart(reals, row, other))
    facets.reals[row, CLEARANCE] = max(clearance, 0.0)
    # The tangent of half the angle.
    facets.reals[row, SLOPE] = (
        steepest / (1.0 + math.sqrt(1.0 + steepest * steepest)) if steepest < np.inf else np.inf
    )


@kernel
def certified(facets: Facets, row: int, height: float, inside: float, nodes: Halves) -> bool:
    """Tell whether the foot of a point within a facet is the closest of the whole mesh.

    What shares no corner with the facet is at least its clearance away from it. What shares one
    rises over the facet's plane by no more than its slope, from the edges on: seen from the foot,
    a cone that begins `inside` away, mm, and that a point at a height stays off by more than the
    height where inside > height tan(angle / 2).

    Parameters
    ----------
    facets : Facets
        Clearance and slope of the facet are put down in it where they are not known yet.
    row : int
        In the tree's order.
    height : float
        Of the point over the facet's plane, on either side, mm.
    inside : float
        From the foot to the nearest edge, mm.
    nodes : array
        Room, of `stack`.
    """
    if facets.reals[row, CLEARANCE] < 0.0:
        _know(facets, row, nodes)
    near = 2.0 * height + _ROOM < facets.reals[row, CLEARANCE]
    return bool(near and inside > height * facets.reals[row, SLOPE] + _ROOM)


@kernel
def followed(
    facets: Facets, p: Vector, row: int, nodes: Halves, offs: Floats
) -> tuple[Vector, int]:
    """Closest point of the mesh, and its row, from a facet nearby on.

    Parameters
    ----------
    facets : Facets
    p : tuple of float
        mm.
    row : int
        The facet to begin at, in the tree's order; one that is far costs time, and no more.
    nodes, offs : array
        Room, of `stack`.
    """
    reals = facets.reals
    for _ in range(_MOST):
        edge, beside = 0, -np.inf
        for k in range(3):
            off = _beside(reals, row, k, p)
            if off > beside:
                edge, beside = k, off
        if beside < 0.0:
            height = abs(dot(flat_normal(reals, row), sub(p, corner(reals, row, 0))))
            if height < _NEAR and certified(facets, row, height, -beside, nodes):
                return on_facet(reals, row, p), row
            break
        row = facets.numbers[row, edge]
        if row < 0:
            break
    return closest(facets, p, nodes, offs)


class StripNodes(NamedTuple):
    """Nodes of B strips, as `strip_grid.Nodes` says it."""

    values: Floats
    normal: Floats
    stretch: Floats
    away: Floats


class SampleLimits(NamedTuple):
    """What `triangle_mesh` and `geodesic_stepping` call by these names."""

    on_border: float
    landing: float


class SampleFeet(NamedTuple):
    """Samples of B strokes on the mesh, as `strip_chart.Samples` says it, and what they met.

    Where there is `doubt` numpy is to decide, on `point` and `way`, e_v unnormalised.
    """

    foot: Floats
    across: Floats
    normal: Floats
    face: Integers
    stretch: Floats
    beyond: Booleans
    far: Booleans
    back: Booleans
    doubt: Booleans
    point: Floats
    way: Floats


@kernel
def _weights(s: float) -> tuple[float, float, float, float]:
    s2, s3 = s * s, s * s * s
    return 1 - 3 * s2 + 2 * s3, s - 2 * s2 + s3, 3 * s2 - 2 * s3, s3 - s2


@kernel
def _slopes(s: float) -> tuple[float, float, float, float]:
    s2 = s * s
    return 6 * (s2 - s), 1 - 4 * s + 3 * s2, 6 * (s - s2), 3 * s2 - 2 * s


@kernel
def _along_u(values: Floats, at: tuple[int, int, int], k: int, r: float) -> tuple[float, float]:
    """Coordinate k on a line of a cell between two nodes, and its v-slope."""
    b, i, j = at
    p, pu, q, qu = _weights(r)
    value = p * values[b, i, j, k] + q * values[b, i + 1, j, k]
    value += pu * values[b, i, j, 6 + k] + qu * values[b, i + 1, j, 6 + k]
    slope = p * values[b, i, j, 3 + k] + q * values[b, i + 1, j, 3 + k]
    slope += pu * values[b, i, j, 9 + k] + qu * values[b, i + 1, j, 9 + k]
    return value, slope


@kernel
def _coordinate(
    values: Floats, at: tuple[int, int, int], k: int, r: float, s: float
) -> tuple[float, float]:
    """Coordinate k of a point in a cell, and of the unnormalised e_v there."""
    near, near_v = _along_u(values, at, k, r)
    far, far_v = _along_u(values, (at[0], at[1], at[2] + 1), k, r)
    w0, w1, w2, w3 = _weights(s)
    t0, t1, t2, t3 = _slopes(s)
    value = w0 * near + w1 * near_v + w2 * far + w3 * far_v
    return value, t0 * near + t1 * near_v + t2 * far + t3 * far_v


@kernel
def lift(
    facets: Facets,
    strip: StripNodes,
    u: Floats,
    v: Floats,
    sign: Floats,
    part: Integers,
    limits: SampleLimits,
    out: SampleFeet,
) -> None:
    """Carry samples u, v through patches onto the mesh; fill `out`.

    Parameters
    ----------
    facets : Facets
    strip : StripNodes
    u, v : array, shape (B, T)
        Counted in nodes from the first one; the patches at the rim carry on beyond it.
    sign : array, shape (B, 1)
        Turns the mesh's normals to the tool's side.
    part : array of int, shape (B,)
        Component that a stroke may not leave.
    limits : SampleLimits
    out : SampleFeet
        Filled in, shapes (B, T, ...), but for `point` and `way`: those only where there is doubt.
    """
    nodes, offs = stack()
    nu, nv = strip.values.shape[1] - 1, strip.values.shape[2] - 1
    for b in range(len(u)):
        row = -1
        for k in range(u.shape[1]):
            i = min(max(math.floor(u[b, k]), 0), nu - 1)
            j = min(max(math.floor(v[b, k]), 0), nv - 1)
            r, s = u[b, k] - i, v[b, k] - j
            x, dx = _coordinate(strip.values, (b, i, j), 0, r, s)
            y, dy = _coordinate(strip.values, (b, i, j), 1, r, s)
            z, dz = _coordinate(strip.values, (b, i, j), 2, r, s)
            p, way = (x, y, z), (dx, dy, dz)
            if row < 0:
                foot, row = closest(facets, p, nodes, offs)
            else:
                foot, row = followed(facets, p, row, nodes, offs)
            unsure = in_doubt(facets, p, foot, row)
            out.doubt[b, k] = unsure
            if unsure:
                out.point[b, k, 0], out.point[b, k, 1], out.point[b, k, 2] = p
                out.way[b, k, 0], out.way[b, k, 1], out.way[b, k, 2] = way
            n = times(sign[b, 0], smooth_normal(facets.reals, foot, row))
            a, c = i + (1 if r > 0.5 else 0), j + (1 if s > 0.5 else 0)
            beyond = facets.numbers[row, PART] != part[b]
            beyond = beyond or beyond_border(facets, p, foot, row, limits.on_border)
            near = strip.normal[b, a, c, 0], strip.normal[b, a, c, 1], strip.normal[b, a, c, 2]
            out.back[b, k] = not beyond and dot(n, near) < 0.0
            allowed = max(facets.reals[row, REACH], limits.landing * strip.away[b, i, j])
            out.far[b, k] = not beyond and length(sub(p, foot)) > allowed
            out.beyond[b, k] = beyond
            out.stretch[b, k] = strip.stretch[b, a, c]
            out.face[b, k] = facets.numbers[row, FACE]
            out.foot[b, k, 0], out.foot[b, k, 1], out.foot[b, k, 2] = foot
            out.normal[b, k, 0], out.normal[b, k, 1], out.normal[b, k, 2] = n
            side = across(way, n)
            out.across[b, k, 0], out.across[b, k, 1], out.across[b, k, 2] = side


@kernel
def frames(side: Floats, normal: Floats, out: Floats) -> None:
    """Fill in axes (B, T, 3, 3) with columns e_u, e_v, n of unit vectors e_v, n (B, T, 3)."""
    for b in range(len(out)):
        for k in range(out.shape[1]):
            e_v = side[b, k, 0], side[b, k, 1], side[b, k, 2]
            n = normal[b, k, 0], normal[b, k, 1], normal[b, k, 2]
            e_u = cross(e_v, n)
            for i in range(3):
                out[b, k, i, 0], out[b, k, i, 1], out[b, k, i, 2] = e_u[i], e_v[i], n[i]
