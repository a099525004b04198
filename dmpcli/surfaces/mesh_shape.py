"""The shape of a triangle mesh, face by face: normals, creases, noise, and how far to trust it."""

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.spatial.vectors import across, cross, dot, length, unit
from dmpcli.surfaces.mesh_noise import averaged, noise
from dmpcli.surfaces.topology import Topology

if TYPE_CHECKING:
    from dmpcli.surfaces.developable import Developable

# Where facets meet at more than this the edge is meant to be sharp: normals are not smoothed
# across it, and a strip whose normal turns as much within one step is unfolded instead, degrees.
CREASE = 25.0
# At the tip of a cone the normal leans off each facet by more than this, degrees, and so many times
# the angle between facets.
LEANING, TIMES = 5.0, 2.0
# Nor do normals lean off their facets by more than this anywhere else but in noise, rad.
MOST_LEAN = np.radians(14.9)
# However fine the mesh, points this near to it can be of the same surface, mm.
LEAST_REACH = 0.3


class MeshShape:
    """What the vertices V (n, 3), mm, and faces F (m, 3) of a mesh say of the surface behind it.

    Parameters
    ----------
    V : array, shape (n, 3)
        mm.
    F : array of int, shape (m, 3)
        With area, and wound alike.
    topology : Topology
        Of the faces.
    """

    def __init__(self, V: Floats, F: Integers, topology: Topology) -> None:
        self.V, self.F, self.topology = V, F, topology

    @cached_property
    def corners(self) -> Floats:
        """Corners of the faces, shape (m, 3, 3), mm."""
        return self.V.take(self.F, axis=0)  # several times as fast as indexing

    @cached_property
    def face_normals(self) -> Floats:
        """Unit normals of the facets, shape (m, 3)."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        return unit(cross(b - a, c - a))

    @cached_property
    def corner_normals(self) -> Floats:
        """Smooth normals at the corners of the faces, shape (m, 3, 3).

        Weighted by the corners' angles (G. Thürmer, C. Wüthrich: Computing vertex normals from
        polygonal facets. Journal of Graphics Tools 3 (1998) 43-46); at creases each side has its
        own. Where the mesh is noisy they are averages over several edges.
        """
        import igl

        normals = self.vertex_normals.take(self.F, axis=0)
        sharp = self.dihedrals > CREASE
        if sharp.any():
            split = igl.per_corner_normals(self.V, self.F, CREASE).reshape(-1, 3, 3)
            normals = np.where(self._ends(sharp)[self.F][..., None], split, normals)
        noisy = self.noise > 0.0
        if noisy.any():
            # Creases of smooth faces are creases beside noise too.
            apart = sharp & ~noisy[:, None]
            among = averaged(self.vertex_normals, self.F[~apart.any(axis=1)])
            joined = np.zeros(len(self.V), dtype=bool)
            joined[self.F[noisy]] = True
            joined &= ~self._ends(apart)
            over = noisy[:, None] | joined[self.F]
            normals = np.where(over[..., None], among[self.F], normals)
        return self._leaning_back(normals)

    def _leaning_back(self, normals: Floats) -> Floats:
        """Normals (m, 3, 3) of length 1, those of facets where they lean off these too far."""
        normals = unit(normals)
        flat = self.face_normals[:, None]
        normals = np.where(self._tips(normals)[..., None], flat, normals)
        # The rest of what leans too far is brought back: facets too coarse to tell the surface.
        cosine = dot(normals, flat)
        leaning = (cosine < np.cos(MOST_LEAN)) & (self.noise == 0.0)[:, None, None]
        back = np.cos(MOST_LEAN) * flat + np.sin(MOST_LEAN) * across(normals, flat)
        return np.where(leaning, back, normals)

    def _tips(self, normals: Floats) -> Booleans:
        """Corners (m, 3) whose normals are not those of the facets about them: the tips of cones.

        About a smooth point a normal leans off a facet by about the angle between facets there.
        """
        cosine = dot(normals, self.face_normals[:, None])[..., 0]
        lean = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
        bent = np.maximum(self.dihedrals, np.roll(self.dihedrals, 1, axis=1))
        return np.asarray((lean > LEANING + TIMES * bent) & (self.noise == 0.0)[:, None])

    def _ends(self, edges: Booleans) -> Booleans:
        """Vertices, shape (n,), at the ends of edges marked (m, 3)."""
        at = np.zeros(len(self.V), dtype=bool)
        at[self.F[edges]] = at[np.roll(self.F, -1, axis=1)[edges]] = True
        return at

    @cached_property
    def vertex_normals(self) -> Floats:
        """Unit normals at the vertices, shape (n, 3), by the angles of the faces about them."""
        import igl

        weighting = igl.PER_VERTEX_NORMALS_WEIGHTING_TYPE_ANGLE
        return np.asarray(igl.per_vertex_normals(self.V, self.F, weighting))

    @cached_property
    def noise(self) -> Floats:
        """Estimated standard deviation of vertices about each face, (m,), mm; 0 where smooth."""
        of = (self.corners, self.face_normals, self.vertex_normals, self.dihedrals)
        return noise(*of, self.topology)

    @cached_property
    def dihedrals(self) -> Floats:
        """Angles between the facets at each edge of each face, shape (m, 3), degrees; 0 at borders.

        Where three or more faces meet: 180, the edge is no smooth one.
        """
        across = self.topology.neighbours
        cosine = dot(self.face_normals[:, None], self.face_normals.take(across, axis=0))[..., 0]
        angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
        return np.where(across == -1, 0.0, np.where(across == -2, 180.0, angle))

    @cached_property
    def developable(self) -> "Developable":
        """Slivers that are to be unfolded; see `developable`."""
        from dmpcli.surfaces.developable import developable

        border = self.topology.border_vertices
        return developable(self.corners, self.F, self.dihedrals, border, CREASE)

    @cached_property
    def heights(self) -> Floats:
        """Chordal error of each face, (m,), mm; see `chordal_error`."""
        from dmpcli.surfaces.chordal_error import heights, split_normals

        normals = split_normals(self.V, self.F, self.face_normals)
        angles = np.radians(self.dihedrals)
        return heights(self.corners, normals, self.topology.neighbours, angles)

    @cached_property
    def reach(self) -> Floats:
        """Largest distance of the smooth course of a stroke from the mesh at each face, (m,), mm.

        By the chordal error of the faces that touch it, and by the noise about it.
        """
        at = np.zeros(len(self.V))
        np.maximum.at(at, self.F.reshape(-1), np.repeat(self.heights, 3))
        touching = at.take(self.F).max(axis=1)
        reach: Floats = np.maximum(LEAST_REACH, np.maximum(5.0 * touching, 6.0 * self.noise))
        return reach

    @property
    def noisy_share(self) -> float:
        """Share of the area that is noisy, 0 to 1."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        area = length(cross(b - a, c - a))[:, 0]
        return float(area[self.noise > 0.0].sum() / area.sum())
