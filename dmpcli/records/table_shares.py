"""Some of the rows of a long table: those of every so-many-th part, or any that were chosen."""

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Booleans, Integers


@dataclass(frozen=True)
class Share:
    """Some of the rows of a table, which is cut into parts of so many.

    Attributes
    ----------
    size : int
        Rows of a part.
    has : callable
        Tells which parts (N,), by their numbers, are of the share.
    """

    size: int
    has: Callable[[Integers], Booleans]

    def rows(self, begin: int, end: int) -> Integers:
        """Return which rows of a stretch are of the share, rising."""
        parts = np.arange(begin // self.size, -(-end // self.size))
        rows = np.add.outer(parts[self.has(parts)] * self.size, np.arange(self.size)).ravel()
        return rows[(rows >= begin) & (rows < end)]

    def count(self, rows: int) -> int:
        """Return how many of so many rows are of the share."""
        parts = np.arange(-(-rows // self.size))
        size = np.minimum(self.size, rows - parts * self.size)
        return int(size[self.has(parts)].sum())

    def pieces(self, rows: int) -> Iterator[int]:
        """Yield how many of its rows each piece is to have, so many at most."""
        return itertools.repeat(rows)


@dataclass(frozen=True)
class ChosenRows:
    """Some of the rows of a table, wherever they stand.

    Attributes
    ----------
    numbers : array of int, shape (k,)
        Which, counted from 0, rising.
    groups : list of int
        How many of them, one after the other, belong together: no piece ends within such a group.
    """

    numbers: Integers
    groups: list[int]

    def rows(self, begin: int, end: int) -> Integers:
        """Return which rows of a stretch are of the share, rising."""
        return self.numbers[slice(*np.searchsorted(self.numbers, [begin, end]).tolist())]

    def count(self, rows: int) -> int:
        """Return how many of so many rows are of the share."""
        return int(np.searchsorted(self.numbers, rows))

    def pieces(self, rows: int) -> Iterator[int]:
        """Yield how many of its rows each piece is to have, so many at most."""
        held = 0
        for group in self.groups:
            if held and held + group > rows:
                yield held
                held = 0
            held += group
        yield from itertools.repeat(max(held, 1))
