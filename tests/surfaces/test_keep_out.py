"""Regions within closed lines: against a polygon test that is not ours, and closed forms."""

import pickle

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.path import Path
from scipy.spatial import Delaunay

from dmpcli.errors import InputError
from dmpcli.surfaces.cylinder import Cylinder
from dmpcli.surfaces.keep_out import enclosed
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.plane import Plane
from dmpcli.surfaces.sphere import Sphere
from tests.surfaces import fields

PLANE = Plane(np.array([0.0, 0.0, 5.0]), np.array([0.0, 0.0, 1.0]))
ARROW = np.array([[20, -10], [60, -20], [70, 30], [45, 5], [25, 35]], dtype=float)
RADIUS = 40.0
CYLINDER = Cylinder(np.array([1.0, 2.0, 3.0]), np.array([0.0, 1.0, 0.0]), RADIUS)


def flat(xy):
    return np.column_stack([xy, np.full(len(xy), 5.0)])


def rolled(xy, turn=0.0):
    """Points of the cylinder: x around from an angle, y along."""
    a = xy[..., 0] / RADIUS + turn
    local = np.stack([RADIUS * np.sin(a), xy[..., 1], RADIUS * np.cos(a)], axis=-1)
    return CYLINDER.point + local


def mesh_of(made):
    return Mesh(np.array(made.vertices, dtype=float), np.array(made.faces))


def alone(region, points):
    """Whether each point is in a region, as strokes of one sample each."""
    return region.holds(points[:, None])[:, 0]


def scattered(low, high, count=4000):
    return np.random.default_rng(4).uniform(low, high, (count, 2))


polygons = st.lists(
    st.tuples(st.floats(0.0, 2 * np.pi), st.floats(5.0, 45.0)), min_size=3, max_size=14
).map(lambda corners: np.array([[r * np.cos(a), r * np.sin(a)] for a, r in sorted(corners)]))


@settings(max_examples=30, deadline=None)
@given(polygons, st.floats(-4.0, 4.0))
def test_polygons_on_planes_and_cylinders_hold_what_matplotlib_says(polygon, turn):
    points = scattered(-50.0, 50.0, 600)
    sure = ~Path(polygon).contains_points(points, radius=1e-6)
    sure = sure == ~Path(polygon).contains_points(points, radius=-1e-6)
    want = Path(polygon).contains_points(points)[sure]
    got = alone(enclosed(PLANE, flat(polygon)), flat(points))[sure]
    np.testing.assert_array_equal(got, want)
    got = alone(enclosed(CYLINDER, rolled(polygon, turn)), rolled(points, turn))[sure]
    np.testing.assert_array_equal(got, want)


def circle_on(radius, angle, count=90):
    a = np.linspace(0.0, 2 * np.pi, count, endpoint=False)
    s, c = np.sin(angle), np.cos(angle)
    return radius * np.stack([s * np.cos(a), s * np.sin(a), c + 0 * a], axis=-1)


@pytest.mark.parametrize("angle", [0.1, 0.7, 1.3])
def test_on_a_sphere_exact_or_meshed_a_circle_of_latitude_holds_its_cap(angle):
    Q = np.random.default_rng(5).normal(size=(3000, 3))
    Q *= 50.0 / np.linalg.norm(Q, axis=1)[:, None]
    apart = np.arccos(np.clip(Q[:, 2] / 50.0, -1, 1))
    sure = np.abs(apart - angle) > 0.01
    for surface in (Sphere(np.zeros(3), 50.0), mesh_of(trimesh.creation.icosphere(4, 50.0))):
        got = alone(enclosed(surface, circle_on(50.0, angle)), Q)
        np.testing.assert_array_equal(got[sure], (apart < angle)[sure])


def test_within_two_facets_and_around_the_corner_of_a_box():
    box = mesh_of(trimesh.creation.box((100, 80, 30)))
    square = np.array([[-40, -30], [40, -30], [40, 30], [-40, 30]], dtype=float)
    region = enclosed(box, np.column_stack([square, np.full(4, 15.0)]))
    points = scattered([-49, -39], [49, 39])
    top = np.column_stack([points, np.full(len(points), 15.0)])
    np.testing.assert_array_equal(region.inside(top), Path(square).contains_points(points))
    assert not region.inside(top - [0.0, 0.0, 30.0]).any()
    # Around a corner: 10 mm from it along the three edges.
    corner = enclosed(box, np.array([[40.0, 40, 15], [50, 30, 15], [50, 40, 5]]))
    near = np.array([[48.0, 38.0, 15.0], [50.0, 38.0, 13.0], [48.0, 40.0, 13.0]])
    far = np.array([[42.0, 32.0, 15.0], [50.0, 32.0, 7.0], [-48.0, -38.0, 15.0]])
    assert corner.inside(near).all()
    assert not corner.inside(far).any()


