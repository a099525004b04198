"""What every stroke on a mesh must hold before it is given out, however it was found.

A strip that was walked over a step, or facets that were walked on either side of a corner, can
come out whole and be wrong. None of these checks knows how the stroke was drawn.
"""

from dataclasses import dataclass, fields

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.spatial.vectors import dot, length
from dmpcli.surfaces.mesh_shape import CREASE
from dmpcli.surfaces.surface import Status
from dmpcli.surfaces.triangle_mesh import TriangleMesh

# Start and goal are met within this, mm, and within the noise of the mesh there, which tilts its
# facets; a geodesic may be so much shorter than its chord.
MET = 1e-2
# Samples are no farther apart than so many times their distance in the chart, and this, mm.
_TIMES, _MORE = 3.0, 0.3
# A foot this far from its facet is not on it, mm.
_ON = 1e-3
# Chart coordinates this near to those of start and goal are theirs, mm.
_SAME = 1e-6
_TILTED = np.cos(np.radians(CREASE))


@dataclass(frozen=True)
class Feet:
    """Strokes on a mesh.

    Attributes
    ----------
    coordinates : array, shape (B, T, 3)
        In the charts, mm.
    position, normal : array, shape (B, T, 3)
        Of the points without w, mm, and unit vectors on either side.
    face : array of int, shape (B, T)
        Their facets.
    stretch : array, shape (B, T)
        Distance of neighbouring cross lines, by that at the centre line.
    outside : array of bool, shape (B, T)
        Points beyond the border. What comes after the first is not looked at.
    """

    coordinates: Floats
    position: Floats
    normal: Floats
    face: Integers
    stretch: Floats
    outside: Booleans

    def rows(self, rows: Integers, count: int) -> "Feet":
        """Return some of so many strokes, which are no copies where these are all."""
        if len(rows) == count:
            return self
        return Feet(*(getattr(self, field.name)[rows] for field in fields(self)))


def refusals(
    mesh: TriangleMesh, feet: Feet, start: Floats, goal: Floats, goals: Floats
) -> Integers:
    """Tell which strokes are wrong, and how.

    Parameters
    ----------
    mesh : TriangleMesh
    feet : Feet
        B strokes.
    start, goal : array, shape (B, 3)
        On the mesh, mm.
    goals : array, shape (B, 3)
        Chart coordinates of the goals, mm; starts are at 0.

    Returns
    -------
    array of int, shape (B,)
        `Status`: TORN, MISSED, LOST or TILTED, else DRAWN.
    """
    on = ~np.maximum.accumulate(feet.outside, axis=1)
    plane = mesh.planes_at(feet.face)
    wrong = [
        (_torn(feet, on), Status.TORN),
        (_missed(mesh, feet, on, start, goal, goals), Status.MISSED),
        (_beside(plane, feet, on), Status.LOST),
        (_tilted(mesh, plane, feet, on), Status.TILTED),
    ]
    which, what = [mark for mark, _ in wrong], [np.int64(status) for _, status in wrong]
    return np.select(which, what, np.int64(Status.DRAWN))


def surely_sound(
    mesh: TriangleMesh, feet: Feet, start: Floats, goal: Floats, goals: Floats
) -> Booleans:
    """Tell which strokes are surely not refused, shape (B,): by kernels, most of them.

    Parameters
    ----------
    mesh : TriangleMesh
        One that is `compiled`.
    feet : Feet
        B strokes.
    start, goal, goals : array, shape (B, 3)
        mm, as in `refusals`, which has the last word about the others.
    """
    from dmpcli.surfaces.kernels import checks

    limits = checks.CheckLimits(_TIMES, _MORE, _ON, float(_TILTED), _SAME, MET)
    whole = np.ascontiguousarray
    strokes = checks.CheckedStrokes(
        whole(feet.coordinates),
        whole(feet.position),
        whole(feet.normal),
        whole(feet.face),
        whole(feet.stretch),
        whole(feet.outside),
        whole(start),
        whole(goal),
        whole(goals),
    )
    known = mesh.for_kernels
    return checks.sound(known.facets.reals, known.rows, strokes, limits)


