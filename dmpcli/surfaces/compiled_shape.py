"""The shape of a mesh as kernels find it: the numbers of `MeshShape`, several times faster."""

import math
from functools import cached_property

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.surfaces import chordal_error, mesh_noise, mesh_shape
from dmpcli.surfaces.kernels import shape
from dmpcli.surfaces.mesh_shape import MeshShape


class CompiledShape(MeshShape):
    """What a mesh says of the surface behind it, as `MeshShape` says it."""

    @cached_property
    def face_normals(self) -> Floats:
        """See `MeshShape.face_normals`."""
        return shape.face_normals(self.corners)

    @cached_property
    def dihedrals(self) -> Floats:
        """See `MeshShape.dihedrals`."""
        return shape.dihedrals(self.face_normals, self.topology.neighbours)

    @cached_property
    def vertex_normals(self) -> Floats:
        """See `MeshShape.vertex_normals`."""
        return np.ascontiguousarray(super().vertex_normals)

    @cached_property
    def noise(self) -> Floats:
        """See `MeshShape.noise`."""
        # Smooth parts are told apart at once; what may be noise is looked at as ever.
        limits = math.radians(mesh_noise.LEAST), (1.0 - 1e-6) * mesh_noise.TILTED
        if shape.tilted(self.face_normals, self.vertex_normals, self.F, self.dihedrals, *limits):
            return np.asarray(super().noise)
        return np.zeros(len(self.F))

    def _leaning_back(self, normals: Floats) -> Floats:
        limits = mesh_shape.LEANING, mesh_shape.TIMES, float(mesh_shape.MOST_LEAN)
        return shape.leaning_back(normals, self.face_normals, self.dihedrals, self.noise, *limits)

    @cached_property
    def heights(self) -> Floats:
        """See `MeshShape.heights`."""
        means = np.ascontiguousarray(chordal_error.mean_normals(self.V, self.F))
        if shape.leans(means, self.F, self.face_normals, float(chordal_error.HALF_CREASE)):
            return np.asarray(super().heights)
        across, limit = self.topology.neighbours, math.radians(chordal_error.CREASE)
        return shape.heights(self.corners, means, self.F, across, self.dihedrals, limit)

    @cached_property
    def reach(self) -> Floats:
        """See `MeshShape.reach`."""
        return shape.reach(self.F, self.heights, self.noise, len(self.V), mesh_shape.LEAST_REACH)
