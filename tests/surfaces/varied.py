"""Meshes, charts and poses of many kinds, and limits met from both sides: cases of `test_kept`.

Each is quick, so that many may stand side by side; what is right in closed form is tested beside
the modules themselves.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import trimesh

from dmpcli.errors import InputError
from dmpcli.spatial import rotations
from dmpcli.spatial.pose import Pose
from dmpcli.surfaces import (
    chordal_error,
    extent,
    frame_smoothing,
    geodesic_search,
    geodesic_shooting,
    geodesic_stepping,
    inverse_chart,
    last_check,
    mesh_charts,
    mesh_noise,
    mesh_regions,
    mesh_repair,
    open_patches,
    placement,
    polygons,
    pose_bound,
    pose_search,
    registration,
    sharp_edges,
    strip_grid,
    strip_inverse,
    strip_pieces,
    tangential,
)
from dmpcli.surfaces.border_margin import BorderMargin
from dmpcli.surfaces.conditioning import conditioning_of
from dmpcli.surfaces.cylinder import Cylinder
from dmpcli.surfaces.keep_out import enclosed
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.mesh_noise import noise
from dmpcli.surfaces.plane import Plane
from dmpcli.surfaces.slit_crossings import crossed
from dmpcli.surfaces.sphere import Sphere
from dmpcli.surfaces.strip_grid import Grid
from dmpcli.surfaces.thin_walls import mistaken
from dmpcli.surfaces.topology import Topology
from tests.surfaces import fields
from tests.surfaces.test_mesh import folded
from tests.surfaces.test_open_patches import ball as rings

CASES: list[Callable] = []
DRUM = Cylinder(np.array([0.0, 0.0, -60.0]), np.array([0.0, 1.0, 0.0]), 60.0)
BALL = Sphere(np.array([0.0, 0.0, -150.0]), 150.0)


def case(make):
    CASES.append(make)
    return make


def made(part):
    return np.array(part.vertices, dtype=float), np.array(part.faces)


def plate(nx, ny, x=(-30.0, 30.0), y=(-20.0, 20.0)):
    return fields.grid(lambda u, v: np.stack([u, v, 0 * u], axis=-1), nx, ny, x, y)


def holed(V, F, middle, radius):
    return V, F[np.linalg.norm(V[F].mean(axis=1) - middle, axis=1) > radius]


def joined(*parts):
    """Meshes side by side as one."""
    counts = np.cumsum([0, *(len(V) for V, _ in parts)])
    faces = [F + at for (_, F), at in zip(parts, counts, strict=False)]
    return np.concatenate([V for V, _ in parts]), np.concatenate(faces)


def with_wall():
    """A plate on which a wall stands: sheets touch along its foot."""
    V, F = plate(7, 5)
    foot = np.flatnonzero(np.abs(V[:, 1]) < 1e-9)
    top = len(V) + np.arange(len(foot))
    a, b, c, d = foot[:-1], foot[1:], top[1:], top[:-1]
    wall = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    found = mesh_repair.mended(np.r_[V, V[foot] + [0, 0, 15.0]], np.r_[F, wall])
    return found.V, found.F


@cache
def meshes():
    saddle = fields.square(fields.saddle(), 300, 60.0)
    rough = fields.square(fields.saddle(), 700, 30.0)
    shift = 0.15 * np.random.default_rng(1).normal(size=rough[0].shape)
    tube = fields.grid(
        lambda a, y: np.stack([25 * np.sin(a), y, 25 * np.cos(a) - 25], -1),
        19,
        8,
        (-2, 2),
        (-40, 40),
    )
    arc = np.concatenate([[-2.0], np.linspace(-0.8, 0.8, 17), [2.0]])
    fillet = fields.grid(
        lambda i, y: np.stack(
            [25 * np.sin(t := arc[np.rint(i).astype(int)]), y, 25 * np.cos(t) - 25], axis=-1
        ),
        len(arc),
        2,
        (0, len(arc) - 1),
        (-40, 40),
    )
    box = trimesh.creation.box((60.0, 40.0, 20.0)).subdivide().subdivide()
    wall = trimesh.creation.box((60.0, 40.0, 0.8)).subdivide().subdivide()
    found = {
        "saddle": saddle,
        "bumpy": fields.square(fields.bumpy(), 700, 60.0),
        "holed": holed(*saddle, [12.0, 9.0, 0.0], 8.0),
        "rough": (rough[0] + shift, rough[1]),
        "tube": tube,
        "fillet": fillet,
        "ball": made(trimesh.creation.icosphere(2, 40.0)),
        "box": made(box),
        "wall": made(wall),
        "slit": with_wall(),
        "two": joined(plate(6, 4), (plate(5, 5)[0] + [70.0, 3.0, 1.0], plate(5, 5)[1])),
    }
    return {name: Mesh(*one) for name, one in found.items()} | {
        "fold": folded(20.0, 50.0, 6),
        "edge": folded(75.0, 50.0, 6),
    }


OPEN = ("saddle", "bumpy", "holed", "tube", "fold", "edge", "slit")


def scattered(mesh, count, seed, off=0.0):
    """Points on a mesh, or beside it."""
    rng = np.random.default_rng(seed)
    face = rng.integers(len(mesh.F), size=count)
    on = np.einsum("ki,kij->kj", rng.dirichlet([1.0, 1.0, 1.0], count), mesh.corners[face])
    return on + off * rng.normal(size=on.shape)


def spread(mesh, count=5, seed=1, half=16.0):
    """Starts and goals about places of a mesh, as far apart as each has it."""
    rng = np.random.default_rng(seed)
    middle = mesh.V.mean(axis=0) + [0.0, 0.0, 30.0] + 3.0 * rng.normal(size=(count, 3))
    a = 1.3 * np.arange(count) + 0.2
    aside = (
        half * rng.uniform(0.6, 1.2, (count, 1)) * np.column_stack([np.cos(a), np.sin(a), 0 * a])
    )
    return mesh.closest(middle - aside).position, mesh.closest(middle + aside).position


def wavy(lengths, samples, wide, seed=2, beyond=0.0):
    """Waves of differing widths and heights, some of which swing beyond their ends."""
    rng = np.random.default_rng(seed)
    s = np.linspace(0.0, 1.0, samples)
    count = len(lengths)
    u = lengths[:, None] * s + beyond * rng.uniform(-1, 1, (count, 1)) * np.sin(2 * np.pi * s)
    v = wide * rng.uniform(0.2, 1.0, (count, 1)) * np.sin(2 * np.pi * rng.integers(1, 3) * s + 0.3)
    w = rng.choice([0.0, 0.4, 2.0], (count, 1)) * np.cos(5.0 * s)
    return np.stack([u, v, w], axis=-1)


def drawn(mesh, count=4, samples=17, wide=6.0, beyond=0.0, seed=1):
    charts = mesh.charts(*spread(mesh, count, seed))
    coordinates = wavy(charts.lengths, samples, wide, seed, beyond)
    return charts, coordinates, charts.lift(coordinates)


def right(lift):
    """A lift's parts, those of strokes that are drawn."""
    good = lift.status == 0
    return [
        lift.status,
        lift.outside,
        lift.unfolded,
        lift.unsound,
        lift.position[good],
        lift.axes[good],
    ]


