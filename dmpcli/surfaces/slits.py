"""Edges where sheets touch: borders of each that a step along the smooth normal would not notice.

Mending makes edges of three faces and more borders, one on top of the other (see `mending`). What
lies beyond such a border can be the same component, as smooth as if nothing were between: the foot
of a wall that stands on a plate.
"""

from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from dmpcli.arrays import Booleans, Floats
from dmpcli.surfaces import unfolding
from dmpcli.surfaces.topology import Topology, places
from dmpcli.surfaces.vectors import dot, length

if TYPE_CHECKING:
    from dmpcli.surfaces.mesh import Mesh

# Edges are looked for by points on them that are no farther apart than this, mm.
_SPACING = 2.0
# Points this near to such an edge, mm, are on it, on either side: the ways past them are looked at.
_ON = 1e-3


class Slits:
    """The edges of a mesh where sheets touch.

    Parameters
    ----------
    V : array, shape (n, 3)
        mm.
    topology : Topology
    """

    def __init__(self, V: Floats, topology: Topology) -> None:
        face, edge = np.nonzero(topology.border)
        ends = np.stack([topology.faces[face, edge], topology.faces[face, (edge + 1) % 3]], axis=1)
        if len(ends):
            place = np.sort(places(V, ends), axis=1)
            _, first, uses = np.unique(place, axis=0, return_index=True, return_counts=True)
            ends = ends[first[uses > 1]]
        self._a, self._b = V[ends[:, 0]], V[ends[:, 1]]
        parts = np.ceil(length(self._b - self._a)[:, 0] / _SPACING).astype(np.int64)
        self._edge = np.repeat(np.arange(len(parts)), parts)
        within = np.arange(len(self._edge)) - np.repeat(np.cumsum(parts) - parts, parts)
        share = ((within + 0.5) / np.repeat(parts, parts))[:, None]
        middle = self._a[self._edge] + share * (self._b - self._a)[self._edge]
        self._tree = cKDTree(middle) if len(middle) else None

    def __len__(self) -> int:
        return len(self._a)

    def crossed(self, mesh: "Mesh", foot: Floats) -> Booleans:
        """Tell which points of strokes the way from the point before crosses such an edge to.

        Parameters
        ----------
        mesh : Mesh
        foot : array, shape (R, T, 3)
            Points of the mesh, mm.

        Returns
        -------
        array of bool, shape (R, T)
        """
        crossed = np.zeros(foot.shape[:2], dtype=bool)
        if self._tree is None or foot.shape[1] < 2:
            return crossed
        on = (self._off(foot.reshape(-1, 3)) <= _ON).reshape(crossed.shape)
        # Each way begins at the last point that is surely on one side, and ends at one.
        place = np.arange(foot.shape[1])
        last = np.maximum.accumulate(np.where(on, 0, place), axis=1)[:, :-1]
        before = np.take_along_axis(foot, last[..., None], axis=1)
        sure = ~np.take_along_axis(on, last, axis=1) & ~on[:, 1:]
        p, way = before.reshape(-1, 3), (foot[:, 1:] - before).reshape(-1, 3)
        size = length(way)[:, 0]
        away, _ = self._tree.query(p + 0.5 * way)
        some = np.flatnonzero(sure.reshape(-1) & (away <= 0.5 * size + _SPACING) & (size > 0.0))
        if len(some) == 0:
            return crossed
        end = unfolding.walk(mesh, p[some], way[some], size[some])
        stopped = ~end.arrived
        stopped[stopped] = self._off(end.position[stopped]) <= _ON
        hit = np.zeros(len(p), dtype=bool)
        hit[some] = stopped
        crossed[:, 1:] = hit.reshape(len(foot), -1)
        return crossed

    def _off(self, points: Floats) -> Floats:
        """Distances of points (N, 3) from the nearest of the edges, mm; inf where they are far."""
        off = np.full(len(points), np.inf)
        if self._tree is None or len(points) == 0:
            return off
        away, near = self._tree.query(points, k=min(4, len(self._edge)))
        away = np.asarray(away).reshape(len(points), -1)
        near = np.asarray(near).reshape(len(points), -1)
        some = np.flatnonzero(away[:, 0] < _SPACING)
        edge = self._edge[near[some]]
        a, along = self._a[edge], self._b[edge] - self._a[edge]
        offset = points[some, None] - a
        share = np.clip(dot(offset, along) / dot(along, along), 0.0, 1.0)
        off[some] = length(offset - share * along)[..., 0].min(axis=1)
        return off
