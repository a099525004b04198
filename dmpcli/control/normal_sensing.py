"""The surface's normal as the tool feels it: estimated in each cycle, told, and used on request."""

from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np

from dmpcli.admittance.normal_estimation import NormalEstimator, Vector, carried, turned
from dmpcli.arrays import Floats

# Over so many cycles the tool's own velocity is taken.
_WINDOW = 5
# So many cycles must have told something before an estimate is believed.
_BELIEVED = 25


@dataclass(frozen=True)
class NormalPolicy:
    """Whether the estimate leads the coupling, and within which bounds.

    Attributes
    ----------
    used : bool
    angle : float
        Furthest from the planned normal, rad.
    rate : float
        Fastest turn, rad/s.
    """

    used: bool = False
    angle: float = 0.175
    rate: float = 0.175


class NormalSense:
    """Follows the normal along the strokes of a run.

    Parameters
    ----------
    period : float
        s.
    policy : NormalPolicy
    """

    def __init__(self, period: float, policy: NormalPolicy) -> None:
        self._period, self._policy = period, policy
        self._estimator = NormalEstimator(period)
        self._way: deque[tuple[float, Vector]] = deque(maxlen=_WINDOW + 1)
        self._found: Vector | None = None
        self._used: Vector | None = None
        self._planned: Vector = (0.0, 0.0, 1.0)
        self._angles: list[float] = []

    @property
    def estimate(self) -> Floats | None:
        """Unit normal, shape (3,), base axes; None where nothing is known."""
        return None if self._found is None else np.array(self._found)

    @property
    def friction(self) -> float:
        """Coulomb's coefficient; 0 where it was not felt yet."""
        return 0.0 if self._found is None else self._estimator.friction

    def begin(self) -> None:
        """Get ready for the next stroke: of the surface elsewhere only its friction is known."""
        self._estimator = NormalEstimator(self._period, self._estimator.friction)
        self._way.clear()
        self._used = self._found = None

    def feel(self, t: float, force: Vector, position: Vector, planned: Vector) -> None:
        """Take in one cycle of the stroke in contact.

        Parameters
        ----------
        t : float
            s.
        force : tuple of float
            On the tool, its zero taken off, base axes, N.
        position : tuple of float
            Of the tool, as the arm tells it, mm.
        planned : tuple of float
            Unit normal.
        """
        way = self._way
        way.append((t, position))
        since, before = way[0]
        if len(way) <= _WINDOW or t <= since:
            return
        T, (x, y, z), (u, v, w) = t - since, position, before
        told = self._estimator.feel(force, ((x - u) / T, (y - v) / T, (z - w) / T), planned)
        if self._estimator.heard >= _BELIEVED:
            self._found = self._estimator.normal
            if told:
                self._angles.append(self._estimator.angle)

    def lift(self) -> None:
        """Say that the tool is lifted, or does not press."""
        self._way.clear()

    def normal(self, planned: Vector) -> Vector:
        """Return the normal along which the force is held."""
        policy = self._policy
        if not policy.used or self._found is None:
            return planned
        now = planned
        if self._used is not None:
            # The planned normal turns with the surface; the rate is that of the lean from it.
            now = carried(self._used, self._planned, planned)
        step = policy.rate * self._period
        self._used = turned(now, self._found, planned, policy.angle, step)
        self._planned = planned
        return self._used

    def facts(self) -> dict[str, Any]:
        """Return what a run file says of it; empty where nothing was known."""
        if not self._angles:
            return {}
        angles = np.array(self._angles)
        return {
            "normal_angle": {
                "mean": float(angles.mean()),
                "p95": float(np.percentile(angles, 95.0)),
                "used": self._policy.used,
            },
            "friction": self._estimator.friction,
        }
