"""Strip charts inverted, compiled: feet by the smooth normal, then Newton steps on the spline.

Each sample begins where its neighbour came to rest, moved on as far as their feet are apart.
"""

import math
from typing import NamedTuple

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.compiled import kernel
from dmpcli.surfaces.kernels.samples import followed
from dmpcli.surfaces.kernels.tree import (
    EDGES,
    Facets,
    closest,
    flat_normal,
    in_doubt,
    outward_of,
    smooth_normal,
    stack,
)
from dmpcli.surfaces.kernels.vectors import (
    Vector,
    cross,
    dot,
    length,
    sub,
    times,
)

_ON_EDGE = 1e-9
"""A foot this near to an edge of its facet may as well lie on the next one, mm."""

_SEEDED = 5.0
"""Where the neighbour leads no farther than this from a guess it is begun there, mm."""


class FootLimits(NamedTuple):
    """How often feet are sought, and how near they must come, mm; see `strip_inverse`."""

    most: int
    near: float


class NewtonLimits(NamedTuple):
    """What `strip_inverse` calls by these names."""

    steps: int
    still: float
    longest: float
    least_area: float


@kernel
def closest_along(
    facets: Facets,
    points: Floats,
    foot: Floats,
    normal: Floats,
    where: Integers,
    doubt: Booleans,
) -> None:
    """Fill in closest points of paths, smooth normals there, and rows of facets.

    Parameters
    ----------
    facets : Facets
    points : array, shape (B, T, 3)
        mm; neighbours are near to one another, or each costs a search of the whole tree.
    foot, normal : array, shape (B, T, 3)
        Filled in: mm, and unit vectors on the mesh's own side.
    where : array of int, shape (B, T)
        Filled in: facets in the tree's order.
    doubt : array of bool, shape (B, T)
        Filled in: where numpy is to decide.
    """
    nodes, offs = stack()
    for b in range(len(points)):
        row = -1
        for k in range(points.shape[1]):
            p = points[b, k, 0], points[b, k, 1], points[b, k, 2]
            if row < 0:
                q, row = closest(facets, p, nodes, offs)
            else:
                q, row = followed(facets, p, row, nodes, offs)
            doubt[b, k] = in_doubt(facets, p, q, row)
            foot[b, k, 0], foot[b, k, 1], foot[b, k, 2], where[b, k] = q[0], q[1], q[2], row
            n = smooth_normal(facets.reals, q, row)
            normal[b, k, 0], normal[b, k, 1], normal[b, k, 2] = n


@kernel
def _on_edge(reals: Floats, foot: Vector, row: int) -> bool:
    """Tell whether a point of a facet lies on an edge of it."""
    for k in range(3):
        if dot(outward_of(reals, row, k), foot) - reals[row, EDGES + 9 + k] > -_ON_EDGE:
            return True
    return False


@kernel
def feet(
    facets: Facets,
    points: Floats,
    near: tuple[Floats, Integers],
    sign: Floats,
    limits: FootLimits,
    foot: Floats,
    facet: Floats,
    height: Floats,
    doubt: Booleans,
) -> None:
    """Fill in feet by the smooth normal, normals of their facets, and heights.

    Parameters
    ----------
    facets : Facets
    points : array, shape (B, T, 3)
        mm.
    near : tuple of array (B, T, 3), array of int (B, T)
        Their closest points, mm, and rows of facets, where the search begins.
    sign : array, shape (B, 1)
        Turns the mesh's normals to the tool's side.
    limits : FootLimits
    foot, facet : array, shape (B, T, 3)
        Filled in: mm, NaN where no foot is found; and unit normals of the facets, on the mesh's own
        side.
    height : array, shape (B, T)
        Filled in: over the foot on the tool's side, mm.
    doubt : array of bool, shape (B, T)
        Filled in: samples for numpy, whose feet lie on an edge, where it matters which of its
        facets is named.
    """
    nodes, offs = stack()
    for b in range(len(points)):
        for k in range(points.shape[1]):
            p = points[b, k, 0], points[b, k, 1], points[b, k, 2]
            q, row = (near[0][b, k, 0], near[0][b, k, 1], near[0][b, k, 2]), near[1][b, k]
            below, up, unsure = p, 0.0, False
            for step in range(limits.most):
                if step > 0:
                    q, row = followed(facets, below, row, nodes, offs)
                unsure |= _on_edge(facets.reals, q, row) or in_doubt(facets, below, q, row)
                n = times(sign[b, 0], smooth_normal(facets.reals, q, row))
                up = dot(sub(p, q), n)
                below = sub(p, times(up, n))
                if length(sub(below, q)) <= limits.near:
                    break
                if step == limits.most - 1:
                    q = (np.nan, np.nan, np.nan)
            height[b, k], doubt[b, k] = up, unsure
            foot[b, k, 0], foot[b, k, 1], foot[b, k, 2] = q
            facet[b, k, 0], facet[b, k, 1], facet[b, k, 2] = flat_normal(facets.reals, row)


