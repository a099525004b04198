"""Meshes: closest points, smooth normals, borders, resolution, and what is next to what."""

import numpy as np
import pytest

from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.sphere import Sphere
from dmpcli.surfaces.surface import Status
from tests.surfaces import fields


def folded(degrees, half=60.0, cells=12):
    """Two flat halves that meet at an angle along y, x running over the fold."""
    a = np.radians(degrees)

    def point(x, y):
        over = np.maximum(x, 0.0)
        return np.stack([np.minimum(x, 0.0) + over * np.cos(a), y, -over * np.sin(a)], axis=-1)

    return Mesh(*fields.grid(point, cells + 1, cells + 1, (-half, half), (-half, half)))


def brute_force_distance(mesh, points, samples=60):
    """Distances to a dense cloud of points of the mesh: an upper bound that is nearly met."""
    a, b = np.meshgrid(np.linspace(0, 1, samples), np.linspace(0, 1, samples))
    inside = a + b <= 1.0
    w = np.stack([1 - a[inside] - b[inside], a[inside], b[inside]], axis=1)
    cloud = (w @ mesh.corners).reshape(-1, 3)
    return np.array([np.linalg.norm(cloud - p, axis=1).min() for p in points])


@pytest.mark.slow
def test_closest_points_are_those_of_a_dense_cloud():
    mesh = Mesh(*fields.square(fields.bumpy(), 200, reach=20.0))
    points = np.random.default_rng(0).normal(size=(30, 3)) * 15
    hits = mesh.closest(points)
    np.testing.assert_allclose(hits.distance, np.linalg.norm(points - hits.position, axis=1))
    cloud = brute_force_distance(mesh, points)
    assert (hits.distance <= cloud + 1e-12).all()
    np.testing.assert_allclose(hits.distance, cloud, atol=0.05)


def test_smooth_normals_approach_those_of_the_surface():
    field = fields.saddle()
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-60, 60, (2, 500))
    worst = []
    for faces in (2_000, 32_000):
        normal = Mesh(*fields.square(field, faces)).closest(field.point(x, y)).normal
        worst.append(
            np.degrees(np.arccos(np.clip(np.sum(normal * field.normal(x, y), -1), -1, 1))).max()
        )
    assert worst[0] < 1.0
    assert worst[1] < worst[0] / 3


def test_normals_are_not_smoothed_across_creases():
    mesh = folded(60.0)
    hits = mesh.closest(np.array([[-3.0, 1.0, 0.0], [-1e-3, 1.0, 0.0], [2.0, 1.0, -3.4]]))
    np.testing.assert_allclose(hits.normal[:2], [[0, 0, 1]] * 2, atol=1e-12)
    np.testing.assert_allclose(hits.normal[2], [np.sin(np.pi / 3), 0, 0.5], atol=1e-12)


@pytest.mark.slow
def test_the_chordal_estimate_bounds_the_distance_to_the_true_surface():
    for field in (fields.saddle(), fields.bumpy()):
        for faces in (2_000, 20_000):
            mesh = Mesh(*fields.square(field, faces))
            middles = 0.5 * (mesh.corners + np.roll(mesh.corners, -1, axis=1))
            true = field.distance(middles).max()
            assert 0.9 * true <= mesh.shape.heights.max() <= 1.5 * true


def test_topology_of_a_strip_of_four_faces_and_one_apart():
    V = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 2, 0], [1, 2, 0]], dtype=float)
    V = np.concatenate([V, V[:3] + 9])
    F = np.array([[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4], [6, 7, 8]])
    mesh = Mesh(V, F)
    top = mesh.topology
    np.testing.assert_array_equal(
        top.neighbours[:4], [[-1, 1, -1], [-1, 2, 0], [1, 3, -1], [-1, -1, 2]]
    )
    assert top.border.sum() == 9
    assert top.border_vertices.all()
    assert len(set(mesh.components[:4])) == 1
    assert mesh.components[4] != mesh.components[0]
    three = Mesh(
        np.concatenate([V[:4], [[0.5, 0.5, 1.0]]]), np.array([[0, 1, 2], [1, 3, 2], [1, 2, 4]])
    )
    assert (three.topology.neighbours == -2).sum() == 3


