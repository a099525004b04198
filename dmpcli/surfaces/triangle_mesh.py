"""The geometry of triangle meshes: closest points with smooth normals, borders, resolution."""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Self

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.spatial.vectors import across, cross, dot, length, unit
from dmpcli.surfaces.mesh_noise import averaged, noise
from dmpcli.surfaces.surface import ClosestPoints
from dmpcli.surfaces.topology import Topology

if TYPE_CHECKING:
    from igl import AABB

    from dmpcli.surfaces.developable import Developable
    from dmpcli.surfaces.kernels.mesh import Compiled
    from dmpcli.surfaces.kernels.tree import Facets
    from dmpcli.surfaces.slits import Slits

# Where facets meet at more than this the edge is meant to be sharp: normals are not smoothed
# across it, and a strip whose normal turns as much within one step is unfolded instead, degrees.
CREASE = 25.0
# At the tip of a cone the normal leans off each facet by more than this, degrees, and so many times
# the angle between facets.
_LEANING, _TIMES = 5.0, 2.0
# Nor do normals lean off their facets by more than this anywhere else but in noise, rad.
_MOST_LEAN = np.radians(14.9)
# A point beside the border by less than this is on it, mm.
ON_BORDER = 1e-2
# However fine the mesh, points this near to it can be of the same surface, mm.
LEAST_REACH = 0.3


@dataclass(frozen=True)
class MeshParts:
    """What is costly to find of a mesh of m faces, to be kept and given back as it is.

    Attributes
    ----------
    neighbours : array of int, shape (m, 3)
        See `Topology`.
    components : array of int, shape (m,)
    corner_normals : array, shape (m, 3, 3)
    noise, heights : array, shape (m,)
        mm.
    """

    neighbours: Integers
    components: Integers
    corner_normals: Floats
    noise: Floats
    heights: Floats


