"""What a report says of a batch: distributions, the worst strokes by name, why pairs failed.

Nothing here grows with the batch: what every stroke says on its own goes into CSV files as it is
measured, and the figures that are told of all together wait in a file; one is held at a time.
"""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TextIO

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.messages import Advance
from dmpcli.metrics import paper_values
from dmpcli.records.columns import taken
from dmpcli.records.dataset import BatchFolder, facts_of, part_of, states_of
from dmpcli.reporting.batch_measures import measured_parts, strokes_of_rows
from dmpcli.reporting.figure_store import FigureStore
from dmpcli.reporting.measurement_context import MeasurementContext
from dmpcli.reporting.stroke import ReportedStroke
from dmpcli.reporting.stroke_block import FIGURES, MeasuredBlock
from dmpcli.reporting.stroke_measures import Row, distribution

WORST = 5
"""Strokes named for each figure."""

MOST_DRAWN = 200
"""Strokes of a batch that are kept for the figures of all strokes: an even choice."""

ALIKE = 1e-6
"""Where figures differ by no more than this none is the worst, mm or degrees."""

BINS = 60

RANKED = (
    *("wave_height", "nearest_max", "start_error", "goal_error"),
    *("surface_distance_max", "surface_tilt_max"),
)
"""Figures whose worst strokes are named: the wave height farthest from the demonstration's (from
the median where there is none), and of the others the largest."""

HISTOGRAMS = (
    *("wave_height", "wave_spread", "nearest_rms", "nearest_max", "phase_rms"),
    *("start_error", "goal_error", "length", "duration", "ldlj", "sparc"),
    *("surface_distance_max", "surface_tilt_max", "surface_length_change"),
)

STROKES = ["file", "id", "part", *FIGURES]
"""Header of the CSV file with a row per stroke."""


@dataclass(frozen=True)
class Tables:
    """Open text files that the strokes' own numbers go to; `strokes` those of batches."""

    waves: TextIO
    strokes: TextIO | None


@dataclass
class MeasuredBatch:
    """A batch as measured.

    Attributes
    ----------
    batch : BatchFolder
    label : str
    sight : MeasurementContext
    figures : FigureStore
        Of all strokes; NaN where one does not exist.
    shown : list of ReportedStroke
        An even choice, and what lies at the places of the paper.
    """

    batch: BatchFolder
    label: str
    sight: MeasurementContext
    figures: FigureStore
    shown: list[ReportedStroke] = field(default_factory=list)

    def values(self, name: str) -> Floats:
        """Return the values of one figure, shape (B,), NaN where there is none."""
        return self.figures.column(name)

    @property
    def target(self) -> float | None:
        """Wave height of the demonstration, mm."""
        return self.sight.reference.wave.mean if self.sight.reference else None

    def entry(self) -> Row:
        """Return what the report's document says of it."""
        states, failures = states_of(self.batch)
        return {
            "count": len(self.batch),
            "statistics": {name: distribution(_known(self.values(name))) for name in FIGURES},
            "histograms": {name: histogram(_known(self.values(name))) for name in HISTOGRAMS},
            "worst": {name: self.worst(name) for name in RANKED},
            "states": states,
            "failures": failures,
        } | ({"kernels": "compiled"} if self.sight.compiled else {})

    @property
    def table(self) -> Floats:
        """All figures at once, shape (B, len(FIGURES))."""
        return np.column_stack([self.values(name) for name in FIGURES])

    def worst(self, name: str) -> list[Row]:
        """Return the worst strokes by one figure, the very worst first."""
        values = self.values(name)
        return [
            {
                "id": self.batch.ids[row].as_py(),
                "part": self.batch.files[int(self.batch.part[row])],
                "value": float(values[row]),
            }
            for row in self.worst_rows(name)
        ]

    def worst_rows(self, name: str) -> list[int]:
        """Rows with the worst values of one figure, the very worst first; none if all are alike."""
        values = self.values(name)
        known = np.flatnonzero(np.isfinite(values))
        if not len(known):
            return []
        off = values[known]
        if name == "wave_height":
            usual = np.median(off) if self.target is None else self.target
            off = np.abs(off - usual)
        if np.ptp(off) <= ALIKE:
            return []
        # Equal ones in the order of the table.
        return [int(row) for row in known[np.argsort(-off, kind="stable")[:WORST]]]

    def strokes(self, rows: Sequence[int]) -> list[ReportedStroke]:
        """Read some strokes once more, as they are drawn."""
        found = strokes_of_rows(self.batch, self.label, self.sight, np.array(rows))
        return [found[row] for row in rows]


