"""The least acceleration that the samples allow, where noise may be what a stroke accelerates by.

What a spline follows of the noise shows in its acceleration first: a corner that is drawn sharper
than it is, or a piece that bends with a few samples, accelerates an arm several times too much, and
no residual tells. So it is asked last of all, wherever the acceleration is highest, by how much it
could be less: of all strokes that keep within a cap, the nearest is one that the samples believe as
well until its squares are more than noise explains. That stroke is a quadratic programme, whose
multipliers are found by reweighted least squares (K. Lange, D. R. Hunter and I. Yang, J. Comput.
Graph. Stat. 9, 2000).
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from dmpcli.arrays import Booleans, Floats
from dmpcli.dmp.noise import Noise

# Squares beyond those that were left, in variances of one axis, from which on the samples do not
# believe it: a likelihood ratio of exp(3), and on each axis so many more for each time that what is
# drawn swings back, as by that many coefficients it follows the noise. A swing is larger than this
# part of the peak.
_LIMIT, _SWUNG, _SWING = 6.0, 2.0, 0.25
# Standard deviations by which it may go off anywhere; where the samples are about as near to it, to
# within so many variances.
_OFF, _OFF_AS_NEAR, _AS_NEAR = 1.5, 2.5, 1.0
# Times that the acceleration must be less to be doubtful, steps in which caps fall, and how far.
_DOUBTFUL, _STEP, _MOST = 1.2, 1.25, 50.0
# Part of the highest acceleration below which none is worth a look; rounds of looking, and times
# that one came down from which on it is looked at again.
_WORTH, _ROUNDS, _FAR = 0.6, 12, 2.0
# Samples beside what is above a cap that may change: by how long it takes at the cap, and more.
_MORE = 6
# Times the limit from which on the least squares of all reject a cap: what was left and what goes
# off have a little to do with each other.
_SURELY = 2.0
# Power of the reweighting, most iterations, those between two looks, part by which a cap may be
# passed in them and at last, and that of the squares which may be missing.
_POWER, _ITERATIONS, _TOGETHER, _PASSED, _PASSED_AT_LAST, _MISSING = 1.5, 60, 6, 1.05, 1.1, 0.15
# Part of the acceleration by samples by which positions are averaged: a quintic through the samples
# of a stroke that starts to accelerate at once would swing beyond them.
_AVERAGED = 1.0 / 6.0
# Second differences that may change together, from which on means of some are taken.
_FINE = 64
# Deviations of a spline's acceleration that noise does not reach, and intervals from an end
# beyond which they are alike.
_CERTAIN, _END = 5.0, 2.0
# Samples up to which it is asked.
_LONGEST = 50_000
# Holds where nothing may change.
_HELD = 1e30


def calmed(x: Floats, values: Floats, noise: Noise, width: float | None = None) -> Floats | None:
    """Lower the acceleration wherever it may be that of noise; None where it is nowhere.

    Parameters
    ----------
    x : array, shape (T, D)
        Even samples.
    values : array, shape (T, D)
        What they are without their noise.
    noise : Noise
        Of the samples. Of any but white noise a sample says little of its own, and nothing is done.
    width : float, optional
        Samples in an interval, where the values are those of a spline whose intervals are alike:
        how much of its acceleration is noise is known then, but for the ends.

    Returns
    -------
    array, shape (T, D), or None
    """
    if noise.kind != "white" or len(x) > _LONGEST:
        return None
    sigma = noise.typical
    calm, done = values, np.zeros(len(values) - 2, dtype=bool)
    bends = given = np.diff(values, 2, axis=0)
    if width is not None:
        # Of white noise a low-pass leaves ∫ (2 π f)⁴ df up to half a cycle an interval.
        deviation = sigma * float(np.sqrt(bends.shape[1] * np.pi**4 / (5.0 * width**5)))
        peak = float(np.sqrt(np.einsum("td,td->t", bends, bends).max(initial=0.0)))
        if _CERTAIN * deviation < (1.0 - 1.0 / _DOUBTFUL) * peak:
            end = int(np.ceil(_END * width))
            done[end : len(done) - end] = True
    for _ in range(_ROUNDS):
        places = _places(bends, given, done, sigma)
        if not places:
            break
        change = np.zeros_like(values)
        changed = False
        for place in _lowered(places, x, calm, values, sigma):
            if place.changed is not None and place.change is not None:
                change[place.changed] += place.change
                changed = True
            # What came down by far may come down farther from there.
            if place.changed is None or place.lower < _FAR:
                done[place.changed or place.above] = True
        if changed:
            calm = calm + change
            bends = np.diff(calm, 2, axis=0)
    return None if calm is values else calm


@dataclass
class _Place:
    """Where the acceleration is high: its second differences [low, high) may change.

    Attributes
    ----------
    at : int
    peak : float
    above : slice
        What is above the first cap.
    low, high : int
        As far as the next places leave it.
    lower : float
        Times that the cap is below the peak.
    changed : slice
        Samples that change.
    change : array, shape (n, D), or None
    """

    at: int
    peak: float
    above: slice
    low: int
    high: int
    lower: float = _DOUBTFUL
    changed: slice | None = None
    change: Floats | None = None


def _places(bends: Floats, given: Floats, done: Booleans, sigma: float) -> list[_Place]:
    """Highest second differences that are not `done`, and may be lower for all that is plain."""
    sizes = np.sqrt(np.einsum("td,td->t", bends, bends))
    left = np.where(done, 0.0, sizes)
    least = _WORTH * float(sizes.max(initial=0.0))
    found: list[_Place] = []
    taken = np.zeros(len(sizes), dtype=bool)
    while least > 0.0:
        at = int(np.argmax(left))
        peak = float(left[at])
        if peak < least:
            break
        cap = peak / _DOUBTFUL
        low, high = _above(sizes, at, cap)
        above = slice(max(0, low - 1), high + 1)
        left[above] = 0.0
        about = slice(*_window(sizes, low, high, cap))
        if _fewest(bends, low, high, at, cap) > _SURELY * sigma**2 * _limit(given, about):
            done[above] = True
            continue
        # What is high beside another place may be no longer once that is lowered.
        if not taken[about].any():
            found.append(_Place(at, peak, above, about.start, about.stop))
        taken[about] = True
    if not found:
        return []
    found.sort(key=lambda place: place.at)
    between = [(a.high + b.low) // 2 for a, b in pairwise(found)]
    edges = [-2, *between, len(left) + 2]
    for place, (low, high) in zip(found, pairwise(edges), strict=True):
        # What changes of one place and of the next is apart.
        place.low, place.high = max(low + 2, 0), min(high - 2, len(left))
    return found


def _window(sizes: Floats, low: int, high: int, cap: float) -> tuple[int, int]:
    """Begin and end of what may change where [low, high) is above a cap."""
    most = round(float(sizes[low:high].sum()) / cap) + _MORE
    return max(0, low - most), min(len(sizes), high + most)


def _limit(given: Floats, window: slice) -> float:
    """Squares that may be lost of what was given there, in variances of one axis."""
    part = given[window]
    squares = np.einsum("td,td->t", part, part)
    at = int(np.argmax(squares))
    along = part @ part[at] / max(float(squares[at]), 1e-300)
    swings = np.sign(along[np.abs(along) > _SWING])
    return float(_LIMIT + _SWUNG * part.shape[1] * np.count_nonzero(np.diff(swings)))


def _above(sizes: Floats, at: int, cap: float) -> tuple[int, int]:
    """Begin and end of what is above a cap about a place."""
    before, after = sizes[at::-1] <= cap, sizes[at:] <= cap
    low = at - int(np.argmax(before)) + 1 if before.any() else 0
    return low, at + int(np.argmax(after)) if after.any() else len(sizes)


def _fewest(bends: Floats, low: int, high: int, at: int, cap: float) -> float:
    """Squares by which a stroke under a cap goes off at least, by one dual solution."""
    along = bends[low:high] @ bends[at] / np.linalg.norm(bends[at])
    s = np.linspace(-1.0, 1.0, high - low + 2)[1:-1]
    bump = (1.0 - s**2) ** 2
    over = max(0.0, float(bump @ along) - cap * float(bump.sum()))
    return float(over**2 / np.sum(_second(bump[:, None]) ** 2))


def _lowered(
    places: list[_Place], x: Floats, calm: Floats, values: Floats, sigma: float
) -> list[_Place]:
    """Lower the caps of all places together, each until the samples reject it."""
    bends, given = np.diff(calm, 2, axis=0), np.diff(values, 2, axis=0)
    sizes = np.sqrt(np.einsum("td,td->t", bends, bends))
    active = places
    while active:
        caps = np.array([place.peak / place.lower for place in active])
        windows = []
        for place, cap in zip(active, caps.tolist(), strict=True):
            low, high = _window(sizes, *_above(sizes, place.at, cap), cap)
            windows.append(_Window.over(max(place.low, low), min(place.high, high), len(bends)))
        limits = sigma**2 * np.array(
            [
                _limit(given, slice(window.low, window.high))
                for place, window in zip(active, windows, strict=True)
            ]
        )
        each = np.array([window.each for window in windows])
        multipliers = _multipliers(
            [window.means(bends) for window in windows], caps, _SURELY * limits / each**5
        )
        going = []
        for place, window, cap, limit, u in zip(
            active, windows, caps.tolist(), limits.tolist(), multipliers, strict=True
        ):
            if u is None:
                continue
            change = window.change(u)
            changed = slice(window.low, window.high + 2)
            bent = bends[window.low : window.high] + np.diff(change, 2, axis=0)
            change[1:-1] += _AVERAGED * bent
            drawn = calm[changed] + change
            off = drawn - values[changed]
            lost = float(np.sum((x[changed] - drawn) ** 2 - (x[changed] - values[changed]) ** 2))
            most = _OFF if lost > _AS_NEAR * sigma**2 else _OFF_AS_NEAR
            far = float(np.einsum("td,td->t", off, off).max()) > (most * sigma) ** 2
            if lost > limit or far:
                continue
            about = slice(max(0, window.low - 2), window.high + 4)
            beside = calm[about].copy()
            beside[window.low - about.start :][: len(change)] = drawn
            highest = float(np.linalg.norm(np.diff(beside, 2, axis=0), axis=1).max())
            if highest <= _PASSED_AT_LAST * cap:
                place.changed, place.change = changed, change
            elif place.changed is None and highest * _PASSED_AT_LAST > place.peak:
                # Something else is as high there.
                continue
            place.lower *= _STEP
            if place.lower <= _MOST:
                going.append(place)
        active = going
    return places


@dataclass(frozen=True)
class _Window:
    """Second differences [low, high) that may change, by means of `each`, from `begin` on."""

    low: int
    high: int
    each: int
    begin: int
    count: int

    @classmethod
    def over(cls, low: int, high: int, rows: int) -> "_Window":
        each = max(1, (high - low) // _FINE)
        # Where a mean changes, its neighbours do so too.
        begin = low if each == 1 or low == 0 else low + 3 * each
        end = high if each == 1 or high == rows else high - 3 * each
        return cls(low, high, each, begin, (end - begin) // each)

    def means(self, bends: Floats) -> Floats:
        """Means of second differences, shape (count, D)."""
        part = bends[self.begin : self.begin + self.each * self.count]
        if self.each == 1:
            return part
        return np.asarray(part.reshape(self.count, self.each, -1).mean(axis=1))

    def change(self, u: Floats) -> Floats:
        """What samples change by where means are multiplied so, shape (high - low + 2, D).

        Of cubic B-splines, so that the acceleration between means is on a line between theirs.
        """
        from scipy.interpolate import BSpline

        second = -(self.each**2) * _second(u)
        if self.each == 1:
            return second
        knots = np.arange(-6.0, self.count + 6.0)
        middle = self.begin + 0.5 * (self.each - 1)
        at = (np.arange(self.low, self.high + 2) - 1 - middle) / self.each
        values = BSpline(knots, np.pad(second, ((3, 3), (0, 0))), 3, extrapolate=False)(at)
        return np.asarray(np.nan_to_num(values))


def _multipliers(bends: list[Floats], caps: Floats, limits: Floats) -> list[Floats | None]:
    """Multipliers u of the strokes nearest to some whose second differences keep within caps.

    They go off by the second differences of u, where beyond its ends u is 0.

    Parameters
    ----------
    bends : list of array, shape (n, D)
        Second differences.
    caps, limits : array, shape (P,)
        Limits are those of the squares by which one goes off.

    Returns
    -------
    list of array, shape (n, D), or None
        None where it goes off by more.
    """
    lengths = []
    for part, cap in zip(bends, caps.tolist(), strict=True):
        s = np.linspace(-1.0, 1.0, len(part) + 2)[1:-1]
        lengths.append(0.1 * cap * len(part) ** 2 * (1.0 - s**2) ** 2)
    found: list[Floats | None] = [None] * len(bends)
    open_ones = list(range(len(bends)))
    for _ in range(_ITERATIONS // _TOGETHER):
        solved = _reweighted(
            [bends[i] for i in open_ones],
            caps[open_ones],
            limits[open_ones],
            [lengths[i] for i in open_ones],
        )
        unfinished = []
        for i, (u, length, rejected, ended) in zip(open_ones, solved, strict=True):
            found[i], lengths[i] = None if rejected else u, length
            if not (ended or rejected):
                unfinished.append(i)
        open_ones = unfinished
        if not open_ones:
            break
    return found


def _reweighted(
    bends: list[Floats], caps: Floats, limits: Floats, starts: list[Floats]
) -> list[tuple[Floats, Floats, bool, bool]]:
    """Some iterations of `_multipliers` in one banded matrix.

    Returns
    -------
    list of (array, array, bool, bool)
        Multipliers, their lengths as they weight the next iteration, whether it goes off by more
        than the limit for certain, and whether it was found.
    """
    from scipy.linalg.lapack import dpbsv

    sizes = np.array([len(part) for part in bends])
    # Two rows between them in which u is held at 0.
    firsts = np.concatenate([[0], np.cumsum(sizes + 2)[:-1]])
    total = int(sizes.sum()) + 2 * len(sizes)
    given, cap = np.zeros((total, bends[0].shape[1])), np.full(total, _HELD)
    lengths = np.full(total, 1.0 / _HELD)
    parts = [slice(a, a + n) for a, n in zip(firsts.tolist(), sizes.tolist(), strict=True)]
    for rows, part, most, start in zip(parts, bends, caps.tolist(), starts, strict=True):
        given[rows], cap[rows], lengths[rows] = part, most, start
    least = 1e-12 * np.repeat(np.maximum.reduceat(lengths, firsts), sizes + 2)
    bands = np.empty((3, total))
    bands[1], bands[2] = -4.0, 1.0
    for _ in range(_TOGETHER):
        bands[0] = 6.0 + cap / lengths
        u = dpbsv(bands, given, lower=1)[1]
        fourth = _second(_second(u))[2:-2]
        rest = given - fourth
        shares = np.sqrt(np.einsum("td,td->t", rest, rest)) / cap
        own = lengths * shares
        lengths = np.maximum(lengths * shares**_POWER, least)
    squares = np.add.reduceat(np.einsum("td,td->t", u, fourth), firsts)
    dual = 2.0 * np.einsum("td,td->t", u, given) - 2.0 * cap * own
    rejected = np.add.reduceat(dual, firsts) - squares > limits
    slack = np.add.reduceat(own * cap * (1.0 - shares), firsts)
    ended = (np.maximum.reduceat(shares, firsts) <= _PASSED) & (slack <= _MISSING * squares)
    return [
        (u[rows], lengths[rows], no, yes)
        for rows, no, yes in zip(parts, rejected.tolist(), ended.tolist(), strict=True)
    ]


def _second(u: Floats) -> Floats:
    """Second differences of u (n, D), which is 0 beyond its ends, shape (n + 2, D)."""
    second = np.zeros((len(u) + 2, u.shape[1]))
    second[1:-1] = -2.0 * u
    second[:-2] += u
    second[2:] += u
    return second
