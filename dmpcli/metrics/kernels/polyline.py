"""The nearest places of a curve whose u is stretched, compiled: walked to and certified, or sought.

Neighbouring samples of a stroke lie beside neighbouring corners of the demonstration, so each
search begins at the corner where the one before ended. What is known of the curve's clearance tells
whether anything else can be as near; otherwise a tree of boxes is asked, which leaves nothing out.
"""

import math
from typing import NamedTuple

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.compiled import kernel

_LEAF = 8
"""Segments in a leaf of the tree."""

_WALK = 64
"""Corners that are walked over before the tree is asked."""

REACHES = (1, 2, 4, 8, 16, 32)
"""Segments, or corners, on either side that are looked at before the tree is asked."""

_ROOM = 1e-9
"""What rounding may add up to, and more: share, and mm."""

_COLUMNS = 8
"""Of the table that is made of a curve for each stroke; see `_stretched`."""


class Polyline(NamedTuple):
    """A polyline of m corners, and a tree of boxes about its segments.

    Attributes
    ----------
    corners : array, shape (m, 3)
        u, v, w, mm.
    boxes : array, shape (2 leaves - 1, 6)
        Least and largest u, v, w in a node; node i has the children 2i + 1 and 2i + 2.
    first : array of int, shape (leaves + 1,)
        Where the segments of each leaf begin.
    """

    corners: Floats
    boxes: Floats
    first: Integers


def curve(corners: Floats) -> Polyline:
    """Make a curve of corners (m, 3), m ≥ 2, ready to be searched."""
    segments, leaves = len(corners) - 1, 1
    while segments > _LEAF * leaves:
        leaves *= 2
    first = np.arange(leaves + 1) * segments // leaves
    boxes = np.empty((2 * leaves - 1, 6))
    for leaf in range(leaves):
        held = corners[first[leaf] : first[leaf + 1] + 1]
        boxes[leaves - 1 + leaf] = np.concatenate([held.min(axis=0), held.max(axis=0)])
    for node in range(leaves - 2, -1, -1):
        below = boxes[2 * node + 1 : 2 * node + 3]
        boxes[node] = np.concatenate([below[:, :3].min(axis=0), below[:, 3:].max(axis=0)])
    return Polyline(np.ascontiguousarray(corners, dtype=float), boxes, first.astype(np.int64))


@kernel
def _to_segment(c: Floats, i: int, wide: float, u: float, v: float, w: float) -> float:
    """Squared distance of a point from segment i."""
    bu, bv, bw = wide * (c[i + 1, 0] - c[i, 0]), c[i + 1, 1] - c[i, 1], c[i + 1, 2] - c[i, 2]
    du, dv, dw = u - wide * c[i, 0], v - c[i, 1], w - c[i, 2]
    share = (du * bu + dv * bv + dw * bw) / max(bu * bu + bv * bv + bw * bw, 1e-200)
    share = min(max(share, 0.0), 1.0)
    du -= share * bu
    dv -= share * bv
    dw -= share * bw
    return float(du * du + dv * dv + dw * dw)


@kernel
def _off_box(boxes: Floats, node: int, wide: float, u: float, v: float) -> float:
    """Squared distance of a point from a box, seen along w."""
    du = max(wide * boxes[node, 0] - u, u - wide * boxes[node, 3], 0.0)
    dv = max(boxes[node, 1] - v, v - boxes[node, 4], 0.0)
    return float(du * du + dv * dv)


@kernel
def _off_solid(boxes: Floats, node: int, wide: float, u: float, v: float, w: float) -> float:
    """Squared distance of a point from a box."""
    dw = max(boxes[node, 2] - w, w - boxes[node, 5], 0.0)
    return float(_off_box(boxes, node, wide, u, v) + dw * dw)


@kernel
def _nearest_segment(
    curve: Polyline, wide: float, u: float, v: float, w: float, bound: float, stack: Integers
) -> float:
    """Squared distance of a point from the whole curve, which is no more than a bound."""
    best, inner = bound, len(curve.first) - 2
    stack[0], held = 0, 1
    while held > 0:
        held -= 1
        node = stack[held]
        if _off_solid(curve.boxes, node, wide, u, v, w) >= best:
            continue
        if node < inner:
            one, other = 2 * node + 1, 2 * node + 2
            if _off_solid(curve.boxes, other, wide, u, v, w) < _off_solid(
                curve.boxes, one, wide, u, v, w
            ):
                one, other = other, one
            # The nearer one comes off the stack first.
            stack[held], stack[held + 1] = other, one
            held += 2
            continue
        leaf = node - inner
        for i in range(curve.first[leaf], curve.first[leaf + 1]):
            best = min(best, _to_segment(curve.corners, i, wide, u, v, w))
    return best


