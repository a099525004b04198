"""How far a mesh may lie from the smooth surface it was made of, judged by the mesh alone.

Where the surface is the graph of a quadratic form over a triangle, its height over the middle of
an edge is s = e · (n_b - n_a) / 8, with the edge e from a to b and the surface's normals there, and
its height at barycentric coordinates λ is 4 Σ_{i<j} λ_i λ_j s_ij: at most s_ij on an edge, and
4/9 Σ s_ij at the centroid. Normals are those of the mesh's corners, apart across creases.
"""

from dataclasses import dataclass

import igl
import numpy as np

from dmpcli.arrays import Floats, Integers

CREASE = 30.0
"""Faces that meet at more than this angle, degrees, are meant to: no chord of a smooth surface."""


@dataclass(frozen=True)
class ChordalError:
    """Estimated distance of a mesh's faces from the surface behind it, mm.

    Attributes
    ----------
    median, largest : float
        Over the faces. Of the noise of a scan they see about a half.
    """

    median: float
    largest: float


def chordal_error(V: Floats, F: Integers) -> ChordalError:
    """Estimate the chordal error of a mesh from the turn of its normals; second order.

    Parameters
    ----------
    V : array, shape (n, 3)
        Vertices, mm.
    F : array, shape (m, 3)
        Faces of consistent winding, all with area.

    Returns
    -------
    ChordalError
    """
    normals = igl.per_corner_normals(V, F, CREASE).reshape(-1, 3, 3)
    worst, total = np.zeros(len(F)), np.zeros(len(F))
    for a, b in ((0, 1), (1, 2), (2, 0)):
        edge, turn = V[F[:, b]] - V[F[:, a]], normals[:, b] - normals[:, a]
        sagitta = np.einsum("fi,fi->f", edge, turn) / 8.0
        worst = np.maximum(worst, np.abs(sagitta))
        total += sagitta
    worst = np.maximum(worst, np.abs(total) * (4.0 / 9.0))
    return ChordalError(float(np.median(worst)), float(worst.max()))
