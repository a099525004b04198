"""Chatter of a dragged tool on stiff work: named, and damped away step by step.

A stiff plate behind a lagging servo lets the tool bounce at a few Hz, which the hand takes for its
own unrest. What tells it is the force along the tool: its mean over a tenth of a second alternates
by more than a hand's tremor does, five times within two seconds.
"""

from collections import deque

import numpy as np

from dmpcli.admittance.model import AdmittanceLaw
from dmpcli.admittance.oscillation import AlternationDetector
from dmpcli.arrays import Floats

_MEAN = 0.1  # s
_SIZE, _COUNT, _WINDOW = 2.5, 5, 2.0
FACTOR, MOST = 1.6, 6
"""By how much damping and inertia rise with each alarm, and how often at most."""
# An axis of the base takes part where the tool leans so little from it.
_ALONG = 0.5


class ChatterDetector:
    """Listens to the force along the tool, and makes the drag heavier where it chatters.

    Parameters
    ----------
    period : float
        s.

    Attributes
    ----------
    alarms : list of dict
        When, s, by how much the force alternated, N, and what damping and inertia were raised to.
    """

    def __init__(self, period: float) -> None:
        self._window: deque[float] = deque(maxlen=max(round(_MEAN / period), 1))
        self._detector = AlternationDetector(_SIZE, _COUNT, _WINDOW)
        self.alarms: list[dict[str, float]] = []

    @property
    def spent(self) -> bool:
        """Whether nothing more can be raised."""
        return len(self.alarms) >= MOST

    def feel(self, t: float, force: Floats, axis: Floats) -> bool:
        """Take in one cycle; tell whether an alarm is due.

        Parameters
        ----------
        t : float
            s.
        force : array, shape (3,)
            On the tool, compensated, not shortened by a dead-band, base axes, N.
        axis : array, shape (3,)
            Along the tool, unit vector.
        """
        self._window.append(float(force @ axis))
        mean = sum(self._window) / len(self._window)
        if not self._detector.feel(t, mean) or self.spent:
            return False
        swing = self._detector.swing
        self._detector.reset()
        factor = FACTOR ** (len(self.alarms) + 1)
        self.alarms.append({"t": round(t, 6), "swing": swing, "factor": factor})
        return True

    def said(self) -> str:
        """Say what the last alarm was."""
        last = self.alarms[-1]
        return (
            f"at {last['t']:.1f} s the tool chatters on the work, by {last['swing']:.1f} N: its "
            f"damping and inertia are {last['factor']:.2g} times the preset's now; a softer tool, "
            "a shorter look-ahead or a heavier preset helps"
        )


def damped(law: AdmittanceLaw, axis: Floats, factor: float = FACTOR) -> AdmittanceLaw:
    """Return a law that is heavier by a factor along the tool: as stable by itself as it was.

    Parameters
    ----------
    law : AdmittanceLaw
        Of six axes.
    axis : array, shape (3,)
        Along the tool, unit vector.
    factor : float
    """
    by = np.ones(6)
    by[:3] = np.where(np.abs(axis) >= _ALONG, factor, 1.0)
    return AdmittanceLaw(by * law.mass, by * law.damping, law.stiffness, law.period)