# Strips.


def parts_of(mesh):
    """What of a mesh is costly to find."""
    topology, shape = mesh.topology, mesh.shape
    found = {"neighbours": topology.neighbours, "components": topology.components}
    names = ("corner_normals", "noise", "heights")
    return found | {name: getattr(shape, name) for name in names}


@case
def slopes_and_cells_of_grids():
    rng = np.random.default_rng(3)
    found: list = []
    for nu, nv in ((5, 2), (6, 3), (9, 4)):
        values = rng.normal(size=(3, nu, nv, 2))
        cells = rng.random((3, nu - 1, nv - 1)) < 0.3
        found += [strip_grid._slopes(values), strip_grid.corners(cells)]
        for right_ in range(nv):
            grid = Grid(2, nu - 3, right_, nv - 1 - right_)
            needs = strip_grid._needs(cells.copy(), grid)
            found += [needs[0].reshape(3, nu), needs[1].reshape(3, nu)]
        away = rng.choice([0.0, 0.0, 1.5, 3.0], (3, nu))
        found += [strip_grid._last_on(away, start) for start in (0, 2, nu - 1)]
        found += [strip_grid._cells(rng.random((3, nu, nv)))]
    return found


@case
def nodes_walked_on_and_off_meshes():
    rng = np.random.default_rng(4)
    found: list = []
    for name in ("saddle", "holed", "tube", "fold"):
        charts = meshes()[name].charts(*spread(meshes()[name], 3, half=24.0))
        for grid in (Grid(1, 5, 0, 1), Grid(0, 4, 2, 1), Grid(3, 3, 6, 5)):
            step = np.array([[4.0], [5.5], [6.5]])
            cells = rng.random((3, grid.behind + grid.ahead, grid.right + grid.left)) < 0.5
            found.append(strip_grid.walk_nodes(charts.mesh, charts.centre, grid, step, cells))
    return found


@case
def trends_borrowed_from_others():
    mesh = meshes()["saddle"]
    at = mesh.closest(scattered(mesh, 6, 5))
    rng = np.random.default_rng(6)
    direction = np.cross(at.normal, rng.normal(size=(6, 3)))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    ones = np.ones((6, 1))
    fronts = geodesic_stepping.start(
        mesh, at.position, at.normal, direction, 3.0 * ones, ones, mesh.components[at.face]
    )
    found: list = []
    for front in fronts:
        strip_grid._borrow_trends(front, np.array([0, 0, 2, 2, 4, 1]))
        found += [front.trend, front.away, front.before]
        moved, marks = geodesic_stepping.advance(mesh, front)
        found += [moved.position, moved.direction, moved.normal, moved.away, marks]
    return found


@case
def feet_and_guesses_beside_centre_lines():
    found: list = []
    for name in ("saddle", "bumpy", "fold", "holed"):
        charts, _, lift = drawn(meshes()[name], 3, 13, 8.0, 9.0)
        position = lift.position + [0.0, 0.0, 0.2]
        foot, facet, height = strip_inverse._feet(charts, position)
        whole = np.flatnonzero(np.isfinite(foot).all(axis=(1, 2)))
        guessed = strip_inverse._guessed(charts.rows(whole), foot[whole])
        found += [foot, facet, height, whole, guessed]
    return found


@case
def strips_moved_over_feet():
    found: list = []
    for name in ("saddle", "bumpy", "tube", "fold"):
        charts, coordinates, lift = drawn(meshes()[name], 4, 11, 9.0, 4.0)
        foot, facet, _ = strip_inverse._feet(charts, lift.position)
        whole = np.isfinite(foot).all(axis=(1, 2))
        charts, foot, facet = charts.rows(np.flatnonzero(whole)), foot[whole], facet[whole]
        for off in (0.3, 5.0):
            guess = coordinates[whole, :, :2] + off * np.sin(np.arange(22.0)).reshape(11, 2)
            for some, strip in strip_pieces.strips(charts, guess):
                found += [some, strip.shape, strip.step, strip.zero]
                found += [strip.nodes.values, strip.nodes.stretch]
                found += strip._where(guess[some], strip.step)
                for rough in (True, False):
                    found += strip.moved(foot[some], facet[some], rough)
            at = guess.copy()
            found += [strip_inverse._settled(charts, at, foot, facet), at]
    return found