@kernel
def _stretched(curve: Polyline, near: Floats, wide: float, flat: bool, table: Floats) -> None:
    """Fill in a row of `_COLUMNS` for each corner of a curve whose u is stretched.

    Where it lies, the way to the next one (w is 0 in both if the curve is `flat`), 1 over its
    square, and the square of half the distance `near` up to which its neighbours are the nearest.
    """
    c, last, up = curve.corners, len(curve.corners) - 1, 0.0 if flat else 1.0
    for i in range(last + 1):
        table[i, 0], table[i, 1], table[i, 2] = wide * c[i, 0], c[i, 1], up * c[i, 2]
        room = 0.5 * _room(near[i], wide)
        table[i, 7] = room * room
    for i in range(last):
        x = table[i + 1, 0] - table[i, 0]
        y = table[i + 1, 1] - table[i, 1]
        z = table[i + 1, 2] - table[i, 2]
        table[i, 3], table[i, 4], table[i, 5] = x, y, z
        table[i, 6] = 1.0 / max(x * x + y * y + z * z, 1e-200)


@kernel
def _room(clear: float, wide: float) -> float:
    """Clearance of a stretched curve, less what rounding may add up to, mm."""
    return max(min(wide, 1.0) * clear * (1.0 - _ROOM) - _ROOM, 0.0)


@kernel
def _reach(clear: Floats, at: int, wide: float, need: float) -> int:
    """How far along the curve from a corner to look so that all that is nearer is seen; 0: on."""
    for r in range(1, len(clear)):
        if need <= _room(clear[r, at], wide):
            return 1 << r
    return 0


@kernel
def _nearest_beside(table: Floats, at: int, reach: int, u: float, v: float, w: float) -> float:
    """Squared distance of a point from the segments up to so many on either side of a corner."""
    best = np.inf
    for i in range(max(at - reach, 0), min(at + reach, len(table) - 1)):
        du, dv, dw = u - table[i, 0], v - table[i, 1], w - table[i, 2]
        bu, bv, bw = table[i, 3], table[i, 4], table[i, 5]
        share = min(max((du * bu + dv * bv + dw * bw) * table[i, 6], 0.0), 1.0)
        du, dv, dw = du - share * bu, dv - share * bv, dw - share * bw
        best = min(best, du * du + dv * dv + dw * dw)
    return best


@kernel
def deviations(
    curve: Polyline,
    clear: Floats,
    same: Floats,
    place: Floats,
    stretch: Floats,
    out: Floats,
) -> None:
    """Fill in how far strokes lie from a curve whose u is stretched.

    Parameters
    ----------
    curve : Polyline
    clear : array, shape (R, m)
        Least distance of each corner to the segments beyond the next 1, 2, 4, ... on either side,
        mm.
    same : array, shape (3, n)
        The curve's own places at the phases of the samples, mm.
    place : array, shape (3, B, n)
        mm.
    stretch : array, shape (B,)
    out : array, shape (4, B)
        RMS and largest distance from the nearest place, then from the same phase's, mm.
    """
    last, n = len(curve.corners) - 1, place.shape[2]
    stack, table = np.empty(64, dtype=np.int64), np.empty((last + 1, _COLUMNS))
    for b in range(len(stretch)):
        wide, at = stretch[b], 0
        _stretched(curve, clear[0], wide, False, table)
        near_sum, near_max, same_sum, same_max = 0.0, 0.0, 0.0, 0.0
        for i in range(n):
            u, v, w = place[0, b, i], place[1, b, i], place[2, b, i]
            du, dv, dw = u - wide * same[0, i], v - same[1, i], w - same[2, i]
            off = du * du + dv * dv + dw * dw
            same_sum += off
            same_max = max(same_max, off)
            du, dv, dw = u - table[at, 0], v - table[at, 1], w - table[at, 2]
            here = du * du + dv * dv + dw * dw
            for way in (1, -1):
                walked = 0
                while walked < _WALK and 0 <= at + way <= last:
                    eu, ev = u - table[at + way, 0], v - table[at + way, 1]
                    ew = w - table[at + way, 2]
                    there = eu * eu + ev * ev + ew * ew
                    if not there < here:
                        break
                    at, walked = at + way, walked + 1
                    du, dv, dw, here = eu, ev, ew, there
                if walked > 0:
                    break
            near = here
            if at < last:
                bu, bv, bw = table[at, 3], table[at, 4], table[at, 5]
                share = min(max((du * bu + dv * bv + dw * bw) * table[at, 6], 0.0), 1.0)
                eu, ev, ew = du - share * bu, dv - share * bv, dw - share * bw
                near = min(near, eu * eu + ev * ev + ew * ew)
            if at > 0:
                bu, bv, bw = table[at - 1, 3], table[at - 1, 4], table[at - 1, 5]
                share = min(max(-(du * bu + dv * bv + dw * bw) * table[at - 1, 6], 0.0), 1.0)
                eu, ev, ew = du + share * bu, dv + share * bv, dw + share * bw
                near = min(near, eu * eu + ev * ev + ew * ew)
            if not here < table[at, 7]:
                need = math.sqrt(here) + math.sqrt(near)
                if need > _room(clear[0, at], wide):
                    reach = _reach(clear, at, wide, need)
                    if reach > 0:
                        near = _nearest_beside(table, at, reach, u, v, w)
                    else:
                        near = _nearest_segment(curve, wide, u, v, w, near, stack)
            near_sum += near
            near_max = max(near_max, near)
        out[0, b], out[1, b] = math.sqrt(near_sum / n), math.sqrt(near_max)
        out[2, b], out[3, b] = math.sqrt(same_sum / n), math.sqrt(same_max)


