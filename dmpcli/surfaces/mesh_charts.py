"""Charts of a mesh: which geodesic each pair gets, and which way its strokes are carried."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.spatial.vectors import across, cross, dot, length
from dmpcli.surfaces import (
    geodesic_shooting,
    last_check,
    slit_crossings,
    straightest_geodesics,
    strip_chart,
    thin_walls,
)
from dmpcli.surfaces.geodesic_shooting import Aim
from dmpcli.surfaces.sampled_chart import closed_direction, goal_coordinates, walk_samples
from dmpcli.surfaces.strip_grid import Centre
from dmpcli.surfaces.surface import ChartImage, Geodesics, Status, first_refusal, towards
from dmpcli.surfaces.triangle_mesh import TriangleMesh
from dmpcli.surfaces.walked_nodes import WalkedNodes

# Start and goal nearer to each other than this have no direction, mm.
COINCIDENT = 1e-6
# A stroke that is walked over a crease is followed this much at a time to see whether it folds, mm.
_LEAST_MOVE = 1e-3
# It folds where it comes back by more than this, mm.
_OVERLAP = 0.3
# Points beside the border by more than this, mm, and by more than this part of their distance to
# the mesh, are surely not over it.
_BESIDE, _LEANING = 1.0, 0.2
_FLAT = np.cos(np.radians(10.0))
# What a smooth course over facets can come to though the stroke can be drawn.
_MAY_BE_WRONG = (Status.OTHER_SIDE, Status.LOST, Status.TORN, Status.MISSED, Status.TILTED)


@dataclass(frozen=True)
class MeshCharts:
    """Charts of start-goal pairs on a mesh.

    Attributes
    ----------
    mesh : TriangleMesh
    centre : Centre
        B centre lines.
    target : array, shape (B, 3)
        Goals on the mesh, mm.
    lengths : array, shape (B,)
        mm; 0 for closed strokes.
    goals : array, shape (B, 3)
        Chart coordinates, mm.
    status : array of int, shape (B,)
    creased : array of bool, shape (B,)
        Pairs whose geodesic crosses a crease and was found by unfolding.
    """

    mesh: TriangleMesh
    centre: Centre
    target: Floats
    lengths: Floats
    goals: Floats
    status: Integers
    creased: Booleans

    def __len__(self) -> int:
        return len(self.lengths)

    def rows(self, rows: Integers) -> "MeshCharts":
        """Return the charts of some of the pairs."""
        return MeshCharts(
            self.mesh,
            self.centre.rows(rows),
            self.target[rows],
            self.lengths[rows],
            self.goals[rows],
            self.status[rows],
            self.creased[rows],
        )

    def over(self, points: Floats) -> Booleans:
        """Tell which points (B, T, 3) are not beside the mesh; doubtful ones are over it.

        The closest point of a border is nearest to points that lean outwards with the smooth
        normal too.
        """
        hits = self.mesh.closest(points)
        gap = points - hits.position
        sideways = length(gap - dot(gap, hits.normal) * hits.normal)[..., 0]
        far = np.flatnonzero(sideways > _BESIDE + _LEANING * hits.distance)
        beside = np.zeros(sideways.size, dtype=bool)
        beside[far] = self.mesh.beyond_border(
            points.reshape(-1, 3)[far],
            hits.position.reshape(-1, 3)[far],
            hits.face.reshape(-1)[far],
        )
        return ~beside.reshape(sideways.shape)

    def lift(
        self,
        coordinates: Floats,
        walked: Sequence[strip_chart.WalkedStrips] | None = None,
    ) -> ChartImage:
        """Carry chart coordinates (B, T, 3), mm, to the mesh; see `ChartImage`.

        Charts that are all smooth may bring their strips with nodes that were `walked` before.
        """
        shape = coordinates.shape
        axes = np.empty((*shape[:2], 3, 3))
        outside, status = np.ones(shape[:2], dtype=bool), self.status.copy()
        face, stretch = np.full(shape[:2], -1), np.ones(shape[:2])
        unfolded = self.creased & (status == Status.DRAWN)
        smooth = np.flatnonzero((status == Status.DRAWN) & ~self.creased)
        every = 0 < len(smooth) == len(axes)
        if not every:
            foot = np.repeat(self.centre.origin[:, None], shape[1], axis=1)
            axes[:] = np.eye(3)
        if len(smooth):
            u, v = coordinates[smooth, :, 0], coordinates[smooth, :, 1]
            part = strip_chart.lift(self.mesh, self.centre.rows(smooth), u, v, walked)
            if every:
                foot = part.foot
                self._lay(part, axes)
            else:
                foot[smooth] = part.foot
                some = np.empty((len(smooth), *axes.shape[1:]))
                self._lay(part, some)
                axes[smooth] = some
            outside[smooth], face[smooth], stretch[smooth] = part.outside, part.face, part.stretch
            status[smooth] = np.where(part.sharp, Status.DRAWN, part.status)
            unfolded[smooth[part.sharp]] = True
            self._stop_at_slits(smooth, foot, outside, status)
            better = smooth[part.slivers & ~part.sharp & (part.status == Status.DRAWN)]
            if len(better):
                face[self._improve(better, coordinates[better], foot, axes)] = -1
        feet = last_check.Feet(coordinates, foot, axes[..., 2], face, stretch, outside)
        self._check(np.flatnonzero(~unfolded), feet, status)
        self._walk_facets(np.flatnonzero(unfolded), feet, axes, status)
        self._try_facets(unfolded, feet, axes, status)
        position = foot + coordinates[..., 2:] * axes[..., 2]
        unsound = self._unsound(np.flatnonzero(status == Status.BORDER), feet)
        return ChartImage(position, axes, outside, status, unfolded, unsound)

    def _lay(self, part: strip_chart.Samples, axes: Floats) -> None:
        """Fill in the axes (B, T, 3, 3) of samples on smooth strips."""
        if self.mesh.compiled:
            from dmpcli.surfaces.kernels import samples

            samples.frames(part.across, part.normal, axes)
            return
        for i, column in enumerate((cross(part.across, part.normal), part.across, part.normal)):
            axes[..., i] = column

    def _unsound(self, left: Integers, feet: last_check.Feet) -> Booleans | None:
        """Points (B, T) that are wrong of strokes that left the surface; None where none did."""
        if len(left) == 0:
            return None
        some = self._some(left, feet)
        unsound = np.zeros(feet.outside.shape, dtype=bool)
        unsound[left] = last_check.unsound(self.mesh, some)
        return unsound

    def _check(self, rows: Integers, feet: last_check.Feet, status: Integers) -> None:
        """Put what is wrong with some of the strokes that were drawn into their status."""
        # A stroke that is torn at a corner goes backwards there too, which is no fold.
        looked = (Status.DRAWN, Status.BORDER, Status.FOLDED)
        rows = rows[np.isin(status[rows], looked)]
        if self.mesh.compiled and len(rows):
            ends = self.centre.origin[rows], self.target[rows], self.goals[rows]
            some = feet.rows(rows, len(self))
            rows = rows[~last_check.surely_sound(self.mesh, some, *ends)]
        status[rows] = first_refusal(self._checked(rows, feet), status[rows])

    def _walk_facets(
        self, rows: Integers, feet: last_check.Feet, axes: Floats, status: Integers
    ) -> None:
        """Walk the strokes of some pairs from facet to facet, and check them."""
        if len(rows) == 0:
            return
        foot, axes[rows], feet.outside[rows], status[rows] = self._unfold(
            rows, feet.coordinates[rows]
        )
        feet.position[rows], feet.normal[rows] = foot, axes[rows][..., 2]
        feet.face[rows], feet.stretch[rows] = -1, 1.0
        self._check(rows, feet, status)
        # Straight lines over noisy facets go astray by millimetres.
        status[rows[self._crosses_noise(foot)]] = Status.NOISY

    def _try_facets(
        self, unfolded: Booleans, feet: last_check.Feet, axes: Floats, status: Integers
    ) -> None:
        """Walk strokes from facet to facet where the smooth course is refused, and may be wrong.

        Steps of some mm pass thin ribs, grooves and the tips of cones. What is refused on the
        facets too is refused for what happened there, unless that tells less.
        """
        closed = (self.mesh.outward[self.centre.part] != 0.0) & (len(self.mesh.slits) == 0)
        wrong = np.isin(status, _MAY_BE_WRONG) | (closed & (status == Status.BORDER))
        rows = np.flatnonzero(wrong & ~unfolded & (self.status == Status.DRAWN))
        if len(rows) == 0:
            return
        before = status[rows].copy()
        second = last_check.Feet(*(getattr(feet, field.name).copy() for field in fields(feet)))
        turned = axes.copy()
        self._walk_facets(rows, second, turned, status)
        tells = np.isin(status[rows], (Status.NO_GEODESIC, Status.NOISY))
        status[rows] = np.where(tells, before, status[rows])
        better = rows[status[rows] == Status.DRAWN]
        unfolded[better] = True
        axes[better] = turned[better]
        for field in fields(feet):
            getattr(feet, field.name)[better] = getattr(second, field.name)[better]

    def _stop_at_slits(
        self, rows: Integers, foot: Floats, outside: Booleans, status: Integers
    ) -> None:
        """Mark the strokes of some pairs that step over an edge where sheets touch."""
        if len(self.mesh.slits) == 0:
            return
        crossed = slit_crossings.crossed(self.mesh, foot[rows])
        outside[rows] |= crossed
        hit = rows[crossed.any(axis=1)]
        status[hit] = first_refusal(status[hit], np.full(len(hit), Status.BORDER))

    def _checked(self, rows: Integers, feet: last_check.Feet) -> Integers:
        """What is wrong with some of the strokes, as `Status`."""
        some = self._some(rows, feet)
        origin = self.centre.origin[rows]
        return last_check.refusals(self.mesh, some, origin, self.target[rows], self.goals[rows])

    def _some(self, rows: Integers, feet: last_check.Feet) -> last_check.Feet:
        """Return some of the strokes, with their facets."""
        some = feet.rows(rows, len(self))
        unknown = np.flatnonzero(some.face[:, 0] < 0)
        if len(unknown):
            walked = some.position[unknown]
            found = self.mesh.search(walked.reshape(-1, 3))[1]
            some.face[unknown] = found.reshape(walked.shape[:2])
        return some

    def _crosses_noise(self, foot: Floats) -> Booleans:
        """Tell which strokes (R, T, 3) on the mesh come over noisy facets, shape (R,)."""
        face = self.mesh.search(foot.reshape(-1, 3))[1].reshape(foot.shape[:2])
        return np.asarray((self.mesh.noise_at(face) > 0.0).any(axis=1))

    def _improve(self, rows: Integers, coordinates: Floats, foot: Floats, axes: Floats) -> Integers:
        """Put the strokes of some pairs where unfolding leads, if it confirms the strip's: which.

        Where it does not, a cross line met a border or a hole that the strip was carried over.
        """
        exact, turned, _, status = self._unfold(rows, coordinates)
        face = self.mesh.search(exact.reshape(-1, 3))[1].reshape(exact.shape[:2])
        apart = length(exact - foot[rows])[..., 0]
        near = (apart <= self.mesh.reach_at(face)).all(axis=1)
        good = near & (status == Status.DRAWN)
        foot[rows[good]], axes[rows[good]] = exact[good], turned[good]
        better: Integers = rows[good]
        return better

    def _unfold(
        self, rows: Integers, coordinates: Floats
    ) -> tuple[Floats, Floats, Booleans, Integers]:
        """Feet (R, T, 3), axes, points outside and status of pairs that are walked by facets."""
        centre = self.centre.rows(rows)
        direction, scale = centre.direction, np.ones(len(rows))
        status = np.full(len(rows), Status.DRAWN, dtype=np.int64)
        # A centre line that was stepped along is not quite the facets' own: shoot once more.
        again = np.flatnonzero(~self.creased[rows] & (self.lengths[rows] > 0.0))
        if len(again):
            aim = _aim(centre.rows(again), self.target[rows[again]])
            aim.direction, aim.length = direction[again], self.lengths[rows[again], None]
            aim, _, good = geodesic_shooting.hit(self.mesh, aim, geodesic_shooting.by_facets)
            direction = direction.copy()
            direction[again] = aim.direction
            scale[again] = aim.length[:, 0] / self.lengths[rows[again]]
            status[again] = np.where(good, Status.DRAWN, Status.NO_GEODESIC)
        scaled = coordinates * np.array([1.0, 1.0, 0.0])
        scaled[..., 0] *= scale[:, None]

        def walk(origin: Floats, heading: Floats, way: Floats) -> Geodesics:
            return straightest_geodesics.walk(self.mesh, origin, heading, way)

        foot, axes, arrived = walk_samples(walk, centre.origin, direction, centre.sign, scaled)
        left = np.where(arrived.all(axis=1), Status.DRAWN, Status.BORDER)
        folds = np.where(_folded(foot, axes, scaled), Status.FOLDED, Status.DRAWN)
        return foot, axes, ~arrived, first_refusal(status, left, folds)


def _folded(foot: Floats, axes: Floats, coordinates: Floats) -> Booleans:
    """Tell which strokes (R, T, 3) come back along e_u while u goes on, shape (R,).

    By more than `_OVERLAP` in all: beyond each corner of a faceted rim a little of the surface is
    come over twice, and the lines go on after it.
    """
    move, change = np.diff(foot, axis=1), np.diff(coordinates, axis=1)
    along = 0.5 * (dot(move, axes[:, :-1, :, 0])[..., 0] + dot(move, axes[:, 1:, :, 0])[..., 0])
    du, dv = change[..., 0], change[..., 1]
    clear = (np.abs(du) > _LEAST_MOVE) & (np.abs(du) > 0.2 * np.abs(dv))
    # The chord over a crease is in neither facet.
    clear &= dot(axes[:, :-1, :, 2], axes[:, 1:, :, 2])[..., 0] > _FLAT
    gone = np.cumsum(np.where(clear, along * np.sign(du), 0.0), axis=1)
    back = np.maximum.accumulate(np.maximum(gone, 0.0), axis=1) - gone
    return np.asarray(np.any(back > _OVERLAP, axis=1))


def mesh_charts(
    mesh: TriangleMesh, start: Floats, goal: Floats, side: Floats | None, closed: Floats | None
) -> MeshCharts:
    """Charts of a mesh; see `Surface.charts`."""
    a, b = mesh.closest(start), mesh.closest(goal)
    part = mesh.components[a.face]
    apart = np.where(part != mesh.components[b.face], Status.OTHER_COMPONENT, Status.DRAWN)
    # A solid is drawn on from outside. An open sheet may be wound either way.
    outward = mesh.outward[part][:, None]
    sign = np.where(outward == 0.0, towards(a.normal, side), outward)
    if side is not None:
        inside = (outward != 0.0) & (dot(sign * a.normal, np.asarray(side, dtype=float)) < 0.0)
        apart = first_refusal(apart, np.where(inside[:, 0], Status.FACES_AWAY, Status.DRAWN))
    count = len(part)
    normal = sign * a.normal
    centre = Centre(a.position, normal, normal, np.ones((count, 1)), sign, part)
    if closed is not None:
        direction = closed_direction(closed, normal)
        step = np.full((count, 1), geodesic_shooting.STEP)
        centre = Centre(a.position, normal, direction, step, sign, part)
        zeros = np.zeros((count, 3))
        creased = np.zeros(count, dtype=bool)
        charts = MeshCharts(mesh, centre, b.position, zeros[:, 0], zeros, apart, creased)
        goals = goal_coordinates(charts.lift, b.position)
        return MeshCharts(mesh, centre, b.position, zeros[:, 0], goals, apart, creased)
    link = connect(mesh, centre, b.position, apart)
    status = link.status.copy()
    around = np.flatnonzero((status == Status.DRAWN) & link.creased)
    if len(around):
        ends = centre.origin[around], b.position[around], b.distance[around]
        thin = thin_walls.mistaken(mesh, *ends, link.length[around])
        status[around[thin]] = Status.OTHER_SIDE
    centre = Centre(a.position, normal, link.direction, link.step, sign, part, link.course)
    goals = np.stack([link.length, 0.0 * link.length, 0.0 * link.length], axis=-1)
    return MeshCharts(mesh, centre, b.position, link.length, goals, status, link.creased)


@dataclass(frozen=True)
class Link:
    """Geodesics found: e_u at the start, normal at the goal, step of the nodes, length, mm.

    And what was walked of them, if all were.
    """

    direction: Floats
    normal: Floats
    step: Floats
    length: Floats
    status: Integers
    creased: Booleans
    course: WalkedNodes | None = None


def connect(mesh: TriangleMesh, centre: Centre, goal: Floats, status: Integers) -> Link:
    """Find the geodesics from the charts' starts to points of the mesh.

    Stepped along the smooth normal; unfolded where that meets a crease or does not arrive.

    Parameters
    ----------
    mesh : TriangleMesh
    centre : Centre
        Its directions and steps do not count.
    goal : array, shape (B, 3)
        mm.
    status : array of int, shape (B,)
        Pairs of another one than DRAWN keep it; the others may come to COINCIDENT or NO_GEODESIC.
    """
    count = len(status)
    met = length(goal - centre.origin)[:, 0] < COINCIDENT
    status = first_refusal(status, np.where(met, Status.COINCIDENT, Status.DRAWN))
    direction, normal = centre.normal.copy(), centre.normal.copy()
    lengths, step = np.zeros(count), np.ones((count, 1))
    creased = np.zeros(count, dtype=bool)
    rows = np.flatnonzero(status == Status.DRAWN)
    if len(rows) == 0:
        return Link(direction, normal, step, lengths, status, creased)
    first = _aim(centre.rows(rows), goal[rows])
    aim, ends, good = geodesic_shooting.hit(mesh, first, geodesic_shooting.by_steps)
    # What stands over the goal by no more than the rounding of facets may belong beside it.
    good &= _landed(mesh, first, aim, ends)
    creases = np.flatnonzero(ends.sharp | ~good)
    if len(creases):
        smooth = ~ends.sharp[creases]
        again, there, hit = geodesic_shooting.hit(
            mesh, first.rows(creases), geodesic_shooting.by_facets
        )
        good[creases] = hit
        aim.direction[creases], aim.length[creases] = again.direction, again.length
        ends.fill(creases, there, np.ones(len(creases), dtype=bool))
        # The chord and a fan about it may have led astray on a surface that is smooth all the way.
        creases = np.delete(creases, _stepped(mesh, aim, ends, creases, hit & smooth))
    creased[rows[creases]] = True
    direction[rows], normal[rows] = aim.direction, ends.normal
    lengths[rows], step[rows] = aim.length[:, 0], aim.length / aim.steps[:, None]
    status[rows] = np.where(good, Status.DRAWN, Status.NO_GEODESIC)
    course = ends.course if len(rows) == count else None
    return Link(direction, normal, step, lengths, status, creased, course)


def _landed(mesh: TriangleMesh, first: Aim, aim: Aim, ends: geodesic_shooting.Ends) -> Booleans:
    """Tell which smooth courses end at their goals, on the goals' side, and are no short cuts.

    There are none over holes on solids, where what was stepped over is a rib or a groove.
    """
    landed, face = mesh.search(ends.position)
    there = length(landed - first.goal)[:, 0] <= geodesic_shooting.HIT + mesh.noise_at(face)
    normal = first.sign * mesh.closest(first.goal).normal
    there &= dot(normal, ends.normal)[:, 0] > 0.0
    short = last_check.shorter_than_chord(mesh, first.origin, first.goal, aim.length[:, 0])
    solid = (mesh.outward[first.part] != 0.0) & (mesh.noise_at(face) == 0.0)
    solid &= len(mesh.slits) == 0
    return np.asarray(there & ~short & ~(ends.off & solid))


def _stepped(
    mesh: TriangleMesh, aim: Aim, ends: geodesic_shooting.Ends, rows: Integers, which: Booleans
) -> Integers:
    """Step along what some of the rows found from facet to facet; which can be had that way."""
    some = np.flatnonzero(which)
    if len(some) == 0:
        return some
    trial = aim.rows(rows[some])
    trial.steps = np.maximum(4, np.ceil(trial.length[:, 0] / geodesic_shooting.STEP)).astype(
        np.int64
    )
    found, there, good = geodesic_shooting.corrected(mesh, trial)
    good &= ~there.sharp & _landed(mesh, trial, found, there)
    kept = rows[some[good]]
    aim.direction[kept], aim.length[kept] = found.direction[good], found.length[good]
    aim.steps[kept] = found.steps[good]
    ends.fill(kept, there, good)
    stepped: Integers = some[good]
    return stepped


def walk(mesh: TriangleMesh, origin: Floats, direction: Floats, way: Floats) -> Geodesics:
    """Walk geodesics; see `Surface.walk`. Stepped, and unfolded at creases and borders."""
    shape = np.shape(origin)
    hits = mesh.closest(np.asarray(origin, dtype=float).reshape(-1, 3))
    size = np.broadcast_to(way, shape[:-1]).reshape(-1)
    backward = np.where(size < 0.0, -1.0, 1.0)[:, None]
    heading = across(np.broadcast_to(direction, shape).reshape(-1, 3), hits.normal) * backward
    ones = np.ones((len(size), 1))
    aim = Aim(
        hits.position,
        hits.normal,
        hits.position,
        heading,
        np.abs(size)[:, None],
        np.maximum(1, np.ceil(np.abs(size) / geodesic_shooting.STEP)).astype(np.int64),
        ones,
        mesh.components[hits.face],
    )
    # A walk of no length still needs a step to look around with.
    aim.length = np.maximum(aim.length, 1e-9)
    ends = geodesic_shooting.by_steps(mesh, aim)
    there = mesh.closest(ends.position)
    position, normal = there.position, there.normal
    ahead, arrived = across(ends.direction, normal), ~ends.off
    rows = np.flatnonzero(ends.sharp | ends.off)
    if len(rows):
        end = straightest_geodesics.walk(
            mesh, hits.position[rows], heading[rows], np.abs(size)[rows]
        )
        position[rows], ahead[rows], normal[rows] = end.position, end.direction, end.normal
        arrived[rows] = end.arrived
    return Geodesics(
        position.reshape(shape),
        (ahead * backward).reshape(shape),
        normal.reshape(shape),
        arrived.reshape(shape[:-1]),
    )


def _aim(centre: Centre, goal: Floats) -> Aim:
    return geodesic_shooting.take_aim(centre.origin, centre.normal, goal, centre.sign, centre.part)
