"""Poses from touched points: exact motions are found, noise averages out, blind sets refused."""

import numpy as np
import pytest
import trimesh
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from dmpcli.errors import InputError
from dmpcli.spatial.pose import Pose
from dmpcli.surfaces import registration
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.registration import (
    RegisteredPart,
    from_pairs,
    onto_surface,
    starts_anywhere,
    starts_near,
)
from tests.records.meshes import box, grid
from tests.surfaces.registration_trial import loaded, motion, near, touched_on, trial

BUMPY = grid(41, 90.0, lambda x, y: 6.0 * np.sin(x * 2 * np.pi / 90) * np.cos(y * 2 * np.pi / 80))
SEEDS = st.integers(0, 10_000)


def laid(points, V, F, R, t):
    """The pose found near another."""
    return onto_surface(points, RegisteredPart.of(Mesh(V, F)), starts_near(points, R, t))


@settings(max_examples=50, deadline=None)
@given(SEEDS, st.integers(3, 12))
def test_pairs_give_back_every_rigid_motion(seed, count):
    rng = np.random.default_rng(seed)
    part = rng.uniform(-100, 100, (count, 3))
    _, spread, _ = np.linalg.svd(part - part.mean(axis=0))
    assume(spread[1] > 0.05 * spread[0])  # not on a line
    R, t = motion(rng)
    found = from_pairs(part, part @ R.T + t)
    np.testing.assert_allclose(found.rotation, R, atol=1e-9)
    np.testing.assert_allclose(found.position, t, atol=1e-9)
    assert found.rms < 1e-9
    assert found.spare == 3 * count - 6


def test_points_in_one_plane_are_enough_for_pairs_and_never_mirror():
    part = np.array([[0.0, 0, 0], [100, 0, 0], [0, 60, 0], [90, 50, 0]])
    R, t = motion(np.random.default_rng(4))
    found = from_pairs(part, part @ R.T + t)
    assert np.linalg.det(found.rotation) == pytest.approx(1.0)
    np.testing.assert_allclose(found.rotation, R, atol=1e-9)


def test_the_residuals_of_noisy_pairs_are_those_of_scipy():
    rng = np.random.default_rng(5)
    part = rng.uniform(-100, 100, (9, 3))
    R, t = motion(rng)
    noisy = part @ R.T + t + 0.1 * rng.standard_normal(part.shape)
    found = from_pairs(part, noisy)
    _, distance = Rotation.align_vectors(noisy - noisy.mean(axis=0), part - part.mean(axis=0))
    assert found.rms == pytest.approx(distance / 3.0)
    assert 0.05 < found.uncertainty < 0.4


@pytest.mark.parametrize("bend", [0.0, 0.5])
def test_pairs_on_one_line_are_refused_with_the_turn_about_it(bend):
    along = np.array([[-100.0, 0, 0], [-20, bend, 0], [40, 0, bend], [90, 0, 0]])
    with pytest.raises(InputError, match=r"turns about \(1\.00, 0\.00, 0\.00\) through .*one line"):
        from_pairs(along, along + 7.0)


def test_too_few_pairs_one_point_and_a_wrong_unit_are_refused():
    part = np.array([[0.0, 0, 0], [100, 0, 0], [0, 60, 0]])
    with pytest.raises(InputError, match="2 point pairs; a pose needs 3"):
        from_pairs(part[:2], part[:2])
    with pytest.raises(InputError, match="all one point"):
        from_pairs(part, np.ones((3, 3)))
    with pytest.raises(InputError, match="check the part's unit of length"):
        from_pairs(part / 1000.0, part)