@dataclass(frozen=True)
class MeasuredStrokes:
    """What is kept of some strokes: it goes from process to process.

    Attributes
    ----------
    rows : array of int, shape (k,)
        Of the batch.
    table : array, shape (k, len(FIGURES))
    shown : dict of ReportedStroke
        Those that are drawn, by row.
    waves, strokes : str
        Lines of both CSV files.
    """

    rows: Integers
    table: Floats
    shown: dict[int, ReportedStroke]
    waves: str
    strokes: str


@dataclass(frozen=True)
class Measurement:
    """How the strokes of a batch are measured, the same for all of its parts.

    Attributes
    ----------
    label : str
        What to call the batch.
    sight : MeasurementContext
        What to measure against.
    told : bool
        Whether each stroke's own numbers are wanted as lines of CSV.
    """

    label: str
    sight: MeasurementContext
    told: bool

    def here(self, batch: BatchFolder, chosen: Integers) -> Iterator[MeasuredStrokes]:
        """Measure a batch in this process, of which `chosen` rows are drawn, on several threads."""
        for some in measured_parts(batch, self.label, self.sight):
            yield self._kept(some, batch, chosen)

    def part(self, batch: BatchFolder, chosen: Integers) -> MeasuredStrokes:
        """Measure one part, as `part_of` gives it, on this thread."""
        found = [
            self._kept(some, batch, chosen)
            for some in measured_parts(batch, self.label, self.sight, threads=1)
        ]
        shown: dict[int, ReportedStroke] = {}
        for some in found:
            shown |= some.shown
        return MeasuredStrokes(
            np.concatenate([some.rows for some in found]),
            np.concatenate([some.table for some in found]),
            shown,
            "".join(some.waves for some in found),
            "".join(some.strokes for some in found),
        )

    def _kept(self, some: MeasuredBlock, batch: BatchFolder, chosen: Integers) -> MeasuredStrokes:
        drawn = np.flatnonzero(np.isin(some.rows, chosen)).tolist()
        shown = dict(zip(some.rows[drawn].tolist(), some.strokes(drawn), strict=True))
        if not self.told:
            return MeasuredStrokes(some.rows, some.table, shown, "", "")
        ids = taken(batch.ids, some.rows).to_pylist()
        compiled = self.sight.compiled
        waves = _wave_rows(some, self.label, ids, compiled)
        strokes = _stroke_rows(some, self.label, ids, batch, compiled)
        return MeasuredStrokes(some.rows, some.table, shown, waves, strokes)

    def apart(self, batch: BatchFolder) -> "Measurement":
        """Return it so that it can go to another process: the skill's view of the recording alone.

        All parts of a batch are drawn by one skill.
        """
        sight = self.sight.of_drawn(facts_of(batch))
        if sight.reference is not None:
            sight = replace(sight, reference=replace(sight.reference, seen_by=None))
        return replace(self, sight=sight)


Measure = Callable[
    [Measurement, BatchFolder, Iterator[tuple[BatchFolder, Integers]]], Iterator[MeasuredStrokes]
]
"""Measures parts in other processes, and gives what they found back in their order."""


def measure(
    batch: BatchFolder,
    label: str,
    sight: MeasurementContext,
    tables: Tables | None,
    advance: Advance,
    elsewhere: Measure | None = None,
) -> MeasuredBatch:
    """Measure all strokes of a batch.

    Parameters
    ----------
    batch : BatchFolder
    label : str
        What to call it.
    sight : MeasurementContext
        What to measure against.
    tables : Tables, optional
        Files for the numbers of every stroke.
    advance : Advance
        Told how many strokes are done.
    elsewhere : callable, optional
        Measures parts in other processes; what is found does not depend on it.

    Raises
    ------
    InputError
        A part is damaged or not the batch's; by name.
    """
    many = MeasuredBatch(batch, label, sight, FigureStore(len(batch), FIGURES))
    chosen = _chosen(batch)
    how = Measurement(label, sight, tables is not None)
    if elsewhere is None or len(batch.files) < 2:
        found = how.here(batch, chosen)
    else:
        found = _by_parts(batch, chosen, how, elsewhere)
    shown: dict[int, ReportedStroke] = {}
    for some in found:
        many.figures.put(some.rows, some.table)
        shown |= some.shown
        if tables is not None:
            tables.waves.write(some.waves)
            assert tables.strokes is not None
            tables.strokes.write(some.strokes)
        advance(len(some.rows))
    many.shown = [shown[row] for row in sorted(shown)]
    return many


