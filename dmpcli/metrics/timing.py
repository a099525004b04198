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
        Deadlines at which nothing was sent, because the loop was still late from one before.
    cycles : int
    """

    median: float
    p99: float
    worst: float
    missed: int
    cycles: int


def punctuality(deadline: Floats, lateness: Floats, period: float) -> Punctuality:
    """Return the deadline statistics of a run.

    Parameters
    ----------
    deadline : array, shape (n,)
        When each set-point was due, s; the gaps between them are the deadlines that were missed.
    lateness : array, shape (n,)
        How much later than due each set-point was sent, s.
    period : float
        Servo period, s.
    """
    median, p99 = np.quantile(lateness, [0.50, 0.99])
    due = np.rint(np.diff(deadline) / period)
    return Punctuality(
        float(median),
        float(p99),
        float(np.max(lateness)),
        int(np.maximum(due - 1.0, 0.0).sum()),
        len(lateness),
    )


def spread(values: Floats) -> dict[str, float]:
    """Return median, 99th percentile and maximum as a file's metadata hold them.

    Parameters
    ----------
    values : array, shape (n,)
        At least one.
    """
    median, p99 = np.quantile(values, [0.50, 0.99])
    return {"p50": float(median), "p99": float(p99), "max": float(np.max(values))}
