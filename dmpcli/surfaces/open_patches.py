"""Where on a mesh there is room for a stroke: its large smooth patches, and a way across each."""

from collections.abc import Iterator
from dataclasses import dataclass

import igl
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.spatial.vectors import any_tangent, unit
from dmpcli.surfaces.mesh import Mesh

_SMOOTH = np.cos(np.radians(15.0))
"""Cosine of the angle between facets beyond which an edge is the part's and not its mesh's."""

_WAYS = (0.6, 0.45, 0.3, 0.2, 0.12)
"""Lengths that are tried, as shares of a patch's own; none comes near its rim."""

_WIDE = 0.2
"""How far to either side of a way there must be room, as a share of its length."""

_ASLANT = 0.3
"""Sine of the angle to a facet's normal under which points over smooth edges may be seen."""

_POINTS = 25

_STRETCHES = (1.0, 0.85, 0.7, 0.55)
"""Lengths that a stroke is tried at, by its own."""

_TURNS = np.radians(np.concatenate([[0.0, 90.0], np.arange(15.0, 360.0, 15.0)]))
_GRID = 9
_MORE = 0.04
"""By how much a stroke must have room, too, if it were larger, as a share of its size."""

_TRIED = 3

_AT_ONCE = 16
"""Ways that are looked at whole at once, the best first."""

_UPWARDS = 0.7
"""Cosine of the angle to base z up to which a facet is the upper side of a round patch."""


@dataclass(frozen=True)
class Patch:
    """A smooth patch and two points on it, from one to the other of which it goes on.

    Attributes
    ----------
    area : float
        mm².
    normal : array, shape (3,)
        Its mean, outwards.
    start, goal : array, shape (3,)
        mm.
    """

    area: float
    normal: Floats
    start: Floats
    goal: Floats


def open_patches(V: Floats, F: Integers, most: int = 4) -> list[Patch]:
    """Return the patches that have room for a stroke, those that face +z first, largest first.

    Parameters
    ----------
    V : array, shape (n, 3)
        mm.
    F : array, shape (m, 3)
        Edge manifold, wound so that normals point outwards.
    most : int
    """
    whole, found = _Patches(V, F), list[Patch]()
    # A patch with no room on it is passed over; of very many, the small ones are not looked at.
    for number in whole.order[: 4 * most]:
        way = _way(whole, number)
        if way is not None:
            found.append(whole.patch(number, *way))
        if len(found) == most:
            break
    return found


@dataclass(frozen=True)
class Footprint:
    """How much room a stroke takes, along and across its line from start to goal.

    Attributes
    ----------
    length : float
        From start to goal, mm; 0 of a closed stroke.
    path : array, shape (k, 2)
        Its u and v, mm.
    """

    length: float
    path: Floats


def places_for(V: Floats, F: Integers, stroke: Footprint, most: int = 8) -> Iterator[list[Patch]]:
    """Yield for each patch, in the order of `open_patches`, where a stroke might lie on it whole.

    The longest way that has room comes first, and of those the ones nearest to the middle and to
    the reading direction.

    Parameters
    ----------
    V, F : arrays
        As for `open_patches`.
    stroke : Footprint
    most : int
        Patches that are looked at.
    """
    whole = _Patches(V, F)
    for number in whole.order[:most]:
        yield [whole.patch(number, *way) for way in _ways_for(whole, number, stroke)]


