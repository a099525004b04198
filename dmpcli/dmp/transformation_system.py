"""The transformation system, solved exactly.

Once the phase is fixed, eq. (9) and (10) without coupling are a linear system with the state
(x, V) per axis::

    tau dV/dt = k (g - x) - d V + f(s(t))        (4), (9)
    tau dx/dt = V                                (5), (10)

so that ``x(t) = x0 a(t) + g b(t) + V0 c(t) + F(t)`` with ``a + b = 1`` and F the response to the
forcing term alone. a, b and c are closed forms; F is integrated with the exact 2×2 exponential and
Gauss-Legendre quadrature of the forcing, which leaves rounding error only.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from dmpcli.arrays import Floats

# Six nodes a step: with steps of a third of the narrowest basis function the quadrature error is
# below the rounding error of a stroke of a metre.
NODES = 6
# Longest step by the time in which the spring's faster mode falls to 1/e: six nodes leave 1e-11.
_FALLEN = 2.5
# Steps that differ by less than this are equal but for the rounding of the time stamps.
_EVEN = 1e-12


@dataclass(frozen=True)
class TransformationGains:
    """Gains and time constant of the six transformation systems.

    Attributes
    ----------
    k, d : array, shape (D,)
        Spring constant and damping of eq. (4); dimensionless, time is in units of tau.
    tau : float
        Time constant, s.
    """

    k: Floats
    d: Floats
    tau: float


def critical(d: Floats) -> Floats:
    """Spring constant of critical damping, ``k = d²/4``."""
    k: Floats = np.asarray(d, dtype=float) ** 2 / 4.0
    return k


def transition(spring: TransformationGains, h: Floats) -> Floats:
    """Matrix exponential of the free system over the times `h`.

    Parameters
    ----------
    spring : TransformationGains
        D axes.
    h : array, shape (...,)
        Time steps, s.

    Returns
    -------
    array, shape (..., D, 2, 2)
        Acts on the state (x - g, V).
    """
    h = np.asarray(h, dtype=float)[..., None] / spring.tau
    half = spring.d / 2.0
    discriminant = half**2 - spring.k
    root = np.sqrt(np.abs(discriminant))
    x = root * h
    # sinh(x)/root, sin(x)/root or h: over-, under- and critically damped. The over-damped
    # exponentials are joined with the decay so that long steps cannot overflow.
    over = discriminant > 0
    slow = np.exp(np.where(over, (root - half) * h, -half * h))
    twice = np.exp(np.where(over, -2.0 * x, 0.0))
    cosine = np.where(over, 0.5 * (1.0 + twice), np.cos(x))
    safe = np.where(root > 0, root, 1.0)
    sine = np.where(over, 0.5 * (1.0 - twice) / safe, np.where(root > 0, np.sin(x) / safe, h))
    # Of tau dV/dt = k (g - x) - d V, eq. (4) and (9), and tau dx/dt = V, eq. (5) and (10).
    E = np.empty((*h.shape[:-1], len(spring.k), 2, 2))
    E[..., 0, 0] = slow * (cosine + half * sine)
    E[..., 0, 1] = slow * sine
    E[..., 1, 0] = -spring.k * slow * sine
    E[..., 1, 1] = slow * (cosine - half * sine)
    return E


def homogeneous(spring: TransformationGains, t: Floats) -> tuple[Floats, Floats, Floats]:
    """Responses a, b, c to a unit start, goal and initial velocity V0 = tau dx/dt(0).

    Parameters
    ----------
    spring : TransformationGains
    t : array, shape (T,)
        s.

    Returns
    -------
    a, b, c : array, shape (T, D)
        ``x = x0 a + g b + V0 c``; a + b = 1.
    """
    E = transition(spring, t)
    a, c = E[..., 0, 0], E[..., 0, 1]
    return a, 1.0 - a, c


@cache
def quadrature(nodes: int) -> tuple[Floats, Floats]:
    """Return nodes and weights (n,) of the Gauss-Legendre quadrature over [0, 1]."""
    at, weights = np.polynomial.legendre.leggauss(nodes)
    return 0.5 * (at + 1.0), 0.5 * weights


def longest_step(spring: TransformationGains, duration: float, count: int) -> float:
    """Step that the quadrature of a forcing term of N functions can take, s.

    A third of the distance between two centres resolves the narrowest function; with few functions
    the spring is the faster of the two.

    Parameters
    ----------
    spring : TransformationGains
        Of its axes the fastest counts.
    duration : float
        Over which the centres are spread evenly, s.
    count : int
        N.
    """
    half = spring.d / 2.0
    fastest = half + np.sqrt(np.maximum(half**2 - spring.k, 0.0))
    fastest = np.maximum(fastest, np.sqrt(spring.k))
    return min(duration / max(1, count - 1) / 3.0, _FALLEN * spring.tau / float(fastest.max()))


def forced(
    spring: TransformationGains, forcing: Callable[[Floats], Floats], t: Floats, longest_step: float
) -> Floats:
    """Response F(t) of the transformation systems, at rest in 0, to their forcing terms.

    Parameters
    ----------
    spring : TransformationGains
        D axes.
    forcing : callable
        Times of any shape (...,), s, to forcing terms (..., D).
    t : array, shape (T,)
        Non-decreasing times, s, beginning at 0; any spacing.
    longest_step : float
        s; longer intervals are cut, so that the quadrature resolves the forcing.

    Returns
    -------
    array, shape (T, D)
    """
    intervals = np.diff(t)
    pieces = max(1, int(np.ceil(np.max(intervals, initial=0.0) / longest_step - 1e-9)))
    fractions = np.arange(pieces) / pieces
    starts = (t[:-1, None] + intervals[:, None] * fractions).ravel()
    h = np.repeat(intervals / pieces, pieces)
    nodes, weights = quadrature(NODES)
    f = forcing(starts[:, None] + h[:, None] * nodes)
    if len(h) and np.ptp(h) <= _EVEN * np.max(h):
        h = h[:1]  # one matrix serves all steps
    kernel = transition(spring, h[:, None] * (1.0 - nodes))[..., 1] / spring.tau
    weighted = f * (weights * h[:, None])[..., None]
    increments = np.sum(kernel * weighted[..., None], axis=1)  # eq. (4)-(5), (9)-(10)

    states = accumulated(transition(spring, h), increments)
    response = np.zeros((len(t), len(spring.k)))
    response[1:] = states[pieces - 1 :: pieces, :, 0]
    return response


def accumulated(E: Floats, z: Floats) -> Floats:
    """States ``z_n <- E_n z_(n-1) + z_n``, all at once: a parallel prefix of affine maps.

    Parameters
    ----------
    E : array, shape (n, D, 2, 2), or (1, D, 2, 2) where all steps are alike
        Matrix exponential of each step; one axis may stand for all.
    z : array, shape (n, D, 2)
        What the forcing adds to (x, V) in each step.

    Returns
    -------
    array, shape (n, D, 2)
        State after each step, at rest in 0 before the first.
    """
    E, z = E.copy(), z.copy()
    stride = 1
    while stride < len(z):
        head, tail = slice(None, -stride), slice(stride, None)
        later, earlier = (E, E) if len(E) == 1 else (E[tail], E[head])
        carried = later[..., 0] * z[head][..., :1] + later[..., 1] * z[head][..., 1:]
        z[tail] = z[tail] + carried
        if len(E) == 1:
            E = later @ earlier
        else:
            E[tail] = later @ earlier
        stride *= 2
    return z
