"""Normals of scans: noise in the vertices is told from shape, and averaged out of the normals.

Noise of σ on edges of length h tilts facets by about σ/h: 0.1 mm on 1.5 mm makes facets meet at up
to 50°. Those are no creases, and normals split there would be those of single facets.
"""

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.surfaces.vectors import cross, length, unit

# Tilt of facets against the normals around them, by the angle to their neighbours, in the median:
# 0.85 to 0.95 of noise, below 0.5 of smooth shapes with ten edges or more to the wave.
_NOISE = 0.75
# Between these the median angle of neighbouring facets lies in scans, degrees: in parts of flat
# faces it is 0, or that of their corners.
_LEAST, _LARGEST = 0.5, 30.0
# Rounds of averaging. More of them carry strokes better over gentle shapes, worse over lively ones.
_ROUNDS = 3
# Noise over tilt times edge length: 0.60 to 0.64 on four shapes, 0.02 to 0.15 mm on 1.5 mm.
_SIGMA = 0.63


def noise(
    face_normals: Floats, normals: Floats, faces: Integers, dihedrals: Floats, edge: float
) -> float:
    """Estimate the noise of vertices, mm, as a standard deviation; 0 where a mesh is smooth.

    Parameters
    ----------
    face_normals : array, shape (m, 3)
    normals : array, shape (n, 3)
        Unit normals at the vertices.
    faces : array of int, shape (m, 3)
    dihedrals : array, shape (m, 3)
        Degrees.
    edge : float
        Mean length of the edges, mm.
    """
    between = float(np.median(dihedrals))
    if not _LEAST < between < _LARGEST:
        return 0.0
    around = unit(normals[faces].sum(axis=1))
    sine = length(cross(face_normals, around))
    tilt = float(np.median(np.arcsin(np.minimum(sine, 1.0))))
    return _SIGMA * tilt * edge if np.degrees(tilt) > _NOISE * between else 0.0


def averaged(normals: Floats, faces: Integers) -> Floats:
    """Average unit normals (n, 3) at vertices over their neighbours, several times."""
    from scipy.sparse import csr_array

    count = len(normals)
    ones = np.ones(faces.size)
    rows = np.repeat(np.arange(len(faces)), 3)
    touches = csr_array((ones, (rows, faces.reshape(-1))), shape=(len(faces), count))
    back = csr_array(touches.T)
    for _ in range(_ROUNDS):
        normals = unit(np.asarray(back @ unit(np.asarray(touches @ normals))))
    return normals
