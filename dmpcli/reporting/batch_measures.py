"""A batch measured part by part: some numbers of each stroke, and the few strokes to be drawn."""

import os
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from threading import Event

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.errors import InputError
from dmpcli.records import dataset, schemas
from dmpcli.records.columns import taken
from dmpcli.records.dataset import BatchFolder, Piece
from dmpcli.reporting.measurement_context import MeasurementContext
from dmpcli.reporting.report_surface import AT_ONCE
from dmpcli.reporting.stroke import LEAST, ReportedStroke
from dmpcli.reporting.stroke_block import MeasuredBlock, StrokeBlock, gathered
from dmpcli.surfaces.strip_settling import Course

_SAMPLES, _BY_KERNELS = 1 << 16, 1 << 17
"""Samples worked on at once: what is in work stays in the processor's cache."""

_MOST_WORKERS = 4


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
    tasks = (
        partial(course.measured, course.takes(), *some)
        for course, some in _blocks(batch, label, sight, only)
    )
    if threads == 1:
        return (task() for task in tasks)
    return _in_turn(tasks)


def strokes_of_rows(
    batch: BatchFolder, label: str, sight: MeasurementContext, rows: Integers
) -> dict[int, ReportedStroke]:
    """Read some strokes of a batch by row, as they are drawn; see `measured_parts`."""
    found: dict[int, ReportedStroke] = {}
    for _, some in _blocks(batch, label, sight, rows):
        block = _block(*some)
        strokes = block.strokes(range(len(block.rows)))
        found |= dict(zip(block.rows.tolist(), strokes, strict=True))
    return found


_Some = tuple[BatchFolder, Piece, Integers, Floats, str, MeasurementContext, int | None]
"""Strokes of a piece that share their times and the surface of this number; see `StrokeBlock`."""


class _SharedCourse:
    """The course of a part's strokes that share their times: always told by their first block.

    So what is measured does not depend on how many blocks are measured at once.
    """

    def __init__(self) -> None:
        self._course, self._known = Course(), Event()
        self._begun = False

    def takes(self) -> bool:
        """Tell whether a block is the first."""
        first, self._begun = not self._begun, True
        return first

    def measured(self, first: bool, *some: *_Some) -> MeasuredBlock:
        """Measure a block; the first ones are begun first."""
        if not first:
            self._known.wait()
            return _block(*some).measured(self._course)
        try:
            return _block(*some).measured(self._course)
        finally:
            self._course.told = True
            self._known.set()


def _blocks(
    batch: BatchFolder, label: str, sight: MeasurementContext, only: Integers | None
) -> Iterator[tuple[_SharedCourse, _Some]]:
    lying = sight.ground is not None or sight.grounds is not None
    more = (*schemas.NORMAL, *schemas.EULER_ANGLES) if lying else schemas.NORMAL
    # On planes kernels have no charts in hand.
    curved = lying and not (sight.compiled and sight.normal is not None)
    parts = None if only is None else np.unique(batch.part[only]).tolist()

    courses: dict[bytes, _SharedCourse] = {}
    name = None
    for piece in dataset.pieces(batch, more, parts):
        if piece.name != name:
            name, courses = piece.name, {}
        for which, t in _alike(piece):
            if only is not None:
                which = which[np.isin(piece.rows[which], only)]
            course = courses.setdefault(t.tobytes(), _SharedCourse())
            size = max(1, (_BY_KERNELS if sight.compiled else _SAMPLES) // len(t))
            size = min(size, AT_ONCE) if curved else size
            for number, those in _apart(batch, piece, which, sight):
                count = max(1, round(len(those) / size))
                for some in np.array_split(those, count) if len(those) else ():
                    yield course, (batch, piece, some, t, label, sight, number)


def _apart(
    batch: BatchFolder, piece: Piece, which: Integers, sight: MeasurementContext
) -> Iterator[tuple[int | None, Integers]]:
    """Trajectories of a piece by the surface that they lie on, with its number."""
    if sight.grounds is None:
        yield None, which
        return
    on = sight.grounds.of(taken(batch.ids, piece.rows[which]).to_pylist())
    for number in np.unique(on).tolist():
        yield number, which[on == number]


def _block(
    batch: BatchFolder,
    piece: Piece,
    which: Integers,
    t: Floats,
    label: str,
    sight: MeasurementContext,
    ground: int | None,
) -> StrokeBlock:
    own = sight.ground
    if ground is not None:
        assert sight.grounds is not None
        own = sight.grounds.ground(ground)
    return StrokeBlock(batch, piece, which, t, label, sight, own)


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
        times = gathered(t, piece.first[which], n)
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
