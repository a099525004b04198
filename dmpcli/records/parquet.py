"""Parquet files as bytes and as tables: sizes judged before memory, page checksums verified.

Files that hold no checksums (of other programs, and of version 0.1.0) are read as they are.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from dmpcli.errors import InputError
from dmpcli.records import untrusted
from dmpcli.records.file_io import Source
from dmpcli.records.object_store import ObjectPath
from dmpcli.records.storage import Location

MAGIC = b"PAR1"

_NUMBER, _TEXT = 8, 64
"""Bytes of memory that a value takes at least; a text as an object of Python."""

_ROWS = 4096
"""Rows of lists that are read at once."""

_REMEDY = "make it again"

_FAULTS = (pa.ArrowException, OSError, ValueError, MemoryError)


def opened(source: Source | Location, remedy: str, text: Sequence[str] | None = None) -> Any:
    """Open a Parquet file whose columns may be read.

    Parameters
    ----------
    source : Source, Path or ObjectPath
    remedy : str
        What to do about a damaged file.
    text : sequence of str, optional
        Columns to read as dictionaries; without it all of text.

    Returns
    -------
    pyarrow.parquet.ParquetFile
        A page whose checksum is wrong raises OSError as it is read.

    Raises
    ------
    InputError
        Not a Parquet file, truncated or damaged, or too large; by name.
    """
    name = source.name if isinstance(source, Source) else str(source)
    try:
        with untrusted.decoding(name):
            schema = pq.read_schema(_file(source))
            untrusted.judge_columns(name, len(schema), schema.names)
            if text is None:
                text = [field.name for field in schema if _is_text(field.type)]
            return pq.ParquetFile(
                _file(source), read_dictionary=list(text), page_checksum_verification=True
            )
    except InputError as error:
        if isinstance(error.__cause__, _FAULTS):
            raise damaged(name, remedy) from None
        raise


def damaged(name: str, remedy: str) -> InputError:
    """Return what is said of a file that cannot be read."""
    return InputError(f"{name}: is not a Parquet file, or it is truncated or damaged; {remedy}")


def _file(source: Source | Location) -> Any:
    if isinstance(source, ObjectPath):
        return source.open("rb")
    return source.open() if isinstance(source, Source) else source


def footer(path: Location) -> Any:
    """Return the metadata of a file: rows, row groups, and what its writer says.

    Raises
    ------
    pyarrow.ArrowException, OSError
        It is missing, or no Parquet file.
    """
    return pq.read_metadata(_file(path))


def table(source: Source) -> Any:
    """Return the pyarrow table of a Parquet source, ours or another's; text as plain text.

    Raises
    ------
    InputError
        As in `opened`; or two columns have one name.
    """
    file = _whole(source)
    names = file.schema_arrow.names
    try:
        with untrusted.decoding(source.name):
            flat = [field.name for field in file.schema_arrow if not _nested(field.type)]
            found = _plain(source, file.read(columns=flat))
            for name in names if len(flat) < len(names) else ():
                if name not in flat:
                    values = _lists(source, file, name) or pa.nulls(found.num_rows)
                    found = found.append_column(name, values)
            return found
    except InputError as error:
        if isinstance(error.__cause__, _FAULTS):
            raise damaged(source.name, _REMEDY) from None
        raise


def one_by_one(source: Source) -> tuple[Any, Iterator[Any]]:
    """Read a table as `table` does, one column at a time: no more than one is in memory at once.

    Returns
    -------
    pyarrow.Schema
        Of the file.
    iterator of pyarrow.Table
        Of one column each; lists and what else is nested are left out.

    Raises
    ------
    InputError
        As in `table`; of a damaged column as it is read.
    """
    file = _whole(source)
    flat = [field.name for field in file.schema_arrow if not _nested(field.type)]
    return file.schema_arrow, (_column(source, file, name) for name in flat)


def _column(source: Source, file: Any, name: str) -> Any:
    try:
        with untrusted.decoding(source.name):
            return _plain(source, file.read(columns=[name]))
    except InputError as error:
        if isinstance(error.__cause__, _FAULTS):
            raise damaged(source.name, _REMEDY) from None
        raise


def _whole(source: Source) -> Any:
    """Open a file of which all rows are read."""
    file = opened(source, _REMEDY)
    judge(source.name, file, len(source.content))
    double = twice(file.schema_arrow.names)
    if double is not None:
        raise InputError(f"{source.name}: column {double!r} is there twice; leave one out")
    return file


def judge(name: str, file: Any, size: int, groups: Sequence[int] | None = None) -> None:
    """Refuse a file that takes far more memory than its size lets expect.

    Only what is said of whole row groups is asked: to look at the columns of a crafted footer ends
    the process, from within the library.

    Parameters
    ----------
    name : str
    file : pyarrow.parquet.ParquetFile
    size : int
        Bytes of the file.
    groups : sequence of int, optional
        Only these row groups are read; without it all are.

    Raises
    ------
    InputError
    """
    with untrusted.decoding(name, "its footer"):
        metadata = file.metadata
        width = sum(_width(field.type) for field in file.schema_arrow)
        taken = 0
        for number in range(metadata.num_row_groups) if groups is None else groups:
            group = metadata.row_group(number)
            if group.num_rows < 0:
                raise ValueError("a row group of less than no rows")
            taken += width * group.num_rows
        untrusted.judge_table(name, taken, size)


def _lists(source: Source, file: Any, name: str) -> Any:
    """Return a column of lists of numbers, read a few rows at a time; None for other nested ones.

    How long the lists are shows only as they are read.
    """
    kind = file.schema_arrow.field(name).type
    lists = (pa.types.is_list, pa.types.is_large_list, pa.types.is_fixed_size_list)
    if not any(is_one(kind) for is_one in lists) or not _is_number(kind.value_type):
        return None
    chunks, taken = [], 0
    for batch in file.iter_batches(batch_size=_ROWS, columns=[name]):
        chunks.append(batch.column(0))
        taken += batch.nbytes
        untrusted.judge_table(source.name, taken, len(source.content))
    return pa.chunked_array(chunks, kind)


def _is_number(kind: Any) -> bool:
    return bool(pa.types.is_integer(kind) or pa.types.is_floating(kind))


def _width(kind: Any) -> int:
    """Bytes of memory that a value takes at most; what is nested is not read."""
    if _is_text(kind) or pa.types.is_dictionary(kind):
        return _TEXT
    if pa.types.is_null(kind):  # a column without any value, as pandas writes one
        return _NUMBER
    return 0 if _nested(kind) else max(kind.bit_width // 8, _NUMBER)


def _nested(kind: Any) -> bool:
    """Tell a type whose values have no one width: lists may hold any number of values each."""
    if _is_text(kind) or pa.types.is_dictionary(kind):
        return False
    try:
        return bool(kind.bit_width < 0)
    except ValueError:
        return not pa.types.is_null(kind)


def twice(names: Sequence[str]) -> str | None:
    """Return the first name that stands there twice; None where all differ."""
    seen: set[str] = set()
    for name in names:
        if name in seen:
            return name
        seen.add(name)
    return None


_TEXTS = (pa.string(), pa.large_string(), pa.string_view())
_BYTES = (pa.binary(), pa.large_binary(), pa.binary_view())


def _is_text(kind: Any) -> bool:
    """Tell text, and bytes, as which many writers keep it."""
    return kind in _TEXTS or kind in _BYTES


def plain_text(column: Any) -> Any:
    """Return a column of text, in whichever type its writer keeps it, as plain text.

    Parameters
    ----------
    column : Arrow array, chunked or not
        Bytes that are no text in UTF-8 stay as they are, and so does what is neither.
    """
    kind = column.type
    if pa.types.is_dictionary(kind) and _is_text(kind.value_type):
        column = column.cast(kind.value_type)
        kind = column.type
    if pa.types.is_fixed_size_binary(kind):
        return _unpadded(column)
    if kind not in (pa.string_view(), *_BYTES):
        return column
    try:
        return column.cast(pa.large_string() if kind == pa.large_binary() else pa.string())
    except pa.ArrowInvalid:
        return column


def _unpadded(column: Any) -> Any:
    """Return bytes of one width, as numpy keeps text, as plain text without the zeros behind it.

    Numbers of 16 bytes that name things are no text, and stay as they are.
    """
    import pyarrow.compute as pc

    try:
        return pc.utf8_rtrim(column.cast(pa.binary()).cast(pa.string()), characters="\0")
    except pa.ArrowInvalid:
        return column


def _plain(source: Source, found: Any) -> Any:
    """Return a table whose text is plain, if its dictionaries are not too large for that."""
    import pyarrow.compute as pc

    for i, field in enumerate(found.schema):
        kind = field.type
        column = found.column(i)
        if pa.types.is_dictionary(kind) and _is_text(kind.value_type):
            taken = 0
            for chunk in column.chunks:
                lengths = pc.binary_length(chunk.dictionary)
                taken += pc.sum(lengths.take(chunk.indices)).as_py() or 0
            untrusted.judge_table(source.name, taken, len(source.content))
        elif not _is_text(kind):
            continue
        plain = plain_text(column)
        found = found.set_column(i, field.with_type(plain.type), plain)
    return found
