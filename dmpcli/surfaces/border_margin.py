"""Samples that are nearer to the border of a mesh, along it, than a process allows."""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.spatial.vectors import across, cross, length
from dmpcli.surfaces import straightest_geodesics
from dmpcli.surfaces.mesh import Mesh

if TYPE_CHECKING:
    from igl import AABB

# Headings that are walked where the border that is nearest through the air is not so near along
# the surface: all around, and beside the way to it, degrees.
_AROUND = np.arange(0.0, 360.0, 7.5)
_BESIDE = np.array([-8.0, -4.0, -2.0, -1.0, 1.0, 2.0, 4.0, 8.0])
# A walk that ends on the border is not stopped by it: of a margin that is just kept, mm.
_JUST = 1e-6


@dataclass(frozen=True)
class BorderMargin:
    """A strip along the border of a mesh.

    No way along the surface is shorter than that through the air, so that most samples need no
    second look. From the others geodesics of the margin's length are walked: towards the nearest
    point of the border, beside that, and all around; one that meets the border tells that it is
    too near. A hole that is narrower than an eighth of the margin, at its very end and behind a
    nearer one of another sheet, can be missed.

    Attributes
    ----------
    mesh : Mesh
        With a border.
    margin : float
        mm.
    """

    mesh: Mesh
    margin: float

    @cached_property
    def edges(self) -> Integers:
        """Vertices of the edges where the mesh ends, or sheets touch, shape (E, 2)."""
        face, edge = np.nonzero(self.mesh.topology.uses != 2)
        F = self.mesh.F
        return np.ascontiguousarray(
            np.stack([F[face, edge], F[face, (edge + 1) % 3]], axis=1), dtype=np.int64
        )

    @cached_property
    def _tree(self) -> "AABB":
        import igl

        tree = igl.AABB()
        tree.init(self.mesh.V, self.edges)
        return tree

    def __getstate__(self) -> dict[str, object]:
        # A search tree does not travel to other processes.
        return {"mesh": self.mesh, "margin": self.margin}

    def holds(self, points: Floats, looked: Booleans) -> Booleans:
        """Tell which points (B, T, 3) over the mesh are within the margin, of those looked at.

        Parameters
        ----------
        points : array, shape (B, T, 3)
            mm; what counts is their closest point of the mesh.
        looked : array of bool, shape (B, T)
        """
        near = np.zeros(looked.shape, dtype=bool)
        rows, samples = np.nonzero(looked)
        if len(rows) == 0 or len(self.edges) == 0:
            return near
        foot, face = self.mesh.search(points[rows, samples])
        squared, _, border = self._tree.squared_distance(self.mesh.V, self.edges, foot)
        close = np.flatnonzero(squared < (self.margin - _JUST) ** 2)
        foot, face, border = foot[close], face[close], border[close]
        normal = self.mesh.face_normals[face]
        ahead = across(border - foot, normal)
        # On the border itself there is no way to it.
        hit = (length(border - foot)[:, 0] < _JUST) | self._meets(foot, ahead)
        for angles in (_BESIDE, _AROUND):
            left = np.flatnonzero(~hit)
            if len(left) == 0:
                break
            hit[left] = self._meets_any(foot[left], ahead[left], normal[left], angles)
        near[rows[close[hit]], samples[close[hit]]] = True
        return near

    def _meets_any(self, foot: Floats, ahead: Floats, normal: Floats, degrees: Floats) -> Booleans:
        c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        side = cross(normal, ahead)
        headings = c[:, None] * ahead[:, None] + s[:, None] * side[:, None]
        origins = np.broadcast_to(foot[:, None], headings.shape)
        return np.asarray(self._meets(origins, headings).any(axis=1))

    def _meets(self, foot: Floats, heading: Floats) -> Booleans:
        """Tell which geodesics of the margin's length meet the border."""
        lengths = np.full(foot.shape[:-1], self.margin - _JUST)
        return ~straightest_geodesics.walk(self.mesh, foot, heading, lengths).arrived
