import numpy as np
import pytest

from dmpcli.simulation.elite_server.workpiece import facing
from dmpcli.simulation.mock.contact import contact
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.plane import Plane
from dmpcli.surfaces.sphere import Sphere

DOWN = np.array([0.0, 0.0, -1.0])
STILL = np.zeros(6)


def square(size: float = 100.0) -> Mesh:
    V = np.array([[0, 0, 0], [size, 0, 0], [size, size, 0], [0, size, 0]], dtype=float)
    return Mesh(V, np.array([[0, 1, 2], [0, 2, 3]]))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_side_is_the_tools_whatever_the_planes_own(sign):
    part = facing(Plane(np.zeros(3), np.array([0.0, 0.0, sign])), np.array([5.0, 5.0, 1.0]), DOWN)
    depth, normal = part.under(np.array([5.0, 5.0, -0.5]))
    assert depth == pytest.approx(0.5)
    np.testing.assert_allclose(normal, [0.0, 0.0, 1.0])
    assert part.under(np.array([5.0, 5.0, 0.5]))[0] == pytest.approx(-0.5)


def test_a_plate_made_of_triangles_pushes_like_a_spring():
    part = facing(square(), np.array([30.0, 40.0, 0.0]), DOWN)
    force = contact(part, np.array([30.0, 40.0, -0.8]), STILL)
    np.testing.assert_allclose(force, [0.0, 0.0, 5.0 * 0.8, 0.0, 0.0, 0.0], atol=1e-9)
    np.testing.assert_array_equal(contact(part, np.array([30.0, 40.0, 0.8]), STILL), 0.0)


def test_beside_a_plate_there_is_nothing_to_touch():
    part = facing(square(), np.array([30.0, 40.0, 0.0]), DOWN)
    np.testing.assert_array_equal(contact(part, np.array([-5.0, 40.0, -0.8]), STILL), 0.0)


def test_far_below_a_plate_there_is_nothing_to_touch():
    part = facing(square(), np.array([30.0, 40.0, 0.0]), DOWN)
    np.testing.assert_array_equal(contact(part, np.array([30.0, 40.0, -40.0]), STILL), 0.0)


def test_a_ball_pushes_along_its_radius():
    part = facing(Sphere(np.zeros(3), 50.0), np.array([0.0, 0.0, 50.0]), DOWN)
    radius = np.array([0.6, 0.0, 0.8])
    force = contact(part, 49.0 * radius, STILL)
    np.testing.assert_allclose(force[:3], 5.0 * radius, atol=1e-9)
