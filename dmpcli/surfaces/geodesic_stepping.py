"""Geodesics on a mesh by steps of a few mm that follow its smooth normal, many at once.

One closest-point query per step. The point ahead is predicted from the curvature that the last
three normals show and snapped to the mesh; the frame is carried by the smallest rotation between
the normals plus the part that a great circle misses; the length is corrected by the trapezoidal
rule with end terms. On smooth surfaces the error is of third order in the step or better, and the
facets' kinks, which make exact polyhedral geodesics jitter, average out.

A walk that runs off the mesh goes on beyond it with the curvature it had, and says so.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.spatial.vectors import across, cross, dot, length, turned, unit
from dmpcli.surfaces.mesh_shape import CREASE
from dmpcli.surfaces.triangle_mesh import TriangleMesh

SHARP = np.cos(np.radians(CREASE))
# The other side of a wall, or another fold of the surface: its normal is turned by more than 120°.
BACK = -0.5
# A closest point further off than this part of the step is not the surface that was walked on.
JUMP = 0.3
# A walk that crossed a hole lands off its course by less than this part of the hole's width; the
# length is then wrong by about a thousandth of it.
LANDING = 0.05


@dataclass
class Front:
    """Where M walks stand.

    Attributes
    ----------
    position, direction, normal : array, shape (M, 3)
        mm; unit vectors, the normal on the side that the walk keeps to.
    before : array, shape (M, 3)
        Normal one step earlier.
    step : array, shape (M, 1)
        mm; all steps of a walk are alike.
    sign : array, shape (M, 1)
        Turns the mesh's normals to the walk's side.
    part : array of int, shape (M,)
        Component of the mesh.
    trend : array, shape (M, 3)
        dn/ds a step earlier, 1/mm: what a walk off the mesh goes on with, because normals at a
        border are one-sided.
    away : array, shape (M,)
        How far it has walked off the mesh, mm; 0 on it.
    """

    position: Floats
    direction: Floats
    normal: Floats
    before: Floats
    step: Floats
    sign: Floats
    part: Integers
    trend: Floats
    away: Floats

    def rows(self, rows: Booleans | Integers) -> "Front":
        """Return some of the walks."""
        return Front(*(getattr(self, field.name)[rows] for field in fields(self)))

    @classmethod
    def joined(cls, fronts: Sequence["Front"]) -> "Front":
        """Return walks that stand apart as one front: a step of many costs little more."""
        names = [field.name for field in fields(cls)]
        return cls(*(np.concatenate([getattr(one, name) for one in fronts]) for name in names))


@dataclass(frozen=True)
class Marks:
    """What happened in a step of M walks; masks of shape (M,).

    Attributes
    ----------
    off : array of bool
        Beyond the border, or on no surface that continues the last one.
    sharp : array of bool
        The normal turned by more than `CREASE`.
    back : array of bool
        The closest surface faces the other way.
    """

    off: Booleans
    sharp: Booleans
    back: Booleans


def start(
    mesh: TriangleMesh,
    position: Floats,
    normal: Floats,
    direction: Floats,
    step: Floats,
    sign: Floats,
    part: Integers,
) -> tuple[Front, Front]:
    """Stand M walks at points of the mesh, and M that go the other way; see `Front`.

    The curvature ahead is found from the normals a step ahead and a step behind.
    """
    reach = step * direction
    ahead, behind = (_probe(mesh, position + way, normal, sign, part) for way in (reach, -reach))
    # Where only one side is there the curvature is taken to be that side's.
    bend_ahead = np.where(ahead[1], ahead[0] - normal, normal - behind[0])
    bend_behind = np.where(behind[1], normal - behind[0], ahead[0] - normal)
    bend = 0.5 * (bend_ahead + bend_behind) * (ahead[1] | behind[1])
    # The probes stand on a tangent, short of a step along the arc by (step κ)²/3.
    bend = bend * (1.0 + dot(bend, bend) / 3.0)
    half = 0.5 * (bend_ahead - bend_behind) * (ahead[1] & behind[1])

    def front(way: float) -> Front:
        before = unit(normal - way * bend + half)
        on, trend = np.zeros(len(position)), way * bend / step
        return Front(position, way * direction, normal, before, step, sign, part, trend, on)

    return front(1.0), front(-1.0)


def _probe(
    mesh: TriangleMesh, points: Floats, normal: Floats, sign: Floats, part: Integers
) -> tuple[Floats, Booleans]:
    """Normals (M, 3) at the closest points, and whether (M, 1) the surface goes on there."""
    position, face = mesh.search(points)
    there = sign * mesh.smooth_normals(position, face)
    good = dot(there, normal)[:, 0] > SHARP
    good &= (mesh.components[face] == part) & ~mesh.beyond_border(points, position, face)
    return there, good[:, None]


def advance(mesh: TriangleMesh, front: Front) -> tuple[Front, Marks]:
    """Take one step of every walk."""
    x, t, n, h = front.position, front.direction, front.normal, front.step
    was_off = front.away > 0.0
    slope = np.where(was_off[:, None], front.trend, (n - front.before) / h)
    slope = slope - dot(slope, n) * n
    kappa = dot(slope, t)
    # The geodesic's Taylor series: x'' = -κ n, x''' ≈ -κ n'.
    guess = x + h * t - 0.5 * h**2 * kappa * n - (h**3 / 6.0) * kappa * slope
    foot, face = mesh.search(guess)
    after = front.sign * mesh.smooth_normals(foot, face)
    turn = dot(after, n)[:, 0]
    gap = length(foot - guess)[:, 0]
    back = turn < BACK
    other = (mesh.components[face] != front.part) | back
    sharp = ~other & (turn < SHARP)
    # A walk that comes back from beyond a hole must land where it was heading.
    allowed = np.where(was_off, LANDING * front.away, JUMP * h[:, 0])
    jump = gap > np.maximum(allowed, mesh.reach_at(face))
    off = other | mesh.beyond_border(guess, foot, face) | (~sharp & jump)
    mark = off[:, None]
    foot = np.where(mark, guess, foot)
    after = np.where(mark, unit(n + h * front.trend), after)
    moved = _corrected(front, foot, after)
    moved.trend = np.where(mark, turned(front.trend, n, after), slope)
    moved.away = np.where(off, front.away + h[:, 0], 0.0)
    return moved, Marks(off, sharp, back)


def _corrected(front: Front, foot: Floats, after: Floats) -> Front:
    """Carry the frames to the points found and correct those for the length walked."""
    x, t, n, h = front.position, front.direction, front.normal, front.step
    chord = after - n
    second = chord - (n - front.before)
    # Parallel transport follows the normal's own curve on the unit sphere; the smallest rotation
    # follows its chord. Between the two lies an area, by which the frame turns.
    twist = dot(n, cross(chord, second)) / 12.0
    there = turned(t, n, after)
    there = unit(there + twist * cross(after, there))
    bend_before = dot(0.5 * (chord + n - front.before), t)
    bend_after = dot(chord + 0.5 * second, there)
    # Trapezoidal rule with end terms, t' = -κ n.
    exact = x + 0.5 * h * (t + there) + (h / 12.0) * (bend_after * after - bend_before * n)
    shift = exact - foot
    shift = shift - dot(shift, after) * after
    size = length(shift)
    shift = shift * np.minimum(1.0, 0.25 * h / np.maximum(size, 1e-300))
    after = unit(after + (chord + 0.5 * second) * (dot(shift, there) / h))
    return replace(
        front, position=foot + shift, direction=across(there, after), normal=after, before=n
    )
