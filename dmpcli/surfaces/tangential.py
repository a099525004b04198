"""Feet of positions in a chart, by damped Newton steps on the gap's part along the surface."""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.surfaces.surface import Charts

SETTLED = 1e-6
"""A foot is found when what is left of the gap along the surface is less than this, mm."""

NEAR = 0.03
"""A foot that came this near and no nearer is found too, mm: where one more node makes the grid of
a mesh's chart another one, the chart jumps by its own error."""

_MOST_STEPS = 30
_DIFFERENCE = 0.5
# Longest step, mm: farther ahead the chart has curved away from where it was differenced.
_LONGEST = 20.0
# Other samples that move change the grid of a mesh's chart, and with it what is left here, mm.
_SLACK = NEAR
_LEAST_AREA = 0.05
# Steps after which a gap must have halved.
_PATIENCE = 3


@dataclass(frozen=True)
class Sought:
    """Feet as far as they were found.

    Attributes
    ----------
    at : array, shape (B, T, 2)
        u, v, mm.
    height : array, shape (B, T)
        Of the positions along the chart's normal at the feet, mm.
    area : array, shape (B, T)
        What an area of the chart is there, that far off the surface; negative beyond a centre of
        curvature.
    good : array of bool, shape (B, T)
    """

    at: Floats
    height: Floats
    area: Floats
    good: Booleans

    def rows(self, rows: Integers) -> "Sought":
        """Return copies of some strokes."""
        return Sought(self.at[rows], self.height[rows], self.area[rows], self.good[rows])

    def put(self, rows: Integers, part: "Sought") -> None:
        """Replace some strokes."""
        self.at[rows], self.height[rows] = part.at, part.height
        self.area[rows], self.good[rows] = part.area, part.good

    def better(self, other: "Sought", free: Booleans, replace: bool = False) -> "Sought":
        """Return these with what another search found of the samples that it was free to move.

        Parameters
        ----------
        other : Sought
            Of the same strokes.
        free : array of bool, shape (B, T)
            Samples that the other search was free to move; the rest stay.
        replace : bool
            Whether what the other found counts in any case; else the nearer foot, where both
            found one.
        """
        take = free & other.good
        if not replace:
            take &= ~self.good | (np.abs(other.height) < np.abs(self.height))
        return Sought(
            np.where(take[..., None], other.at, self.at),
            np.where(take, other.height, self.height),
            np.where(take, other.area, self.area),
            self.good | take,
        )

    def without(self, lost: Booleans, at: Floats) -> "Sought":
        """Return these with some given up, and put where they do no harm.

        Parameters
        ----------
        lost : array of bool, shape (B, T)
        at : array, shape (B, T, 2)
            u, v of those, mm; the rest of it is not looked at.
        """
        return Sought(
            np.where(lost[..., None], at, self.at),
            np.where(lost, 0.0, self.height),
            self.area,
            self.good & ~lost,
        )


def solved(
    charts: Charts,
    position: Floats,
    at: Floats,
    free: Booleans,
    box: tuple[Floats, Floats] | None = None,
) -> Sought:
    """Seek the feet of positions.

    The unknowns are u and v alone: w is the gap's part along the normal. The Jacobian of the other
    two parts, of a difference quotient at first and after slow steps, is carried on by rank-one
    updates (C. Broyden: Math. Comp. 19 (1965) 577). A step that does not lessen the gap is halved.

    Parameters
    ----------
    charts : Charts
        B charts.
    position : array, shape (B, T, 3)
        mm.
    at : array, shape (B, T, 2)
        Guesses, mm.
    free : array of bool, shape (B, T)
        Samples that may be moved.
    box : two arrays, shape (B, 1, 2), optional
        Least and largest u, v that they may be moved to, mm.

    Returns
    -------
    Sought
        `good` counts for samples that are free.
    """
    state = _NewtonState(charts, position, np.array(at, dtype=float), free, box)
    for _ in range(_MOST_STEPS):
        live = state.live()
        if len(live) == 0:
            break
        state.step(live)
    return state.best


