"""Closest points are the same however often, and by whatever means, they were asked before."""

import numpy as np
import pytest

from dmpcli import extras
from dmpcli.surfaces.mesh import Mesh
from tests.extras_here import needs
from tests.surfaces import cases, zoo


def fresh(mesh):
    return Mesh(mesh.V, mesh.F)


def test_what_is_remembered_is_not_what_a_caller_made_of_it():
    mesh = cases.mesh("bumpy", 5000)
    points = mesh.V[100:103] + 0.4
    first = mesh.closest(points)
    kept = first.position.copy()
    first.position[:], first.normal[:], first.face[:] = 0.0, 0.0, 0
    again = mesh.closest(points)
    np.testing.assert_array_equal(again.position, kept)
    assert (again.face != 0).all()


def test_few_points_are_where_they_are_among_many():
    mesh = cases.mesh("bumpy", 5000)
    points = mesh.V[::50] + 0.3
    many = fresh(mesh).closest(points)
    for _ in range(2):
        for row in range(0, len(points), 7):
            one = mesh.closest(points[row])
            np.testing.assert_array_equal(one.position, many.position[row])
            np.testing.assert_array_equal(one.normal, many.normal[row])
            assert one.face == many.face[row]


@needs(extras.FAST)
@pytest.mark.thorough
def test_kernels_do_not_answer_with_what_numpy_found_before():
    mesh = zoo.mesh("ribbed")
    points = mesh.corners.mean(axis=1)[:6] + 0.1
    mesh.closest(points)
    after, alone = mesh.with_kernels.closest(points), fresh(mesh).with_kernels.closest(points)
    np.testing.assert_array_equal(after.position, alone.position)
    np.testing.assert_array_equal(after.normal, alone.normal)


@needs(extras.FAST)
@pytest.mark.thorough
def test_kernels_find_the_points_that_the_library_finds_and_take_what_is_no_number():
    rng = np.random.default_rng(3)
    for name in ("drilled", "united", "ribbed"):
        mesh = fresh(zoo.mesh(name))
        near = mesh.corners.mean(axis=1)[rng.integers(0, len(mesh.F), 400)]
        points = near + rng.normal(0.0, 2.0, near.shape)
        found, face = mesh.with_kernels.search(points)
        expected, _ = mesh.search(points)
        off = [np.linalg.norm(points - one, axis=1) for one in (found, expected)]
        np.testing.assert_allclose(off[0], off[1], atol=1e-12)
        plane = mesh.planes_at(face)
        height = np.sum(plane[:, :3] * found, axis=1) - plane[:, 3]
        assert np.abs(height).max() < 1e-9
        np.testing.assert_array_equal(mesh.with_kernels.planes_at(face), plane)
        points[3] = np.nan
        mesh.with_kernels.search(points)
