"""Some strokes of a part that share their times, measured together as arrays."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dmpcli.arrays import AnyArray, Booleans, Floats, Integers
from dmpcli.metrics.motion import motions
from dmpcli.metrics.wave_height import ManyWaves, many_waves
from dmpcli.records import schemas, tolerance_mark
from dmpcli.records.dataset import BatchFolder, Piece
from dmpcli.reporting import placed_block
from dmpcli.reporting import stroke_measures as measured
from dmpcli.reporting.measurement_context import MeasurementContext
from dmpcli.reporting.report_surface import ReportSurface, placed
from dmpcli.reporting.stroke import ReportedStroke
from dmpcli.reporting.strokes import role_of
from dmpcli.spatial import rotations
from dmpcli.surfaces import plane
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.strip_settling import Course

FIGURES = (
    *("wave_height", "wave_spread", "nearest_rms", "nearest_max", "phase_rms", "phase_max"),
    *("length", "duration", "peak_speed", "ldlj", "sparc", "start_error", "goal_error"),
    *(f"surface_{key}" for key in measured.ON_SURFACE),
)
"""Columns of `MeasuredBlock.table`."""


@dataclass(frozen=True)
class MeasuredBlock:
    """Strokes that were measured together.

    Attributes
    ----------
    rows : array of int, shape (k,)
        Of the batch.
    role : str
    table : array, shape (k, len(FIGURES))
        NaN where a figure does not exist.
    t : array, shape (n,)
        s, of all of them.
    waves : ManyWaves
    strokes : callable
        Some of them as they are drawn, by their places.
    """

    rows: Integers
    role: str
    table: Floats
    t: Floats
    waves: ManyWaves
    strokes: Callable[[Sequence[int]], list[ReportedStroke]]


def gathered(column: AnyArray, first: Integers, n: int) -> Floats:
    """Samples of trajectories of n samples each, shape (k, n).

    Parameters
    ----------
    column : array, shape (rows,)
        Of the file.
    first : array of int, shape (k,)
        Where each trajectory begins, rising.
    n : int

    Returns
    -------
    array, shape (k, n)
        A view of the column where the trajectories follow one another.
    """
    begin, end = int(first[0]), int(first[-1]) + n
    if end - begin == len(first) * n:
        return np.asarray(column[begin:end]).reshape(-1, n)
    return np.asarray(column[first[:, None] + np.arange(n)])


class StrokeBlock:
    """Some trajectories of a piece that share their times.

    Parameters
    ----------
    which : array of int, shape (k,)
        Their places in the piece.
    t : array, shape (n,)
        s, from 0.
    ground : ReportSurface, optional
        What they lie on.
    """

    def __init__(
        self,
        batch: BatchFolder,
        piece: Piece,
        which: Integers,
        t: Floats,
        label: str,
        sight: MeasurementContext,
        ground: ReportSurface | None,
    ) -> None:
        self.ground = ground
        self.batch, self.piece, self.t, self.label = batch, piece, t, label
        self.sight = sight.of_drawn(piece.facts)
        self.rows, self.first = piece.rows[which], piece.first[which]
        self.facts = piece.facts
        self.role = role_of(piece.facts)
        self.position = self._stacked(schemas.POSITION)
        ends = batch.start, batch.goal
        self.intended = ends[0] is not None and ends[1] is not None
        self.start = self.position[..., 0].T if ends[0] is None else ends[0][self.rows]
        self.goal = self.position[..., -1].T if ends[1] is None else ends[1][self.rows]
        self.length = np.linalg.norm(self.goal - self.start, axis=1)
        self.closed = self._closed()
        self.known, self.axes = self._axes()
        self.aims = self._aims()

    def _stacked(self, names: Sequence[str]) -> Floats:
        n = len(self.t)
        return np.stack([gathered(self.piece.columns[c], self.first, n) for c in names])

    def _closed(self) -> Booleans:
        if "closed" in self.facts:
            said: Booleans = np.full(len(self.rows), bool(self.facts["closed"]))
        else:
            said = np.array([plane.is_closed(path.T) for path in self.position.swapaxes(0, 1)])
        return np.asarray(said | (self.length == 0.0))

    def _axes(self) -> tuple[Booleans, Floats]:
        """Which strokes have a plane, shape (k,), and its chart axes, shape (k, 3, 3)."""
        count = len(self.rows)
        normal = np.full((count, 3), np.nan)
        if self.batch.normal is not None:
            normal = self.batch.normal[self.rows].copy()
        unknown = ~np.isfinite(normal).all(axis=1)
        if self.facts.get("normal") is not None:
            normal[unknown] = self.facts["normal"]
        elif unknown.any() and self.piece.has(*schemas.NORMAL):
            turning = self._stacked(schemas.NORMAL)
            level = unknown & (np.ptp(turning, axis=2).max(axis=0) < 1e-6)
            normal[level] = turning[:, level, 0].T
        unknown = ~np.isfinite(normal).all(axis=1)
        self.named = normal.copy()
        if self.sight.normal is not None:
            away = ~unknown & (normal @ self.sight.normal < 0.0)
            normal = np.where(away[:, None], -self.sight.normal, self.sight.normal)
            unknown[:] = False
        axes = np.full((count, 3, 3), np.nan)
        if unknown.any() and not self.piece.has(*schemas.NORMAL):
            for i in np.flatnonzero(unknown):
                axes[i] = plane.stroke_axes(self.position[:, i].T)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        line = ~unknown & ~self.closed
        e_u = (self.goal[line] - self.start[line]) / self.length[line, None]
        axes[line] = plane.open_axes(e_u, normal[line])
        for i in np.flatnonzero(~unknown & self.closed):
            axes[i] = plane.closed_axes(normal[i])
        return np.isfinite(axes[:, 0, 0]), axes

    def measured(self, course: Course | None = None) -> MeasuredBlock:
        """Measure the strokes, which may have a course in common on curved surfaces."""
        table = np.full((len(self.rows), len(FIGURES)), np.nan)
        column = {name: table[:, i] for i, name in enumerate(FIGURES)}
        compiled, every = self.sight.compiled, bool(self.known.all())
        if compiled:
            from dmpcli.metrics.kernels.strokes import charted

            place = charted(self.position, self.start, self.axes)
        else:
            gap = self.position - self.start.T[:, :, None]
            place = np.einsum("bji,jbn->ibn", self.axes, gap)
        moved = motions(self.t, self.position, *self.aims, compiled)
        for name in ("length", "peak_speed", "ldlj", "sparc"):
            column[name][:] = getattr(moved, name)
        if self.intended:
            column["start_error"][:] = moved.start_error
            column["goal_error"][:] = moved.goal_error
        column["duration"][:] = self.t[-1]
        flat = place[1] if every else np.where(self.known[:, None], place[1], 0.0)
        waves = many_waves(flat, self.length, self.closed, compiled=compiled)
        column["wave_height"][:], column["wave_spread"][:] = waves.mean, waves.spread
        charts = place if every else place[:, self.known]
        self._compare(column, self.known, charts, self._stretch())
        if self.ground is None:
            return MeasuredBlock(self.rows, self.role, table, self.t, waves, self.strokes)
        at = self.sight.reference
        length = 1.0 if at is None else at.length
        lies = placed_block.placed(
            self._as_block(), self.ground.surface, self.sight.heights, length, course
        )
        for key, values in lies.figures.items():
            column[f"surface_{key}"][:] = values
        # Without a plane waves are measured, and strokes compared, along the surface.
        along = ~self.known | self._curved()
        if along.any():
            waves = _chosen_waves(waves, lies.waves, along)
            column["wave_height"][:], column["wave_spread"][:] = waves.mean, waves.spread
            self._compare_along(column, lies, along)
        return MeasuredBlock(self.rows, self.role, table, self.t, waves, self.strokes)

    def _curved(self) -> bool:
        """Whether no plane of theirs counts, see `report_surface.placed`."""
        assert self.ground is not None
        return self.ground.curved and bool(self.facts.get("model") != "original")

    def strokes(self, places: Sequence[int]) -> list[ReportedStroke]:
        """Return some of the strokes as they are drawn."""
        found = [self._stroke(i) for i in places]
        ground = self.ground
        if ground is None:
            return found
        if self.sight.compiled and isinstance(ground.surface, Mesh):
            # They are looked at: what figures are told of them stands in the table.
            ground = replace(ground, surface=ground.surface.with_kernels)
        return placed(found, ground, self.sight.reference)

    def _as_block(self) -> placed_block.Block:
        """Return what is measured of them on a surface."""
        count = len(self.rows)
        angles = None
        if self.piece.has(*schemas.EULER_ANGLES):
            angles = self._stacked(schemas.EULER_ANGLES[:2])
        side = np.full((count, 3), np.nan)
        if self.batch.normal is not None:
            side = self.batch.normal[self.rows].copy()
        unknown = ~np.isfinite(side).all(axis=1)
        if self.facts.get("normal") is not None:
            side[unknown] = self.facts["normal"]
        elif unknown.any() and self.piece.has(*schemas.NORMAL):
            side[unknown] = self._stacked(schemas.NORMAL)[:, unknown, 0].T
        elif unknown.any() and angles is not None:
            side[unknown] = placed_block.upwards(angles[:, unknown, 0])
        else:
            side[unknown] = [0.0, 0.0, 1.0]
        return placed_block.Block(
            self.t,
            self.position,
            self.start,
            self.goal,
            side,
            angles,
            self.closed,
            self.facts.get("model") != "original",
            self.sight.compiled,
        )

    def _aims(self) -> tuple[Floats, Floats]:
        """Points where the strokes should begin and end, shape (k, 3) each, mm."""
        heights = self.facts.get("end_heights")
        if heights is None:
            return self.start, self.goal
        # As the file has it: whatever plane the report was given is not what they were drawn on.
        up = np.repeat(self.named[:, None], 2, axis=1)
        if self.piece.has(*schemas.NORMAL):
            turning = self._stacked(schemas.NORMAL)[..., [0, -1]].transpose(1, 2, 0)
            up = np.where(np.isfinite(turning), turning, up)
        return self.start + heights[0] * up[:, 0], self.goal + heights[1] * up[:, 1]

    def _stretch(self) -> Floats:
        """Start-goal distances of the strokes with a plane over the demonstration's."""
        at = self.sight.reference
        if at is None or at.closed:
            return np.ones(int(self.known.sum()))
        return np.asarray(np.where(self.closed, 1.0, self.length / at.length)[self.known])

    def _compare(
        self, column: dict[str, Floats], which: Booleans, place: Floats, stretch: Floats
    ) -> None:
        """Fill in how far some of the strokes lie from the demonstration."""
        taught = self.sight.taught
        if taught is None or not which.any():
            return
        found = taught.deviations(self.t, place, stretch)
        assert self.sight.reference is not None
        rms, largest = self.sight.reference.lost
        column["nearest_rms"][which] = np.hypot(found.nearest_rms, rms)
        column["nearest_max"][which] = np.maximum(found.nearest_max, largest)
        column["phase_rms"][which] = found.phase_rms
        column["phase_max"][which] = found.phase_max

    def _compare_along(
        self, column: dict[str, Floats], lies: placed_block.PlacedBlock, along: Booleans
    ) -> None:
        """Compare some strokes with the demonstration along the surface, if they have a chart."""
        at = self.sight.reference
        if at is None:
            return
        for name in ("nearest_rms", "nearest_max", "phase_rms", "phase_max"):
            column[name][along] = np.nan
        if at.closed:
            return
        charted = lies.charted & along
        stretch = lies.lengths[charted] / at.length
        self._compare(column, charted, lies.place[:, charted], stretch)

    def _stroke(self, i: int) -> ReportedStroke:
        """Return one of the strokes as it is drawn."""
        row, position = int(self.rows[i]), self.position[:, i].T.copy()
        n = len(self.t)
        columns = self.piece.columns
        at = slice(int(self.first[i]), int(self.first[i]) + n)
        rotation = None
        if self.piece.has(*schemas.EULER_ANGLES):
            angles = np.column_stack([columns[c][at] for c in schemas.EULER_ANGLES])
            rotation = rotations.from_euler(angles)
        side = None
        if self.batch.normal is not None and np.isfinite(self.batch.normal[row]).all():
            side = self.batch.normal[row]
        elif self.facts.get("normal") is not None:
            side = np.asarray(self.facts["normal"], dtype=float)
        elif self.piece.has(*schemas.NORMAL):
            side = np.array([columns[c][at.start] for c in schemas.NORMAL])
        elif rotation is not None:
            side = -rotation[0, :, 2]
        aims = np.stack([ends[i] for ends in self.aims])
        heights = self.facts.get("end_heights", (0.0, 0.0))
        return ReportedStroke(
            f"{self.label}[{self.batch.ids[row].as_py()}]",
            schemas.TRAJECTORY.name,
            self.role,
            self.t,
            position,
            position,
            self.start[i],
            self.goal[i],
            self.axes[i] if self.known[i] else None,
            bool(self.closed[i]),
            self.intended,
            bool(self.facts.get("simulated", False)),
            rotation=rotation,
            side=side,
            bound=self.facts.get("model") != "original",
            lesson=self.sight.drawn.lesson,
            end_heights=(heights[0], heights[1]),
            aims=aims if np.isfinite(aims).all() else None,
            over=self.sight.drawn.over,
            size=self.sight.drawn.size,
            turn=self.sight.drawn.turn,
            mark=tolerance_mark.of_facts(self.facts),
        )


def _chosen_waves(first: ManyWaves, second: ManyWaves, which: Booleans) -> ManyWaves:
    """Return the waves of the second where `which` (B,) says so, else those of the first."""
    own = ~which[first.stroke], which[second.stroke]
    stroke, index, value = (
        np.concatenate([a[own[0]], b[own[1]]])
        for a, b in (
            (first.stroke, second.stroke),
            (first.index, second.index),
            (first.value, second.value),
        )
    )
    order = np.argsort(stroke, kind="stable")
    return ManyWaves(first.count, stroke[order], index[order], value[order])