def test_the_inside_of_a_large_line_is_where_the_border_is_not():
    plate = Mesh(*fields.grid(lambda x, y: np.stack([x, y, 0 * x], -1), 30, 30, (0, 90), (0, 90)))
    line = np.array([[5.0, 5, 0], [85, 5, 0], [85, 85, 0], [5, 85, 0]])
    region = enclosed(plate, line)
    assert region.inside(np.array([[45.0, 45.0, 0.0], [2.0, 45.0, 0.0]])).tolist() == [True, False]


@pytest.mark.parametrize("kind", ["plane", "cylinder", "mesh"])
def test_a_step_that_crosses_a_narrow_region_is_marked_at_its_end(kind):
    sliver = np.array([[0.0, -5.0], [0.8, -5.0], [0.8, 5.0], [0.0, 5.0]])
    path = np.stack([np.linspace(-10, 10, 6), np.zeros(6)], axis=-1)
    put = rolled if kind == "cylinder" else flat
    surface = {"plane": PLANE, "cylinder": CYLINDER}.get(kind)
    if surface is None:
        surface = Mesh(*fields.grid(lambda x, y: np.stack([x, y, 0 * x + 5], -1), 9, 9,
                                    (-20, 20), (-20, 20)))  # fmt: skip
    region = pickle.loads(pickle.dumps(enclosed(surface, put(sliver))))
    assert region.holds(put(path)[None])[0].tolist() == [False, False, False, True, False, False]
    aside = put(path + [0.0, 6.0])
    assert not region.holds(aside[None]).any()


def test_lines_without_an_inside_are_refused():
    around = rolled(np.stack([np.linspace(0, 2 * np.pi * RADIUS, 40)[:-1], np.zeros(39)], -1))
    with pytest.raises(InputError, match="goes around the cylinder"):
        enclosed(CYLINDER, around)
    with pytest.raises(InputError, match="half of the sphere"):
        enclosed(Sphere(np.zeros(3), 50.0), circle_on(50.0, np.pi / 2))
    torus = mesh_of(trimesh.creation.torus(40.0, 10.0))
    a = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    loop = np.stack([50 * np.cos(a), 50 * np.sin(a), 0 * a], axis=-1)
    with pytest.raises(InputError, match="does not part the mesh in two"):
        enclosed(torus, loop)
    plate = Mesh(*fields.grid(lambda x, y: np.stack([x, y, 0 * x], -1), 9, 9, (0, 9), (0, 9)))
    far = np.array([[1.0, 1.0, 0.0], [8.0, 1.0, 0.0], [8.0, 8.0, 0.0]])
    hole = Mesh(plate.V, plate.F[np.linalg.norm(plate.V[plate.F].mean(1) - [5, 1, 0], axis=1) > 2])
    with pytest.raises(InputError, match="leaves the mesh between its points 1 and 2"):
        enclosed(hole, far)


def test_around_a_hole_with_a_fine_rim_the_hole_s_side_is_the_inside():
    """The border is weighed by its length, not by how many edges it has."""
    a = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    ring = np.column_stack([np.cos(a), np.sin(a)])
    corners = np.array([[-40, -40], [40, -40], [40, 40], [-40, 40]], dtype=float)
    flat_ = np.concatenate([4.0 * ring, 12.0 * ring[::4], 25.0 * ring[::6], corners])
    F = Delaunay(flat_).simplices
    F = F[np.linalg.norm(flat_[F].mean(axis=1), axis=1) > 4.0]
    u, v = flat_[F[:, 1]] - flat_[F[:, 0]], flat_[F[:, 2]] - flat_[F[:, 0]]
    turn = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    F = np.where(turn[:, None] > 0.0, F, F[:, ::-1])
    for shift in ([0.0, 0, 0], [900.0, 400, -300]):
        mesh = Mesh(np.column_stack([flat_, 0 * flat_[:, 0]]) + shift, F)
        region = enclosed(mesh, np.column_stack([18.0 * ring[::3], 0 * a[::3]]) + shift)
        points = np.array([[8.0, 3, 0], [-16.0, 0, 0], [20.0, 0, 0], [35.0, 35, 0]]) + shift
        assert region.inside(points).tolist() == [True, True, False, False]
