"""Meshes, charts, regions and poses of many kinds: results that are kept, see `tests/kept.py`."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import trimesh

from dmpcli.records import file_io
from dmpcli.records.mesh import decode
from dmpcli.spatial import rotations
from dmpcli.spatial.pose import Pose
from dmpcli.surfaces import (
    chordal_error,
    extent,
    frame_smoothing,
    geodesic_search,
    geodesic_shooting,
    last_check,
    mesh_repair,
    mistouched,
    pose_bound,
    pose_search,
    registration,
    sampled_chart,
    sharp_edges,
    straightest_geodesics,
)
from dmpcli.surfaces.border_margin import BorderMargin
from dmpcli.surfaces.conditioning import conditioning_of, radius_of
from dmpcli.surfaces.cylinder import Cylinder
from dmpcli.surfaces.flat_regions import flattened
from dmpcli.surfaces.inverse_chart import invert
from dmpcli.surfaces.keep_out import enclosed
from dmpcli.surfaces.last_check import Feet
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.mesh_regions import mesh_region
from dmpcli.surfaces.open_patches import open_patches
from dmpcli.surfaces.placement import box, slips
from dmpcli.surfaces.plane import Plane
from dmpcli.surfaces.polygons import cut, too_large
from dmpcli.surfaces.slit_crossings import crossed
from dmpcli.surfaces.sphere import Sphere
from dmpcli.surfaces.thin_walls import mistaken
from dmpcli.surfaces.topology import Topology
from tests.kept import Kept
from tests.records.meshes import grid
from tests.surfaces import cases, fields, varied
from tests.surfaces.test_mesh import folded

KEPT = Kept(__file__)
PARTS = Path(__file__).parent / "parts"
EXACT = {
    "plane": Plane(np.array([1.0, 2.0, 3.0]), np.array([0.6, 0.0, 0.8])),
    "cylinder": Cylinder(np.array([0.0, 0.0, -60.0]), np.array([0.0, 1.0, 0.0]), 60.0),
    "sphere": Sphere(np.array([0.0, 0.0, -150.0]), 150.0),
}


def rng():
    return np.random.default_rng(5)


@cache
def part(name):
    found = decode(file_io.read(PARTS / f"{name}.stl"))
    return Mesh(found.V, found.F)


@cache
def meshes():
    """Meshes of some hundred facets: smooth, folded, noisy, closed, with holes and slivers."""
    ball = trimesh.creation.icosphere(3, 40.0)
    cone = trimesh.creation.cone(30.0, 50.0, sections=24)
    ring = trimesh.creation.annulus(20.0, 30.0, 15.0, sections=24)
    V, F = fields.square(fields.saddle(), 900, 60.0)
    rough = V + np.where(V[:, :1] > 0, 0.2, 0.0) * rng().normal(size=V.shape)
    hole = np.linalg.norm(V[F].mean(axis=1)[:, :2] - [20.0, 10.0], axis=1) > 12.0
    return {
        "saddle": Mesh(V, F),
        "rough": Mesh(rough, F),
        "holed": Mesh(V, F[hole]),
        "bumpy": Mesh(*fields.square(fields.bumpy(), 2000, 60.0)),
        "ball": Mesh(np.array(ball.vertices), np.array(ball.faces)),
        "cone": Mesh(np.array(cone.vertices), np.array(cone.faces)),
        "ring": Mesh(np.array(ring.vertices), np.array(ring.faces)),
        "folded": folded(25.0),
        "edge": folded(70.0),
    }


def about(mesh, count=30, off=4.0):
    """Points near a mesh, on both sides of it."""
    r = rng()
    face = r.integers(len(mesh.F), size=count)
    on = np.einsum("ki,kij->kj", r.dirichlet([1.0, 1.0, 1.0], count), mesh.V[mesh.F[face]])
    return on + off * r.normal(size=on.shape)


def pairs(surface, count=6, half=24.0, top=(0.0, 0.0, 60.0)):
    """Starts and goals about the middle of a surface, in several headings."""
    a = 1.1 * np.arange(count) + 0.3
    aside = half * np.stack([np.cos(a), np.sin(a), 0.0 * a], axis=-1)
    middle = surface.closest(np.asarray(top, dtype=float)[None]).position
    return surface.closest(middle - aside).position, surface.closest(middle + aside).position


def wavy(charts, wide=8.0, height=0.0, samples=40):
    s = np.linspace(0.0, 1.0, samples)
    u = charts.lengths[:, None] * s
    v = np.broadcast_to(wide * np.sin(2 * np.pi * s), u.shape)
    return np.stack([u, v, np.broadcast_to(height * np.sin(5 * s), u.shape)], axis=-1)


@KEPT.case
def what_meshes_say_of_themselves():
    found: list = []
    for mesh in meshes().values():
        found += [
            varied.parts_of(mesh),
            mesh.shape.noisy_share,
            mesh.shape.dihedrals,
            mesh.shape.developable,
            mesh.outward,
            fields.edge_length(mesh),
            mesh.shape.heights.max(),
            mesh.shape.reach,
            mesh.planes_at(np.arange(len(mesh.F))),
        ]
        topology = Topology(mesh.F, len(mesh.V))
        found += [topology.uses, topology.border, topology.closed(mesh.V), topology.border_vertices]
        found += [extent.area(mesh.V, mesh.F), extent.volume(mesh.V, mesh.F)]
        found += [
            chordal_error.chordal_error(mesh.V, mesh.F),
            sharp_edges.sharp_edges(mesh.V, mesh.F),
        ]
        found += [open_patches(mesh.V, mesh.F), box(mesh)]
    return found


@KEPT.case
def nearest_points():
    found: list = []
    for mesh in meshes().values():
        points = about(mesh)
        at = mesh.closest(points)
        found += [
            at,
            mesh.beyond_border(points, at.position, at.face),
            mesh.smooth_normals(at.position, at.face),
            mesh.search(points),
            mesh.slits.near(points, np.full(len(points), 3.0)),
            mesh.slits.off(points),
        ]
    for surface in EXACT.values():
        found.append(surface.closest(10.0 * rng().normal(size=(20, 3)) + [0, 0, 5.0]))
    return found


@KEPT.case
def geodesics_walked_and_found():
    found: list = []
    for surface in [*EXACT.values(), *meshes().values()]:
        start, goal = pairs(surface)
        link = surface.connect(start, goal)
        found.append(link)
        found.append(surface.walk(start, link.direction, 1.4 * link.length))
        found.append(surface.walk(start, -link.direction, np.full(len(start), 9.0)))
    return found


@KEPT.case
def lines_searched_for_over_all_headings():
    found: list = []
    for name in ("saddle", "ball", "folded", "holed", "ring"):
        mesh = meshes()[name]
        points = mesh.closest(about(mesh, 16, 1.0)).position
        found.append(geodesic_search.find(mesh, points[:8], points[8:]))
    return found


@KEPT.case
def strokes_laid_on_surfaces():
    found: list = []
    for surface in [*EXACT.values(), *meshes().values()]:
        for wide, height, half in ((8.0, 0.0, 20.0), (20.0, 3.0, 30.0)):
            start, goal = pairs(surface, 3, half)
            charts = surface.charts(start, goal)
            points = wavy(charts, wide, height)
            lift = charts.lift(points)
            found += [
                charts.lengths,
                charts.goals,
                charts.status,
                lift,
                lift.normal,
                charts.over(lift.position),
                charts.rows(np.array([2, 1])).lift(points[[2, 1]]),
            ]
    return found


@KEPT.case
def strokes_laid_on_machined_parts():
    found: list = []
    for name in ("angle_block", "carriage", "bracket"):
        mesh = part(name)
        r = rng()
        area = np.linalg.norm(
            np.cross(*(mesh.corners[:, i] - mesh.corners[:, 0] for i in (1, 2))), axis=1
        )
        face = r.choice(len(mesh.F), 24, p=area / area.sum())
        start = np.einsum("ki,kij->kj", r.dirichlet([1.0, 1.0, 1.0], 24), mesh.corners[face])
        aside = np.cross(mesh.face_normals[face], r.normal(size=(24, 3)))
        goal = mesh.closest(
            start + 14.0 * aside / np.linalg.norm(aside, axis=1, keepdims=True)
        ).position
        charts = mesh.charts(start, goal)
        lift = charts.lift(wavy(charts, 3.0))
        found += [
            mesh.shape.noise,
            charts.lengths,
            charts.status,
            charts.goals,
            lift.status,
            lift.outside,
            lift.unfolded,
            np.where(lift.status[:, None, None] == 0, lift.position, 0.0),
        ]
    return found


@KEPT.case
def closed_strokes_laid_on_surfaces():
    found: list = []
    c = np.linspace(0.0, 2.0 * np.pi, 40)
    for surface in [*EXACT.values(), meshes()["saddle"], meshes()["ball"]]:
        start, _ = pairs(surface, 4)
        closed = np.tile(rotations.exp(np.array([0.1, 0.2, 0.3])), (4, 1, 1))
        for more in ({}, {"side": np.array([0.0, 0.1, -1.0])}):
            charts = surface.charts(start, start, closed=closed, **more)
            x = np.stack([12 * np.cos(c) - 12, 9 * np.sin(c), 0 * c], axis=-1)
            found.append(charts.lift(np.broadcast_to(x, (4, 40, 3))))
    return found


def seen(charts, position):
    """What an inversion finds, but for how far it is off: that is rounding."""
    found = invert(charts, position)
    return [found.coordinates, found.axes, found.reached, found.status]


@KEPT.case
def charts_inverted():
    found: list = []
    for surface in [*EXACT.values(), meshes()["saddle"], meshes()["bumpy"], meshes()["ball"]]:
        charts = surface.charts(*pairs(surface, 3))
        for height in (0.0, 3.0):
            drawn = charts.lift(wavy(charts, 10.0, height)).position
            found.append(seen(charts, drawn))
        found.append(seen(charts, drawn + 0.3 * rng().normal(size=drawn.shape)))
    return found


@KEPT.case
def regions_within_lines():
    found: list = []
    c = np.linspace(0.0, 2.0 * np.pi, 25)[:-1]
    outline = np.column_stack([14 * np.cos(c) + 4 * np.cos(3 * c), 12 * np.sin(c), 80 + 0 * c])
    for surface in [*EXACT.values(), meshes()["saddle"], meshes()["bumpy"], meshes()["ball"]]:
        line = surface.closest(outline).position
        region = enclosed(surface, line)
        points = surface.closest(25.0 * rng().uniform(-1, 1, (150, 3)) + [0, 0, 80.0]).position
        found += [region.holds(points[:, None]), region.holds(points[None])]
        if isinstance(surface, Mesh):
            region = mesh_region(surface, line)
            found += [region.within, region.face, region.begin, region.low, region.inside(points)]
        else:
            found += [flattened(surface, line).axes, flattened(surface, line).origin]
    return found


@KEPT.case
def margins_to_borders():
    found: list = []
    for name in ("saddle", "holed", "ring", "cone"):
        mesh = meshes()[name]
        points = mesh.closest(about(mesh, 80, 0.5)).position[None]
        for margin in (3.0, 9.0):
            border = BorderMargin(mesh, margin)
            found += [border.edges, border.holds(points, np.ones(points.shape[:2], dtype=bool))]
    return found


@KEPT.case
def meshes_mended():
    V, F = (np.array(x) for x in fields.square(fields.saddle(), 200, 40.0))
    ball = trimesh.creation.icosphere(2, 20.0)
    B, G = np.array(ball.vertices), np.array(ball.faces)
    flipped = F.copy()
    flipped[::7] = flipped[::7, ::-1]
    foot = np.array([5, 16, 27])
    fin = np.array([[5, 16, len(V)], [16, 27, len(V) + 1], [16, len(V) + 1, len(V)]])
    split = np.delete(F, [40, 41], axis=0)
    middle = V[F[3]].mean(axis=0)
    tee = np.r_[F, [[F[3, 0], F[3, 1], len(V)]]]
    many = {
        "apart": (V[F].reshape(-1, 3), np.arange(3 * len(F)).reshape(-1, 3)),
        "flipped": (V, flipped),
        "fin": (np.r_[V, V[foot[:2]] + [0, 0, 9.0]], np.r_[F, fin]),
        "hole": (V, split),
        "twice": (V, np.r_[F, F[:9]]),
        "flat": (np.r_[V, [middle]], tee),
        "inside out": (B, G[:, ::-1]),
        "two": (np.r_[B, B + 60.0], np.r_[G, G[:, ::-1] + len(B)]),
        "near": (
            np.r_[V, V[F[50]] + 1e-7],
            np.r_[np.delete(F, 50, axis=0), [np.arange(3) + len(V)]],
        ),
        "border edge": tjunction(V, F),
    }
    found: list = []
    for V_, F_ in many.values():
        one = mesh_repair.mended(V_, F_)
        found += [
            one.V,
            one.F,
            len(one.remarks),
            mesh_repair.components(one.F),
            mesh_repair.borders(one.F),
        ]
    return found


def tjunction(V, F):
    """A mesh beside which a finer one begins: vertices lie on its border's edges."""
    low = V[np.abs(V[:, 0] - V[:, 0].max()) < 1e-9]
    line = np.repeat(low, 2, axis=0)[:-1]
    line[1::2] = 0.5 * (low[:-1] + low[1:])
    far = line + [9.0, 0.0, 0.0]
    n, base = len(line), len(V)
    i = np.arange(n - 1)
    strip = [np.stack([i, i + n, i + 1], 1), np.stack([i + 1, i + n, i + n + 1], 1)]
    return np.r_[V, line, far], np.r_[F, base + np.concatenate(strip)]


