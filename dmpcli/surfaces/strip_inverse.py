"""Strip charts of a mesh inverted on their own nodes, without a look at the mesh at each step.

The foot of a position is found first: the point of the mesh whose smooth normal leads to it. Then u
and v are sought until the spline through the strip's nodes stands over the foot, along the normal
of the foot's facet: a few Newton steps of all samples at once, on nodes that are walked once. The
nodes are those that `strip_chart.lift` walks for the coordinates that were found, so they are
walked again, at most `PASSES` times, until these no longer change.

Which u, v a foot has on an edge: closest points of all that stands over a convex edge lie on it, so
that several u, v lead to one foot there. The one over the facet that the search names is taken. The
others lie beside it by no more than the spline's height over the mesh times the angle at the edge,
and every one of them leads to the position. Where the spline runs under a convex edge, or over a
concave one, none leads to points of the edge; such strokes are left to `tangential`, which comes as
near as it can.
"""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.spatial.vectors import cross, dot, length, unit
from dmpcli.surfaces import strip_settling
from dmpcli.surfaces.mesh_charts import MeshCharts
from dmpcli.surfaces.strip_pieces import strips
from dmpcli.surfaces.strip_settling import FAR, PASSES, Course
from dmpcli.surfaces.surface import Status
from dmpcli.surfaces.tangential import SETTLED

HIGHEST = 0.5
"""Positions farther off the mesh are left to `tangential`, mm: their normals spread."""

_FEET = 6
# Where coordinates change by less than this the nodes need not be walked again, mm: a change of
# 1e-4 mm would leave an error of up to 1e-7 mm. The last pass may leave the second.
_SAME_NODES = (1e-9, 1e-4)
# How near a foot must come, mm.
_ON_FOOT = 1e-8


@dataclass(frozen=True)
class Found:
    """Coordinates of strokes that were found whole.

    Attributes
    ----------
    rows : array of int, shape (R,)
        Of the charts.
    coordinates : array, shape (R, T, 3)
        u, v, w, mm.
    axes : array, shape (R, T, 3, 3)
        As `Charts.lift` gives them there.
    miss : array, shape (R, T)
        Distance of what `Charts.lift` makes of the coordinates to the positions, mm.
    """

    rows: Integers
    coordinates: Floats
    axes: Floats
    miss: Floats

    def rows_of(self, which: Booleans) -> "Found":
        """Return some of them."""
        if which.all():
            return self
        return Found(self.rows[which], self.coordinates[which], self.axes[which], self.miss[which])


Nearest = tuple[Floats, Integers]
"""Closest points (B, T, 3) and their facets (B, T), as `TriangleMesh.closest_along` has them."""


def found(
    charts: MeshCharts,
    position: Floats,
    course: Course | None = None,
    nearest: Nearest | None = None,
) -> Found:
    """Find chart coordinates of strokes on the mesh or next to it; only of those found whole.

    Parameters
    ----------
    charts : MeshCharts
    position : array, shape (B, T, 3)
        mm.
    course : Course, optional
        Of strokes that one skill drew: kernels spare walks by it, and what they find of a stroke
        hangs on those that told it by rounding (1e-9 mm).
    nearest : arrays, optional
        Of the positions, where they are known: for kernels.
    """
    open_ = charts.lengths > 0.0
    rows = np.flatnonzero(open_ & ~charts.creased & (charts.status == Status.DRAWN))
    if len(rows) < len(position):
        charts, position = charts.rows(rows), position[rows]
        if nearest is not None:
            nearest = nearest[0][rows], nearest[1][rows]
    foot, facet, height = _feet(charts, position, nearest)
    near = (np.abs(height).max(axis=1) <= HIGHEST) & np.isfinite(foot).all(axis=(1, 2))
    if not near.all():
        rows, foot, facet, height = rows[near], foot[near], facet[near], height[near]
        charts, position = charts.rows(np.flatnonzero(near)), position[near]
    walked = None
    if charts.mesh.compiled:
        at, good, walked = strip_settling.settled(
            charts, foot, facet, _along_chord(charts, foot), course
        )
    else:
        at = _guessed(charts, foot)
        good = _settled(charts, at, foot, facet)
    if not good.all():
        rows, height, at = rows[good], height[good], at[good]
        charts, position = charts.rows(np.flatnonzero(good)), position[good]
    coordinates = np.concatenate([at, height[..., None]], axis=-1)
    if len(rows) == 0:
        shape = 0, position.shape[1]
        return Found(rows, coordinates, np.zeros((*shape, 3, 3)), np.zeros(shape))
    lift = charts.lift(coordinates, walked)
    miss = np.empty(position.shape[:2])
    if charts.mesh.compiled:
        from dmpcli.surfaces.kernels import inverse

        inverse.missed(position, lift.position, lift.axes, coordinates, miss)
    else:
        gap = np.einsum("btj,btjk->btk", position - lift.position, lift.axes)
        coordinates[..., 2] += gap[..., 2]
        np.hypot(gap[..., 0], gap[..., 1], out=miss)
    whole = ((miss <= SETTLED) & ~lift.outside).all(axis=1)
    whole &= (lift.status == Status.DRAWN) & ~lift.unfolded
    return Found(rows, coordinates, lift.axes, miss).rows_of(whole)


