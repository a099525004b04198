"""Columns of time of any kind, in s, without losing digits: a double holds 1.7e9 s to 0.2 μs only.

Stamps that count from an epoch are counted from the first of them, before they become doubles.
"""

import re
from typing import Any

import numpy as np
import pyarrow as pa

from dmpcli.arrays import Floats
from dmpcli.errors import InputError
from dmpcli.records import columns
from dmpcli.records.layouts import TIME
from dmpcli.records.table import Table, is_text

EPOCH = 1e6
"""A first stamp beyond this, s, counts from an epoch, not from when something was switched on."""

_DAY = 86400.0
_TIME_OF_DAY = re.compile(r"\d\d:\d\d:\d\d([.,]\d+)?")
_VALID = re.compile(r"([01]\d|2[0-3]):[0-5]\d:[0-5]\d([.,]\d{1,9})?")

# Twelve digits after the point: 1 ns in units of ns, s or anything between; 25 before it.
_EXACT = pa.decimal128(37, 12)


def seconds(table: Table, column: str, unit: str, nanoseconds: str | None = None) -> Floats:
    """Read time.

    Parameters
    ----------
    table : Table
    column : str
        Numbers, dates, times of day, or text of any.
    unit : str
        Of numbers.
    nanoseconds : str, optional
        A second column, of nanoseconds within the second; time then counts from the first row.

    Returns
    -------
    array, shape (rows,)
        s; from the first row where that is beyond `EPOCH`.

    Raises
    ------
    InputError
        A value is no time; names the row.
    """
    if nanoseconds is not None:
        t: Floats = seconds(table, column, unit) + table.numbers(nanoseconds) * 1e-9
        t -= t[0]
        return t
    values: Any = table.columns.get(column)
    if isinstance(values, pa.Array | pa.ChunkedArray):
        dates = _dates(values)
        if dates is not None:
            return dates
        _refuse_times_of_day(table, column, values)
        exact = _exact(values, table.decimal, TIME[unit])
        if exact is not None:
            return exact
    t = table.numbers(column) * TIME[unit]
    if len(t) and abs(t[0]) > EPOCH:
        t = t - t[0]
    return t


def clock(table: Table, column: str, unit: str, first: float) -> float | None:
    """Return what a column of times showed when `seconds` has 0, s; None of dates.

    Parameters
    ----------
    table : Table
    column : str
    unit : str
        Of numbers.
    first : float
        What `seconds` has in the first row, s.
    """
    values: Any = table.columns.get(column)
    if isinstance(values, pa.Array | pa.ChunkedArray) and _dates(values) is not None:
        return None
    return float(table.numbers(column)[0]) * TIME[unit] - first


def _dates(values: Any) -> Floats | None:
    """Seconds since the first of dates or times of day; None where the column holds others."""
    by_day = False
    try:
        if is_text(values.type):
            first = str(values[0].as_py()).strip() if len(values) else ""
            if ":" not in first:
                return None
            by_day = _TIME_OF_DAY.fullmatch(first) is not None
            if by_day:
                values = _on_one_day(values)
            zone = "UTC" if first.endswith("Z") else None
            values = values.cast(pa.timestamp("ns", zone))
        elif pa.types.is_time(values.type):
            by_day, values = True, values.cast(pa.time64("ns"))
        elif not pa.types.is_timestamp(values.type):
            return None
        else:
            values = values.cast(pa.timestamp("ns", values.type.tz))
        ns = columns.numbers(values.cast(pa.int64()))
    except (pa.ArrowInvalid, pa.ArrowNotImplementedError):
        return None
    if values.null_count:
        return None
    t: Floats = (ns - ns[0]) * 1e-9
    if by_day:
        # The only step back by half a day or more that a clock makes is the one at midnight.
        t[1:] += _DAY * np.cumsum(np.diff(t) < -0.5 * _DAY)
    return t


def _refuse_times_of_day(table: Table, column: str, values: Any) -> None:
    """Name the row that is none in a column that begins with a time of day."""
    if not is_text(values.type) or len(values) == 0:
        return
    words = [str(word).strip() for word in values.to_pylist()]
    if _TIME_OF_DAY.fullmatch(words[0]):
        row = next((n for n, word in enumerate(words) if not _VALID.fullmatch(word)), 0)
        raise InputError(
            f"{table.name}: column {column!r}, {table.at(row)}: {table.shown(column, row)} is not "
            "a time of day HH:MM:SS; mend or remove the row"
        )


def _on_one_day(values: Any) -> Any:
    import pyarrow.compute as pc

    values = pc.replace_substring(pc.utf8_trim_whitespace(values), ",", ".")
    return pc.binary_join_element_wise("2000-01-01 ", values, "")


def _exact(values: Any, decimal: str, factor: float) -> Floats | None:
    """Seconds since the first of numbers that count from an epoch; None of others, or unclear."""
    import pyarrow.compute as pc

    try:
        if is_text(values.type):
            values = pc.utf8_trim_whitespace(values)
            if decimal == ",":
                values = pc.replace_substring(values, ",", ".")
        elif not pa.types.is_integer(values.type):
            return None
        if len(values) == 0 or abs(float(values[0].as_py())) * factor <= EPOCH:
            return None
        values = values.cast(_EXACT)
        since = pc.subtract(values, values[0]).cast(pa.float64())
    except (pa.ArrowInvalid, pa.ArrowNotImplementedError, ValueError, TypeError):
        return None
    if since.null_count:
        return None
    t: Floats = columns.numbers(since) * factor
    return t