@KEPT.case
def polygons_cut():
    U = [[0, 0], [60, 0], [60, 40], [40, 40], [40, 10], [20, 10], [20, 40], [0, 40]]
    star = [
        [20 + (9 + 8 * (k % 2)) * np.cos(k * np.pi / 5), (9 + 8 * (k % 2)) * np.sin(k * np.pi / 5)]
        for k in range(10)
    ]
    crossed = [[0, 0], [10, 10], [10, 0], [0, 10], [-5, 5]]
    found: list = []
    for outlines in ([U], [star, U], [crossed], [U[:4]], [star[::2]]):
        flat = np.concatenate([np.asarray(o, dtype=float) for o in outlines])
        V = np.column_stack([flat, 0.05 * np.abs(flat[:, 0]) ** 1.5 * (len(outlines) > 1)])
        V = np.nan_to_num(V) @ rotations.exp(np.array([0.3, -0.2, 0.9])).T
        counts = np.array([len(o) for o in outlines])
        one = cut(V, np.arange(len(V)), counts)
        found += [one.F, one.crossed, too_large(V, np.arange(len(V)), counts)]
    return found


def touched(mesh, count, seed=5, sigma=0.05):
    r = np.random.default_rng(seed)
    area = np.linalg.norm(
        np.cross(*(mesh.corners[:, i] - mesh.corners[:, 0] for i in (1, 2))), axis=1
    )
    face = r.choice(len(mesh.F), count, p=area / area.sum())
    points = np.einsum("ki,kij->kj", r.dirichlet([1.0, 1.0, 1.0], count), mesh.corners[face])
    return points + sigma * r.normal(size=points.shape), mesh.face_normals[face]


