"""Which rows of a table of pairs lie in which part: told from the table alone, before any is drawn.

Without surfaces of its own a table is cut in its order. One that names a surface for each pair is
grouped first, so that a surface is read for as few parts as can be, and a part holds few of them;
within a part the order is that of the table.
"""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats, Integers, first_seen

WINDOW = 100_000
"""Rows that are grouped by their surfaces together."""


@dataclass(frozen=True)
class Cut:
    """The parts of a table of B rows.

    Attributes
    ----------
    part : array of int, shape (B,)
        The part of each row.
    """

    part: Integers

    def __post_init__(self) -> None:
        order = np.argsort(self.part, kind="stable")
        count = int(self.part.max(initial=-1)) + 1
        object.__setattr__(self, "_order", order)
        first = np.searchsorted(self.part[order], np.arange(count + 1))
        object.__setattr__(self, "_first", first)

    def rows(self, number: int) -> Integers:
        """Rows of a part, rising."""
        first: Integers = self._first  # type: ignore[attr-defined]
        order: Integers = self._order  # type: ignore[attr-defined]
        return order[first[number] : first[number + 1]]

    @property
    def count(self) -> int:
        """How many parts there are."""
        return int(self.part.max(initial=-1)) + 1


def in_order(rows: Integers, size: int, first: int = 0) -> Cut:
    """Cut rows of a table, by their numbers, into parts of so many, counted from the first one.

    Parameters
    ----------
    rows : array of int, shape (B,)
        Their numbers in the whole table, from 0, rising.
    size : int
        Rows of the whole table in a part; those that are left out here leave a part smaller.
    first : int
        Number of the part that these rows begin in.
    """
    return Cut(rows // size - first)


def by_site(site: Integers, offset: Floats, size: int, most: int) -> Cut:
    """Cut rows so that each part holds few sites, and one stand-off.

    Parameters
    ----------
    site : array of int, shape (B,)
        Of each row.
    offset : array, shape (B,)
        Stand-off of each row, mm: what a part says of its strokes holds for all of them.
    size : int
        Rows in a part, at most.
    most : int
        Sites in a part, at most.
    """
    part = np.empty(len(site), dtype=np.int64)
    number = 0
    for first in range(0, len(site), WINDOW):
        window = slice(first, first + WINDOW)
        part[window], number = _window(site[window], offset[window], size, most, number)
    return Cut(part)


def _window(
    site: Integers, offset: Floats, size: int, most: int, number: int
) -> tuple[Integers, int]:
    """Part of each row, the first one with this number, and the number of the next one."""
    lift, group = first_seen(offset)[0], first_seen(site)[0]
    order = np.lexsort((group, lift))  # rows of one group stay in their order
    begins = np.flatnonzero(
        np.diff(lift[order], prepend=-1).astype(bool)
        | np.diff(group[order], prepend=-1).astype(bool)
    )
    ends = np.append(begins[1:], len(order))
    part = np.empty(len(site), dtype=np.int64)
    used, sites, height = 0, 0, -1
    for begin, end in zip(begins.tolist(), ends.tolist(), strict=True):
        if used and (sites == most or lift[order[begin]] != height):
            number, used, sites = number + 1, 0, 0
        height, sites = lift[order[begin]], sites + 1
        while begin < end:
            if used == size:
                number, used, sites = number + 1, 0, 1
            taken = min(size - used, end - begin)
            part[order[begin : begin + taken]] = number
            begin, used = begin + taken, used + taken
    return part, number + 1
