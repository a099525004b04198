"""The one boundary for bytes that others wrote: whatever their decoding meets, they are to blame.

Decoders say what is wrong, with column and row, where they look for it. What nobody has foreseen
(a number beyond all bounds, a nesting without end, a library that trips) ends at this boundary as
the same kind of error, with the file's name. It lies around the decoding alone: what is done with
the values afterwards is ours, and a defect there keeps its traceback.
"""

import contextlib
import functools
from collections.abc import Callable, Iterable, Iterator
from typing import Any, TypeVar, cast

from dmpcli.errors import DmpError, InputError, beside
from dmpcli.records.file_io import Source

F = TypeVar("F", bound=Callable[..., Any])

MIB = 2**20

LARGEST_JSON = 32 * MIB
"""Bytes: as Python's objects they take twenty times as much."""

MOST_COLUMNS = 10_000
"""Of a table; the widest exports of motion capture have some thousands."""

LONGEST_NAME = 400
"""Characters of a column's name."""

LARGEST_TABLE, INFLATION = 384 * MIB, 16
"""Bytes that a table may take in memory, and times its file's own size: the larger of the two."""


@contextlib.contextmanager
def decoding(name: str, place: str = "") -> Iterator[None]:
    """Make whatever the decoding of a file raises an error about the file.

    Parameters
    ----------
    name : str
        Of the file, for messages.
    place : str
        Within it, where the caller knows.

    Raises
    ------
    InputError
    """
    try:
        yield
    except DmpError:
        raise
    except MemoryError:
        raise InputError(
            f"{_at(name, place)}needs more memory than there is; cut the file in parts, or make it "
            "again if it is damaged"
        ) from None
    except RecursionError:
        raise InputError(f"{_at(name, place)}is nested too deep; make the file again") from None
    except Exception as error:
        reason = " ".join(str(error).split())[:200]
        raise InputError(
            f"{_at(name, place)}cannot be read ({type(error).__name__}"
            f"{': ' if reason else ''}{reason}): damaged, or not what it says; make the file again"
        ) from error


def _at(name: str, place: str) -> str:
    return f"{name}: {place} " if place else f"{name}: "


def decoder(read: F) -> F:
    """Put the boundary around a function that decodes a source, its first argument."""

    @functools.wraps(read)
    def bounded(source: Source, *given: Any, **named: Any) -> Any:
        with decoding(source.name):
            return read(source, *given, **named)

    return cast("F", bounded)


def judge_size(name: str, size: int, largest: int, what: str) -> None:
    """Refuse bytes that would take too much memory, before any is taken.

    Parameters
    ----------
    name : str
        Of the file.
    size : int
        Bytes that it has.
    largest : int
        Bytes that are read at most.
    what : str
        What is to be read, for the message: ``a JSON file``.

    Raises
    ------
    InputError
        `size` is above `largest`.
    """
    if size > largest:
        has = beside(size / MIB, largest / MIB, ".3g")
        raise InputError(
            f"{name}: has {has} MiB, more than the {largest / MIB:g} MiB that are "
            f"read of {what}; it is damaged, or not what it says"
        )


def judge_columns(name: str, count: int, names: Iterable[str] = ()) -> None:
    """Refuse a table of more columns, or longer names of them, than anybody means.

    Parameters
    ----------
    name : str
        Of the file.
    count : int
    names : iterable of str
        Of the columns.

    Raises
    ------
    InputError
    """
    if count > MOST_COLUMNS:
        raise InputError(
            f"{name}: has {count:,} columns, more than the {MOST_COLUMNS:,} that are read; leave "
            "out what is not needed"
        )
    long = next((column for column in names if len(column) > LONGEST_NAME), None)
    if long is not None:
        raise InputError(
            f"{name}: column {long[:40]!r}... has a name of {len(long):,} characters, more than "
            f"{LONGEST_NAME}; rename it"
        )


def judge_table(name: str, taken: int, size: int) -> None:
    """Refuse a table that would take far more memory than its file's size lets expect.

    Parameters
    ----------
    name : str
        Of the file.
    taken : int
        Bytes in memory.
    size : int
        Bytes of the file.

    Raises
    ------
    InputError
    """
    most = max(LARGEST_TABLE, INFLATION * size)
    if taken > most:
        raise InputError(
            f"{name}: would take {taken / MIB:,.0f} MiB of memory, more than the "
            f"{most / MIB:,.0f} MiB that are kept for a file of its size; cut it in parts, or "
            "leave out what is not needed"
        )
