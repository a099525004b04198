"""Tables from elsewhere: CSV and Parquet files whose columns and units are not ours.

Text stays in Arrow's buffers until somebody asks for numbers: a million rows are then no more than
their bytes, and a bad cell can still be shown as it stands in the file.
"""

import itertools
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pyarrow as pa

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.errors import InputError
from dmpcli.records import columns, list_columns, parquet, untrusted
from dmpcli.records.file_io import Source
from dmpcli.records.text_lines import MARK, TextLines, counted_lines
from dmpcli.records.untrusted import decoder

_BLOCK, _LARGEST_BLOCK = 1 << 20, 1 << 24
"""Bytes that are parsed at once: what stays in cache, and more where a row is longer."""
_LONGEST_LINE = 1 << 20
_NUMBER = r"^[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?$"
_SEPARATORS = (b",", b";", b"\t")
_DECIMAL_COMMA, _DECIMAL_POINT = re.compile(rb"[0-9],[0-9]"), re.compile(rb"[0-9]\.[0-9]")


class HeadlessError(InputError):
    """A table begins with numbers where the names of its columns should be.

    Attributes
    ----------
    count : int
        How many columns it has.
    """

    def __init__(self, name: str, line: int, count: int) -> None:
        super().__init__(
            f"{name}: line {line} holds numbers, not names of columns; put a header line above"
        )
        self.line, self.count = line, count


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
    return source.content[:4] == parquet.MAGIC


@decoder
def read(
    source: Source,
    names: Sequence[str] = (),
    decimal: str | None = ".",
    texts: Collection[str] | None = None,
) -> Table:
    """Read a CSV or Parquet table whole.

    CSV files have a header line; the separator is that of ``, ; tab`` of which the header and the
    first row hold equally many, else runs of spaces. Empty lines and lines that begin with ``#``
    are passed over.

    Parameters
    ----------
    source : Source
    names : sequence of str
        Of the columns in order, instead of a header line; further columns are named by number.
    decimal : {'.', ','}, optional
        None: commas where they stand between digits, no point does, and they do not separate.
    texts : collection of str, optional
        Columns that are wanted as they stand. Where this is said, others are parsed as numbers at
        once if all of their cells are; without it every column is kept as text.

    Raises
    ------
    HeadlessError
        There is no header line.
    InputError
        Neither Parquet nor text, no rows, or lines of differing length.
    """
    table = _parquet(source) if is_parquet(source) else _csv(source, names, decimal, texts)
    if len(table) == 0:
        raise InputError(f"{source.name}: holds no rows; it needs a header and at least one row")
    return table


def _parquet(source: Source) -> Table:
    return of_arrow(source.name, parquet.table(source))


def of_arrow(name: str, table: Any, rows: Integers | None = None) -> Table:
    """Return an Arrow table, or these rows of a file, as a `Table`.

    Parameters
    ----------
    name : str
        What messages call the file.
    table : Arrow table
        Columns of lists of one length become a column for each element, ``name[0]`` and so on.
    rows : array of int, shape (rows,), optional
        Which rows of the file these are, from 0; without it, all.
    """
    columns: dict[str, Any] = {}
    for column in table.column_names:
        values = parquet.plain_text(table.column(column)).combine_chunks()
        columns |= list_columns.expanded(column, values)
    return Table(name, columns, rows=rows)


def _csv(
    source: Source, given: Sequence[str], decimal: str | None, texts: Collection[str] | None
) -> Table:
    body = counted_lines(source)
    header, numbers = body.first(), body.numbers
    separator = _separator(header, body.rest().text(_LONGEST_LINE))
    names = _cells(header, separator)
    untrusted.judge_columns(source.name, len(names), names)
    headless = _are_values(names)
    if headless and not given:
        raise HeadlessError(source.name, int(numbers[0]), len(names))
    remarks = []
    if given and not headless:
        remarks.append(f"line {numbers[0]} is not read: --columns names the columns")
    if not headless:
        body = body.rest()
    if given:
        names = named(given, len(names), source.name)
    if separator == b" ":
        body = body.of(_single_spaces(body.text()))
    elif b'"' in body:
        spaced = re.escape(separator) + rb"[ \t]+\""
        body = body.of(re.sub(spaced, separator + b'"', body.text()))
    twice = parquet.twice(names)
    if twice is not None:
        raise InputError(f"{source.name}: column {twice!r} is there twice; rename one")
    if decimal is None:
        points = separator == b"," or body.search(_DECIMAL_POINT)
        comma = not points and body.search(_DECIMAL_COMMA)
        decimal = "," if comma else "."
        if comma:
            remarks.append("commas between digits read as decimal signs")
    found = None
    if texts is not None and decimal == ".":
        found = _number_columns(body, names, separator, texts)
    if found is None:
        found = body_columns(body, names, separator, source.name)
    rows = len(next(iter(found.values()), ()))
    return Table(source.name, found, body.numbers[:rows], decimal, tuple(remarks))


