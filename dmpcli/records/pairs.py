"""Start-goal pairs from CSV or Parquet: every row is kept, bad ones with what is wrong."""

import re
from dataclasses import dataclass, field

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.dmp.rollout import Pairs
from dmpcli.errors import InputError
from dmpcli.records import pair_places, schemas, tables
from dmpcli.records.columns import FARTHEST, LARGEST
from dmpcli.records.file_io import Source
from dmpcli.records.pair_places import PairPlaces
from dmpcli.records.schemas import OK
from dmpcli.records.table import Table
from dmpcli.records.untrusted import decoder
from dmpcli.spatial import rotations

START = ("x0", "y0", "z0")
GOAL = schemas.GOAL
START_ANGLES = ("rx0", "ry0", "rz0")
GOAL_ANGLES = ("rxg", "ryg", "rzg")

_CONTROL = re.compile(r"[\x00-\x1f\x7f]")

LARGEST_ANGLE = 1e3
"""Angles beyond this, rad, are a mistake."""

KNOWN = ("id", *START, *GOAL, *START_ANGLES, *GOAL_ANGLES, "duration", *pair_places.COLUMNS)
"""Columns that are read."""

_NUMBERS = (*START, *GOAL, *START_ANGLES, *GOAL_ANGLES, "duration", "offset")


@dataclass(frozen=True)
class PairTable:
    """A table of pairs as read.

    Attributes
    ----------
    name : str
    ids : array of str, shape (B,)
        Of the ``id`` column, else the row numbers from 1.
    pairs : Pairs
        B pairs; rows whose status is not ``ok`` hold NaN or what they held.
    lines : array of int, shape (B,), optional
        Where each row stands in a text file; without it rows are counted from 1.
    duration : array, shape (B,)
        s; NaN where the table does not say.
    status : array of str, shape (B,)
        ``ok``, or what is wrong with the row, with its place in the file.
    places : PairPlaces, optional
        Where the table itself says on which surface each pair lies.
    unknown : list of str
        Columns that nobody reads.
    remarks : tuple of str
        What a person should know of how it was read.
    rows : array of int, shape (B,), optional
        Which rows of the whole table these are, counted from 0 and rising, where they are not all.
    """

    name: str
    ids: list[str]
    pairs: Pairs
    lines: Integers | None
    duration: Floats
    status: list[str]
    places: PairPlaces | None = None
    unknown: list[str] = field(default_factory=list)
    rows: Integers | None = None
    remarks: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.ids)

    def place(self, row: int) -> str:
        """Return how a person finds row `row`, counted from 0."""
        if self.lines is not None:
            return f"line {self.lines[row]}"
        return f"row {self.numbers[row] + 1}"

    @property
    def numbers(self) -> Integers:
        """Which rows of the whole table these are, counted from 0, shape (B,)."""
        return np.arange(len(self)) if self.rows is None else self.rows

    @property
    def good(self) -> Booleans:
        """Rows whose status is ``ok``, shape (B,)."""
        if self.status.count(OK) == len(self):  # several times faster, and the usual case
            return np.ones(len(self), dtype=bool)
        return np.array([status == OK for status in self.status], dtype=bool)


@decoder
def read(source: Source) -> PairTable:
    """Read a table with the columns ``x0 y0 z0 xg yg zg`` and what else it has.

    Optional are ``id``, ``duration`` (s), the orientations ``rx0 ry0 rz0``, ``rxg ryg rzg``
    (X-Y-Z Euler angles, rad), and where each pair lies, see `pair_places`.

    Raises
    ------
    InputError
        The file cannot be read, holds no rows, lacks a column, or two rows have one id.
    """
    return decoded(tables.read(source, decimal=None, numeric=_NUMBERS))


def decoded(table: Table) -> PairTable:
    """Return a table, or a piece of one, as pairs; see `read`.

    Raises
    ------
    InputError
        As `read`.
    """
    table = tables.without_blank_rows(table)
    status = [OK] * len(table)
    start, goal = _three(table, START, status), _three(table, GOAL, status)
    duration = np.full(len(table), np.nan)
    if "duration" in table.columns:
        duration = table.floats("duration")
        bad = ~table.empty("duration") & ~(np.isfinite(duration) & (duration > 0))
        _mark(table, status, bad, "duration", "is not a positive time in s")
    # A table of pairs that a batch ended with has more of its own, which mean no harm here.
    known = (*KNOWN, *schemas.PAIRS.columns, *pair_places.POSE_CELLS)
    return PairTable(
        table.name,
        _ids(table),
        Pairs(
            start,
            goal,
            _rotations(table, START_ANGLES, status),
            _rotations(table, GOAL_ANGLES, status),
        ),
        table.lines,
        duration,
        status,
        pair_places.read(table, status),
        [name for name in table.columns if name not in known],
        table.rows,
        table.remarks,
    )


def _three(table: Table, names: tuple[str, ...], status: list[str]) -> Floats:
    return np.stack([_column(table, name, status) for name in names], axis=1)


def _column(table: Table, name: str, status: list[str]) -> Floats:
    values = table.floats(name)
    _mark(table, status, ~np.isfinite(values), name, "is not a finite number")
    largest = LARGEST_ANGLE if name.startswith("r") else FARTHEST
    beyond = np.isfinite(values) & (np.abs(values) > largest)
    _mark(table, status, beyond, name, f"is beyond {largest:g}; check its unit")
    return np.where(np.abs(values) <= LARGEST, values, np.nan)


def _mark(table: Table, status: list[str], bad: Booleans, name: str, what: str) -> None:
    for row in np.flatnonzero(bad):
        if status[row] == OK:
            shown = table.shown(name, int(row))
            status[row] = f"{table.at(int(row))}, column {name!r}: {shown} {what}"


def _rotations(table: Table, names: tuple[str, ...], status: list[str]) -> Floats | None:
    present = [name in table.columns for name in names]
    if not any(present):
        return None
    if not all(present):
        missing = names[present.index(False)]
        raise InputError(
            f"{table.name}: column {missing!r} is missing; an orientation needs all of "
            f"{', '.join(names)}"
        )
    return rotations.from_euler(_three(table, names, status))


def _ids(table: Table) -> list[str]:
    if "id" not in table.columns:
        numbers = np.arange(len(table)) if table.rows is None else table.rows
        return [str(number) for number in (numbers + 1).tolist()]
    ids = table.texts("id")
    odd = next((row for row, name in enumerate(ids) if _CONTROL.search(name)), None)
    if odd is not None:
        raise InputError(
            f"{table.name}: column 'id', {table.at(odd)}: {ids[odd]!r} holds a control character; "
            "rename it"
        )
    if len(set(ids)) == len(ids):
        return ids
    seen: dict[str, int] = {}
    for row, name in enumerate(ids):
        if name in seen and not name:
            raise InputError(
                f"{table.name}: column 'id', {table.at(row)}: is empty, and so is "
                f"{table.at(seen[name])}; give each pair an id, or leave the column out"
            )
        if name in seen:
            raise InputError(
                f"{table.name}: column 'id', {table.at(row)}: {name!r} is also in "
                f"{table.at(seen[name])}; ids must differ"
            )
        seen[name] = row
    return ids
