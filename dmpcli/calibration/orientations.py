"""How the tool is turned for a calibration: tilts all around, in two rounds of opposite twist."""

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.spatial.rotations import exp

TWIST = np.pi / 4.0
"""Turn about the tool's own axis, one way in the first round and back in the second, rad."""


def around(rotation: Floats, count: int, tilt: float) -> Floats:
    """Return orientations around one, in the order in which to visit them.

    Tilts alone leave the zeros across the tool badly known (condition number 3.6 for 45°), hence
    the twist (2.4). Two rounds and not one: a zero that drifts evenly over the calibration then
    looks half as much like weight.

    Parameters
    ----------
    rotation : array, shape (3, 3)
        The present one, which is not among them.
    count : int
        How many; 4 or more.
    tilt : float
        Of the tool's axis against the present one, rad.

    Returns
    -------
    array, shape (count, 3, 3)
    """
    first = (count + 1) // 2
    rounds = [np.arange(first) / first, (np.arange(count - first) + 0.5) / (count - first)]
    angle = 2.0 * np.pi * np.concatenate(rounds)
    twist = np.repeat([TWIST, -TWIST], [first, count - first])
    nothing = np.zeros(count)
    tilts = exp(tilt * np.column_stack([np.cos(angle), np.sin(angle), nothing]))
    return np.asarray(rotation @ tilts @ exp(np.column_stack([nothing, nothing, twist])))
