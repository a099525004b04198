"""Demonstrations as they are compared: their paths, without the time at which they rest."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp import arc_length, pauses
from dmpcli.dmp.arc_length import TimeLaw

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

# Rests of several demonstrations are one where they lie no farther apart than this part of the
# length.
_SAME_PLACE = 0.02
# A path goes straight on where its direction over this part of the length changes by no more than
# 45 degrees.
_AROUND = 0.01
_STRAIGHT = np.sqrt(0.5)
# Nodes of a path's law at least: few samples carry a spline that is finer than they are.
_NODES = 400


@dataclass(frozen=True)
class ComparedPath:
    """One smoothed demonstration, in the coordinates that are compared.

    Attributes
    ----------
    duration : float
        s.
    x : array, shape (M, D)
        Positions at even times from 0 to `duration`, mm.
    noise : float
        Standard deviation of what smoothing left in the positions, mm.
    angles : array, shape (M, A), or None
        Continuous, rad; carried along, not compared.
    """

    duration: float
    x: Floats
    noise: float = 0.0
    angles: Floats | None = None

    @property
    def columns(self) -> Floats:
        """Positions and angles side by side, shape (M, D + A)."""
        return self.x if self.angles is None else np.hstack([self.x, self.angles])


@dataclass(frozen=True)
class Rest:
    """A pause in the middle of a demonstration.

    Attributes
    ----------
    index : int
        Of the demonstration, from 0.
    start, end : float
        Time in it, s.
    left_out : bool
        Whether it was left out, since fewer than half of the demonstrations rest there.
    """

    index: int
    start: float
    end: float
    left_out: bool


@dataclass(frozen=True)
class Stay:
    """A rest that is kept.

    Attributes
    ----------
    start : float
        Time in motion, without any rest, s.
    duration : float
        s.
    place : float
        Part of the length, from 0 to 1.
    """

    start: float
    duration: float
    place: float


@dataclass(frozen=True)
class Rests:
    """The rests of all demonstrations, sorted out.

    Attributes
    ----------
    stays : int
        Number of places at which a rest is kept.
    cuts : list of list of tuple of int
        For each demonstration first and last sample of the rests that are left out.
    held : list of dict
        For each demonstration first and last sample of its rest at each of the `stays`.
    told : list of Rest
    """

    stays: int
    cuts: list[list[tuple[int, int]]]
    held: list[dict[int, tuple[int, int]]]
    told: list[Rest]


@dataclass(frozen=True)
class Moving:
    """A demonstration's path, and when it is where while it moves.

    Attributes
    ----------
    columns : BSpline
        Positions and angles by time without the rests that are left out, mm and rad.
    dimensions : int
        D, of the positions.
    duration : float
        Of that, s.
    law : TimeLaw
        Arc length by time without any rests.
    stays : dict of Stay
        Rests that are kept, by the number of their place.
    skipped : list of float
        Places of the rests that are left out, as parts of the length, where the path goes straight
        on: at a corner the hand stays slow.
    """

    columns: "BSpline"
    dimensions: int
    duration: float
    law: TimeLaw
    stays: dict[int, Stay]
    skipped: list[float]

    def at(self, places: Floats) -> Floats:
        """Positions at parts of the length, mm, shape (P, D)."""
        t = self.law.time(self.law.length * places)
        t = t + sum(stay.duration * (t > stay.start) for stay in self.stays.values())
        path = _positions(self.columns, self.dimensions)
        return np.asarray(path(np.clip(t, 0.0, self.duration)))


def rests_of(demonstrations: Sequence[ComparedPath]) -> Rests:
    """Find each demonstration's rests, and which to keep.

    Kept is a rest that at least half of the demonstrations have at about the same place, and any
    during which the tool turns. The others are left out.

    Parameters
    ----------
    demonstrations : sequence of ComparedPath

    Returns
    -------
    Rests
    """
    n = len(demonstrations)
    found: list[tuple[float, int, tuple[int, int], bool]] = []
    for i, d in enumerate(demonstrations):
        own = pauses.rests(np.linspace(0.0, d.duration, len(d.x)), d.x, d.noise)
        if not own:
            continue
        steps = np.linalg.norm(np.diff(d.x, axis=0), axis=1)
        for a, b in own:
            steps[a:b] = 0.0
        share = np.append(0.0, np.cumsum(steps)) / steps.sum()
        for a, b in own:
            turns = d.angles is not None and pauses.turning(d.angles, (a, b))
            found.append((float(share[a]), i, (a, b), turns))
    found.sort(key=lambda rest: rest[:2])
    places: list[list[tuple[float, int, tuple[int, int], bool]]] = []
    for rest in found:
        here = places[-1] if places else []
        near = bool(here) and rest[0] - here[0][0] <= _SAME_PLACE
        if near and all(rest[1] != other[1] for other in here):
            here.append(rest)
        else:
            places.append([rest])
    result = Rests(0, [[] for _ in range(n)], [{} for _ in range(n)], [])
    stays = 0
    for here in places:
        keep = 2 * len(here) >= n or any(turns for *_, turns in here)
        for _, i, span, _ in here:
            if keep:
                result.held[i][stays] = span
            else:
                result.cuts[i].append(span)
            step = demonstrations[i].duration / (len(demonstrations[i].x) - 1)
            result.told.append(Rest(i, step * span[0], step * span[1], not keep))
        stays += keep
    told = sorted(result.told, key=lambda rest: (rest.index, rest.start))
    return Rests(stays, [sorted(c) for c in result.cuts], result.held, told)


def of_stroke(
    demonstration: ComparedPath,
    cuts: Sequence[tuple[int, int]],
    held: dict[int, tuple[int, int]],
) -> Moving:
    """A demonstration's path, and when it is where.

    Parameters
    ----------
    demonstration : ComparedPath
    cuts : sequence of tuple of int
        First and last sample of rests that are left out, in order.
    held : dict of tuple of int
        Likewise of those that are kept.

    Returns
    -------
    Moving
    """
    step = demonstration.duration / (len(demonstration.x) - 1)
    dimensions = demonstration.x.shape[1]
    x, kept = pauses.without(demonstration.columns, cuts)
    finer = max(1, -(-_NODES // (len(x) - 1)))
    duration = step * (len(x) - 1)
    columns = through(np.linspace(0.0, duration, len(x)), x)
    path = _positions(columns, dimensions)
    law = arc_length.of_path(path, np.linspace(0.0, duration, finer * (len(x) - 1) + 1))

    stand = np.zeros(len(law.t) - 1, dtype=bool)
    index = {k: np.searchsorted(kept, span) * finer for k, span in held.items()}
    for a, b in index.values():
        stand[a:b] = True
    passed = np.append(0.0, np.cumsum(np.where(stand, 0.0, np.diff(law.t))))
    length = np.append(0.0, np.cumsum(np.where(stand, 0.0, np.diff(law.s))))
    stays = {
        k: Stay(float(passed[a]), float(law.t[b] - law.t[a]), float(length[a] / length[-1]))
        for k, (a, b) in index.items()
    }
    places = [float(length[np.searchsorted(kept, a) * finer] / length[-1]) for a, _ in cuts]
    moves = np.append(True, ~stand)
    law = arc_length.monotone(passed[moves], length[moves], law.speed[moves])
    moving = Moving(columns, dimensions, duration, law, stays, [])
    moving.skipped.extend(p for p in places if _straight(moving, p))
    return moving


def _straight(moving: Moving, place: float) -> bool:
    """Whether the path goes on in about the same direction at a place."""
    around = np.clip(np.array([place - _AROUND, place, place + _AROUND]), 0.0, 1.0)
    before, after = np.diff(moving.at(around), axis=0)
    return bool(before @ after > _STRAIGHT * np.linalg.norm(before) * np.linalg.norm(after))


def _positions(columns: "BSpline", dimensions: int) -> "BSpline":
    return columns.construct_fast(columns.t, columns.c[:, :dimensions], columns.k)


def through(t: Floats, columns: Floats) -> "BSpline":
    """The quintic spline through even samples; of a lower odd degree where they are fewer than six.

    Parameters
    ----------
    t : array, shape (M,)
    columns : array, shape (M, C)

    Returns
    -------
    BSpline
    """
    from scipy.interpolate import make_interp_spline

    return make_interp_spline(t, columns, k=min(5, 2 * ((len(t) - 2) // 2) + 1))
