"""Bringing several demonstrations of one stroke to a common time.

Equal places correspond, whatever each hand's timing: by arc length, corrected where local lengths
differ (`path_registration`). A rest that fewer than half of the demonstrations have is left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp import agreement, path_registration, pauses
from dmpcli.dmp.agreement import Doubt
from dmpcli.dmp.arc_length import TimeLaw
from dmpcli.dmp.common_timing import mean_law, running_on
from dmpcli.dmp.demonstrations import ComparedPath, Moving, Rest, of_stroke, rests_of, through
from dmpcli.dmp.options import Align
from dmpcli.dmp.path_registration import Correspondence
from dmpcli.dmp.time_scaling import eased
from dmpcli.errors import InputError


@dataclass(frozen=True)
class Track:
    """Where in one demonstration the common times are.

    Attributes
    ----------
    duration : float
        Of the demonstration as recorded, s.
    samples : int
        M_i.
    cuts : tuple of tuple of int
        First and last sample of each rest that is left out.
    joined : array, shape (M,)
        Time since the demonstration's start, without such rests, s; non-decreasing.
    """

    duration: float
    samples: int
    cuts: tuple[tuple[int, int], ...]
    joined: Floats

    @property
    def times(self) -> Floats:
        """Time in the demonstration as recorded, s, shape (M,); a left-out rest is a jump."""
        if not self.cuts:
            return self.joined
        _, kept = pauses.without(np.zeros((self.samples, 1)), self.cuts)
        grid = np.linspace(0.0, self.duration, self.samples)
        return np.interp(self.joined, grid[: len(kept)], grid[kept])

    def carry(self, columns: Floats) -> Floats:
        """Bring what was sampled with the demonstration to the common times.

        Parameters
        ----------
        columns : array, shape (M_i, C)

        Returns
        -------
        array, shape (M, C)
            From the quintic spline through the samples.
        """
        joined, _ = pauses.without(columns, self.cuts)
        grid = np.linspace(0.0, self.duration, self.samples)[: len(joined)]
        if np.array_equal(self.joined, grid):
            return joined
        return np.asarray(through(grid, joined)(np.clip(self.joined, 0.0, grid[-1])))


@dataclass(frozen=True)
class Alignment:
    """Several demonstrations at common times, and how well they agree.

    Attributes
    ----------
    how : {'none', 'time', 'path'}
    duration : float
        Common, s.
    tracks : tuple of Track
        One each.
    x : array, shape (n, M, D)
        Positions at the common times, mm.
    angles : array, shape (n, M, A), or None
        Likewise, rad.
    spread : array, shape (M, D + A)
        Standard deviation of positions and angles over the demonstrations, mm and rad.
    distances : array, shape (n,)
        RMS distance of each from the mean of the others, mm.
    doubts : tuple of Doubt
        Demonstrations that do not belong to the others, in order.
    rests : tuple of Rest
        Pauses, left out or kept.
    deviations : array, shape (n,)
        By how much correspondence differs from arc length, largest, as a part of the length.
    """

    how: Align
    duration: float
    tracks: tuple[Track, ...]
    x: Floats
    angles: Floats | None
    spread: Floats
    distances: Floats
    doubts: tuple[Doubt, ...]
    rests: tuple[Rest, ...]
    deviations: Floats

    @property
    def grid(self) -> Floats:
        """The common times, s, shape (M,), even."""
        return np.linspace(0.0, self.duration, self.x.shape[1])

    @property
    def times(self) -> Floats:
        """Time in each demonstration at the common times, s, shape (n, M)."""
        return np.array([track.times for track in self.tracks])

    @property
    def mean(self) -> Floats:
        """The mean path at the common times, mm, shape (M, D)."""
        return agreement.pooled_mean(self.x)


def align(
    demonstrations: Sequence[ComparedPath], how: Align = "path", samples: int | None = None
) -> Alignment:
    """Bring demonstrations to a common time.

    Parameters
    ----------
    demonstrations : sequence of ComparedPath
        One or more of the same D; all with angles or all without.
    how : {'none', 'time', 'path'}
        'none': seconds as recorded; a shorter one rests at its goal. 'time': at equal parts of
        their durations. 'path': at equal places on the path, at the mean of the times at which they
        are there.
    samples : int, optional
        M; the most that any demonstration has, by default.

    Returns
    -------
    Alignment
        One demonstration alone stays as it is.

    Raises
    ------
    InputError
        A demonstration does not move.
    """
    for i, d in enumerate(demonstrations, start=1):
        if not np.any(np.ptp(d.x, axis=0) > 0.0):
            raise InputError(f"demonstration {i} does not move; leave it out")
    count = samples or max(len(d.x) for d in demonstrations)
    if len(demonstrations) > 1 and how == "path":
        return _by_path(demonstrations, count)
    durations = [d.duration for d in demonstrations]
    duration = max(durations) if how == "none" else float(np.mean(durations))
    grid = np.linspace(0.0, duration, count)
    tracks = [
        Track(
            d.duration,
            len(d.x),
            (),
            np.minimum(grid, d.duration) if how == "none" else np.linspace(0.0, d.duration, count),
        )
        for d in demonstrations
    ]
    if len(demonstrations) == 1:
        columns = [tracks[0].carry(demonstrations[0].columns)]
        return _measured(how, duration, demonstrations, tracks, columns)
    strokes = [of_stroke(d, (), {}) for d in demonstrations]
    doubts, _ = _compared(demonstrations, strokes, False)
    columns = [s.columns(track.joined) for s, track in zip(strokes, tracks, strict=True)]
    return _measured(how, duration, demonstrations, tracks, columns, doubts)


def _by_path(demonstrations: Sequence[ComparedPath], count: int) -> Alignment:
    found = rests_of(demonstrations)
    strokes = [
        of_stroke(d, cuts, held)
        for d, cuts, held in zip(demonstrations, found.cuts, found.held, strict=True)
    ]
    doubts, warps = _compared(demonstrations, strokes, True)
    targets = [
        float(
            np.mean(
                [
                    warp.inverse(np.array([s.stays[k].place]))[0]
                    for s, warp in zip(strokes, warps, strict=True)
                    if k in s.stays
                ]
            )
        )
        for k in range(found.stays)
    ]
    warps = [
        warp.pinned({targets[k]: stay.place for k, stay in s.stays.items()})
        for s, warp in zip(strokes, warps, strict=True)
    ]
    law = mean_law([running_on(s.law, s.skipped) for s in strokes], warps, count)
    lasting = [
        float(np.mean([s.stays[k].duration for s in strokes if k in s.stays]))
        for k in range(found.stays)
    ]
    duration = law.duration + sum(lasting)
    moving, rested = _standing(np.linspace(0.0, duration, count), law, targets, lasting)
    places = np.clip(law.place(moving)[0], 0.0, 1.0)
    places[0], places[-1] = 0.0, 1.0
    tracks = []
    for d, s, warp, cuts in zip(demonstrations, strokes, warps, found.cuts, strict=True):
        t = s.law.time(s.law.length * warp(places))
        for k, stay in s.stays.items():
            t = t + stay.duration * rested[k]
        t[0], t[-1] = 0.0, s.duration
        tracks.append(Track(d.duration, len(d.x), tuple(cuts), np.maximum.accumulate(t)))
    columns = [s.columns(track.joined) for s, track in zip(strokes, tracks, strict=True)]
    deviations = [warp.deviation() for warp in warps]
    return _measured(
        "path", duration, demonstrations, tracks, columns, doubts, found.told, deviations
    )


def _standing(
    grid: Floats, law: TimeLaw, places: Sequence[float], lasting: Sequence[float]
) -> tuple[Floats, list[Floats]]:
    """Time in motion, and for each stay the part of it that is over, from 0 to 1."""
    starts = law.time(np.array(places, dtype=float))
    moving, rested = np.array(grid), []
    for k in range(len(places)):
        earlier = sum(lasting[j] for j in range(len(places)) if starts[j] < starts[k])
        start = float(starts[k]) + earlier
        end = start + lasting[k]
        # Half a stay's duration to come to rest, and as much to leave.
        ease = min(0.5 * lasting[k], 2.0 * start, 2.0 * (float(grid[-1]) - end))
        over = eased(grid - start + 0.5 * ease, ease) - eased(grid - end + 0.5 * ease, ease)
        moving -= over
        rested.append(over / lasting[k])
    return np.clip(moving, 0.0, law.duration), rested


def _compared(
    demonstrations: Sequence[ComparedPath], strokes: Sequence[Moving], warp: bool
) -> tuple[list[Doubt], list[Correspondence]]:
    """Doubts about each, and which places correspond."""
    even = np.linspace(0.0, 1.0, path_registration.PLACES)
    paths = np.array([s.at(even) for s in strokes])
    noise = np.array([d.noise for d in demonstrations])
    reversed_ = agreement.reversals(paths)
    against = np.array([d.index for d in reversed_], dtype=np.int64)
    warps = [Correspondence()] * len(paths)
    while True:
        if warp:
            included = np.ones(len(paths), dtype=bool)
            included[against] = False
            warps = path_registration.register(paths, included, float(np.median(noise)))
        warped = np.array(
            [
                path if w.straight else s.at(w(even))
                for s, w, path in zip(strokes, warps, paths, strict=True)
            ]
        )
        strange = agreement.strangers(warped, noise, np.array([d.index for d in reversed_], int))
        other = np.array([d.index for d in strange if d.kind == "shape"], dtype=np.int64)
        if not warp or np.all(np.isin(other, against)):
            break
        # Once more without them: a mean with another shape in it misleads all.
        against = np.union1d(against, other)
    return sorted([*reversed_, *strange], key=lambda d: d.index), warps


def _measured(
    how: Align,
    duration: float,
    demonstrations: Sequence[ComparedPath],
    tracks: Sequence[Track],
    columns: Sequence[Floats],
    doubts: Sequence[Doubt] = (),
    rests: Sequence[Rest] = (),
    deviations: Sequence[float] | None = None,
) -> Alignment:
    all_ = np.array(columns)
    dimensions = demonstrations[0].x.shape[1]
    x = all_[:, :, :dimensions]
    distances = agreement.distances(x)
    return Alignment(
        how,
        duration,
        tuple(tracks),
        x,
        None if demonstrations[0].angles is None else all_[:, :, dimensions:],
        agreement.spread(all_),
        distances,
        tuple(replace(d, distance=float(distances[d.index])) for d in doubts),
        tuple(rests),
        np.zeros(len(x)) if deviations is None else np.array(deviations),
    )
