"""The surface's normal where a tool slides, from what it feels and how it moves.

Friction opposes the sliding: a surface with the unit normal n pushes a tool that slides along the
unit tangent s with N (n - mu s). By the planned normal n_p and two tangents t1, t2 across it, the
true normal is n_p + a t1 + b t2 but for its length, and to first order::

    F·t1 / F·n_p = a - mu s·t1        the force across the planned normal, friction removed
    F·t2 / F·n_p = b - mu s·t2
    -s·n_p = a s·t1 + b s·t2          the motion lies in the surface

What the first two leave open while the tool slides in one direction, tilt along it or friction, the
third one settles. The three unknowns are followed by recursive least squares (a Kalman filter of
unknowns that wander); what lies further off than three deviations counts less (Huber), as at an
edge or a knock.
"""

import math

import numpy as np

from dmpcli.arrays import Floats

SLOWEST = 2.0
"""mm/s: a tool that slides more slowly tells nothing of friction and tangent."""

# Standard deviations: of a force, N; of a motion along the normal while a force is held, mm/s;
# of what is off for other reasons, rad.
_FORCE, _MOTION, _ELSE = 0.1, 0.5, 0.01
# What is known at first: tilt, rad; friction and its deviation.
_TILT, _FRICTION, _FRICTION_KNOWN = 0.1, 0.2, 0.15
# How they wander in a second, rad and 1.
_TILTS, _RUBS = 0.05, 0.02
_FAR = 3.0
_MOST_FRICTION = 1.0


class NormalEstimator:
    """Follows tilt and friction of the surface under a tool that slides.

    Parameters
    ----------
    period : float
        s.
    friction : float
        What it is taken for at first.

    Attributes
    ----------
    friction : float
        mu.
    heard : int
        Cycles that told something.
    """

    def __init__(self, period: float, friction: float = _FRICTION) -> None:
        self._x = np.array([0.0, 0.0, friction])
        self._P = np.diag([_TILT**2, _TILT**2, _FRICTION_KNOWN**2])
        self._Q = np.diag([_TILTS**2, _TILTS**2, _RUBS**2]) * period
        self._first: Floats | None = None
        self._axes = np.eye(3)
        self.heard = 0

    @property
    def friction(self) -> float:
        """Coulomb's coefficient."""
        return float(self._x[2])

    @property
    def normal(self) -> Floats:
        """Unit normal, shape (3,), base axes; the planned one while nothing is known."""
        a, b, _ = self._x
        found: Floats = self._axes[2] + a * self._axes[0] + b * self._axes[1]
        return found / math.sqrt(1.0 + a * a + b * b)

    @property
    def angle(self) -> float:
        """Between the planned and the estimated normal, rad."""
        return math.atan(math.hypot(self._x[0], self._x[1]))

    def carry(self, planned: Floats) -> None:
        """Go on to the planned normal of another place; the tilt goes with it.

        Parameters
        ----------
        planned : array, shape (3,)
            Unit vector.
        """
        if self._first is None:
            away = np.eye(3)[int(np.argmin(np.abs(planned)))]
            self._first = away
        first = self._first - (self._first @ planned) * planned
        first = first / math.sqrt(first @ first)
        self._first = first
        x, y, z = planned.tolist()
        u, v, w = first.tolist()
        self._axes = np.array([[u, v, w], [y * w - z * v, z * u - x * w, x * v - y * u], planned])

    def feel(self, force: Floats, velocity: Floats, planned: Floats) -> bool:
        """Take in one cycle.

        Parameters
        ----------
        force : array, shape (3,)
            On the tool, base axes, N.
        velocity : array, shape (3,)
            Of the tool, mm/s.
        planned : array, shape (3,)
            Unit normal, to the tool's side.

        Returns
        -------
        bool
            Whether it told something: the surface pushes, and the tool slides.
        """
        self.carry(planned)
        f1, f2, push = (self._axes @ force).tolist()
        v1, v2, rise = (self._axes @ velocity).tolist()
        speed = math.hypot(v1, v2)
        if push <= 0.0 or speed < SLOWEST:
            return False
        s1, s2 = v1 / speed, v2 / speed
        self._P = self._P + self._Q
        by_force = (_FORCE / push) ** 2 + _ELSE**2
        by_motion = (_MOTION / speed) ** 2 + _ELSE**2
        self._learn(np.array([1.0, 0.0, -s1]), f1 / push, by_force)
        self._learn(np.array([0.0, 1.0, -s2]), f2 / push, by_force)
        self._learn(np.array([s1, s2, 0.0]), -rise / speed, by_motion)
        self._x[2] = min(max(self._x[2], 0.0), _MOST_FRICTION)
        self.heard += 1
        return True

    def _learn(self, row: Floats, value: float, variance: float) -> None:
        """One equation, ``row @ x = value``."""
        spread = self._P @ row
        known = float(row @ spread)
        off = value - float(row @ self._x)
        far = abs(off) / (_FAR * math.sqrt(known + variance))
        whole = known + variance * max(far, 1.0) ** 2
        gain = spread / whole
        self._x = self._x + gain * off
        self._P = self._P - gain[:, None] * spread


def turned(now: Floats, wanted: Floats, planned: Floats, most: float, step: float) -> Floats:
    """Turn a normal towards another, within a bound about the planned one and a step at a time.

    Parameters
    ----------
    now, wanted, planned : array, shape (3,)
        Unit vectors.
    most : float
        Largest angle to the planned one, rad, below a right angle.
    step : float
        Largest angle from the one now, rad.

    Returns
    -------
    array, shape (3,)
        Unit vector.
    """
    return _near(now, _near(planned, wanted, most), step)


def _near(centre: Floats, wanted: Floats, most: float) -> Floats:
    """The direction within an angle of a centre that is nearest to the one that is wanted."""
    cosine = float(centre @ wanted)
    across = wanted - cosine * centre
    sine = math.sqrt(across @ across)
    if math.atan2(sine, cosine) <= most or sine == 0.0:
        return wanted
    found: Floats = math.cos(most) * centre + math.sin(most) / sine * across
    return found