@KEPT.case
def parts_laid_to_touched_points():
    found: list = []
    R, t = rotations.exp(np.array([0.2, -0.4, 0.7])), np.array([120.0, -30.0, 15.0])
    for name in ("angle_block", "bracket"):
        mesh = part(name)
        points, normals = touched(mesh, 18)
        laid = registration.RegisteredPart.of(mesh)
        near = rotations.exp(np.array([0.05, 0.02, -0.04])) @ R
        starts = registration.starts_near(points @ R.T + t, near, t + [2.0, -1.0, 1.5])
        one = registration.onto_surface(points @ R.T + t, laid, starts)
        found += [laid.extreme, laid.places, one, one.rms, conditioning_of(points, normals, 18)]
        directed = registration.onto_surface(
            points @ R.T + t, laid, starts, approach=-normals @ R.T
        )
        found.append(directed)
        found.append([one.conditioning.number, one.conditioning.weakest, one.conditioning.free])
    return found


@KEPT.case
def pairs_laid_upon_each_other():
    found: list = []
    r = rng()
    R, t = rotations.exp(np.array([1.0, -0.4, 0.7])), np.array([20.0, -30.0, 15.0])
    for shape in (np.ones(3), np.array([1.0, 1.0, 0.0]), np.array([1.0, 0.2, 0.05])):
        part_ = 40.0 * r.normal(size=(7, 3)) * shape
        given = part_ @ R.T + t + 0.1 * r.normal(size=part_.shape)
        one = registration.from_pairs(part_, given)
        found += [
            one,
            registration.from_pairs(part_, given, part_[:3] + 50.0).uncertainty,
            one.conditioning.number,
            one.conditioning.weakest,
            one.conditioning.free,
        ]
    return found


