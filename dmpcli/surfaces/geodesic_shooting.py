"""Geodesics from A to B: shoot, see by how much the goal is missed, correct heading and length."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.spatial.vectors import across, cross, dot, length, turned
from dmpcli.surfaces import (
    compiled_stepping,
    geodesic_search,
    geodesic_stepping,
    straightest_geodesics,
)
from dmpcli.surfaces.triangle_mesh import TriangleMesh
from dmpcli.surfaces.walked_nodes import WalkedNodes

# Steps of the centre line are no longer than this, mm, and there are at least four.
STEP = 6.5
# The goal counts as hit within this, and shooting goes on until it is hit within `ENOUGH`, mm.
HIT = 1e-2
ENOUGH = 1e-6
MOST_SHOTS = 14
# Headings tried at once where the chord's own does not lead to the goal.
FAN = np.radians(np.linspace(-75.0, 75.0, 21))
STRETCHES = (1.0, 1.15, 1.4)
# So many shots at once, where there are less of them to begin with.
_SHOTS = 2000


@dataclass
class Aim:
    """Where B shots start and what they are to hit; `direction` and `length` are what is found.

    Attributes
    ----------
    origin, normal : array, shape (B, 3)
        Point of the mesh, mm, and its normal on the tool's side.
    goal : array, shape (B, 3)
        Point of the mesh, mm.
    direction : array, shape (B, 3)
    length : array, shape (B, 1)
        mm.
    steps : array of int, shape (B,)
    sign : array, shape (B, 1)
        Of the mesh's normals.
    part : array of int, shape (B,)
        Component.
    """

    origin: Floats
    normal: Floats
    goal: Floats
    direction: Floats
    length: Floats
    steps: Integers
    sign: Floats
    part: Integers

    def rows(self, rows: Integers) -> "Aim":
        """Return a copy of some of the shots."""
        return Aim(
            self.origin[rows],
            self.normal[rows],
            self.goal[rows],
            self.direction[rows],
            self.length[rows],
            self.steps[rows],
            self.sign[rows],
            self.part[rows],
        )


@dataclass(frozen=True)
class Ends:
    """Where B shots came out: position, direction, normal (B, 3), and what they met (B,).

    `sharp` tells of a crease, `off` that a shot left the mesh, if only for a while. Of shots along
    the smooth normal `course` has the nodes, where they are kept.
    """

    position: Floats
    direction: Floats
    normal: Floats
    sharp: Booleans
    off: Booleans
    course: WalkedNodes | None = None

    @classmethod
    def unknown(cls, count: int, nodes: int = 0) -> "Ends":
        """Return ends to be filled in, with so many nodes of their courses."""
        a, b, c = np.zeros((3, count, 3))
        sharp, off = np.zeros((2, count), dtype=bool)
        return cls(a, b, c, sharp, off, WalkedNodes.unknown(count, nodes) if nodes else None)

    def fill(self, rows: Integers, other: "Ends", which: Booleans) -> None:
        """Put some rows of other ends into these.

        Parameters
        ----------
        rows : array of int, shape (k,)
            Of these.
        other : Ends
        which : array of bool, shape (rows of `other`,)
            True for k of them, in the order of `rows`.
        """
        for name in ("position", "direction", "normal", "sharp", "off"):
            getattr(self, name)[rows] = getattr(other, name)[which]
        if self.course is not None:
            self.course.fill(rows, other.course, which)


Shot = Callable[[TriangleMesh, Aim], Ends]


def take_aim(origin: Floats, normal: Floats, goal: Floats, sign: Floats, part: Integers) -> Aim:
    """Aim along the chords from origins to goals; see `Aim`."""
    chord = goal - origin
    size = length(chord)
    steps = np.maximum(4, np.ceil(size[:, 0] / STEP - 1e-9)).astype(np.int64)
    return Aim(origin, normal, goal, across(chord, normal), size, steps, sign, part)


def by_steps(mesh: TriangleMesh, aim: Aim) -> Ends:
    """Shoot along the smooth normal."""
    step = aim.length / aim.steps[:, None]
    begun = aim.origin, aim.normal, aim.direction, step, aim.sign, aim.part
    if mesh.compiled:
        front, _ = compiled_stepping.start(mesh, *begun)
        sharp, off, doubtful = compiled_stepping.walk(mesh, front, aim.steps)
        ends = Ends(front.position, front.direction, front.normal, sharp, off)
        if len(doubtful):
            again = _walked(mesh, front.rows(doubtful), aim.steps[doubtful])
            ends.fill(doubtful, again, np.ones(len(doubtful), dtype=bool))
        return ends
    front, behind = geodesic_stepping.start(mesh, *begun)
    return _walked(mesh, front, aim.steps, WalkedNodes.begun(front, behind, aim.steps))


def _walked(
    mesh: TriangleMesh,
    front: geodesic_stepping.Front,
    steps: Integers,
    course: WalkedNodes | None = None,
) -> Ends:
    ends = replace(Ends.unknown(len(steps)), course=course)
    sharp, off = ends.sharp.copy(), ends.off.copy()
    active = np.arange(len(steps))
    for number in range(1, int(steps.max(initial=0)) + 1):
        front, marks = geodesic_stepping.advance(mesh, front)
        sharp[active] |= marks.sharp
        off[active] |= marks.off
        if course is not None:
            course.add(active, number - 1, front, marks)
        done = steps[active] == number
        if done.any():
            rows = active[done]
            here = Ends(front.position, front.direction, front.normal, sharp[active], off[active])
            replace(ends, course=None).fill(rows, here, done)
            front, active = front.rows(~done), active[~done]
    return ends


def by_facets(mesh: TriangleMesh, aim: Aim) -> Ends:
    """Shoot from facet to facet."""
    end = straightest_geodesics.walk(mesh, aim.origin, aim.direction, aim.length[:, 0])
    normal = aim.sign * end.normal
    return Ends(
        end.position, end.direction, normal, np.zeros(len(aim.steps), dtype=bool), ~end.arrived
    )


def hit(mesh: TriangleMesh, aim: Aim, shot: Shot) -> tuple[Aim, Ends, Booleans]:
    """Correct shots until they hit.

    A secant step in the heading, whose lever is the width by which neighbouring geodesics spread
    (the Jacobi field), and the tangential miss in the length. Where that does not converge the
    best of a fan of headings is corrected instead; from facet to facet all headings are looked
    through (`geodesic_search`), so that what is not hit has no straight line to it.

    Parameters
    ----------
    mesh : TriangleMesh
    aim : Aim
        B shots; their directions and lengths are where the search begins.
    shot : callable
        `by_steps` or `by_facets`.

    Returns
    -------
    tuple of Aim, Ends, array of bool (B,)
        Directions and lengths found, the last ends, and which shots hit within `HIT`.
    """
    # The smooth course stands off its facets by their rounding, which does not count; a walk from
    # facet to facet does not.
    stands_off = np.zeros(len(aim.steps))
    if shot is by_steps:
        stands_off = mesh.reach_at(mesh.closest(aim.goal).face)
    found, ends, miss = _corrected(mesh, aim, shot, stands_off)
    missed = np.flatnonzero(miss > HIT)
    if len(missed):
        choose = _best_of_fan if shot is by_steps else _of_all_headings
        chosen = choose(mesh, aim.rows(missed), shot)
        again, there, less = _corrected(mesh, chosen, shot, stands_off[missed])
        better = less <= HIT
        rows = missed[better]
        found.direction[rows], found.length[rows] = again.direction[better], again.length[better]
        found.steps[rows] = again.steps[better]
        ends.fill(rows, there, better)
        miss[rows] = less[better]
    return found, ends, miss <= HIT


def _corrected(
    mesh: TriangleMesh, aim: Aim, shot: Shot, stands_off: Floats
) -> tuple[Aim, Ends, Floats]:
    """Correct shots; ends may be over or under the goal by less than `stands_off` (B,), mm."""
    count = len(aim.steps)
    best = aim.rows(np.arange(count))
    miss = np.full(count, np.inf)
    kept = shot is by_steps and not mesh.compiled
    ends = Ends.unknown(count, int(aim.steps.max(initial=0)) if kept else 0)
    active = np.arange(count)
    trial = best.rows(active)
    lever, turn, side = trial.length.copy(), np.zeros((count, 1)), np.zeros((count, 1))
    for _ in range(MOST_SHOTS):
        there = shot(mesh, trial)
        gap = trial.goal - there.position
        height = dot(gap, there.normal)
        gap = np.where(np.abs(height) < stands_off[active, None], gap - height * there.normal, gap)
        error = length(gap)[:, 0]
        better = error < miss[active]
        rows = active[better]
        miss[rows] = error[better]
        best.direction[rows], best.length[rows] = trial.direction[better], trial.length[better]
        ends.fill(rows, there, better)
        on = error > ENOUGH
        # Where facets' kinks keep the last digits from settling, a few shots are enough.
        on &= better | (miss[active] > HIT)
        if not on.any():
            break
        across_way = cross(there.normal, there.direction)
        side_now = dot(gap, across_way)
        secant = (side - side_now) / np.where(np.abs(turn) > 1e-12, turn, np.inf)
        sound = (secant > 0.2 * trial.length) & (secant < 5.0 * trial.length)
        lever = np.where(sound, secant, lever)
        turn = np.clip(side_now / lever, -0.5, 0.5)
        heading = np.cos(turn) * trial.direction + np.sin(turn) * cross(
            trial.normal, trial.direction
        )
        size = np.maximum(trial.length + dot(gap, there.direction), 0.2 * trial.length)
        active, trial = active[on], trial.rows(np.flatnonzero(on))
        trial.direction, trial.length = heading[on], size[on]
        lever, turn, side = lever[on], turn[on], side_now[on]
    return best, ends, miss


def corrected(mesh: TriangleMesh, aim: Aim) -> tuple[Aim, Ends, Booleans]:
    """Correct shots along the smooth normal from where they aim, and no others; see `hit`."""
    found, ends, miss = _corrected(mesh, aim, by_steps, mesh.reach_at(mesh.search(aim.goal)[1]))
    return found, ends, miss <= HIT


def _of_all_headings(mesh: TriangleMesh, aim: Aim, _shot: Shot) -> Aim:
    """Aim along the shortest straight lines over the facets, where there are any."""
    heading, size, found = geodesic_search.find(mesh, aim.origin, aim.goal)
    chosen = aim.rows(np.arange(len(size)))
    flat = aim.sign * mesh.face_normals[mesh.search(aim.origin)[1]]
    heading = across(turned(heading, flat, aim.normal), aim.normal)
    chosen.direction[found], chosen.length[found, 0] = heading[found], size[found]
    return chosen


def _best_of_fan(mesh: TriangleMesh, aim: Aim, shot: Shot) -> Aim:
    """Aim along the heading of a fan, and with the length, that comes nearest to the goal."""
    count = len(aim.steps)
    own = np.arange(count)
    nearest = np.full(count, np.inf)
    best = aim.rows(own)
    tries = np.array([(angle, stretch) for angle in FAN for stretch in STRETCHES])
    # A shot takes as many rounds for one as for many.
    at_once = max(1, _SHOTS // max(1, count))
    for some in np.split(tries, range(at_once, len(tries), at_once)):
        angle, stretch = np.repeat(some, count, axis=0).T[..., None]
        trial = aim.rows(np.tile(own, len(some)))
        aside = cross(trial.normal, trial.direction)
        trial.direction = np.cos(angle) * trial.direction + np.sin(angle) * aside
        trial.length = stretch * trial.length
        gap = length(shot(mesh, trial).position - trial.goal).reshape(len(some), count)
        gap[np.isnan(gap)] = np.inf
        closer = gap.min(axis=0, initial=np.inf) < nearest
        rows = (gap.argmin(axis=0) * count + own)[closer]
        nearest[closer] = gap.min(axis=0)[closer]
        best.direction[closer], best.length[closer] = trial.direction[rows], trial.length[rows]
    return best
