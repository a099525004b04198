"""A skill: what `fit` learns of a stroke, and all that `generalize` needs."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from dmpcli.arrays import Booleans, Floats
from dmpcli.dmp import transformation_system
from dmpcli.dmp.canonical_system import Basis, phase
from dmpcli.dmp.force_profile import LEAST, ForceProfile
from dmpcli.dmp.options import ForcingScale, Learning, Model
from dmpcli.dmp.transformation_system import TransformationGains

_HELD = 4
"""Responses that a skill remembers."""


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
class TaughtSurface:
    """The surface that a skill was taught on.

    Attributes
    ----------
    kind : {'plane', 'cylinder', 'sphere', 'mesh'}
    facts : mapping
        Of its file, as it was named: its SHA-256, unit and pose.
    """

    kind: str
    facts: Mapping[str, Any]


@dataclass(frozen=True)
class Accuracy:
    """How well a skill gives back what it was learned from.

    Attributes
    ----------
    tolerance : float
        What was asked for, mm.
    rms, largest : float
        Distance of the recording to the reproduction beyond its noise, mm.
    noise : float
        Standard deviation of the recording's noise, mm.
    within : bool
        Whether the skill keeps the tolerance, in wave height and orientation too.
    """

    tolerance: float
    rms: float
    largest: float
    noise: float
    within: bool


@dataclass(frozen=True)
class DemonstrationSpread:
    """Scatter of several demonstrations about their mean.

    Attributes
    ----------
    share : array, shape (P,)
        Of the duration, 0 to 1.
    deviation : array, shape (P, 6)
        Standard deviation of each coordinate, mm and rad.
    """

    share: Floats
    deviation: Floats


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
    spring : TransformationGains
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
    learning : {'tolerance', 'paper'}
        How it was learned.
    passes : int
        Of LWR.
    surface : TaughtSurface or None
        None for a skill in the chart of a plane.
    heights : tuple of float
        Least and largest w of the demonstrations, mm.
    side_guessed : bool
        Nothing told the side of the plane: a surface named later decides it.
    reached : Accuracy or None
        None for the paper's learning, and for skills of older files.
    spread : DemonstrationSpread or None
        None for a single demonstration.
    force : ForceProfile or None
        Along the normal, where it was learned; w is then 0 where it presses.
    """

    model: Model
    forcing_scale: ForcingScale | None
    spring: TransformationGains
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
    learning: Learning = "paper"
    passes: int = 1
    surface: TaughtSurface | None = None
    heights: tuple[float, float] = (0.0, 0.0)
    side_guessed: bool = False
    reached: Accuracy | None = None
    spread: DemonstrationSpread | None = None
    force: ForceProfile | None = None

    @property
    def oriented(self) -> bool:
        """Whether the demonstration had an orientation."""
        return self.frame.rotation is not None

    def turned_over(self) -> "Skill":
        """Return the skill of the same stroke seen from the plane's other side: -v, -w.

        Raises
        ------
        ValueError
            The skill has an orientation: its side is known.
        """
        if self.oriented:
            raise ValueError("a skill with an orientation knows its side")
        sign = np.array([1.0, -1.0, -1.0, 1.0, 1.0, 1.0])
        least, largest = self.heights
        axes = self.frame.axes * sign[:3]
        return replace(
            self,
            weights=self.weights * sign[:, None],
            start=self.start * sign,
            goal=self.goal * sign,
            initial_velocity=self.initial_velocity * sign,
            heights=(-largest, -least),
            frame=replace(self.frame, axes=axes),
        )

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
        f *= self.forcing_factor * s[..., None]  # eq. (7)
        return f

    def taught_force(self, t: Floats) -> Floats | None:
        """Force along the normal that was learned; None for a skill without.

        Parameters
        ----------
        t : array, shape (T,)
            Non-decreasing from 0, s, on the demonstration's time scale.

        Returns
        -------
        array, shape (T,), or None
            N; 0 where it is too small to be a contact.
        """
        if self.force is None:
            return None
        found = self.force.at(t, self.spring, self.basis, self.alpha_1, self.duration)
        return np.where(found < LEAST, 0.0, found)

    def response(self, t: Floats) -> "Response":
        """Solve eq. (9)-(11) for unit start, goal and initial velocity, and for the forcing term.

        Parameters
        ----------
        t : array, shape (T,)
            Non-decreasing from 0, s, on the demonstration's time scale.
        """
        key = np.asarray(t, dtype=float).tobytes()
        known = self._responses.pop(key, None)
        if known is None:
            step = transformation_system.longest_step(self.spring, self.duration, len(self.basis))
            a, b, c = transformation_system.homogeneous(self.spring, t)
            forced = transformation_system.forced(self.spring, self.forcing, t, step)
            for part in (a, b, c, forced):
                part.flags.writeable = False
            known = Response(a, b, c, forced)
            while len(self._responses) >= _HELD:
                del self._responses[next(iter(self._responses))]
        self._responses[key] = known
        return known

    @cached_property
    def _responses(self) -> "dict[bytes, Response]":
        """The last ones, by their times: where every pair has its own surface they come again."""
        return {}

    def __getstate__(self) -> dict[str, object]:
        # What is held stays; another process begins with nothing.
        return {name: value for name, value in vars(self).items() if name != "_responses"}


@dataclass(frozen=True)
class Response:
    """The four parts of every roll-out of a skill, each of shape (T, 6).

    ``x = x0 a + g b + S (V0 c + alpha_f forced)``; S scales the stroke per pair and axis.
    """

    a: Floats
    b: Floats
    c: Floats
    forced: Floats

    def between(self, skill: Skill, start: Floats, goal: Floats) -> Floats:
        """Return the stroke of a skill in the size in which it was taught, S = 1.

        Parameters
        ----------
        skill : Skill
        start, goal : array, shape (6,)
            x0 and g, in its coordinates.

        Returns
        -------
        array, shape (T, 6)
        """
        x: Floats = (  # eq. (9)-(10), solved
            start * self.a
            + goal * self.b
            + skill.initial_velocity * self.c
            + skill.alpha_f * self.forced
        )
        return x
