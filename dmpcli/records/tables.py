"""Tables from elsewhere: CSV and Parquet files whose columns and units are not ours.

Text stays in Arrow's buffers until somebody asks for numbers: a million rows are then no more than
their bytes, and a bad cell can still be shown as it stands in the file.
"""

import io
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.errors import InputError
from dmpcli.records import columns, record
from dmpcli.records.streams import Source

PARQUET_MAGIC = b"PAR1"

_BLOCK = 1 << 24
_NUMBER = r"^[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?$"
_PASSED_OVER = re.compile(rb"^[ \t]*(?:#[^\n]*)?$", re.MULTILINE)
_NEVER_WITHOUT = (b"#", b"\n\n", b"\n ", b"\n\t")
"""A text that does not begin with a blank, and holds none of these, has no such line."""
_SEPARATORS = (b",", b";", b"\t")


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
    """

    name: str
    columns: Mapping[str, Any]
    lines: Integers | None = None

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()), ()))

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
        if isinstance(values, np.ndarray):
            return values.astype(float)
        return _floats(values)

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
        if _is_text(values.type):
            import pyarrow.compute as pc

            blank = pc.equal(pc.utf8_trim_whitespace(values), "")
            return np.array([value is not False for value in blank.to_pylist()], dtype=bool)
        return np.isnan(_floats(values))

    def shown(self, column: str, row: int) -> str:
        """Return a cell as a message shows it."""
        value = self.columns[column][row]
        value = value.as_py() if isinstance(value, pa.Scalar) else value
        return "an empty cell" if value is None or str(value).strip() == "" else repr(str(value))


def _is_text(kind: Any) -> bool:
    return bool(pa.types.is_string(kind) or pa.types.is_large_string(kind))


def _floats(values: Any) -> Floats:
    """Numbers of an Arrow array; NaN where there is none."""
    import pyarrow.compute as pc

    if _is_text(values.type):
        text = pc.utf8_trim_whitespace(values)
        try:
            values = text.cast(pa.float64())
        except pa.ArrowInvalid:
            number = pc.match_substring_regex(text, _NUMBER)
            text = pc.if_else(number, pc.utf8_ltrim(text, characters="+"), None)
            values = text.cast(pa.float64())
    else:
        try:
            values = values.cast(pa.float64())
        except (pa.ArrowInvalid, pa.ArrowNotImplementedError):
            return np.full(len(values), np.nan)
    # Not by to_numpy: it would import pandas only to ask what this is.
    found = columns.numbers(values)
    found[columns.nulls(values)] = np.nan
    return found


def is_parquet(source: Source) -> bool:
    """Tell a Parquet file by its first bytes."""
    return source.content[:4] == PARQUET_MAGIC


def read(source: Source) -> Table:
    """Read a CSV or Parquet table whole.

    CSV files have a header line; the separator is the first of ``, ; tab`` that the header holds,
    else runs of spaces. Empty lines and lines that begin with ``#`` are passed over.

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
    return Table(
        source.name, {name: table.column(name).combine_chunks() for name in table.column_names}
    )


def _csv(source: Source) -> Table:
    from pyarrow import csv

    text, lines = _counted(source)
    header, _, body = text.partition(b"\n")
    separator = next((s for s in _SEPARATORS if s in header), b" ")
    if separator == b" ":
        # Runs of spaces: one is left of each.
        header, body = re.sub(rb"[ \t]+", b" ", header), re.sub(rb"[ \t]+", b" ", body)
        header, body = header.strip(), re.sub(rb"^ | $", b"", body, flags=re.MULTILINE)
    elif b'"' in body:
        body = re.sub(re.escape(separator) + rb"[ \t]+\"", separator + b'"', body)
    names = [name.strip().strip('"').strip() for name in header.decode().split(separator.decode())]
    twice = next((name for i, name in enumerate(names) if name in names[:i]), None)
    if twice is not None:
        raise InputError(f"{source.name}: column {twice!r} is there twice; rename one")
    if not body:
        raise InputError(f"{source.name}: holds no rows; it needs a header and at least one row")
    # As text: numbers are parsed by column, so that a bad cell can be named with its line.
    try:
        table = csv.read_csv(
            io.BytesIO(body),
            read_options=csv.ReadOptions(use_threads=False, block_size=_BLOCK, column_names=names),
            parse_options=csv.ParseOptions(
                delimiter=separator.decode(), newlines_in_values=b'"' in body
            ),
            convert_options=csv.ConvertOptions(
                column_types=dict.fromkeys(names, pa.string()), strings_can_be_null=False
            ),
        )
    except pa.ArrowInvalid as error:
        raise InputError(f"{source.name}: {_complaint(str(error), lines, len(names))}") from None
    return Table(
        source.name,
        {name: table.column(name).combine_chunks() for name in table.column_names},
        lines[1 : 1 + table.num_rows],
    )


def _counted(source: Source) -> tuple[bytes, Integers]:
    """Lines of a text file that count, joined, and the number of each."""
    content = source.content.removeprefix(b"\xef\xbb\xbf")
    try:
        # Only to know that it is text; Arrow takes the bytes.
        content.decode("utf-8")
    except UnicodeDecodeError:
        raise InputError(f"{source.name}: is neither a Parquet file nor text in UTF-8") from None
    if b"\r" in content:
        content = content.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    content = content.rstrip(b"\n")
    likely = content[:1] in b" \t\n" or any(sign in content for sign in _NEVER_WITHOUT)
    if not likely or _PASSED_OVER.search(content) is None:
        return content, np.arange(1, content.count(b"\n") + 2)
    every = content.split(b"\n")
    kept = [number for number, line in enumerate(every) if not _PASSED_OVER.fullmatch(line)]
    return b"\n".join([every[number] for number in kept]), np.array(kept, dtype=np.int64) + 1


def _complaint(error: str, lines: Integers, expected: int) -> str:
    """Say what Arrow found wrong with a table's shape, by the line of the file."""
    found = re.search(r"Row #(\d+): Expected \d+ columns, got (\d+)", error)
    if found is None:
        return f"cannot be read as a table: {error.strip().splitlines()[0]}"
    # Arrow counts the rows after the header from 1.
    line = lines[min(int(found[1]), len(lines) - 1)]
    return f"line {line} has {found[2]} columns, the header has {expected}; mend or remove the line"
