"""Which place on each of several paths corresponds: where arc length alone misses it.

Two demonstrations of one shape have their features at the same share of their lengths only as long
as local lengths agree: one larger loop shifts whatever follows. Dynamic time warping between each
path and the mean of all finds the shift; a smooth, monotone function of arc length takes it over,
so that no path becomes jagged.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.dmp.agreement import pooled_mean

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

# Places per path, even in arc length.
PLACES = 401
# Coefficients of the correspondence, and the weight of its roughness.
_COEFFICIENTS = 80
_ROUGHNESS = 1e-5
# How far, as a part of the length, arc length may be off.
_WINDOW = 0.15
# Weight of the direction beside the position over the extent: direction tells the features of paths
# that lie apart. A step off the diagonal costs as much as this in both.
_DIRECTION = 0.3
_PENALTY = 0.02
# The correspondence's slope stays between this and its inverse.
_FLATTEST = 0.25
# Arc length stands where warping brings the paths closer by less than this part.
_GAIN = 0.1
_ROUNDS = 4
_SETTLED = 1e-3


@dataclass(frozen=True)
class Correspondence:
    """Place on one path by the common place, both as parts of the length from 0 to 1.

    Attributes
    ----------
    coefficients : array, shape (Q,), or None
        Increasing, of the cubic B-spline on even knots; None for the identity.
    pins : tuple of array, shape (K,), or None
        Common places, and the places that the spline takes for them: increasing, both from 0 to 1.
    """

    coefficients: Floats | None = None
    pins: tuple[Floats, Floats] | None = None

    @property
    def straight(self) -> bool:
        """Whether it is the identity."""
        return self.coefficients is None and self.pins is None

    def __call__(self, place: Floats) -> Floats:
        """Place on this path, shape (M,)."""
        pinned = self._pinned(place)
        if self.coefficients is None:
            return pinned
        return np.asarray(np.clip(_spline(self.coefficients)(pinned), 0.0, 1.0))

    def slope(self, place: Floats) -> Floats:
        """Derivative of the place on this path by the common one, shape (M,)."""
        slope = self._pinned(place, 1)
        if self.coefficients is None:
            return slope
        return np.asarray(slope * _spline(self.coefficients)(self._pinned(place), 1))

    def inverse(self, place: Floats) -> Floats:
        """Common place by the place on this path, to about 1e-6, shape (M,)."""
        if self.straight:
            return place
        nodes = np.linspace(0.0, 1.0, 4 * PLACES)
        return np.interp(place, self(nodes), nodes)

    def deviation(self) -> float:
        """Largest distance between both places, as a part of the length."""
        if self.straight:
            return 0.0
        nodes = np.linspace(0.0, 1.0, PLACES)
        return float(np.max(np.abs(self(nodes) - nodes)))

    def pinned(self, pins: dict[float, float]) -> "Correspondence":
        """The same with some pairs held together.

        Parameters
        ----------
        pins : dict of float
            Place on this path by common place, strictly between 0 and 1.

        Returns
        -------
        Correspondence
            Pairs that are out of order are passed over.
        """
        common, own = [0.0], [0.0]
        for place in sorted(pins):
            inner = float(self.inverse(np.array([pins[place]]))[0])
            if common[-1] < place < 1.0 and own[-1] < inner < 1.0:
                common.append(place)
                own.append(inner)
        if len(common) == 1:
            return self
        return Correspondence(self.coefficients, (np.array([*common, 1.0]), np.array([*own, 1.0])))

    def _pinned(self, place: Floats, derivative: int = 0) -> Floats:
        if self.pins is None:
            return np.ones_like(place) if derivative else place
        from scipy.interpolate import PchipInterpolator

        return np.asarray(PchipInterpolator(*self.pins)(place, derivative))


def register(paths: Floats, included: Booleans, noise: float) -> list[Correspondence]:
    """Bring the features of several paths together.

    Parameters
    ----------
    paths : array, shape (n, PLACES, D)
        At even arc length, mm.
    included : array, shape (n,)
        Paths of the same shape and direction; the others keep their arc length.
    noise : float
        Standard deviation of the positions, mm: differences of a few of it are no features.

    Returns
    -------
    list of Correspondence
        Identities where arc length does as well, or nearly.
    """
    identity = [Correspondence()] * len(paths)
    chosen = np.flatnonzero(included)
    if len(chosen) < 2:
        return identity
    part = paths[chosen]
    size = float(np.linalg.norm(np.ptp(pooled_mean(part), axis=0)))
    if _scatter(part) <= max(3.0 * noise, 1e-3 * size):
        return identity
    coefficients = _warped(part, size)
    warped = np.array([_at(x, c) for x, c in zip(part, coefficients, strict=True)])
    before, after = _scatter(_features(part, size)), _scatter(_features(warped, size))
    if after > (1.0 - _GAIN) * before:
        return identity
    result = list(identity)
    for i, c in zip(chosen.tolist(), coefficients, strict=True):
        result[i] = Correspondence(c)
    return result


def _warped(paths: Floats, size: float) -> Floats:
    """Coefficients of each correspondence, shape (n, Q): a mean path, and each warped to it."""
    straight = _averages()
    coefficients = np.tile(straight, (len(paths), 1))
    features = _features(paths, size)
    for _ in range(_ROUNDS):
        mean = pooled_mean(np.array([_at(x, c) for x, c in zip(paths, coefficients, strict=True)]))
        target = _features(mean[None], size)[0]
        found = np.array([_deviation(*_path(f, target)) for f in features])
        found = np.array([_monotone(straight + d) for d in found - pooled_mean(found)])
        change = float(np.max(np.abs(found - coefficients)))
        coefficients = found
        if change < _SETTLED:
            break
    return coefficients


def _path(features: Floats, target: Floats) -> tuple[Integers, Integers]:
    """Samples of both that time warping pairs."""
    from dtaidistance import dtw

    pairs = dtw.warping_path_fast(
        features, target, use_ndim=True, window=int(_WINDOW * len(target)), penalty=_PENALTY
    )
    pairs = np.asarray(pairs, dtype=np.int64)
    return pairs[:, 0], pairs[:, 1]


def _features(paths: Floats, size: float) -> Floats:
    """Positions by the extent, and directions, shape (n, P, 2 D)."""
    direction = np.gradient(paths, axis=1)
    norm = np.linalg.norm(direction, axis=2, keepdims=True)
    direction = direction / np.where(norm > 0.0, norm, 1.0)
    return np.concatenate([paths / size, _DIRECTION * direction], axis=2)


def _scatter(x: Floats) -> float:
    """RMS distance of all from their mean."""
    return float(np.sqrt(np.mean(np.sum((x - pooled_mean(x)) ** 2, axis=2))))


def _at(path: Floats, coefficients: Floats) -> Floats:
    """The path at the places that the correspondence names, shape (P, D)."""
    where = np.clip(_basis() @ coefficients, 0.0, 1.0) * (len(path) - 1)
    k = np.minimum(where.astype(np.int64), len(path) - 2)
    r = (where - k)[:, None]
    return np.asarray((1.0 - r) * path[k] + r * path[k + 1])


def _deviation(own: Integers, common: Integers) -> Floats:
    """Smooth deviation from arc length, shape (Q,): a penalized spline through the pairs."""
    # Of the several places that a common one may be paired with, the mean.
    off = np.bincount(common, own) / np.bincount(common) - np.arange(PLACES)
    return np.concatenate([[0.0], _smoother() @ (off / (PLACES - 1)), [0.0]])


def _monotone(coefficients: Floats) -> Floats:
    """The same with slopes within bounds, from 0 to 1."""
    straight = np.diff(_averages())
    steps = straight * np.clip(np.diff(coefficients) / straight, _FLATTEST, 1.0 / _FLATTEST)
    total = np.append(0.0, np.cumsum(steps))
    return np.asarray(total / total[-1])


@lru_cache(maxsize=1)
def _knots() -> Floats:
    inner = np.linspace(0.0, 1.0, _COEFFICIENTS - 2)
    return np.concatenate([np.zeros(3), inner, np.ones(3)])


@lru_cache(maxsize=1)
def _averages() -> Floats:
    """Greville's abscissae: the coefficients of the identity."""
    knots = _knots()
    return np.asarray((knots[1:-3] + knots[2:-2] + knots[3:-1]) / 3.0)


@lru_cache(maxsize=1)
def _basis() -> Floats:
    """B-splines at the even places, shape (P, Q)."""
    from scipy.interpolate import BSpline

    return np.asarray(BSpline.design_matrix(np.linspace(0.0, 1.0, PLACES), _knots(), 3).toarray())


@lru_cache(maxsize=1)
def _smoother() -> Floats:
    """Inner coefficients by the deviations at the even places, shape (Q - 2, P)."""
    second = np.diff(np.eye(_COEFFICIENTS), 2, axis=0)[:, 1:-1]
    B = _basis()[:, 1:-1]
    normal = B.T @ B / PLACES + _ROUGHNESS * _COEFFICIENTS * second.T @ second
    return np.asarray(np.linalg.solve(normal, B.T / PLACES))


def _spline(coefficients: Floats) -> "BSpline":
    from scipy.interpolate import BSpline

    return BSpline(_knots(), coefficients, 3)
