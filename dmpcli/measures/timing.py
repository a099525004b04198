"""How punctual a control loop was."""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats


@dataclass(frozen=True)
class Punctuality:
    """Lateness of a loop's set-points.

    Attributes
    ----------
    median, p99, worst : float
        Lateness after the deadline, s.
    missed : int
        Cycles whose set-point left a full period late or more: the next one was already due.
    cycles : int
    """

    median: float
    p99: float
    worst: float
    missed: int
    cycles: int


def punctuality(lateness: Floats, period: float) -> Punctuality:
    """Return the deadline statistics of a run.

    Parameters
    ----------
    lateness : array, shape (n,)
        How much later than due each set-point was sent, s.
    period : float
        Servo period, s.
    """
    median, p99 = np.quantile(lateness, [0.50, 0.99])
    return Punctuality(
        float(median),
        float(p99),
        float(np.max(lateness)),
        int(np.count_nonzero(lateness >= period)),
        len(lateness),
    )
