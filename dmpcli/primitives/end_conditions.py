"""Weights that end the stroke on its goal, at the demonstrated velocity.

A regression of the forcing term knows nothing of where the stroke ends: small errors of f add up.
But the state at the end is linear in the weights, so that the least change of them that ends the
stroke right has a closed form: two conditions per axis.
"""

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.primitives.dynamics import NODES, Spring, longest_step, quadrature, transition
from dmpcli.primitives.phase import Basis, phase


def end_responses(spring: Spring, basis: Basis, alpha_1: float, duration: float) -> Floats:
    """State at the end, of one axis at rest in 0, to each basis function alone.

    Parameters
    ----------
    spring : Spring
        One axis.
    basis : Basis
        N functions.
    alpha_1 : float
    duration : float
        T_d, s.

    Returns
    -------
    array, shape (2, N)
        x(T_d) and V(T_d) = tau dx/dt: C_i = (1/tau) ∫ (E01, E11)(T_d - t) φ_i(t) dt with
        φ_i = psi_i/Σpsi · s, by the quadrature of `dynamics.forced`.
    """
    steps = int(np.ceil(duration / longest_step(spring, duration, len(basis)) - 1e-9))
    h = duration / steps
    nodes, weights = quadrature(NODES)
    t = ((np.arange(steps)[:, None] + nodes) * h).ravel()
    s = phase(t, spring.tau, alpha_1)
    E = transition(spring, duration - t)[:, 0, :, 1]
    kernel = E * (np.tile(weights, steps) * h / spring.tau)[:, None]
    return np.ascontiguousarray(basis.window(s).normalized().scaled(s).gathered(kernel).T)


def corrections(weights: Floats, required: Floats, responses: Floats, moves: Floats) -> Floats:
    """Multipliers of the least change of weights that makes the forced response end as required.

    The weights that do are ``w + A Cᵀ (C A Cᵀ)⁻¹ (r - C w)``, A the inverse Hessian of what the
    regression minimizes.

    Parameters
    ----------
    weights : array, shape (D, N)
        N ≥ 2.
    required : array, shape (D, 2)
        r: end state of the response to the forcing term.
    responses : array, shape (2, N)
        C, of `end_responses`.
    moves : array, shape (N, 2)
        A Cᵀ, of `BandedRegression.least_change`.

    Returns
    -------
    array, shape (D, 2)
        m; the weights are ``w + m (A Cᵀ)ᵀ``.
    """
    gram = responses @ moves
    # V is larger than x by orders of magnitude: rows and columns of unit diagonal keep the digits.
    scale = 1.0 / np.sqrt(np.diag(gram))
    missing = required - weights @ responses.T
    multipliers: Floats = (
        scale * np.linalg.solve(gram * np.outer(scale, scale), (scale * missing).T).T
    )
    return multipliers
