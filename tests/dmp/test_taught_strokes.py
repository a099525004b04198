"""Demonstrations in their charts: planes, exact surfaces, and what does not lie on them."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dmpcli.dmp.options import FitOptions
from dmpcli.dmp.preprocessing import preprocess
from dmpcli.dmp.skill import TaskFrame
from dmpcli.dmp.taught_strokes import mean_frame, taught_strokes
from dmpcli.errors import InputError, RefusedError
from dmpcli.spatial import rotations
from dmpcli.spatial.trajectory import Trajectory
from dmpcli.surfaces.cylinder import Cylinder
from dmpcli.surfaces.plane import Plane
from tests import cases
from tests.dmp.strokes import circle, paper_stroke

RADIUS = 60.0
DRUM = Cylinder(np.array([0.0, 0.0, -RADIUS]), np.array([0.0, 1.0, 0.0]), RADIUS)
UV = cases.wave(cases.U6, 109.0, 40.0)


def on_drum(uv, w=0.0):
    """Points (T, 3) over the cylinder, and the tool's rotations square to it there."""
    angle, r = uv[:, 0] / RADIUS, RADIUS + w
    position = np.column_stack([r * np.sin(angle), uv[:, 1], r * np.cos(angle) - RADIUS])
    down = Rotation.from_euler("x", np.pi)
    return position, (Rotation.from_euler("y", angle[:, None]) * down).as_matrix()


def seen(position, rotation=None, t=cases.T6):
    return preprocess(Trajectory(t, position, rotation))


@pytest.mark.parametrize("w", [0.0, 5.0, -2.0])
def test_the_chart_of_a_cylinder_is_its_unrolling(w):
    position, rotation = on_drum(UV, w)
    [found], plane, closed = taught_strokes([seen(position, rotation)], FitOptions(), DRUM)
    assert plane is None
    assert not closed
    x = found.curve(cases.T6)
    np.testing.assert_allclose(x[:, :2], UV[:, :2], atol=0.01)
    np.testing.assert_allclose(x[:, 2], w, atol=0.01)
    # Square to the surface all along: no turn against the local chart.
    np.testing.assert_allclose(x[:, 3:], 0.0, atol=1e-3)
    assert found.length == pytest.approx(109.0, abs=1e-6)
    # Start and goal are the feet.
    np.testing.assert_allclose(
        [found.frame.start, found.frame.goal], on_drum(UV[[0, -1]])[0], atol=1e-6
    )


def test_a_stroke_that_ends_lifted_keeps_its_height_at_the_end():
    w = 8.0 * cases.jerk((cases.T6 - 4.5) / 1.2)
    position, _ = on_drum(UV, w)
    [found], _, _ = taught_strokes([seen(position)], FitOptions(), DRUM)
    np.testing.assert_allclose(found.curve(cases.T6[[0, -1]])[:, 2], [0.0, 8.0], atol=0.01)


def test_the_chart_of_a_named_plane_is_rigid():
    stroke = paper_stroke(turning=True)
    Q = Rotation.from_euler("xyz", [0.3, -0.2, 1.0]).as_matrix()
    plane = Plane(stroke.position[0] + [0, 0, -3.0], np.array([0.0, 0.0, 1.0]))
    turned = Plane(Q @ plane.point, Q @ plane.normal)
    moved = Trajectory(stroke.t, stroke.position @ Q.T, Q @ stroke.rotation)
    [a], _, _ = taught_strokes([preprocess(stroke)], FitOptions(), plane)
    [b], _, _ = taught_strokes([preprocess(moved)], FitOptions(), turned)
    t = np.linspace(0.0, 10.0, 50)
    np.testing.assert_allclose(b.curve(t), a.curve(t), atol=1e-6)
    # The paper's start and goal lie 0.02 mm apart in height.
    np.testing.assert_allclose(a.curve(t)[:, 2], 3.0, atol=0.05)


