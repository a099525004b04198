"""The geometry of triangle meshes: closest points with smooth normals, borders, resolution."""

from functools import cached_property
from typing import TYPE_CHECKING, Self

import numpy as np

from dmpcli.arrays import Booleans, Floats, Halves, Integers
from dmpcli.spatial.vectors import cross, dot, length, unit
from dmpcli.surfaces.closest_facets import ClosestFacets
from dmpcli.surfaces.local_shape import LocalShape
from dmpcli.surfaces.mesh_shape import MeshShape
from dmpcli.surfaces.surface import ClosestPoints
from dmpcli.surfaces.topology import Adjacency, Topology, places

if TYPE_CHECKING:
    from dmpcli.surfaces.kernels.mesh import Compiled
    from dmpcli.surfaces.kernels.tree import Facets
    from dmpcli.surfaces.kernels.tree_order import TreeOrder
    from dmpcli.surfaces.slits import Slits

_FEW = 8
"""So few closest points are remembered, of so many questions."""

_FEW_PLANES = 0.1
"""Planes of so many of the facets are found one by one, mostly."""

_AFTER, _BEFORE = np.array([1, 2, 0]), np.array([2, 0, 1])
"""Corners of a face: the one after each, and the one before it; np.roll takes ten times as long."""

# A point beside the border by less than this is on it, mm.
ON_BORDER = 1e-2


