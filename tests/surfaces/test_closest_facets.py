"""Closest points by the trees of cells are those of all facets, one by one."""

import igl
import numpy as np
import pytest
import trimesh

from dmpcli.surfaces import closest_facets
from dmpcli.surfaces.closest_facets import ClosestFacets
from tests.records.meshes import grid
from tests.surfaces import zoo


def points_about(V, F, seed, far):
    rng = np.random.default_rng(seed)
    at = V[F[rng.integers(0, len(F), 600)]]
    share = rng.dirichlet(np.ones(3), len(at))[..., None]
    away = rng.normal(size=(len(at), 3)) * far * rng.choice([1e-3, 0.05, 1.0], (len(at), 1))
    return (share * at).sum(axis=1) + away


def sheet():
    return grid(n=61, half=50.0, height=lambda x, y: 6.0 * np.sin(x / 9.0) * np.cos(y / 11.0))


def turned_sheet():
    V, F = sheet()
    return V @ trimesh.transformations.euler_matrix(0.4, 0.9, -0.3)[:3, :3].T, F


def ball():
    made = trimesh.creation.icosphere(subdivisions=4, radius=30.0)
    return np.array(made.vertices), np.array(made.faces)


def flat():
    return grid(n=41, half=20.0, height=lambda x, y: 0.0 * x)


MESHES = {"sheet": sheet, "turned": turned_sheet, "ball": ball, "flat": flat}


@pytest.fixture
def small_cells(monkeypatch):
    monkeypatch.setattr(closest_facets, "_WHOLE", 50)
    monkeypatch.setattr(closest_facets, "_IN_A_CELL", 60)


def check(V, F, points):
    position, face = ClosestFacets(V, F).search(points)
    squared, _, _ = igl.point_mesh_squared_distance(points, V, F)
    assert np.linalg.norm(points - position, axis=1) == pytest.approx(np.sqrt(squared), abs=1e-9)
    own, _, foot = igl.point_mesh_squared_distance(position[:1], V, F[face[:1]])
    assert own[0] < 1e-18
    assert foot[0] == pytest.approx(position[0], abs=1e-9)
    return position, face


@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize("far", [0.01, 3.0, 200.0])
def test_no_facet_is_nearer_however_far_the_points(name, far, small_cells):
    V, F = MESHES[name]()
    check(V, F, points_about(V, F, 1, far))


@pytest.mark.slow
@pytest.mark.parametrize("name", zoo.PARTS)
def test_so_it_is_on_parts_with_long_facets(name, small_cells):
    mesh = zoo.mesh(name)
    check(mesh.V, mesh.F, points_about(mesh.V, mesh.F, 2, 5.0))


def test_the_answer_to_a_point_is_its_own_whatever_is_asked_beside_it_or_was_before(small_cells):
    V, F = sheet()
    points = np.concatenate([points_about(V, F, 3, 2.0), V[::7], V[F[::11, :2]].mean(axis=1)])
    together = ClosestFacets(V, F).search(points)
    backwards = ClosestFacets(V, F)
    for i in range(len(points) - 1, -1, -1):
        position, face = backwards.search(points[i : i + 1])
        assert face[0] == together[1][i]
        assert position[0].tobytes() == together[0][i].tobytes()


def test_only_the_cells_that_points_lie_in_get_trees(small_cells):
    V, F = sheet()
    facets = ClosestFacets(V, F)
    facets.search(V[:3] + 1e-4)
    assert len(facets._trees) == 1
    assert "_whole" not in vars(facets)
    facets.search(V[:1] + [0.0, 0.0, 90.0])
    assert "_whole" in vars(facets)


def test_no_points_and_points_that_are_no_numbers_are_borne(small_cells):
    V, F = sheet()
    facets = ClosestFacets(V, F)
    position, face = facets.search(np.empty((0, 3)))
    assert position.shape == (0, 3)
    assert face.shape == (0,)
    some = np.array([[np.nan, 0.0, 0.0], [1.0, 2.0, 0.3], [1e300, 0.0, 0.0]])
    _, face = facets.search(some)
    assert face[1] == facets.search(some[1:2])[1][0]
