"""A skill: what `fit` learns of a stroke, and all that `generalize` needs."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from dmpcli.arrays import Booleans, Floats
from dmpcli.primitives import dynamics
from dmpcli.primitives.dynamics import Spring
from dmpcli.primitives.phase import Basis, phase

Model = Literal["modified", "original"]
ForcingScale = Literal["axis", "distance"]


@dataclass(frozen=True)
class TaskFrame:
    """Where and how the stroke was demonstrated, in the base frame.

    Attributes
    ----------
    start, goal : array, shape (3,)
        mm.
    axes : array, shape (3, 3)
        C_d, columns e_u, e_v, n of the demonstration's chart.
    rotation : array, shape (3, 3), or None
        R(0); None where the demonstration has no orientation.
    """

    start: Floats
    goal: Floats
    axes: Floats
    rotation: Floats | None

    @property
    def normal(self) -> Floats:
        """Unit normal of the demonstration's plane, on the tool's side, shape (3,)."""
        return self.axes[:, 2]

    @property
    def length(self) -> float:
        """Distance from start to goal, mm."""
        return float(np.linalg.norm(self.goal - self.start))


@dataclass(frozen=True)
class Skill:
    """Six dynamic movement primitives, eq. (4)-(8) or (9)-(11).

    The six coordinates of the modified model are those of the chart (u, v, w, mm) and the X-Y-Z
    Euler angles of E = C_dᵀ R(t) R(0)ᵀ C_d (rad); those of the original model are x, y, z of the
    base frame and the angles of R(t) R(0)ᵀ.

    Attributes
    ----------
    model : {'modified', 'original'}
    forcing_scale : {'axis', 'distance'} or None
        What (g - x0) in eq. (7) means for the original model; None for the modified one.
    spring : Spring
        k, d, shape (6,), and tau in s.
    alpha_1 : float
    basis : Basis
        N functions.
    weights : array, shape (6, N)
    forcing_factor : array, shape (6,)
        The demonstration's factor beside s in eq. (7): g - x0 for the original model, 1 for the
        modified one.
    exempt : array of bool, shape (6,)
        Axes of the original model whose g - x0 is too small to divide by; their factor is always 1.
    alpha_f : array, shape (6,)
        Factor of the forcing term in eq. (9), identified at fit time.
    alpha_e : array, shape (6,)
        Factor of the force coupling in eq. (10); k/d, unit gain at rest.
    start, goal : array, shape (6,)
        x0 and g of the demonstration, in the skill's coordinates.
    initial_velocity : array, shape (6,)
        V0 = tau dx/dt(0), in the skill's coordinates.
    duration : float
        T_d, s.
    closed : bool
        Whether the stroke ends where it began.
    frame : TaskFrame
    """

    model: Model
    forcing_scale: ForcingScale | None
    spring: Spring
    alpha_1: float
    basis: Basis
    weights: Floats
    forcing_factor: Floats
    exempt: Booleans
    alpha_f: Floats
    alpha_e: Floats
    start: Floats
    goal: Floats
    initial_velocity: Floats
    duration: float
    closed: bool
    frame: TaskFrame

    @property
    def oriented(self) -> bool:
        """Whether the demonstration had an orientation."""
        return self.frame.rotation is not None

    def forcing(self, t: Floats) -> Floats:
        """``f(s(t))`` of eq. (7), demonstration scale, without alpha_f.

        Parameters
        ----------
        t : array, shape (...,)
            s, on the demonstration's time scale.

        Returns
        -------
        array, shape (..., 6)
        """
        s = phase(t, self.spring.tau, self.alpha_1)
        f = self.basis.mean(s, self.weights)
        f *= self.forcing_factor * s[..., None]
        return f

    def response(self, t: Floats) -> "Response":
        """Solve eq. (9)-(11) for unit start, goal and initial velocity, and for the forcing term.

        Parameters
        ----------
        t : array, shape (T,)
            Non-decreasing from 0, s, on the demonstration's time scale.
        """
        # A third of the distance between two centres resolves the narrowest basis function.
        step = self.duration / max(1, len(self.basis) - 1) / 3.0
        a, b, c = dynamics.homogeneous(self.spring, t)
        forced = dynamics.forced(self.spring, self.forcing, t, step)
        return Response(a, b, c, forced)


@dataclass(frozen=True)
class Response:
    """The four parts of every roll-out of a skill, each of shape (T, 6).

    ``x = x0 a + g b + S (V0 c + alpha_f forced)``; S scales the stroke per pair and axis.
    """

    a: Floats
    b: Floats
    c: Floats
    forced: Floats