@KEPT.case
def bounds_of_poses():
    found: list = [
        [f(s, n) for s in (0.0, 0.5, 4.0) for n in (1, 3, 12)]
        for f in (pose_bound.variance, pose_bound.likely_rise, pose_bound.sure_rise)
    ]
    about_ = np.array([0.1, -0.2, 0.3])
    for more in (
        pose_search.near(np.eye(3), np.ones(3), about_, 12, 3.0, 0.2),
        pose_search.anywhere(about_, about_ + 5.0, 20),
    ):
        found += [more.rotation, more.position]
    return found


@KEPT.case
def points_that_miss_a_part():
    ball = Sphere(np.array([300.0, -80.0, 40.0]), 60.0)
    given = ball.centre + 60.0 * np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1], [0.6, 0.8, 0]])
    angles = np.array([0.1, 0.2, 0.3])
    return [
        slips(ball, given * a, b, np.array([300.0, -80.0, 40.0]), angles, (1000.0, 0.001), 0.5)
        for a in (1.0, 0.001, 1000.0)
        for b in (True, False)
    ]


@KEPT.case
def frames_made_smooth():
    s = fields.strokes(np.array([60.0, 90.0]), 80, 0)[..., :1]
    position = s * np.array([0.6, 0.0, 0.8])
    axes = rotations.exp(np.where(s < 30.0, 0.0, 0.3) * np.array([0.0, 1.0, 0.2]))
    return [
        frame_smoothing.smoothed(axes, position),
        frame_smoothing.smoothed(axes, position, 7.0),
        frame_smoothing.smoothed_vectors(position**2, position),
    ]