@case
def splines_between_nodes():
    rng = np.random.default_rng(7)
    found: list = []
    for shape in ((1, 5, 2), (3, 6, 4)):
        spline = strip_pieces.StripSpline(rng.normal(size=(*shape, 12)))
        for count in (7, 7, 4):
            pair = rng.integers(shape[0], size=(2, count))
            i = rng.integers(shape[1] - 1, size=(2, count))
            j = rng.integers(shape[2] - 1, size=(2, count))
            r, s = rng.random((2, 2, count))
            found += spline.at(pair, i, j, r, s)
            found += spline.at(pair, i, j, s, r)
    return found


@case
def strokes_found_on_strips_or_left():
    found: list = []
    for name in ("saddle", "bumpy", "holed", "tube", "fold", "edge", "ball"):
        charts, _, lift = drawn(meshes()[name], 5, 15, 7.0, 5.0)
        for height in (0.0, 0.45, 0.55):
            up = np.where(np.arange(5) % 2, height, 0.5 * height)[:, None, None]
            one = strip_inverse.found(charts, lift.position + up * lift.normal)
            found += [one.rows, one.coordinates, one.axes, one.miss < 1e-6]
    return found


# Charts inverted.


@case
def coordinates_sought_about_round_parts():
    found: list = []
    s = np.linspace(0.0, 1.0, 40)
    start, goal = np.array([[60.0, -40.0, -60.0]]), np.array([[40.0, 45.0, -15.0]])
    charts = DRUM.charts(start, goal, side=np.array([1.0, 0.0, 0.3]))
    for turns, height in ((0.8, 0.0), (2.3, 5.0), (-1.6, -9.0)):
        u = np.stack([120 * s, turns * 2 * np.pi * 60.0 * s, height * np.sin(9 * s)], axis=-1)
        position = charts.lift(u[None]).position
        position[0, 20:] += 0.4
        one = inverse_chart.invert(charts, position)
        found += [one.coordinates, one.axes, one.reached, one.status]
    charts = BALL.charts(*(BALL.closest(60.0 * np.eye(3)[[k, 1 - k]]).position for k in (0, 1)))
    for wide in (30.0, 140.0, 220.0):
        u = np.stack([np.linspace(-40, 130, 40), wide * np.sin(6 * s), 12 * s], axis=-1)
        position = charts.lift(np.stack([u, u * [1, -1, 1]])).position
        one = inverse_chart.invert(charts, position)
        found += [one.coordinates, one.reached, one.status]
    return found


@case
def guesses_beside_lines_and_grids():
    found: list = []
    for surface in (DRUM, BALL, meshes()["saddle"], meshes()["holed"]):
        start = surface.closest(np.array([[-20.0, 3.0, 9.0], [5.0, -22.0, 9.0]])).position
        goal = surface.closest(np.array([[24.0, 9.0, 9.0], [-4.0, 20.0, 9.0]])).position
        charts = surface.charts(start, goal)
        position = charts.lift(wavy(charts.lengths, 9, 14.0, 3, 12.0)).position
        low, high = inverse_chart._swing(charts, position)
        at, near = inverse_chart._beside_centre_line(charts, position, low, high)
        found += [low, high, at, near]
        # The widest has more nodes than are looked at: it is coarser.
        for wide in (9.0, 60.0, 4000.0)[: 3 if surface is DRUM else 2]:
            ends = [np.stack([x, side], axis=-1)[:, None] for x, side in (
                (low, np.full(2, -wide)), (high, np.full(2, wide)))]  # fmt: skip
            found += inverse_chart._on_grid(charts, position, near, tuple(ends))
    return found


@case
def strokes_inverted_by_steps():
    found: list = []
    for name, off in (("saddle", [25.0, 0.0, 1.0]), ("holed", [0.0, 0.0, 3.0])):
        charts, _, lift = drawn(meshes()[name], 1, 7, 8.0, 6.0)
        position = lift.position.copy()
        position[0, 3:5] += off
        one = inverse_chart.invert(charts, position)
        found += [one.coordinates, one.reached, one.status, one.miss < 1e-6]
    return found


@case
def jumps_and_gaps_filled():
    rng = np.random.default_rng(8)
    found: list = []
    coordinates, position = 20.0 * rng.normal(size=(5, 8, 3)), 3.0 * rng.normal(size=(5, 8, 3))
    found.append(inverse_chart._jumps(coordinates, position))
    found.append(inverse_chart._jumps(0.2 * coordinates, position))
    for share in (0.0, 0.5, 0.9):
        good = rng.random((5, 8)) < share
        good[0] = True
        found.append(inverse_chart._between(coordinates, good))
    return found


