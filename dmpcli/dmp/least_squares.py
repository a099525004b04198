"""Least squares by splines of degree 5 on even samples, in memory and time linear in both.

The banded solver is scipy's. The basis is Cox and de Boor's (L. Piegl and W. Tiller, The NURBS
Book, A2.2): scipy's own fit takes nine seconds for a million samples.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from dmpcli.arrays import Floats, Integers

DEGREE = 5
# Uniform intervals that have pieces of their own: four at either end, and those between alike.
_ENDS = 4
_DISTINCT = 2 * _ENDS + 1
# Samples worked on at once, so that they stay in the processor's cache.
_CHUNK = 1 << 14
# Entries up to which a full matrix is faster than its bands, and samples up to which it is to
# copy its piece to each.
_FULL, _COPIED = 40_000, 1 << 10
_EACH = np.arange(DEGREE + 1)[:, None]


@dataclass(frozen=True, eq=False)
class Design:
    """Even samples and the spline space that is fitted to them.

    Attributes
    ----------
    count : int
        Samples.
    first, step : float
        Place of the first sample and step between samples, in the unit of `breaks`.
    breaks : array, shape (K + 1,)
        Knots without their repetition at the ends, increasing from 0.
    uniform : bool
        Whether the breaks are 0, 1 … K.
    """

    count: int
    first: float
    step: float
    breaks: Floats
    uniform: bool

    @property
    def intervals(self) -> int:
        """K."""
        return len(self.breaks) - 1

    @property
    def size(self) -> int:
        """Coefficients: K + 5."""
        return self.intervals + DEGREE

    @cached_property
    def knots(self) -> Floats:
        """Breaks, the end ones sixfold, shape (K + 11,)."""
        return np.pad(self.breaks, DEGREE, mode="edge")

    @cached_property
    def full(self) -> Floats | None:
        """The matrix A of the basis functions, shape (n, K + 5), where it is small."""
        if self.count * self.size > _FULL:
            return None
        A = np.zeros((self.count, self.size))
        for part, interval, basis in self.chunks():
            first = interval + self.size * np.arange(part.start, part.stop)
            A.reshape(-1)[first + _EACH] = basis
        return A

    @cached_property
    def gram(self) -> Floats:
        """Lower bands of AᵀA, shape (6, K + 5)."""
        gram = np.zeros((DEGREE + 1, self.size))
        if self.full is not None:
            size, product = self.size, (self.full.T @ self.full).reshape(-1)
            for offset in range(DEGREE + 1):
                gram[offset, : size - offset] = product[offset * size :: size + 1]
            return gram
        for _, interval, basis in self.chunks():
            ids, starts = _runs(interval)
            for offset in range(DEGREE + 1):
                products = basis[: DEGREE + 1 - offset] * basis[offset:]
                for a, row in enumerate(np.add.reduceat(products, starts, axis=1)):
                    gram[offset, ids + a] += row
        return gram

    def chunks(self) -> Iterator[tuple[slice, Integers, Floats]]:
        """Samples, their intervals (n,) and the six basis functions there (6, n), by chunks."""
        for begin in range(0, self.count, _CHUNK):
            part = slice(begin, min(self.count, begin + _CHUNK))
            u = np.minimum(
                self.first + self.step * np.arange(part.start, part.stop), self.breaks[-1]
            )
            if self.uniform:
                yield part, *_uniform_basis(u, self.intervals)
            else:
                yield part, *local_basis(u, self.knots)

    def right(self, x: Floats) -> Floats:
        """Return Aᵀ x, shape (K + 5, D), of samples (n, D)."""
        if self.full is not None:
            return self.full.T @ x
        total = np.zeros((self.size, x.shape[1]))
        for part, interval, basis in self.chunks():
            ids, starts = _runs(interval)
            columns = np.ascontiguousarray(x[part].T)
            for d, column in enumerate(columns):
                sums = np.add.reduceat(basis * column, starts, axis=1)
                for a in range(DEGREE + 1):
                    total[ids + a, d] += sums[a]
        return total

    @cached_property
    def factor(self) -> Floats:
        """Cholesky factor of `gram`, in bands."""
        from scipy.linalg.lapack import dpbtrf

        factor, failed = dpbtrf(self.gram, lower=1)
        if failed:
            raise np.linalg.LinAlgError("an interval of the spline holds no sample")
        return np.asarray(factor)

    def solve(self, right: Floats) -> Floats:
        """Return (AᵀA)⁻¹ of right sides (K + 5, D)."""
        from scipy.linalg.lapack import dpbtrs

        return np.asarray(dpbtrs(self.factor, right, lower=1)[0])

    def values(self, coefficients: Floats) -> Floats:
        """Return A c, shape (n, D), of coefficients (K + 5, D)."""
        if self.full is not None:
            return self.full @ coefficients
        x = np.empty((self.count, coefficients.shape[1]))
        for part, interval, basis in self.chunks():
            for d in range(coefficients.shape[1]):
                column = np.ascontiguousarray(coefficients[:, d])
                total = basis[0] * column[interval]
                for a in range(1, DEGREE + 1):
                    total += basis[a] * column[interval + a]
                x[part, d] = total
        return x

    def coefficients(self, x: Floats) -> Floats:
        """Least-squares coefficients (K + 5, D) of samples (n, D), refined once."""
        c = self.solve(self.right(x))
        return c + self.solve(self.right(x - self.values(c)))

    def residual(self, x: Floats) -> Floats:
        """Return what the best spline leaves of samples (n, D)."""
        return x - self.values(self.solve(self.right(x)))


def uniform(count: int, intervals: int, first: float = 0.0, step: float | None = None) -> Design:
    """Lay K uniform intervals over even samples.

    Parameters
    ----------
    count, intervals : int
        n and K.
    first, step : float, optional
        Place of the first sample and step between samples, in intervals; from end to end without.
    """
    step = intervals / (count - 1) if step is None else step
    make = _small if count * (intervals + DEGREE) <= _FULL else _uniform
    return make(count, intervals, first, step)


def _uniform(count: int, intervals: int, first: float, step: float) -> Design:
    return Design(count, first, step, np.arange(intervals + 1.0), True)


_small = lru_cache(maxsize=32)(_uniform)


def _runs(interval: Integers) -> tuple[Integers, Integers]:
    """Intervals that hold samples, and the first sample of each."""
    starts = np.concatenate([[0], np.flatnonzero(interval[1:] != interval[:-1]) + 1])
    return interval[starts], starts


def local_basis(u: Floats, knots: Floats) -> tuple[Integers, Floats]:
    """Intervals of places and the six basis functions that live on them, by Cox and de Boor.

    Parameters
    ----------
    u : array, shape (n,)
        Places beyond the ends count as of the first or the last interval.
    knots : array, shape (K + 11,)
        The K + 1 ends of intervals with five more on either side, not falling.

    Returns
    -------
    tuple of array of int (n,), array (6, n)
        Number of each interval, which is that of its first function too, and the functions' values.
    """
    last = len(knots) - 2 * DEGREE - 2
    at = np.clip(np.searchsorted(knots, u, side="right") - 1, DEGREE, last + DEGREE)
    right = [knots[at + i] - u for i in range(1, DEGREE + 1)]
    left = [u - knots[at + 1 - i] for i in range(1, DEGREE + 1)]
    basis = np.empty((DEGREE + 1, len(u)))
    basis[0] = 1.0
    for degree in range(1, DEGREE + 1):
        saved: Floats | float = 0.0
        for i in range(degree):
            share = basis[i] / (right[i] + left[degree - 1 - i])
            basis[i] = saved + right[i] * share
            saved = left[degree - 1 - i] * share
        basis[degree] = saved
    return at - DEGREE, basis


def _uniform_basis(u: Floats, intervals: int) -> tuple[Integers, Floats]:
    """`local_basis` on knots 0, 1 … K, several times faster: by the pieces' polynomials."""
    interval = np.minimum(u.astype(np.int64), intervals - 1)
    powers = np.empty((DEGREE + 1, len(u)))
    powers[0] = 1.0
    centred = u - interval - 0.5
    for i in range(DEGREE):
        np.multiply(powers[i], centred, out=powers[i + 1])
    if intervals <= _DISTINCT:
        piece = interval
    else:
        from_end = interval - (intervals - _DISTINCT)
        piece = np.minimum(interval, np.maximum(_ENDS, from_end))
    pieces = _pieces(min(intervals, _DISTINCT))
    if len(u) <= _COPIED:
        return interval, np.einsum("jin,jn->in", pieces.T[:, :, piece], powers)
    ids, starts = _runs(piece)
    basis = np.empty_like(powers)
    for i, begin, end in zip(ids, starts, np.append(starts[1:], len(u)), strict=True):
        basis[:, begin:end] = pieces[i] @ powers[:, begin:end]
    return interval, basis


@lru_cache(maxsize=_DISTINCT)
def _pieces(intervals: int) -> Floats:
    """Polynomials about the middle of each of K uniform intervals, shape (K, 6, 6)."""
    nodes = 0.5 * np.cos(np.pi * (np.arange(DEGREE + 1) + 0.5) / (DEGREE + 1))
    places = (np.arange(intervals)[:, None] + 0.5 + nodes).ravel()
    _, basis = local_basis(places, np.pad(np.arange(intervals + 1.0), DEGREE, mode="edge"))
    values = basis.reshape(DEGREE + 1, intervals, DEGREE + 1).transpose(1, 0, 2)
    inverse = np.linalg.inv(np.vander(nodes, increasing=True).T)
    pieces: Floats = values @ inverse
    return pieces
