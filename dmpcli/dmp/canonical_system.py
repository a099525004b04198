"""The canonical system: phase, and the Gaussian basis over it."""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from dmpcli.arrays import Floats, Integers
from dmpcli.dmp.options import WidthRule

if TYPE_CHECKING:
    from scipy.sparse import csr_array

# exp(-60) is 1e-26: ten orders below rounding, and weights differ by far less than that.
_LEAST_EXPONENT = -60.0


def phase(t: Floats, tau: float, alpha_1: float) -> Floats:
    """Phase of eq. (6) and (11): ``tau ds/dt = -alpha_1 s``, ``s(0) = 1``.

    Parameters
    ----------
    t : array
        Time since the stroke began, s.
    tau : float
        Time constant, s.
    alpha_1 : float

    Returns
    -------
    array, shape of `t`
        ``exp(-alpha_1 t / tau)``.
    """
    s: Floats = np.exp(-alpha_1 / tau * np.asarray(t, dtype=float))  # eq. (6), (11)
    return s


def significant_exp(exponents: Floats) -> Floats:
    """Exponentials of numbers ≤ 0, and 0 where they are below rounding beside 1.

    Most Gaussians are far from most samples: their exponentials would be denormal numbers, which
    slow the products that follow by an order of magnitude.
    """
    return np.exp(exponents, out=np.zeros_like(exponents), where=exponents > _LEAST_EXPONENT)


@dataclass(frozen=True)
class Basis:
    """Gaussian functions of the phase, eq. (8).

    Attributes
    ----------
    centres : array, shape (N,)
        c_i, in phase.
    widths : array, shape (N,)
        h_i.
    """

    centres: Floats
    widths: Floats

    def __len__(self) -> int:
        return len(self.centres)

    def exponents(self, s: Floats) -> Floats:
        """Logarithms of psi, shape (..., N); the x inside the printed (8) is read as s."""
        e: Floats = np.asarray(s, dtype=float)[..., None] - self.centres
        np.square(e, out=e)
        e *= -self.widths  # eq. (8): psi_i = exp(-h_i (s - c_i)²)
        return e

    def activations(self, s: Floats) -> Floats:
        """Psi up to a common factor per sample, shape (..., N).

        The largest exponent is taken off first: far from every centre all psi underflow, their
        ratios do not.
        """
        e = self.exponents(s)
        e -= e.max(axis=-1, keepdims=True)
        return significant_exp(e)

    @cached_property
    def reach(self) -> int:
        """Neighbours on either side of a sample whose functions are not below rounding beside it.

        A sample lies within half a spacing of some centre; functions further than this many
        centres away are left out of sums, which then cost as little for N = 2000 as for N = 80.
        """
        if len(self) == 1:
            return 1
        nearest = 0.5 * np.abs(np.diff(self.centres, append=self.centres[-1:]))
        nearest[-1] = nearest[-2]
        for lag in range(1, len(self)):
            apart = np.abs(self.centres[lag:] - self.centres[:-lag])
            from_earlier = self.widths[:-lag] * (apart - nearest[lag:]) ** 2
            from_later = self.widths[lag:] * (apart - nearest[:-lag]) ** 2
            if min(from_earlier.min(), from_later.min()) > -_LEAST_EXPONENT:
                return lag
        return len(self)

    @property
    def banded(self) -> bool:
        """Whether most functions are below rounding at any sample."""
        return 2 * self.reach + 1 <= len(self) // 2

    def window(self, s: Floats) -> "Window":
        """Functions that count at each sample, psi up to a common factor per sample.

        Parameters
        ----------
        s : array, shape (S,)
        """
        size = min(2 * self.reach + 1, len(self))
        # Centres fall with their number, as the phase does with time.
        after = np.searchsorted(-self.centres, -s)
        first = np.clip(after - self.reach, 0, len(self) - size)
        columns = first[:, None] + np.arange(size)
        e = s[:, None] - self.centres[columns]
        np.square(e, out=e)
        e *= -self.widths[columns]
        e -= e.max(axis=1, keepdims=True)
        return Window(first, significant_exp(e), len(self))

    def mean(self, s: Floats, weights: Floats) -> Floats:
        """Weighted mean of eq. (7), ``Σ psi_i w_i / Σ psi_i``, shape (..., D).

        Parameters
        ----------
        s : array, shape (...,)
        weights : array, shape (D, N)
        """
        if self.banded:
            s = np.asarray(s, dtype=float)
            flat = self.window(s.reshape(-1)).normalized().mean(weights)
            return flat.reshape(*s.shape, len(weights))
        psi = self.activations(s)
        mean: Floats = psi @ weights.T  # eq. (7)
        mean /= psi.sum(axis=-1, keepdims=True)
        return mean

    def normalized(self, s: Floats) -> Floats:
        """``psi_i / Σ psi``, the weights' factors in eq. (7), shape (..., N)."""
        psi = self.activations(s)
        psi /= psi.sum(axis=-1, keepdims=True)
        return psi