class _NewtonState:
    """The search, of all strokes."""

    def __init__(
        self,
        charts: Charts,
        position: Floats,
        at: Floats,
        free: Booleans,
        box: tuple[Floats, Floats] | None,
    ) -> None:
        self.charts, self.position, self.at, self.free = charts, position, at, free
        count, samples = free.shape
        self.box = box
        self.gap = np.full((count, samples, 2), np.inf)
        self.height = np.zeros((count, samples))
        self.jacobian = np.zeros((count, samples, 2, 2))
        self.trust = np.ones((count, samples))
        self.fresh = np.zeros(count, dtype=bool)
        self.least = np.full((count, samples), np.inf)
        self.score = np.full(count, np.inf)
        self.best = self._now(np.arange(count))
        self.stalled = np.zeros((count, samples), dtype=np.int64)

    def live(self) -> Integers:
        """Strokes with samples that can still be brought nearer."""
        size = _size(self.gap)
        moving = self.free & ~(size <= SETTLED) & (self.stalled < 3 * _PATIENCE)
        return np.flatnonzero(moving.any(axis=1))

    def step(self, rows: Integers) -> None:
        """Move the samples of some strokes once."""
        stale = rows[~self.fresh[rows]]
        if len(stale):
            self._difference(stale)
        at, gap, J, free = self.at[rows], self.gap[rows], self.jacobian[rows], self.free[rows]
        trust = self.trust[rows]
        trial = at + np.where(free[..., None], _limited(-_solve(J, gap)) * trust[..., None], 0.0)
        if self.box is not None:
            inside = np.clip(trial, self.box[0][rows], self.box[1][rows])
            trial = np.where(free[..., None], inside, trial)
        after, height = self._look(rows, trial)
        before, now = _size(gap), _size(after)
        finite = np.isfinite(now)
        taken = finite & (~free | (now < before + np.minimum(_SLACK, before)))
        self.at[rows] = np.where(taken[..., None], trial, at)
        self.gap[rows] = np.where(taken[..., None], after, gap)
        self.height[rows] = np.where(taken, height, self.height[rows])
        fared = np.where(now < before, 2.0 * trust, 0.5 * trust)
        self.trust[rows] = np.where(free & finite, np.minimum(1.0, fared), 0.5 * trust)
        known = np.isfinite(gap) & np.isfinite(after)
        change = np.where(known, after, np.nan) - np.where(known, gap, 0.0)
        self.jacobian[rows] = _carried_on(J, trial - at, change, free)
        least = self.least[rows]
        halved = now < 0.5 * least
        self.stalled[rows] = np.where(halved | ~free, 0, self.stalled[rows] + 1)
        self.least[rows] = np.where(halved, now, least)
        slow = free & (now > SETTLED) & (self.stalled[rows] % _PATIENCE == _PATIENCE - 1)
        self.fresh[rows] = ~slow.any(axis=1)
        self._keep(rows)

    def _keep(self, rows: Integers) -> None:
        """Remember the best that was found of some strokes, each as a whole."""
        size = np.where(self.free[rows], np.minimum(_size(self.gap[rows]), 1.0), 0.0)
        score = size.sum(axis=1)
        better = rows[score < self.score[rows]]
        if len(better):
            self.score[rows] = np.minimum(score, self.score[rows])
            self.best.put(better, self._now(better))

    def _difference(self, rows: Integers) -> None:
        """Take gaps and Jacobians of some strokes anew."""
        at = self.at[rows]
        beside = [at + np.array(by) for by in ((0.0, 0.0), (_DIFFERENCE, 0.0), (0.0, _DIFFERENCE))]
        gaps, _ = self._look(rows, np.concatenate(beside, axis=1))
        here, *ahead = np.split(gaps, 3, axis=1)
        lost = ~np.isfinite(here).all(axis=-1) & self.free[rows]
        if lost.any():
            # Beyond the border the way back is unknown: try again nearer the middle.
            self.at[rows] = np.where(lost[..., None], 0.5 * at, at)
        J = np.stack([(there - here) / _DIFFERENCE for there in ahead], axis=-1)
        usable = np.isfinite(J).all(axis=(-2, -1), keepdims=True)
        self.jacobian[rows] = np.where(usable, J, -np.eye(2))
        # So many samples have not quite the grid of the stroke alone, which counts.
        own, height = self._look(rows, self.at[rows])
        self.gap[rows] = np.where(np.isfinite(own), own, np.inf)
        self.height[rows] = np.where(np.isfinite(height), height, 0.0)
        self.fresh[rows] = True
        self._keep(rows)

    def _look(self, rows: Integers, at: Floats) -> tuple[Floats, Floats]:
        """Gaps along e_u and e_v, (R, n, 2), and heights (R, n); NaN beyond the border."""
        chart = self.charts if len(rows) == len(self.at) else self.charts.rows(rows)
        flat = np.concatenate([at, np.zeros((*at.shape[:2], 1))], axis=-1)
        lift = chart.lift(flat)
        sought = self.position[rows]
        sought = np.tile(sought, (1, at.shape[1] // sought.shape[1], 1))
        parts = np.einsum("btj,btjk->btk", sought - lift.position, lift.axes)
        parts[lift.outside] = np.nan
        return parts[..., :2], parts[..., 2]

    def _now(self, rows: Integers) -> Sought:
        good = self.free[rows] & (_size(self.gap[rows]) <= NEAR)
        area = np.linalg.det(self.jacobian[rows])
        return Sought(self.at[rows], self.height[rows], area, good)


def _size(gap: Floats) -> Floats:
    return np.asarray(np.hypot(gap[..., 0], gap[..., 1]))


def _solve(J: Floats, gap: Floats) -> Floats:
    """J⁻¹ gap (B, T, 2); where J is nearly singular or folds over, -gap: towards the position.

    Where the gap is not known, zero.
    """
    gap = np.where(np.isfinite(gap), gap, 0.0)
    a, b, c, d = J[..., 0, 0], J[..., 0, 1], J[..., 1, 0], J[..., 1, 1]
    area = a * d - b * c
    sound = area > _LEAST_AREA
    scale = 1.0 / np.where(sound, area, 1.0)
    x, y = gap[..., 0], gap[..., 1]
    exact = np.stack([d * x - b * y, a * y - c * x], axis=-1) * scale[..., None]
    return np.where(sound[..., None], exact, -gap)


def _limited(move: Floats) -> Floats:
    size = _size(move)[..., None]
    return move * np.minimum(1.0, _LONGEST / np.maximum(size, 1e-12))


def _carried_on(J: Floats, move: Floats, change: Floats, free: Booleans) -> Floats:
    """Jacobians after a step: they would have foretold its change of the gap."""
    square = np.sum(move**2, axis=-1)
    usable = free & np.isfinite(change).all(axis=-1) & (square > 1e-12)
    wrong = change - np.einsum("btij,btj->bti", J, move)
    share = move / np.where(usable, square, 1.0)[..., None]
    update = np.where(usable[..., None], wrong, 0.0)[..., :, None] * share[..., None, :]
    return J + update
