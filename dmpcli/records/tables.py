"""Tables from elsewhere: CSV and Parquet files whose columns and units are not ours."""

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from dmpcli.arrays import AnyArray, Booleans, Floats
from dmpcli.errors import InputError
from dmpcli.records import record
from dmpcli.records.streams import Source

PARQUET_MAGIC = b"PAR1"


@dataclass(frozen=True)
class Table:
    """A table as read: columns of numbers or text, all of one length.

    Attributes
    ----------
    name : str
        What messages call the file.
    columns : dict of array
    lines : sequence of int, optional
        The line of each row in a text file; without it rows are counted from 1.
    """

    name: str
    columns: dict[str, AnyArray]
    lines: Sequence[int] | None = None

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()), np.empty(0)))

    def at(self, row: int) -> str:
        """Return how a person finds row `row`, counted from 0."""
        return f"row {row + 1}" if self.lines is None else f"line {self.lines[row]}"

    def numbers(self, column: str) -> Floats:
        """Return a column as finite numbers, shape (rows,).

        Raises
        ------
        InputError
            The column is missing, or a value is text, empty, NaN or infinite; names the row.
        """
        values = self.floats(column)
        bad = ~np.isfinite(values)
        if bad.any():
            row = int(np.argmax(bad))
            raise InputError(
                f"{self.name}: column {column!r}, {self.at(row)}: {self.shown(column, row)} is "
                "not a finite number; mend or remove the row"
            )
        return values

    def floats(self, column: str) -> Floats:
        """Return a column as numbers, shape (rows,): NaN where there is text or no value.

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
        if values.dtype.kind in "iufb":
            return values.astype(float)
        import pandas as pd

        return np.array(pd.to_numeric(pd.Series(values), errors="coerce"), dtype=float)

    def empty(self, column: str) -> Booleans:
        """Tell which cells of a column hold nothing, shape (rows,)."""
        values = self.columns[column]
        if values.dtype.kind == "f":
            return np.isnan(values)
        return np.array([v is None or str(v).strip() == "" for v in values], dtype=bool)

    def shown(self, column: str, row: int) -> str:
        """Return a cell as a message shows it."""
        value = self.columns[column][row]
        return "an empty cell" if value is None or str(value).strip() == "" else repr(str(value))


def is_parquet(source: Source) -> bool:
    """Tell a Parquet file by its first bytes."""
    return source.content[:4] == PARQUET_MAGIC


def read(source: Source) -> Table:
    """Read a CSV or Parquet table whole.

    CSV files have a header line; the separator is the first of ``, ; tab`` that the header holds,
    else runs of spaces. Lines that begin with ``#`` are passed over.

    Raises
    ------
    InputError
        Neither Parquet nor text, no rows, or lines of differing length.
    """
    table = _parquet(source) if is_parquet(source) else _csv(source)
    if len(table) == 0:
        raise InputError(f"{source.name}: holds no rows; it needs a header and at least one row")
    return table


def _parquet(source: Source) -> Table:
    table = record.parquet_table(source)
    return Table(source.name, {name: table.column(name).to_numpy() for name in table.column_names})


def _csv(source: Source) -> Table:
    import pandas as pd

    try:
        text = source.content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{source.name}: is neither a Parquet file nor text in UTF-8") from None
    lines = [
        (number, line) for number, line in enumerate(text.splitlines(), start=1) if _counts(line)
    ]
    if not lines:
        raise InputError(f"{source.name}: holds no rows; it needs a header and at least one row")
    separator = next((s for s in ",;\t" if s in lines[0][1]), r"\s+")
    _check_lengths(source.name, lines, separator)
    try:
        # As text: numbers are parsed by column, so that a bad cell can be named with its line.
        frame: Any = pd.read_csv(
            io.StringIO("\n".join(line for _, line in lines)),
            sep=separator,
            dtype=str,
            keep_default_na=False,
            skipinitialspace=True,
        )
    except (pd.errors.ParserError, pd.errors.EmptyDataError, ValueError) as error:
        reason = str(error).strip().splitlines()[0]
        raise InputError(f"{source.name}: cannot be read as a table: {reason}") from None
    names = [name.strip().strip('"') for name in _cells(lines[0][1], separator)]
    twice = next((name for i, name in enumerate(names) if name in names[:i]), None)
    if twice is not None:
        raise InputError(f"{source.name}: column {twice!r} is there twice; rename one")
    columns = {str(name).strip(): frame[name].to_numpy(dtype=object) for name in frame.columns}
    return Table(source.name, columns, [number for number, _ in lines[1:]])


def _counts(line: str) -> bool:
    return bool(line.strip()) and not line.lstrip().startswith("#")


def _check_lengths(name: str, lines: Sequence[tuple[int, str]], separator: str) -> None:
    header = len(_cells(lines[0][1], separator))
    for number, line in lines:
        count = len(_cells(line, separator))
        if count != header and '"' not in line:
            raise InputError(
                f"{name}: line {number} has {count} columns, the header has {header}; "
                "mend or remove the line"
            )


def _cells(line: str, separator: str) -> list[str]:
    return line.split() if separator == r"\s+" else line.split(separator)
