"""Which decimal sign the numbers of a table have: their own cells tell it, or it is refused.

A comma between digits is a decimal sign where some number has one and none has a point; that is
remarked. It parts thousands in tables of other countries: 1,234 may be either. Where each number
with a comma looks so, and cells are parted by commas too or other numbers go without one, nobody
can tell; what draws at a thousandth of the place is not guessed.
"""

from collections.abc import Collection, Iterator
from dataclasses import replace
from typing import Any

import pyarrow.compute as pc

from dmpcli.errors import InputError
from dmpcli.records.table import Table, is_text_array

REMARK = "commas between digits read as decimal signs"

_COMMA = r"^\s*[-+]?[0-9]*,[0-9]+([eE][-+]?[0-9]+)?\s*$"
_POINT = r"^\s*[-+]?[0-9,]*\.[0-9]+([eE][-+]?[0-9]+)?\s*$"
_THOUSANDS = r"^\s*[-+]?[1-9][0-9]{0,2}(,[0-9]{3})+\s*$"
_WHOLE = r"^\s*[-+]?[0-9]+\s*$"


def judged(table: Table, numeric: Collection[str], parted_by_commas: bool = False) -> Table:
    """Return a table of which text is to be read with points, with the sign that it has.

    Parameters
    ----------
    table : Table
        Whole: a piece of a file cannot tell, for the others may have points, and all are to be
        read alike.
    numeric : collection of str
        Columns whose cells decide; those that the table lacks, or that are no text, are passed
        over, and so are cells that are no numbers.
    parted_by_commas : bool
        Whether its cells are.

    Raises
    ------
    InputError
        Commas may be decimal signs or part thousands.
    """
    cells = {name: table.columns[name] for name in numeric if name in table.columns}
    cells = {name: values for name, values in cells.items() if is_text_array(values)}

    def count(pattern: str) -> int:
        return sum(_count(found) for found in _matches(cells.values(), pattern))

    commas = count(_COMMA)
    if not commas or count(_POINT):
        return table
    if count(_THOUSANDS) >= commas and (parted_by_commas or count(_WHOLE)):
        raise InputError(_doubt(table, cells))
    return replace(table, decimal=",", remarks=(*table.remarks, REMARK))


def _matches(cells: Collection[Any], pattern: str) -> Iterator[Any]:
    return (pc.match_substring_regex(values, pattern) for values in cells)


def _count(found: Any) -> int:
    return int(pc.sum(found).as_py() or 0)


def _doubt(table: Table, cells: dict[str, Any]) -> str:
    for name, found in zip(cells, _matches(cells.values(), _THOUSANDS), strict=True):
        if _count(found):
            row = found.to_pylist().index(True)
            shown = table.columns[name][row].as_py().strip()
            return (
                f"{table.name}: column {name!r}, {table.at(row)}: {shown!r} may be "
                f"{shown.replace(',', '.', 1)} or {shown.replace(',', '')}; write the numbers of "
                "the table without commas"
            )
    raise AssertionError("a number with a comma was counted")
