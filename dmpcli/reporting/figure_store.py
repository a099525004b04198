"""The figures of all strokes of a batch, kept in a file: memory does not grow with the batch."""

import os
import tempfile
import weakref

import numpy as np

from dmpcli.arrays import Floats, Integers


class FigureStore:
    """Columns of figures, one value a stroke, NaN until it is put in; the file goes with it.

    Parameters
    ----------
    count : int
        Strokes.
    names : tuple of str
        Of the figures.
    """

    def __init__(self, count: int, names: tuple[str, ...]) -> None:
        self.count, self.names = count, names
        self._file = tempfile.TemporaryFile(buffering=0)  # noqa: SIM115 (as long as this lives)
        weakref.finalize(self, self._file.close)
        unknown = np.full(min(count, _AT_ONCE), np.nan).tobytes()
        for _ in names:
            left = 8 * count
            while left > 0:
                left -= self._file.write(unknown[:left]) or 0

    def put(self, rows: Integers, table: Floats) -> None:
        """Keep the figures (k, len(names)) of some strokes, by rows (k,)."""
        ends = np.flatnonzero(np.diff(rows) != 1) + 1
        for run, some in zip(np.split(rows, ends), np.split(table, ends), strict=True):
            for i, values in enumerate(np.ascontiguousarray(some.T)):
                self._write(8 * (i * self.count + int(run[0])), values.tobytes())

    def column(self, name: str) -> Floats:
        """Return the values of one figure, shape (count,)."""
        self._file.seek(8 * self.names.index(name) * self.count)
        values = np.fromfile(self._file, dtype=float, count=self.count)
        assert len(values) == self.count
        return values

    def _write(self, at: int, content: bytes) -> None:
        while content:
            done = os.pwrite(self._file.fileno(), content, at)
            at, content = at + done, content[done:]


_AT_ONCE = 1 << 16
"""Values written at once."""