class _Patches:
    """A mesh and its smooth patches, those that face +z first, largest first.

    Attributes
    ----------
    mesh : Mesh
    normal : array, shape (m, 3)
        Of the facets.
    label : array of int, shape (m,)
        Which patch each facet is of.
    order : array of int
        Their numbers.
    """

    def __init__(self, V: Floats, F: Integers) -> None:
        self._V, self._F, self._corners = V, F, V[F]
        edges = self._corners[:, 1:] - self._corners[:, :1]
        cross = np.cross(edges[:, 0], edges[:, 1])
        self._doubled = np.linalg.norm(cross, axis=1)
        self.normal = cross / np.maximum(self._doubled, 1e-300)[:, None]
        self.label = _labels(F, self.normal)
        self._area = np.bincount(self.label, 0.5 * self._doubled)
        self._mean = np.stack([np.bincount(self.label, column) for column in cross.T], axis=1)
        upwards = self._mean[:, 2] > 0.5 * np.linalg.norm(self._mean, axis=1)
        self.order = np.lexsort([-self._area, ~upwards])
        self.mesh = Mesh(V, F)

    def patch(self, number: int, start: Floats, goal: Floats) -> Patch:
        """Return a patch with a way on it."""
        mean = self._mean[number]
        towards = unit(mean) if mean.any() else np.zeros(3)
        return Patch(float(self._area[number]), towards, start, goal)

    def vertices(self, number: int) -> Floats:
        """Vertices of a patch, shape (k, 3)."""
        return np.asarray(self._V[np.unique(self._F[self.label == number])])

    def middle(self, number: int) -> tuple[Floats, Floats]:
        """Return a point near the middle of a patch, and the normal there."""
        faces = np.flatnonzero(self.label == number)
        corners, weight = self._corners[faces], self._doubled[faces]
        middle = np.average(corners.mean(axis=1), axis=0, weights=weight)
        found = self.mesh.closest(middle[None])
        if self.label[found.face[0]] != number:
            # The middle of what is bent or has a hole is beside it: begin on its largest facet.
            found = self.mesh.closest(corners[np.argmax(weight)].mean(axis=0)[None])
        return found.position[0], found.normal[0]

    def middles(self, number: int) -> Iterator[tuple[Floats, Floats]]:
        """Points to look around, with the normals there: of a round patch its upper side first."""
        middle, n = self.middle(number)
        upper = (self.label == number) & (self.normal[:, 2] > _UPWARDS)
        if n[2] < _UPWARDS and upper.any():
            corners, weight = self._corners[upper], self._doubled[upper]
            top = np.average(corners.mean(axis=1), axis=0, weights=weight)
            found = self.mesh.closest(top[None])
            yield found.position[0], found.normal[0]
        yield middle, n

    def holds(self, number: int, points: Floats, size: float) -> tuple[Booleans, Floats, Floats]:
        """Tell which points (..., 3) lie over a patch; with their feet and the normals there."""
        seen = self.mesh.closest(points)
        # What lies beside the patch is nearest to its rim, and seen from there aslant.
        off, facet = points - seen.position, self.normal[seen.face]
        aslant = np.linalg.norm(off - (off * facet).sum(axis=-1)[..., None] * facet, axis=-1)
        over = aslant <= _ASLANT * seen.distance + 1e-6 * size
        return (self.label[seen.face] == number) & over, seen.position, seen.normal


def _labels(F: Integers, normal: Floats) -> Integers:
    """Return the number of the patch of each face."""
    beside = igl.triangle_triangle_adjacency(F)[0]
    face, side = np.nonzero(beside >= 0)
    other = beside[face, side]
    smooth = np.einsum("ij,ij->i", normal[face], normal[other]) > _SMOOTH
    pairs = face[smooth], other[smooth]
    graph = coo_array((np.ones(len(pairs[0])), pairs), shape=(len(F), len(F)))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def _way(whole: _Patches, number: int) -> tuple[Floats, Floats] | None:
    """Return two points between and beside which the patch goes on; None where there is no room."""
    centre, n = whole.middle(number)
    across = whole.vertices(number) - centre
    across = across - np.outer(across @ n, n)
    _, axes = np.linalg.eigh(across.T @ across)
    for axis in (axes[:, 2], axes[:, 1]):
        along = axis - (axis @ n) * n
        along = unit(along) if np.linalg.norm(along) > 1e-6 else any_tangent(n)
        # From left to right as people read: in +x, else in +y, else in +z.
        along = along * np.sign(along[np.argmax(np.abs(along) > 1e-6)])
        long = float(np.ptp(across @ along))
        for share in _WAYS:
            length = share * long
            line = centre + np.outer(np.linspace(-0.5, 0.5, _POINTS) * length, along)
            aside = _WIDE * length * np.cross(n, along)
            held, feet, _ = whole.holds(number, np.stack([line, line + aside, line - aside]), long)
            if held.all():
                return feet[0, 0], feet[0, -1]
    return None