def test_points_beside_the_border_are_told_from_points_over_the_mesh():
    mesh = Mesh(*fields.grid(lambda x, y: np.stack([x, y, 0 * x], -1), 5, 5, (0, 40), (0, 40)))
    points = np.array(
        [[20, 20, 5], [0.0, 20, 3], [-0.005, 20, 0], [-0.1, 20, 0], [-1, -1, 0], [41, 7, 2.0]]
    )
    found, face = mesh.search(points)
    np.testing.assert_array_equal(
        mesh.beyond_border(points, found, face), [False, False, False, True, True, True]
    )


def test_walks_and_connections_follow_the_true_geodesics():
    field = fields.bumpy()
    mesh = Mesh(*fields.square(field, 20_000))
    heading = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    xy = np.random.default_rng(2).uniform(-10, 10, (12, 2))
    t = field.tangent(xy, heading)
    origin = field.point(*xy.T)
    end, _ = field.walk(xy, t, np.full(12, 60.0))
    goal = field.point(*end.T)
    walked = mesh.walk(origin, t, np.full(12, 60.0))
    assert walked.arrived.all()
    np.testing.assert_allclose(walked.position, goal, atol=0.1)
    backwards = mesh.walk(origin, -t, np.full(12, -60.0))
    np.testing.assert_allclose(backwards.position, walked.position, atol=1e-6)
    np.testing.assert_allclose(backwards.direction, -walked.direction, atol=1e-6)
    link = mesh.connect(origin, goal)
    assert (link.status == Status.DRAWN).all()
    np.testing.assert_allclose(link.length, 60.0, atol=0.03)
    again = mesh.walk(origin, link.direction, link.length)
    np.testing.assert_allclose(again.position, mesh.closest(goal).position, atol=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("degrees", [60.0, 90.0])
def test_walks_cross_folds_as_on_the_flat_sheet(degrees):
    mesh = folded(degrees)
    origin = np.array([[-20.0, 3.0, 0.0]])
    walked = mesh.walk(origin, np.array([[0.8, 0.6, 0.0]]), np.array([50.0]))
    a = np.radians(degrees)
    np.testing.assert_allclose(
        walked.position, [[20 * np.cos(a), 33.0, -20 * np.sin(a)]], atol=1e-9
    )
    np.testing.assert_allclose(
        walked.direction, [[0.8 * np.cos(a), 0.6, -0.8 * np.sin(a)]], atol=1e-9
    )
    link = mesh.connect(origin, walked.position)
    np.testing.assert_allclose(link.length, 50.0, atol=1e-6)
    assert not mesh.walk(origin, np.array([[0.0, 1.0, 0.0]]), np.array([80.0])).arrived[0]


def test_a_closed_sphere_is_walked_round():
    import igl

    V, F = igl.icosahedron()
    for _ in range(4):
        V, F = igl.upsample(V, F)
        V = V / np.linalg.norm(V, axis=1, keepdims=True)
    mesh, ball = Mesh(V * 50, F), Sphere(np.zeros(3), 50.0)
    assert not mesh.topology.border.any()
    at = mesh.closest(np.array([[50.0, 3.0, 7.0]]))
    t = np.cross(at.normal, [[0.1, 0.2, 0.9]])
    walked = mesh.walk(at.position, t, np.array([2 * np.pi * 50.0]))
    assert walked.arrived.all()
    np.testing.assert_allclose(walked.position, at.position, atol=0.3)
    half = mesh.walk(at.position, t, np.array([np.pi * 25.0]))
    true = ball.walk(ball.closest(at.position).position, t, np.array([np.pi * 25.0]))
    np.testing.assert_allclose(half.position, true.position, atol=0.1)