@kernel
def _arc(aside: float, up: float) -> float:
    """Length of the arc of a circle from a point of it to another, that far aside and above."""
    chord = aside * aside + up * up
    if not chord > 0.0:
        return aside
    bend = 2.0 * up / chord
    if abs(bend * aside) < 1e-6:
        return aside
    return math.atan2(bend * aside, 1.0 - bend * up) / bend


@kernel
def guesses(
    line: Floats,
    e_v: Floats,
    normal: Floats,
    behind: Integers,
    ahead: Integers,
    zero: int,
    step: Floats,
    foot: Floats,
) -> Floats:
    """u, v (B, T, 2) beside the nearest nodes of centre lines, in their axes, mm.

    Parameters
    ----------
    line, e_v, normal : array, shape (B, nu, 3)
        Of the nodes, mm; unit vectors, the normals on the tool's side.
    behind, ahead : array of int, shape (B,)
        How many nodes there are on either side of the start.
    zero : int
        The node at the start.
    step : array, shape (B,)
        From node to node, mm.
    foot : array, shape (B, T, 3)
        Points of the surface, mm.
    """
    found = np.empty((foot.shape[0], foot.shape[1], 2))
    for b in range(len(foot)):
        for k in range(foot.shape[1]):
            x, y, z = foot[b, k, 0], foot[b, k, 1], foot[b, k, 2]
            node, nearest = zero, np.inf
            for i in range(zero - behind[b], zero + ahead[b] + 1):
                dx, dy, dz = x - line[b, i, 0], y - line[b, i, 1], z - line[b, i, 2]
                off = dx * dx + dy * dy + dz * dz
                if off < nearest:
                    node, nearest = i, off
            gap = x - line[b, node, 0], y - line[b, node, 1], z - line[b, node, 2]
            side = e_v[b, node, 0], e_v[b, node, 1], e_v[b, node, 2]
            n = normal[b, node, 0], normal[b, node, 1], normal[b, node, 2]
            found[b, k, 0] = (node - zero) * step[b] + dot(gap, cross(side, n))
            found[b, k, 1] = _arc(dot(gap, side), dot(gap, n))
    return found


Weights = tuple[float, float, float, float]


@kernel
def _weights(s: float) -> Weights:
    """Weights of value and slope at 0 and at 1."""
    s2, s3 = s * s, s * s * s
    return 1 - 3 * s2 + 2 * s3, s - 2 * s2 + s3, 3 * s2 - 2 * s3, s3 - s2


@kernel
def _slopes(s: float) -> Weights:
    """Derivatives of the weights."""
    s2 = s * s
    return 6 * (s2 - s), 1 - 4 * s + 3 * s2, 6 * (s - s2), 3 * s2 - 2 * s


@kernel
def _blended(values: Floats, cell: tuple[int, int, int], k: int, w: Weights) -> float:
    """Number k of two nodes along u, whose u-slope stands six on."""
    b, i, j = cell
    here = w[0] * values[b, i, j, k] + w[1] * values[b, i, j, 6 + k]
    there = w[2] * values[b, i + 1, j, k] + w[3] * values[b, i + 1, j, 6 + k]
    return float(here + there)


@kernel
def _coordinate(
    values: Floats,
    cell: tuple[int, int, int],
    k: int,
    along: tuple[Weights, Weights],
    aside: tuple[Weights, Weights],
) -> Vector:
    """Coordinate k of a place on the spline, and its derivatives per node along u and v."""
    next_to = cell[0], cell[1], cell[2] + 1
    near, near_v = _blended(values, cell, k, along[0]), _blended(values, cell, 3 + k, along[0])
    far, far_v = _blended(values, next_to, k, along[0]), _blended(values, next_to, 3 + k, along[0])
    w, t = aside
    place = w[0] * near + w[1] * near_v + w[2] * far + w[3] * far_v
    by_v = t[0] * near + t[1] * near_v + t[2] * far + t[3] * far_v
    near, near_v = _blended(values, cell, k, along[1]), _blended(values, cell, 3 + k, along[1])
    far, far_v = _blended(values, next_to, k, along[1]), _blended(values, next_to, 3 + k, along[1])
    return place, w[0] * near + w[1] * near_v + w[2] * far + w[3] * far_v, by_v


@kernel
def _on_spline(values: Floats, b: int, u: float, v: float) -> tuple[Vector, Vector, Vector]:
    """Place on the spline of u, v, counted in nodes, and its derivatives per node along both."""
    i = min(max(math.floor(u), 0), values.shape[1] - 2)
    j = min(max(math.floor(v), 0), values.shape[2] - 2)
    cell, r, s = (b, i, j), u - i, v - j
    along, aside = (_weights(r), _slopes(r)), (_weights(s), _slopes(s))
    x, xu, xv = _coordinate(values, cell, 0, along, aside)
    y, yu, yv = _coordinate(values, cell, 1, along, aside)
    z, zu, zv = _coordinate(values, cell, 2, along, aside)
    return (x, y, z), (xu, yu, zu), (xv, yv, zv)


