"""What is next to what in a triangle mesh: edges, borders, components."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.surfaces.mesh_edges import pieces

_LINE = np.array([0.2666, 0.6100, 0.7463])
"""A direction, of length 1, to which hardly any two vertices of a part lie square."""


@dataclass(frozen=True)
class Adjacency:
    """What of a mesh of m faces is next to what, as `Topology` says it.

    Attributes
    ----------
    neighbours : array of int, shape (m, 3)
    components : array of int, shape (m,)
    """

    neighbours: Integers
    components: Integers

    @classmethod
    def of(cls, neighbours: Integers, faces: Integers) -> "Adjacency":
        """Find the components of faces that share an edge wherever they share a vertex.

        Parameters
        ----------
        neighbours : array of int, shape (m, 3)
            See `Topology.neighbours`.
        faces : array of int, shape (m, 3)
            Their vertices.
        """
        own = np.arange(len(neighbours))[:, None]
        if pieces(np.where(neighbours < 0, own, neighbours)) == 1:
            return cls(neighbours, np.zeros(len(faces), dtype=np.int64))
        return cls(neighbours, _by_vertices(faces))


def _by_vertices(faces: Integers) -> Integers:
    import igl

    parts: Integers = igl.vertex_components(faces)[faces[:, 0]]
    return parts


@dataclass(frozen=True)
class Topology:
    """Neighbourhood of faces.

    Edge i of a face runs from its corner i to corner i + 1.

    Attributes
    ----------
    faces : array of int, shape (m, 3)
        Vertices, counter-clockwise.
    vertices : int
        How many there are.
    """

    faces: Integers
    vertices: int

    def know(self, adjacency: Adjacency) -> None:
        """Take what was found before for what would be found here."""
        # As cached properties keep what they found.
        vars(self).update(neighbours=adjacency.neighbours, components=adjacency.components)

    @property
    def adjacency(self) -> Adjacency:
        """What `know` takes."""
        return Adjacency(self.neighbours, self.components)

    @cached_property
    def _edges(self) -> tuple[Integers, Integers]:
        """Order that sorts the half-edges (3m,) by edge, and the edge's number of each in it."""
        a, b = self.faces, np.roll(self.faces, -1, axis=1)
        key = (np.minimum(a, b) * self.vertices + np.maximum(a, b)).reshape(-1)
        order = np.argsort(key, kind="stable")
        ordered = key[order]
        number = np.concatenate([[0], np.cumsum(ordered[1:] != ordered[:-1])])
        return order, number

    @cached_property
    def uses(self) -> Integers:
        """How many faces share each edge of each face, shape (m, 3)."""
        order, number = self._edges
        uses = np.empty(self.faces.size, dtype=np.int64)
        uses[order] = np.bincount(number)[number]
        return uses.reshape(-1, 3)

    @cached_property
    def neighbours(self) -> Integers:
        """Face across each edge, shape (m, 3): -1 at a border, -2 where three or more meet."""
        order, number = self._edges
        first = np.flatnonzero(np.bincount(number)[number] == 2)[::2]
        one, two = order[first], order[first + 1]
        across = np.where(self.uses.reshape(-1) == 1, -1, -2)
        across[one], across[two] = two // 3, one // 3
        return across.reshape(-1, 3)

    @cached_property
    def border(self) -> Booleans:
        """Edges with one face only, shape (m, 3)."""
        alone: Booleans = self.neighbours == -1
        return alone

    @cached_property
    def border_vertices(self) -> Booleans:
        """Vertices at the end of a border edge, shape (vertices,)."""
        marked = np.zeros(self.vertices, dtype=bool)
        marked[self.rim[1]] = True
        return marked

    @cached_property
    def components(self) -> Integers:
        """Number of the connected component of each face, shape (m,); vertices connect."""
        return _by_vertices(self.faces)

    @cached_property
    def rim(self) -> tuple[Integers, Integers]:
        """Faces (k,) of the border edges, and the vertices (k, 2) that these run from and to."""
        face, edge = np.nonzero(self.border)
        return face, np.stack([self.faces[face, edge], self.faces[face, (edge + 1) % 3]], axis=1)

    def closed(self, V: Floats, place: Integers | None = None) -> Booleans:
        """Tell which components, shape (components,), have no border but where they touch.

        A border that lies on another of the same component, run along the other way, is a cut
        along an edge of several sheets (see `mesh_repair`): nothing is open there.

        Parameters
        ----------
        V : array, shape (vertices, 3)
        place : array of int, shape (k, 2), optional
            Of the ends of the rim, see `places`, where they are known.
        """
        count = int(self.components.max(initial=-1)) + 1
        closed = np.ones(count, dtype=bool)
        if self.neighbours.min(initial=0) == -2:
            closed[self.components[(self.neighbours == -2).any(axis=1)]] = False
        face, ends = self.rim
        if len(face) == 0:
            return closed
        place = places(V, ends) if place is None else place
        part = self.components[face]
        # Each edge leads away from its start as often as another comes back to it.
        way = np.where(place[:, 0] < place[:, 1], 1, -1)
        # One number for each: several times as fast as rows of three.
        span = int(place.max()) + 1
        keys = (part * span + place.min(axis=1)) * span + place.max(axis=1)
        groups, of = np.unique(keys, return_inverse=True)
        left = np.bincount(of, way, len(groups))
        closed[groups[left != 0] // span**2] = False
        return closed


def places(V: Floats, ends: Integers) -> Integers:
    """Number the places of vertices: those at one point, up to rounding, have one number.

    Parameters
    ----------
    V : array, shape (n, 3)
    ends : array of int, shape (k, 2)
        Vertices, such as the ends of edges.

    Returns
    -------
    array of int, shape (k, 2)
        From 0; their order means nothing.
    """
    used, number = np.unique(ends, return_inverse=True)
    reach = 1e-9 * float(np.abs(V[used]).max())
    # What is near is near along any line, and hardly any two are: then there is nothing to search.
    along = np.sort(V[used] @ _LINE)
    if not (np.diff(along) <= 2.0 * reach).any():
        return np.asarray(number.reshape(-1, 2), dtype=np.int64)
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    near = cKDTree(V[used]).query_pairs(reach, output_type="ndarray")
    joined = coo_array((np.ones(len(near)), tuple(near.T)), shape=(len(used), len(used)))
    _, place = connected_components(joined, directed=False)
    return np.asarray(place[number].reshape(-1, 2), dtype=np.int64)
