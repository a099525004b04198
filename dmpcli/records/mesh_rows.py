"""Rows of numbers in text files of vertices and faces, one row a line."""

import warnings
from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.errors import InputError


@dataclass(frozen=True)
class Rows:
    """The numbers of a text, line by line; blank lines are no rows.

    Attributes
    ----------
    name : str
        Of the file.
    values : array, shape (w,)
    start, count : array, shape (r,)
        Of each row's numbers in `values`.
    line : array, shape (r,)
        In the file, from 1.
    """

    name: str
    values: Floats
    start: Integers
    count: Integers
    line: Integers

    def __len__(self) -> int:
        return len(self.start)

    def table(self, first: int, rows: int, columns: int, what: str) -> Floats:
        """Return the first numbers of some rows, shape (rows, columns).

        Parameters
        ----------
        first, rows : int
            From which row on, from 0, and how many.
        columns : int
            Rows may hold more numbers, which are not taken.
        what : str
            What messages call a row.

        Raises
        ------
        InputError
            Fewer rows, or a row that is too short; by its line.
        """
        self._whole(first, rows, what)
        self._long_enough(first, rows, np.full(rows, columns), what)
        found: Floats = self.values[self.start[first : first + rows, None] + np.arange(columns)]
        return found

    def lists(self, first: int, rows: int, before: int, what: str) -> tuple[Integers, Integers]:
        """Return lists that stand in rows after `before` numbers, each after its own length.

        Parameters
        ----------
        first, rows : int
            From which row on, from 0, and how many.
        before : int
            Numbers of each row before its list's length.
        what : str
            What messages call a row.

        Returns
        -------
        tuple of array (k,), array (rows,)
            The numbers of all of them, one list after the other, and their lengths.

        Raises
        ------
        InputError
            Fewer rows, a row that is too short, a length below 0, or a number that is not whole; by
            its line.
        """
        self._whole(first, rows, what)
        self._long_enough(first, rows, np.full(rows, before + 1), what)
        start = self.start[first : first + rows] + before
        counts = self._whole_numbers(self.values[start], first, np.arange(rows), what)
        if rows and counts.min() < 0:
            self._refuse(first + int(np.argmin(counts)), f"a {what} has a length below 0")
        self._long_enough(first, rows, counts + before + 1, what)
        row = np.repeat(np.arange(rows), counts)
        ends = np.cumsum(counts)
        within = np.arange(len(row)) - np.repeat(ends - counts, counts)
        found = self.values[start[row] + 1 + within]
        return self._whole_numbers(found, first, row, what), counts

    def _whole(self, first: int, rows: int, what: str) -> None:
        if first + rows > len(self):
            raise InputError(
                f"{self.name}: its header announces {rows} rows of {what}, but "
                f"{max(len(self) - first, 0)} whole ones follow: truncated or damaged; export the "
                "part again"
            )

    def _long_enough(self, first: int, rows: int, need: Integers, what: str) -> None:
        short = self.count[first : first + rows] < need
        if short.any():
            row = int(np.argmax(short))
            self._refuse(
                first + row,
                f"a {what} of {need[row]} numbers is meant here, but "
                f"{self.count[first + row]} stand there",
            )

    def _whole_numbers(self, found: Floats, first: int, row: Integers, what: str) -> Integers:
        with np.errstate(invalid="ignore"):
            wrong = ~(np.abs(found) < 2.0**53) | (found != np.floor(found))
        if wrong.any():
            at = int(np.argmax(wrong))
            self._refuse(first + int(row[at]), f"a {what} holds {found[at]:g}, no whole number")
        return found.astype(np.int64)

    def _refuse(self, row: int, reason: str) -> None:
        raise InputError(
            f"{self.name}: line {self.line[row]}: {reason}: truncated or damaged; export the part "
            "again"
        )


def rows(name: str, text: bytes, before: int) -> Rows:
    """Read the numbers of a text.

    Parameters
    ----------
    name : str
        Of the file.
    text : bytes
    before : int
        Lines of the file before it.

    Raises
    ------
    InputError
        A word that is no number; by its line.
    """
    text = text.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    letters = np.frombuffer(text + b"\n", dtype=np.uint8)
    blank = (letters == 32) | ((letters >= 9) & (letters <= 13))
    begins = np.flatnonzero(~blank[:-1] & np.concatenate([[True], blank[:-2]]))
    ends = np.flatnonzero(letters == 10)
    words = np.diff(np.searchsorted(begins, ends), prepend=0)
    with warnings.catch_warnings():
        # numpy stops at a word that is none, with a warning.
        warnings.simplefilter("ignore", DeprecationWarning)
        try:
            values = np.fromstring(text, dtype=float, sep=" ") if len(begins) else np.empty(0)
        except ValueError:
            values = np.empty(0)
    if len(values) != len(begins):
        _refuse_word(name, text, before)
    filled = np.flatnonzero(words)
    count = words[filled]
    return Rows(name, values, np.cumsum(count) - count, count, before + 1 + filled)


def _refuse_word(name: str, text: bytes, before: int) -> None:
    for number, line in enumerate(text.split(b"\n"), start=before + 1):
        for word in line.split():
            try:
                float(word)
            except ValueError:
                shown = word[:20].decode("latin-1")
                raise InputError(
                    f"{name}: line {number}: {shown!r} is no number; mend the line, or export the "
                    "part again"
                ) from None
    raise InputError(f"{name}: holds words that are no numbers; export the part again")
