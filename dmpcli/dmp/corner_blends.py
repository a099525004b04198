"""How far a corner is rounded: from one velocity to the other in as long as the samples allow.

A blend of constant acceleration over ± half goes inside of a corner by jump · half / 4 at its tip.
Samples hardly tell a sharper corner from one that is rounded by σ there, and an arm is accelerated
the less. Where they tell of a longer blend, it is the longest that is about as likely.
"""

import numpy as np

from dmpcli.arrays import Floats

# Steps in which lengths of a blend are tried.
_STEP = 1.15
# Samples to either side of a corner that a blend has at least: of fewer it would follow the noise.
_SHORTEST = 2.0
# What one that is clearly likelier costs less, and one that is about as likely more, in variances
# of one axis.
_CLEARLY, _AS_LIKELY = 6.0, 1.0
# Times the least that one is at most which is not clearly likelier.
_UNSEEN = 2.0
# Of the shorter leg beside a corner, what a blend takes at most.
_SHARE = 0.5


def least(count: int, corners: Floats, jumps: Floats, sigma: float) -> Floats:
    """Halves of blends that go inside by σ at their tips, in samples, shape (P,).

    Parameters
    ----------
    count : int
        T.
    corners : array, shape (P,)
        Times, in samples.
    jumps : array, shape (P, D)
        Of the velocity, by samples.
    sigma : float
    """
    sizes = np.maximum(np.linalg.norm(jumps, axis=1), 1e-300)
    return np.asarray(np.minimum(4.0 * sigma / sizes, _room(count, corners)))


def likely(residual: Floats, corners: Floats, jumps: Floats, sigma: float, longest: bool) -> Floats:
    """Halves of blends that the samples ask for, in samples, shape (P,).

    Parameters
    ----------
    residual : array, shape (T, D)
        What corners without blends leave of the samples.
    corners, jumps, sigma
        As of `least`.
    longest : bool
        Whether to take, where none is clearly likelier than the least, the longest that is about as
        likely as any; else the least.
    """
    count = len(residual)
    halves = least(count, corners, jumps, sigma)
    for i, most in enumerate(_room(count, corners)):
        first = max(_SHORTEST, halves[i])
        if most <= first:
            continue
        steps = np.arange(np.ceil(np.log(most / first) / np.log(_STEP)))
        tried = np.concatenate([halves[i : i + 1], first * _STEP**steps, [most]])
        near = _near(corners[i], most)
        along = residual[near] @ jumps[i]
        inside = _inside(near, corners[i], tried)
        squares = float(jumps[i] @ jumps[i])
        costs = (np.sum(inside**2, axis=1) * squares - 2.0 * inside @ along) / sigma**2
        if costs.min() < costs[0] - _CLEARLY:
            halves[i] = tried[np.argmin(costs)]
        elif longest:
            within = (costs <= costs.min() + _AS_LIKELY) & (tried <= _UNSEEN * halves[i])
            halves[i] = np.max(tried, where=within, initial=halves[i])
    return halves


def added(count: int, corners: Floats, jumps: Floats, halves: Floats) -> Floats:
    """What blends add to the values, shape (T, D).

    Parameters
    ----------
    count, corners, jumps
        As of `least`.
    halves : array, shape (P,)
    """
    values = np.zeros((count, jumps.shape[1]))
    for at, jump, half in zip(corners.tolist(), jumps, halves.tolist(), strict=True):
        near = _near(at, half)
        values[near] += _inside(near, at, np.array([half]))[0][:, None] * jump
    return values


def _room(count: int, corners: Floats) -> Floats:
    legs = np.diff(np.concatenate([[0.0], corners, [count - 1.0]]))
    return np.asarray(_SHARE * np.minimum(legs[:-1], legs[1:]))


def _near(at: float, half: float) -> slice:
    return slice(int(np.ceil(at - half)), int(np.floor(at + half)) + 1)


def _inside(near: slice, at: float, halves: Floats) -> Floats:
    """Shares of the jump that blends add to samples, shape (S, n)."""
    distance = np.abs(np.arange(near.start, near.stop) - at)
    return np.asarray(np.maximum(halves[:, None] - distance, 0.0) ** 2 / (4.0 * halves[:, None]))
