"""Touched points: where the tool's tip met a part, and where on the part that was, if known."""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Booleans, Floats
from dmpcli.errors import InputError
from dmpcli.records import tables
from dmpcli.records.columns import LARGEST
from dmpcli.records.file_io import Source
from dmpcli.records.schemas import EULER_ANGLES, POSITION
from dmpcli.records.table import Table
from dmpcli.records.untrusted import decoder
from dmpcli.spatial import rotations

PART = ("px", "py", "pz")
APPROACH = ("ax", "ay", "az")
"""Direction in which the tip came to the point, base axes, of any length."""


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
    approach : array, shape (n, 3), or None
        Unit directions in which the tip came to the points, base frame: those of ``ax ay az``,
        else the tool's axis by ``rx ry rz``; NaN where the file does not say, None where it nowhere
        does.
    """

    table: Table
    base: Floats
    part: Floats
    approach: Floats | None = None

    @property
    def paired(self) -> Booleans:
        """Rows whose point of the part is known, shape (n,)."""
        return ~np.isnan(self.part[:, 0])


@decoder
def read(source: Source) -> Touched:
    """Read a table with ``x y z`` and, where they are known, ``px py pz`` and ``ax ay az``.

    Raises
    ------
    InputError
        The file cannot be read, lacks a column, or holds what is no finite number; names the line.
    """
    table = tables.read(source)
    base = np.stack([table.numbers(name) for name in POSITION], axis=1)
    part, approach = _three(table, PART, "a point of the part"), _approach(table)
    return Touched(table, base, np.full_like(base, np.nan) if part is None else part, approach)


def _approach(table: Table) -> Floats | None:
    said = _three(table, APPROACH, "a direction of approach")
    if said is None:
        if not all(name in table.columns for name in EULER_ANGLES):
            return None
        angles = np.stack([table.floats(name) for name in EULER_ANGLES], axis=1)
        known = np.asarray((np.abs(angles) <= LARGEST).all(axis=1))
        return rotations.from_euler(np.where(known[:, None], angles, np.nan))[..., 2]
    length = np.linalg.norm(said, axis=1, keepdims=True)
    if (length == 0.0).any():
        row = int(np.flatnonzero(length[:, 0] == 0.0)[0])
        raise InputError(
            f"{table.name}: columns {', '.join(APPROACH)}, {table.at(row)}: a direction has a "
            "length; leave the three cells empty where it is not known"
        )
    return np.asarray(said / length)


def _three(table: Table, names: tuple[str, ...], what: str) -> Floats | None:
    """Three columns, shape (n, 3), NaN where all three cells are empty; None without them."""
    present = [name in table.columns for name in names]
    if not any(present):
        return None
    if not all(present):
        raise InputError(
            f"{table.name}: column {names[present.index(False)]!r} is missing; {what} "
            f"needs all of {', '.join(names)}"
        )
    values = np.stack([table.floats(name) for name in names], axis=1)
    empty = np.stack([table.empty(name) for name in names], axis=1)
    bad = ~(np.abs(values) <= LARGEST) & ~np.asarray(empty.all(axis=1))[:, None]
    if bad.any():
        row, column = (int(i) for i in np.argwhere(bad)[0])
        raise InputError(
            f"{table.name}: column {names[column]!r}, {table.at(row)}: "
            f"{table.shown(names[column], row)} is not a finite number; fill in {what}, or leave "
            "all three cells empty"
        )
    return values
