"""As many basis functions as the stroke needs, and weights that end it on its goal.

The paper's N = 80 carries one wave; twenty loops come out flat. So N begins there and grows until
the reproduction is within the tolerance. LWR's error is the bias of its kernels, about N⁻² where
the stroke is smooth, which tells the next N.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp import end_conditions
from dmpcli.dmp.canonical_system import Basis
from dmpcli.dmp.curve import Curve
from dmpcli.dmp.forced_model import forced_model
from dmpcli.dmp.options import LARGEST, MOST, Method, WidthRule
from dmpcli.dmp.regression import target_forcing
from dmpcli.dmp.transformation_system import TransformationGains
from dmpcli.metrics.wave_height import LINE, wave_heights

FIRST = 80
PASSES = 3
# Deviation of the tool's orientation that is always allowed, rad.
ANGLE = np.radians(0.1)
# N may be so many times the pieces that the recording's band holds.
_BEYOND_BAND = 16
# A forced response below this part of the extent does not tell alpha_f.
NEGLIGIBLE = 1e-9
# Nor does one that is but rounding, mm and rad.
ROUNDING = 1e-12


@dataclass(frozen=True)
class Tolerance:
    """How far a reproduction may be from the demonstration.

    Attributes
    ----------
    length : float
        RMS and wave height, and `LARGEST` of it anywhere, mm.
    angle : float
        rad.
    """

    length: float
    angle: float = ANGLE


@dataclass(frozen=True)
class Quality:
    """How far a reproduction is from the demonstration.

    Attributes
    ----------
    rms, largest : float
        Distance to the nearest point, mm.
    end : float
        Of the last sample, mm.
    wave : tuple of float, or None
        Mean wave height, demonstrated and reproduced, mm; None where there is no wave.
    angle : float
        Largest, at equal times, rad.
    """

    rms: float
    largest: float
    end: float
    wave: tuple[float, float] | None
    angle: float

    def excess(self, tolerance: Tolerance) -> float:
        """Return the largest ratio of a deviation to what is allowed; at most 1 is within."""
        wave = 0.0 if self.wave is None else abs(self.wave[1] - self.wave[0])
        return max(
            max(self.rms, wave, self.largest / LARGEST) / tolerance.length,
            self.angle / tolerance.angle,
        )


@dataclass(frozen=True)
class Weights:
    """Weights of one N, and what they reach.

    Attributes
    ----------
    basis : Basis
    passes : int
        Of LWR.
    weights : array, shape (6, N)
    alpha_f : array, shape (6,)
    initial_velocity : array, shape (6,)
        V0 = tau dx/dt(0).
    demonstrated, reproduced : array, shape (T, 6)
        What was to be learned, and what the weights make of it, at even times.
    quality : Quality
        Of the one beside the other.
    bulge : float
        How far the path was moved to begin and to end as demonstrated, mm.
    """

    basis: Basis
    passes: int
    weights: Floats
    alpha_f: Floats
    initial_velocity: Floats
    demonstrated: Floats
    reproduced: Floats
    quality: Quality
    bulge: float

    def lacks(self, tolerance: Tolerance) -> float:
        """Return by how many tolerances the weights miss, the ends by whole ones; 1 is enough.

        Where a recording changes its speed next to its end faster than N carries, the path bulges
        beyond the end, which the points that are nearest to the recording do not see.
        """
        return max(self.quality.excess(tolerance), self.bulge / tolerance.length)


@dataclass(frozen=True)
class LearnedCurve:
    """Weights of the coordinates of one curve, before anything is held against it.

    Attributes
    ----------
    basis : Basis
    passes : int
        Of LWR.
    weights : array, shape (D, N)
    alpha_f, initial_velocity : array, shape (D,)
    demonstrated, reproduced : array, shape (T, D)
        At even times.
    moved : array, shape (T, D)
        By how much, to begin and to end as demonstrated.
    """

    basis: Basis
    passes: int
    weights: Floats
    alpha_f: Floats
    initial_velocity: Floats
    demonstrated: Floats
    reproduced: Floats
    moved: Floats


@dataclass(frozen=True)
class Problem:
    """What is to be learned, and how.

    Attributes
    ----------
    curve : Curve
        The mean demonstration in the skill's six coordinates.
    spring : TransformationGains
        Alike on all axes.
    alpha_1 : float
    widths : {'spacing', 'power'}
    closed : bool
        Whether the stroke has no start-goal line, and so no wave.
    """

    curve: Curve
    spring: TransformationGains
    alpha_1: float
    widths: WidthRule
    closed: bool

    def learn(self, count: int, method: Method, passes: int | None) -> Iterator[Weights]:
        """Learn N weights, with one pass of LWR, then with more; ridge has one.

        Parameters
        ----------
        count : int
            N.
        method : {'lwr', 'ridge'}
        passes : int or None
            So many alone; None tries 1, 2, ... `PASSES` as they are asked for.
        """
        for way in self.ways(self.curve, count, method, passes):
            quality = judged(way.demonstrated, way.reproduced, self.closed)
            bulge = float(np.linalg.norm(way.moved[:, :3], axis=1).max())
            yield Weights(
                way.basis,
                way.passes,
                way.weights,
                way.alpha_f,
                way.initial_velocity,
                way.demonstrated,
                way.reproduced,
                quality,
                bulge,
            )

    def ways(
        self, curve: Curve, count: int, method: Method, passes: int | None
    ) -> Iterator["LearnedCurve"]:
        """Learn N weights per coordinate of any curve of the same duration; as `learn`.

        Parameters
        ----------
        curve : Curve
            D coordinates.
        count, method, passes
            As in `learn`.
        """
        duration, axes = curve.duration, slice(0, curve.spline.c.shape[1])
        spring = TransformationGains(self.spring.k[axes], self.spring.d[axes], self.spring.tau)
        k, d = float(spring.k[0]), float(spring.d[0])
        model = forced_model(count, k, d, spring.tau / duration, self.alpha_1, self.widths)
        regression = model.regression
        ends = np.array([0.0, duration])
        start, goal = curve(ends)
        V0, V_end = spring.tau * curve(ends, 1)
        x, velocity, acceleration = curve.limited(count, model.samples)
        forcing = target_forcing(spring, goal, x, velocity, acceleration)
        # What N carries of the recording begins at another velocity than the recording.
        late = V0 - spring.tau * velocity[0]
        rest = start * model.a + goal * model.b + V0 * model.c
        demonstrated = curve.even(model.samples)
        C, E = model.end_responses, model.end
        required = np.stack(
            [
                (goal - start) * E[0, 0] - V0 * E[0, 1],
                V_end - (start - goal) * E[1, 0] - V0 * E[1, 1],
            ],
            axis=1,
        )
        rounds = (passes,) if passes else (1,) if method == "ridge" else range(1, PASSES + 1)
        for number in rounds:
            weights = regression.fit(method, forcing, number)
            forced = model.response(weights)
            alpha_f = _alpha_f(demonstrated - rest + late * model.c, forced, demonstrated)
            by_ends = np.zeros_like(demonstrated)
            if count > 1:
                move, moved = model.start_move
                by = late / alpha_f
                weights, forced = weights + np.outer(by, move), forced + np.outer(moved, by)
                moves, changed = model.end_moves
                m = end_conditions.corrections(weights, required / alpha_f[:, None], C, moves)
                weights, forced = weights + m @ moves.T, forced + changed @ m.T
                by_ends = late * (model.c + moved[:, None]) + alpha_f * (changed @ m.T)
            reproduced = rest + alpha_f * forced
            yield LearnedCurve(
                model.basis, number, weights, alpha_f, V0, demonstrated, reproduced, by_ends
            )


def judged(demonstrated: Floats, reproduced: Floats, closed: bool) -> Quality:
    """Hold a reproduction against a demonstration at the same times.

    Parameters
    ----------
    demonstrated, reproduced : array, shape (T, 6)
        In the skill's coordinates, mm and rad.
    closed : bool
        Whether the stroke ends where it begins: then it has no wave height.
    """
    near = nearest(demonstrated[:, :3], reproduced[:, :3])
    return Quality(
        float(np.sqrt(np.mean(near**2))),
        float(near.max()),
        float(np.linalg.norm(reproduced[-1, :3] - demonstrated[-1, :3])),
        None if closed else waves(demonstrated, reproduced),
        float(np.linalg.norm(reproduced[:, 3:] - demonstrated[:, 3:], axis=1).max()),
    )


def search(
    problem: Problem,
    method: Method,
    tolerance: Tolerance,
    count: int | None = None,
    passes: int | None = None,
) -> Weights:
    """Learn with as few basis functions as the tolerance allows.

    Parameters
    ----------
    problem : Problem
    method : {'lwr', 'ridge'}
    tolerance : Tolerance
    count : int, optional
        N alone, whatever it reaches.
    passes : int, optional
        Of LWR; without it as few as the tolerance allows, at most `PASSES`.

    Returns
    -------
    Weights
        The first within the tolerance; where none is, the best found.
    """
    most = min(MOST, max(FIRST, _BEYOND_BAND * problem.curve.intervals))
    best: Weights | None = None
    number = count or FIRST
    while True:
        here: Weights | None = None
        for found in problem.learn(number, method, passes):
            if here is None or found.lacks(tolerance) < here.lacks(tolerance):
                here = found
            if here.lacks(tolerance) <= 1.0:
                return here
        assert here is not None
        lacks = here.lacks(tolerance)
        if best is None or lacks < best.lacks(tolerance):
            best = here
        if count is not None or number >= most:
            return best
        number = min(most, int(np.ceil(number * np.clip(1.1 * np.sqrt(lacks), 1.15, 4.0))))


def _alpha_f(rest: Floats, forced: Floats, demonstrated: Floats) -> Floats:
    """Factor per axis that brings the forced response closest to the demonstration.

    With x = x_hom + alpha x_forced: ``alpha = <x_demo - x_hom, x_forced> / <x_forced, x_forced>``;
    1 where x_forced is negligible.
    """
    across, along = np.sum(rest * forced, axis=0), np.sum(forced**2, axis=0)
    ranges = np.ptp(demonstrated, axis=0)
    extents = ranges
    if len(ranges) == 6:  # positions and angles
        extents = np.repeat([np.linalg.norm(ranges[:3]), np.linalg.norm(ranges[3:])], 3)
    least = np.maximum(NEGLIGIBLE * extents, ROUNDING)
    told = along > least**2 * len(forced)
    return np.where(told, across / np.where(told, along, 1.0), 1.0)  # alpha_f of eq. (9)


def nearest(points: Floats, path: Floats) -> Floats:
    """Distance of points (n, 3) to a densely sampled path (m, 3), shape (n,).

    To the two segments beside the nearest sample: exact where samples are closer together than
    the path is to itself.
    """
    from scipy.spatial import cKDTree

    # The tree serves one query: balancing it costs more than it saves.
    tree = cKDTree(path, compact_nodes=False, balanced_tree=False)
    at = np.clip(tree.query(points)[1], 1, len(path) - 2)
    best = np.full(len(points), np.inf)
    for first in (at - 1, at):
        way = path[first + 1] - path[first]
        size = np.maximum(np.sum(way**2, axis=1), 1e-300)
        offset = points - path[first]
        share = np.clip(np.sum(offset * way, axis=1) / size, 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(offset - share[:, None] * way, axis=1))
    return best


def waves(demonstrated: Floats, reproduced: Floats) -> tuple[float, float] | None:
    """Mean wave heights of open strokes in chart coordinates; None for a line.

    Parameters
    ----------
    demonstrated, reproduced : array, shape (T, D)
        Whose first two columns are u and v, mm.

    Returns
    -------
    tuple of float, or None
        Of the demonstration and of the reproduction, mm; 0 where the latter has lost its waves.
    """
    v, length = demonstrated[:, 1], demonstrated[-1, 0] - demonstrated[0, 0]
    if np.ptp(v) < LINE * abs(length):
        return None
    there, here = wave_heights(v).mean, wave_heights(reproduced[:, 1]).mean
    return None if there is None else (there, here or 0.0)
