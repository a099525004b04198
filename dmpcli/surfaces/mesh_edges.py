"""The edges of triangles, whatever meets at them, and the neighbours that they make."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.surfaces.integer_sort import sorted_with_order


@dataclass(frozen=True)
class Edges:
    """The edges of faces (m, 3).

    Attributes
    ----------
    half : array, shape (3m, 2)
        Directed edges; number h stands opposite corner h // m of face h % m.
    crowded : array
        Half edges of edges of three faces or more, those of one edge side by side.
    border : array
        Half edges of edges of a single face.
    one, other : array, shape (i,)
        The two half edges of edges between two faces.
    """

    half: Integers
    crowded: Integers
    border: Integers
    one: Integers
    other: Integers

    @classmethod
    def of(cls, F: Integers) -> "Edges":
        """Find the edges of faces (m, 3), by their ends in order."""
        half = np.empty((F.size, 2), dtype=np.int64)
        half[:, 0], half[:, 1] = F.T[[1, 2, 0]].reshape(-1), F.T[[2, 0, 1]].reshape(-1)
        low, high = np.minimum(half[:, 0], half[:, 1]), np.maximum(half[:, 0], half[:, 1])
        key, halves = sorted_with_order(low * (int(F.max(initial=0)) + 1) + high)
        starts = np.flatnonzero(np.append(True, key[1:] != key[:-1])) if len(key) else key
        count = np.diff(np.append(starts, len(key)))
        inner = starts[count == 2]
        crowded = halves[np.repeat(count > 2, count)]
        return cls(half, crowded, halves[starts[count == 1]], halves[inner], halves[inner + 1])

    @cached_property
    def at_odds(self) -> Booleans:
        """Which edges between two faces these run along in one direction, shape (i,)."""
        odd: Booleans = self.half[self.one, 0] == self.half[self.other, 0]
        return odd

    @cached_property
    def neighbours(self) -> Integers:
        """Face across each edge of each face, see `Topology.neighbours`."""
        m = len(self.half) // 3
        across = np.full(3 * m, -2)
        across[self.border] = -1
        across[self.one], across[self.other] = self.other % m, self.one % m
        # Edge i of a face runs from its corner i to the next: opposite to the one after.
        return np.ascontiguousarray(across.reshape(3, m)[[2, 0, 1]].T)

    @cached_property
    def fans(self) -> int:
        """How many fans of faces there are about vertices, joined by edges of two faces."""
        m, odd = len(self.half) // 3, self.at_odds
        # One edge begins at each corner, or none that two faces share; where all faces are wound
        # alike it ends at the corner of the next one.
        joined = np.stack([np.arange(3 * m)] * (2 if odd.any() else 1), axis=1)
        for here, there in ((self.one, self.other), (self.other, self.one)):
            first, last = (corners_at(there, k, m) for k in (1, 2))
            start, end = (corners_at(here, k, m) for k in (1, 2))
            if joined.shape[1] == 1:
                joined[start, 0] = last
                continue
            joined[start, 0] = np.where(odd, first, last)
            joined[end, 1] = np.where(odd, last, first)
        return pieces(joined)


def corners_at(half: Integers, k: int, faces: int) -> Integers:
    """Corner at the start (k = 1) or end (k = 2) of half edges, numbered as these are.

    Parameters
    ----------
    half : array of int
        Half edges as in `Edges.half`, in an array of any shape, which the result has too.
    k : {1, 2}
    faces : int
        How many there are.
    """
    at = half + k * faces
    return np.where(at < 3 * faces, at, at - 3 * faces)


def pieces(joined: Integers) -> int:
    """Return how many pieces n things make that are joined to k others each, or to themselves.

    Parameters
    ----------
    joined : array of int, shape (n, k)
    """
    return pieces_of(joined)[0]


def pieces_of(joined: Integers) -> tuple[int, Integers]:
    """Return how many pieces there are, see `pieces`, and the piece of each thing, shape (n,)."""
    n, k = joined.shape
    values: Floats = np.ones(joined.size)
    ends = np.arange(0, joined.size + 1, k, dtype=np.int32)
    graph = csr_array((values, joined.reshape(-1).astype(np.int32), ends), shape=(n, n))
    count, piece = connected_components(graph, directed=False)
    return int(count), np.asarray(piece, dtype=np.int64)
