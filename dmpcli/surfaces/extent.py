"""Area and volume of a mended mesh."""

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.spatial.vectors import cross, dot, length
from dmpcli.surfaces.topology import Topology


def area(V: Floats, F: Integers) -> float:
    """Area of faces (m, 3) of vertices (n, 3), in the square of their unit."""
    a, b, c = np.moveaxis(V[F], 1, 0)
    return float(length(cross(b - a, c - a)).sum() / 2.0)


def volume(V: Floats, F: Integers) -> float | None:
    """Volume that closed pieces enclose, in the cube of the unit; None where a piece is open.

    A piece that is wound against the one whose box holds it is a cavity there. Others count
    whichever way they are wound.

    Parameters
    ----------
    V : array, shape (n, 3)
    F : array of int, shape (m, 3)
        Faces, wound alike within each piece.
    """
    topology = Topology(F, len(V))
    if not topology.closed(V).all():
        return None
    piece = topology.components
    count = int(piece.max()) + 1
    a, b, c = np.moveaxis(V[F] - V.mean(axis=0), 1, 0)
    signed = np.bincount(piece, dot(a, cross(b, c))[:, 0], count) / 6.0
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    for corner in F.T:
        np.minimum.at(low, piece, V[corner])
        np.maximum.at(high, piece, V[corner])
    total = 0.0
    for i in range(count):
        holds = (low <= low[i]).all(axis=1) & (high >= high[i]).all(axis=1)
        holds &= np.abs(signed) > abs(signed[i])
        cavity = bool((holds & (signed * signed[i] < 0.0)).any())
        total += -abs(signed[i]) if cavity else abs(signed[i])
    return float(total)