def _by_parts(
    batch: BatchFolder, chosen: Integers, how: Measurement, elsewhere: Measure
) -> Iterator[MeasuredStrokes]:
    """Measure parts in other processes: each gets its own rows of the table alone."""
    own = batch.rows_of_parts()
    tasks = (
        (part_of(batch, part, rows), np.flatnonzero(np.isin(rows, chosen)))
        for part, rows in enumerate(own)
    )
    for rows, found in zip(own, elsewhere(how.apart(batch), batch, tasks), strict=True):
        shown = {int(rows[i]): stroke for i, stroke in found.shown.items()}
        yield replace(found, rows=rows[found.rows], shown=shown)


def _chosen(batch: BatchFolder) -> Integers:
    """Rows of an even choice of strokes, and of those at the paper's places."""
    step = max(1, -(-len(batch) // MOST_DRAWN))
    rows = [np.arange(0, len(batch), step)]
    if batch.start is not None and batch.goal is not None:
        for experiment in paper_values.EXPERIMENTS:
            off = np.linalg.norm(batch.start - experiment.start, axis=1)
            off = np.maximum(off, np.linalg.norm(batch.goal - experiment.goal, axis=1))
            rows.append(np.flatnonzero(off <= paper_values.TOLERANCE)[:MOST_DRAWN])
    return np.unique(np.concatenate(rows))


def _known(values: Floats) -> Floats:
    return values[np.isfinite(values)]


def histogram(
    values: Floats, low: float | None = None, high: float | None = None, bins: int = BINS
) -> Row | None:
    """Counts of values in bins of equal width, over their own range; None without values.

    Parameters
    ----------
    values : array, shape (k,)
        Finite, in any unit.
    low, high : float, optional
        Of the bins, instead of the values' own; what lies beyond is not counted.
    bins : int

    Returns
    -------
    dict or None
        ``edges``, bins + 1 of them in the unit of the values, and ``counts``.
    """
    if not len(values):
        return None
    low = float(values.min()) if low is None else low
    high = float(values.max()) if high is None else high
    least = 1e-6 * max(1.0, abs(low), abs(high))
    if high - low < least:
        middle = 0.5 * (low + high)
        # Distances are not negative, nor are the bins that they fall into.
        low = middle - 0.5 * least if low < 0.0 else max(0.0, middle - 0.5 * least)
        high = low + least
    counts, edges = np.histogram(values, bins, (low, high))
    return {"edges": edges.tolist(), "counts": counts.tolist()}


def _wave_rows(some: MeasuredBlock, label: str, ids: Sequence[str], compiled: bool) -> str:
    """Every wave height, as in `document.write_waves`."""
    waves = some.waves
    ends = waves.ends
    stroke = waves.stroke[ends]
    t = np.interp(waves.index, np.arange(len(some.t)), some.t)
    number = np.arange(len(ends)) - np.searchsorted(stroke, stroke) + 1
    numbers = np.column_stack(
        [waves.heights, t[ends - 1], t[ends], waves.value[ends - 1], waves.value[ends]]
    )
    names = _cells([f"{label}[{name}]" for name in ids])
    heads = [
        f"{names[i]},{some.role},{k}" for i, k in zip(stroke.tolist(), number.tolist(), strict=True)
    ]
    return _lines(heads, numbers, compiled)


def _stroke_rows(
    some: MeasuredBlock, label: str, ids: Sequence[str], batch: BatchFolder, compiled: bool
) -> str:
    """The figures of every stroke; nothing where there is none."""
    first = _cell(label)
    files = [_cell(file) for file in batch.files]
    part = batch.part[some.rows].tolist()
    cells = zip(_cells(ids), part, strict=True)
    return _lines([f"{first},{name},{files[file]}" for name, file in cells], some.table, compiled)


def _lines(heads: Sequence[str], numbers: Floats, compiled: bool) -> str:
    """Rows of a CSV file: heads, and numbers (k, c) after them, nothing where there is none."""
    if compiled:
        from dmpcli.reporting import decimals

        text = decimals.rows(heads, numbers)
        if text is not None:
            return text
    known = np.isfinite(numbers)
    # Strokes that are measured together mostly have the same figures.
    forms: dict[bytes, str] = {}
    lines = []
    for head, which, values in zip(heads, known, numbers.tolist(), strict=True):
        kind = which.tobytes()
        if kind not in forms:
            forms[kind] = "%s" + "".join(",%.6f" if one else ",%.0s" for one in which) + "\n"
        lines.append(forms[kind] % (head, *values))
    return "".join(lines)


_QUOTED = re.compile('[,"\r\n]')


def _cells(texts: Sequence[str]) -> Sequence[str]:
    """Return texts as cells of a CSV file."""
    # Hardly any needs quotes: seen at once.
    return [_cell(text) for text in texts] if _QUOTED.search("".join(texts)) else texts


def _cell(text: str) -> str:
    """Return a text as a cell of a CSV file."""
    if _QUOTED.search(text):
        return '"' + text.replace('"', '""') + '"'
    return text