def _ways_for(whole: _Patches, number: int, stroke: Footprint) -> list[tuple[Floats, Floats]]:
    """Return starts and goals of ways on a patch that leave room for a whole stroke."""
    for middle, n in whole.middles(number):
        found = _ways_about(whole, number, stroke, middle, n)
        if found:
            return found
    return []


def _ways_about(
    whole: _Patches, number: int, stroke: Footprint, middle: Floats, n: Floats
) -> list[tuple[Floats, Floats]]:
    """Return such ways near a point of the patch with the normal n."""
    e_1 = np.array([1.0, 0.0, 0.0]) - n[0] * n
    e_1 = unit(e_1) if np.linalg.norm(e_1) > 0.1 else unit(np.array([0.0, 1.0, 0.0]) - n[1] * n)
    e_2 = np.cross(n, e_1)
    flat = (whole.vertices(number) - middle) @ np.stack([e_1, e_2], axis=1)
    low, high = flat.min(axis=0), flat.max(axis=0)
    size = float(np.linalg.norm(high - low))
    steps = np.linspace(0.0, 1.0, _GRID + 2)[1:-1]
    a, b = (g.ravel() for g in np.meshgrid(*(low + np.outer(steps, high - low)).T))
    at = np.concatenate([middle[None], middle + np.outer(a, e_1) + np.outer(b, e_2)])
    held, feet, normals = whole.holds(number, at, size)
    feet, normals = feet[held], normals[held]
    if len(feet) == 0:
        return []
    turns = _TURNS if stroke.length else _TURNS[:1]
    first = e_1 - (normals @ e_1)[:, None] * normals
    first /= np.maximum(np.linalg.norm(first, axis=1), 1e-9)[:, None]
    second = np.cross(normals, first)
    along = (
        np.cos(turns)[:, None] * first[:, None] + np.sin(turns)[:, None] * second[:, None]
    )  # (k, turns, 3)
    across = np.cross(normals[:, None], along)

    def free(rows: Integers, ways: Integers, shape: Floats) -> Booleans:
        u, v = shape[:, :1], shape[:, 1:]
        points = u * along[rows, ways, None] + v * across[rows, ways, None]
        held = whole.holds(number, points + feet[rows, None], size)[0]
        return np.asarray(held.all(axis=-1))

    for stretch in _STRETCHES if stroke.length else _STRETCHES[:1]:
        path = stroke.path * [stretch, 1.0]
        centre = 0.5 * (path.min(axis=0) + path.max(axis=0))
        shape = np.concatenate([path - centre, (1.0 + _MORE) * (path - centre)])
        rows, ways = (index.ravel() for index in np.indices(along.shape[:2]))
        away = np.linalg.norm(feet[rows] - middle, axis=1) / size
        best = np.argsort(away + 0.2 * (1.0 - np.cos(turns[ways])), kind="stable")
        rows, ways = rows[best], ways[best]

        # Where its corners have no room, the rest need not be looked at.
        open_ = free(rows, ways, shape[_corners(shape)])
        rows, ways = rows[open_], ways[open_]
        good = np.zeros(len(rows), dtype=bool)
        for first_of in range(0, len(rows), _AT_ONCE):
            some = slice(first_of, first_of + _AT_ONCE)
            good[some] = free(rows[some], ways[some], shape)
            if good.sum() >= _TRIED:
                break
        rows, ways = rows[good][:_TRIED], ways[good][:_TRIED]
        if len(rows) == 0:
            continue
        start = feet[rows] - centre[0] * along[rows, ways] - centre[1] * across[rows, ways]
        goal = start + stretch * stroke.length * along[rows, ways]
        on = whole.mesh.closest(np.stack([start, goal])).position
        return [(on[0, i], on[1, i]) for i in range(len(rows))]
    return []


def _corners(shape: Floats) -> Integers:
    """Rows of points (k, 2) that reach farthest in eight directions."""
    angles = np.arange(8) * np.pi / 4.0
    far = shape @ np.stack([np.cos(angles), np.sin(angles)])
    return np.unique(far.argmax(axis=0))