@case
def newton_steps_and_jacobians():
    rng = np.random.default_rng(9)
    J, gap = rng.normal(size=(3, 6, 2, 2)), rng.normal(size=(3, 6, 2))
    gap[0, 2] = np.nan
    move, free = 9.0 * rng.normal(size=(3, 6, 2)), rng.random((3, 6)) < 0.7
    move[1, 1] = 0.0
    found: list = [
        tangential._solve(J, gap),
        tangential._limited(3.0 * move),
        tangential._size(gap),
    ]
    found.append(tangential._carried_on(J, move, gap, free))
    charts = meshes()["holed"].charts(*spread(meshes()["holed"], 3, half=24.0))
    wanted = wavy(charts.lengths, 6, 9.0)
    position = charts.lift(wanted).position
    for off in (0.2, 9.0):
        guess = wanted[..., :2] + off * rng.normal(size=(3, 6, 2))
        free = rng.random((3, 6)) < 0.8
        box = np.full((3, 1, 2), -40.0), np.full((3, 1, 2), 70.0)
        for within in (None, box)[off > 1.0 :]:
            one = tangential.solved(charts, position, guess, free, within)
            found += [one.at, one.height, one.area, one.good]
    state = tangential._NewtonState(charts, position, guess, free, box)
    for _ in range(4):
        live = state.live()
        state.step(live)
        found += [live, state.at, state.gap, state.jacobian, state.trust, state.stalled]
        found += [state.fresh, state.least, state.score]
    other, lost = state.best.rows(np.arange(3)), rng.random((3, 6)) < 0.3
    other.height[:] *= rng.choice([0.5, 2.0], (3, 6))
    for keep in (True, False):
        found.append(state.best.better(other, free, keep))
    return [*found, state.best.without(lost, guess)]


# Charts of meshes.


@case
def charts_of_pairs_of_chance():
    found: list = []
    for name, mesh in meshes().items():
        a, b = scattered(mesh, 5, 10, 0.3), scattered(mesh, 5, 11, 0.3)
        b[3] = a[3]
        for side in (None, np.array([0.2, 0.1, -1.0]))[len(found) % 2 :][:1]:
            charts = mesh.charts(a, b, side)
            found += [name, charts.lengths, charts.status, charts.creased, charts.goals]
            found += [charts.centre.sign, charts.centre.step, charts.centre.part]
    return found


@case
def strokes_lifted_over_all_kinds():
    found: list = []
    for name, mesh in meshes().items():
        for wide in (3.0, 14.0):
            _, _, lift = drawn(mesh, 4, 15, wide, 3.0)
            found += [name, *right(lift)]
    return found


@case
def strokes_walked_from_facet_to_facet():
    found: list = []
    for name in ("saddle", "fold", "edge", "fillet", "box", "holed"):
        charts, coordinates, lift = drawn(meshes()[name], 3, 11, 5.0)
        rows = np.array([2, 0])
        foot, axes, outside, status = charts._unfold(rows, coordinates[rows])
        found += [outside, status, foot, axes, charts.over(lift.position + [0, 0, 4.0])]
        found += [charts._crosses_noise(foot)]
    return found


@case
def closed_strokes_over_meshes():
    found: list = []
    a = np.linspace(0.0, 2.0 * np.pi, 17)
    loop = np.stack([9 * np.cos(a) - 9, 6 * np.sin(a), 0.3 * np.sin(a)], axis=-1)
    for name in OPEN:
        mesh = meshes()[name]
        start, goal = spread(mesh, 3, half=2.0)
        charts = mesh.charts(start, goal, None, rotations.exp(np.array([0.1, 0.2, 0.9])))
        found += [charts.goals, charts.status, *right(charts.lift(np.tile(loop, (3, 1, 1))))]
    return found


@case
def what_folds_and_what_does_not():
    rng = np.random.default_rng(12)
    found: list = []
    for step in (0.02, 0.1, 0.5, 2.0):
        u = np.cumsum(np.full(30, step))
        u = np.tile(u, (4, 1))
        coordinates = np.stack([u, rng.choice([0.0, 3.0], (4, 1)) * u, 0 * u], axis=-1)
        foot = coordinates.copy()
        foot[1, 12:18, 0] -= 2.0 * step * np.arange(6)
        foot[2, 12:, 0] = 2.0 * u[2, 12] - foot[2, 12:, 0]
        axes = np.tile(np.eye(3), (4, 30, 1, 1))
        axes[2, 14:] = rotations.exp(np.array([0.0, rng.choice([0.1, 0.3]), 0.0]))
        found += [mesh_charts._folded(foot, axes, coordinates)]
        found += [mesh_charts._folded(foot, axes, -coordinates)]
    return found


@case
def walks_over_meshes():
    rng = np.random.default_rng(13)
    found: list = []
    for mesh in meshes().values():
        origin = mesh.closest(scattered(mesh, 5, 14)).position
        heading = rng.normal(size=(5, 3))
        found.append(mesh.walk(origin, heading, np.array([5.0, -9.0, 0.0, 30.0, 2.0])))
        found.append(mesh.walk(origin[:4].reshape(2, 2, 3), heading[0], np.full((2, 2), 6.0)))
    return found


@case
def shots_by_fans():
    found: list = []
    for name in ("bumpy", "holed", "tube", "edge"):
        mesh = meshes()[name]
        start, goal = spread(mesh, 4, 15, 26.0)
        at = mesh.closest(start)
        part = mesh.components[at.face]
        aim = geodesic_shooting.take_aim(start, at.normal, goal, np.ones((4, 1)), part)
        for shot in (geodesic_shooting.by_steps, geodesic_shooting.by_facets):
            best = geodesic_shooting._best_of_fan(mesh, aim, shot)
            found += [best.direction, best.length]
            hit, ends, good = geodesic_shooting.hit(mesh, aim, shot)
            found += [hit.direction[good], hit.length[good], good, ends.sharp, ends.off]
    return found


@case
def lines_and_ways_along_edges():
    found: list = []
    for name in ("saddle", "holed", "ball", "box", "edge", "two", "wall"):
        mesh = meshes()[name]
        a, b = mesh.closest(scattered(mesh, 5, 16)), mesh.closest(scattered(mesh, 5, 17))
        pairs = geodesic_search._Pairs.of(mesh, a.position, b.position)
        found.append(geodesic_search._along_edges(mesh, pairs, np.array([4, 1, 2])))
        windows = geodesic_search._first(mesh, pairs, np.array([0, 3, 4]))
        limit = np.array([40.0, 9.0, 9.0, 25.0, 90.0])
        found.append(windows)
        found.append(geodesic_search._within(mesh, pairs, windows, limit))
        found.append(geodesic_search._behind(mesh, pairs, windows, limit))
        found.append(geodesic_search.find(mesh, a.position, b.position))
    return found