@kernel
def _nearest_corner(
    curve: Polyline, wide: float, u: float, v: float, bound: float, at: int, stack: Integers
) -> int:
    """The corner nearest to a point, seen along w; the first of several."""
    best, inner = bound, len(curve.first) - 2
    stack[0], held = 0, 1
    while held > 0:
        held -= 1
        node = stack[held]
        if _off_box(curve.boxes, node, wide, u, v) > best:
            continue
        if node < inner:
            one, other = 2 * node + 1, 2 * node + 2
            if _off_box(curve.boxes, other, wide, u, v) < _off_box(curve.boxes, one, wide, u, v):
                one, other = other, one
            stack[held], stack[held + 1] = other, one
            held += 2
            continue
        leaf = node - inner
        for i in range(curve.first[leaf], curve.first[leaf + 1] + 1):
            du, dv = u - wide * curve.corners[i, 0], v - curve.corners[i, 1]
            off = du * du + dv * dv
            if off < best or (off == best and i < at):
                best, at = off, i
    return at


@kernel
def _corner_beside(table: Floats, at: int, reach: int, u: float, v: float) -> int:
    """The corner nearest to a point up to so many on either side of one; the first of several."""
    best, found = np.inf, at
    for i in range(max(at - reach, 0), min(at + reach, len(table) - 1) + 1):
        du, dv = u - table[i, 0], v - table[i, 1]
        if du * du + dv * dv < best:
            best, found = du * du + dv * dv, i
    return found


@kernel
def heights_there(curve: Polyline, clear: Floats, uv: Floats, stretch: Floats, out: Floats) -> None:
    """Fill in heights w where a curve whose u is stretched passes nearest to u, v.

    Parameters
    ----------
    curve : Polyline
        Of m corners.
    clear : array, shape (R, m)
        Least distance of each corner to those beyond the next 1, 2, 4, ... on either side, seen
        along w, mm.
    uv : array, shape (2, B, n)
        mm; neighbours are near to one another, or each costs a search of the whole tree.
    stretch : array, shape (B,)
        Factor of the curve's u, for each stroke.
    out : array, shape (B, n)
        Filled in, mm.
    """
    c, last = curve.corners, len(curve.corners) - 1
    stack, table = np.empty(64, dtype=np.int64), np.empty((last + 1, _COLUMNS))
    for b in range(len(stretch)):
        wide, at = stretch[b], 0
        _stretched(curve, clear[0], wide, True, table)
        for i in range(uv.shape[2]):
            u, v = uv[0, b, i], uv[1, b, i]
            du, dv = u - table[at, 0], v - table[at, 1]
            here, walked = du * du + dv * dv, 0
            while walked < _WALK and at < last:
                eu, ev = u - table[at + 1, 0], v - table[at + 1, 1]
                if not eu * eu + ev * ev < here:
                    break
                at, walked = at + 1, walked + 1
                du, dv, here = eu, ev, eu * eu + ev * ev
            back = walked == 0
            # Of corners that are as near the first one counts.
            while back and walked < _WALK and at > 0:
                eu, ev = u - table[at - 1, 0], v - table[at - 1, 1]
                if not eu * eu + ev * ev <= here:
                    break
                at, walked = at - 1, walked + 1
                du, dv, here = eu, ev, eu * eu + ev * ev
            if walked == _WALK or not here < table[at, 7]:
                reach = _reach(clear, at, wide, 2.0 * math.sqrt(here))
                if reach > 0:
                    at = _corner_beside(table, at, reach, u, v)
                else:
                    at = _nearest_corner(curve, wide, u, v, here, at, stack)
                du, dv = u - table[at, 0], v - table[at, 1]
            # Beside it on the nearer of its two segments, the first of both.
            best, found = np.inf, c[at, 2]
            if at > 0:
                bu, bv = table[at - 1, 3], table[at - 1, 4]
                share = min(max(-(du * bu + dv * bv) * table[at - 1, 6], 0.0), 1.0)
                eu, ev = du + share * bu, dv + share * bv
                best, found = eu * eu + ev * ev, c[at, 2] - share * (c[at, 2] - c[at - 1, 2])
            if at < last:
                bu, bv = table[at, 3], table[at, 4]
                share = min(max((du * bu + dv * bv) * table[at, 6], 0.0), 1.0)
                eu, ev = du - share * bu, dv - share * bv
                if eu * eu + ev * ev < best:
                    found = c[at, 2] + share * (c[at + 1, 2] - c[at, 2])
            out[b, i] = found
