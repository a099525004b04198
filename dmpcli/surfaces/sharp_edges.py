"""The edges of a mesh that a draughtsman would draw: where it bends sharply, or ends."""

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.spatial.vectors import unit

BEND = np.radians(25.0)
"""Faces that meet at a larger angle have an edge between them."""


def sharp_edges(V: Floats, F: Integers, bend: float = BEND) -> Floats:
    """Return the sharp edges and the border of a mesh.

    Parameters
    ----------
    V : array, shape (v, 3)
        mm.
    F : array of int, shape (m, 3)
    bend : float
        rad.

    Returns
    -------
    array, shape (k, 2, 3)
        mm.
    """
    sides = np.sort(np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]]), axis=1)
    face = np.tile(np.arange(len(F)), 3)
    code = sides[:, 0] * len(V) + sides[:, 1]
    order = np.argsort(code, kind="stable")
    sides, face, code = sides[order], face[order], code[order]
    first = np.flatnonzero(np.append(True, np.diff(code) != 0))
    count = np.diff(np.append(first, len(code)))
    normal = unit(np.cross(V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]]))
    sharp = count != 2
    two = np.flatnonzero(count == 2)
    a, b = normal[face[first[two]]], normal[face[first[two] + 1]]
    sharp[two] = np.einsum("ij,ij->i", a, b) < np.cos(bend)
    return np.asarray(V[sides[first[sharp]]])
