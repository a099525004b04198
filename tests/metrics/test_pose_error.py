"""Absolute and relative pose error: closed forms, and evo on the same trajectories."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.metrics import pose_error
from dmpcli.metrics.pose_error import absolute, alignment, associate, relative
from dmpcli.spatial import rotations
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.trajectory import Trajectory
from tests.outside_judge import judge


def curve(n=200, seed=0, dt=0.02, turned=True):
    """A wave in space with a turning tool."""
    s = np.linspace(0.0, 1.0, n)
    random = np.random.default_rng(seed)
    position = np.column_stack([110 * s, 25 * np.sin(2 * np.pi * s), 8 * s**2])
    rotation = rotations.exp(np.column_stack([0.4 * s, 0.3 * np.sin(3 * s), 0.2 + s]))
    noise = 0.0 if seed == 0 else 0.3
    position = position + noise * random.standard_normal((n, 3))
    rotation = rotation @ rotations.exp(0.02 * noise * random.standard_normal((n, 3)))
    return Trajectory(dt * np.arange(n), position, rotation if turned else None)


def moved(one, pose):
    return Trajectory(one.t, pose.apply(one.position), pose.rotation @ one.rotation)


def test_a_shift_is_an_absolute_error_and_no_relative_one():
    here = curve()
    there = moved(here, Pose(np.array([3.0, 4.0, 0.0]), np.eye(3)))
    assert absolute(here, there).position == pytest.approx(5.0)
    assert absolute(here, there).rotation == pytest.approx(0.0, abs=1e-7)
    assert relative(here, there).position == pytest.approx(0.0, abs=1e-9)


def test_a_turn_of_the_tool_alone_is_an_error_of_rotation_alone():
    here = curve()
    turned = Trajectory(
        here.t, here.position, here.rotation @ rotations.exp(np.array([[0, 0.1, 0]]))
    )
    errors = absolute(here, turned)
    assert errors.position == pytest.approx(0.0)
    assert errors.rotation == pytest.approx(0.1)


@pytest.mark.slow
@given(st.lists(st.floats(-3.0, 3.0), min_size=6, max_size=6), st.floats(0.5, 2.0))
def test_alignment_finds_the_motion_and_the_scale_that_were_applied(six, scale):
    here = curve().position
    pose = Pose(100.0 * np.array(six[:3]), rotations.exp(np.array([six[3:]]))[0])
    found = alignment(pose.apply(scale * here), here, scaled=True)
    assert found.scale == pytest.approx(scale, rel=1e-9)
    assert found.pose.position == pytest.approx(pose.position, abs=1e-6)
    assert found.pose.rotation == pytest.approx(pose.rotation, abs=1e-9)


def test_a_mirrored_estimate_is_turned_and_not_mirrored_back():
    here = curve().position
    found = alignment(here * [1.0, 1.0, -1.0], here)
    assert np.linalg.det(found.pose.rotation) == pytest.approx(1.0)


def test_points_on_a_line_have_no_alignment():
    line = np.outer(np.arange(5.0), [1.0, 2.0, 3.0])
    assert alignment(line, line) is None
    assert alignment(line[:2], line[:2]) is None


def test_samples_are_paired_by_the_nearest_time_within_a_hundredth_of_a_second():
    slow, fast = np.arange(0.0, 1.0, 0.1), np.arange(-0.5, 2.0, 0.01)
    a, b = associate(slow, fast + 0.004)
    assert list(a) == list(range(10))
    assert fast[b] + 0.004 == pytest.approx(slow, abs=0.006)
    assert [len(rows) for rows in associate(slow, slow + 0.05)] == [0, 0]
    b, a = associate(fast, slow)
    assert list(a) == list(range(10))


def test_without_orientation_there_is_no_error_of_it():
    errors = absolute(curve(turned=False), curve(seed=1))
    assert errors.rotation is None
    assert relative(curve(turned=False), curve(seed=1)).rotation is None


def evos(one):
    """The trajectory as evo has it, in m."""
    from evo.core.trajectory import PoseTrajectory3D

    poses = np.tile(np.eye(4), (len(one), 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = one.rotation, one.position / 1000.0
    return PoseTrajectory3D(poses_se3=list(poses), timestamps=one.t)


@judge("evo", "evo")
@pytest.mark.parametrize("aligned", [False, True])
@pytest.mark.parametrize("rates", [(0.02, 0.02), (0.02, 0.013), (0.008, 0.02)])
def test_evo_finds_the_same_errors(aligned, rates):
    from evo.core import metrics, sync

    reference, estimate = curve(300, 1, rates[0]), curve(260, 2, rates[1])
    tilt = Pose(np.array([2.0, -1.0, 3.0]), rotations.exp(np.array([[0.02, 0.1, -0.05]]))[0])
    estimate = moved(estimate, tilt)
    theirs = sync.associate_trajectories(evos(reference), evos(estimate))
    rows, others = associate(reference.t, estimate.t)
    pairs = [
        Trajectory(one.t[i], one.position[i], one.rotation[i])
        for one, i in ((reference, rows), (estimate, others))
    ]
    assert len(rows) == theirs[0].num_poses
    if aligned:
        theirs[1].align(theirs[0])
        pairs[1] = alignment(pairs[0].position, pairs[1].position).apply(pairs[1])
    relations = metrics.PoseRelation
    for metric, ours in ((metrics.APE, absolute), (metrics.RPE, relative)):
        errors = ours(*pairs)
        for relation, values in (
            (relations.translation_part, errors.position / 1000.0),
            (relations.rotation_angle_rad, errors.rotation),
        ):
            judged = metric(relation)
            judged.process_data(theirs)
            assert values == pytest.approx(judged.error, abs=1e-6)
            for name, value in judged.get_all_statistics().items():
                assert pose_error.summary(values)[name] == pytest.approx(value, abs=1e-6)


def test_without_orientations_steps_are_compared_in_base_axes_one_by_one():
    here = curve(turned=False)
    there = Trajectory(here.t, here.position * [1.0, 1.0, 3.0] + 7.0)
    steps = 2.0 * np.diff(here.position[:, 2])
    found = relative(here, there)
    assert found.rotation is None
    assert found.position == pytest.approx(np.abs(steps))
