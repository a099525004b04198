"""Tables from elsewhere: CSV and Parquet files whose columns and units are not ours.

Text stays in Arrow's buffers until somebody asks for numbers: a million rows are then no more than
their bytes, and a bad cell can still be shown as it stands in the file.
"""

import itertools
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pyarrow as pa

from dmpcli.arrays import Integers
from dmpcli.errors import InputError
from dmpcli.records import columns, decimal_signs, list_columns, parquet, untrusted
from dmpcli.records.file_io import Source
from dmpcli.records.table import NUMBER, Table, is_text_array
from dmpcli.records.text_lines import MARK, TextLines, counted_lines
from dmpcli.records.untrusted import decoder

_BLOCK, _LARGEST_BLOCK = 1 << 20, 1 << 24
"""Bytes that are parsed at once: what stays in cache, and more where a row is longer."""
_LONGEST_LINE = 1 << 20
_SEPARATORS = (b",", b";", b"\t")
_BETWEEN_DIGITS = re.compile(rb"[0-9],[0-9]")


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


def is_parquet(source: Source) -> bool:
    """Tell a Parquet file by its first bytes."""
    return source.content[:4] == parquet.MAGIC


@decoder
def read(
    source: Source,
    names: Sequence[str] = (),
    decimal: str | None = ".",
    texts: Collection[str] | None = None,
    only: Collection[str] | None = None,
    numeric: Collection[str] | None = None,
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
        None: as the numbers tell it, see `decimal_signs`.
    texts : collection of str, optional
        Columns that are wanted as they stand. Where this is said, others are parsed as numbers at
        once if all of their cells are; without it every column is kept as text.
    only : collection of str, optional
        Of a text, columns that are read; others are passed over.
    numeric : collection of str, optional
        Columns of numbers, whose cells tell the decimal sign; without it, all but `texts`.

    Raises
    ------
    HeadlessError
        There is no header line.
    InputError
        Neither Parquet nor text, no rows, lines of differing length, or a decimal sign that cannot
        be told.
    """
    if is_parquet(source):
        table = _parquet(source)
        if decimal is None:
            table = decimal_signs.judged(table, numeric or table.columns)
    else:
        table = _csv(source, names, decimal, texts, only, numeric)
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
    source: Source,
    given: Sequence[str],
    decimal: str | None,
    texts: Collection[str] | None,
    only: Collection[str] | None,
    numeric: Collection[str] | None,
) -> Table:
    body = counted_lines(source)
    header, numbers = body.first(), body.numbers
    separator = _separator(header, body.rest().text(_LONGEST_LINE))
    names = _cells(header, separator)
    untrusted.judge_columns(source.name, len(names), names)
    headless = _are_values(names)
    if headless and not given:
        raise HeadlessError(source.name, int(numbers[0]), len(names))
    remarks: tuple[str, ...] = ()
    if given and not headless:
        remarks = (f"line {numbers[0]} is not read: --columns names the columns",)
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
    parted = separator == b","
    if decimal is None and ((parted and b'"' not in body) or not body.search(_BETWEEN_DIGITS)):
        decimal = "."
    found = None
    if texts is not None and decimal == ".":
        found = _number_columns(body, names, separator, texts)
    if found is None:
        found = body_columns(body, names, separator, source.name, only)
    rows = len(next(iter(found.values()), ()))
    table = Table(source.name, found, body.numbers[:rows], decimal or ".", remarks)
    if decimal is not None:
        return table
    speaking = [one for one in names if one not in (texts or ())] if numeric is None else numeric
    return decimal_signs.judged(table, speaking, parted)


def without_blank_rows(table: Table) -> Table:
    """Return a text table without rows of which no cell holds anything.

    Spreadsheets write such rows below their last one. Of a piece of a file, whose rows have numbers
    there, all stay.
    """
    import pyarrow.compute as pc

    held = table.columns
    if table.lines is None or table.rows is not None:
        return table
    if not all(map(is_text_array, held.values())):
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
    return re.match(NUMBER, cell) is not None and abs(float(cell)) <= _EXACT


def _parsed(
    body: TextLines,
    names: Sequence[str],
    separator: bytes,
    kinds: Mapping[str, Any],
    only: Sequence[str] = (),
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
                column_types=kinds,
                strings_can_be_null=False,
                null_values=[],
                include_columns=only,
            ),
        )

    try:
        return parsed(_BLOCK)
    except pa.ArrowInvalid:
        if len(body) <= _BLOCK:
            raise
        return parsed(_LARGEST_BLOCK)  # a row may be longer than the block


def body_columns(
    body: TextLines,
    names: Sequence[str],
    separator: bytes,
    name: str,
    only: Collection[str] | None = None,
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
    only : collection of str, optional
        Columns that are wanted.

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
        some = [] if only is None else [one for one in names if one in only]
        table = _parsed(body, names, separator, dict.fromkeys(names, pa.string()), some)
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
    return re.match(NUMBER, cell.replace(",", ".", 1)) is not None or cell.lower() == "nan"


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
