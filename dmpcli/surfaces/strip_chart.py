"""Strip charts of a mesh: a grid of nodes walked along and across the geodesic, and a spline.

Per pair the centre line is walked from the start, both ways as far as the stroke swings, and from
each of its nodes the geodesics at a right angle. Between the nodes position and e_v are bicubic;
one closest-point query per sample puts the result onto the mesh.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.spatial.vectors import across, dot, length
from dmpcli.surfaces import geodesic_stepping
from dmpcli.surfaces.strip_grid import Centre, Grid, Nodes, corners, walk_nodes
from dmpcli.surfaces.surface import Status
from dmpcli.surfaces.triangle_mesh import ON_BORDER, TriangleMesh

# Steps across the centre line are no longer than this, mm.
STEP = 6.5
# A strip is at least this wide, so that straight strokes have one too, mm.
LEAST_WIDTH = 1.0
# Where neighbouring cross lines come nearer than this part of their distance at the centre line,
# the chart folds or is about to.
LEAST_STRETCH = 0.1
# Pairs in hand at once: their nodes fit the processor's cache.
PAIRS_AT_ONCE = 64
SAMPLES_AT_ONCE = 4096


@dataclass(frozen=True)
class Samples:
    """Chart coordinates carried to the mesh, for B pairs.

    Attributes
    ----------
    foot, across, normal : array, shape (B, T, 3)
        On the mesh, mm; e_v and n.
    face : array of int, shape (B, T)
    stretch : array, shape (B, T)
        Distance of neighbouring cross lines, by that at the centre line.
    outside : array of bool, shape (B, T)
    status : array of int, shape (B,)
    sharp : array of bool, shape (B,)
        Pairs that must be unfolded; the rest of their row means nothing.
    slivers : array of bool, shape (B,)
        Pairs that are better unfolded: over slivers, and nowhere near a corner with a defect.
    """

    foot: Floats
    across: Floats
    normal: Floats
    face: Integers
    stretch: Floats
    outside: Booleans
    status: Integers
    sharp: Booleans
    slivers: Booleans


@dataclass(frozen=True)
class WalkedStrips:
    """Strips whose nodes were walked before.

    Attributes
    ----------
    rows : array of int, shape (R,)
        Of the pairs.
    grid : Grid
    cross_step : array, shape (R, 1)
        mm.
    nodes : Nodes
    """

    rows: Integers
    grid: Grid
    cross_step: Floats
    nodes: Nodes


def lift(
    mesh: TriangleMesh,
    centre: Centre,
    u: Floats,
    v: Floats,
    walked: Sequence[WalkedStrips] | None = None,
) -> Samples:
    """Carry u, v to the mesh; pairs with grids of one shape go together.

    Parameters
    ----------
    mesh : TriangleMesh
    centre : Centre
        Of B charts.
    u, v : array, shape (B, T)
        mm.
    walked : sequence of WalkedStrips, optional
        Of all pairs, each once, and wide enough for u, v; nothing is walked again then.
    """
    B, T = u.shape
    foot, e_v, normal = (np.empty((B, T, 3)) for _ in range(3))
    face, stretch = np.empty((B, T), dtype=np.int64), np.empty((B, T))
    outside = np.empty((B, T), dtype=bool)
    status, sharp, slivers = np.empty(B, dtype=np.int64), *np.empty((2, B), dtype=bool)
    for some in _alike(mesh, centre, u, v) if walked is None else walked:
        rows = some.rows
        part = _lift_alike(mesh, centre.rows(rows), some, u[rows], v[rows])
        foot[rows], e_v[rows], normal[rows] = part.foot, part.across, part.normal
        outside[rows], status[rows], sharp[rows] = part.outside, part.status, part.sharp
        slivers[rows], face[rows], stretch[rows] = part.slivers, part.face, part.stretch
    return Samples(foot, e_v, normal, face, stretch, outside, status, sharp, slivers)


def _alike(mesh: TriangleMesh, centre: Centre, u: Floats, v: Floats) -> Iterator[WalkedStrips]:
    """Walk the strips of u, v (B, T), those with grids of one shape together."""
    for rows, grid, cross_step in shapes(centre, u, v):
        i = _cell(u[rows] / centre.step[rows] + grid.behind, grid.behind + grid.ahead)
        j = _cell(v[rows] / cross_step + grid.right, grid.right + grid.left)
        cells = np.zeros((len(rows), grid.behind + grid.ahead, grid.right + grid.left), dtype=bool)
        cells[np.arange(len(rows))[:, None], i, j] = True
        nodes = walk_nodes(mesh, centre.rows(rows), grid, cross_step, cells)
        yield WalkedStrips(rows, grid, cross_step, nodes)


def shapes(centre: Centre, u: Floats, v: Floats) -> Iterator[tuple[Integers, Grid, Floats]]:
    """Rows of pairs with grids of one shape, that shape, and their steps across (R, 1), mm.

    Parameters
    ----------
    centre : Centre
        Of B charts.
    u, v : array, shape (B, T)
        mm; of each row only the least and the largest count.

    Yields
    ------
    tuple of array of int (R,), Grid, array (R, 1)
        At most `PAIRS_AT_ONCE` pairs at a time.
    """
    found, cross_step = grids_of(centre, u, v)
    kinds, kind = np.unique(found, axis=0, return_inverse=True)
    for number, shape in enumerate(kinds):
        members = np.flatnonzero(kind.reshape(-1) == number)
        for first in range(0, len(members), PAIRS_AT_ONCE):
            rows = members[first : first + PAIRS_AT_ONCE]
            yield rows, Grid(*shape.tolist()), cross_step[rows]


def widths(v: Floats) -> Floats:
    """How far strips reach on either side for coordinates v (B, T), shape (B, 1), mm."""
    width: Floats = np.maximum(np.abs(v).max(axis=1), LEAST_WIDTH)[:, None]
    return width


def grids_of(centre: Centre, u: Floats, v: Floats) -> tuple[Integers, Floats]:
    """`Grid` of each pair, shape (B, 4), and steps across, shape (B, 1), mm.

    Parameters
    ----------
    centre : Centre
        Tells the steps along.
    u, v : array, shape (B, T)
        mm. Steps across are the longest up to `STEP` of which a whole number makes the width.
    """
    width = widths(v)
    cross_step = width / np.ceil(width / STEP - 1e-6)
    return grids(u / centre.step, v / cross_step), cross_step


def grids(u: Floats, v: Floats) -> Integers:
    """`Grid` of each pair, shape (B, 4), of coordinates (B, T) counted in steps."""

    def nodes(reach: Floats) -> Integers:
        return np.maximum(0, np.ceil(reach - 1e-6)).astype(np.int64)

    behind, ahead = nodes(-u.min(axis=1)), nodes(u.max(axis=1))
    # Five nodes carry the differences.
    ahead = np.maximum(ahead, 4 - behind)
    right, left = nodes(-v.min(axis=1)), nodes(v.max(axis=1))
    left = np.where(right + left == 0, 1, left)
    return np.stack([behind, ahead, right, left], axis=1)


def _lift_alike(
    mesh: TriangleMesh, centre: Centre, strips: WalkedStrips, u: Floats, v: Floats
) -> Samples:
    grid, cross_step, nodes = strips.grid, strips.cross_step, strips.nodes
    along, aside = u / centre.step + grid.behind, v / cross_step + grid.right
    i = _cell(along, grid.behind + grid.ahead)
    j = _cell(aside, grid.right + grid.left)
    pair = np.arange(len(u))[:, None]
    cells = np.zeros((len(u), grid.behind + grid.ahead, grid.right + grid.left), dtype=bool)
    cells[pair, i, j] = True
    if mesh.compiled:
        feet = _feet_compiled(mesh, centre, nodes, along, aside)
    else:
        feet = _feet(mesh, centre, nodes, (i, along - i), (j, aside - j))
    touched = corners(cells)
    status = np.select(
        [
            _any(feet.back) | _any(nodes.back & touched),
            _any(feet.beyond),
            _any(feet.far),
            _any((nodes.stretch < LEAST_STRETCH) & touched),
        ],
        [np.int64(s) for s in (Status.OTHER_SIDE, Status.BORDER, Status.LOST, Status.FOLDED)],
        np.int64(Status.DRAWN),
    )
    sharp = _any(nodes.sharp & touched)
    slivers, stretched = mesh.developable_at(feet.face)
    better = _any(slivers) & ~_any(stretched)
    return Samples(
        feet.foot,
        feet.across,
        feet.normal,
        feet.face,
        feet.stretch,
        feet.beyond | feet.far,
        status,
        sharp,
        better,
    )


@dataclass(frozen=True)
class _Feet:
    """Samples (B, T) on the mesh, as `Samples` says it, and what each met.

    `beyond` the border, `far` from the mesh, or, `back`, on a surface that faces away.
    """

    foot: Floats
    across: Floats
    normal: Floats
    face: Integers
    stretch: Floats
    beyond: Booleans
    far: Booleans
    back: Booleans


def _feet(
    mesh: TriangleMesh,
    centre: Centre,
    nodes: Nodes,
    u: tuple[Integers, Floats],
    v: tuple[Integers, Floats],
) -> _Feet:
    """Carry samples, by cells and shares (B, T), through the patches onto the mesh."""
    (i, r), (j, s) = u, v
    pair = np.arange(len(i))[:, None]
    point, e_v = _bicubic(nodes, pair, i, j, r, s)
    return _feet_of(mesh, centre, nodes, (pair, i, j, r, s), point, e_v)


def _feet_of(
    mesh: TriangleMesh,
    centre: Centre,
    nodes: Nodes,
    cells: tuple[Integers, Integers, Integers, Floats, Floats],
    point: Floats,
    e_v: Floats,
) -> _Feet:
    """Put points (B, T, 3) of pairs' cells onto the mesh."""
    pair, i, j, r, s = cells
    flat = point.reshape(-1, 3)
    found, face = mesh.search(flat)
    own = np.broadcast_to(pair, i.shape).reshape(-1)
    normal = centre.sign[own] * mesh.smooth_normals(found, face)
    normal = normal.reshape(point.shape)
    foot = found.reshape(point.shape)
    elsewhere = mesh.components[face] != centre.part[own]
    beyond = (elsewhere | mesh.beyond_border(flat, found, face)).reshape(i.shape)
    nearest = pair, i + (r > 0.5), j + (s > 0.5)
    back = ~beyond & (dot(normal, nodes.normal[nearest])[..., 0] < 0.0)
    face = face.reshape(i.shape)
    allowed = np.maximum(mesh.reach_at(face), geodesic_stepping.LANDING * nodes.away[pair, i, j])
    far = ~beyond & (length(point - foot)[..., 0] > allowed)
    return _Feet(foot, across(e_v, normal), normal, face, nodes.stretch[nearest], beyond, far, back)


