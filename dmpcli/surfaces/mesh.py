"""Triangle meshes as surfaces: closest points with smooth normals, borders, resolution."""

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.surfaces.protocol import Connections, Hits, Status, Walks
from dmpcli.surfaces.roughness import averaged, noise
from dmpcli.surfaces.topology import Topology
from dmpcli.surfaces.vectors import cross, dot, length, unit

if TYPE_CHECKING:
    from dmpcli.surfaces.charts import MeshCharts
    from dmpcli.surfaces.developable import Developable

# Where facets meet at more than this the edge is meant to be sharp: normals are not smoothed
# across it, and a strip whose normal turns as much within one step is unfolded instead, degrees.
CREASE = 25.0
# A point beside the border by less than this is on it, mm.
ON_BORDER = 1e-2
# However fine the mesh, points this near to it can be of the same surface, mm.
LEAST_REACH = 0.3


class Mesh:
    """A triangle mesh in the robot's base frame.

    Faces must be valid (in range, not degenerate) and wound alike; `records` sees to that. An
    object holds its search tree, so build it once and keep it.

    Parameters
    ----------
    V : array, shape (n, 3)
        mm.
    F : array of int, shape (m, 3)
    """

    def __init__(self, V: Floats, F: Integers) -> None:
        import igl

        self.V = np.ascontiguousarray(V, dtype=float)
        self.F = np.ascontiguousarray(F, dtype=np.int64)
        self.topology = Topology(self.F, len(self.V))
        self._tree = igl.AABB()
        self._tree.init(self.V, self.F)

    def __reduce__(self) -> tuple[type["Mesh"], tuple[Floats, Integers]]:
        # The search tree does not travel to another process; it is built there again.
        return Mesh, (self.V, self.F)

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
    def corner_normals(self) -> Floats:
        """Smooth normals at the corners of the faces, shape (m, 3, 3).

        Weighted by the corners' angles (G. Thürmer, C. Wüthrich: Computing vertex normals from
        polygonal facets. Journal of Graphics Tools 3 (1998) 43-46); at creases each side has its
        own. Of noisy scans they are averages over several edges.
        """
        import igl

        if self.noise > 0.0:
            return averaged(self._vertex_normals, self.F)[self.F]
        normals = self._vertex_normals[self.F]
        sharp = self.dihedrals > CREASE
        if sharp.any():
            at = np.zeros(len(self.V), dtype=bool)
            at[self.F[sharp]] = at[np.roll(self.F, -1, axis=1)[sharp]] = True
            split = igl.per_corner_normals(self.V, self.F, CREASE).reshape(-1, 3, 3)
            normals = np.where(at[self.F][..., None], split, normals)
        return unit(normals)

    @cached_property
    def _vertex_normals(self) -> Floats:
        import igl

        weighting = igl.PER_VERTEX_NORMALS_WEIGHTING_TYPE_ANGLE
        return np.asarray(igl.per_vertex_normals(self.V, self.F, weighting))

    @cached_property
    def noise(self) -> float:
        """Estimated standard deviation of a scan's vertices, mm; 0 of a smooth mesh."""
        of = (self.face_normals, self._vertex_normals, self.F, self.dihedrals, self.edge_length)
        return noise(*of)

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
    def _normal_maps(self) -> Floats:
        """Per face the affine map from a position to its smooth normal, shape (m, 3, 4).

        Barycentric interpolation written as one product; positions count from `_middle`.
        """
        corners = self.corners - self._middle
        opposite = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)
        n = cross(opposite[:, 0], opposite[:, 1])
        # Gradients of the barycentric coordinates: exact on slivers too.
        gradients = cross(n[:, None], opposite) / dot(n, n)[:, None]
        N = self.corner_normals
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

    @property
    def components(self) -> Integers:
        """Component of each face, shape (m,)."""
        return self.topology.components

    @cached_property
    def outward(self) -> Floats:
        """By component: 1 if closed and wound with normals outwards, -1 if inwards, 0 if open."""
        count = int(self.components.max(initial=-1)) + 1
        gaps = np.bincount(self.components, (self.topology.uses != 2).any(axis=1), count)
        a, b, c = np.moveaxis(self.corners - self._middle, 1, 0)
        volume = np.bincount(self.components, dot(a, cross(b, c))[:, 0], count)
        return np.where(gaps > 0, 0.0, np.sign(volume))

    @cached_property
    def edge_length(self) -> float:
        """Mean length of the edges, mm."""
        return float(length(np.roll(self.corners, -1, axis=1) - self.corners).mean())

    @cached_property
    def chordal_error(self) -> float:
        """Estimated largest distance between the mesh and its smooth surface, mm; see `chordal`."""
        from dmpcli.surfaces.chordal import chordal_error

        return chordal_error(self.V, self.F).largest

    @cached_property
    def reach(self) -> float:
        """Largest distance between the mesh and the smooth course of a stroke over it, mm."""
        return max(LEAST_REACH, 5.0 * self.chordal_error, 6.0 * self.noise)

    def search(self, points: Floats) -> tuple[Floats, Integers]:
        """Closest points (N, 3), mm, and their faces (N,); quickest in the order of a path."""
        _, face, position = self._tree.squared_distance(
            self.V, self.F, np.ascontiguousarray(points)
        )
        return position, face

    def smooth_normals(self, position: Floats, face: Integers) -> Floats:
        """Unit normals (N, 3) at points of faces, interpolated between the corners'."""
        maps = self._normal_maps[face]
        local = position - self._middle
        return unit(np.einsum("nij,nj->ni", maps[..., :3], local) + maps[..., 3])

    def closest(self, points: Floats) -> Hits:
        """Closest points with smooth normals, see `Surface`."""
        points = np.asarray(points, dtype=float)
        position, face = self.search(points.reshape(-1, 3))
        normal = self.smooth_normals(position, face)
        position = position.reshape(points.shape)
        return Hits(
            position,
            normal.reshape(points.shape),
            length(points - position)[..., 0],
            face.reshape(points.shape[:-1]),
        )

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

    def walk(self, origin: Floats, direction: Floats, length: Floats) -> Walks:
        """Walk geodesics, see `Surface`."""
        from dmpcli.surfaces import charts

        return charts.walk(self, origin, direction, length)

    def connect(self, start: Floats, goal: Floats) -> Connections:
        """Find geodesics, see `Surface`; not always the shortest of several."""
        from dmpcli.surfaces import charts
        from dmpcli.surfaces.nodes import Centre

        a, b = self.closest(start), self.closest(goal)
        part = self.components[a.face]
        apart = np.where(part == self.components[b.face], Status.DRAWN, Status.OTHER_COMPONENT)
        ones = np.ones((len(part), 1))
        centre = Centre(a.position, a.normal, a.normal, ones, ones, part)
        link = charts.connect(self, centre, b.position, apart)
        return Connections(link.direction, link.length, link.status)

    def charts(
        self, start: Floats, goal: Floats, side: Floats | None = None, closed: Floats | None = None
    ) -> "MeshCharts":
        """Lay charts, see `Surface`."""
        from dmpcli.surfaces import charts

        return charts.mesh_charts(self, start, goal, side, closed)
