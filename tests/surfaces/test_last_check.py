"""The last check: what is wrong is refused, however it was found, and by its name."""

from dataclasses import replace

import numpy as np
import pytest

from dmpcli.surfaces import last_check, straightest_geodesics
from dmpcli.surfaces.last_check import Feet, refusals
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.surface import Status
from tests.records.meshes import box
from tests.surfaces import fields
from tests.surfaces.test_mesh import folded
from tests.surfaces.test_mesh_noise import part

LENGTH = 60.0


def sheet(samples=200):
    """Return a plane at z = 0 and one stroke over it that is right."""
    mesh = folded(0.0)
    coordinates = fields.strokes([LENGTH], samples, height=20.0)
    position = coordinates + [-LENGTH / 2, 1.0, 0.0]
    face = mesh.closest(position).face
    up = np.broadcast_to([0.0, 0.0, 1.0], position.shape)
    outside = np.zeros(position.shape[:2], dtype=bool)
    return mesh, Feet(coordinates, position, up, face, np.ones(face.shape), outside)


def status(mesh, feet):
    start = np.array([[-LENGTH / 2, 1.0, 0.0]])
    step = np.array([[LENGTH, 0.0, 0.0]])
    return refusals(mesh, feet, start, start + step, step)[0]


def moved(feet, at, by):
    position = feet.position.copy()
    position[0, at] += by
    return replace(feet, position=position)


def test_a_right_stroke_passes():
    assert status(*sheet()) == Status.DRAWN


def test_a_stroke_torn_by_three_millimetres_is_refused():
    mesh, feet = sheet()
    assert status(mesh, moved(feet, slice(100, 150), [0.0, 3.0, 0.0])) == Status.TORN


def test_a_chart_that_is_wide_there_may_take_wide_steps():
    mesh, feet = sheet(60)
    wide = replace(feet, position=feet.position * [1.0, 3.5, 1.0] + [0.0, -2.5, 0.0])
    wide.position[..., 0] = 3.5 * (wide.position[..., 0] + LENGTH / 2) - LENGTH / 2
    # Only the tear is looked at: its end is not the goal's.
    assert status(mesh, wide) == Status.TORN
    assert status(mesh, replace(wide, stretch=np.full(feet.face.shape, 3.5))) != Status.TORN


@pytest.mark.parametrize("at", [0, -1])
def test_a_stroke_that_misses_its_end_by_more_than_a_hundredth_is_refused(at):
    mesh, feet = sheet()
    assert status(mesh, moved(feet, at, [0.009, 0.0, 0.0])) == Status.DRAWN
    assert status(mesh, moved(feet, at, [0.011, 0.0, 0.0])) == Status.MISSED


def test_a_point_off_its_facet_is_refused():
    mesh, feet = sheet()
    assert status(mesh, moved(feet, 70, [0.0, 0.0, 0.01])) == Status.LOST


def test_what_comes_after_the_border_is_not_looked_at():
    mesh, feet = sheet()
    wrong = moved(feet, slice(150, None), [0.0, 9.0, 4.0])
    assert status(mesh, wrong) != Status.DRAWN
    outside = feet.outside.copy()
    outside[0, 150] = True
    assert status(mesh, replace(wrong, outside=outside)) == Status.DRAWN


def cone(half_angle, sides=40, size=60.0):
    """Return a cone about z whose facets lean by 90° less `half_angle`, degrees, off its axis."""
    turn = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
    depth = size / np.tan(np.radians(half_angle))
    rim = np.stack([size * np.cos(turn), size * np.sin(turn), np.full(sides, -depth)], axis=1)
    k = np.arange(sides)
    F = np.stack([np.zeros(sides, dtype=int), 1 + k, 1 + (k + 1) % sides], axis=1)
    return Mesh(np.vstack([[[0.0, 0.0, 0.0]], rim]), F)


def test_normals_at_the_tip_of_a_cone_are_those_of_its_facets():
    for mesh in (cone(80.0), cone(50.0)):
        lean = np.sum(mesh.shape.corner_normals * mesh.face_normals[:, None], axis=-1)
        assert lean.min() >= np.cos(np.radians(11.0))
    np.testing.assert_allclose(mesh.shape.corner_normals[:, 0], mesh.face_normals, atol=1e-12)
    # Facets so coarse that the tip could be a rounded one.
    coarse = cone(50.0, 12)
    lean = np.degrees(
        np.arccos(np.sum(coarse.shape.corner_normals * coarse.face_normals[:, None], -1))
    )
    assert lean.max() == pytest.approx(14.9)


def test_a_normal_that_leans_off_its_facet_is_refused():
    mesh, feet = sheet()
    for degrees, right in ((24.0, Status.DRAWN), (26.0, Status.TILTED)):
        a = np.radians(degrees)
        normal = feet.normal.copy()
        normal[0, 90] = [np.sin(a), 0.0, np.cos(a)]
        assert status(mesh, replace(feet, normal=normal)) == right


def test_a_line_shorter_than_its_chord_is_found_out():
    mesh = folded(0.0)
    start, goal = np.array([[[-20.0, 0.0, 0.0]], [[20.0, 0.0, 0.0]]])
    for length, short in ((40.0, False), (39.995, False), (39.98, True)):
        found = last_check.shorter_than_chord(mesh, start, goal, np.array([length]))
        assert found[0] == short


