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

_ROOM = 1e-9
"""What rounding may add up to, and more: share, and mm."""


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
def _to_corner(c: Floats, i: int, wide: float, u: float, v: float, w: float) -> float:
    """Squared distance of a point from a corner."""
    du, dv, dw = u - wide * c[i, 0], v - c[i, 1], w - c[i, 2]
    return float(du * du + dv * dv + dw * dw)


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
    clear : array, shape (m,)
        Least distance of each corner to the segments that do not end there, mm.
    same : array, shape (3, n)
        The curve's own places at the phases of the samples, mm.
    place : array, shape (3, B, n)
        mm.
    stretch : array, shape (B,)
    out : array, shape (4, B)
        RMS and largest distance from the nearest place, then from the same phase's, mm.
    """
    c, last = curve.corners, len(curve.corners) - 1
    stack = np.empty(64, dtype=np.int64)
    for b in range(len(stretch)):
        wide, least = stretch[b], min(stretch[b], 1.0)
        at = 0
        near_sum, near_max, same_sum, same_max = 0.0, 0.0, 0.0, 0.0
        for i in range(place.shape[2]):
            u, v, w = place[0, b, i], place[1, b, i], place[2, b, i]
            du, dv, dw = u - wide * same[0, i], v - same[1, i], w - same[2, i]
            off = du * du + dv * dv + dw * dw
            same_sum += off
            same_max = max(same_max, off)
            here = _to_corner(c, at, wide, u, v, w)
            for _ in range(_WALK):
                if at < last:
                    there = _to_corner(c, at + 1, wide, u, v, w)
                    if there < here:
                        at, here = at + 1, there
                        continue
                if at > 0:
                    there = _to_corner(c, at - 1, wide, u, v, w)
                    if there < here:
                        at, here = at - 1, there
                        continue
                break
            near = here
            if at < last:
                near = min(near, _to_segment(c, at, wide, u, v, w))
            if at > 0:
                near = min(near, _to_segment(c, at - 1, wide, u, v, w))
            room = max(least * clear[at] * (1.0 - _ROOM) - _ROOM, 0.0)
            sure = 4.0 * here < room * room
            if not sure and math.sqrt(here) + math.sqrt(near) > room:
                near = _nearest_segment(curve, wide, u, v, w, near, stack)
            near_sum += near
            near_max = max(near_max, near)
        n = place.shape[2]
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
def heights_there(curve: Polyline, clear: Floats, uv: Floats, stretch: Floats, out: Floats) -> None:
    """Fill in heights w where a curve whose u is stretched passes nearest to u, v.

    Parameters
    ----------
    curve : Polyline
        Of m corners.
    clear : array, shape (m,)
        Least distance of each corner to those that are not next to it, seen along w, mm.
    uv : array, shape (2, B, n)
        mm; neighbours are near to one another, or each costs a search of the whole tree.
    stretch : array, shape (B,)
        Factor of the curve's u, for each stroke.
    out : array, shape (B, n)
        Filled in, mm.
    """
    c, last = curve.corners, len(curve.corners) - 1
    stack = np.empty(64, dtype=np.int64)
    for b in range(len(stretch)):
        wide, least = stretch[b], min(stretch[b], 1.0)
        at = 0
        for i in range(uv.shape[2]):
            u, v = uv[0, b, i], uv[1, b, i]
            du, dv = u - wide * c[at, 0], v - c[at, 1]
            here = du * du + dv * dv
            # Of corners that are as near the first one counts.
            settled = False
            for _ in range(_WALK):
                if at < last:
                    du, dv = u - wide * c[at + 1, 0], v - c[at + 1, 1]
                    if du * du + dv * dv < here:
                        at, here = at + 1, du * du + dv * dv
                        continue
                if at > 0:
                    du, dv = u - wide * c[at - 1, 0], v - c[at - 1, 1]
                    if du * du + dv * dv <= here:
                        at, here = at - 1, du * du + dv * dv
                        continue
                settled = True
                break
            room = max(least * clear[at] * (1.0 - _ROOM) - _ROOM, 0.0)
            if not settled or 4.0 * here >= room * room:
                at = _nearest_corner(curve, wide, u, v, here, at, stack)
            best, found = np.inf, c[at, 2]
            for k in range(2):
                one = max(at - 1, 0) if k == 0 else min(at, last - 1)
                bu, bv = wide * c[one + 1, 0] - wide * c[one, 0], c[one + 1, 1] - c[one, 1]
                gu, gv = u - wide * c[one, 0], v - c[one, 1]
                share = (gu * bu + gv * bv) / max(bu * bu + bv * bv, 1e-300)
                share = min(max(share, 0.0), 1.0)
                gu -= share * bu
                gv -= share * bv
                if gu * gu + gv * gv < best:
                    best = gu * gu + gv * gv
                    found = c[one, 2] + share * (c[one + 1, 2] - c[one, 2])
            out[b, i] = found
