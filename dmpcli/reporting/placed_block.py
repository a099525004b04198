"""How strokes that share their times lie on the surface of a report, all of them as arrays.

The figures are those of `report_surface.placed`, which looks at strokes one by one and tells more
of each.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.metrics import many_on_surface as measure
from dmpcli.metrics.wave_height import ManyWaves, many_waves
from dmpcli.surfaces.inverse_chart import invert, on_strips
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.plane import Plane
from dmpcli.surfaces.strip_settling import Course
from dmpcli.surfaces.surface import Status, Surface, towards


@dataclass(frozen=True)
class Block:
    """Strokes that share their times.

    Attributes
    ----------
    t : array, shape (n,)
        s.
    position : array, shape (3, k, n)
        mm.
    start, goal : array, shape (k, 3)
        mm.
    side : array, shape (k, 3)
        Towards the tool at the start.
    angles : array, shape (2, k, n), or None
        First two Euler angles of the tool, rad.
    closed : array of bool, shape (k,)
    bound : bool
        Whether they were meant to lie on a surface.
    compiled : bool
        Whether by kernels.
    """

    t: Floats
    position: Floats
    start: Floats
    goal: Floats
    side: Floats
    angles: Floats | None
    closed: Booleans
    bound: bool
    compiled: bool = False

    @cached_property
    def points(self) -> Floats:
        """Positions as points, shape (k, n, 3), mm."""
        return np.ascontiguousarray(self.position.transpose(1, 2, 0))

    @cached_property
    def up(self) -> Floats | None:
        """Along the tool, from its tip upwards, shape (k, n, 3)."""
        return None if self.angles is None else upwards(self.angles)


def upwards(angles: Floats) -> Floats:
    """Along tools from their tips upwards, (..., 3), by their first two Euler angles (2, ...)."""
    rx, ry = angles
    cosine = np.cos(ry)
    # The third column of the rotation, backwards.
    return np.stack([-np.sin(ry), np.sin(rx) * cosine, -np.cos(rx) * cosine], axis=-1)


@dataclass(frozen=True)
class PlacedBlock:
    """How k strokes lie on a surface; NaN where a figure does not exist.

    Attributes
    ----------
    place : array, shape (3, k, n)
        u, v along the surface and the height over it, mm.
    charted : array of bool, shape (k,)
        Strokes all of whose samples have u, v.
    lengths : array, shape (k,)
        Of the geodesics from start to goal, mm.
    waves : ManyWaves
        Along the surface.
    figures : dict of array, shape (k,)
        As `stroke_measures.ON_SURFACE` names them.
    """

    place: Floats
    charted: Booleans
    lengths: Floats
    waves: ManyWaves
    figures: dict[str, Floats]


def placed(
    block: Block,
    surface: Surface,
    taught: measure.TaughtHeights | None,
    taught_length: float,
    course: Course | None = None,
) -> PlacedBlock:
    """Measure how strokes lie on a surface.

    Parameters
    ----------
    block : Block
        Of some dozens of strokes: the charts have as many in hand.
    surface : Surface
    taught : TaughtHeights, optional
        The demonstration as they draw it, if it is an open one with a chart.
    taught_length : float
        Its start-goal distance, mm.
    course : Course, optional
        Of strokes that one skill drew, which kernels find it quicker by.
    """
    if block.compiled and isinstance(surface, Plane):
        return _on_plane(block, surface, taught, taught_length)
    ends = surface.closest(np.stack([block.start, block.goal], axis=1))
    sign = towards(ends.normal[:, 0], block.side)
    foot, normal, where = _closest(block, surface, block.points)
    normal = sign[:, None] * normal
    lengths, uv = _coordinates(
        block, surface, ends.position, sign * ends.normal[:, 0], foot, where, course
    )
    charted: Booleans = np.logical_and.reduce(np.isfinite(uv), axis=(0, 2))
    height, length = _over_feet(block, foot, normal)
    off = np.zeros(height.shape)
    length_change = np.full(len(lengths), np.nan)
    if taught is not None:
        known = np.isfinite(lengths)
        stretch = lengths / taught_length
        meant = _stretched_lengths(block, taught, stretch[known])
        length_change[known] = length[known] / meant - 1.0
        # The original model has no w: it does not know what off the surface means.
        if block.bound and charted.any():
            phase = block.t / block.t[-1]
            off[charted] = taught.at(phase, uv[:, charted], stretch[charted])
    distance = _distances(block, surface, foot, normal, height, off)
    waves = many_waves(
        np.where(charted[:, None], uv[1], 0.0),
        np.where(charted, lengths, 1.0),
        block.closed,
        compiled=block.compiled,
    )
    figures = {
        "wave_height": waves.mean,
        "distance_max": distance.max(axis=1),
        "distance_rms": np.sqrt(np.mean(distance**2, axis=1)),
        "length_change": length_change,
        "start_off": ends.distance[:, 0],
        "goal_off": ends.distance[:, 1],
    }
    figures |= _tilts(block, normal)
    return PlacedBlock(np.concatenate([uv, height[None]]), charted, lengths, waves, figures)


def _on_plane(
    block: Block, surface: Plane, taught: measure.TaughtHeights | None, taught_length: float
) -> PlacedBlock:
    """Measure how strokes lie on a plane, by kernels."""
    from dmpcli.metrics.kernels import lying, strokes

    count, n = block.position.shape[1:]
    ends = surface.closest(np.stack([block.start, block.goal], axis=1))
    sign = towards(ends.normal[:, 0], block.side)
    normal = sign * ends.normal[:, 0]
    with np.errstate(invalid="ignore", divide="ignore"):
        # Where start and goal are one there is no line, and what comes of that is left out.
        charts = surface.charts(ends.position[:, 0], ends.position[:, 1], normal)
    charted = ~block.closed & (charts.status == Status.DRAWN) & np.isfinite(charts.lengths)
    lengths = np.where(charted, charts.lengths, np.nan)
    # Of strokes without a chart u and v come out as no numbers.
    origin = np.where(charted[:, None], charts.origin, np.nan)
    place = strokes.charted(block.position, origin, np.ascontiguousarray(charts.axes))
    uv, height, off = place[:2], place[2], np.zeros((count, n))
    length, most, rms = np.empty((3, count))
    lying.over_plane(block.position, surface.point, surface.normal, sign[:, 0], height, length)
    length_change = np.full(count, np.nan)
    if taught is not None:
        stretch = lengths[charted] / taught_length
        meant = _stretched_lengths(block, taught, stretch)
        length_change[charted] = length[charted] / meant - 1.0
        if block.bound and charted.any():
            phase = block.t / block.t[-1]
            every = bool(charted.all())
            lifts = taught.at(phase, uv if every else uv[:, charted], stretch)
            off = _spread(lifts, charted)
    lying.spreads(height, off, most, rms)
    across = uv[1] if charted.all() else np.where(charted[:, None], uv[1], 0.0)
    waves = many_waves(across, np.where(charted, lengths, 1.0), block.closed, compiled=True)
    figures = {
        "wave_height": waves.mean,
        "distance_max": most,
        "distance_rms": rms,
        "length_change": length_change,
        "start_off": ends.distance[:, 0],
        "goal_off": ends.distance[:, 1],
    }
    return PlacedBlock(place, charted, lengths, waves, figures | _tilts(block, normal[:, None]))


def _closest(
    block: Block, surface: Surface, points: Floats
) -> tuple[Floats, Floats, Integers | None]:
    """Closest points of strokes (k, n, 3), mm, normals there, and facets (k, n) by kernels."""
    if block.compiled and isinstance(surface, Mesh):
        return surface.with_kernels.closest_along(points)
    found = surface.closest(points)
    return found.position, found.normal, None


def _over_feet(block: Block, foot: Floats, normal: Floats) -> tuple[Floats, Floats]:
    """Signed heights (k, n) of strokes over their feet, and lengths (k,) of these, mm."""
    if not block.compiled:
        return measure.heights(block.points, foot, normal), measure.path_lengths(foot)
    from dmpcli.metrics.kernels import lying

    height, length = np.empty(foot.shape[:2]), np.empty(len(foot))
    lying.over_feet(block.points, foot, normal, height, length)
    return height, length


def _stretched_lengths(block: Block, taught: measure.TaughtHeights, stretch: Floats) -> Floats:
    """Lengths (B,) of the demonstration, u stretched by so much (B,), along the surface, mm."""
    if not block.compiled:
        return measure.stretched_lengths(taught.place[:, :2], stretch)
    from dmpcli.metrics.kernels import lying

    return lying.stretched_lengths(taught.place, stretch)


def _tilts(block: Block, normal: Floats) -> dict[str, Floats]:
    """Largest and mean tilt of tools off normals (k, n, 3) or (k, 1, 3), degrees, if they turn."""
    if block.angles is None:
        return {}
    if block.compiled:
        from dmpcli.metrics.kernels import lying

        largest, mean = np.empty((2, len(normal)))
        rx, ry = block.angles
        lying.tilts(rx, ry, np.ascontiguousarray(normal), largest, mean)
    else:
        assert block.up is not None
        tilt = measure.tilts(block.up, normal)
        largest, mean = tilt.max(axis=1), tilt.mean(axis=1)
    return {"tilt_max": np.degrees(largest), "tilt_mean": np.degrees(mean)}


def _spread(values: Floats, which: Booleans) -> Floats:
    """Put rows where they belong among others, which are 0."""
    if which.all():
        return values
    found = np.zeros((len(which), values.shape[1]))
    found[which] = values
    return found


def _coordinates(
    block: Block,
    surface: Surface,
    ends: Floats,
    normal: Floats,
    foot: Floats,
    where: Integers | None,
    course: Course | None,
) -> tuple[Floats, Floats]:
    """Geodesic lengths (k,), mm, and u, v (2, k, n); NaN where there is no chart or it ends."""
    count, n = block.position.shape[1:]
    lengths, uv = np.full(count, np.nan), np.full((2, count, n), np.nan)
    rows = np.flatnonzero(~block.closed)
    if len(rows) == 0:
        return lengths, uv
    # A stroke that knows no surface may be anywhere: the closest points say where it is over.
    position = block.points if block.bound else foot
    if where is not None and isinstance(surface, Mesh):
        # What is not found on smooth strips is searched for, and rounding would tell how that ends:
        # so numpy does it, as for a single stroke.
        by_kernels = surface.with_kernels.charts(ends[rows, 0], ends[rows, 1], normal[rows])
        some = position, foot, where
        if len(rows) < count:
            some = position[rows], foot[rows], where[rows]
        found = on_strips(by_kernels, some[0], course, some[1:])
        whole = found.complete
        lengths[rows[whole]] = by_kernels.lengths[whole]
        uv[:, rows[whole]] = found.coordinates[whole, :, :2].transpose(2, 0, 1)
        rows = rows[~whole]
        if len(rows) == 0:
            return lengths, uv
    charts = surface.charts(ends[rows, 0], ends[rows, 1], normal[rows])
    found = invert(charts, position[rows])
    drawn = charts.status == Status.DRAWN
    lengths[rows[drawn]] = charts.lengths[drawn]
    whole = drawn & found.complete
    uv[:, rows[whole]] = found.coordinates[whole, :, :2].transpose(2, 0, 1)
    return lengths, uv


def _distances(
    block: Block, surface: Surface, foot: Floats, normal: Floats, height: Floats, off: Floats
) -> Floats:
    """Distances (k, n) to the surface once intended heights are taken off; see `on_surface`."""
    lifted = off != 0.0
    if not lifted.any():
        return np.abs(height)
    away = block.points - off[..., None] * normal
    below = foot
    if lifted.all():
        below = _closest(block, surface, away)[0]
    else:
        # Where nothing was meant to be lifted the closest points are known.
        below = foot.copy()
        below[lifted] = surface.closest(away[lifted]).position
    return np.asarray(np.linalg.norm(away - below, axis=-1))