def _feet_compiled(
    mesh: TriangleMesh, centre: Centre, nodes: Nodes, along: Floats, aside: Floats
) -> _Feet:
    """Carry samples (B, T), counted in nodes, through the patches onto the mesh."""
    from dmpcli.surfaces.kernels import samples

    shape = along.shape
    foot, e_v, normal, point, slope = (np.empty((*shape, 3)) for _ in range(5))
    beyond, far, back, doubt = np.empty((4, *shape), dtype=bool)
    feet = _Feet(foot, e_v, normal, np.empty(shape, np.int64), np.empty(shape), beyond, far, back)
    given = (
        mesh.for_kernels.facets,
        samples.StripNodes(nodes.values, nodes.normal, nodes.stretch, nodes.away),
        along,
        aside,
        centre.sign,
        centre.part,
        samples.SampleLimits(ON_BORDER, geodesic_stepping.LANDING),
        samples.SampleFeet(
            foot, e_v, normal, feet.face, feet.stretch, beyond, far, back, doubt, point, slope
        ),
    )
    samples.lift(*given)
    while mesh.made_known(doubt):
        samples.lift(*given)
    pair, k = np.nonzero(doubt)
    if len(pair):
        u, v = along[pair, k, None], aside[pair, k, None]
        i, j = (_cell(u, nodes.values.shape[1] - 1), _cell(v, nodes.values.shape[2] - 1))
        cells = pair[:, None], i, j, u - i, v - j
        some = _feet_of(mesh, centre, nodes, cells, point[pair, k, None], slope[pair, k, None])
        for name in ("foot", "across", "normal", "face", "beyond", "far", "back"):
            getattr(feet, name)[pair, k] = getattr(some, name)[:, 0]
    return feet