# What is checked of strokes.


@case
def feet_that_are_wrong_in_many_ways():
    rng = np.random.default_rng(18)
    found: list = []
    for name in ("fold", "edge", "rough"):
        mesh = meshes()[name]
        line = np.linspace(-20.0, 20.0, 15)
        base = np.stack([np.stack([line, 0 * line + y, 0 * line + 9.0], -1) for y in (-6, 1, 5, 8)])
        at = mesh.closest(base)
        u = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(at.position[0], axis=0), axis=1))]
        coordinates = np.tile(np.stack([u, 0 * u, 0 * u], -1), (4, 1, 1))
        for size in (0.0, 2e-3, 0.02, 0.4, 4.0):
            position, normal = at.position.copy(), at.normal.copy()
            for row in range(4):
                position[row, rng.integers(15)] += size * rng.normal(size=3)
                turn = rotations.exp(rng.choice([0.0, 0.3, 0.6]) * np.array([1.0, 0.0, 0.0]))
                normal[row, rng.integers(15)] @= turn
            stretch = rng.choice([-1.0, 0.4, 1.0, 6.0], (4, 15))
            outside = rng.random((4, 15)) < 0.05
            feet = last_check.Feet(coordinates, position, normal, at.face, stretch, outside)
            ends = at.position[:, 0], at.position[:, -1], coordinates[:, -1]
            found += [last_check.refusals(mesh, feet, *ends), last_check.unsound(mesh, feet)]
            found += [last_check._jumps(feet)]
        chord = np.linalg.norm(at.position[:, -1] - at.position[:, 0], axis=1)
        for less in (0.009, 0.011, 0.3):
            lengths = chord - less
            found += [
                last_check.shorter_than_chord(mesh, at.position[:, 0], at.position[:, -1], lengths)
            ]
    return found


@case
def strokes_over_slits():
    mesh = meshes()["slit"]
    rng = np.random.default_rng(19)
    ends = np.column_stack([rng.uniform(-25, 25, (2, 9)).T, 0.0 * np.zeros(9)])
    path = np.linspace(ends * [1, 1, 0], ends * [0.5, -1, 0], 7).transpose(1, 0, 2)
    path[3, :, 1] = 0.0
    path[4, 2:5, 1] = 0.0
    found: list = [crossed(mesh, path), crossed(mesh, path[:, ::2]), mesh.slits.off(path[0])]
    return [*found, mesh.slits.near(path[1], np.linspace(0.0, 9.0, 7))]


@case
def goals_behind_thin_walls():
    found: list = []
    mesh = meshes()["wall"]
    x = np.linspace(-29.0, 29.5, 9)
    origin = np.column_stack([0 * x - 12.0, 0 * x + 2.0, 0 * x + 0.4])
    for z in (-0.4, 0.4):
        goal = np.column_stack([x, 0.6 * x, 0 * x + z])
        for off in (0.0, 0.15, 0.3):
            for size in (15.0, 45.0):
                found += [mistaken(mesh, origin, goal, np.full(9, off), np.full(9, size))]
    charts = mesh.charts(origin, goal + [0.0, 0.0, -0.7])
    return [*found, charts.status, charts.lengths]


@case
def margins_on_folds_and_around_holes():
    found: list = []
    for name in ("holed", "fold", "edge", "slit", "tube", "two"):
        mesh = meshes()[name]
        points = mesh.closest(scattered(mesh, 60, 20)).position.reshape(4, 15, 3)
        looked = np.arange(60).reshape(4, 15) % 5 > 0
        for margin in (2.0, 7.0):
            found += [BorderMargin(mesh, margin).holds(points, looked)]
    return found


@case
def regions_on_meshes_of_all_kinds():
    found: list = []
    a = np.linspace(0.0, 2.0 * np.pi, 14)[:-1]
    for name in ("saddle", "holed", "fold", "edge", "ball", "box", "two"):
        mesh = meshes()[name]
        for size in (5.0, 13.0):
            line = np.column_stack([12 + size * np.cos(a), 8 + 0.8 * size * np.sin(a), 60 + 0 * a])
            try:
                region = mesh_regions.mesh_region(mesh, mesh.closest(line).position)
            except InputError as error:
                found.append(str(error))
                continue
            points = mesh.closest(scattered(mesh, 40, 21)).position
            found += [region.face, region.begin, region.within, region.low, region.high]
            found += [region.inside(points), region.holds(points.reshape(5, 8, 3))]
    return found


# Meshes.


@case
def scans_smooth_and_rough():
    found: list = []
    for name, sigma in (("rough", 0.0), ("saddle", 0.5), ("bumpy", 0.2), ("edge", 0.3)):
        V, F = meshes()[name].V, meshes()[name].F
        shift = sigma * np.random.default_rng(22).normal(size=V.shape) * (V[:, :1] > 0.0)
        for faces in (F, F[::-1].copy(), np.roll(F, 1, axis=1)):
            mesh = Mesh(V + shift, faces)
            found += [
                mesh.shape.noise,
                mesh.shape.noisy_share,
                mesh.shape.reach,
                mesh.shape.corner_normals,
            ]
        found += [mesh_noise.averaged(mesh.shape.vertex_normals, mesh.F)]
    return found


