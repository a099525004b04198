"""The kernels of one mesh: its facets, made ready for them, and what they are called with."""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.surfaces.kernels import tree
from dmpcli.surfaces.kernels.tree import Facets
from dmpcli.surfaces.kernels.tree_order import TreeOrder, boxes_of


@dataclass(frozen=True)
class Geometry:
    """What kernels need to know of a mesh of m faces; see `TriangleMesh`."""

    vertices: Floats
    faces: Integers
    corners: Floats
    face_normals: Floats
    components: Integers
    neighbours: Integers
    border_vertices: Booleans


class Compiled:
    """Facets, and where those of the mesh lie in their order.

    Their shape, which is dear, is learned where it is wanted: what kernels find does not hang on
    how much of it is known.

    Parameters
    ----------
    mesh : Geometry
    ordered : TreeOrder

    Attributes
    ----------
    facets : Facets
    rows : array of int, shape (m,)
    unknown : int
        Facets whose shape was not told.
    """

    def __init__(self, mesh: Geometry, ordered: TreeOrder) -> None:
        order, first = ordered
        m = self.unknown = len(order)
        self.rows = np.empty(m, dtype=np.int64)
        self.rows[order] = np.arange(m)
        reals, numbers = np.empty((m, tree.REALS)), np.zeros((m, tree.NUMBERS), dtype=np.int32)
        faces = tree.FaceArrays(
            mesh.corners,
            mesh.face_normals,
            mesh.neighbours,
            mesh.faces,
            mesh.components,
            mesh.border_vertices,
        )
        tree.fill(reals, numbers, faces, order, self.rows.astype(np.int32))
        self._lying = _on_one_another(mesh.vertices)
        self.facets = Facets(boxes_of(reals, first), first, reals, numbers)

    def asked(self) -> Integers:
        """Faces whose shape kernels have asked for and not found."""
        rows = np.flatnonzero(self.facets.reals[:, tree.REACH] == tree.ASKED)
        faces: Integers = self.facets.numbers[rows, tree.FACE].astype(np.int64)
        return faces

    def learn(self, faces: Integers, normals: Floats, reach: Floats, inner: Booleans) -> None:
        """Learn the shape of some faces.

        Parameters
        ----------
        faces : array of int, shape (k,)
        normals : array, shape (k, 3, 3)
            Smooth, at their corners.
        reach : array, shape (k,)
            mm, see `MeshShape.reach`.
        inner : array of bool, shape (k,)
            Those about whose vertices there are no others; only these are learned.
        """
        rows = self.rows[faces]
        at = self.facets.numbers[rows, tree.VERTICES : tree.VERTICES + 3]
        split = tree.split(at, normals, self._lying)
        new = np.flatnonzero(inner & (self.facets.reals[rows, tree.REACH] < 0.0))
        tree.shape(self.facets, rows[new], normals[new], reach[new], split[new])
        self.unknown -= len(new)


def _on_one_another(points: Floats) -> Booleans:
    """Points (n, 3) that lie on others."""
    lying = np.zeros(len(points), dtype=bool)
    # What lies at one point has one number; others may have it too, which does no harm.
    number = points @ np.array([0.6180339887, 1.4142135624, 1.7320508076])
    order = np.argsort(number)
    same = np.diff(number[order]) <= 1e-9 * max(1.0, float(np.abs(number).max(initial=0.0)))
    lying[order[1:][same]] = lying[order[:-1][same]] = True
    return lying
