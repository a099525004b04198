"""`straightest_geodesics`, compiled: straight through each facet, unfolded across each edge."""

import numpy as np

from dmpcli.arrays import Booleans, Floats, Halves, Integers
from dmpcli.compiled import kernel
from dmpcli.surfaces.kernels.tree import corner, flat_normal, outward_of
from dmpcli.surfaces.kernels.vectors import (
    Vector,
    add,
    at,
    cross,
    dot,
    put,
    sub,
    times,
    unit,
)


@kernel
def _exit(reals: Floats, p: Vector, d: Vector, row: int, entry: int) -> tuple[int, float]:
    """Edge through which a walk leaves its facet, and the way to it."""
    edge, way = 0, np.inf
    for k in range(3):
        if k == entry:
            continue
        outward = outward_of(reals, row, k)
        speed = dot(outward, d)
        if speed > 1e-14:
            room = max(dot(outward, sub(corner(reals, row, k), p)), 0.0) / speed
            if room < way:
                edge, way = k, room
    return edge, way


@kernel
def run(
    reals: Floats,
    numbers: Halves,
    position: Floats,
    heading: Floats,
    rows: Integers,
    remaining: Floats,
    most: int,
) -> Booleans:
    """Walk lengths (M,), mm, in place, over no more than so many facets; tell which got there.

    Parameters
    ----------
    reals, numbers : array
        Of `Facets`.
    position, heading : array, shape (M, 3)
        On the mesh, mm, and unit vectors in the facets' planes; overwritten. A walk that meets a
        border ends there.
    rows : array of int, shape (M,)
        Facets in the tree's order; overwritten.
    remaining : array, shape (M,)
        How far to walk, mm; read only.
    most : int

    Returns
    -------
    array of bool, shape (M,)
    """
    arrived = np.zeros(len(remaining), dtype=np.bool_)
    for i in range(len(remaining)):
        p, d, row, left = at(position, i), at(heading, i), rows[i], remaining[i]
        entry = -1
        for _ in range(most):
            edge, way = _exit(reals, p, d, row, entry)
            p = add(p, times(min(way, left), d))
            if left <= way:
                arrived[i] = True
                break
            left -= way
            after = numbers[row, edge]
            if after < 0:
                break
            n = flat_normal(reals, row)
            a = corner(reals, row, edge)
            along = unit(sub(corner(reals, row, (edge + 1) % 3), a))
            part, out = dot(d, along), dot(d, cross(along, n))
            d = unit(add(times(part, along), times(out, cross(along, flat_normal(reals, after)))))
            entry = 0
            for k in range(3):
                if numbers[after, k] == row:
                    entry = k
                    break
            row = after
        put(position, i, p)
        put(heading, i, d)
        rows[i] = row
    return arrived
