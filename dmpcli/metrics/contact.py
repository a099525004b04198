"""How a tool pressed on what it drew on."""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats


@dataclass(frozen=True)
class ContactMeasures:
    """Force along the surface normal.

    Attributes
    ----------
    least, mean, largest : float
        N; a surface pushes with a positive force.
    absent : float
        Share of the samples without contact, 0 to 1.
    threshold : float
        N; less is no contact.
    """

    least: float
    mean: float
    largest: float
    absent: float
    threshold: float


def contact(force: Floats, threshold: float) -> ContactMeasures:
    """Return how a tool pressed.

    Parameters
    ----------
    force : array, shape (n,)
        Along the normal, N; at least one.
    threshold : float
        N; less is no contact.
    """
    return ContactMeasures(
        float(np.min(force)),
        float(np.mean(force)),
        float(np.max(force)),
        float(np.mean(np.asarray(force) <= threshold)),
        threshold,
    )
