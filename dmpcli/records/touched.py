"""Touched points: where the tool's tip met a part, and where on the part that was, if known."""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Booleans, Floats
from dmpcli.errors import InputError
from dmpcli.records import tables
from dmpcli.records.schemas import POSITION
from dmpcli.records.streams import Source
from dmpcli.records.tables import Table

PART = ("px", "py", "pz")


@dataclass(frozen=True)
class Touched:
    """Touched points.

    Attributes
    ----------
    table : Table
        Says where a row stands in the file.
    base : array, shape (n, 3)
        Base frame, mm.
    part : array, shape (n, 3)
        The same points in the part's frame, in the file's unit; NaN where the file does not say.
    """

    table: Table
    base: Floats
    part: Floats

    @property
    def paired(self) -> Booleans:
        """Rows whose point of the part is known, shape (n,)."""
        return ~np.isnan(self.part[:, 0])


def read(source: Source) -> Touched:
    """Read a table with ``x y z`` and, where points of the part are known, ``px py pz``.

    Raises
    ------
    InputError
        The file cannot be read, lacks a column, or holds what is no finite number; names the line.
    """
    table = tables.read(source)
    base = np.stack([table.numbers(name) for name in POSITION], axis=1)
    present = [name in table.columns for name in PART]
    if not any(present):
        return Touched(table, base, np.full_like(base, np.nan))
    if not all(present):
        raise InputError(
            f"{source.name}: column {PART[present.index(False)]!r} is missing; a point of the part "
            f"needs all of {', '.join(PART)}"
        )
    part = np.stack([table.floats(name) for name in PART], axis=1)
    empty = np.stack([table.empty(name) for name in PART], axis=1)
    bad = ~np.isfinite(part) & ~np.asarray(empty.all(axis=1))[:, None]
    if bad.any():
        row, column = (int(i) for i in np.argwhere(bad)[0])
        raise InputError(
            f"{source.name}: column {PART[column]!r}, {table.at(row)}: "
            f"{table.shown(PART[column], row)} is not a finite number; fill in the point of the "
            "part, or leave all three cells empty"
        )
    return Touched(table, base, part)
