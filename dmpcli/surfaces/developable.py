"""Where a mesh is bent without being stretched, so that unfolding it is exact.

CAD programs tessellate fillets and cylinders as slivers: facets as long as the part and as narrow
as the chordal tolerance asks. Their corners are far from most points of them, and normals
interpolated between those corners tell little of the surface in between: steps along them
mistake lengths by as much as the tolerance. But all the angles about such corners add up to 360°
(no defect), so that the facets unfold into the plane, and straight lines there are exact.
"""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.spatial.vectors import cross, dot, length

# A facet is a sliver if its longest edge is so many times its height over that edge.
_SLENDER = 5.0
# Facets that meet at less than this are one flat facet, rad.
_FLAT = 1e-3
# A corner whose angles miss 360° by less than this, rad, moves lines of 100 mm by 0.01 mm; the
# rounding of a binary STL alone causes up to 1e-5.
_DEFECT = 1e-4


@dataclass(frozen=True)
class Developable:
    """Which facets, shape (m,), are slivers to unfold, and which must not be.

    Attributes
    ----------
    slivers : array of bool
        Long, narrow, at an angle to a neighbour, and without defect at their corners.
    stretched : array of bool
        With a corner of smooth surroundings and a defect: straight lines pass it on either side in
        different directions, which jitters. Not looked for in meshes without slivers.
    """

    slivers: Booleans
    stretched: Booleans


def developable(
    corners: Floats, faces: Integers, dihedrals: Floats, on_border: Booleans, crease: float
) -> Developable:
    """Look for facets to be unfolded.

    Parameters
    ----------
    corners : array, shape (m, 3, 3)
        mm.
    faces : array of int, shape (m, 3)
    dihedrals : array, shape (m, 3)
        At the edges of each face, degrees.
    on_border : array of bool, shape (n,)
        Vertices; those have no defect.
    crease : float
        Edges sharper than this, degrees, are meant to be: their ends have none either.
    """
    edges = np.roll(corners, -1, axis=1) - corners
    sizes = length(edges)[..., 0]
    area = length(cross(edges[:, 0], edges[:, 1]))[:, 0]
    slender = sizes.max(axis=1) ** 2 > _SLENDER * area
    slivers = slender & (dihedrals > np.degrees(_FLAT)).any(axis=1)
    if not slivers.any():
        return Developable(slivers, np.zeros(len(faces), dtype=bool))
    back = -np.roll(edges, 1, axis=1)
    angle = np.arctan2(length(cross(edges, back))[..., 0], dot(edges, back)[..., 0])
    defect = 2.0 * np.pi - np.bincount(faces.reshape(-1), angle.reshape(-1), len(on_border))
    exempt = on_border.copy()
    sharp = dihedrals > crease
    exempt[faces[sharp]] = exempt[np.roll(faces, -1, axis=1)[sharp]] = True
    stretched = (~exempt & (np.abs(defect) > _DEFECT))[faces].any(axis=1)
    return Developable(slivers & ~stretched, stretched)
