"""A cubic spline at rest at both ends, without scipy, whose import would delay every start."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dmpcli.arrays import Floats

WINDOW = 24
"""Even samples on either side that a value depends on; those beyond add less than 1e-13 of them."""

# Slopes of the spline through even samples, from the differences around each: the rows of the
# inverse of s_(i-1) + 4 s_i + s_(i+1) = 3 (y_(i+1) - y_(i-1)), which decay by 0.27 from one to the
# next.
_KERNEL = (np.sqrt(3.0) - 2.0) ** np.abs(np.arange(1 - WINDOW, WINDOW)) * np.sqrt(3.0) / 2.0


@dataclass(frozen=True)
class Spline:
    """Twice continuously differentiable curve through samples, with zero end velocities.

    Attributes
    ----------
    t : array, shape (n,)
        Strictly increasing knots, s.
    y : array, shape (n, m)
    slope : array, shape (n, m)
        dy/dt at the knots.
    """

    t: Floats
    y: Floats
    slope: Floats

    def __call__(self, at: Floats) -> Floats:
        """Values at the times `at`, shape (..., m); the ends hold outside the knots."""
        at = np.clip(np.asarray(at, dtype=float), self.t[0], self.t[-1])
        if len(self.t) == 1:
            return np.broadcast_to(self.y[0], (*at.shape, self.y.shape[1])).copy()
        i = np.clip(np.searchsorted(self.t, at, side="right") - 1, 0, len(self.t) - 2)
        h = (self.t[i + 1] - self.t[i])[..., None]
        u = (at - self.t[i])[..., None] / h
        # Hermite's form; u = 0 and u = 1 give the samples themselves, to the last bit.
        left = (1.0 + 2.0 * u) * (1.0 - u) ** 2
        right = u**2 * (3.0 - 2.0 * u)
        bend = h * u * (1.0 - u) * ((1.0 - u) * self.slope[i] - u * self.slope[i + 1])
        value: Floats = left * self.y[i] + right * self.y[i + 1] + bend
        return value


def spline(t: Floats, y: Floats) -> Spline:
    """Fit the clamped cubic spline with zero velocity at both ends.

    Parameters
    ----------
    t : array, shape (n,)
        Strictly increasing, s.
    y : array, shape (n, m)
    """
    n = len(t)
    slope = np.zeros_like(y, dtype=float)
    if n > 2:
        h = np.diff(t)
        rise = np.diff(y, axis=0) / h[:, None]
        # Continuity of the second derivative at the inner knots, a tridiagonal system:
        # h_i s_(i-1) + 2 (h_(i-1) + h_i) s_i + h_(i-1) s_(i+1) = 3 (h_i r_(i-1) + h_(i-1) r_i)
        right = 3.0 * (h[1:, None] * rise[:-1] + h[:-1, None] * rise[1:])
        slope[1:-1] = _tridiagonal(h[1:], 2.0 * (h[:-1] + h[1:]), h[:-1], right)
    return Spline(np.asarray(t, dtype=float), np.asarray(y, dtype=float), slope)


def window(index: float, count: int) -> tuple[NDArray[np.int64], float]:
    """Return the numbers of the even samples that a value between two of them depends on.

    Beyond an end the samples are mirrored there, which is what zero end velocities mean.

    Parameters
    ----------
    index : float
        Number of the sample, between two.
    count : int
        How many there are, two or more.

    Returns
    -------
    array, shape (2 * WINDOW + 2,)
    float
        Share of the way from the middle two's first to their second.
    """
    i = min(int(index), count - 2)
    numbers = np.arange(i - WINDOW, i + WINDOW + 2) % (2 * count - 2)
    return np.minimum(numbers, 2 * count - 2 - numbers), index - i


def between(y: Floats, share: float) -> Floats:
    """Value of the same spline between the middle two of even samples; its cost is constant.

    Parameters
    ----------
    y : array, shape (2 * WINDOW + 2, m)
        Of the `window`.
    share : float
        0 gives the first of the two, 1 the second.
    """
    rise = y[2:] - y[:-2]
    slope = np.array([_KERNEL @ rise[:-1], _KERNEL @ rise[1:]])
    middle = Spline(np.array([0.0, 1.0]), y[WINDOW : WINDOW + 2], slope)
    return middle(np.array(share))


def _tridiagonal(lower: Floats, diagonal: Floats, upper: Floats, right: Floats) -> Floats:
    """Solve a diagonally dominant tridiagonal system (Thomas); row i has lower_i x_(i-1)."""
    n = len(diagonal)
    factor = np.empty(n)
    x = np.array(right, dtype=float)
    factor[0] = upper[0] / diagonal[0]
    x[0] /= diagonal[0]
    for i in range(1, n):
        pivot = diagonal[i] - lower[i] * factor[i - 1]
        factor[i] = upper[i] / pivot
        x[i] = (x[i] - lower[i] * x[i - 1]) / pivot
    for i in range(n - 2, -1, -1):
        x[i] -= factor[i] * x[i + 1]
    return x