@dataclass(frozen=True)
class Window:
    """A sparse matrix of S samples by N functions: at each sample a run of neighbours.

    Attributes
    ----------
    first : array of int, shape (S,)
        Number of the first function of each run.
    psi : array, shape (S, W)
        Values of the functions ``first`` to ``first + W - 1``.
    count : int
        N.
    """

    first: Integers
    psi: Floats
    count: int

    def normalized(self) -> "Window":
        """Return the matrix with rows that add up to 1."""
        return Window(self.first, self.psi / self.psi.sum(axis=1, keepdims=True), self.count)

    def scaled(self, factor: Floats) -> "Window":
        """Return the matrix with each row multiplied by its factor, shape (S,)."""
        return Window(self.first, self.psi * factor[:, None], self.count)

    def mean(self, weights: Floats) -> Floats:
        """Product with weights (D, N): shape (S, D); by numpy, since roll-outs load no scipy."""
        by_function = np.ascontiguousarray(weights.T)
        runs = sliding_window_view(by_function, self.psi.shape[1], axis=0)[self.first]
        return np.asarray(np.einsum("sw,sdw->sd", self.psi, runs))

    def gathered(self, values: Floats) -> Floats:
        """Product of the transpose with values (S, D): shape (N, D)."""
        return np.asarray(self.sparse().T @ values)

    def sparse(self) -> "csr_array":
        """Return the matrix (S, N) in scipy's form."""
        from scipy.sparse import csr_array

        samples, width = self.psi.shape
        columns = (self.first[:, None] + np.arange(width)).ravel()
        ends = np.arange(0, samples * width + 1, width)
        return csr_array((self.psi.ravel(), columns, ends), shape=(samples, self.count))

    def normal(self) -> Floats:
        """Product of the transpose with itself in LAPACK's band form, shape (2 W - 1, N)."""
        width = self.psi.shape[1]
        band = np.zeros((2 * width - 1, self.count))
        for a in range(width):
            for b in range(a, width):
                product = self.psi[:, a] * self.psi[:, b]
                # Entry (i, j) of the matrix stands in row (W - 1 + i - j) of column j.
                band[width - 1 + a - b] += np.bincount(self.first + b, product, self.count)
                if a != b:
                    band[width - 1 + b - a] += np.bincount(self.first + a, product, self.count)
        return band


def even_in_time(
    count: int, duration: float, tau: float, alpha_1: float, rule: WidthRule = "spacing"
) -> Basis:
    """Basis whose centres are even in time over the demonstration.

    Parameters
    ----------
    count : int
        N ≥ 1.
    duration : float
        T_d, s.
    tau, alpha_1 : float
        Of the phase.
    rule : {'spacing', 'power'}
        ``spacing``: h_i = 1 / (2 (0.5 Δc_i)²), a Gaussian whose standard deviation is half the
        distance to the next centre. ``power``: h_i = N^1.5 / (c_i alpha_1), as in the published
        code of several DMP packages; wider, so it smooths more.

    Returns
    -------
    Basis
    """
    centres = phase(np.linspace(0.0, duration, count), tau, alpha_1)
    if rule == "power":
        return Basis(centres, count**1.5 / (centres * alpha_1))
    if count == 1:
        spacing = np.array([1.0 - float(phase(np.array(duration), tau, alpha_1))])
    else:
        spacing = -np.diff(centres)
        spacing = np.append(spacing, spacing[-1])
    return Basis(centres, 1.0 / (2.0 * (0.5 * spacing) ** 2))
