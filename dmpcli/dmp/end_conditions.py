"""Weights that begin the stroke at its velocity, and end it on its goal at the demonstrated one.

A regression of the forcing term knows nothing of where the stroke ends: small errors of f add up.
But the state at the end is linear in the weights, so that the least change of them that ends the
stroke right has a closed form: two conditions per axis. Least is what moves the path least, and is
done by the functions next to the end: a change spread over all of them, least in the weights or in
what the regression minimizes, moves the path tens of times as far.
"""

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp.canonical_system import Basis, phase
from dmpcli.dmp.transformation_system import (
    NODES,
    TransformationGains,
    longest_step,
    quadrature,
    transition,
)

# Functions at either end that a change is made of; more of them move the path no less.
CHANGED = 6
# Part of the path's own squares that the squares of weights cost beside them.
_RIDGE = 1e-8


def end_responses(
    spring: TransformationGains, basis: Basis, alpha_1: float, duration: float
) -> Floats:
    """State at the end, of one axis at rest in 0, to each basis function alone.

    Parameters
    ----------
    spring : TransformationGains
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
        φ_i = psi_i/Σpsi · s, by the quadrature of `transformation_system.forced`.
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

    The weights that do are ``w + A Cᵀ (C A Cᵀ)⁻¹ (r - C w)``, A the inverse Hessian of what is to
    be least: how far the path moves.

    Parameters
    ----------
    weights : array, shape (D, N)
        N ≥ 2.
    required : array, shape (D, 2)
        r: end state of the response to the forcing term.
    responses : array, shape (2, N)
        C, of `end_responses`.
    moves : array, shape (N, 2)
        A Cᵀ, of `end_moves`.

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


def end_moves(paths: Floats, responses: Floats) -> Floats:
    """Columns ``A Cᵀ`` that weights move along to end as required and move the path least.

    Parameters
    ----------
    paths : array, shape (S, M)
        Response to each of the last M functions over even times: A = (PᵀP + μ)⁻¹ for their weights,
        0 for those of all others.
    responses : array, shape (2, N)
        C, of `end_responses`.

    Returns
    -------
    array, shape (N, 2)
    """
    moves = np.zeros(responses.shape[::-1])
    moves[-paths.shape[1] :] = _least_squares(paths, responses[:, -paths.shape[1] :].T)
    return moves


def start_move(paths: Floats, c: Floats, count: int) -> Floats:
    """Change of weights that takes back the response to V0 = 1, but for its velocity at the start.

    Parameters
    ----------
    paths : array, shape (S, M)
        Response to each of the first M functions over even times.
    c : array, shape (S,)
        That to V0, of `transformation_system.homogeneous`.
    count : int
        N.

    Returns
    -------
    array, shape (N,)
    """
    move = np.zeros(count)
    move[: paths.shape[1]] = -_least_squares(paths, paths.T @ c)
    return move


def _least_squares(paths: Floats, right: Floats) -> Floats:
    gram = paths.T @ paths
    gram += _RIDGE * np.trace(gram) / len(gram) * np.eye(len(gram))
    return np.asarray(np.linalg.solve(gram, right))