@case
def noise_at_its_limits():
    mesh = meshes()["rough"]
    of = mesh.corners, mesh.face_normals, mesh.shape.vertex_normals
    found: list = []
    for share in (0.02, 0.3, 0.6, 1.0, 1.6):
        found += [noise(*of, share * mesh.shape.dihedrals, mesh.topology)]
    rings_ = mesh_noise._Rings(np.linspace(1.0, 2.0, len(mesh.F)), mesh.topology)
    values = np.column_stack([np.arange(len(mesh.F)), np.ones(len(mesh.F))])
    return [*found, *(rings_.means(values, n) for n in (0, 1, 3))]


@case
def soups_mended():
    rng = np.random.default_rng(23)
    V0, F0 = plate(6, 5)
    ball = made(trimesh.creation.icosphere(1, 15.0))
    found: list = []
    for number in range(30):
        V, F = (V0.copy(), F0.copy()) if number % 2 else (ball[0].copy(), ball[1].copy())
        for _ in range(int(rng.integers(1, 4))):
            kind, at = rng.integers(7), rng.integers(len(F), size=3)
            if kind == 0:
                F = np.delete(F, at, axis=0)
            elif kind == 1:
                F[at] = F[at][:, ::-1]
            elif kind == 2:
                F = np.r_[F, F[at][:, [1, 2, 0]], F[at[:1]][:, ::-1]]
            elif kind == 3:
                F = np.r_[F, [[F[at[0], 0], F[at[0], 1], len(V)]]]
                V = np.r_[V, V[F[at[0], :1]] + [0, 0, 8.0]]
            elif kind == 4:
                own = V[F[at[0]]] + rng.choice([0.0, 1e-6])
                F[at[0]] = len(V) + np.arange(3)
                V = np.r_[V, own]
            elif kind == 5:
                middle = V[F[at[0], :2]].mean(axis=0)
                F = np.r_[F, [[F[at[0], 0], len(V), F[at[0], 2]], [len(V), *F[at[0], 1:]]]]
                F, V = np.delete(F, at[0], axis=0), np.r_[V, [middle]]
            else:
                F = np.r_[F, len(V) + F[at]]
                V = np.r_[V, V * [1, 1, -1] + [0, 0, rng.choice([0.0, 40.0])]]
        try:
            one = mesh_repair.mended(V, F)
        except InputError as error:
            found.append(type(error).__name__)
            continue
        topology = Topology(one.F, len(one.V))
        found += [one.V, one.F, len(one.remarks), topology.neighbours, topology.uses]
        found += [topology.closed(one.V), mesh_repair.borders(one.F), mesh_repair.components(one.F)]
    return found


@case
def strips_that_are_one_sided():
    found: list = []
    for turns in (1, 2, 3):
        a = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
        half = 0.5 * turns * a
        out = np.column_stack([np.cos(a), np.sin(a), 0 * a])
        arm = 5.0 * (np.cos(half)[:, None] * out + np.sin(half)[:, None] * [0.0, 0.0, 1.0])
        V = np.r_[30.0 * out - arm, 30.0 * out + arm]
        i, n = np.arange(24), (np.arange(24) + 1) % 24
        low, high = n.copy(), n + 24
        if turns % 2:
            low[-1], high[-1] = 24, 0
        F = np.r_[np.stack([i, low, high], axis=1), np.stack([i, high, i + 24], axis=1)]
        one = mesh_repair.mended(V, F)
        found += [one.V, one.F, one.remarks]
    return found


@case
def room_on_parts():
    lying = rotations.exp(np.array([0.0, np.pi / 2, 0.0]))
    tall = made(trimesh.creation.box((90.0, 50.0, 30.0)))
    parts = {
        "box": tall,
        "lying": (tall[0] @ lying.T, tall[1]),
        "ball": rings(40.0, 14, 20),
        "plate": holed(*plate(13, 9), [3.0, 2.0, 0.0], 7.0),
        "ring": made(trimesh.creation.annulus(20.0, 24.0, 8.0, sections=24)),
        "tube": made(trimesh.creation.cylinder(15.0, 70.0, sections=32)),
        "aslant": (plate(5, 5)[0] @ rotations.exp(np.array([0.4, 0.9, 0.2])).T, plate(5, 5)[1]),
        "strips": joined(*((plate(2, 2, (0, 60), (0, w))[0] + [0, 10 * w, 0], plate(2, 2)[1])
                           for w in (1.0, 2.0, 3.0, 9.0, 20.0))),
    }  # fmt: skip
    found: list = []
    s = np.linspace(0.0, 1.0, 9)
    wave = np.column_stack([18 * s, 3 * np.sin(6 * s)])
    circle = 4.0 * np.column_stack([np.cos(6.3 * s) - 1.0, np.sin(6.3 * s)])
    for V, F in parts.values():
        whole = open_patches._Patches(V, F)
        found += [whole.order, whole.label, open_patches.open_patches(V, F, 2)]
        found += [whole.middle(n) for n in whole.order[:3]]
        for stroke in (
            open_patches.Footprint(25.0, 1.4 * wave),
            open_patches.Footprint(0.0, circle),
        ):
            found += list(open_patches.places_for(V, F, stroke, 2))
    return found


@case
def frames_smoothed_along_uneven_paths():
    rng = np.random.default_rng(24)
    found: list = []
    steps = rng.choice([0.0, 0.2, 3.0], (4, 25))
    position = np.cumsum(steps, axis=1)[..., None] * np.array([0.6, 0.8, 0.0])
    axes = rotations.exp(0.4 * rng.normal(size=(4, 25, 3)))
    for width in (0.0, 0.5, 4.0, 90.0):
        found += [frame_smoothing.smoothed(axes, position, width)]
    found.append(frame_smoothing.smoothed(axes[:, :2], position[:, :2], 4.0))
    found.append(frame_smoothing.smoothed_vectors(rng.normal(size=(4, 25, 2)), position, 2.0))
    return found