class TriangleMesh:
    """A triangle mesh in the robot's base frame; see `Mesh` for geodesics and charts on it.

    Faces must be valid (in range, not degenerate) and wound alike; `records` sees to that. An
    object holds its search tree, so build it once and keep it.

    Parameters
    ----------
    V : array, shape (n, 3)
        mm.
    F : array of int, shape (m, 3)
    """

    def __init__(self, V: Floats, F: Integers) -> None:
        self.V = np.ascontiguousarray(V, dtype=float)
        self.F = np.ascontiguousarray(F, dtype=np.int64)
        self.topology = Topology(self.F, len(self.V))

    @property
    def parts(self) -> MeshParts:
        """What is costly to find, see `with_parts`."""
        return MeshParts(
            self.topology.neighbours,
            self.components,
            self.corner_normals,
            self.noise,
            self._heights,
        )

    @classmethod
    def with_parts(cls, V: Floats, F: Integers, parts: MeshParts) -> Self:
        """Return the mesh of which these are `parts`: bit by bit as if it had found them itself."""
        mesh = cls(V, F)
        # As cached properties keep what they found.
        vars(mesh.topology).update(neighbours=parts.neighbours, components=parts.components)
        found = {name: getattr(parts, name) for name in ("corner_normals", "noise")}
        vars(mesh).update(found, _heights=parts.heights)
        return mesh

    def __reduce__(self) -> tuple[type["TriangleMesh"], tuple[Floats, Integers]]:
        # What was built does not travel to another process; it is built there again.
        return type(self), (self.V, self.F)

    compiled = False
    """Whether strokes are carried by kernels, see `with_kernels`."""

    @cached_property
    def with_kernels(self) -> Self:
        """The same mesh, on which compiled kernels walk: quicker, and the same but for rounding."""
        twin = type(self)(self.V, self.F)
        vars(twin).update(vars(self))
        twin.compiled = True
        return twin

    @property
    def facets(self) -> "Facets":
        """The facets as kernels want them."""
        return self.for_kernels.facets

    @cached_property
    def for_kernels(self) -> "Compiled":
        """What kernels work on."""
        from dmpcli.surfaces.kernels.mesh import Geometry, compiled

        topology = self.topology
        return compiled(
            Geometry(
                self.F,
                self.corners,
                self.face_normals,
                self.corner_normals,
                self.reach,
                self.components,
                topology.neighbours,
                topology.border,
                topology.border_vertices,
            )
        )

    @cached_property
    def _tree(self) -> "AABB":
        import igl

        tree = igl.AABB()
        tree.init(self.V, self.F)
        return tree

    @cached_property
    def corners(self) -> Floats:
        """Corners of the faces, shape (m, 3, 3), mm."""
        return self.V[self.F]

    @cached_property
    def face_normals(self) -> Floats:
        """Unit normals of the facets, shape (m, 3)."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        return unit(cross(b - a, c - a))

    @cached_property
    def planes(self) -> Floats:
        """Unit normals of the facets and their distances from the origin, shape (m, 4)."""
        distance = dot(self.face_normals, self.corners[:, 0])
        return np.concatenate([self.face_normals, distance], axis=1)

    @cached_property
    def corner_normals(self) -> Floats:
        """Smooth normals at the corners of the faces, shape (m, 3, 3).

        Weighted by the corners' angles (G. Thürmer, C. Wüthrich: Computing vertex normals from
        polygonal facets. Journal of Graphics Tools 3 (1998) 43-46); at creases each side has its
        own. Where the mesh is noisy they are averages over several edges.
        """
        import igl

        normals = self._vertex_normals[self.F]
        sharp = self.dihedrals > CREASE
        if sharp.any():
            split = igl.per_corner_normals(self.V, self.F, CREASE).reshape(-1, 3, 3)
            normals = np.where(self._ends(sharp)[self.F][..., None], split, normals)
        noisy = self.noise > 0.0
        if noisy.any():
            # Creases of smooth faces are creases beside noise too.
            apart = sharp & ~noisy[:, None]
            among = averaged(self._vertex_normals, self.F[~apart.any(axis=1)])
            joined = np.zeros(len(self.V), dtype=bool)
            joined[self.F[noisy]] = True
            joined &= ~self._ends(apart)
            over = noisy[:, None] | joined[self.F]
            normals = np.where(over[..., None], among[self.F], normals)
        normals = unit(normals)
        flat = self.face_normals[:, None]
        normals = np.where(self._tips(normals)[..., None], flat, normals)
        # The rest of what leans too far is brought back: facets too coarse to tell the surface.
        cosine = dot(normals, flat)
        leaning = (cosine < np.cos(_MOST_LEAN)) & (self.noise == 0.0)[:, None, None]
        back = np.cos(_MOST_LEAN) * flat + np.sin(_MOST_LEAN) * across(normals, flat)
        return np.where(leaning, back, normals)

    def _tips(self, normals: Floats) -> Booleans:
        """Corners (m, 3) whose normals are not those of the facets about them: the tips of cones.

        About a smooth point a normal leans off a facet by about the angle between facets there.
        """
        cosine = dot(normals, self.face_normals[:, None])[..., 0]
        lean = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
        bent = np.maximum(self.dihedrals, np.roll(self.dihedrals, 1, axis=1))
        return np.asarray((lean > _LEANING + _TIMES * bent) & (self.noise == 0.0)[:, None])

    def _ends(self, edges: Booleans) -> Booleans:
        """Vertices, shape (n,), at the ends of edges marked (m, 3)."""
        at = np.zeros(len(self.V), dtype=bool)
        at[self.F[edges]] = at[np.roll(self.F, -1, axis=1)[edges]] = True
        return at

    @cached_property
    def _vertex_normals(self) -> Floats:
        import igl

        weighting = igl.PER_VERTEX_NORMALS_WEIGHTING_TYPE_ANGLE
        return np.asarray(igl.per_vertex_normals(self.V, self.F, weighting))

    @cached_property
    def noise(self) -> Floats:
        """Estimated standard deviation of vertices about each face, (m,), mm; 0 where smooth."""
        of = (self.corners, self.face_normals, self._vertex_normals, self.dihedrals)
        return noise(*of, self.topology)

    @property
    def noisy_share(self) -> float:
        """Share of the area that is noisy, 0 to 1."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        area = length(cross(b - a, c - a))[:, 0]
        return float(area[self.noise > 0.0].sum() / area.sum())

    @cached_property
    def dihedrals(self) -> Floats:
        """Angles between the facets at each edge of each face, shape (m, 3), degrees; 0 at borders.

        Where three or more faces meet: 180, the edge is no smooth one.
        """
        across = self.topology.neighbours
        cosine = dot(self.face_normals[:, None], self.face_normals[across])[..., 0]
        angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
        return np.where(across == -1, 0.0, np.where(across == -2, 180.0, angle))

    @cached_property
    def developable(self) -> "Developable":
        """Slivers that are to be unfolded; see `developable`."""
        from dmpcli.surfaces.developable import developable

        border = self.topology.border_vertices
        return developable(self.corners, self.F, self.dihedrals, border, CREASE)

    @cached_property
    def _known_maps(self) -> tuple[Floats, Booleans]:
        """Maps of `_normal_maps`, and which of them are made; memory is taken as they are."""
        return np.empty((len(self.F), 3, 4)), np.zeros(len(self.F), dtype=bool)

    def _normal_maps(self, face: Integers) -> Floats:
        """Of each face (N,) the affine map from a position to its smooth normal, shape (N, 3, 4).

        Barycentric interpolation written as one product; positions count from `_middle`. A stroke
        asks for few of all faces, again and again.
        """
        maps, known = self._known_maps
        if not known[face].all():
            new = np.unique(face[~known[face]])
            maps[new], known[new] = self._made_maps(new), True
        return maps[face]

    def _made_maps(self, face: Integers) -> Floats:
        corners = self.corners[face] - self._middle
        opposite = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)
        n = cross(opposite[:, 0], opposite[:, 1])
        # Gradients of the barycentric coordinates: exact on slivers too.
        gradients = cross(n[:, None], opposite) / dot(n, n)[:, None]
        N = self.corner_normals[face]
        slope = np.swapaxes(N, -1, -2) @ gradients
        offset = N[:, 0, :, None] - slope @ corners[:, 0, :, None]
        return np.concatenate([slope, offset], axis=-1)

    @cached_property
    def _middle(self) -> Floats:
        middle: Floats = self.V.mean(axis=0)
        return middle

    @cached_property
    def _near_border(self) -> Booleans:
        """Faces with a corner on the border, shape (m,)."""
        return np.asarray(self.topology.border_vertices[self.F].any(axis=1))

    @cached_property
    def slits(self) -> "Slits":
        """Edges where sheets touch, which no stroke crosses; see `slits`."""
        from dmpcli.surfaces.slits import Slits

        return Slits(self.V, self.topology)

    @property
    def components(self) -> Integers:
        """Component of each face, shape (m,)."""
        return self.topology.components

    @cached_property
    def outward(self) -> Floats:
        """By component: 1 if closed and wound with normals outwards, -1 if inwards, 0 if open."""
        count = int(self.components.max(initial=-1)) + 1
        a, b, c = np.moveaxis(self.corners - self._middle, 1, 0)
        volume = np.bincount(self.components, dot(a, cross(b, c))[:, 0], count)
        return np.where(self.topology.closed(self.V), np.sign(volume), 0.0)

    @cached_property
    def edge_length(self) -> float:
        """Mean length of the edges, mm."""
        return float(length(np.roll(self.corners, -1, axis=1) - self.corners).mean())

    @cached_property
    def _heights(self) -> Floats:
        from dmpcli.surfaces.chordal_error import heights

        return heights(self.V, self.F, self.topology)

    @property
    def chordal_error(self) -> float:
        """Estimated largest distance between the mesh and its smooth surface, mm; see `chordal`."""
        return float(self._heights.max())

    @cached_property
    def reach(self) -> Floats:
        """Largest distance of the smooth course of a stroke from the mesh at each face, (m,), mm.

        By the chordal error of the faces that touch it, and by the noise about it.
        """
        at = np.zeros(len(self.V))
        np.maximum.at(at, self.F.reshape(-1), np.repeat(self._heights, 3))
        touching = at[self.F].max(axis=1)
        reach: Floats = np.maximum(LEAST_REACH, np.maximum(5.0 * touching, 6.0 * self.noise))
        return reach

    def search(self, points: Floats) -> tuple[Floats, Integers]:
        """Closest points (N, 3), mm, and their faces (N,); quickest in the order of a path."""
        _, face, position = self._tree.squared_distance(
            self.V, self.F, np.ascontiguousarray(points)
        )
        return position, face

    def smooth_normals(self, position: Floats, face: Integers) -> Floats:
        """Unit normals (N, 3) at points of faces, interpolated between the corners'."""
        maps = self._normal_maps(face)
        local = position - self._middle
        return unit(np.einsum("nij,nj->ni", maps[..., :3], local) + maps[..., 3])

    def closest(self, points: Floats) -> ClosestPoints:
        """Closest points with smooth normals, see `Surface`."""
        points = np.asarray(points, dtype=float)
        position, face = self.search(points.reshape(-1, 3))
        normal = self.smooth_normals(position, face)
        position = position.reshape(points.shape)
        return ClosestPoints(
            position,
            normal.reshape(points.shape),
            length(points - position)[..., 0],
            face.reshape(points.shape[:-1]),
        )

    def closest_along(self, paths: Floats) -> tuple[Floats, Floats]:
        """Closest points of paths (B, T, 3), mm, and smooth normals there, both (B, T, 3)."""
        if not self.compiled:
            found = self.closest(paths)
            return found.position, found.normal
        from dmpcli.surfaces.kernels import inverse

        foot, normal = np.empty((2, *paths.shape))
        doubt = np.empty(paths.shape[:2], dtype=bool)
        inverse.closest_along(self.facets, np.ascontiguousarray(paths), foot, normal, doubt)
        if doubt.any():
            found = self.closest(paths[doubt])
            foot[doubt], normal[doubt] = found.position, found.normal
        return foot, normal

    def beyond_border(self, points: Floats, position: Floats, face: Integers) -> Booleans:
        """Tell which points (N, 3) lie beside the mesh rather than over it.

        Their closest point is on a border, and they are off it sideways by more than `ON_BORDER`.

        Parameters
        ----------
        points : array, shape (N, 3)
        position, face
            Their closest points, of `search`.
        """
        beyond = np.zeros(len(points), dtype=bool)
        some = np.flatnonzero(self._near_border[face])
        if len(some) == 0:
            return beyond
        face = face[some]
        gap = points[some] - position[some]
        normal = self.face_normals[face]
        sideways = length(gap - dot(gap, normal) * normal)[:, 0] > ON_BORDER
        some, face = some[sideways], face[sideways]
        beyond[some] = self._on_border(position[some], face)
        return beyond

    def _on_border(self, position: Floats, face: Integers) -> Booleans:
        """Tell which points of faces are on a border edge or a border's corner."""
        corners = self.corners[face]
        edges = np.roll(corners, -1, axis=1) - corners
        size = np.sum(edges**2, axis=-1)
        offset = position[:, None] - corners
        along = np.clip(np.sum(offset * edges, axis=-1) / size, 0.0, 1.0)
        off_edge = length(offset - along[..., None] * edges)[..., 0]
        off_corner = length(offset)[..., 0]
        on_edge = self.topology.border[face] & (off_edge < 1e-6)
        on_corner = self.topology.border_vertices[self.F[face]] & (off_corner < 1e-6)
        return np.asarray(np.any(on_edge | on_corner, axis=1))