def with_decimal_commas(table: Table, names: Collection[str]) -> Table:
    """Return a table with the decimal sign that its columns of numbers have.

    It is the comma where one of them has some between digits and none has a point; that is
    remarked. What columns of text hold, such as names of files, says nothing.
    A piece of a file cannot tell: the others may have points, and all are to be read alike.

    Parameters
    ----------
    table : Table
    names : collection of str
        Of columns of numbers; those that the table lacks are passed over.
    """
    import pyarrow.compute as pc

    if table.rows is not None:
        return table
    cells = [table.columns[name] for name in names if name in table.columns]
    cells = [one for one in cells if _is_text_array(one)]

    def some(pattern: str) -> bool:
        return any(pc.any(pc.match_substring_regex(one, pattern)).as_py() for one in cells)

    if table.decimal == "," or not some(r"[0-9],[0-9]") or some(r"[0-9]\.[0-9]"):
        return table
    remark = "commas between digits read as decimal signs"
    return replace(table, decimal=",", remarks=(*table.remarks, remark))


def without_blank_rows(table: Table) -> Table:
    """Return a text table without rows of which no cell holds anything.

    Spreadsheets write such rows below their last one. Of a piece of a file, whose rows have numbers
    there, all stay.
    """
    import pyarrow.compute as pc

    held = table.columns
    if table.lines is None or table.rows is not None:
        return table
    if not all(map(_is_text_array, held.values())):
        return table
    blank = np.ones(len(table), dtype=bool)
    for values in held.values():
        here = np.flatnonzero(blank)
        if not len(here):
            return table
        cells = pc.utf8_trim_whitespace(values.take(columns.arrow(here)))
        blank[here] = np.array(pc.equal(cells, "").to_pylist(), dtype=bool)
    kept = np.flatnonzero(~blank)
    if len(kept) in (0, len(table)):
        return table
    some = {name: values.take(columns.arrow(kept)) for name, values in held.items()}
    return replace(table, columns=some, lines=table.lines[kept])


def _is_text_array(values: Any) -> bool:
    return not isinstance(values, np.ndarray) and is_text(values.type)


def _number_columns(
    body: TextLines, names: Sequence[str], separator: bytes, texts: Collection[str]
) -> dict[str, Any] | None:
    """Part the rows of a text table, with numbers parsed on the way: half of the time and memory.

    A column is one of numbers if its first cell is, and not so large that a double could lose
    digits of it, as of stamps that count from an epoch.

    Returns
    -------
    dict or None
        Arrays of numpy, and of Arrow where a column is text. None where a cell of a column of
        numbers is none, or no finite one: read as text, it can be shown as it stands.
    """
    first = _cells(body.first(), separator)
    kinds = {
        name: pa.float64() if name not in texts and _is_small(cell) else pa.string()
        for name, cell in zip(names, first, strict=False)
    }
    if len(first) != len(names) or pa.float64() not in kinds.values():
        return None
    try:
        table = _parsed(body, names, separator, kinds)
    except pa.ArrowInvalid:
        return None
    found: dict[str, Any] = {}
    for name in names:
        column = table.column(name)
        table = table.drop_columns([name])  # its memory goes as soon as it is copied
        if kinds[name] == pa.string():
            found[name] = column.combine_chunks()
            continue
        values = columns.joined(column)
        # NaN is the least and the largest of what it is among.
        if not len(values) or not np.isfinite([values.min(), values.max()]).all():
            return None
        found[name] = values
    return found


_EXACT = 1e6


def _is_small(cell: str) -> bool:
    return re.match(_NUMBER, cell) is not None and abs(float(cell)) <= _EXACT


def _parsed(
    body: TextLines, names: Sequence[str], separator: bytes, kinds: Mapping[str, Any]
) -> Any:
    from pyarrow import csv

    def parsed(block: int) -> Any:
        return csv.read_csv(
            body.reader(),
            read_options=csv.ReadOptions(
                use_threads=False, block_size=min(block, len(body) + 1), column_names=names
            ),
            parse_options=csv.ParseOptions(
                delimiter=separator.decode(), newlines_in_values=b'"' in body
            ),
            convert_options=csv.ConvertOptions(
                column_types=kinds, strings_can_be_null=False, null_values=[]
            ),
        )

    try:
        return parsed(_BLOCK)
    except pa.ArrowInvalid:
        if len(body) <= _BLOCK:
            raise
        return parsed(_LARGEST_BLOCK)  # a row may be longer than the block