def test_coordinates_in_a_plane_are_distances_from_its_line():
    position = cases.wave(cases.U6) @ cases.about("z", 40.0).T + [5.0, 6.0, 7.0]
    [found], plane, _ = taught_strokes([seen(position)], FitOptions(), None)
    assert plane.rule == "fitted"
    np.testing.assert_allclose(
        np.abs(found.curve(cases.T6)[:, :3]), np.abs(cases.wave(cases.U6)), atol=1e-6
    )


def test_what_lies_nowhere_near_the_surface_is_refused_with_what_to_check():
    position, _ = on_drum(UV)
    with pytest.raises(RefusedError, match=r"mm off the surface; check --surface-pose"):
        taught_strokes([seen(position + [0.0, 0.0, 500.0])], FitOptions(), DRUM)


def test_closedness_is_that_of_the_mean_gap():
    whole = circle()
    nearly = Trajectory(whole.t[:-60], whole.position[:-60])
    open_alone = taught_strokes([preprocess(nearly, trim=False)], FitOptions(), None)[2]
    both = [preprocess(Trajectory(whole.t, whole.position)), preprocess(nearly, trim=False)]
    gap = np.linalg.norm(nearly.position[-1] - nearly.position[0])
    assert gap > 0.0
    assert taught_strokes(both, FitOptions(), None)[2]
    assert taught_strokes(both[::-1], FitOptions(), None)[2]
    assert not open_alone or gap < 6.0


def test_a_stroke_without_a_gap_among_open_ones_is_refused():
    ring, line = circle(), cases.wave(cases.U6, 900.0)
    both = [preprocess(Trajectory(ring.t, ring.position)), seen(line), seen(line)]
    with pytest.raises(InputError, match="demonstration 1 is closed, the others are open"):
        taught_strokes(both, FitOptions(), None)


def test_the_mean_frame_lies_between():
    shift = np.array([10.0, -4.0, 2.0])
    turn = cases.about("z", 10.0)
    one = cases.wave(cases.U6)
    strokes = [seen(one), seen(one @ turn.T + shift)]
    found, _, closed = taught_strokes(strokes, FitOptions(), None)
    frame = mean_frame(found, closed)
    np.testing.assert_allclose(frame.start, shift / 2, atol=1e-9)
    half = cases.about("z", 5.0)
    np.testing.assert_allclose(frame.goal - frame.start, half @ [300.0, 0.0, 0.0], atol=1e-6)
    other = mean_frame(found[::-1], closed)
    np.testing.assert_allclose(other.axes, frame.axes, atol=1e-12)


@pytest.mark.parametrize("width", [0.1, 0.8, 1.6])
def test_the_mean_of_charts_is_scipys_mean_of_their_rotations(width):
    rng = np.random.default_rng(int(10 * width))
    compared = 0
    for _ in range(40):
        axes = Rotation.from_rotvec(width * rng.standard_normal((3, 3)))
        tools = axes * Rotation.from_rotvec(0.3 * rng.standard_normal((3, 3)))
        starts = rng.standard_normal((3, 3))
        frames = [
            TaskFrame(start, start + 50.0 * chart[:, 0], chart, tool)
            for start, chart, tool in zip(starts, axes.as_matrix(), tools.as_matrix(), strict=True)
        ]
        mean = mean_frame([SimpleNamespace(frame=frame) for frame in frames], False)
        if np.linalg.svd(axes.as_matrix().mean(axis=0), compute_uv=False)[1] < 0.1:
            continue
        compared += 1
        expected = axes.mean().as_matrix()
        np.testing.assert_allclose(mean.axes, expected, atol=1e-9)
        np.testing.assert_allclose(mean.start, starts.mean(axis=0))
        np.testing.assert_allclose(mean.goal, mean.start + 50.0 * expected[:, 0])
        turn = (axes.inv() * tools).mean().as_matrix()
        np.testing.assert_allclose(mean.rotation, expected @ turn, atol=1e-9)
    assert compared > 20


