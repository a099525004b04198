"""The shape of a mesh about the faces that are asked for, and of no more of it than that.

A stroke passes over few of the faces of a part. What their shape is hangs on those around them,
but on none that are far: normals on the faces about a vertex, and noise on means over some rings
of faces. So a patch is cut out, its own shape is found, and what stands far enough from the cut is
bit for bit that of the whole mesh.
"""

from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.spatial.vectors import dot
from dmpcli.surfaces.mesh_shape import MeshShape
from dmpcli.surfaces.topology import Adjacency, Topology

# Rings of faces about a face, those that share a vertex, that its shape hangs on: noise on means
# over three rings of means over three rings of what the angles to neighbours and the normals at
# vertices tell; normals on whether there is noise next to them; and, if there is, on averages
# over three rings more.
_OF_NOISE, _OF_NORMALS, _OF_AVERAGES = 7, 8, 11
# A patch has so many faces at least, and each is so many times as large as the one before; one of
# more than this share of the mesh is not cut out.
_LEAST, _TIMES, _SHARE = 1000, 2, 0.5
# Rings are as wide as the mean edge, or a little wider.
_WIDER = 1.1
# Of more lines the box around them all is taken.
_LINES = 8


@dataclass(frozen=True)
class _Patch:
    """Some faces, cut out.

    Attributes
    ----------
    shape : MeshShape
    number : array of int, shape (m,)
        Of each face of the mesh in the patch; -1 where its shape is not known.
    size : int
        How many faces were cut out.
    """

    shape: MeshShape
    number: Integers
    size: int


class LocalShape:
    """Finds the shape of the faces that are asked for.

    Parameters
    ----------
    whole : MeshShape
        What is asked where it is not worth while to cut.

    Attributes
    ----------
    expecting : bool
        Whether it was said where faces will be asked for.
    """

    def __init__(self, whole: MeshShape) -> None:
        self._whole = whole
        self._patch: _Patch | None = None
        self._all = False
        self._lines: list[tuple[Floats, Floats, float]] = []
        self._box: tuple[Floats, Floats] | None = None
        self.expecting = False

    def beside(self, whole: MeshShape) -> "LocalShape":
        """Return one of the same mesh, found by other means, that expects the same."""
        other = LocalShape(whole)
        other._lines, other._box = list(self._lines), self._box
        other._all, other.expecting = self._all, self.expecting
        return other

    def use_whole(self) -> None:
        """Cut no more: the shape of all faces is known, or soon will be."""
        self._all, self._patch = True, None

    def expect(self, start: Floats, goal: Floats, beside: float) -> None:
        """Say where faces will be asked for: what comes first is cut out for all of them.

        Parameters
        ----------
        start, goal : array, shape (B, 3)
            Of lines, mm.
        beside : float
            How far from them, mm.
        """
        self.expecting = True
        self._also(start, goal, beside)

    def _also(self, start: Floats, goal: Floats, beside: float) -> None:
        finite = np.isfinite(start).all(axis=1) & np.isfinite(goal).all(axis=1)
        start, goal = start[finite], goal[finite]
        if self._box is None and len(self._lines) + len(start) <= _LINES:
            self._lines += [(a, b, beside) for a, b in zip(start, goal, strict=True)]
            return
        ends = [start - beside, start + beside, goal - beside, goal + beside]
        ends += [end + way * width for *two, width in self._lines for end in two for way in (-1, 1)]
        ends += [] if self._box is None else self._box
        both = np.concatenate([end.reshape(-1, 3) for end in ends])
        self._box, self._lines = (both.min(axis=0), both.max(axis=0)), []

    def about(self, face: Integers) -> tuple[MeshShape, Integers]:
        """Return a shape in which these faces are known, and their numbers in it."""
        while not self._all:
            if self._patch is not None:
                number = self._patch.number[face]
                if number.min(initial=0) >= 0:
                    return self._patch.shape, number
            self._grow(face)
        return self._whole, face

    def known(self) -> tuple[MeshShape, Integers, Integers, Booleans]:
        """Return what is known by now.

        Returns
        -------
        MeshShape
        faces, at : array of int, shape (k,)
            Faces that are known, and their numbers in the shape.
        inner : array of bool, shape (k,)
            Those about whose vertices all faces are known.
        """
        every: Integers = np.arange(len(self._whole.F) if self._all else 0)
        if self._all or self._patch is None:
            return self._whole, every, every, np.ones(len(every), dtype=bool)
        F, number = self._whole.F, self._patch.number
        known = number >= 0
        faces = np.flatnonzero(known)
        rim = np.zeros(len(self._whole.V), dtype=bool)
        rim[F.compress(~known, axis=0)] = True
        a, b, c = rim.take(F.take(faces, axis=0)).T
        return self._patch.shape, faces, number.take(faces), np.asarray(~(a | b | c))

    def _grow(self, face: Integers) -> None:
        """Cut out a larger patch, about these faces too."""
        V, F = self._whole.V, self._whole.F
        at = V.take(F[:, 0], axis=0)
        asked = at[face.reshape(-1)] if face.size else at[:1]
        off = self._off(at)
        if self._patch is None and face.size and (off[face] <= 0.0).all():
            inside = F[off <= 0.0]
            edge = np.linalg.norm(V[inside[:, 1]] - V[inside[:, 0]], axis=1).mean()
            inside = off <= _WIDER * (_OF_NORMALS + 1) * edge
        else:
            self._also(asked, asked, 0.0)
            off = self._off(at)
            before = 0 if self._patch is None else self._patch.size
            wanted = min(max(_LEAST, _TIMES * before), len(F) - 1)
            inside = off <= np.partition(off, wanted)[wanted]
        if np.count_nonzero(inside) > _SHARE * len(F):
            self.use_whole()
            return
        self._patch = _cut(self._whole, inside)

    def _off(self, at: Floats) -> Floats:
        """How far points (m, 3) are beyond where faces are expected, mm; less than 0 within."""
        if self._box is not None:
            low, high = self._box
            return np.asarray(np.maximum(low - at, at - high).max(axis=1))
        nearest = np.full(len(at), np.inf)
        for start, goal, width in self._lines:
            size = float(np.linalg.norm(goal - start))
            along = (goal - start) / size if size > 0.0 else np.zeros(3)
            away = at - start
            u = dot(away, along)[:, 0]
            v = np.sqrt(np.maximum(dot(away, away)[:, 0] - u * u, 0.0))
            # No further beyond the ends than a quarter of the way to the sides.
            ends = np.abs(u - 0.5 * size) - 0.5 * size - (0.25 if size > 0.0 else 1.0) * width
            nearest = np.minimum(nearest, np.maximum(v - width, ends))
        return nearest