def body_columns(
    body: TextLines, names: Sequence[str], separator: bytes, name: str
) -> dict[str, Any]:
    """Part the rows of a text table.

    Parameters
    ----------
    body : TextLines
        The rows alone.
    names : sequence of str
        Of the columns.
    separator : bytes
    name : str
        Of the file, for messages.

    Returns
    -------
    dict
        Arrow arrays of text.

    Raises
    ------
    InputError
        No rows, or one of another length.
    """
    if not len(body):
        raise InputError(f"{name}: holds no rows; it needs a header and at least one row")
    # As text: numbers are parsed by column, so that a bad cell can be named with its line.
    try:
        table = _parsed(body, names, separator, dict.fromkeys(names, pa.string()))
    except pa.ArrowInvalid as error:
        raise InputError(f"{name}: {_complaint(str(error), body.numbers, len(names))}") from None
    return {key: table.column(key).combine_chunks() for key in table.column_names}


def _cells(header: bytes, separator: bytes) -> list[str]:
    """Part a header line into names."""
    if separator == b" ":
        return header.decode().split()
    return [name.strip().strip('"').strip() for name in header.decode().split(separator.decode())]


def _single_spaces(text: bytes) -> bytes:
    """Leave one space of each run of blanks, none at the ends of lines."""
    # Most files are so already, and patterns are slow on a million lines.
    if b"\t" in text or b"  " in text:
        text = re.sub(rb"[ \t]+", b" ", text)
    return text.replace(b"\n ", b"\n").replace(b" \n", b"\n").strip(b" ")


def _separator(header: bytes, body: bytes) -> bytes:
    """Return what parts the columns: what the header and the first row hold equally often."""
    row = body.partition(b"\n")[0]
    # The comma last: it may be a decimal sign, the others may not.
    for separator in (b";", b"\t", b","):
        if 0 < header.count(separator) == row.count(separator):
            return separator
    return next((s for s in _SEPARATORS if s in header), b" ")


def _is_number(cell: str) -> bool:
    return re.match(_NUMBER, cell.replace(",", ".", 1)) is not None or cell.lower() == "nan"


def _are_values(cells: Sequence[str]) -> bool:
    """Tell a row from names: numbers, among them a word or two such as a frame's name."""
    numbers = sum(map(_is_number, cells))
    return bool(cells) and (numbers == len(cells) or (numbers > 3 and len(cells) - numbers <= 2))


def named(given: Sequence[str], count: int, source: str) -> list[str]:
    """Return names for all columns, the given ones first.

    Parameters
    ----------
    given : sequence of str
        As ``--columns`` names them.
    count : int
        How many columns the file has; the rest are called ``column N``, from 1.
    source : str
        What messages call the file.

    Raises
    ------
    InputError
        There are fewer columns than names.
    """
    if len(given) > count:
        raise InputError(
            f"{source}: has {count} columns, --columns names {len(given)}: {', '.join(given)}"
        )
    return [*given, *(f"column {i}" for i in range(len(given) + 1, count + 1))]


def commented_names(source: Source, count: int) -> list[str] | None:
    """Return the names of a header line that is commented out, as TUM and EuRoC files have it.

    Parameters
    ----------
    source : Source
        A text table without header.
    count : int
        Of its columns.

    Returns
    -------
    list of str or None
        None where no line of comment before the rows has that many words.
    """
    head = source.content[: 1 << 14].removeprefix(MARK).decode("utf-8", "replace")
    for line in reversed(list(itertools.takewhile(_is_passed_over, head.splitlines()))):
        words = line.strip().lstrip("#").strip()
        for parts in (words.split(","), words.split(";"), words.split()):
            names = [part.strip() for part in parts]
            if len(names) == len(set(names)) == count and not any(map(_is_number, names)):
                return names
    return None


def _is_passed_over(line: str) -> bool:
    return line.strip()[:1] in ("", "#")


def _complaint(error: str, lines: Integers, expected: int) -> str:
    """Say what Arrow found wrong with a table's shape, by the line of the file."""
    found = re.search(r"Row #(\d+): Expected \d+ columns, got (\d+)", error)
    if found is None:
        return f"cannot be read as a table: {error.strip().splitlines()[0]}"
    # Arrow counts the rows from 1.
    line = lines[min(int(found[1]), len(lines)) - 1]
    return f"line {line} has {found[2]} columns, the header has {expected}; mend or remove the line"
