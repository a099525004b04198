"""Weights of the forcing term from its samples."""

from functools import cached_property

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.dmp.canonical_system import Basis, Window, significant_exp
from dmpcli.dmp.options import Method
from dmpcli.dmp.transformation_system import TransformationGains

# Relative to the mean diagonal of the normal equations: enough to make them definite.
_RIDGE = 1e-12


def target_forcing(
    spring: TransformationGains, goal: Floats, x: Floats, velocity: Floats, acceleration: Floats
) -> Floats:
    """Forcing that the demonstration asks for: eq. (4) and (5) solved for f.

    Parameters
    ----------
    spring : TransformationGains
        D axes.
    goal : array, shape (D,)
    x, velocity, acceleration : array, shape (T, D)
        Per axis, and their derivatives by time in s.

    Returns
    -------
    array, shape (T, D)
        ``tau² ẍ + d tau ẋ - k (g - x)``.
    """
    f: Floats = (  # eq. (4), (5)
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
    weights: Floats = (weighted @ forcing / (weighted @ xi)[:, None]).T  # w_i of eq. (7)
    return weights


def ridge(basis: Basis, s: Floats, xi: Floats, forcing: Floats) -> Floats:
    """Least squares of all weights together, with a slight ridge.

    Parameters
    ----------
    basis : Basis
        N functions.
    s : array, shape (T,)
        Phase of the samples.
    xi : array, shape (T,)
        As in `lwr`.
    forcing : array, shape (T, D)

    Returns
    -------
    array, shape (D, N)
    """
    features = basis.normalized(s) * xi[:, None]
    normal = features.T @ features
    normal[np.diag_indices_from(normal)] += _RIDGE * np.trace(normal) / len(basis)
    return np.asarray(np.linalg.solve(normal, features.T @ forcing).T, dtype=float)


METHODS = {"lwr": lwr, "ridge": ridge}


class BandedRegression:
    """Both regressions of the modified model (ξ = s) by sparse products.

    Time and memory grow with the samples and with N, not with their product: N = 2000 over
    16,000 samples takes some tens of MB.

    Parameters
    ----------
    basis : Basis
        N functions.
    s : array, shape (T,)
        Phase of the samples; so dense that every function has several in its reach.
    """

    def __init__(self, basis: Basis, s: Floats) -> None:
        window = basis.window(s)
        self._features = window.normalized().scaled(s)
        psi = Window(window.first, _values(basis, s, window.first, window.psi.shape[1]), len(basis))
        self._weighted = psi.scaled(s)
        self._local_cost = psi.gathered(s[:, None] ** 2)

    def fit(self, method: Method, forcing: Floats, passes: int = 1) -> Floats:
        """Weights of forcing terms.

        Parameters
        ----------
        method : {'lwr', 'ridge'}
        forcing : array, shape (T, D)
        passes : int
            Of `lwr`: how often it is applied, each time to what the weights so far leave over. LWR
            smooths by the width of its functions; each pass gives back most of what the last one
            took (twicing: J. W. Tukey, Exploratory Data Analysis, Addison-Wesley 1977, ch. 16).

        Returns
        -------
        array, shape (D, N)
        """
        if method == "ridge":
            return self._solve(self._features.gathered(forcing)).T
        weights = np.zeros((forcing.shape[1], self._features.count))
        rest = forcing
        for i in range(passes):
            if i:
                rest = forcing - self._features.mean(weights)
            weights = weights + (self._weighted.gathered(rest) / self._local_cost).T
        return weights

    @cached_property
    def _normal(self) -> Floats:
        """The normal equations with their slight ridge, in LAPACK's band form."""
        normal = self._features.normal()
        reach = len(normal) // 2
        normal[reach] += _RIDGE * normal[reach].mean()
        return normal

    def _solve(self, right: Floats) -> Floats:
        from scipy.linalg import solve_banded

        normal = self._normal
        reach = len(normal) // 2
        return np.asarray(solve_banded((reach, reach), normal, right, check_finite=False))


def _values(basis: Basis, s: Floats, first: Integers, size: int) -> Floats:
    """Psi itself of `size` functions from `first` (T,) on at each sample, shape (T, size)."""
    columns = first[:, None] + np.arange(size)
    e = s[:, None] - basis.centres[columns]
    return significant_exp(-basis.widths[columns] * e * e)