# Poses.


@cache
def block():
    return Mesh(*made(trimesh.creation.box((60.0, 40.0, 25.0)).subdivide()))


def touched(count, seed, sigma=0.0):
    rng = np.random.default_rng(seed)
    mesh = block()
    face = rng.permutation(len(mesh.F))[np.arange(count) % len(mesh.F)]
    on = np.einsum("ki,kij->kj", rng.dirichlet([2.0, 2.0, 2.0], count), mesh.corners[face])
    return on + sigma * rng.normal(size=on.shape), mesh.face_normals[face]


def near(points, seed, count=8):
    rng = np.random.default_rng(seed)
    R, t = rotations.exp(0.02 * rng.normal(size=3)), rng.normal(size=3)
    return pose_search.near(R, t, points.mean(axis=0), count, 2.0, 0.05)


@case
def blocks_laid_to_points():
    laid = registration.RegisteredPart.of(block())
    found: list = [laid.extreme, laid.places]
    for count, sigma in ((8, 0.0), (14, 0.05), (24, 0.3)):
        points, normals = touched(count, 25 + count, sigma)
        mixed = np.where(np.arange(count)[:, None] % 3 == 0, np.nan, -normals)
        for approach, limits in ((None, (0.5, 1.5)), (-normals, (1.0,)), (mixed, (1.5,))):
            for limit in limits:
                try:
                    one = registration.onto_surface(points, laid, near(points, 3), approach, limit)
                except InputError as error:
                    found.append(str(error))
                    continue
                found += [one.rotation, one.position, one.uncertainty, one.directed, one.outside]
                found += [one.rms, one.spare, one.conditioning.gains]
                rival = one.rival
                found += [] if rival is None else [rival.apart > limit, rival.near]
    return found


@case
def directions_against_poses():
    laid = registration.RegisteredPart.of(block())
    points, normals = touched(12, 30)
    poses, squares = pose_search.descend(points, laid.closest, near(points, 4))
    some = Pose(
        np.concatenate([poses.position[:1], poses.position[:1], poses.position[:1] + 1.0]),
        np.concatenate([poses.rotation[:1], poses.rotation[:1] @ np.diag([1.0, -1, -1]),
                        poses.rotation[:1] @ np.diag([-1.0, -1, 1])]),
    )  # fmt: skip
    found: list = [squares[:1]]
    for wrong in (0, 1, 2, 3, 8):
        approach = -normals.copy()
        approach[:wrong] *= -1.0
        approach[wrong : wrong + 1] = np.nan
        for limit in (0.7, 3.0):
            cost = np.array([0.0, 4.0, 1.0])
            found += registration._directed(points, laid, some, cost, approach, limit)
    for off in (0.0, 0.09, 0.11, 0.4):
        d = off + 0.05 * np.sin(np.arange(12.0))
        found += [registration._one_sided(d), registration._one_sided(-d)]
    one = Pose(some.position[:1], some.rotation[:1])
    for k in (1, 2):
        other = Pose(some.position[k : k + 1], some.rotation[k : k + 1])
        found.append(registration._rival(laid, one, other, 0.3, True))
    return found


@case
def points_of_wrong_sizes():
    found: list = []
    for V in (block().V, block().V + [900.0, -40.0, 7.0], block().V * [1.0, 0.01, 0.01]):
        part = registration.RegisteredPart(None, V, V)
        for size in (0.01, 0.019, 0.021, 0.5, 1.0, 1.5, 3.0, 40.0):
            try:
                registration._refuse_size(size * V, part)
                found.append("")
            except InputError:
                found.append("refused")
    rng = np.random.default_rng(31)
    for size in (0.4, 0.51, 1.0, 1.99, 2.1):
        part_ = 20.0 * rng.normal(size=(5, 3))
        try:
            one = registration.from_pairs(part_, size * part_ + 3.0, 3.0 * part_)
            found += [one.rotation, one.position, one.residual, one.uncertainty, one.spare]
        except InputError as error:
            found.append(str(error))
    return found


@case
def poses_spread_and_told_apart():
    rng = np.random.default_rng(32)
    placed = rng.normal(size=(1, 7, 3)) + 0.02 * rng.normal(size=(20, 1, 3))
    found: list = [pose_search._distinct(placed, np.arange(20)[::-1])]
    placed = placed + 0.02 * rng.normal(size=(20, 7, 3))
    found += [pose_search._distinct(placed, np.arange(20)), pose_search._ball(rng.random((9, 3)))]
    points, normals = touched(10, 33, 0.1)
    laid = registration.RegisteredPart.of(block())
    found += pose_search.signed(points.reshape(2, 5, 3), laid.closest)
    best, squares = pose_search.descended(points, laid.closest, near(points, 5, 4))
    found += [best.rotation, best.position, squares]
    fixed = np.linalg.qr(rng.normal(size=(6, 6)))[0][:4]
    held, squares = pose_search.descended(points, laid.closest, near(points, 5, 4), 5, fixed)
    found += [held.rotation, held.position, squares]
    of = conditioning_of(points, normals, 10)
    one = Pose(best.position[:1], best.rotation[:1])
    aside, squares = pose_bound.beside(points, laid.closest, one, of, block().V, 0.8)
    found += [aside.rotation, aside.position, squares, of.gains, of.radius]
    return [*found, pose_bound.displacement(aside, one, block().V)]


