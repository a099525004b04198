"""A batch measured part by part: some numbers of each stroke, and the few strokes to be drawn."""

import os
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
import pyarrow as pa

from dmpcli.arrays import AnyArray, Booleans, Floats, Integers
from dmpcli.dmp.contact_heights import ContactHeights
from dmpcli.errors import InputError
from dmpcli.metrics.deviation import Taught
from dmpcli.metrics.many_on_surface import TaughtHeights
from dmpcli.metrics.motion import motions
from dmpcli.metrics.wave_height import ManyWaves, many_waves
from dmpcli.records import dataset, schemas, tolerance_mark
from dmpcli.records import learning_record as lessons
from dmpcli.records.dataset import BatchFolder, Piece
from dmpcli.records.learning_record import Lesson
from dmpcli.reporting import placed_block
from dmpcli.reporting import stroke_measures as measured
from dmpcli.reporting.report_surface import AT_ONCE, Grounds, ReportSurface, placed
from dmpcli.reporting.stroke import LEAST, ReportedStroke, as_drawn
from dmpcli.reporting.strokes import over_of, role_of
from dmpcli.spatial import rotations
from dmpcli.surfaces import plane

FIGURES = (
    *("wave_height", "wave_spread", "nearest_rms", "nearest_max", "phase_rms", "phase_max"),
    *("length", "duration", "peak_speed", "ldlj", "sparc", "start_error", "goal_error"),
    *(f"surface_{key}" for key in measured.ON_SURFACE),
)
"""Columns of `Measured.table`."""

_SAMPLES = 1 << 16
"""Samples worked on at once: what is in work stays in the processor's cache."""

