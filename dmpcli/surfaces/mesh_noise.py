"""Normals of scans: noise in the vertices is told from shape, and averaged out of the normals.

Noise of σ on edges of length h tilts facets by about σ/h: 0.1 mm on 1.5 mm makes facets meet at up
to 50°. Those are no creases, and normals split there would be those of single facets.

Noise is a matter of place, and is judged by the area around each face. Two things tell it from
shape, and only together: facets that have neighbours both above and below them, and facets that
are tilted against the normals around them by most of the angle to their neighbours. A saddle has
the first everywhere, creases and the ends of cylinders have the second.
"""

import numpy as np
from scipy.sparse import csr_array

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.spatial.vectors import cross, dot, length, unit
from dmpcli.surfaces.topology import Topology

# Share of the area in facets with a convex and a concave edge: 0.6 to 1.0 of noise, 1.0 of saddles,
# below 0.5 of machined parts. Less will do beside what is surely noise.
_MIXED, _LESS_MIXED = 0.65, 0.5
# Tilt of facets against the normals around them, by the angle to their neighbours, as a mean over
# the area: 0.6 to 0.85 of noise of 3 to 7 % of an edge, below 0.52 of smooth shapes with ten edges
# or more to the wave.
TILTED, _LESS_TILTED = 0.6, 0.55
# That share of what is around must be surely noise, and the tilt one ring about a face this much.
_SEED, _ITSELF = 0.15, 0.5
# Edges less bent than this are flat, degrees; those more bent than the other are meant to be: noise
# of a tenth of an edge leaves one in a hundred so, and the rims of bores would pass for it.
LEAST, _MOST = 0.5, 60.0
# What is around a face: those that share a vertex with it, three times over.
_RINGS = 3
# Rounds of averaging. More of them carry strokes better over gentle shapes, worse over lively ones.
_ROUNDS = 3
# Noise over mean tilt times edge length.
_SIGMA = 0.59


def noise(
    corners: Floats, face_normals: Floats, normals: Floats, dihedrals: Floats, topology: Topology
) -> Floats:
    """Estimate the noise of the vertices about each face, mm, as a standard deviation.

    Parameters
    ----------
    corners : array, shape (m, 3, 3)
        mm.
    face_normals : array, shape (m, 3)
    normals : array, shape (n, 3)
        Unit normals at the vertices.
    dihedrals : array, shape (m, 3)
        Degrees.
    topology : Topology
        Of the m faces.

    Returns
    -------
    array, shape (m,)
        0 where the mesh is smooth.
    """
    around = unit(_at_corners(normals, topology.faces))
    tilt = np.arcsin(np.minimum(length(cross(face_normals, around))[:, 0], 1.0))
    between = np.radians(dihedrals.mean(axis=1))
    # A mean of ratios: the large angles of noise must not speak for a smooth region beside it.
    own = np.minimum(tilt / np.maximum(between, 1e-9), 1.0) * (between > np.radians(LEAST))
    if own.max(initial=0.0) < (1.0 - 1e-9) * TILTED:
        return np.zeros(len(corners))  # nor are means above it
    edges = np.roll(corners, -1, axis=1) - corners
    after = topology.neighbours
    # Positive at convex edges: the normals turn about the edge, which runs counter-clockwise.
    turn = dot(cross(face_normals[:, None], face_normals.take(after, axis=0)), edges)[..., 0]
    bent = (dihedrals > LEAST) & (dihedrals < _MOST) & (after >= 0)
    mixed = _any(bent & (turn > 0.0)) & _any(bent & (turn < 0.0))
    if not mixed.any():
        return np.zeros(len(corners))
    area = length(cross(edges[:, 0], edges[:, 1]))[:, 0]
    size = length(edges)[..., 0].mean(axis=1)
    seen = np.stack([mixed, own, tilt, between, size], axis=1)
    rings = _Rings(area, topology)
    share, own, tilt, between, size = rings.means(seen).T
    tilted = np.minimum(own, tilt / np.maximum(between, 1e-9)) * (between > np.radians(LEAST))
    surely = (share > _MIXED) & (tilted > TILTED)
    if not surely.any():
        return np.zeros(len(corners))
    likely = (share > _LESS_MIXED) & (tilted > _LESS_TILTED)
    # Chance leaves gaps within noise and makes spots of it elsewhere: majorities decide.
    of_sure, of_likely = rings.means(np.stack([surely, likely], axis=1)).T
    noisy = (of_sure > 0.5) | ((of_likely > 0.5) & (of_sure > _SEED))
    # What is smooth itself is not noisy by what lies beside it.
    noisy &= rings.means(seen[:, 1:2], 1)[:, 0] > _ITSELF
    return np.where(noisy, _SIGMA * tilt * size, 0.0)


class _Rings:
    """Means by area over the faces around each."""

    def __init__(self, area: Floats, topology: Topology) -> None:
        self._area = area[:, None]
        self._faces = topology.faces
        self._back = _incidence(topology.faces, topology.vertices)[1]

    def means(self, values: Floats, rings: int = _RINGS) -> Floats:
        """Means of values (m, k) over so many rings."""
        sums = np.concatenate([self._area, self._area * values], axis=1)
        for _ in range(rings):
            sums = _at_corners(np.asarray(self._back @ sums), self._faces)
        means: Floats = sums[:, 1:] / sums[:, :1]
        return means


def _any(marks: Booleans) -> Booleans:
    """Tell which faces have a mark (m, 3): so several times as fast as along an axis."""
    a, b, c = marks.T
    return np.asarray(a | b | c)


def _at_corners(values: Floats, faces: Integers) -> Floats:
    """Sums (m, k) of the values (n, k) at the corners of faces."""
    sums, *others = (values.take(corner, axis=0) for corner in faces.T)
    for other in others:
        sums += other
    return np.asarray(sums)


def averaged(normals: Floats, faces: Integers) -> Floats:
    """Average unit normals at vertices over their neighbours, several times.

    Parameters
    ----------
    normals : array, shape (n, 3)
    faces : array of int, shape (m, 3)
        Vertices that share a face are neighbours.

    Returns
    -------
    array, shape (n, 3)
        Of length 1; the zero vector at vertices of no face.
    """
    touches, back = _incidence(faces, len(normals))
    for _ in range(_ROUNDS):
        normals = unit(np.asarray(back @ unit(np.asarray(touches @ normals))))
    return normals


def _incidence(faces: Integers, vertices: int) -> tuple[csr_array, csr_array]:
    """Which faces have which vertices, as matrices of ones (m, n) and (n, m)."""
    of = (np.ones(faces.size), faces.reshape(-1), np.arange(0, faces.size + 1, 3))
    touches = csr_array(of, shape=(len(faces), vertices))
    return touches, csr_array(touches.T)
