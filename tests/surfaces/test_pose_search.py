"""Poses told apart, and signed distances, by hand."""

import numpy as np
import pytest

from dmpcli.spatial import rotations
from dmpcli.surfaces import pose_search


def test_poses_differ_where_one_point_lies_farther_off_and_not_where_all_are_a_little():
    points = np.random.default_rng(1).normal(size=(9, 3))
    poses = np.stack([points] * 4)
    poses[1] += [0.03, 0.03, 0.0]  # all by 0.042
    poses[2, 5, 2] += 0.051
    poses[3, 5, 1] -= 0.049
    assert pose_search._distinct(poses, np.array([0, 1, 2, 3])).tolist() == [0, 2]
    assert pose_search._distinct(poses, np.array([3, 2, 1, 0])).tolist() == [3, 2, 1]


def test_no_more_poses_are_kept_than_go_on():
    poses = np.arange(100.0)[:, None, None] * np.ones((100, 2, 3))
    order = np.random.default_rng(2).permutation(100)
    assert pose_search._distinct(poses, order).tolist() == order[:48].tolist()


def test_distances_are_signed_by_the_normals_and_their_gradients_are_unit_vectors():
    foot, normal = np.array([[1.0, 2.0, 3.0]]), np.array([[0.0, 0.0, 1.0]])

    def closest(points):
        return np.tile(foot, (len(points), 1)), np.tile(normal, (len(points), 1))

    off = np.array([[3.0, 0.0, 4.0], [3.0, 0.0, -4.0], [2.0, 0.0, 0.0], [1e-10, 0, 0], [0, 0, 0]])
    distance, gradient = pose_search.signed((foot + off).reshape(5, 1, 3), closest)
    assert distance.shape == (5, 1)
    np.testing.assert_allclose(distance[:, 0], [5.0, -5.0, 2.0, 0.0, 0.0], atol=1e-9)
    wanted = [[0.6, 0, 0.8], [-0.6, 0, 0.8], [1, 0, 0], [0, 0, 1], [0, 0, 1]]
    np.testing.assert_allclose(gradient[:, 0], wanted, atol=1e-9)


def test_starts_near_a_pose_turn_about_a_place_and_stay_within_their_bounds():
    R, t, about = rotations.exp(np.array([0.3, -0.2, 0.5])), np.array([9.0, 8.0, 7.0]), np.ones(3)
    found = pose_search.near(R, t, about, 60, 4.0, 0.3)
    np.testing.assert_array_equal(found.rotation[0], R)
    np.testing.assert_allclose(found.position[0], t, atol=1e-12)
    turn = np.linalg.norm(rotations.log(found.rotation @ R.T), axis=1)
    there = (about - t) @ R  # what lies at the place, in the part's frame
    shift = np.linalg.norm(found.rotation @ there + found.position - about, axis=1)
    assert turn.max() == pytest.approx(0.3, abs=0.03)
    assert turn.max() <= 0.3 + 1e-9
    assert shift.max() == pytest.approx(4.0, abs=0.4)
    assert shift.max() <= 4.0 + 1e-9
    assert len(found.rotation) == 60


def test_starts_anywhere_lay_one_point_on_another_in_orientations_all_around():
    centre, about = np.array([5.0, -3.0, 2.0]), np.array([100.0, 50.0, -20.0])
    found = pose_search.anywhere(centre, about, 500)
    np.testing.assert_allclose(found.rotation @ centre + found.position, np.tile(about, (500, 1)))
    assert np.abs(found.rotation.mean(axis=0)).max() < 0.02
    apart = np.linalg.norm(found.rotation[:, None] - found.rotation, axis=(2, 3))
    assert (apart + 9.0 * np.eye(500)).min() > 0.2


def test_up_to_a_millionth_of_a_micrometre_a_point_lies_on_the_surface():
    def closest(points):
        return np.zeros_like(points), np.tile([0.0, 0.0, 1.0], (len(points), 1))

    _, gradient = pose_search.signed(np.array([[1e-9, 0, 0], [1.1e-9, 0, 0]]), closest)
    assert gradient.tolist() == [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]
