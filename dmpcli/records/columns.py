"""Columns of a pyarrow table as arrays, checked."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pyarrow as pa

from dmpcli.arrays import AnyArray, Booleans, Integers
from dmpcli.errors import InputError
from dmpcli.records.schemas import Column

TYPES = {"double": pa.float64(), "int64": pa.int64(), "string": pa.string()}
"""Arrow's types of the columns that a schema names."""


LARGEST = 1e30
"""Numbers beyond this are no quantity in any unit, and their products would overflow."""

FARTHEST = 1e6
"""Coordinates beyond this, mm, are a mistake: no arm reaches a kilometre."""


def columns_of(
    table: Any, wanted: Mapping[str, Column], name: str, views: bool = False
) -> dict[str, AnyArray]:
    """Return the wanted columns of a pyarrow table as arrays, checked.

    Parameters
    ----------
    table : Arrow table
    wanted : mapping of str to Column
        Of a schema; columns of the table that are not wanted are left alone.
    name : str
        What messages call the file.
    views : bool
        Columns without nulls are not copied then, and cannot be written to.

    Returns
    -------
    dict of array, shape (rows,)
        Optional columns that the table lacks are absent; nulls are NaN, in whole numbers -1.

    Raises
    ------
    InputError
        A required column is missing, empty or null somewhere, a value is not a finite number or
        beyond `LARGEST`, an id holds a control character, or there are no rows.
    """
    columns: dict[str, AnyArray] = {}
    for key, column in wanted.items():
        if key not in table.column_names:
            if column.required:
                raise InputError(
                    f"{name}: column {key!r} is missing; it has {', '.join(table.column_names)}"
                )
            continue
        columns[key] = _array(table.column(key), key, column, name, views)
    if table.num_rows == 0:
        raise InputError(f"{name}: holds no rows")
    return columns


def _array(chunked: Any, key: str, column: Column, name: str, views: bool) -> AnyArray:
    try:
        cast = chunked.cast(TYPES[column.type])
        # One chunk would be copied.
        values = cast.chunk(0) if cast.num_chunks == 1 else cast.combine_chunks()
    except pa.ArrowException:
        raise InputError(
            f"{name}: column {key!r} holds {chunked.type}, numbers are needed"
            if column.type != "string"
            else f"{name}: column {key!r} holds {chunked.type}, text is needed"
        ) from None
    whole = column.type == "double" and values.null_count == 0
    if whole and all_within(seen := viewed(values), LARGEST):
        return seen if views else seen.copy()
    unknown = nulls(values)
    if column.required and unknown.any():
        raise InputError(
            f"{name}: column {key!r}, row {int(np.argmax(unknown)) + 1}: no value; "
            "remove the row or fill it in"
        )
    if column.type == "string":
        if key == "id":
            check_ids(values, name)
        return np.asarray(values.to_pylist(), dtype=object)
    array = numbers(values)
    if column.type == "int64":
        array[unknown] = -1
        return array
    array[unknown] = np.nan
    bad = ~(np.abs(array) <= LARGEST) & ~unknown
    if bad.any():
        row = int(np.argmax(bad))
        wrong = f"is beyond {LARGEST:g}" if np.isfinite(array[row]) else "is not a finite number"
        raise InputError(
            f"{name}: column {key!r}, row {row + 1}: {array[row]} {wrong}; "
            "remove the row or mend it"
        )
    return array


def check_ids(values: Any, name: str) -> None:
    """Refuse ids that are not shown as they are: with control characters in them.

    Parameters
    ----------
    values : Arrow array of text
    name : str
        Of the file.

    Raises
    ------
    InputError
        Names the row.
    """
    import pyarrow.compute as pc

    bad = pc.match_substring_regex(values, r"[\x00-\x1f\x7f]")
    if pc.any(bad).as_py():
        row = bad.to_pylist().index(True)
        raise InputError(
            f"{name}: column 'id', row {row + 1}: {values[row].as_py()!r} holds a control "
            "character; rename it"
        )


def nulls(values: Any) -> Booleans:
    """Tell which values of a pyarrow array are null, shape (rows,)."""
    if values.null_count == 0:
        return np.zeros(len(values), dtype=bool)
    bits = np.frombuffer(values.buffers()[0], dtype=np.uint8)
    known = np.unpackbits(bits, bitorder="little")[values.offset : values.offset + len(values)]
    unknown: Booleans = known == 0
    return unknown


def dtype_of(kind: Any) -> np.dtype[Any]:
    """Return numpy's type for Arrow's type of numbers; to_pandas_dtype may import pandas for it."""
    letter = (
        "f" if pa.types.is_floating(kind) else "u" if pa.types.is_unsigned_integer(kind) else "i"
    )
    return np.dtype(f"{letter}{kind.bit_width // 8}")


def numbers(values: Any) -> AnyArray:
    """Copy of the numbers of a pyarrow array, whatever stands at its nulls."""
    return viewed(values).copy()


def viewed(values: Any) -> AnyArray:
    """Numbers of a pyarrow array where they lie."""
    dtype = dtype_of(values.type)
    if len(values) == 0:
        return np.empty(0, dtype=dtype)
    whole = np.frombuffer(values.buffers()[1], dtype=dtype)
    return whole[values.offset : values.offset + len(values)]


def joined(chunked: Any) -> AnyArray:
    """Numbers of a chunked array without nulls, shape (rows,)."""
    found = np.empty(len(chunked), dtype=dtype_of(chunked.type))
    first = 0
    for chunk in chunked.chunks:
        found[first : first + len(chunk)] = viewed(chunk)
        first += len(chunk)
    return found


def arrow(values: AnyArray) -> Any:
    """Arrow array over an array of numbers, shape (rows,)."""
    # From buffers: pa.array would import pandas, a third of a second, only to ask what this is.
    kind = pa.from_numpy_dtype(values.dtype)
    data = pa.py_buffer(np.ascontiguousarray(values))
    return pa.Array.from_buffers(kind, len(values), [None, data])


def taken(values: Any, rows: Integers) -> Any:
    """Return values of a pyarrow array by their rows (k,)."""
    return values.take(arrow(rows))


def all_within(values: AnyArray, largest: float) -> bool:
    """Tell whether no value is NaN or further from 0 than `largest`; takes no memory."""
    return not len(values) or bool(values.min() >= -largest and values.max() <= largest)
