"""Weights of the forcing term from its samples."""

from typing import Literal

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.primitives.dynamics import Spring
from dmpcli.primitives.phase import Basis, significant_exp

Method = Literal["lwr", "ridge"]

# Relative to the mean diagonal of the normal equations: enough to make them definite.
_RIDGE = 1e-12


def target_forcing(
    spring: Spring, goal: Floats, x: Floats, velocity: Floats, acceleration: Floats
) -> Floats:
    """Forcing that the demonstration asks for: eq. (4) and (5) solved for f.

    Parameters
    ----------
    spring : Spring
        D axes.
    goal : array, shape (D,)
    x, velocity, acceleration : array, shape (T, D)
        Per axis, and their derivatives by time in s.

    Returns
    -------
    array, shape (T, D)
        ``tau² ẍ + d tau ẋ - k (g - x)``.
    """
    f: Floats = (
        spring.tau**2 * acceleration + spring.d * spring.tau * velocity - spring.k * (goal - x)
    )
    return f


def lwr(basis: Basis, s: Floats, xi: Floats, forcing: Floats) -> Floats:
    """Locally weighted regression: ``w_i = Σ psi_i ξ f / Σ psi_i ξ²``.

    Parameters
    ----------
    basis : Basis
        N functions.
    s : array, shape (T,)
        Phase of the samples.
    xi : array, shape (T,)
        What the weighted mean of the weights is multiplied by in eq. (7): s, or s (g - x0).
    forcing : array, shape (T, D)

    Returns
    -------
    array, shape (D, N)
    """
    e = basis.exponents(s)
    # A common factor per function cancels; without it a narrow function between two samples is 0/0.
    e -= e.max(axis=0)
    weighted = significant_exp(e).T * xi
    weights: Floats = (weighted @ forcing / (weighted @ xi)[:, None]).T
    return weights


def ridge(basis: Basis, s: Floats, xi: Floats, forcing: Floats) -> Floats:
    """Least squares of all weights together, with a slight ridge; parameters as in `lwr`.

    Returns
    -------
    array, shape (D, N)
    """
    features = basis.normalized(s) * xi[:, None]
    normal = features.T @ features
    normal[np.diag_indices_from(normal)] += _RIDGE * np.trace(normal) / len(basis)
    return np.asarray(np.linalg.solve(normal, features.T @ forcing).T, dtype=float)


METHODS = {"lwr": lwr, "ridge": ridge}