def unsound(mesh: TriangleMesh, feet: Feet) -> Booleans:
    """Tell which points (B, T) of strokes are wrong, whether or not they come after a border.

    Of a torn stroke these are both points beside the tear.
    """
    jumps = _jumps(feet)
    plane = mesh.planes_at(feet.face)
    wrong = _off(plane, feet) > _ON
    wrong[:, 1:] |= jumps
    wrong[:, :-1] |= jumps
    rows, samples = _leaning(mesh, plane, feet, ~feet.outside)
    wrong[rows, samples] = True
    return wrong


def shorter_than_chord(
    mesh: TriangleMesh, start: Floats, goal: Floats, lengths: Floats
) -> Booleans:
    """Tell which lines (B,) from start to goal are shorter than any can be, but for the noise.

    Parameters
    ----------
    mesh : TriangleMesh
    start, goal : array, shape (B, 3)
        On the mesh, mm; the estimated noise of the facets there is taken off their distance.
    lengths : array, shape (B,)
        Of the lines as found, mm.
    """
    chord = length(goal - start)[:, 0]
    noise = mesh.noise_at(mesh.search(np.stack([start, goal]).reshape(-1, 3))[1])
    height = 6.0 * noise.reshape(2, -1).max(axis=0)
    smooth = np.sqrt(np.maximum(chord**2 - height**2, 0.0))
    return np.asarray(lengths < smooth - MET)


def _torn(feet: Feet, on: Booleans) -> Booleans:
    return np.asarray(np.any(_jumps(feet) & on[:, 1:], axis=1))


def _jumps(feet: Feet) -> Booleans:
    """Tell which steps are longer than any can be, shape (B, T - 1)."""
    move = length(np.diff(feet.position, axis=1))[..., 0]
    change = np.diff(feet.coordinates[..., :2], axis=1)
    stretch = np.maximum(np.abs(feet.stretch[:, 1:]), np.abs(feet.stretch[:, :-1]))
    flat = np.hypot(change[..., 0] * stretch, change[..., 1])
    return np.asarray(move > _TIMES * flat + _MORE)


def _missed(
    mesh: TriangleMesh, feet: Feet, on: Booleans, start: Floats, goal: Floats, goals: Floats
) -> Booleans:
    missed = np.zeros(len(start), dtype=bool)
    for at, point, of in ((0, start, 0.0 * goals), (-1, goal, goals)):
        there = np.all(np.abs(feet.coordinates[:, at, :2] - of[:, :2]) < _SAME, axis=1)
        off = length(feet.position[:, at] - point)[:, 0]
        missed |= there & on[:, at] & (off > MET + mesh.noise_at(feet.face[:, at]))
    return missed


def _beside(plane: Floats, feet: Feet, on: Booleans) -> Booleans:
    return np.asarray(np.any((_off(plane, feet) > _ON) & on, axis=1))


def _off(plane: Floats, feet: Feet) -> Floats:
    """Distances of points from the planes of their facets, mm, shape (B, T)."""
    off = np.einsum("bti,bti->bt", feet.position, plane[..., :3]) - plane[..., 3]
    return np.asarray(np.abs(off))


def _tilted(mesh: TriangleMesh, plane: Floats, feet: Feet, on: Booleans) -> Booleans:
    tilted = np.zeros(len(feet.face), dtype=bool)
    tilted[_leaning(mesh, plane, feet, on)[0]] = True
    return tilted


def _leaning(
    mesh: TriangleMesh, plane: Floats, feet: Feet, on: Booleans
) -> tuple[Integers, Integers]:
    """Rows and samples of the points whose normals lean off their facets outside noise."""
    lean = np.abs(np.einsum("bti,bti->bt", feet.normal, plane[..., :3]))
    rows, samples = np.nonzero((lean < _TILTED) & on)
    smooth = mesh.noise_at(feet.face[rows, samples]) == 0.0
    rows, samples = rows[smooth], samples[smooth]
    if len(rows) == 0:
        return rows, samples
    position, normal = feet.position[rows, samples], feet.normal[rows, samples]
    face = feet.face[rows, samples]
    # A point of an edge is on either facet.
    either = mesh.topology.neighbours[face]
    flat, corner = mesh.face_normals[either], mesh.corners[either, 0]
    holds = np.abs(dot(normal[:, None], flat)[..., 0]) >= _TILTED
    holds &= np.abs(dot(position[:, None] - corner, flat)[..., 0]) < _SAME
    holds &= either >= 0
    leans = ~holds.any(axis=1)
    return rows[leans], samples[leans]
