"""Gaps of a recording that are too long to be filled in, and what lies between them."""

import numpy as np

from dmpcli.arrays import Floats

LONGEST_GAP = 25.0
"""A gap of more median steps than this cannot be filled in: nobody knows what the tool did."""


def inside(t: Floats, start: float | None, until: float | None) -> slice:
    """Samples of a recording that no gap too long to be filled in parts from two times.

    Parameters
    ----------
    t : array, shape (T,)
        Increasing, s.
    start, until : float or None
        s from the first sample; None is where the recording begins and ends.

    Returns
    -------
    slice
        What is beyond a gap before or after them is left out; a gap between them is inside.
    """
    steps = np.diff(t)
    gaps: list[int] = []
    if len(steps):
        gaps = np.flatnonzero(steps > LONGEST_GAP * np.median(steps)).tolist()
    first, stop = 0, len(t)
    for at in gaps:
        if start is not None and t[at] - t[0] < start:
            first = at + 1
        elif until is not None and t[at + 1] - t[0] > until:
            stop = at + 1
            break
    return slice(first, stop)
