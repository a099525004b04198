"""Poses are rigid motions: closed forms, scipy's, and the laws of a group."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import RigidTransform, Rotation

from dmpcli.spatial.pose import Pose

six = st.lists(st.floats(-3.0, 3.0), min_size=6, max_size=6).map(np.array)


def scipys(pose):
    return RigidTransform.from_components(pose.position, Rotation.from_matrix(pose.rotation))


def test_six_numbers_turn_about_x_then_the_turned_y_then_the_turned_z():
    pose = Pose.of(np.array([1.0, 2.0, 3.0, 0.1, -0.2, 0.6]))
    np.testing.assert_array_equal(pose.position, [1.0, 2.0, 3.0])
    expected = Rotation.from_euler("XYZ", [0.1, -0.2, 0.6]).as_matrix()
    np.testing.assert_allclose(pose.rotation, expected, atol=1e-15)


@pytest.mark.slow
@given(six, six)
def test_composition_and_inverse_are_scipys(a, b):
    one, other = Pose.of(100 * a), Pose.of(b)
    points = np.array([[1.0, 2.0, 3.0], [-4.0, 0.5, 9.0]])
    np.testing.assert_allclose(
        (one @ other).apply(points), (scipys(one) * scipys(other)).apply(points), atol=1e-10
    )
    np.testing.assert_allclose(
        one.inverse().apply(points), scipys(one).inv().apply(points), atol=1e-10
    )


@given(six)
def test_points_come_back(a):
    points = np.array([[1.0, 2.0, 3.0], [-4.0, 0.5, 9.0]])
    pose = Pose.of(a)
    np.testing.assert_allclose(pose.apply_inverse(pose.apply(points)), points, atol=1e-12)
    np.testing.assert_allclose((pose @ pose.inverse()).apply(points), points, atol=1e-12)


def test_many_poses_carry_points_as_each_of_them_does():
    rng = np.random.default_rng(5)
    singles = [Pose.of(rng.normal(size=6)) for _ in range(7)]
    many = Pose.joined(*[Pose(one.position[None], one.rotation[None]) for one in singles])
    points = rng.normal(size=(11, 3))
    assert len(many) == 7
    for i, one in enumerate(singles):
        np.testing.assert_allclose(many.apply(points)[i], one.apply(points), atol=1e-14)
        np.testing.assert_allclose(
            many.apply_inverse(points)[i], one.apply_inverse(points), atol=1e-14
        )
        pair = many[i] @ singles[0]
        assert (many @ many[:1])[i].position == pytest.approx(pair.position, abs=1e-13)
