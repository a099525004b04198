"""Edges where sheets touch: borders of each that a step along the smooth normal would not notice.

Mending makes edges of three faces and more borders, one on top of the other (see `mesh_repair`).
What lies beyond such a border can be the same component, as smooth as if nothing were between: the
foot of a wall that stands on a plate.
"""

import numpy as np
from scipy.spatial import cKDTree

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.spatial.vectors import dot, length
from dmpcli.surfaces.topology import Topology, places

# Edges are looked for by points on them that are no farther apart than this, mm.
_SPACING = 2.0


class Slits:
    """The edges of a mesh where sheets touch.

    Parameters
    ----------
    V : array, shape (n, 3)
        mm.
    topology : Topology
    place : array of int, shape (k, 2), optional
        Of the ends of its rim, see `places`, where they are known.
    """

    def __init__(self, V: Floats, topology: Topology, place: Integers | None = None) -> None:
        _, ends = topology.rim
        if len(ends):
            place = np.sort(places(V, ends) if place is None else place, axis=1)
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

    def near(self, points: Floats, reach: Floats) -> Booleans:
        """Tell which points may have an edge within their reach.

        Parameters
        ----------
        points : array, shape (N, 3)
            mm.
        reach : array, shape (N,)
            mm; some that are up to 2 mm farther off are told too, but none is left out.
        """
        if self._tree is None:
            return np.zeros(len(points), dtype=bool)
        away, _ = self._tree.query(points)
        return np.asarray(away <= reach + _SPACING)

    def off(self, points: Floats) -> Floats:
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
