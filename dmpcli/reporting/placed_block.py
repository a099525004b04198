"""How strokes that share their times lie on the surface of a report, all of them as arrays.

The figures are those of `report_surface.placed`, which looks at strokes one by one and tells more
of each.
"""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Booleans, Floats
from dmpcli.metrics import many_on_surface as measure
from dmpcli.metrics.wave_height import ManyWaves, many_waves
from dmpcli.surfaces.inverse_chart import invert
from dmpcli.surfaces.surface import Status, Surface, towards


@dataclass(frozen=True)
class Block:
    """Strokes that share their times.

    Attributes
    ----------
    t : array, shape (n,)
        s.
    position : array, shape (k, n, 3)
        mm.
    start, goal : array, shape (k, 3)
        mm.
    side : array, shape (k, 3)
        Towards the tool at the start.
    up : array, shape (k, n, 3), or None
        Along the tool, from its tip upwards.
    closed : array of bool, shape (k,)
    bound : bool
        Whether they were meant to lie on a surface.
    """

    t: Floats
    position: Floats
    start: Floats
    goal: Floats
    side: Floats
    up: Floats | None
    closed: Booleans
    bound: bool


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
    block: Block, surface: Surface, taught: measure.TaughtHeights | None, taught_length: float
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
    """
    ends = surface.closest(np.stack([block.start, block.goal], axis=1))
    sign = towards(ends.normal[:, 0], block.side)
    hits = surface.closest(block.position)
    normal = sign[:, None] * hits.normal
    lengths, uv = _coordinates(
        block, surface, ends.position, sign * ends.normal[:, 0], hits.position
    )
    charted: Booleans = np.logical_and.reduce(np.isfinite(uv), axis=(0, 2))
    height = measure.heights(block.position, hits.position, normal)
    off = np.zeros(height.shape)
    length_change = np.full(len(lengths), np.nan)
    if taught is not None:
        known = np.isfinite(lengths)
        stretch = lengths / taught_length
        meant = measure.stretched_lengths(taught.place[:, :2], stretch[known])
        length_change[known] = measure.path_lengths(hits.position[known]) / meant - 1.0
        # The original model has no w: it does not know what off the surface means.
        if block.bound and charted.any():
            phase = block.t / block.t[-1]
            off[charted] = taught.at(phase, uv[:, charted], stretch[charted])
    distance = _distances(block.position, surface, hits.position, normal, off)
    waves = many_waves(
        np.where(charted[:, None], uv[1], 0.0), np.where(charted, lengths, 1.0), block.closed
    )
    figures = {
        "wave_height": waves.mean,
        "distance_max": distance.max(axis=1),
        "distance_rms": np.sqrt(np.mean(distance**2, axis=1)),
        "length_change": length_change,
        "start_off": ends.distance[:, 0],
        "goal_off": ends.distance[:, 1],
    }
    if block.up is not None:
        tilt = measure.tilts(block.up, normal)
        figures["tilt_max"] = np.degrees(tilt.max(axis=1))
        figures["tilt_mean"] = np.degrees(tilt.mean(axis=1))
    return PlacedBlock(np.concatenate([uv, height[None]]), charted, lengths, waves, figures)


def _coordinates(
    block: Block, surface: Surface, ends: Floats, normal: Floats, foot: Floats
) -> tuple[Floats, Floats]:
    """Geodesic lengths (k,), mm, and u, v (2, k, n); NaN where there is no chart or it ends."""
    count, n = block.position.shape[:2]
    lengths, uv = np.full(count, np.nan), np.full((2, count, n), np.nan)
    rows = np.flatnonzero(~block.closed)
    if len(rows) == 0:
        return lengths, uv
    charts = surface.charts(ends[rows, 0], ends[rows, 1], normal[rows])
    # A stroke that knows no surface may be anywhere: the closest points say where it is over.
    found = invert(charts, (block.position if block.bound else foot)[rows])
    drawn = charts.status == Status.DRAWN
    lengths[rows[drawn]] = charts.lengths[drawn]
    whole = drawn & found.complete
    uv[:, rows[whole]] = found.coordinates[whole, :, :2].transpose(2, 0, 1)
    return lengths, uv


def _distances(
    position: Floats, surface: Surface, foot: Floats, normal: Floats, off: Floats
) -> Floats:
    """Distances (k, n) to the surface once intended heights are taken off; see `on_surface`."""
    away = position - off[..., None] * normal
    below = foot
    lifted = off != 0.0
    if lifted.any():
        # Where nothing was meant to be lifted the closest points are known.
        below = foot.copy()
        below[lifted] = surface.closest(away[lifted]).position
    return np.asarray(np.linalg.norm(away - below, axis=-1))