@pytest.mark.slow
@settings(max_examples=8, deadline=None)
@given(SEEDS, st.sampled_from(["box", "bumpy"]))
def test_touched_points_give_back_rigid_motions_exactly(seed, kind):
    rng = np.random.default_rng(seed)
    V, F = box((100.0, 60.0, 40.0)) if kind == "box" else BUMPY
    points = touched_on(V, F, 40, rng)
    R, t = motion(rng)
    found = laid(points @ R.T + t, V, F, *near(R, t, V.mean(axis=0), rng, 0.08, 4.0))
    back = V @ found.rotation.T + found.position
    np.testing.assert_allclose(back, V @ R.T + t, atol=1e-6)
    assert found.residual.max() < 1e-6


@pytest.mark.thorough
def test_noise_averages_out_as_the_uncertainty_says():
    rng = np.random.default_rng(6)
    V, F = BUMPY
    errors, told = [], []
    for _ in range(6):
        points = touched_on(V, F, 60, rng)
        R, t = motion(rng)
        noisy = points @ R.T + t + 0.05 * rng.standard_normal(points.shape)
        found = laid(noisy, V, F, *near(R, t, V.mean(axis=0), rng, 0.05, 3.0))
        moved = points @ found.rotation.T + found.position - (points @ R.T + t)
        errors.append(np.sqrt(np.mean(np.sum(moved**2, axis=1))))
        told.append(found.uncertainty)
        assert found.rms == pytest.approx(0.05, rel=0.35)
    assert np.sum(np.array(errors) > told) <= 1
    assert np.median(told) < 0.4


def test_a_mistouched_point_is_told_and_hardly_moves_the_part():
    rng = np.random.default_rng(7)
    V, F = box((100.0, 60.0, 40.0))
    points = touched_on(V, F, 40, rng)
    R, t = motion(rng)
    noisy = points @ R.T + t + 0.02 * rng.standard_normal(points.shape)
    top = int(np.argmax(points[:, 2]))
    noisy[top] += 8.0 * R[:, 2]
    found = laid(noisy, V, F, *near(R, t, np.zeros(3), rng, 0.05, 3.0))
    assert int(np.argmax(found.residual)) == top
    assert found.residual[top] == pytest.approx(8.0, abs=0.2)
    assert np.median(found.residual) < 0.03
    moved = V @ found.rotation.T + found.position - (V @ R.T + t)
    assert np.abs(moved).max() < 0.15


def flat():
    return grid(9, 50.0, lambda x, y: 0.0 * x)


def tube():
    made = trimesh.creation.cylinder(60.0, 300.0, sections=90)
    V, F = np.array(made.vertices, dtype=float), np.array(made.faces)
    side = np.ptp(V[F][:, :, 2], axis=1) > 1.0
    return V, F[side]


def ball():
    made = trimesh.creation.icosphere(4, 50.0)
    return np.array(made.vertices, dtype=float), np.array(made.faces)


@pytest.mark.sweep(kept=1)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("mesh", "free"),
    [
        (flat, ["slides along", "slides along", "turns about (0.00, 0.00, 1.00)"]),
        (tube, ["slides along (0.00, 0.00, 1.00)", "turns about (0.00, 0.00, 1.00)"]),
        (ball, ["turns about"] * 3),
    ],
)
def test_a_part_that_can_slide_under_the_points_is_refused_with_its_motions(mesh, free):
    rng = np.random.default_rng(8)
    V, F = mesh()
    points = touched_on(V, F, 60, rng)
    with pytest.raises(InputError) as error:
        laid(points, V, F, np.eye(3), np.array([0.01, 0.0, 0.01]))
    named = str(error.value).split("free: it ")[1].split("; ")
    assert len(named) == len(free) + 1
    for said, expected in zip(named[:-1], free, strict=True):
        assert said.startswith(expected)


def test_a_box_touched_on_one_face_only_is_refused():
    rng = np.random.default_rng(9)
    V, F = box((100.0, 60.0, 40.0))
    top = np.flatnonzero((V[F][:, :, 2] > 19.0).all(axis=1))
    points = touched_on(V, F, 30, rng, top) * [0.8, 0.8, 1.0]
    with pytest.raises(InputError, match=r"slides along .*slides along .*turns about"):
        laid(points, V, F, np.eye(3), np.zeros(3))