@KEPT.case
def charts_by_walks():
    case = cases.case("sphere", 4, 40)
    ball = cases.EXACT["sphere"]
    charts = sampled_chart.walked_charts(ball, case.start, case.goal, None, None)
    turned = np.tile(rotations.exp(np.array([0.1, 0.2, 0.3])), (4, 1, 1))
    far = sampled_chart.walked_charts(ball, case.start, case.goal, None, None, 20.0)
    return [
        charts.lengths,
        charts.goals,
        charts.status,
        charts.lift(case.coordinates),
        far.lift(case.coordinates).status,
        far.status,
        sampled_chart.closed_direction(turned, case.axes[:, 0, :, 2]),
    ]


@KEPT.case
def grids_of_heights():
    mesh = Mesh(*grid(13, 40.0))
    start = np.array([[-30.0, 0.0, 0.0], [0.0, -25.0, 0.0], [-20.0, -20.0, 0.0]])
    goal = np.array([[30.0, 5.0, 0.0], [5.0, 28.0, 0.0], [25.0, 18.0, 0.0]])
    at = mesh.closest(start).position, mesh.closest(goal).position
    charts = mesh.charts(*at)
    return [charts.lift(wavy(charts, w)) for w in (2.0, 12.0, 30.0, 60.0)]


def right(count=60):
    """A stroke that lies as it should on a flat sheet."""
    mesh = folded(0.0)
    coordinates = fields.strokes([60.0], count, height=20.0)
    position = coordinates + [-30.0, 1.0, 0.0]
    up = np.broadcast_to([0.0, 0.0, 1.0], position.shape)
    face = mesh.closest(position).face
    outside = np.zeros(face.shape, dtype=bool)
    return mesh, Feet(coordinates, position, up, face, np.ones(face.shape), outside)