def test_waves_round_the_corner_of_a_box_are_whole_or_refused():
    V, F = box()
    mesh = Mesh(5.0 * V, F)  # a corner at (75, 50, 25)
    y = np.linspace(20.0, 48.0, 9)
    start, goal = (np.stack([x + 0 * y, y, z + 0 * y], 1) for x, z in ((40.0, 25.0), (75.0, 0.0)))
    charts = mesh.charts(start, goal, np.array([0.0, 0.0, 1.0]))
    coordinates = fields.strokes(charts.lengths, 300, height=40.0)
    lift = charts.lift(coordinates)
    assert (lift.status == Status.TORN).any()
    drawn = lift.status == Status.DRAWN
    move = np.linalg.norm(np.diff(lift.position[drawn], axis=1), axis=-1)
    flat = np.linalg.norm(np.diff(coordinates[drawn], axis=1), axis=-1)
    assert (move <= 3.0 * flat + 0.3).all()


@pytest.mark.slow
@pytest.mark.parametrize(("name", "reach"), [("angle_block", 25.0), ("carriage", 18.0)])
def test_strokes_anywhere_on_machined_parts_are_drawn_right_or_refused(name, reach):
    mesh, rng = part(name), np.random.default_rng(0)
    edges = mesh.corners[:, 1:] - mesh.corners[:, :1]
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    face = rng.choice(len(area), 60, p=area / area.sum())
    start = np.einsum("ni,nij->nj", rng.dirichlet([1, 1, 1], 60), mesh.corners[face])
    normal = mesh.face_normals[face]
    heading = np.cross(normal, rng.normal(size=(60, 3)))
    end = straightest_geodesics.walk(mesh, start, heading, np.full(60, reach))
    assert end.arrived.all()
    charts = mesh.charts(start, end.position, normal)
    coordinates = fields.strokes(charts.lengths, 300, height=5.0)
    lift = charts.lift(coordinates)
    drawn = lift.status == Status.DRAWN
    assert drawn.mean() >= 0.85
    position, target = lift.position[drawn], end.position[drawn]
    assert np.linalg.norm(position[:, -1] - target, axis=1).max() <= 0.01
    assert (charts.lengths[drawn] >= np.linalg.norm(target - start[drawn], axis=1) - 0.01).all()
    hits = mesh.closest(position)
    assert hits.distance.max() <= 1e-6
    move = np.linalg.norm(np.diff(position, axis=1), axis=-1)
    flat = np.linalg.norm(np.diff(coordinates[drawn], axis=1), axis=-1)
    assert (move <= 3.0 * flat + 0.3).all()
    lean = np.abs(np.sum(mesh.face_normals[hits.face] * lift.normal[drawn], axis=-1))
    # Right on an edge the nearest facet may be the other one.
    assert np.mean(lean >= np.cos(np.radians(25.0))) >= 0.999


@pytest.mark.parametrize("at", [29, 30])
def test_of_two_samples_the_one_where_the_chart_is_wider_counts(at):
    """A step of 3.5 mm for 1 mm of the chart, which is four times as wide on one side of it."""
    _, feet = sheet(60)
    step = np.ones((1, 60, 1)) * np.arange(60.0)[None, :, None]
    coordinates = step * [1.0, 0.0, 0.0]
    position = coordinates + [-30.0, 0.0, 0.0]
    position[0, 30:, 0] += 3.5
    stretch = np.ones((1, 60))
    one = replace(feet, coordinates=coordinates, position=position, stretch=stretch)
    assert np.flatnonzero(last_check._jumps(one)[0]).tolist() == [29]
    stretch[0, at] = -4.0
    assert not last_check._jumps(one).any()
    stretch[0, at], stretch[0, 0], stretch[0, -1] = 1.0, 9.0, 9.0
    assert last_check._jumps(one).sum() == 1


def test_both_points_beside_a_tear_are_unsound_and_what_leans_beyond_the_border_is_not():
    mesh, feet = sheet(60)
    torn = moved(feet, slice(30, None), [0.0, 20.0, 0.0])
    assert np.flatnonzero(last_check.unsound(mesh, torn)[0]).tolist() == [29, 30]
    off = moved(feet, 7, [0.0, 0.0, 0.002])
    assert np.flatnonzero(last_check.unsound(mesh, off)[0]).tolist() == [7]
    assert not last_check.unsound(mesh, moved(feet, 7, [0.0, 0.0, 0.0005])).any()
    normal = feet.normal.copy()
    normal[0, 9:12] = [0.6, 0.0, 0.8]
    outside = feet.outside.copy()
    outside[0, 10] = True
    leaning = replace(feet, normal=normal, outside=outside)
    assert np.flatnonzero(last_check.unsound(mesh, leaning)[0]).tolist() == [9, 11]


@pytest.mark.parametrize(("off", "right"), [(0.5, Status.DRAWN), (0.0, Status.MISSED)])
def test_a_stroke_that_begins_beside_its_start_need_not_meet_it(off, right):
    mesh, feet = sheet()
    coordinates = feet.coordinates.copy()
    coordinates[0, 0, 0] += off
    beside = replace(moved(feet, 0, [0.02, 0.0, 0.0]), coordinates=coordinates)
    assert status(mesh, beside) == right
