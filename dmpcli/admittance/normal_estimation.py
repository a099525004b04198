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
from typing import TypeAlias

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

Vector: TypeAlias = tuple[float, float, float]
"""Three plain floats: arrays of three take ten times as long, once a cycle."""


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
        self._x = (0.0, 0.0, friction)
        self._P = (_TILT**2, 0.0, 0.0, _TILT**2, 0.0, _FRICTION_KNOWN**2)  # its upper half
        self._wander = (_TILTS**2 * period, _RUBS**2 * period)
        self._first: Vector | None = None
        self._axes: tuple[Vector, Vector, Vector] | None = None
        self.heard = 0

    @property
    def friction(self) -> float:
        """Coulomb's coefficient."""
        return self._x[2]

    @property
    def normal(self) -> Vector:
        """Unit normal, base axes; of something that has been felt or carried."""
        if self._axes is None:
            raise ValueError("nothing is known of where the tool is")
        a, b, _ = self._x
        t1, t2, n = self._axes
        size = math.sqrt(1.0 + a * a + b * b)
        return (
            (n[0] + a * t1[0] + b * t2[0]) / size,
            (n[1] + a * t1[1] + b * t2[1]) / size,
            (n[2] + a * t1[2] + b * t2[2]) / size,
        )

    @property
    def angle(self) -> float:
        """Between the planned and the estimated normal, rad."""
        return math.atan(math.hypot(self._x[0], self._x[1]))

    def carry(self, planned: Vector) -> None:
        """Go on to the planned normal of another place; the tilt goes with it.

        Parameters
        ----------
        planned : tuple of float
            Unit vector.
        """
        x, y, z = planned
        if self._first is None:
            sizes = (abs(x), abs(y), abs(z))
            least = sizes.index(min(sizes))
            self._first = (float(least == 0), float(least == 1), float(least == 2))
        u, v, w = self._first
        off = u * x + v * y + w * z
        u, v, w = u - off * x, v - off * y, w - off * z
        size = math.sqrt(u * u + v * v + w * w)
        u, v, w = u / size, v / size, w / size
        self._first = (u, v, w)
        second = (y * w - z * v, z * u - x * w, x * v - y * u)
        self._axes = (self._first, second, (x, y, z))

    def feel(self, force: Vector, velocity: Vector, planned: Vector) -> bool:
        """Take in one cycle.

        Parameters
        ----------
        force : tuple of float
            On the tool, base axes, N.
        velocity : tuple of float
            Of the tool, mm/s.
        planned : tuple of float
            Unit normal, to the tool's side.

        Returns
        -------
        bool
            Whether it told something: the surface pushes, and the tool slides.
        """
        self.carry(planned)
        assert self._axes is not None
        t1, t2, n = self._axes
        push = dot(force, n)
        v1, v2, rise = dot(velocity, t1), dot(velocity, t2), dot(velocity, n)
        speed = math.hypot(v1, v2)
        if push <= 0.0 or speed < SLOWEST:
            return False
        s1, s2 = v1 / speed, v2 / speed
        p00, p01, p02, p11, p12, p22 = self._P
        tilts, rubs = self._wander
        self._P = (p00 + tilts, p01, p02, p11 + tilts, p12, p22 + rubs)
        by_force = (_FORCE / push) ** 2 + _ELSE**2
        by_motion = (_MOTION / speed) ** 2 + _ELSE**2
        self._learn(1.0, 0.0, -s1, dot(force, t1) / push, by_force)
        self._learn(0.0, 1.0, -s2, dot(force, t2) / push, by_force)
        self._learn(s1, s2, 0.0, -rise / speed, by_motion)
        a, b, mu = self._x
        self._x = (a, b, min(max(mu, 0.0), _MOST_FRICTION))
        self.heard += 1
        return True

    def _learn(self, h0: float, h1: float, h2: float, value: float, variance: float) -> None:
        """One equation, ``h @ x = value``."""
        x0, x1, x2 = self._x
        p00, p01, p02, p11, p12, p22 = self._P
        s0 = p00 * h0 + p01 * h1 + p02 * h2
        s1 = p01 * h0 + p11 * h1 + p12 * h2
        s2 = p02 * h0 + p12 * h1 + p22 * h2
        known = h0 * s0 + h1 * s1 + h2 * s2
        off = value - (h0 * x0 + h1 * x1 + h2 * x2)
        far = abs(off) / (_FAR * math.sqrt(known + variance))
        whole = known + variance * max(far, 1.0) ** 2
        g0, g1, g2 = s0 / whole, s1 / whole, s2 / whole
        self._x = (x0 + g0 * off, x1 + g1 * off, x2 + g2 * off)
        self._P = (
            p00 - g0 * s0,
            p01 - g0 * s1,
            p02 - g0 * s2,
            p11 - g1 * s1,
            p12 - g1 * s2,
            p22 - g2 * s2,
        )


def dot(a: Vector, b: Vector) -> float:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def carried(normal: Vector, before: Vector, planned: Vector) -> Vector:
    """Carry a normal with the planned one to another place: it leans from it as it did.

    Parameters
    ----------
    normal : tuple of float
        Unit vector, less than a right angle from `before`.
    before, planned : tuple of float
        The planned unit normals, less than a right angle apart.
    """
    upright = dot(normal, before)
    lean = _sum(normal, -upright, before)
    across = _sum(lean, -dot(lean, planned), planned)
    size = math.sqrt(dot(across, across))
    if size < 1e-12:
        return planned
    longer = math.sqrt(dot(lean, lean)) / size
    return _sum((upright * planned[0], upright * planned[1], upright * planned[2]), longer, across)


def turned(now: Vector, wanted: Vector, planned: Vector, most: float, step: float) -> Vector:
    """Turn a normal towards another, within a bound about the planned one and a step at a time.

    Parameters
    ----------
    now, wanted, planned : tuple of float
        Unit vectors.
    most : float
        Largest angle to the planned one, rad, below a right angle.
    step : float
        Largest angle from the one now, rad.

    Returns
    -------
    tuple of float
        Unit vector.
    """
    return _near(now, _near(planned, wanted, most), step)


def _near(centre: Vector, wanted: Vector, most: float) -> Vector:
    """The direction within an angle of a centre that is nearest to the one that is wanted."""
    cosine = dot(centre, wanted)
    across = _sum(wanted, -cosine, centre)
    sine = math.sqrt(dot(across, across))
    if math.atan2(sine, cosine) <= most or sine == 0.0:
        return wanted
    c = math.cos(most)
    return _sum((c * centre[0], c * centre[1], c * centre[2]), math.sin(most) / sine, across)


def _sum(a: Vector, times: float, b: Vector) -> Vector:
    return (a[0] + times * b[0], a[1] + times * b[1], a[2] + times * b[2])