@pytest.mark.slow
def test_motions_are_named_in_the_base_frame():
    rng = np.random.default_rng(10)
    V, F = tube()
    R = Rotation.from_euler("y", 90, degrees=True).as_matrix()
    points = touched_on(V, F, 60, rng) @ R.T + [0.0, 30.0, 200.0]
    with pytest.raises(InputError) as error:
        laid(points, V, F, R, np.array([0.0, 30.0, 200.0]))
    slide, turn, _ = str(error.value).split("; ")
    assert slide.endswith("slides along (1.00, 0.00, 0.00)")
    assert turn.startswith("turns about (1.00, 0.00, 0.00) through (")
    through = [float(word) for word in turn.split("(")[2].split(")")[0].split(",")]
    np.testing.assert_allclose(through[1:], [30.0, 200.0], atol=0.2)


def test_six_touched_points_are_too_few():
    V, F = BUMPY
    with pytest.raises(InputError, match="6 touched points"):
        laid(V[:6], V, F, np.eye(3), np.zeros(3))


@pytest.mark.sweep(kept=1)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "count", "least"),
    [("wedge", 8, 0.0), ("bracket", 12, 0.2), ("wedge", 20, 0.75), ("bracket", 30, 0.85)],
)
def test_accepted_poses_are_right_and_within_their_bound(name, count, least):
    """`benchmarks/registration.py` in small."""
    V, F, part = loaded(name)
    found = [trial(V, F, part, count, seed) for seed in range(8)]
    good = [one for one in found if one.verdict == "accepted"]
    assert all(one.error < 1.5 for one in good)
    assert sum(one.error > one.bound for one in good) <= 1
    assert len(good) >= least * len(found)


@pytest.mark.thorough
def test_in_all_orientations_the_pose_is_found_without_a_start():
    V, F, part = loaded("bracket")
    found = [trial(V, F, part, 24, seed, anywhere=True) for seed in range(2)]
    assert [one.verdict for one in found] == ["accepted"] * 2
    assert max(one.error for one in found) < 1.0


@pytest.mark.slow
def test_a_box_in_all_orientations_has_a_rival_that_looks_the_same():
    rng = np.random.default_rng(11)
    V, F = box((100.0, 60.0, 40.0))
    part = RegisteredPart.of(Mesh(V, F))
    points = touched_on(V, F, 40, rng) + 0.05 * rng.standard_normal((40, 3))
    found = onto_surface(points, part, starts_anywhere(points, part))
    assert found.rival.near
    assert np.degrees(found.rival.turned) == pytest.approx(180.0, abs=0.5)
    assert found.rival.difference < 0.3
    near_it = laid(points, V, F, np.eye(3), np.ones(3))
    assert near_it.rival is None or not near_it.rival.near


@pytest.mark.slow
def test_directions_of_approach_tell_sides_of_a_thin_plate_apart():
    """A plate of 3 mm touched on top and along its upper edge: it may also lie 3 mm higher."""
    rng = np.random.default_rng(12)
    V, F = wedge_plate()
    top = np.flatnonzero(np.isclose(V[F][:, :, 2].min(axis=1), 3.0))
    sides = np.flatnonzero(np.ptp(V[F][:, :, 2], axis=1) > 1.0)
    points = np.concatenate([touched_on(V, F, 9, rng, top), touched_on(V, F, 10, rng, sides)])
    points[9:, 2] = 2.98
    normals = np.concatenate([np.tile([0.0, 0.0, 1.0], (9, 1)), np.full((10, 3), np.nan)])
    part = RegisteredPart.of(Mesh(V, F))
    low = np.array([0.0, 0.0, 3.0])
    noisy = points + 0.03 * rng.standard_normal(points.shape)
    blind = onto_surface(noisy, part, starts_near(noisy, np.eye(3), low))
    assert blind.rival.near
    assert blind.rival.apart == pytest.approx(3.0, abs=0.3)
    told = onto_surface(noisy, part, starts_near(noisy, np.eye(3), low), -normals)
    assert told.directed
    assert told.rival is None or not told.rival.near
    np.testing.assert_allclose(told.position, 0.0, atol=0.3)


