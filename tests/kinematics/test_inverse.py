from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from dmpcli.errors import InputError, RefusedError
from dmpcli.kinematics import chain, inverse, models
from dmpcli.spatial.pose import Pose
from tests.kinematics.jacobian import jacobian

EC66 = models.model("ec66")
ANGLES = st.lists(st.floats(-np.pi, np.pi), min_size=6, max_size=6).map(np.array)
DOWN = np.diag([1.0, -1.0, -1.0])


def turned(a, b):
    """Largest difference of joint angles, whole turns apart."""
    return np.abs((a - b + np.pi) % (2 * np.pi) - np.pi).max(axis=-1)


def missed(position, rotation, q):
    at = chain.forward(EC66, q)
    p, R = at.position, at.rotation
    return np.concatenate([p - position, 100.0 * (R - rotation).ravel()])


def searched(position, rotation, starts=24):
    """How near scipy brings the flange to a pose: mm, and turns as on a lever of 100 mm."""
    rng = np.random.default_rng(11)

    def off(q):
        return missed(position, rotation, q)

    found = (least_squares(off, rng.uniform(-np.pi, np.pi, 6), xtol=1e-12) for _ in range(starts))
    return min(np.sqrt(2 * fit.cost) for fit in found)


@pytest.mark.slow
def test_every_solution_of_ten_thousand_poses_leads_back_to_its_pose():
    q = np.random.default_rng(1).uniform(-np.pi, np.pi, (10_000, 6))
    at = chain.forward(EC66, q)
    position, rotation = at.position, at.rotation
    found = inverse.solve(EC66, position, rotation)[0]
    exists = ~np.isnan(found[..., 0])
    assert found.shape == (10_000, 8, 6)
    assert np.array_equal(exists, ~np.isnan(found).any(axis=-1))
    assert np.bincount(exists.sum(axis=1))[8] > 7000
    back = chain.forward(EC66, found)
    assert np.nanmax(np.abs(back.position - position[:, None])) < 1e-9
    assert np.nanmax(np.abs(back.rotation - rotation[:, None])) < 1e-12
    # The configuration that the pose came from is one of them, and all of them differ.
    away = turned(found, q[:, None])
    assert np.nanmin(away, axis=1).max() < 1e-9
    for i in np.flatnonzero(exists.all(axis=1))[:200]:
        between = turned(found[i][:, None], found[i][None])
        assert (between[~np.eye(8, dtype=bool)] > 1e-6).all()


def test_solutions_are_angles_within_half_a_turn():
    q = np.random.default_rng(2).uniform(-6, 6, (500, 6))
    at = chain.forward(EC66, q)
    found = inverse.solve(EC66, at.position, at.rotation)[0]
    assert np.nanmax(found) <= np.pi
    assert np.nanmin(found) > -np.pi


@pytest.mark.thorough
@pytest.mark.parametrize("height", [100.0, 400.0])
def test_reach_ends_where_a_search_no_longer_finds_the_pose(height):
    def exists(distance):
        at = np.array([distance, 0.0, height])
        return not np.isnan(inverse.solve(EC66, at, DOWN)[0]).all()

    near, far = 600.0, 1200.0
    assert exists(near)
    assert not exists(far)
    while far - near > 1e-3:
        middle = (near + far) / 2
        near, far = (middle, far) if exists(middle) else (near, middle)
    inside, outside = np.array([near - 0.5, 0, height]), np.array([far + 0.5, 0, height])
    assert searched(inside, DOWN) < 1e-3
    assert searched(outside, DOWN) > 0.1


def test_what_a_pose_misses_is_how_much_longer_the_arm_would_have_to_be():
    at = np.array([1000.0, 0.0, 300.0])
    _, missing = inverse.solve(EC66, at, DOWN)
    short = missing.min()
    assert short > 0
    for extra, reaches in ((short - 1e-6, False), (short + 1e-6, True)):
        longer = replace(EC66, a=EC66.a + np.array([0, extra, 0, 0, 0, 0]))
        assert np.isnan(inverse.solve(longer, at, DOWN)[0]).all() != reaches


def test_too_near_to_the_first_axis_is_out_of_reach():
    # Axes 5 and 6 meet 122 mm beside axis 1 at least.
    at = np.array([60.0, 60.0, 300.0])
    found, missing = inverse.solve(EC66, at, DOWN)
    assert np.isnan(found).all()
    assert missing.min() == pytest.approx(122 - np.hypot(60, 60))
    with pytest.raises(RefusedError, match=r"^out of reach: the ec66 misses the pose by 37\.15 mm"):
        inverse.nearest(EC66, Pose(at, DOWN), np.zeros(6))


@pytest.mark.slow
@settings(deadline=None, max_examples=200)
@example(np.array([2e-05, 0.998046875, 2e-05, 0.125, 2e-05, 0.0]))
@given(ANGLES)
def test_the_scalar_way_finds_what_the_array_way_finds(q):
    at = chain.forward(EC66, q)
    position, rotation = at.position, at.rotation
    found = inverse.solve(EC66, position, rotation)[0]
    reference = np.clip(q, EC66.limits[:, 0] / 2, EC66.limits[:, 1] / 2)
    measure = inverse.singularity(EC66, q)
    if measure.min() < 1e-6 or abs(q[2]) > np.radians(160):
        return
    one = inverse.nearest(EC66, Pose(position, rotation), reference)
    # Near a singularity the angles are worth less: an error of the pose is divided by its measure,
    # and near two of them by both.
    slack = 1e-8 + 1e-11 / measure.min() + 1e-15 / np.prod(np.sort(measure)[:2])
    assert np.nanmin(turned(found, one)) < slack
    assert np.linalg.norm(one - reference) <= np.linalg.norm(q - reference) + slack


