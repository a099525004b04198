"""Length, speed and ends of a path."""

import numpy as np

from dmpcli.arrays import Floats


def path_length(position: Floats) -> float:
    """Length of a polyline, mm; noise lengthens it, nothing is smoothed here.

    Parameters
    ----------
    position : array, shape (n, 3)
        mm.
    """
    return float(np.linalg.norm(np.diff(position, axis=0), axis=1).sum())


def duration(t: Floats) -> float:
    """Time from the first to the last sample, s.

    Parameters
    ----------
    t : array, shape (n,)
    """
    return float(t[-1] - t[0])


def peak_speed(t: Floats, position: Floats) -> float:
    """Largest mean speed between two samples, mm/s.

    Parameters
    ----------
    t : array, shape (n,)
        Increasing, s.
    position : array, shape (n, 3)
        mm.
    """
    return float((np.linalg.norm(np.diff(position, axis=0), axis=1) / np.diff(t)).max())


def end_errors(position: Floats, start: Floats, goal: Floats) -> tuple[float, float]:
    """Distances of the first sample to the start and of the last one to the goal, mm.

    Parameters
    ----------
    position : array, shape (n, 3)
        mm.
    start, goal : array, shape (3,)
        Where the stroke should begin and end, mm.
    """
    return (
        float(np.linalg.norm(position[0] - start)),
        float(np.linalg.norm(position[-1] - goal)),
    )
