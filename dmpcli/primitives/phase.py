"""The canonical system: phase, and the Gaussian basis over it."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from dmpcli.arrays import Floats

# exp(-60) is 1e-26: ten orders below rounding, and weights differ by far less than that.
_LEAST_EXPONENT = -60.0

WidthRule = Literal["spacing", "power"]


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
    s: Floats = np.exp(-alpha_1 / tau * np.asarray(t, dtype=float))
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
        e *= -self.widths
        return e

    def activations(self, s: Floats) -> Floats:
        """Psi up to a common factor per sample, shape (..., N).

        The largest exponent is taken off first: far from every centre all psi underflow, their
        ratios do not.
        """
        e = self.exponents(s)
        e -= e.max(axis=-1, keepdims=True)
        return significant_exp(e)

    def mean(self, s: Floats, weights: Floats) -> Floats:
        """Weighted mean of eq. (7), ``Σ psi_i w_i / Σ psi_i``, shape (..., D).

        Parameters
        ----------
        s : array, shape (...,)
        weights : array, shape (D, N)
        """
        psi = self.activations(s)
        mean: Floats = psi @ weights.T
        mean /= psi.sum(axis=-1, keepdims=True)
        return mean

    def normalized(self, s: Floats) -> Floats:
        """``psi_i / Σ psi``, the weights' factors in eq. (7), shape (..., N)."""
        psi = self.activations(s)
        psi /= psi.sum(axis=-1, keepdims=True)
        return psi


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
