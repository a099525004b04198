"""The response to N basis functions as a linear map, which no recording changes.

In shares of the duration the phase, the basis and the spring are the same for every stroke: what
the regression and the roll-out need of them is worked out once for each N.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp import end_conditions, transformation_system
from dmpcli.dmp.canonical_system import Basis, even_in_time, phase
from dmpcli.dmp.options import WidthRule
from dmpcli.dmp.regression import BandedRegression
from dmpcli.dmp.transformation_system import TransformationGains

if TYPE_CHECKING:
    from scipy.sparse import csr_array

# Samples for each basis function, and the fewest in all.
_SAMPLES = 8
_FEWEST = 640
# Models that are kept: those of one search for N.
_KEPT = 4


@dataclass(frozen=True, eq=False)
class ForcedModel:
    """N functions over a duration of 1, at S even samples.

    Attributes
    ----------
    basis : Basis
    regression : BandedRegression
        Over the samples.
    a, b, c : array, shape (S, 1)
        Responses to start, goal and V0, of `transformation_system.homogeneous`.
    end : array, shape (2, 2)
        Matrix exponential over the whole duration.
    end_responses : array, shape (2, N)
        Of `end_conditions.end_responses`.
    """

    basis: Basis
    regression: BandedRegression
    a: Floats
    b: Floats
    c: Floats
    end: Floats
    end_responses: Floats
    _step: Floats
    _increments: "tuple[csr_array, csr_array]"

    @property
    def samples(self) -> int:
        """S."""
        return len(self.a)

    @cached_property
    def end_moves(self) -> tuple[Floats, Floats]:
        """Changes of weights that correct the end, of `end_conditions.end_moves`.

        Returns
        -------
        moves : array, shape (N, 2)
        response : array, shape (S, 2)
            To them.
        """
        changed = min(end_conditions.CHANGED, len(self.basis))
        paths = self.response(np.eye(len(self.basis))[-changed:])
        moves = end_conditions.end_moves(paths, self.end_responses)
        return moves, paths @ moves[-changed:]

    @cached_property
    def start_move(self) -> tuple[Floats, Floats]:
        """Change of weights that makes up for another V0, of `end_conditions.start_move`.

        Returns
        -------
        move : array, shape (N,)
        response : array, shape (S,)
            To it.
        """
        changed = min(end_conditions.CHANGED, len(self.basis))
        paths = self.response(np.eye(changed, len(self.basis)))
        move = end_conditions.start_move(paths, self.c[:, 0], len(self.basis))
        return move, paths @ move[:changed]

    def response(self, weights: Floats) -> Floats:
        """Response to the forcing terms of weights (D, N) at the samples, shape (S, D)."""
        by_function = np.ascontiguousarray(weights.T)
        increments = np.stack([part @ by_function for part in self._increments], axis=-1)
        states = transformation_system.accumulated(self._step, increments)
        response = np.zeros((self.samples, len(weights)))
        response[1:] = states[..., 0]
        return response


@lru_cache(maxsize=_KEPT)
def forced_model(
    count: int, k: float, d: float, tau: float, alpha_1: float, widths: WidthRule
) -> ForcedModel:
    """Work out the linear map of N basis functions.

    Parameters
    ----------
    count : int
        N.
    k, d : float
        Of one axis.
    tau : float
        In units of the duration.
    alpha_1 : float
    widths : {'spacing', 'power'}

    Returns
    -------
    ForcedModel
    """
    steps = max(_SAMPLES * (count - 1), _FEWEST)
    spring = TransformationGains(np.array([k]), np.array([d]), tau)
    share = np.linspace(0.0, 1.0, steps + 1)
    basis = even_in_time(count, 1.0, tau, alpha_1, widths)
    a, b, c = transformation_system.homogeneous(spring, share)
    pieces = int(
        np.ceil(1.0 / steps / transformation_system.longest_step(spring, 1.0, count) - 1e-9)
    )
    return ForcedModel(
        basis,
        BandedRegression(basis, phase(share, tau, alpha_1)),
        a,
        b,
        c,
        transformation_system.transition(spring, np.array(1.0))[0],
        end_conditions.end_responses(spring, basis, alpha_1, 1.0),
        transformation_system.transition(spring, np.array([1.0 / steps])),
        _increments(spring, basis, alpha_1, steps, max(1, pieces)),
    )


def _increments(
    spring: TransformationGains, basis: Basis, alpha_1: float, steps: int, pieces: int
) -> "tuple[csr_array, csr_array]":
    """What each function adds to x and V over each step, by the nodes of `forced`."""
    from scipy.sparse import csr_array

    nodes, weights = transformation_system.quadrature(transformation_system.NODES)
    inside = ((np.arange(pieces)[:, None] + nodes) / pieces).ravel()
    h = 1.0 / steps
    s = phase(h * (np.arange(steps)[:, None] + inside).ravel(), spring.tau, alpha_1)
    functions = basis.window(s).normalized().scaled(s).sparse()
    kernel = transformation_system.transition(spring, h * (1.0 - inside))[:, 0, :, 1]
    kernel *= (np.tile(weights, pieces) * h / pieces / spring.tau)[:, None]
    ends = np.arange(0, len(s) + 1, len(inside))
    x, V = (
        csr_array((np.tile(part, steps), np.arange(len(s)), ends), shape=(steps, len(s)))
        @ functions
        for part in kernel.T
    )
    return x, V