def _cut(whole: MeshShape, inside: Booleans) -> _Patch:
    """Cut out the faces that lie inside."""
    faces = np.flatnonzero(inside)
    own = whole.F.take(faces, axis=0)
    used = np.zeros(len(whole.V), dtype=bool)
    used[own] = True
    # Numbered in their order: sums have the order that they have in the mesh.
    renumbered = np.cumsum(used) - 1
    V, F = whole.V[used], renumbered.take(own)
    number = np.full(len(inside), -1)
    number[faces] = np.arange(len(faces))
    across = whole.topology.neighbours.take(faces, axis=0)
    # An edge at the cut has no other face here.
    across = np.where(across >= 0, number.take(across), across)
    topology = Topology(F, len(V))
    topology.know(Adjacency(across, whole.topology.components[faces]))
    shape = type(whole)(V, F, topology)
    rings = _rings(whole.F, F, used)
    known = rings >= _OF_NORMALS
    if (shape.noise[rings >= _OF_NOISE] > 0.0).any():
        known = rings >= _OF_AVERAGES
    number[faces[~known]] = -1
    return _Patch(shape, number, len(faces))


def _rings(all_faces: Integers, F: Integers, used: Booleans) -> Integers:
    """How many whole rings of faces each face F (k, 3) of a patch has about it in the patch."""
    here = np.bincount(F.reshape(-1), minlength=int(np.count_nonzero(used)))
    cut = np.bincount(all_faces.reshape(-1), minlength=len(used))[used] > here
    rings = np.zeros(len(F), dtype=np.int64)
    corners = [np.ascontiguousarray(corner) for corner in F.T]
    for _ in range(_OF_AVERAGES):
        at = [cut.take(corner) for corner in corners]
        beside = at[0] | at[1] | at[2]
        rings += ~beside
        for corner in corners:
            cut[corner[beside]] = True
    return rings
