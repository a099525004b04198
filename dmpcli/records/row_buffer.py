"""What a control loop remembers of each cycle: rows that one thread adds and others read.

The loop's thread alone adds; a row counts once it is whole, so that a journal may read rows in
another thread without a lock. Blocks of rows never move, and no earlier row is touched again.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from dmpcli.arrays import Floats

RECOVERED = "recovered after a crash"
"""Why a run ended that is known by its journal alone."""

_BLOCK = 2048


class RowBuffer:
    """A growing table of numbers in groups (a position, a rotation, a time) and of texts.

    Parameters
    ----------
    groups : mapping of str to int
        How many numbers each group holds.
    texts : sequence of str
        Names of the columns of text.

    Attributes
    ----------
    mirror : callable or None
        Given each row that is added, all its numbers (n,) and texts, to copy it elsewhere.
    """

    def __init__(self, groups: Mapping[str, int], texts: Sequence[str] = ()) -> None:
        self.groups = dict(groups)
        ends = np.cumsum([0, *self.groups.values()]).tolist()
        self._width = ends[-1]
        cuts = map(slice, ends[:-1], ends[1:])
        self._slices = dict(zip(self.groups, cuts, strict=True))
        self._blocks: list[Floats] = []
        self._texts: dict[str, list[str]] = {name: [] for name in texts}
        self._count = 0
        self.mirror: Callable[[Floats, Sequence[str]], None] | None = None

    def __len__(self) -> int:
        return self._count

    @property
    def texts(self) -> tuple[str, ...]:
        """Names of the columns of text."""
        return tuple(self._texts)

    def add(self, numbers: Sequence[float | Floats], texts: Sequence[str] = ()) -> None:
        """Add one row.

        Parameters
        ----------
        numbers : sequence of float or array
            One for each group, in order; arrays of as many numbers as the group holds.
        texts : sequence of str
            One for each column of text, in order.
        """
        at = self._count % _BLOCK
        if at == 0:
            self._blocks.append(np.empty((_BLOCK, self._width)))
        row = self._blocks[-1][at]
        for cut, value in zip(self._slices.values(), numbers, strict=True):
            row[cut] = value.ravel() if isinstance(value, np.ndarray) else value
        for column, text in zip(self._texts.values(), texts, strict=True):
            column.append(text)
        # Last: whoever reads the length may read every row below it.
        self._count += 1
        if self.mirror is not None:
            self.mirror(row, texts)

    def extend(self, numbers: Floats, texts: Mapping[str, Sequence[str]]) -> None:
        """Add many rows at once.

        Parameters
        ----------
        numbers : array, shape (n, sum of the groups)
        texts : mapping of str to sequence of str
            n of each.
        """
        for name, column in self._texts.items():
            column.extend(texts[name])
        taken = 0
        while taken < len(numbers):
            at = self._count % _BLOCK
            if at == 0:
                self._blocks.append(np.empty((_BLOCK, self._width)))
            part = numbers[taken : taken + _BLOCK - at]
            self._blocks[-1][at : at + len(part)] = part
            self._count += len(part)
            taken += len(part)

    def whole(self, first: int, last: int, cut: slice = slice(None)) -> Floats:
        """Rows `first` to `last`, all groups or a cut of them, as one array.

        Parameters
        ----------
        first, last : int
            From 0; `last` is the first that is not taken, and at most the length.
        cut : slice
            Of a row's numbers, groups one after the other.

        Returns
        -------
        array, shape (last - first, numbers of the cut)
            A copy: rows that are added later do not show in it.
        """
        parts = [part[:, cut] for part in self._parts(first, last)]
        return np.concatenate([np.empty((0, self._width))[:, cut], *parts])

    def _parts(self, first: int, last: int) -> Iterator[Floats]:
        while first < last:
            block, at = divmod(first, _BLOCK)
            taken = min(last - first, _BLOCK - at)
            yield self._blocks[block][at : at + taken]
            first += taken

    def numbers(self, name: str, first: int = 0) -> Floats:
        """One group from the row `first` on, shape (rows,) or (rows, numbers of the group)."""
        values = self.whole(first, self._count, self._slices[name])
        return values[:, 0] if self.groups[name] == 1 else values

    def rotations(self, name: str) -> Floats:
        """One group of nine as rotations, shape (rows, 3, 3)."""
        return self.numbers(name).reshape(-1, 3, 3)

    def words(self, name: str, first: int = 0, last: int | None = None) -> list[str]:
        """Texts of one column, of the rows `first` to `last`.

        Parameters
        ----------
        name : str
            One of `texts`.
        first : int
            From 0.
        last : int, optional
            The first row that is not taken; without it, all that are whole.
        """
        return self._texts[name][first : self._count if last is None else last]