def wedge_plate():
    made = trimesh.Trimesh(
        [(x, y, z) for z in (0.0, 3.0) for x, y in ((0, 0), (90, 10), (70, 60), (-5, 40))]
    ).convex_hull
    return np.array(made.vertices, dtype=float), np.array(made.faces)


def test_the_radius_of_a_round_tip_is_seen():
    rng = np.random.default_rng(13)
    V, F, part = loaded("wedge")
    points = touched_on(V, F, 40, rng)
    outwards = part.closest(points)[1]
    found = onto_surface(points + 0.5 * outwards, part, starts_near(points, np.eye(3), np.ones(3)))
    assert found.outside == pytest.approx(0.5, abs=0.1)
    bare = onto_surface(points, part, starts_near(points, np.eye(3), np.ones(3)))
    assert bare.outside == 0.0


@pytest.mark.parametrize("scale", [0.001, 10.0, 1000.0])
def test_points_of_another_size_than_the_part_are_refused_for_their_unit(scale):
    V, F, part = loaded("wedge")
    points = scale * touched_on(V, F, 20, np.random.default_rng(14))
    with pytest.raises(InputError, match="check the part's unit of length"):
        onto_surface(points, part, starts_near(points, np.eye(3), np.zeros(3)))


def test_each_touch_out_of_the_part_costs_a_pose_the_square_of_the_limit():
    V, F = box((100.0, 60.0, 40.0))
    part = RegisteredPart.of(Mesh(V, F))
    points = np.array([[x, y, 20.0] for x in (-30.0, 0.0, 30.0) for y in (-20.0, 0.0, 20.0)])
    turned = np.diag([1.0, -1.0, -1.0])
    poses = Pose(np.array([[0.0, 0, 0], [0.0, 0, 40.0]]), np.stack([np.eye(3), turned]))
    squares = np.array([0.5, 0.2])
    down = np.tile([0.0, 0.0, -1.0], (9, 1))
    for wrong in range(10):
        approach = down.copy()
        approach[:wrong] *= -1.0
        cost, used = registration._directed(points, part, poses, squares, approach, 3.0)
        # The second pose is turned over: what came from above came out of it.
        n = np.array([wrong, 9 - wrong])
        found = squares + 9.0 * n
        best = int(np.argmin(found))
        assert used == (n[best] <= 0.2 * 9)
        np.testing.assert_allclose(cost, found if used else squares)
    assert registration._directed(points, part, poses, squares, None, 3.0) == (squares, False)


@pytest.mark.parametrize("off", [[0.0, 0, 0], [5000.0, -300, 0]])
def test_the_size_of_a_part_is_that_of_its_box_wherever_its_origin_is(off):
    V, F = box((10.0, 6.0, 4.0))
    part = RegisteredPart.of(Mesh(V + off, F))
    registration._refuse_size(V, part)
    registration._refuse_size(V[:2] * 0.1, part)
    for wrong in (0.001 * V, 40.0 * V):
        with pytest.raises(InputError, match="check the part's unit"):
            registration._refuse_size(wrong, part)


def test_a_shift_to_one_side_is_told_beyond_a_tenth_of_a_millimetre_and_doubt():
    wave = np.sin(np.arange(25.0))
    assert registration._one_sided(0.2 + 0.01 * wave) == pytest.approx(0.2, abs=0.01)
    assert registration._one_sided(-0.2 - 0.01 * wave) == pytest.approx(-0.2, abs=0.01)
    assert registration._one_sided(0.09 + 0.01 * wave) == 0.0
    assert registration._one_sided(0.2 + 0.5 * wave) == 0.0
