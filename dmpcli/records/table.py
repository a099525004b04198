"""A table from elsewhere, as read: columns of numbers or text, whose cells can be shown.

Text stays in Arrow's buffers until somebody asks for numbers: a million rows are then no more than
their bytes, and a bad cell can still be shown as it stands in the file.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.errors import InputError
from dmpcli.records import columns

NUMBER = r"^[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?$"
"""A number in decimal digits, with a point or without."""


@dataclass(frozen=True)
class Table:
    """A table as read: columns of numbers or text, all of one length.

    Attributes
    ----------
    name : str
        What messages call the file.
    columns : mapping
        Arrays of numpy or Arrow, by the file's own names.
    lines : array of int, shape (rows,), optional
        The line of each row in a text file; without it rows are counted from 1.
    decimal : {'.', ','}
        The decimal sign of its text.
    remarks : tuple of str
        What a person should know of how it was read.
    rows : array of int, shape (rows,), optional
        Which rows of the file these are, counted from 0, where they are not all.
    """

    name: str
    columns: Mapping[str, Any]
    lines: Integers | None = None
    decimal: str = "."
    remarks: tuple[str, ...] = ()
    rows: Integers | None = None

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()), ()))

    def at(self, row: int) -> str:
        """Return how a person finds row `row`, counted from 0."""
        if self.lines is not None:
            return f"line {self.lines[row]}"
        return f"row {(row if self.rows is None else self.rows[row]) + 1}"

    def numbers(self, column: str) -> Floats:
        """Return a column as finite numbers, shape (rows,).

        Raises
        ------
        InputError
            The column is missing, or a value is text, empty, NaN or infinite; names the row.
        """
        values = self.floats(column)
        if not columns.all_within(values, columns.LARGEST):
            bad = ~(np.abs(values) <= columns.LARGEST)
            row = int(np.argmax(bad))
            finite = bool(np.isfinite(values[row]))
            raise InputError(
                f"{self.name}: column {column!r}, {self.at(row)}: {self.shown(column, row)} is "
                + (f"beyond {columns.LARGEST:g}" if finite else "not a finite number")
                + "; mend or remove the row"
            )
        return values

    def floats(self, column: str) -> Floats:
        """Return a column as numbers, shape (rows,): NaN where there is text or no value.

        It may be the table's own: copy what is to be changed.

        Raises
        ------
        InputError
            The column is missing.
        """
        if column not in self.columns:
            raise InputError(
                f"{self.name}: column {column!r} is missing; it has {', '.join(self.columns)}"
            )
        values = self.columns[column]
        if isinstance(values, np.ndarray):
            return np.asarray(values, dtype=float)
        return _floats(values, self.decimal)

    def texts(self, column: str) -> list[str]:
        """Return a column as text, numbers as a file shows them."""
        values = self.columns[column]
        if isinstance(values, np.ndarray):
            return [str(value) for value in values]
        return ["" if value is None else str(value) for value in values.to_pylist()]

    def empty(self, column: str) -> Booleans:
        """Tell which cells of a column hold nothing, shape (rows,)."""
        values = self.columns[column]
        if isinstance(values, np.ndarray):
            return np.asarray(np.isnan(values.astype(float)))
        if is_text(values.type):
            import pyarrow.compute as pc

            blank = pc.equal(pc.utf8_trim_whitespace(values), "")
            return np.array([value is not False for value in blank.to_pylist()], dtype=bool)
        # What is no number, such as a span of time, is not nothing for that.
        if pa.types.is_floating(values.type):
            return np.isnan(_floats(values))
        return np.array(values.is_null().to_pylist(), dtype=bool)

    def shown(self, column: str, row: int) -> str:
        """Return a cell as a message shows it."""
        value = self.columns[column][row]
        value = value.as_py() if isinstance(value, pa.Scalar) else value
        return "an empty cell" if value is None or str(value).strip() == "" else repr(str(value))


def is_text(kind: Any) -> bool:
    """Tell an Arrow type of text."""
    return bool(pa.types.is_string(kind) or pa.types.is_large_string(kind))


def _floats(values: Any, decimal: str = ".") -> Floats:
    """Numbers of an Arrow array; NaN where there is none."""
    import pyarrow.compute as pc

    if is_text(values.type):
        text = pc.utf8_trim_whitespace(values)
        if decimal == ",":
            text = pc.replace_substring(text, ",", ".")
        try:
            values = text.cast(pa.float64())
        except pa.ArrowInvalid:
            number = pc.match_substring_regex(text, NUMBER)
            text = pc.if_else(number, pc.utf8_ltrim(text, characters="+"), None)
            values = text.cast(pa.float64())
    elif pa.types.is_boolean(values.type):  # true is not 1 of any unit
        return np.full(len(values), np.nan)
    else:
        try:
            values = values.cast(pa.float64())
        except (pa.ArrowInvalid, pa.ArrowNotImplementedError):
            return np.full(len(values), np.nan)
    # Not by to_numpy: it would import pandas only to ask what this is.
    found = columns.numbers(values)
    found[columns.nulls(values)] = np.nan
    return found


def is_text_array(values: Any) -> bool:
    """Tell an Arrow array of text."""
    return not isinstance(values, np.ndarray) and is_text(values.type)
