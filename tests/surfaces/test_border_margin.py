"""The margin to a border is measured along the surface: against closed forms."""

import pickle

import numpy as np
import pytest
import trimesh

from dmpcli.surfaces.border_margin import BorderMargin
from dmpcli.surfaces.mesh import Mesh
from tests.surfaces import fields

MARGIN = 12.0


def held(mesh, points, margin=MARGIN):
    return BorderMargin(mesh, margin).holds(points[None], np.ones((1, len(points)), bool))[0]


def agree(found, distance, room, margin=MARGIN):
    """Whether all is as the true distances say, but for those within `room` of the margin."""
    clear = np.abs(distance - margin) > room
    return np.array_equal(found[clear], (distance < margin)[clear])


def test_on_a_coarse_plate_it_is_the_distance_to_the_nearest_edge():
    V = np.array([[0.0, 0, 0], [100, 0, 0], [100, 60, 0], [0, 60, 0]])
    mesh = Mesh(V, np.array([[0, 1, 2], [0, 2, 3]]))
    x, y = np.random.default_rng(1).uniform([0.5, 0.5], [99.5, 59.5], (800, 2)).T
    points = np.stack([x, y, 0 * x], axis=-1)
    distance = np.minimum(np.minimum(x, 100 - x), np.minimum(y, 60 - y))
    assert agree(held(mesh, points), distance, 1e-5)
    lifted = points + [0.0, 0.0, 7.0]
    np.testing.assert_array_equal(held(mesh, lifted), held(mesh, points))


@pytest.mark.parametrize("radius", [9.0, 15.0, 60.0])
def test_on_a_cylinder_it_goes_around_and_not_through_the_air(radius):
    reach = 24.0 / radius

    def cylinder(a, y):
        return np.stack([radius * np.sin(a), y, radius * np.cos(a)], axis=-1)

    mesh = Mesh(*fields.grid(cylinder, 161, 41, (-reach, reach), (-40, 40)))
    a, y = np.random.default_rng(2).uniform([-reach, -40], [reach, 40], (600, 2)).T * 0.999
    distance = np.minimum((reach - np.abs(a)) * radius, 40 - np.abs(y))
    assert agree(held(mesh, cylinder(a, y)), distance, 0.02)


def test_on_a_sphere_s_cap_it_is_the_arc_of_the_great_circle():
    rim, radius = 1.2, 30.0

    def cap(r, a):
        return radius * np.stack([np.sin(r) * np.cos(a), np.sin(r) * np.sin(a), np.cos(r)], -1)

    mesh = Mesh(*fields.grid(cap, 60, 241, (0.1, rim), (0.0, 1.9 * np.pi)))
    r, a = np.random.default_rng(3).uniform([0.5, 1.0], [rim, 4.9], (400, 2)).T
    distance = (rim - r) * radius
    assert agree(held(mesh, cap(r, a)), distance, 0.03)


def test_a_border_on_the_far_sheet_of_a_thin_wall_is_not_near():
    low, high = trimesh.creation.box((100, 100, 1)), None
    faces = low.faces[np.abs(low.face_normals[:, 2] + 1.0) > 1e-6]  # open below
    high = Mesh(np.array(low.vertices), np.array(faces))
    points = np.array([[0.0, 45.0, 0.5], [0.0, 49.5, 0.5], [0.0, 0.0, 0.5]])
    # The border is the lower rim: over the upper edge and down the wall of 1 mm.
    np.testing.assert_array_equal(held(high, points, 5.5), [False, True, False])
    np.testing.assert_array_equal(held(high, points, 6.5), [True, True, False])


def test_only_what_is_looked_at_is_told_and_a_closed_mesh_has_no_border():
    box = trimesh.creation.box((20, 20, 20))
    mesh = Mesh(np.array(box.vertices), np.array(box.faces))
    assert len(BorderMargin(mesh, 5.0).edges) == 0
    V = np.array([[0.0, 0, 0], [100, 0, 0], [100, 60, 0], [0, 60, 0]])
    plate = Mesh(V, np.array([[0, 1, 2], [0, 2, 3]]))
    points = np.array([[[1.0, 30.0, 0.0], [2.0, 30.0, 0.0]]])
    found = BorderMargin(plate, 5.0).holds(points, np.array([[True, False]]))
    assert found.tolist() == [[True, False]]


def test_a_border_is_found_beside_a_nearer_one_that_only_the_air_leads_to():
    """Two sheets that meet at a sharp fold: near one's own border the other sheet's is nearer."""
    a = np.radians(160.0)

    def point(s, y):
        over = np.maximum(s, 0.0)
        return np.stack([np.minimum(s, 0.0) + over * np.cos(a), y, -over * np.sin(a)], axis=-1)

    V, F = fields.grid(point, 31, 21, (-30.0, 30.0), (-20.0, 20.0))
    # The lower sheet ends 8 mm before the fold.
    low = V[F].mean(axis=1)[:, 2] < -10.5 * np.sin(a) * 0.8
    mesh = Mesh(V, F[~low])
    s = np.array([-8.0, -8.0, -8.0])
    y = np.array([17.0, 15.0, 0.0])
    found = held(mesh, np.stack([s, y, 0 * s], axis=-1), 4.0)
    assert found.tolist() == [True, False, False]
    through_air = np.linalg.norm(point(np.array([-8.0]), y[:1]) - mesh.V[np.unique(
        BorderMargin(mesh, 4.0).edges)], axis=1).min()  # fmt: skip
    assert through_air < 3.5


def test_a_margin_travels_to_other_processes_without_its_tree():
    V = np.array([[0.0, 0, 0], [100, 0, 0], [100, 60, 0], [0, 60, 0]])
    margin = BorderMargin(Mesh(V, np.array([[0, 1, 2], [0, 2, 3]])), 5.0)
    points, looked = np.array([[[4.0, 30, 0], [6.0, 30, 0]]]), np.ones((1, 2), dtype=bool)
    first = margin.holds(points, looked)
    again = pickle.loads(pickle.dumps(margin))
    assert again.margin == 5.0
    assert again.holds(points, looked).tolist() == first.tolist() == [[True, False]]
