"""Whether a recording can be in the units it was read in: strokes are drawn by hands and arms.

Pure functions of time and position, for whatever reads a recording.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.records.layouts import LENGTH, TIME

EXTENT = (5.0, 5000.0)
"""Diagonals of the box around a stroke, mm, that need no question."""

SPEED = (0.5, 2000.0)
"""Mean speeds while moving, mm/s, that need no question."""

LONGEST = 3600.0
"""Durations, s, that need no question."""

REFUSED = 1.0
"""A stroke smaller than this, mm, is refused unless its unit was said."""

# Chunks in which a recording is looked at, so that noise from sample to sample is no movement,
# and the part of the fastest ones' speed above which a chunk moves.
_CHUNKS, _MOVES = 200, 0.25


@dataclass(frozen=True)
class Measures:
    """What units show in.

    Attributes
    ----------
    extent : float
        Diagonal of the box around the path, mm.
    speed : float
        Mean speed while it moves, mm/s; 0 where nothing does.
    duration : float
        s.
    """

    extent: float
    speed: float
    duration: float

    def scaled(self, length: float, time: float) -> "Measures":
        """Return the measures if a length of 1 were `length`, a time of 1 `time`."""
        return Measures(self.extent * length, self.speed * length / time, self.duration * time)

    def plausible(self) -> bool:
        """Tell whether nothing about the measures is doubtful."""
        return (
            EXTENT[0] <= self.extent <= EXTENT[1]
            and (SPEED[0] <= self.speed <= SPEED[1])
            and self.duration <= LONGEST
        )


def measures(t: Floats, position: Floats) -> Measures:
    """Measure a recording.

    Parameters
    ----------
    t : array, shape (T,)
        Increasing, s.
    position : array, shape (T, 3)
        mm.
    """
    extent = float(np.linalg.norm(np.ptp(position, axis=0)))
    ends = np.unique(np.linspace(0, len(t) - 1, min(len(t), _CHUNKS + 1)).astype(int))
    way = np.linalg.norm(np.diff(position[ends], axis=0), axis=1)
    time = np.diff(t[ends])
    speed = way / time
    moves = speed > _MOVES * float(np.quantile(speed, 0.95))
    mean = float(way[moves].sum() / time[moves].sum()) if moves.any() else 0.0
    return Measures(extent, mean, float(t[-1] - t[0]))


def likely(found: Measures, length: str, time: str) -> dict[str, str]:
    """Guess the units in which nothing would be doubtful.

    Parameters
    ----------
    found : Measures
        In the units `length` and `time`, converted to mm and s.

    Returns
    -------
    dict
        ``length`` or ``time`` or both, by what to change, the fewest changes first; empty where
        no units help.
    """
    lengths = [length, *(unit for unit in ("m", "mm", "cm", "in") if unit != length)]
    times = [time, *(unit for unit in ("ms", "us", "ns", "s") if unit != time)]
    tries = sorted(product(range(len(lengths)), range(len(times))), key=lambda t: _cost(*t))
    for i, j in tries:
        scaled = found.scaled(LENGTH[lengths[i]] / LENGTH[length], TIME[times[j]] / TIME[time])
        if (i or j) and scaled.plausible():
            return ({"length": lengths[i]} if i else {}) | ({"time": times[j]} if j else {})
    return {}


def _cost(i: int, j: int) -> tuple[int, int]:
    """Order guesses: one change before two, the commoner unit first."""
    return (i > 0) + (j > 0), i + j


def options(units: Mapping[str, str]) -> str:
    """Return units as the options that say them."""
    return " ".join(f"--{key}-unit {unit}" for key, unit in units.items())


def doubts(found: Measures, length: str, time: str) -> list[str]:
    """Say what is doubtful about a recording's units, and the likely option.

    Parameters
    ----------
    found : Measures
    length, time : str
        The units it was read in.

    Returns
    -------
    list of str
        At most one line, of all that is doubtful.
    """
    if found.plausible():
        return []
    said = []
    if not EXTENT[0] <= found.extent <= EXTENT[1]:
        said.append(f"is {found.extent:.3g} mm large")
    if not SPEED[0] <= found.speed <= SPEED[1]:
        said.append(f"moves at {found.speed:.3g} mm/s in the mean")
    if found.duration > LONGEST:
        said.append(f"lasts {found.duration:.5g} s")
    guess = likely(found, length, time)
    remedy = (
        f"if that is wrong, {options(guess)}" if guess else "check --length-unit and --time-unit"
    )
    return [f"the stroke {' and '.join(said)}, read in {length} and {time}; {remedy}"]