def test_the_goal_of_closed_strokes_is_the_mean_of_their_gaps():
    frames = [
        TaskFrame(np.array([1.0, 0, 0]), np.array([1.0, 0.5, 0]), np.eye(3), None),
        TaskFrame(np.array([3.0, 0, 0]), np.array([3.0, 1.5, 2.0]), np.eye(3), None),
    ]
    mean = mean_frame([SimpleNamespace(frame=frame) for frame in frames], True)
    assert mean.goal.tolist() == [2.0, 1.0, 1.0]
    assert mean.rotation is None


def pressed(up=6.0):
    """A wave on z = 0 by a pen that gives way the more the nearer to the goal, turned by 30°."""
    t, u = cases.T6, cases.U6
    force = 3.0 + up * u
    x = np.column_stack([120 * u, 20 * np.sin(6 * u), -force / 4.0]) @ cases.about("y", 30.0).T
    R = np.tile(cases.about("y", 30.0) @ np.diag([1.0, -1.0, -1.0]), (len(t), 1, 1))
    felt = force[:, None] * cases.about("y", 30.0)[:, 2]
    return Trajectory(t, x, R, contact_force=felt)


@pytest.mark.parametrize("length", [0.2, 1.0, 5.0])
def test_a_named_normal_may_be_of_any_length(length):
    normal = tuple(length * cases.about("y", 30.0)[:, 2])
    [found], _, _ = taught_strokes([preprocess(pressed())], FitOptions(normal=normal), None)
    np.testing.assert_allclose(found.frame.axes[:, 2], cases.about("y", 30.0)[:, 2], atol=1e-6)
    np.testing.assert_allclose(found.curve(cases.T6)[:, 2], 0.0, atol=1e-6)
    np.testing.assert_allclose(found.force[[0, -1]], [3.0, 9.0], atol=0.01)


def test_tools_that_face_opposite_ways_have_no_mean_and_the_first_stands():
    turns = [np.eye(3), np.diag([1.0, -1.0, -1.0])]
    frames = [TaskFrame(np.zeros(3), np.array([9.0, 0, 0]), np.eye(3), R) for R in turns]
    for some in (frames, frames[::-1]):
        mean = mean_frame([SimpleNamespace(frame=frame) for frame in some], False)
        np.testing.assert_array_equal(mean.rotation, some[0].rotation)


def test_charts_that_face_opposite_ways_have_no_mean_and_the_first_in_space_stands():
    places = [np.array([5.0, 1, 0]), np.array([-2.0, 7, 0])]
    turns = [np.eye(3), np.diag([1.0, -1.0, -1.0])]
    frames = [
        TaskFrame(at, at + 9.0 * C[:, 0], C, None) for at, C in zip(places, turns, strict=True)
    ]
    for some in (frames, frames[::-1]):
        mean = mean_frame([SimpleNamespace(frame=frame) for frame in some], False)
        np.testing.assert_array_equal(mean.start, places[1])
        np.testing.assert_array_equal(mean.axes, turns[1])
        np.testing.assert_allclose(mean.goal, places[1] + 9.0 * turns[1][:, 0])


def test_a_closed_stroke_with_its_tool_keeps_its_shape_on_the_plane_it_was_taught_on():
    ring = circle()
    tilt = rotations.from_euler(np.array([0.2, -0.1, 0.4]))
    R = np.tile(tilt @ np.diag([1.0, -1.0, -1.0]), (len(ring.t), 1, 1))
    one = Trajectory(ring.t, ring.position, R)
    named = Plane(ring.position[0] - 2.0 * tilt[:, 2], tilt[:, 2])
    [a], _, closed = taught_strokes([preprocess(one)], FitOptions(), named)
    [b], _, _ = taught_strokes([preprocess(one)], FitOptions(), None)
    assert closed
    x, y = a.curve.even(60), b.curve.even(60)
    np.testing.assert_allclose(x[:, 2], 2.0, atol=0.01)
    np.testing.assert_allclose(np.hypot(x[:, 0] - y[:, 0], x[:, 1] - y[:, 1]), 0.0, atol=0.02)
    assert np.ptp(x[:, 0]) == pytest.approx(60.0, abs=0.3)
    np.testing.assert_allclose(x[:, 3:], 0.0, atol=1e-6)