@kernel
def extents(at: Floats) -> Floats:
    """Least and largest u and v of coordinates (B, T, 2), shape (B, 2, 2); NaN where one is."""
    found = np.empty((len(at), 2, 2))
    for b in range(len(at)):
        for c in range(2):
            low, high = at[b, 0, c], at[b, 0, c]
            for k in range(at.shape[1]):
                x = at[b, k, c]
                low = x if x < low or x != x else low
                high = x if x > high or x != x else high
            found[b, 0, c], found[b, 1, c] = low, high
    return found


@kernel
def mark(cells: Booleans, at: Floats, step: Floats, zero: Floats, beside: float) -> None:
    """Mark the cells (B, nu - 1, nv - 1) of coordinates (B, T, 2), mm, and of those next to them.

    These are so many nodes `beside` them, along u and v; for the rest see `settle`.
    """
    nu, nv = cells.shape[1] - 1, cells.shape[2] - 1
    for b in range(len(at)):
        for k in range(at.shape[1]):
            u, v = at[b, k, 0] / step[b, 0] + zero[0], at[b, k, 1] / step[b, 1] + zero[1]
            low = min(max(math.floor(u - beside), 0), nu)
            high = min(max(math.floor(u + beside), 0), nu)
            right = min(max(math.floor(v - beside), 0), nv)
            left = min(max(math.floor(v + beside), 0), nv)
            cells[b, low, right] = cells[b, low, left] = True
            cells[b, high, right] = cells[b, high, left] = True


@kernel
def settle(
    values: Floats,
    step: Floats,
    zero: Floats,
    guess: Floats,
    foot: Floats,
    facet: Floats,
    limits: NewtonLimits,
    seeded: bool,
) -> Booleans:
    """Move coordinates `guess` (B, T, 2) over feet (B, T, 3), in place; which strokes are at rest.

    Parameters
    ----------
    values : array, shape (B, nu, nv, 12)
        As `strip_grid.Nodes` has them.
    step : array, shape (B, 2)
        Of the nodes, along u and v, mm.
    zero : array, shape (2,)
        The node at the start.
    guess, foot : array
        mm.
    facet : array, shape (B, T, 3)
        Normals that the spline is to stand over the feet along.
    limits : NewtonLimits
    seeded : bool
        Whether samples begin where their neighbours lead them.
    """
    still = np.ones(len(guess), dtype=np.bool_)
    for b in range(len(guess)):
        su, sv = step[b, 0], step[b, 1]
        u, v, known = 0.0, 0.0, False
        by_u, by_v, before = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        for k in range(guess.shape[1]):
            q = foot[b, k, 0], foot[b, k, 1], foot[b, k, 2]
            n = facet[b, k, 0], facet[b, k, 1], facet[b, k, 2]
            near = guess[b, k, 0], guess[b, k, 1]
            if known and seeded:
                e, area = sub(q, before), dot(n, cross(by_u, by_v))
                if abs(area) > limits.least_area:
                    u += dot(n, cross(e, by_v)) / area
                    v += dot(n, cross(by_u, e)) / area
                if max(abs(u - near[0]), abs(v - near[1])) > _SEEDED:
                    u, v = near
            else:
                u, v = near
            known = False
            for _ in range(limits.steps):
                point, by_u, by_v = _on_spline(values, b, u / su + zero[0], v / sv + zero[1])
                by_u, by_v = times(1.0 / su, by_u), times(1.0 / sv, by_v)
                area = dot(n, cross(by_u, by_v))
                if not abs(area) > limits.least_area:
                    break
                e = sub(q, point)
                du, dv = dot(n, cross(e, by_v)) / area, dot(n, cross(by_u, e)) / area
                size = math.sqrt(du * du + dv * dv)
                short = min(1.0, limits.longest / max(size, 1e-300))
                u, v = u + short * du, v + short * dv
                if size < limits.still:
                    known = True
                    break
            before = q
            guess[b, k, 0], guess[b, k, 1] = u, v
            still[b] &= known
    return still


@kernel
def missed(position: Floats, lifted: Floats, axes: Floats, at: Floats, miss: Floats) -> None:
    """Move w of coordinates `at` (B, T, 3) up to positions (B, T, 3); how far these lie beside.

    `lifted` is what the coordinates lead to, with `axes` (B, T, 3, 3) there; `miss` is (B, T), mm.
    """
    for b in range(len(at)):
        for k in range(at.shape[1]):
            u, v, w = 0.0, 0.0, 0.0
            for i in range(3):
                gap = position[b, k, i] - lifted[b, k, i]
                u += gap * axes[b, k, i, 0]
                v += gap * axes[b, k, i, 1]
                w += gap * axes[b, k, i, 2]
            at[b, k, 2] += w
            miss[b, k] = math.sqrt(u * u + v * v)
