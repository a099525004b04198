"""How far a drawn path is from the one it should be, as one number that several tests bound."""

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.metrics.deviation import nearest_distance


def nearest_rms(points: Floats, polyline: Floats) -> float:
    """Root mean square of the distances to the nearest point of a polyline, in the points' unit."""
    return float(np.sqrt(np.mean(nearest_distance(points, polyline) ** 2)))
