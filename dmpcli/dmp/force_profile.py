"""The force along a stroke: a seventh primitive beside the six of the pose, on the same phase.

A pen that is pressed stands deep in its own spring: its height over the surface is then no
geometry, and is drawn as 0.
"""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp import transformation_system
from dmpcli.dmp.canonical_system import Basis, phase
from dmpcli.dmp.transformation_system import TransformationGains

LEAST = 0.5
"""Less force is no contact, N; what is drawn of a profile below it is 0."""

# Between these forces, N, a pen's height passes from what was recorded to 0.
_LIFTED, _PRESSED = 0.25, 0.75


@dataclass(frozen=True)
class ForceProfile:
    """The force along the normal: one movement primitive, eq. (9)-(11), on a skill's phase.

    Attributes
    ----------
    weights : array, shape (N,)
        Of the skill's own basis functions.
    alpha_f : float
    start, goal : float
        x0 and g, N.
    initial_velocity : float
        V0 = tau dF/dt(0), N.
    rms, largest : float
        Deviation from the smoothed force of the demonstrations at equal times, N.
    """

    weights: Floats
    alpha_f: float
    start: float
    goal: float
    initial_velocity: float
    rms: float = 0.0
    largest: float = 0.0

    def at(
        self,
        t: Floats,
        spring: TransformationGains,
        basis: Basis,
        alpha_1: float,
        duration: float,
    ) -> Floats:
        """Solve eq. (9)-(11) for the force.

        Parameters
        ----------
        t : array, shape (T,)
            Non-decreasing from 0, s, on the demonstration's time scale.
        spring : TransformationGains
            Of the skill; its first axis is taken.
        basis : Basis
            N functions.
        alpha_1 : float
        duration : float
            T_d, s.

        Returns
        -------
        array, shape (T,)
            N.
        """
        one = TransformationGains(spring.k[:1], spring.d[:1], spring.tau)

        def forcing(at: Floats) -> Floats:
            s = phase(at, one.tau, alpha_1)
            return np.asarray(basis.mean(s, self.weights[None]) * s[..., None])  # eq. (7)

        step = transformation_system.longest_step(one, duration, len(basis))
        a, b, c = transformation_system.homogeneous(one, t)
        own = transformation_system.forced(one, forcing, t, step)
        found: Floats = (  # eq. (9)-(10), solved
            self.start * a + self.goal * b + self.initial_velocity * c + self.alpha_f * own
        )
        return found[:, 0]


def unsprung(w: Floats, force: Floats) -> Floats:
    """Heights of a stroke whose pen is pressed: 0 in contact, lifted parts over the surface.

    Parameters
    ----------
    w : array, shape (T,)
        As recorded, mm.
    force : array, shape (T,)
        Along the normal, N.

    Returns
    -------
    array, shape (T,)
        mm; lifted parts count from where the pen touches and leaves.
    """
    touching = force > LEAST
    met = np.flatnonzero(touching[1:] != touching[:-1])
    level = float(np.mean(w[[*met, *(met + 1)]])) if len(met) else 0.0
    share = np.clip((force - _LIFTED) / (_PRESSED - _LIFTED), 0.0, 1.0)
    pressed = share * share * (3.0 - 2.0 * share)
    return np.asarray((1.0 - pressed) * (w - level))