class TriangleMesh:
    """A triangle mesh in the robot's base frame; see `Mesh` for geodesics and charts on it.

    Faces must be valid (in range, not degenerate) and wound alike; `records` sees to that. An
    object holds its search tree, so build it once and keep it.

    Parameters
    ----------
    V : array, shape (n, 3)
        mm.
    F : array of int, shape (m, 3)
    adjacency : Adjacency, optional
        Of the faces, where it is known already.
    """

    def __init__(self, V: Floats, F: Integers, adjacency: Adjacency | None = None) -> None:
        self.V = np.ascontiguousarray(V, dtype=float)
        self.F = np.ascontiguousarray(F, dtype=np.int64)
        self.topology = Topology(self.F, len(self.V))
        if adjacency is not None:
            self.topology.know(adjacency)

    def __reduce__(self) -> tuple[type["TriangleMesh"], tuple[Floats, Integers, Adjacency]]:
        # What else was built does not travel to another process; it is built there again.
        return type(self), (self.V, self.F, self.topology.adjacency)

    compiled = False
    """Whether strokes are carried by kernels, see `with_kernels`."""

    @property
    def with_kernels(self) -> Self:
        """The same mesh, on which compiled kernels walk: quicker, and the same but for rounding."""
        # It does not hold itself: it goes as soon as nobody else does.
        return self if self.compiled else self._compiled_twin

    @cached_property
    def _compiled_twin(self) -> Self:
        twin = type(self)(self.V, self.F)
        vars(twin).update(vars(self))
        for found in ("_recent", "shape", "_local", "_known_maps"):  # by other means
            vars(twin).pop(found, None)
        twin.compiled = True
        if "_local" in vars(self):
            vars(twin)["_local"] = self._local.beside(twin.shape)
        return twin

    @property
    def facets(self) -> "Facets":
        """The facets as kernels want them, with the shape of all."""
        if self.for_kernels.unknown:
            self._local.use_whole()
            self._tell_kernels(self.for_kernels)
        return self.for_kernels.facets

    @cached_property
    def for_kernels(self) -> "Compiled":
        """What kernels work on: facets, of which some may not know their shape yet."""
        from dmpcli.surfaces.kernels.mesh import Compiled, Geometry

        shape, topology = self.shape, self.topology
        if not self._local.expecting:
            self._local.use_whole()
        made = Compiled(
            Geometry(
                self.V,
                self.F,
                shape.corners,
                shape.face_normals,
                self.components,
                topology.neighbours,
                topology.border_vertices,
            ),
            self.tree_order,
        )
        self._tell_kernels(made)
        return made

    @cached_property
    def tree_order(self) -> "TreeOrder":
        """Order of the facets in the kernels' search tree, which a store may keep."""
        from dmpcli.surfaces.kernels.tree_order import TreeOrder

        if self._known_order is not None:
            return TreeOrder(*self._known_order)
        return TreeOrder.of(self.shape.corners)

    _known_order: "tuple[Halves, Halves] | None" = None

    @property
    def knows_order(self) -> bool:
        """Whether the order is known without looking for it."""
        return self._known_order is not None or "tree_order" in vars(self)

    def know_order(self, order: Halves, first: Halves) -> None:
        """Take what `tree_order` was before for what it would be."""
        self._known_order = order, first

    def _tell_kernels(self, kernels: "Compiled") -> None:
        """Tell kernels all that is known of the faces' shape."""
        shape, faces, at, inner = self._local.known()
        if len(faces):
            kernels.learn(faces, shape.corner_normals[at], shape.reach[at], inner)

    def made_known(self, doubt: Booleans) -> bool:
        """Tell whether kernels that left doubt asked for shapes, known now, and must run again."""
        if not self.for_kernels.unknown or not doubt.any():
            return False
        asked = self.for_kernels.asked()
        if len(asked) == 0:
            return False
        near = np.zeros(len(self.V), dtype=bool)
        near[self.F[asked]] = True
        a, b, c = near.take(self.F).T
        self._local.about(np.flatnonzero(a | b | c))
        self._tell_kernels(self.for_kernels)
        return True

    @cached_property
    def _facets(self) -> ClosestFacets:
        return ClosestFacets(self.V, self.F)

    @cached_property
    def shape(self) -> MeshShape:
        """Normals, creases and noise of all its faces; of few ask `noise_at` and its like."""
        if not self.compiled:
            return MeshShape(self.V, self.F, self.topology)
        from dmpcli.surfaces.compiled_shape import CompiledShape

        return CompiledShape(self.V, self.F, self.topology)

    @cached_property
    def _local(self) -> LocalShape:
        return LocalShape(self.shape)

    def expect(self, start: Floats, goal: Floats, beside: float) -> None:
        """Say where strokes are to come by: what they will ask for there is found at once.

        Parameters
        ----------
        start, goal : array, shape (B, 3)
            Of strokes, mm.
        beside : float
            How far they may lead away from the lines between these, mm.
        """
        self._local.expect(start, goal, beside)

    @property
    def corners(self) -> Floats:
        """Corners of the faces, shape (m, 3, 3), mm."""
        return self.shape.corners

    @property
    def face_normals(self) -> Floats:
        """Unit normals of the facets, shape (m, 3)."""
        return self.shape.face_normals

    def noise_at(self, face: Integers) -> Floats:
        """Estimated noise of the vertices about faces, see `MeshShape.noise`; shape of `face`."""
        shape, at = self._local.about(face)
        return shape.noise[at]

    def reach_at(self, face: Integers) -> Floats:
        """Largest distance of a smooth course from faces, see `MeshShape.reach`."""
        shape, at = self._local.about(face)
        return shape.reach[at]

    def developable_at(self, face: Integers) -> tuple[Booleans, Booleans]:
        """Which faces are slivers to unfold, and which must not be; see `Developable`."""
        shape, at = self._local.about(face)
        found = shape.developable
        return found.slivers[at], found.stretched[at]

    def planes_at(self, face: Integers) -> Floats:
        """Unit normals of facets and their distances from the origin, shape (..., 4)."""
        if self.compiled:
            # Many strokes ask for each, again and again; few, for few of them.
            if "_planes" in vars(self) or face.size > _FEW_PLANES * len(self.F):
                return self._planes.take(face, axis=0)
            normal = self.face_normals.take(face, axis=0)
            return np.concatenate([normal, dot(normal, self.corners[face, 0])], axis=-1)
        a, b, c = np.moveaxis(self.V[self.F[face]], -2, 0)
        normal = unit(cross(b - a, c - a))
        return np.concatenate([normal, dot(normal, a)], axis=-1)

    @cached_property
    def _planes(self) -> Floats:
        """Planes of all facets: many strokes ask for each, again and again."""
        normal = self.face_normals
        return np.concatenate([normal, dot(normal, self.corners[:, 0])], axis=-1)

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
        corners = self.V[self.F[face]] - self._middle
        opposite = corners[:, _BEFORE] - corners[:, _AFTER]
        n = cross(opposite[:, 0], opposite[:, 1])
        # Gradients of the barycentric coordinates: exact on slivers too.
        gradients = cross(n[:, None], opposite) / dot(n, n)[:, None]
        shape, at = self._local.about(face)
        N = shape.corner_normals[at]
        slope = np.swapaxes(N, -1, -2) @ gradients
        offset = N[:, 0, :, None] - slope @ corners[:, 0, :, None]
        return np.concatenate([slope, offset], axis=-1)

    @cached_property
    def _middle(self) -> Floats:
        middle: Floats = self.V.mean(axis=0)
        return middle

    @cached_property
    def _rim_places(self) -> Integers | None:
        _, ends = self.topology.rim
        return places(self.V, ends) if len(ends) else None

    @cached_property
    def slits(self) -> "Slits":
        """Edges where sheets touch, which no stroke crosses; see `slits`."""
        from dmpcli.surfaces.slits import Slits

        return Slits(self.V, self.topology, self._rim_places)

    @property
    def components(self) -> Integers:
        """Component of each face, shape (m,)."""
        return self.topology.components

    @cached_property
    def outward(self) -> Floats:
        """By component: 1 if closed and wound with normals outwards, -1 if inwards, 0 if open."""
        closed = self.topology.closed(self.V, self._rim_places)
        if not closed.any():
            return np.zeros(len(closed))
        a, b, c = np.moveaxis(self.corners - self._middle, 1, 0)
        volume = np.bincount(self.components, dot(a, cross(b, c))[:, 0], len(closed))
        return np.where(closed, np.sign(volume), 0.0)

    def search(self, points: Floats) -> tuple[Floats, Integers]:
        """Closest points (N, 3), mm, and their faces (N,); quickest in the order of a path."""
        if not self.compiled or not np.isfinite(points).all():
            return self._facets.search(points)
        from dmpcli.surfaces.kernels import tree

        points = np.ascontiguousarray(points)
        foot, face, doubt = tree.search(self.for_kernels.facets, points)
        while self.made_known(doubt):
            foot, face, doubt = tree.search(self.for_kernels.facets, points)
        if doubt.any():
            foot[doubt], face[doubt] = self._facets.search(points[doubt])
        return foot, face

    def search_without_kernels(self, points: Floats) -> tuple[Floats, Integers]:
        """As `search`; of facets that share a point the one that is named without kernels."""
        return self._facets.search(points)

    def smooth_normals(self, position: Floats, face: Integers) -> Floats:
        """Unit normals at points of faces, interpolated between the corners'.

        Parameters
        ----------
        position : array, shape (N, 3)
            mm; off a face's plane it counts by its foot there.
        face : array of int, shape (N,)

        Returns
        -------
        array, shape (N, 3)
            On the mesh's own side.
        """
        maps = self._normal_maps(face)
        local = position - self._middle
        return unit(np.einsum("nij,nj->ni", maps[..., :3], local) + maps[..., 3])

    def closest(self, points: Floats) -> ClosestPoints:
        """Closest points with smooth normals, see `Surface`."""
        points = np.asarray(points, dtype=float)
        flat = points.reshape(-1, 3)
        # Of a stroke's start and goal it is asked half a dozen times, by whoever looks at them.
        key = flat.tobytes() if len(flat) <= _FEW else None
        known = None if key is None else self._recent.get(key)
        if known is None:
            position, face = self.search(flat)
            known = position, face, self.smooth_normals(position, face)
            if key is not None:
                if len(self._recent) >= _FEW:
                    self._recent.clear()
                self._recent[key] = known
        position, face, normal = known[0].copy(), known[1].copy(), known[2].copy()
        position = position.reshape(points.shape)
        return ClosestPoints(
            position,
            normal.reshape(points.shape),
            length(points - position)[..., 0],
            face.reshape(points.shape[:-1]),
        )

    @cached_property
    def _recent(self) -> dict[bytes, tuple[Floats, Integers, Floats]]:
        """Closest points, faces and normals of the last few points, by their bytes."""
        return {}

    def closest_along(self, paths: Floats) -> tuple[Floats, Floats, Integers]:
        """Closest points of paths (B, T, 3), mm, and smooth normals there, both (B, T, 3).

        And where their facets lie in the kernels' order, (B, T); with kernels alone.
        """
        from dmpcli.surfaces.kernels import inverse

        foot, normal = np.empty((2, *paths.shape))
        row, doubt = np.empty(paths.shape[:2], dtype=np.int64), np.empty(paths.shape[:2], bool)
        inverse.closest_along(self.facets, np.ascontiguousarray(paths), foot, normal, row, doubt)
        if doubt.any():
            found = self.closest(paths[doubt])
            foot[doubt], normal[doubt] = found.position, found.normal
            row[doubt] = self.for_kernels.rows[found.face]
        return foot, normal, row

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
        some = np.flatnonzero(self.topology.border_vertices[self.F[face]].any(axis=1))
        if len(some) == 0:
            return beyond
        face = face[some]
        gap = points[some] - position[some]
        normal = self.planes_at(face)[:, :3]
        sideways = length(gap - dot(gap, normal) * normal)[:, 0] > ON_BORDER
        some, face = some[sideways], face[sideways]
        beyond[some] = self._on_border(position[some], face)
        return beyond

    def _on_border(self, position: Floats, face: Integers) -> Booleans:
        """Tell which points of faces are on a border edge or a border's corner."""
        corners = self.V[self.F[face]]
        edges = corners[:, _AFTER] - corners
        size = np.sum(edges**2, axis=-1)
        offset = position[:, None] - corners
        along = np.clip(np.sum(offset * edges, axis=-1) / size, 0.0, 1.0)
        off_edge = length(offset - along[..., None] * edges)[..., 0]
        off_corner = length(offset)[..., 0]
        on_edge = self.topology.border[face] & (off_edge < 1e-6)
        on_corner = self.topology.border_vertices[self.F[face]] & (off_corner < 1e-6)
        return np.asarray(np.any(on_edge | on_corner, axis=1))
