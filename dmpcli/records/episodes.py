"""Tables that hold several recordings, one after the other: which rows are meant."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Integers
from dmpcli.errors import InputError
from dmpcli.records.table import Table

NAMES = ("episode_index", "episode", "episode_id", "trial", "demo", "id")
"""Columns that tell recordings apart, the surest first."""

MOST = 10_000
"""More different values than this number something else."""


@dataclass(frozen=True)
class EpisodeTable(Table):
    """Some rows of a table, which messages name as they stand in the whole one."""

    rows: Integers | None = None

    def at(self, row: int) -> str:
        """Return how a person finds row `row` of these, counted from 0."""
        assert self.rows is not None
        return super().at(row) if self.lines is not None else f"row {int(self.rows[row]) + 1}"


def chosen(table: Table, episode: str | None, time: Sequence[str]) -> Table:
    """Return the rows of one episode.

    Parameters
    ----------
    table : Table
    episode : str, optional
        As its column shows it.
    time : sequence of str
        Columns of time: an episode that is not said is asked for only where one runs backward.

    Raises
    ------
    InputError
        There is no such column or episode, or there are several and none is chosen.
    """
    column = next((name for name in NAMES if name in table.columns), None)
    if episode is None:
        if column is not None and _restarts(table, time):
            words = _different(table.texts(column))
            if 1 < len(words) <= min(MOST, len(table) // 2):
                raise InputError(
                    f"{table.name}: column {column!r} tells {len(words)} recordings apart: "
                    f"{_shown(words)}; choose one with --episode NAME"
                )
        return table
    if column is None:
        raise InputError(
            f"--episode {episode}: {table.name} has no column that tells recordings apart "
            f"({', '.join(NAMES)})"
        )
    texts = table.texts(column)
    rows = np.flatnonzero([text == episode for text in texts])
    if not len(rows):
        raise InputError(
            f"--episode {episode}: column {column!r} of {table.name} has "
            f"{_shown(_different(texts))}"
        )
    taken = {
        name: values[rows] if isinstance(values, np.ndarray) else values.take(_indices(rows))
        for name, values in table.columns.items()
    }
    return EpisodeTable(
        **{
            **{name: getattr(table, name) for name in ("name", "decimal", "remarks")},
            "columns": taken,
            "lines": None if table.lines is None else table.lines[rows],
            "rows": rows,
        }
    )


def _indices(rows: Integers) -> object:
    import pyarrow as pa

    return pa.array(rows)


def _restarts(table: Table, time: Sequence[str]) -> bool:
    """Tell whether a column of time runs backward anywhere."""
    for name in time:
        if name in table.columns:
            return bool((np.diff(table.floats(name)) < 0.0).any())
    return False


def _different(texts: Sequence[str]) -> list[str]:
    return list(dict.fromkeys(texts))


def _shown(words: Sequence[str]) -> str:
    return ", ".join(words[:8]) + (", ..." if len(words) > 8 else "")
