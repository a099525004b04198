"""Touched points as they are taken, one by one: CSV for ``register`` and ``generalize --pairs``.

Every point is kept at once: a file is written anew, whole, with each; a pipe gets its line.
"""

from pathlib import Path

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.records import file_io
from dmpcli.records.pairs import GOAL, GOAL_ANGLES, START, START_ANGLES
from dmpcli.records.schemas import POSE
from dmpcli.records.touched import PART
from dmpcli.spatial.rotations import to_euler

_MM, _RAD = 4, 7
"""Decimals: a tenth of a micrometre, and as much at a metre."""


class PointFile:
    """Rows ``x y z rx ry rz``, for `dmpcli register`.

    Parameters
    ----------
    path : str
        ``-`` is standard output.
    part : array, shape (n, 3), optional
        The same points on the part, in their order: columns ``px py pz``.
    """

    def __init__(self, path: str, part: Floats | None = None) -> None:
        self._path, self._part = path, part
        columns = (*POSE, *(() if part is None else PART))
        self._lines = [",".join(columns)]
        self._told = 0
        self.count = 0
        """Points that were taken."""

    @property
    def next(self) -> str:
        """What a person is to touch next."""
        if self._part is None:
            return f"point {self.count + 1}"
        place = ", ".join(f"{value:g}" for value in self._part[self.count])
        return f"point {self.count + 1} of {len(self._part)}, ({place}) on the part"

    @property
    def full(self) -> bool:
        """Whether no point of the part is left."""
        return self._part is not None and self.count >= len(self._part)

    def add(self, position: Floats, rotation: Floats) -> None:
        """Keep one point.

        Parameters
        ----------
        position, rotation : array, shape (3,) and (3, 3)
            Actual TCP, mm.

        Raises
        ------
        InputError
            The file cannot be written.
        """
        cells = _pose(position, rotation)
        if self._part is not None:
            cells += [repr(float(value)) for value in self._part[self.count]]
        self._lines.append(",".join(cells))
        self.count += 1
        self._write(len(self._lines))

    def close(self) -> None:
        """Keep what is not yet: nothing."""

    def _write(self, complete: int) -> None:
        """Keep the lines; on a pipe, those that will not change any more."""
        if self._path == file_io.DASH:
            ready = self._lines[self._told : complete]
            self._told = complete
            file_io.say("".join(f"{line}\n" for line in ready).encode())
        else:
            file_io.write(Path(self._path), "".join(f"{line}\n" for line in self._lines).encode())


class PairFile(PointFile):
    """Rows ``id x0 y0 z0 rx0 ry0 rz0 xg yg zg rxg ryg rzg``, for `dmpcli generalize --pairs`.

    A start whose goal is still missing stands in the file with empty cells, which its reader names.

    Parameters
    ----------
    path : str
        ``-`` is standard output.
    angles : bool
        Whether the orientations are kept: `generalize` then draws with them.
    """

    def __init__(self, path: str, angles: bool = False) -> None:
        super().__init__(path)
        self._angles = angles
        start = START + (START_ANGLES if angles else ())
        goal = GOAL + (GOAL_ANGLES if angles else ())
        self._empty = "," * len(goal)
        self._lines = [",".join(("id", *start, *goal))]

    @property
    def next(self) -> str:
        """What a person is to touch next."""
        return f"{'goal' if self.count % 2 else 'start'} of pair {self.count // 2 + 1}"

    @property
    def open(self) -> bool:
        """Whether the last start has no goal."""
        return self.count % 2 == 1

    def add(self, position: Floats, rotation: Floats) -> None:
        """Keep a start, or the goal to the last start; see `PointFile.add`."""
        cells = ",".join(_pose(position, rotation)[: 6 if self._angles else 3])
        if self.open:
            self._lines[-1] = f"{self._lines[-1].removesuffix(self._empty)},{cells}"
        else:
            self._lines.append(f"{self.count // 2 + 1},{cells}{self._empty}")
        self.count += 1
        self._write(len(self._lines) - (1 if self.open else 0))

    def close(self) -> None:
        """Keep a last start without its goal, which a pipe has not got yet."""
        if self._path == file_io.DASH and self.open:
            self._write(len(self._lines))


def _pose(position: Floats, rotation: Floats) -> list[str]:
    angles = np.round(to_euler(rotation), _RAD)
    return [repr(float(v) + 0.0) for v in (*np.round(position, _MM), *angles)]