def _any(marks: Booleans) -> Booleans:
    """Tell which pairs have a mark, shape (B,)."""
    return np.asarray(marks.reshape(len(marks), -1).any(axis=1))


def _cell(at: Floats, cells: int) -> Integers:
    """Cell of each position, counted in steps from the first node."""
    return np.clip(np.floor(at).astype(np.int64), 0, cells - 1)


def _hermite(s: Floats) -> tuple[Floats, Floats]:
    """Weights (..., 4) of value and slope at 0 and at 1, and their derivatives in s."""
    s2, s3 = s * s, s * s * s
    value = np.stack([1 - 3 * s2 + 2 * s3, s - 2 * s2 + s3, 3 * s2 - 2 * s3, s3 - s2], axis=-1)
    slope = np.stack([6 * (s2 - s), 1 - 4 * s + 3 * s2, 6 * (s - s2), 3 * s2 - 2 * s], axis=-1)
    return value, slope


def _bicubic(
    nodes: Nodes, pair: Integers, i: Integers, j: Integers, r: Floats, s: Floats
) -> tuple[Floats, Floats]:
    """Positions and unnormalised e_v, both (B, T, 3), of cells i, j and shares r, s, all (B, T)."""
    nu, nv = nodes.values.shape[1:3]
    at = ((pair * nu + i) * nv + j).reshape(-1)
    # Two nodes of one centre node's cross line stand beside each other: 24 numbers in one piece,
    # two times (position, v-slope, and the u-slopes of both).
    table = np.lib.stride_tricks.sliding_window_view(nodes.values.reshape(-1), 24)[::12]
    r, s = r.reshape(-1), s.reshape(-1)
    both = np.empty((len(at), 2, 3))
    for first in range(0, len(at), SAMPLES_AT_ONCE):
        part = slice(first, first + SAMPLES_AT_ONCE)
        w, _ = _hermite(r[part])
        near = table[at[part]].reshape(-1, 2, 2, 6)
        far = table[at[part] + nv].reshape(-1, 2, 2, 6)
        near *= w[:, :2].reshape(-1, 1, 2, 1)
        far *= w[:, 2:].reshape(-1, 1, 2, 1)
        near += far
        line = near[:, :, 0] + near[:, :, 1]
        across_weights = np.stack(_hermite(s[part]), axis=1)
        np.matmul(across_weights, line.reshape(-1, 4, 3), out=both[part])
    return both[:, 0].reshape(*i.shape, 3), both[:, 1].reshape(*i.shape, 3)
