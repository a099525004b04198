"""Closest points of a mesh: search trees of the parts of it that are asked for.

A tree over all facets takes as long as a stroke on them. So the box of a large mesh is divided into
cells, and each cell that points lie in gets a tree of its own, over the facets in it and in a rim
around it. What is found there is the closest of all facets if it is nearer than the end of the rim;
the tree over all facets, made when it is needed first, is asked otherwise. Which trees are asked
hangs on the point alone, so that it has one answer, whatever is asked beside it or was before.
"""

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers

if TYPE_CHECKING:
    from igl import AABB

# Meshes of fewer faces have one tree; others have cells of so many faces, and a rim of this part of
# a cell's width around each.
_WHOLE, _IN_A_CELL, _RIM = 16_000, 1_000, 0.12


class ClosestFacets:
    """Finds the closest facets of a mesh.

    Parameters
    ----------
    V : array, shape (n, 3)
        mm.
    F : array of int, shape (m, 3)
    """

    def __init__(self, V: Floats, F: Integers) -> None:
        self._V, self._F = V, F
        self._cells: _Cells | None = None
        if len(F) >= _WHOLE:
            self._cells = _Cells(V, F)
        self._trees: dict[int, _Tree | None] = {}

    @cached_property
    def _whole(self) -> "_Tree":
        return _Tree(self._V, self._F)

    def search(self, points: Floats) -> tuple[Floats, Integers]:
        """Closest points (N, 3), mm, and their faces (N,).

        Parameters
        ----------
        points : array, shape (N, 3)
            mm; quickest in the order of a path.
        """
        points = np.ascontiguousarray(points)
        if self._cells is None or len(points) == 0:
            return self._whole.closest(points)[1:]
        cell = self._cells.of(points)
        number = self._cells.number(cell)
        if (number == number[0]).all():
            return self._in_cell(int(number[0]), cell[0], points)
        position, face = np.empty_like(points), np.empty(len(points), dtype=np.int64)
        for one in set(number.tolist()):
            rows = np.flatnonzero(number == one)
            position[rows], face[rows] = self._in_cell(one, cell[rows[0]], points[rows])
        return position, face

    def _in_cell(self, number: int, cell: Integers, points: Floats) -> tuple[Floats, Integers]:
        """Closest points and faces of points of one cell."""
        if number not in self._trees:
            self._trees[number] = self._made(cell)
        tree = self._trees[number]
        if tree is None:
            return self._whole.closest(points)[1:]
        squared, position, face = tree.closest(points)
        sure = squared < tree.room(points)
        if not sure.all():
            _, position[~sure], face[~sure] = self._whole.closest(points[~sure])
        return position, face

    def _made(self, cell: Integers) -> "_Tree | None":
        """Tree of a cell; None where no facet is near."""
        assert self._cells is not None
        faces = np.flatnonzero(self._cells.near(cell))
        if len(faces) == 0:
            return None
        return _Tree(self._V, self._F, faces, self._cells.ends(cell))


class _Tree:
    """A tree over some facets, or all of them; within a box none of the others is near."""

    def __init__(
        self,
        V: Floats,
        F: Integers,
        faces: Integers | None = None,
        box: tuple[Floats, Floats] | None = None,
    ) -> None:
        import igl

        self._V, self._faces = V, faces
        self._F = F if faces is None else F.take(faces, axis=0)
        self._box: tuple[Floats, Floats] = box or (np.full(3, -np.inf), np.full(3, np.inf))
        self._tree: AABB = igl.AABB()
        self._tree.init(V, self._F)

    def closest(self, points: Floats) -> tuple[Floats, Floats, Integers]:
        """Squared distances (N,), closest points (N, 3) and faces (N,)."""
        squared, face, position = self._tree.squared_distance(self._V, self._F, points)
        if self._faces is not None:
            # Of points that are no numbers, or as far as one can be, igl tells no face.
            face = self._faces.take(face, mode="clip")
        return squared, position, face

    def room(self, points: Floats) -> Floats:
        """Squared distances of points (N, 3) in the box from its ends, mm²."""
        low, high = self._box
        room = np.minimum(points - low, high - points).min(axis=1)
        return np.where(room > 0.0, room * room, 0.0)


class _Cells:
    """A division of the box of a mesh into cubes."""

    def __init__(self, V: Floats, F: Integers) -> None:
        corners = [np.ascontiguousarray(corner) for corner in F.T]
        self._low = V.min(axis=0)
        size = V.max(axis=0) - self._low
        # As if it were a sheet over the two longest edges of its box.
        area = float(np.prod(np.sort(size)[1:]))
        self._width = max(np.sqrt(area * _IN_A_CELL / len(F)), float(size.max()) / 1000.0)
        self._last = np.maximum(1, np.ceil(size / self._width).astype(np.int64)) - 1
        count = self._last + 1
        self._strides = np.array([1, count[0], count[0] * count[1]])
        self._reach = []
        for axis, low in enumerate(self._low):
            x = (V[:, axis] - low) / self._width
            a, b, c = (x.take(corner) for corner in corners)
            least, most = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
            first = np.maximum(least - _RIM, 0.0).astype(np.int16)
            self._reach.append((first, (most + _RIM).astype(np.int16)))

    def of(self, points: Floats) -> Integers:
        """Cells (N, 3) of points; those outside of the box are in the nearest."""
        cell = np.floor((points - self._low) / self._width)
        # What is no number is in the first: its room is none.
        return np.asarray(np.fmin(np.fmax(cell, 0.0), self._last), dtype=np.int64)

    def number(self, cell: Integers) -> Integers:
        """Give each cell one number."""
        return np.asarray(cell @ self._strides)

    def near(self, cell: Integers) -> Booleans:
        """Tell which facets, shape (m,), reach into a cell or its rim."""
        near = np.ones(len(self._reach[0][0]), dtype=bool)
        for (first, last), at in zip(self._reach, cell.astype(np.int16), strict=True):
            near &= first <= at
            near &= last >= at
        return near

    def ends(self, cell: Integers) -> tuple[Floats, Floats]:
        """Where the rim of a cell ends, least and largest (3,), mm.

        Infinite where the box of the mesh ends: there is no more to come.
        """
        low = self._low + cell * self._width
        # Facets were put into cells by rounded numbers.
        rim = (_RIM - 1e-9) * self._width
        before = np.where(cell > 0, low - rim, -np.inf)
        return before, np.where(cell < self._last, low + self._width + rim, np.inf)
