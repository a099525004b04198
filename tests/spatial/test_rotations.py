"""Rotations against scipy's, and the continuity that files rely on."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from dmpcli.spatial import rotations

angle = st.floats(-np.pi, np.pi)
vector = st.tuples(*[st.floats(-3.0, 3.0)] * 3).map(np.array)


@given(st.tuples(angle, angle, angle))
def test_from_euler_is_the_intrinsic_x_y_z_sequence(angles):
    expected = Rotation.from_euler("XYZ", angles).as_matrix()
    np.testing.assert_allclose(rotations.from_euler(np.array(angles)), expected, atol=1e-14)


@given(st.tuples(angle, st.floats(-1.57, 1.57), angle))
def test_to_euler_inverts_from_euler(angles):
    R = rotations.from_euler(np.array(angles))
    np.testing.assert_allclose(rotations.from_euler(rotations.to_euler(R)), R, atol=1e-12)


@given(st.tuples(angle, st.floats(-1.57, 1.57), angle))
def test_one_rotation_has_the_angles_that_it_has_among_others(angles):
    R = rotations.from_euler(np.array(angles))
    np.testing.assert_allclose(rotations.to_euler_one(R), rotations.to_euler(R), atol=1e-13)


@pytest.mark.parametrize("rx", [np.pi, -np.pi, 0.3])
@pytest.mark.parametrize("ry", [np.pi / 2, -np.pi / 2, 0.0])
def test_so_it_has_at_the_singularity_and_where_a_pen_points_down(rx, ry):
    for noise in (1e-16, -1e-16, 0.0):
        R = rotations.from_euler(np.array([rx + noise, ry, -0.8]))
        np.testing.assert_allclose(rotations.to_euler_one(R), rotations.to_euler(R), atol=1e-13)


@pytest.mark.parametrize("ry", [np.pi / 2, -np.pi / 2])
def test_to_euler_gives_the_same_rotation_at_the_singularity(ry):
    R = rotations.from_euler(np.array([0.3, ry, -0.8]))
    np.testing.assert_allclose(rotations.from_euler(rotations.to_euler(R)), R, atol=1e-9)


@given(vector)
def test_exp_and_log_agree_with_scipy(v):
    R = Rotation.from_rotvec(v).as_matrix()
    np.testing.assert_allclose(rotations.exp(v), R, atol=1e-13)
    np.testing.assert_allclose(rotations.exp(rotations.log(R)), R, atol=1e-13)


def test_log_is_exact_for_half_turns_and_tiny_turns():
    half = rotations.from_euler(np.array([np.pi, 0.0, 0.0]))
    np.testing.assert_allclose(np.abs(rotations.log(half)), [np.pi, 0, 0], atol=1e-12)
    tiny = np.array([1e-9, -2e-9, 3e-9])
    np.testing.assert_allclose(rotations.log(rotations.exp(tiny)), tiny, rtol=1e-6)


@given(st.integers(0, 2**32 - 1))
def test_quaternions_agree_with_scipy(seed):
    R = Rotation.random(20, rng=seed)
    expected = R.as_quat(canonical=True)
    q = rotations.to_quaternion(R.as_matrix())
    sign = np.sign(np.sum(q * expected, axis=1, keepdims=True))
    np.testing.assert_allclose(q * sign, expected, atol=1e-13)
    np.testing.assert_allclose(rotations.from_quaternion(q), R.as_matrix(), atol=1e-13)


def test_a_pen_pointing_down_reads_plus_pi_whatever_the_rounding():
    for noise in (1e-16, -1e-16, 0.0):
        R = rotations.from_euler(np.array([np.pi + noise, 0.0, 0.0]))
        assert rotations.to_euler(R)[0] == pytest.approx(np.pi)


def test_continuous_angles_do_not_jump_where_the_pen_swings_through_straight_down():
    swing = 0.3 * np.sin(np.linspace(0, 20, 400))
    angles = np.stack([np.pi + swing, 0.1 * swing, 3.0 + swing], axis=1)
    found = rotations.to_euler_continuous(rotations.from_euler(angles))
    assert np.abs(np.diff(found, axis=0)).max() < 0.02
    np.testing.assert_allclose(found - found[0], angles - angles[0], atol=1e-12)


def test_continuous_angles_pass_the_singularity_at_ry_90_degrees():
    ry = np.linspace(1.2, 1.9, 200)  # through π/2, never on it
    angles = np.stack([np.full(200, 0.4), ry, np.full(200, -0.2)], axis=1)
    R = rotations.from_euler(angles)
    found = rotations.to_euler_continuous(R)
    assert np.abs(np.diff(found, axis=0)).max() < 0.01
    np.testing.assert_allclose(rotations.from_euler(found), R, atol=1e-12)


def test_interpolation_runs_along_the_shortest_arc_at_constant_rate():
    ends = rotations.from_euler(np.array([[np.pi, 0, 0], [np.pi, 0, 1.0]]))
    at = np.linspace(0, 2, 5)
    found = rotations.interpolate(np.array([0.0, 2.0]), ends, at)
    expected = Rotation.from_euler("XYZ", [[np.pi, 0, r] for r in at / 2]).as_matrix()
    np.testing.assert_allclose(found, expected, atol=1e-14)


@given(vector, vector)
def test_smallest_between_turns_a_onto_b_about_their_cross_product(a, b):
    if min(np.linalg.norm(a), np.linalg.norm(b)) < 1e-3:
        return
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    if a @ b < -0.999:
        return
    R = rotations.smallest_between(a, b)
    np.testing.assert_allclose(R @ a, b, atol=1e-9)
    np.testing.assert_allclose(R @ np.cross(a, b), np.cross(a, b), atol=1e-9)


def test_many_quaternions_are_the_same_bits_as_each_alone() -> None:
    q = np.random.default_rng(4).normal(size=(20_000, 4))
    R = rotations.from_quaternion(q)
    alone = np.stack([rotations.from_quaternion(one) for one in q[8_180:8_210]])
    np.testing.assert_array_equal(R[8_180:8_210], alone)
    np.testing.assert_array_equal(R, rotations.from_quaternion(q[None])[0])


@pytest.mark.parametrize("size", [1, 7, 50, 1000])
def test_angles_go_on_from_part_to_part_as_along_the_whole_path(size: int) -> None:
    s = np.linspace(0.0, 1.0, 300)
    # Past straight down and through ry = 90 degrees, with full turns on the way.
    turned = np.column_stack([np.pi + 9 * s, 4 * s, 15 * s])
    R = Rotation.from_euler("XYZ", turned).as_matrix()
    angles = [rotations.to_euler_continuous(R[:size])]
    for first in range(size, len(R), size):
        part = R[first : first + size]
        angles.append(rotations.to_euler_continued(part, R[first - 1], angles[-1][-1]))
    joined = np.concatenate(angles)
    np.testing.assert_allclose(joined, rotations.to_euler_continuous(R), atol=1e-12)
    np.testing.assert_allclose(joined, turned, atol=1e-9)