@settings(deadline=None, max_examples=100)
@given(ANGLES, st.integers(-1, 1), st.integers(0, 5))
def test_turns_follow_the_reference(q, turns, joint):
    q = q / 2.1
    if inverse.singularity(EC66, q).min() < 1e-3 or joint == 2:
        return
    reference = q.copy()
    reference[joint] += turns * 2 * np.pi
    if abs(reference[joint]) > 2 * np.pi:
        return
    found = inverse.nearest(EC66, chain.forward(EC66, q), reference)
    assert found == pytest.approx(reference, abs=1e-6)


def test_a_joint_that_would_turn_past_its_limit_is_named():
    limit = 2 * np.pi
    reference = np.array([0.3, -1.2, 1.0, -1.0, 1.2, limit - 0.01])
    ahead = reference + [0, 0, 0, 0, 0, 0.02]
    with pytest.raises(RefusedError, match=r"joint 6 would turn to 360\.57°, beyond -360° to 360°"):
        inverse.nearest(EC66, chain.forward(EC66, ahead), reference)
    on_it = reference + [0, 0, 0, 0, 0, 0.01]
    assert inverse.nearest(EC66, chain.forward(EC66, on_it), reference) == pytest.approx(on_it)


def test_a_pose_that_is_not_a_number_is_refused():
    with pytest.raises(RefusedError, match="not a number"):
        inverse.nearest(EC66, Pose(np.array([np.nan, 0, 0]), DOWN), np.zeros(6))
    with pytest.raises(RefusedError, match="not a number"):
        inverse.nearest(EC66, Pose(np.array([500.0, 0, 300]), np.full((3, 3), np.nan)), np.zeros(6))


def test_with_axes_4_and_6_in_line_joint_6_stays_and_the_pose_is_kept():
    q = np.array([0.4, -1.1, 1.3, 0.5, -np.pi, 0.7])  # joint 5: offset 180°, so its sine is zero
    at = chain.forward(EC66, q)
    position, rotation = at.position, at.rotation
    assert inverse.singularity(EC66, q)[2] < 1e-12
    found = inverse.nearest(EC66, Pose(position, rotation), q + 0.05)
    at = chain.forward(EC66, found)
    p, R = at.position, at.rotation
    assert p == pytest.approx(position, abs=1e-9)
    assert np.abs(R - rotation).max() < 1e-12
    assert np.abs(found - q).max() < 0.11


@settings(deadline=None, max_examples=100)
@given(ANGLES)
def test_the_three_measures_multiply_to_the_determinant_of_the_jacobian(q):
    a2, a3 = EC66.a[1:3]
    scale = a2 * a3 * (a2 + a3)
    product = inverse.singularity(EC66, q).prod() * scale
    determinant = abs(np.linalg.det(jacobian(EC66, q)))
    assert product == pytest.approx(determinant, abs=1e-9 * scale)


def test_each_singularity_has_its_own_measure():
    plain = np.array([0.4, -1.1, 1.3, 0.5, -1.0, 0.7])
    assert (inverse.singularity(EC66, plain) > 0.1).all()
    stretched, in_line = plain.copy(), plain.copy()
    stretched[2], in_line[4] = 0.0, 0.0
    assert np.flatnonzero(inverse.singularity(EC66, stretched) < 1e-9).tolist() == [1]
    assert np.flatnonzero(inverse.singularity(EC66, in_line) < 1e-9).tolist() == [2]
    assert inverse.SINGULARITIES[1:] == ("elbow", "wrist")


def test_an_arm_of_the_family_with_other_signs_is_solved_too():
    # A UR5e, from the maker's published DH table; its lengths a are negative, its axis 5 flips.
    ur5e = replace(
        EC66,
        name="ur5e",
        d=np.array([162.5, 0, 0, 133.3, 99.7, 99.6]),
        a=np.array([0, -425.0, -392.2, 0, 0, 0]),
        alpha=np.radians([90.0, 0, 0, 90, -90, 0]),
        offset=np.zeros(6),
    )
    q = np.random.default_rng(6).uniform(-np.pi, np.pi, (1000, 6))
    at = chain.forward(ur5e, q)
    position, rotation = at.position, at.rotation
    found = inverse.solve(ur5e, position, rotation)[0]
    assert np.nanmax(np.abs(chain.forward(ur5e, found).position - position[:, None])) < 1e-9
    assert np.nanmin(turned(found, q[:, None]), axis=1).max() < 1e-8
    one = inverse.nearest(ur5e, Pose(position[0], rotation[0]), q[0])
    assert one == pytest.approx(q[0], abs=1e-8)


def test_an_arm_of_another_family_is_refused():
    with pytest.raises(InputError, match="not an arm with three parallel axes"):
        inverse.solve(replace(EC66, a=np.ones(6)), np.zeros(3), np.eye(3))


def test_orientations_far_apart_share_one_set_of_branches():
    at = np.array([500.0, 100.0, 300.0])
    R = Rotation.random(40, rng=np.random.default_rng(7)).as_matrix()
    found = inverse.solve(EC66, np.broadcast_to(at, (40, 3)), R)[0]
    assert found.shape == (40, 8, 6)
    for i in range(40):
        assert np.array_equal(inverse.solve(EC66, at, R[i])[0], found[i], equal_nan=True)