@case
def strokes_lifted_alone_and_among_others():
    """The counts of strokes, samples and coordinates all differ."""
    found: list = []
    for name in ("saddle", "edge", "box"):
        charts, coordinates, _ = drawn(meshes()[name], 5, 8, 5.0)
        for rows in ([4], [0, 3], [1, 2, 4]):
            some = charts.rows(np.array(rows))
            found += right(some.lift(coordinates[rows]))
            found += [some.lengths, some.target, some.centre.origin]
    return [*found, replace(charts, creased=~charts.creased).lift(coordinates).status]


@case
def what_small_meshes_say_of_themselves():
    found: list = []
    for name, mesh in meshes().items():
        points = scattered(mesh, 25, 40, 4.0).reshape(5, 5, 3)
        at = mesh.closest(points)
        flat, face = at.position.reshape(-1, 3), at.face.reshape(-1)
        found += [
            name,
            mesh.shape.dihedrals,
            mesh.shape.developable,
            mesh.outward,
            fields.edge_length(mesh),
        ]
        found += [
            mesh.shape.heights.max(),
            mesh.shape.reach,
            mesh.planes_at(np.arange(len(mesh.F))),
            parts_of(mesh),
            at,
        ]
        found += [mesh.beyond_border(points.reshape(-1, 3), flat, face)]
        found += [
            mesh.shape._tips(mesh.shape.corner_normals),
            mesh.shape._ends(mesh.shape.dihedrals > 10.0),
        ]
        found += [
            mesh.slits.off(flat),
            placement.box(mesh),
            sharp_edges.sharp_edges(mesh.V, mesh.F),
        ]
        found += [chordal_error.chordal_error(mesh.V, mesh.F), extent.area(mesh.V, mesh.F)]
        found += [extent.volume(mesh.V, mesh.F), mesh.topology.border_vertices]
        other = type(mesh)(mesh.V, mesh.F, mesh.topology.adjacency)
        found += [other.shape.noise, other.components, other.shape.corner_normals]
    return found


@case
def pieces_within_pieces():
    ball = made(trimesh.creation.icosphere(1, 20.0))
    small, out = (0.4 * ball[0], ball[1][:, ::-1]), (ball[0] + [60.0, 0, 0], ball[1])
    found: list = []
    for some in ([ball], [ball, small], [ball, (small[0], ball[1])], [ball, small, out]):
        V, F = joined(*some)
        found += [extent.volume(V, F), extent.volume(V, F[:, ::-1]), extent.volume(V, F[1:])]
    return found


@case
def exact_surfaces_walked_and_charted():
    rng = np.random.default_rng(41)
    plane = Plane(np.array([1.0, 2.0, 3.0]), np.array([0.48, 0.6, 0.64]))
    found: list = []
    for surface in (plane, DRUM, BALL):
        points = 70.0 * rng.normal(size=(2, 3, 3))
        at = surface.closest(points)
        heading = rng.normal(size=(2, 3, 3))
        found += [at, surface.walk(at.position, heading, rng.uniform(-40, 90, (2, 3)))]
        a, b = at.position.reshape(-1, 3)[:4], at.position.reshape(-1, 3)[2:]
        found.append(surface.connect(a, b))
        for side in (None, rng.normal(size=3), rng.normal(size=(4, 3))):
            charts = surface.charts(a, b, side)
            u = 25.0 * rng.normal(size=(4, 5, 3))
            found += [charts.lengths, charts.goals, charts.status, charts.lift(u)]
            found += [charts.rows(np.array([3, 1])).lift(u[[3, 1]]).position, charts.over(u)]
            turned = rotations.exp(rng.normal(size=3))
            closed = surface.charts(a, a + 2.0 * rng.normal(size=(4, 3)), side, turned)
            found += [closed.goals, closed.lengths, closed.lift(0.5 * u)]
    return found


@case
def regions_on_exact_surfaces():
    rng = np.random.default_rng(42)
    plane = Plane(np.array([0.0, 0.0, 5.0]), np.array([0.0, 0.0, 1.0]))
    found: list = []
    for surface in (plane, DRUM, BALL):
        for size in (8.0, 25.0):
            a = np.sort(rng.uniform(0.0, 2.0 * np.pi, 9))
            r = size * rng.uniform(0.4, 1.0, 9)
            line = surface.closest(np.column_stack([r * np.cos(a), r * np.sin(a), 60 + 0 * a]))
            region = enclosed(surface, line.position)
            path = np.cumsum(8.0 * rng.normal(size=(6, 7, 3)), axis=1) + [0.0, 0.0, 60.0]
            found += [region.flat.axes, region.corners, region.flat(path)]
            found += [region.holds(surface.closest(path).position)]
    return found


@case
def polygons_of_chance():
    rng = np.random.default_rng(43)
    found: list = []
    counts = rng.integers(3, 9, 25)
    V = []
    for count in counts:
        a = np.sort(rng.uniform(0.0, 2.0 * np.pi, count))
        a = a if rng.random() < 0.8 else rng.permutation(a)
        r = rng.choice([1.0, 9.0], count) if rng.random() < 0.6 else np.full(count, 5.0)
        flat_ = np.column_stack([r * np.cos(a), r * np.sin(a), 0 * a])
        V.append(flat_ @ rotations.exp(rng.normal(size=3)).T + rng.normal(size=3))
    V = np.concatenate(V)
    one = polygons.cut(V, np.arange(len(V)), counts)
    found += [one.F, one.crossed, polygons.cut(V, np.arange(len(V))[::-1], counts[::-1]).F]
    flat_ = np.zeros((1, 5, 3))
    flat_[0, :, 0] = [0, 1, 2, 3, 4]
    found += [polygons._flattened(flat_, polygons._normals(flat_))]
    found += [polygons._convex(V[:4][None], polygons._normals(V[:4][None]))]
    return [*found, polygons.too_large(V, np.arange(len(V)), counts)]
