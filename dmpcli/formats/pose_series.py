"""Poses and wrenches of a recording of any length: what is beyond some thousand rows lies on disk.

Rows come one by one, in any order of time; they leave in blocks, by time, each stamp once.
"""

import tempfile
import weakref
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import IO, Any

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.errors import InputError
from dmpcli.formats.motion import MotionStroke
from dmpcli.records.columns import LARGEST
from dmpcli.records.rotation_forms import wrong
from dmpcli.spatial.rotations import from_quaternion

BLOCK = 1 << 17
"""Rows that leave at once."""

_HELD = 1 << 14
"""Rows of one series that are held in memory while they come."""

_FAR = 4
"""Rows that are read for one that is wanted, before they are fetched one by one."""

_EPOCH = 1_000_000 * 1_000_000_000
"""A first stamp beyond this, ns, counts from an epoch."""

POSE = 7
"""Numbers of a row of poses: x, y, z, m, and a quaternion x, y, z, w."""


@dataclass
class Series:
    """What one topic or frame holds.

    Attributes
    ----------
    width : int
        Numbers of a row.
    frame : str
        In which they are.
    stamps : array of int
        ns.
    bad : (int, str) or None
        The first row, from 0, that is no such thing, and why.
    """

    width: int
    frame: str = ""
    stamps: "array[int]" = field(default_factory=lambda: array("q"))
    bad: tuple[int, str] | None = None
    _values: "array[float]" = field(default_factory=lambda: array("d"))
    _file: IO[bytes] | None = None
    _stored: int = 0

    def add(self, stamp: int, row: tuple[float, ...]) -> None:
        """Take one row.

        Raises
        ------
        InputError
            There is no room on the disk.
        """
        self.stamps.append(stamp)
        self._values.extend(row)
        if len(self._values) >= _HELD * self.width:
            self._store()

    def _store(self) -> None:
        held = self._held()
        self._look_at(held)
        try:
            if self._file is None:
                self._file = tempfile.TemporaryFile()  # noqa: SIM115
                weakref.finalize(self, self._file.close)
            self._file.write(held.tobytes())
            self._file.flush()
        except OSError as error:
            raise InputError(
                f"{tempfile.gettempdir()}: cannot be written: {error.strerror}; TMPDIR names "
                "another folder for what does not fit into memory"
            ) from None
        self._stored += len(held)
        self._values = array("d")

    def _held(self) -> Floats:
        return np.array(self._values, dtype=float).reshape(-1, self.width)

    def _look_at(self, rows: Floats) -> None:
        if self.bad is not None or not len(rows):
            return
        beyond: Booleans = np.asarray(~(np.abs(rows) <= LARGEST).all(axis=1))
        if beyond.any():
            first = int(np.argmax(beyond))
            self.bad = (
                self._stored + first,
                f"holds a value that is not a number, or beyond {LARGEST:g}",
            )
        elif self.width == POSE and (fault := wrong("quaternion", rows[:, 3:])) is not None:
            self.bad = (self._stored + fault[0], fault[1])

    def judged(self) -> tuple[int, str] | None:
        """Return what is wrong with any row; see `bad`."""
        self._look_at(self._held())
        return self.bad

    def rows(self, wanted: Integers) -> Floats:
        """Return rows by their numbers, shape (len(wanted), width)."""
        held = self._held()
        if self._file is None:
            return np.asarray(held[wanted])
        low, high = int(wanted.min()), int(wanted.max()) + 1
        if high - low > _FAR * len(wanted) + _HELD:
            whole = np.memmap(self._file, float, "r", shape=(self._stored, self.width))
            found = np.empty((len(wanted), self.width))
            stored = wanted < self._stored
            found[stored] = whole[wanted[stored]]
            found[~stored] = held[wanted[~stored] - self._stored]
            return found
        self._file.seek(8 * self.width * low)
        count = max(min(high, self._stored) - low, 0) * self.width
        near = np.fromfile(self._file, dtype=float, count=count).reshape(-1, self.width)
        if high > self._stored:
            near = np.concatenate([near, held[max(low - self._stored, 0) : high - self._stored]])
        return np.asarray(near[wanted - low])


class PoseBlocks:
    """A stroke that comes in blocks.

    Parameters
    ----------
    poses : Series
    wrench : Series, optional
        In the poses' axes, over all of their time, its stamps in order.

    Attributes
    ----------
    repeated : int
        Rows whose stamp another had before.
    """

    id = "1"

    def __init__(self, poses: Series, wrench: Series | None = None) -> None:
        self._poses, self._wrench = poses, wrench
        stamps = np.frombuffer(poses.stamps, dtype=np.int64)
        self._order: Integers | None = None
        if (np.diff(stamps) <= 0).any():
            order = np.argsort(stamps, kind="stable")
            self._order = order[np.concatenate([[True], np.diff(stamps[order]) > 0])]
        self._stamps = stamps if self._order is None else stamps[self._order]
        self.repeated = len(stamps) - len(self._stamps)
        # From 0 where stamps count from an epoch; ours count from the stroke's beginning.
        first = int(self._stamps[0])
        self._zero = first if first > _EPOCH else 0

    def __len__(self) -> int:
        return len(self._stamps)

    @property
    def duration(self) -> float:
        """From the first to the last pose, s."""
        return float((int(self._stamps[-1]) - int(self._stamps[0])) * 1e-9)

    def blocks(self, size: int = BLOCK) -> Iterator[MotionStroke]:
        """Yield the stroke, so many samples at a time."""
        for first in range(0, len(self), size):
            stamps = self._stamps[first : first + size]
            rows = (
                np.arange(first, first + len(stamps))
                if self._order is None
                else self._order[first : first + size]
            )
            values = self._poses.rows(rows)
            q = values[:, 3:]
            R = from_quaternion(q / np.linalg.norm(q, axis=1, keepdims=True))
            t: Floats = np.asarray((stamps - self._zero) * 1e-9, dtype=float)
            yield MotionStroke(t, values[:, :3] * 1000.0, R, wrench=self._felt(stamps))

    def _felt(self, stamps: Any) -> Floats | None:
        """Wrench at stamps of poses, shape (n, 6), by straight lines between its own."""
        if self._wrench is None:
            return None
        own = np.frombuffer(self._wrench.stamps, dtype=np.int64)
        first = max(int(np.searchsorted(own, stamps[0], side="right")) - 1, 0)
        last = min(int(np.searchsorted(own, stamps[-1], side="left")) + 1, len(own))
        at, since = (stamps - own[0]) * 1e-9, (own[first:last] - own[0]) * 1e-9
        values = self._wrench.rows(np.arange(first, last))
        return np.column_stack([np.interp(at, since, column) for column in values.T])

    def whole(self) -> MotionStroke:
        """Return the stroke in one."""
        [one] = self.blocks(len(self))
        return one