def _feet(
    charts: MeshCharts, position: Floats, nearest: Nearest | None = None
) -> tuple[Floats, Floats, Floats]:
    """Feet (R, T, 3) by the smooth normal, normals of their facets, and heights (R, T), mm."""
    if not charts.mesh.compiled:
        return _feet_sought(charts, position)
    from dmpcli.surfaces.kernels import inverse

    foot, facet = np.empty((2, *position.shape))
    height, doubt = np.empty(position.shape[:2]), np.empty(position.shape[:2], dtype=bool)
    limits = inverse.FootLimits(_FEET, _ON_FOOT)
    position = np.ascontiguousarray(position)
    sign = charts.centre.sign
    if nearest is None:
        at, _, where = charts.mesh.closest_along(position)
        nearest = at, where
    facets = charts.mesh.facets
    inverse.feet(facets, position, nearest, sign, limits, foot, facet, height, doubt)
    row, sample = np.nonzero(doubt)
    if len(row):
        some = _feet_sought(charts.rows(row), position[row, sample, None])
        for values, sought in zip((foot, facet, height), some, strict=True):
            values[row, sample] = sought[:, 0]
    return foot, facet, height


def _feet_sought(charts: MeshCharts, position: Floats) -> tuple[Floats, Floats, Floats]:
    mesh, shape = charts.mesh, position.shape
    sign = np.repeat(charts.centre.sign, shape[1], axis=0)
    given = position.reshape(-1, 3)
    foot, face = mesh.search_without_kernels(given)
    height = np.zeros(len(given))
    left = np.arange(len(given))
    for step in range(_FEET):
        normal = sign[left] * mesh.smooth_normals(foot[left], face[left])
        height[left] = dot(given[left] - foot[left], normal)[:, 0]
        below = given[left] - height[left, None] * normal
        off = length(below - foot[left])[:, 0] > _ON_FOOT
        left, below = left[off], below[off]
        if len(left) == 0:
            break
        if step == _FEET - 1:
            foot[left] = np.nan
            break
        foot[left], face[left] = mesh.search_without_kernels(below)
    facet = mesh.face_normals[face]
    return foot.reshape(shape), facet.reshape(shape), height.reshape(shape[:2])


def _guessed(charts: MeshCharts, foot: Floats) -> Floats:
    """Guesses (R, T, 2) beside the nearest nodes of the centre lines, in their axes, mm."""
    at = np.zeros((*foot.shape[:2], 2))
    ends = np.stack(_along_chord(charts, foot), axis=1)
    nodes = np.stack([ends, 0.0 * ends], axis=-1)
    for some, strip in strips(charts, nodes, along=True):
        line = strip.nodes.values[:, :, strip.zero[1]]
        normal = strip.nodes.normal[:, :, strip.zero[1]]
        step = strip.step[:, 0, 0]
        for k, i in enumerate(some.tolist()):
            gap = foot[i, :, None] - line[k, :, :3]
            node = np.argmin(np.einsum("tni,tni->tn", gap, gap), axis=1)
            gap = gap[np.arange(len(node)), node]
            e_v = unit(line[k, node, 3:6])
            at[i, :, 0] = (node - strip.zero[0]) * step[k]
            at[i, :, 0] += dot(gap, cross(e_v, normal[k, node]))[:, 0]
            at[i, :, 1] = dot(gap, e_v)[:, 0]
    return at


def _along_chord(charts: MeshCharts, foot: Floats) -> tuple[Floats, Floats]:
    """From which to which u, (R,) each, strokes lie beside their centre lines by their chords, mm.

    At least from start to goal, at most as far again beyond either.
    """
    chord = charts.target - charts.centre.origin
    e_u = unit(chord)[:, None]
    u = dot(foot - charts.centre.origin[:, None], e_u)[..., 0]
    least, most = np.minimum(u.min(axis=1), 0.0), np.maximum(u.max(axis=1), charts.lengths)
    return np.maximum(least, -charts.lengths), np.minimum(most, 2.0 * charts.lengths)


def _settled(charts: MeshCharts, at: Floats, foot: Floats, facet: Floats) -> Booleans:
    """Move coordinates (R, T, 2) over their feet; which strokes came to rest, shape (R,)."""
    good = np.zeros(len(at), dtype=bool)
    left = np.arange(len(at))
    for number in range(PASSES):
        if len(left) == 0:
            break
        before = at[left].copy()
        still = np.zeros(len(left), dtype=bool)
        for some, strip in strips(charts.rows(left), before):
            rows = left[some]
            at[rows], still[some] = strip.moved(foot[rows], facet[rows], rough=number == 0)
        change = np.abs(at[left] - before).max(axis=(1, 2))
        sane = np.isfinite(change) & (np.abs(at[left]).max(axis=(1, 2)) < FAR)
        done = still & (change < _SAME_NODES[number == PASSES - 1])
        good[left[done]] = True
        left = left[~done & sane]
    return good
