"""Parquet files as bytes and as tables: sizes judged before memory, page checksums verified.

Files that hold no checksums (of other programs, and of version 0.1.0) are read as they are.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from dmpcli.errors import InputError
from dmpcli.records import untrusted
from dmpcli.records.file_io import Source

MAGIC = b"PAR1"

_NUMBER, _TEXT = 8, 64
"""Bytes of memory that a value takes; a text as an object of Python."""

_FAULTS = (pa.ArrowException, OSError, ValueError, MemoryError)


def opened(source: Source | Path, remedy: str, text: Sequence[str] | None = None) -> Any:
    """Open a Parquet file whose columns may be read.

    Parameters
    ----------
    source : Source or Path
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
            untrusted.judge_columns(name, len(schema))
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


def _file(source: Source | Path) -> Any:
    return source.open() if isinstance(source, Source) else source


def table(source: Source) -> Any:
    """Return the pyarrow table of a Parquet source, ours or another's; text as plain text.

    Raises
    ------
    InputError
        As in `opened`; or two columns have one name.
    """
    remedy = "make it again"
    file = opened(source, remedy)
    judge(source.name, file.metadata, len(source.content))
    try:
        with untrusted.decoding(source.name):
            found = file.read()
            double = twice(found.column_names)
            if double is not None:
                raise InputError(f"{source.name}: column {double!r} is there twice; leave one out")
            return _plain(source, found)
    except InputError as error:
        if isinstance(error.__cause__, _FAULTS):
            raise damaged(source.name, remedy) from None
        raise


def judge(name: str, metadata: Any, size: int, groups: Sequence[int] | None = None) -> None:
    """Refuse a file that takes far more memory than its size lets expect.

    Parameters
    ----------
    name : str
    metadata : pyarrow.parquet.FileMetaData
    size : int
        Bytes of the file.
    groups : sequence of int, optional
        Only these row groups are read; without it all are.

    Raises
    ------
    InputError
    """
    with untrusted.decoding(name, "its footer"):
        untrusted.judge_columns(name, metadata.num_columns)
        taken = 0
        for number in range(metadata.num_row_groups) if groups is None else groups:
            group = metadata.row_group(number)
            for i in range(group.num_columns):
                column = group.column(i)
                width = _TEXT if column.physical_type == "BYTE_ARRAY" else _NUMBER
                values = max(column.num_values, group.num_rows, 0)
                taken += width * values + max(column.total_uncompressed_size, 0)
        untrusted.judge_table(name, taken, size)


def twice(names: Sequence[str]) -> str | None:
    """Return the first name that stands there twice; None where all differ."""
    seen: set[str] = set()
    for name in names:
        if name in seen:
            return name
        seen.add(name)
    return None


def _is_text(kind: Any) -> bool:
    return bool(
        pa.types.is_string(kind) or pa.types.is_large_string(kind) or pa.types.is_binary(kind)
    )


def _plain(source: Source, found: Any) -> Any:
    """Return a table whose dictionaries are plain columns, if they are not too large for that."""
    import pyarrow.compute as pc

    for i, field in enumerate(found.schema):
        kind = field.type
        if not pa.types.is_dictionary(kind) or not _is_text(kind.value_type):
            continue
        column = found.column(i)
        taken = 0
        for chunk in column.chunks:
            lengths = np.asarray(pc.binary_length(chunk.dictionary).fill_null(0), dtype=np.int64)
            used = np.bincount(
                np.asarray(chunk.indices.drop_null()), minlength=len(lengths)
            )  # raises where an index is below 0
            taken += int((used[: len(lengths)] * lengths).sum())
        untrusted.judge_table(source.name, taken, len(source.content))
        plain = field.with_type(kind.value_type)
        found = found.set_column(i, plain, column.cast(kind.value_type))
    return found