@KEPT.case
def strokes_that_are_wrong():
    mesh, feet = right()
    start, step = np.array([[-30.0, 1.0, 0.0]]), np.array([[60.0, 0.0, 0.0]])
    found: list = []
    for off in (0.0, 0.05, 0.5, 1.2, 3.0):
        for axis in range(3):
            for part_ in (slice(0, 1), slice(20, 40), slice(59, 60)):
                moved = feet.position.copy()
                moved[0, part_, axis] += off
                one = replace(feet, position=moved)
                found += [last_check.refusals(mesh, one, start, start + step, step)]
                found += [last_check.unsound(mesh, one)]
    for lean in (0.2, 0.8, 1.2):
        normal = np.broadcast_to([0.0, np.sin(lean), np.cos(lean)], feet.position.shape)
        found += [
            last_check.refusals(mesh, replace(feet, normal=normal), start, start + step, step)
        ]
    for size in (40.0, 59.98, 59.995, 60.0):
        one = last_check.shorter_than_chord(mesh, start, start + step, np.array([size]))
        found.append(one)
    return found


@KEPT.case
def poses_sought():
    ball = EXACT["sphere"]

    def closest(points):
        at = ball.closest(points)
        return at.position, at.normal

    mesh = part("angle_block")

    def on_part(points):
        at = mesh.closest(points)
        return at.position, at.normal

    points, normals = touched(mesh, 14)
    starts = pose_search.near(
        rotations.exp(np.array([0.02, 0.03, -0.01])), np.ones(3), points.mean(axis=0), 6, 2.0, 0.1
    )
    best, squares = pose_search.descend(points, on_part, starts)
    found: list = [
        pose_search.signed(10.0 * rng().normal(size=(20, 3)), closest),
        best.rotation,
        best.position,
        squares,
    ]
    few, squares = pose_search.descended(points, on_part, starts, 2)
    found += [few.rotation, few.position, squares]
    bad = points.copy()
    bad[3] += 2.0 * normals[3]
    first = Pose(best.position[:1], best.rotation[:1])
    steady = mistouched.steadied(bad, on_part, first)
    conditioning = conditioning_of(points, normals, 14)
    found += [
        steady.rotation,
        steady.position,
        pose_bound.displacement(best, first, mesh.V[:20]),
        pose_bound.ellipsoid(conditioning, 14, 0.3, 8, mesh.V[:20]),
    ]
    beside, squares = pose_bound.beside(points, on_part, first, conditioning, mesh.V[:20], 0.5)
    return [*found, beside.rotation, beside.position, squares, radius_of(points)]


@KEPT.case
def goals_behind_walls():
    made = trimesh.creation.box((60.0, 40.0, 1.2)).subdivide().subdivide()
    wall = Mesh(np.array(made.vertices), np.array(made.faces))
    x = np.linspace(-25.0, 25.0, 12)
    origin = np.tile([-20.0, 3.0, 0.6], (12, 1))
    goal = np.column_stack([x, 0.2 * x, 0.6 * np.where(np.arange(12) % 3, -1.0, 1.0)])
    found: list = [
        mistaken(wall, origin, goal, np.full(12, off), np.full(12, size))
        for off in (0.0, 0.25, 0.35, 1.0)
        for size in (20.0, 50.0, 90.0)
    ]
    return [*found, wall.slits.near(goal, np.full(12, 2.0)), crossed(wall, goal[None])]


@KEPT.case
def lines_shot():
    found: list = []
    for name in ("saddle", "bumpy", "ball", "folded"):
        mesh = meshes()[name]
        start, goal = pairs(mesh, 4, 15.0)
        at = mesh.closest(start)
        part_ = mesh.components[at.face]
        aim = geodesic_shooting.take_aim(start, at.normal, goal, np.ones((4, 1)), part_)
        found += [
            aim,
            geodesic_shooting.by_steps(mesh, aim),
            geodesic_shooting.by_facets(mesh, aim),
            geodesic_shooting.corrected(mesh, aim),
        ]
        found.append(straightest_geodesics.walk(mesh, start, aim.direction, np.full(4, 20.0)))
    return found


for more in varied.CASES:
    KEPT.case(more)


@pytest.mark.sweep(kept=12)
@pytest.mark.slow
@pytest.mark.parametrize("name", KEPT.cases)
def test_results_are_those_that_were_kept(name):
    KEPT.check(name)
