"""Whether a recording has corners, and what it is with them: by the least description of it.

Corners that may be are left out one after the other while what is then smooth costs less than the
corner: Mallows' Cp of the pieces, and of a corner two for its time and the logarithm of the places
it may be at (J. Rissanen, Automatica 14, 1978). The same decides between pieces and a spline.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.dmp import corner_blends, corner_pieces, corner_search
from dmpcli.dmp.corner_pieces import COST, SmoothPiece
from dmpcli.dmp.corner_search import Candidate
from dmpcli.dmp.least_squares import Design
from dmpcli.dmp.noise import ROUNDING, Noise

# Samples up to which corners are looked for.
_MOST = 50_000
# Rounds of looking for corners and what rounds them.
_ROUNDS = 3
# Coefficients up to which two pieces are plain, and squares beyond those of noise, in variances,
# that a polynomial of more leaves where no spline that does better costs as little as they.
_PLAIN, _FAR = 6.0, 200.0
# Samples beside a corner that tell of the velocities there, and how often their difference a jump
# is at most: ends of pieces that follow the noise have jumps of several times as much, and of 248
# rounded corners that are none, one in fifty has more than 1.12 times.
_BESIDE, _WILD = 4, 1.5


@dataclass(frozen=True)
class Cornered:
    """Samples without their noise, smooth between corners.

    Attributes
    ----------
    values : array, shape (T, D)
    corners : array, shape (P,)
        Times, in samples.
    size : float
        Coefficients of all pieces, less those that meeting at the corners saves.
    finest : float
        Coefficients by samples, where they are closest.
    rests : tuple of bool
        Whether the stroke begins and ends at rest.
    """

    values: Floats
    corners: Floats
    size: float
    finest: float
    rests: tuple[bool, bool]


def cornered(
    x: Floats, noise: Noise, variance: float, smooth: float, spline: Design | None
) -> Cornered | None:
    """Look for corners; None where there are none, or a spline does as well.

    Parameters
    ----------
    x : array, shape (T, D)
    noise : Noise
    variance : float
        Of the noise, over all D.
    smooth : float
        What a spline costs, in variances.
    spline : Design, optional
        Its intervals. Where they are uniform, noise explains what it leaves: corners are few then,
        or so many that they must cost less at once.
    """
    extent = float(np.linalg.norm(np.ptp(x, axis=0)))
    # What rounding does at a corner is not worth the search.
    if noise.kind != "white" or noise.typical <= ROUNDING * extent or len(x) > _MOST:
        return None
    uniform = spline is not None and spline.uniform
    breaks = np.zeros(0) if spline is None else spline.breaks / spline.step
    found = corner_search.candidates(x, noise, straight=False)
    if not found or (uniform and _dear(found, x, noise, variance, smooth)):
        return None
    pieces = _KeptPieces(x, noise, variance, breaks)
    at = corner_search.located(x, found, noise)
    more = []
    for low, high in zip(*pieces.edges(at), strict=True):
        piece = pieces[low, high]
        if piece is None or piece.size > 2.0:
            begin = int(np.ceil(low))
            part = x[begin : int(high) + 1]
            closer = corner_search.candidates(part, noise, straight=True, of=len(x))
            more += [(begin + place, within) for place, within in closer]
    if more:
        found = sorted([*((float(place), 1.0) for place in at), *more])
        at = corner_search.located(x, found, noise)
    if uniform and pieces.cost(at) > smooth:
        return None
    at = pieces.needed(at)
    if len(at) == 0:
        return None
    rounded = _rounded(x, at, noise, variance, breaks)
    if rounded is None:
        return None
    at, meeting, blends = rounded
    sharp = meeting.smooth == 1
    corners, jumps = at[sharp], meeting.jumps[sharp]
    residual = x - meeting.values - blends
    cost = float(np.sum(residual**2)) / variance + COST * meeting.size + _places(len(at), x)
    if cost >= smooth or not corner_pieces.explained(residual, noise):
        return None
    halves = corner_blends.likely(x - meeting.values, corners, jumps, noise.typical, True)
    values = meeting.values + corner_blends.added(len(x), corners, jumps, halves)
    return Cornered(values, corners, meeting.size, meeting.finest, meeting.rests)


@dataclass(frozen=True)
class _Meeting:
    """Pieces that meet at corners, without what these are rounded by.

    Attributes
    ----------
    values : array, shape (T, D)
    jumps : array, shape (P, D)
        Of the velocity, by samples.
    smooth : array, shape (P,)
        As `corner_pieces.joint` tells.
    size, finest, rests
        As of `Cornered`.
    """

    values: Floats
    jumps: Floats
    smooth: Integers
    size: float
    finest: float
    rests: tuple[bool, bool]


def _met(x: Floats, at: Floats, noise: Noise, variance: float, breaks: Floats) -> _Meeting | None:
    """Fit pieces between corners that meet; None where nothing explains one, or they cannot."""
    best = _KeptPieces(x, noise, variance, breaks).all(at)
    if best is None:
        return None
    smooth = [corner_pieces.joint(*two, variance)[0] for two in pairwise(best)]
    try:
        values, jumps = corner_pieces.joined(best, smooth)
    except np.linalg.LinAlgError:
        # Pieces of a few samples each cannot meet in all that.
        return None
    size = sum(piece.size for piece in best) - sum(smooth)
    finest = max(piece.size / len(piece.values) for piece in best)
    rests = (best[0].rests[0], best[-1].rests[1])
    return _Meeting(values, jumps, np.array(smooth), size, finest, rests)


def _rounded(
    x: Floats, at: Floats, noise: Noise, variance: float, breaks: Floats
) -> tuple[Floats, _Meeting, Floats] | None:
    """Fit corners and what rounds them in turn: where they are, the pieces, and what blends add."""
    meeting, wild, blends = None, np.zeros(0, dtype=bool), np.zeros_like(x)
    for _ in range(_ROUNDS):
        # Without what is rounded, corners are where they would be.
        without = x - blends
        at = corner_search.located(without, [(float(place), 1.0) for place in at], noise)
        meeting = _met(without, at, noise, variance, breaks)
        if meeting is None:
            return None
        sharp = meeting.smooth == 1
        corners, jumps = at[sharp], meeting.jumps[sharp]
        wild = _wild(meeting.values, corners, jumps)
        if wild.any():
            at = np.setdiff1d(at, corners[wild])
            if len(at) == 0:
                return None
            continue
        least = corner_blends.least(len(x), corners, jumps, noise.typical)
        halves = corner_blends.likely(x - meeting.values, corners, jumps, noise.typical, False)
        long = halves > least
        blends = corner_blends.added(len(x), corners[long], jumps[long], halves[long])
        if not long.any():
            break
    return None if meeting is None or wild.any() else (at, meeting, blends)


def _wild(values: Floats, corners: Floats, jumps: Floats) -> Booleans:
    """Which corners (P,) are ends of pieces that follow the noise: what is beside turns less."""
    before = np.floor(corners).astype(np.int64)
    after = before + 1
    first, last = np.maximum(before - _BESIDE, 0), np.minimum(after + _BESIDE, len(values) - 1)
    coming = (values[before] - values[first]) / np.maximum(before - first, 1)[:, None]
    going = (values[last] - values[after]) / np.maximum(last - after, 1)[:, None]
    turn = np.linalg.norm(going - coming, axis=1)
    return np.asarray(np.linalg.norm(jumps, axis=1) > _WILD * turn)


def _dear(found: list[Candidate], x: Floats, noise: Noise, variance: float, smooth: float) -> bool:
    """Whether corners at about these places cost more than a spline."""
    count = len(x)
    cost = _places(len(found), x) - COST * len(found)
    low, after = 0.0, 0.0
    for at, within in [*found, (count - 1.0, 0.0)]:
        doubt = corner_search.doubted(within)
        begin, end = low + after, at - doubt
        # Of what is about a corner noise is left, whatever it belongs to.
        cost += corner_pieces.least(x, begin, end, noise, variance) + doubt + after
        if cost > smooth:
            return True
        low, after = at, doubt
    return False


def _places(corners: int, x: Floats) -> float:
    """What corners cost, in variances over all axes: their times, and which samples they are at."""
    from scipy.special import gammaln

    count, axes = x.shape
    ways = gammaln(count + 1.0) - gammaln(corners + 1.0) - gammaln(count - corners + 1.0)
    return float(COST * (corners + ways) / axes)


class _KeptPieces:
    """Pieces by the corners between which they are, fitted once."""

    def __init__(self, x: Floats, noise: Noise, variance: float, breaks: Floats) -> None:
        self._x, self._noise, self._variance, self._breaks = x, noise, variance, breaks
        self._kept: dict[tuple[float, float], SmoothPiece | None] = {}

    def __getitem__(self, at: tuple[float, float]) -> SmoothPiece | None:
        if at not in self._kept:
            self._kept[at] = corner_pieces.between(
                self._x, *at, self._noise, self._variance, self._breaks
            )
        return self._kept[at]

    def edges(self, at: Floats) -> tuple[list[float], list[float]]:
        """Where pieces begin and end."""
        inner: list[float] = at.tolist()
        return [0.0, *inner], [*inner, len(self._x) - 1.0]

    def all(self, at: Floats) -> list[SmoothPiece] | None:
        """Return the pieces between corners; None if there is one that nothing explains."""
        found = [self[edges] for edges in zip(*self.edges(at), strict=True)]
        pieces = [piece for piece in found if piece is not None]
        return pieces if len(pieces) == len(found) else None

    def cost(self, at: Floats) -> float:
        """Of pieces and corners, in variances."""
        pieces = self.all(at)
        if pieces is None:
            return np.inf
        own = sum(piece.cost(self._variance) for piece in pieces)
        meeting = sum(corner_pieces.joint(*two, self._variance)[1] for two in pairwise(pieces))
        return own + meeting + _places(len(at), self._x)

    def needed(self, at: Floats) -> Floats:
        """Corners without which it would cost more; of neighbours the least needed goes first."""
        while len(at):
            lows, highs = self.edges(at)
            needs = np.array([self._need(*e) for e in zip(lows, highs, highs[1:], strict=False)])
            needs -= _places(len(at), self._x) - _places(len(at) - 1, self._x)
            gone = np.zeros(len(at), dtype=bool)
            for k in np.argsort(needs, kind="stable"):
                if needs[k] >= 0.0:
                    break
                gone[k] = not gone[max(0, k - 1) : k + 2].any()
            if not gone.any():
                break
            at = at[~gone]
        return at

    def _need(self, low: float, at: float, high: float) -> float:
        """What it costs more to leave a corner out."""
        before, after = self[low, at], self[at, high]
        plain = before is not None and after is not None and before.size + after.size <= _PLAIN
        if plain and (low, high) not in self._kept:
            missed = corner_pieces.missed(self._x, low, high) / self._variance
            if missed > high - low + _FAR:
                return np.inf
        one = self[low, high]
        if one is None:
            return np.inf
        if before is None or after is None:
            return -np.inf
        two = before.cost(self._variance) + after.cost(self._variance)
        return (
            one.cost(self._variance) - two - corner_pieces.joint(before, after, self._variance)[1]
        )