_MOST_WORKERS = 4


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
    stroke : callable
        One of them as it is drawn, by its place.
    """

    rows: Integers
    role: str
    table: Floats
    t: Floats
    waves: ManyWaves
    stroke: Callable[[int], ReportedStroke]


@dataclass(frozen=True)
class Drawn:
    """How a skill saw its recordings, and what it changed where it drew; see `ReportedStroke`."""

    lesson: Lesson | None = None
    over: ContactHeights | None = None
    size: float = 1.0
    turn: float = 0.0


_AS_TAUGHT = Drawn()


@dataclass(frozen=True)
class MeasurementContext:
    """What strokes are measured against.

    Attributes
    ----------
    reference : ReportedStroke, optional
        The demonstration.
    ground : ReportSurface, optional
        The surface of the report.
    normal : array, shape (3,), optional
        Of a surface that is a plane.
    drawn : Drawn
        By which skill the demonstration is seen.
    grounds : Grounds, optional
        The surfaces of batches, where each stroke has its own.
    """

    reference: ReportedStroke | None = None
    ground: ReportSurface | None = None
    normal: Floats | None = None
    drawn: Drawn = _AS_TAUGHT
    grounds: Grounds | None = None
    _others: dict[Drawn, "MeasurementContext"] = field(
        default_factory=dict, compare=False, repr=False
    )

    def of_drawn(self, facts: Mapping[str, Any]) -> "MeasurementContext":
        """Return it as seen by the skill that drew a part, whose facts these are."""
        size, turn = float(facts.get("size", 1.0)), float(facts.get("turn", 0.0))
        drawn = Drawn(lessons.of_facts(facts), over_of(facts), size, turn)
        if drawn == self.drawn or self.reference is None:
            return self
        if drawn not in self._others:
            at = self.reference
            if at.seen_by is not None and drawn.lesson is not None:
                at = at.seen_by(drawn.lesson)
            self._others[drawn] = replace(self, reference=at, drawn=drawn, _others={})
        return self._others[drawn]

    @cached_property
    def taught(self) -> Taught | None:
        """The demonstration in its own chart, as it was to be drawn."""
        at = self.reference
        if at is None or at.chart is None or at.elsewhere:
            return None
        d = self.drawn
        return Taught(at.t, as_drawn(at.chart, d.over, d.size, d.turn))

    @cached_property
    def heights(self) -> TaughtHeights | None:
        """Heights of the demonstration over a surface, as they were to be drawn."""
        at = self.reference
        if at is None or at.chart is None or at.closed or at.elsewhere:
            return None
        phase = (at.t - at.t[0]) / (at.t[-1] - at.t[0])
        return TaughtHeights(phase, as_drawn(np.asarray(at.chart), self.drawn.over))


def measured_parts(
    batch: BatchFolder,
    label: str,
    sight: MeasurementContext,
    only: Integers | None = None,
    threads: int | None = None,
) -> Iterator[MeasuredBlock]:
    """Measure the strokes of a batch, in an order that follows its parts.

    Parameters
    ----------
    batch : BatchFolder
    label : str
        What to call it.
    sight : MeasurementContext
    only : array of int, optional
        Only these rows of the batch.
    threads : int, optional
        By default one to a core, up to four.

    Raises
    ------
    InputError
        A part is damaged, is not the batch's, or holds a stroke that cannot be measured.
    """
    lying = sight.ground is not None or sight.grounds is not None
    more = (*schemas.NORMAL, *schemas.EULER_ANGLES) if lying else schemas.NORMAL
    parts = None if only is None else np.unique(batch.part[only]).tolist()

    def tasks() -> Iterator[Callable[[], MeasuredBlock]]:
        for piece in dataset.pieces(batch, more, parts):
            for which, t in _alike(piece):
                if only is not None:
                    which = which[np.isin(piece.rows[which], only)]
                size = max(1, _SAMPLES // len(t))
                size = min(size, AT_ONCE) if lying else size
                for number, those in _apart(batch, piece, which, sight):
                    for first in range(0, len(those), size):
                        some = those[first : first + size]
                        yield partial(_measured, batch, piece, some, t, label, sight, number)

    if threads == 1:
        return (task() for task in tasks())
    return _in_turn(tasks())


def _apart(
    batch: BatchFolder, piece: Piece, which: Integers, sight: MeasurementContext
) -> Iterator[tuple[int | None, Integers]]:
    """Trajectories of a piece by the surface that they lie on, with its number."""
    if sight.grounds is None:
        yield None, which
        return
    on = sight.grounds.of(batch.ids.take(pa.array(piece.rows[which])).to_pylist())
    for number in np.unique(on).tolist():
        yield number, which[on == number]


def _measured(
    batch: BatchFolder,
    piece: Piece,
    which: Integers,
    t: Floats,
    label: str,
    sight: MeasurementContext,
    ground: int | None,
) -> MeasuredBlock:
    own = sight.ground
    if ground is not None:
        assert sight.grounds is not None
        own = sight.grounds.ground(ground)
    return _Block(batch, piece, which, t, label, sight, own).measured()


def _in_turn(tasks: Iterator[Callable[[], MeasuredBlock]]) -> Iterator[MeasuredBlock]:
    """Do tasks on several cores, few at a time; what they give comes in their order."""
    workers = min(os.cpu_count() or 1, _MOST_WORKERS)
    with ThreadPoolExecutor(workers) as pool:
        begun: deque[Future[MeasuredBlock]] = deque()
        try:
            for task in tasks:
                begun.append(pool.submit(task))
                if len(begun) > 2 * workers:
                    yield begun.popleft().result()
            while begun:
                yield begun.popleft().result()
        finally:
            for future in begun:
                future.cancel()


def _alike(piece: Piece) -> Iterator[tuple[Integers, Floats]]:
    """Trajectories that share their times, by their places in the piece, and the times."""
    t = piece.columns["t"]
    counts = np.diff(piece.first)
    for n in np.unique(counts).tolist():
        which = np.flatnonzero(counts == n)
        if n < LEAST:
            raise InputError(
                f"{piece.name}: a stroke of {n} samples cannot be measured; {LEAST} are needed"
            )
        times = _gathered(t, piece.first[which], n)
        back = np.flatnonzero(~(times[:, 1:] > times[:, :-1]).all(axis=1))
        if len(back):
            one = times[back[0]]
            row = int(piece.first[which[back[0]]] + np.argmax(one[1:] <= one[:-1])) + 2
            raise InputError(
                f"{piece.name}: column 't', row {row}: time does not increase; sort the rows"
            )
        if (times == times[0]).all():
            yield which, times[0] - times[0, 0]
            continue
        groups: dict[bytes, list[int]] = {}
        for i, one in enumerate(times):
            groups.setdefault(one.tobytes(), []).append(i)
        for some in groups.values():
            yield which[some], times[some[0]] - times[some[0], 0]


def _gathered(column: AnyArray, first: Integers, n: int) -> Floats:
    """Samples of trajectories of n samples each, shape (k, n)."""
    begin, end = int(first[0]), int(first[-1]) + n
    if end - begin == len(first) * n:
        return np.asarray(column[begin:end]).reshape(-1, n)
    return np.asarray(column[first[:, None] + np.arange(n)])


class _Block:
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
        self.position = self._three(schemas.POSITION)
        ends = batch.start, batch.goal
        self.intended = ends[0] is not None and ends[1] is not None
        self.start = self.position[..., 0].T if ends[0] is None else ends[0][self.rows]
        self.goal = self.position[..., -1].T if ends[1] is None else ends[1][self.rows]
        self.length = np.linalg.norm(self.goal - self.start, axis=1)
        self.closed = self._closed()
        self.known, self.axes = self._axes()
        self.aims = self._aims()

    def _three(self, names: Sequence[str]) -> Floats:
        n = len(self.t)
        return np.stack([_gathered(self.piece.columns[c], self.first, n) for c in names])

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
            turning = self._three(schemas.NORMAL)
            level = unknown & (np.ptp(turning, axis=2).max(axis=0) < 1e-6)
            normal[level] = turning[:, level, 0].T
        unknown = ~np.isfinite(normal).all(axis=1)
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

    def measured(self) -> MeasuredBlock:
        """Measure the strokes."""
        table = np.full((len(self.rows), len(FIGURES)), np.nan)
        column = {name: table[:, i] for i, name in enumerate(FIGURES)}
        gap = self.position - self.start.T[:, :, None]
        place = np.einsum("bji,jbn->ibn", self.axes, gap)
        moved = motions(self.t, self.position, *self.aims)
        for name in ("length", "peak_speed", "ldlj", "sparc"):
            column[name][:] = getattr(moved, name)
        if self.intended:
            column["start_error"][:] = moved.start_error
            column["goal_error"][:] = moved.goal_error
        column["duration"][:] = self.t[-1]
        flat = np.where(self.known[:, None], place[1], 0.0)
        waves = many_waves(flat, self.length, self.closed)
        column["wave_height"][:], column["wave_spread"][:] = waves.mean, waves.spread
        self._compare(column, self.known, place[:, self.known], self._stretch())
        if self.ground is None:
            return MeasuredBlock(self.rows, self.role, table, self.t, waves, self._stroke)
        at = self.sight.reference
        length = 1.0 if at is None else at.length
        lies = placed_block.placed(
            self._as_block(), self.ground.surface, self.sight.heights, length
        )
        for key, values in lies.figures.items():
            column[f"surface_{key}"][:] = values
        # Without a plane waves are measured, and strokes compared, along the surface.
        along = ~self.known | self._curved()
        if along.any():
            waves = _chosen_waves(waves, lies.waves, along)
            column["wave_height"][:], column["wave_spread"][:] = waves.mean, waves.spread
            self._compare_along(column, lies, along)
        return MeasuredBlock(self.rows, self.role, table, self.t, waves, self._placed_stroke)

    def _curved(self) -> bool:
        """Whether no plane of theirs counts, see `report_surface.placed`."""
        assert self.ground is not None
        return self.ground.curved and bool(self.facts.get("model") != "original")

    def _placed_stroke(self, i: int) -> ReportedStroke:
        assert self.ground is not None
        return placed([self._stroke(i)], self.ground, self.sight.reference)[0]

    def _as_block(self) -> placed_block.Block:
        """Return what is measured of them on a surface."""
        count = len(self.rows)
        up = None
        if self.piece.has(*schemas.EULER_ANGLES):
            rx, ry, _ = self._three(schemas.EULER_ANGLES)
            cosine = np.cos(ry)
            # The third column of the rotation, backwards.
            up = np.stack([-np.sin(ry), np.sin(rx) * cosine, -np.cos(rx) * cosine], axis=-1)
        side = np.full((count, 3), np.nan)
        if self.batch.normal is not None:
            side = self.batch.normal[self.rows].copy()
        unknown = ~np.isfinite(side).all(axis=1)
        if self.facts.get("normal") is not None:
            side[unknown] = self.facts["normal"]
        elif unknown.any() and self.piece.has(*schemas.NORMAL):
            side[unknown] = self._three(schemas.NORMAL)[:, unknown, 0].T
        elif up is not None:
            side[unknown] = up[unknown, 0]
        else:
            side[unknown] = [0.0, 0.0, 1.0]
        return placed_block.Block(
            self.t,
            np.ascontiguousarray(self.position.transpose(1, 2, 0)),
            self.start,
            self.goal,
            side,
            up,
            self.closed,
            self.facts.get("model") != "original",
        )

    def _aims(self) -> tuple[Floats, Floats]:
        """Points where the strokes should begin and end, shape (k, 3) each, mm."""
        heights = self.facts.get("end_heights")
        if heights is None:
            return self.start, self.goal
        up = np.repeat(self.axes[:, None, :, 2], 2, axis=1)
        if self.piece.has(*schemas.NORMAL):
            turning = self._three(schemas.NORMAL)[..., [0, -1]].transpose(1, 2, 0)
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
