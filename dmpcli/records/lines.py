"""Closed lines on a surface, as ``--keep-out`` reads them."""

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import InputError
from dmpcli.records import tables
from dmpcli.records.file_io import Source
from dmpcli.records.schemas import POSITION
from dmpcli.records.untrusted import decoder

_SAME = 1e-6
_LEAST = 3


@decoder
def read(source: Source) -> list[tuple[str, Floats]]:
    """Read a table with ``x y z``, mm, in base axes, and with ``id`` where it has several lines.

    Returns
    -------
    list of (str, array of shape (M, 3))
        What messages call each line, and its points without a last one that repeats the first.

    Raises
    ------
    InputError
        The file cannot be read, lacks a column, holds what is no finite number, or a line of
        fewer than three points; names the line.
    """
    table = tables.read(source)
    points = np.stack([table.numbers(name) for name in POSITION], axis=1)
    names = table.texts("id") if "id" in table.columns else [""] * len(table)
    rows: dict[str, list[int]] = {}
    for row, name in enumerate(names):
        rows.setdefault(name, []).append(row)
    found = []
    for name, of in rows.items():
        line = points[of]
        again = np.linalg.norm(line - np.roll(line, 1, axis=0), axis=1) <= _SAME
        line = line[~again]
        shown = f"{source.name}: line {name!r}" if name else f"{source.name}: the line"
        if len(line) < _LEAST:
            raise InputError(
                f"{shown} has {len(line)} points that differ; a closed line needs {_LEAST} at "
                "least, and several lines tell themselves apart by a column 'id'"
            )
        found.append((shown, line))
    return found
