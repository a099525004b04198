"""Orthonormal polynomials on even samples: least squares by polynomials without a matrix to solve.

J. P. Gram, J. reine angew. Math. 94, 1883, by their three-term recurrence (W. Gautschi, Orthogonal
Polynomials, 2004, table 1.2): x q_k = a_(k+1) q_(k+1) + a_k q_(k-1) about the middle sample.
"""

from functools import lru_cache

import numpy as np

from dmpcli.arrays import Floats

# Samples up to which polynomials are kept.
_SHORT = 1 << 10


def at_samples(count: int, degree: int) -> Floats:
    """Polynomials of degrees 0 … `degree` at n samples, shape (n, degree + 1); not to be written.

    Parameters
    ----------
    count, degree : int
        n, and less than that.
    """
    return (_kept if count <= _SHORT else _at_samples)(count, degree)


def at(count: int, degree: int, place: float, orders: int = 1) -> Floats:
    """Polynomials and their derivatives by samples at a place, shape (orders, degree + 1).

    Parameters
    ----------
    count, degree : int
        As of `at_samples`.
    place : float
        In samples from the first one; it need not be among them.
    orders : int
        Derivatives 0 … orders - 1.
    """
    x = place - 0.5 * (count - 1.0)
    a = _recurrence(count, degree)
    rows = [[0.0] * (degree + 1) for _ in range(orders)]
    rows[0][0] = 1.0 / count**0.5
    for k in range(degree):
        for order in range(orders):
            value = x * rows[order][k]
            if order:
                value += order * rows[order - 1][k]
            if k:
                value -= a[k - 1] * rows[order][k - 1]
            rows[order][k + 1] = value / a[k]
    return np.array(rows)


def _recurrence(count: int, degree: int) -> list[float]:
    """Coefficients a_1 … of the recurrence."""
    return [
        0.5 * k * ((count * count - k * k) / (4.0 * k * k - 1.0)) ** 0.5
        for k in range(1, degree + 1)
    ]


def _at_samples(count: int, degree: int) -> Floats:
    x = np.arange(count) - 0.5 * (count - 1.0)
    a = _recurrence(count, degree)
    columns = np.empty((degree + 1, count))
    columns[0] = 1.0 / count**0.5
    for k in range(degree):
        np.multiply(x, columns[k], out=columns[k + 1])
        if k:
            columns[k + 1] -= a[k - 1] * columns[k - 1]
        columns[k + 1] /= a[k]
    columns.flags.writeable = False
    return columns.T


_kept = lru_cache(maxsize=256)(_at_samples)
