"""Planes, chart axes and which way the normal points."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.spatial import rotations
from dmpcli.surfaces import plane
from dmpcli.surfaces.plane import Plane, PlaneCharts

DOWN = np.array([0.0, 0.0, -1.0])
coordinate = st.floats(-800.0, 800.0)
point = st.tuples(coordinate, coordinate, coordinate).map(np.array)


def wave(start, goal, normal, height=40.0, samples=200):
    u = goal - start
    length = np.linalg.norm(u)
    u = u / length
    v = np.cross(normal, u)
    s = np.linspace(0, 1, samples)
    return start + np.outer(s * length, u) + np.outer(height / 2 * np.sin(2 * np.pi * s), v)


def random_plane(seed):
    R = rotations.exp(np.random.default_rng(seed).normal(size=3))
    return R[:, 2], R[:, 0]


@pytest.mark.slow
@given(st.integers(0, 10_000))
def test_stroke_axes_find_the_plane_of_a_wave_and_point_to_the_tool(seed):
    normal, along = random_plane(seed)
    start = np.array([10.0, -20.0, 30.0])
    C = plane.stroke_axes(wave(start, start + 90 * along, normal), tool_axis=-normal)
    np.testing.assert_allclose(C[:, 0], along, atol=1e-9)
    np.testing.assert_allclose(C[:, 2], normal, atol=1e-7)
    np.testing.assert_allclose(C[:, 1], np.cross(C[:, 2], C[:, 0]), atol=1e-12)
    assert np.linalg.det(C) == pytest.approx(1.0)


def test_without_orientation_the_normal_points_up():
    for normal in (np.array([0.1, 0.2, 1.0]), np.array([0.1, 0.2, -1.0])):
        n = normal / np.linalg.norm(normal)
        e = np.cross(n, [0.0, 1.0, 0.0])
        stroke = wave(np.zeros(3), 70 * e / np.linalg.norm(e), n)
        assert plane.stroke_axes(stroke)[2, 2] > 0.9


def test_a_straight_stroke_lies_across_the_tool_axis():
    line = np.outer(np.linspace(0, 1, 50), [100.0, 0.0, 0.0])
    tool = np.array([0.0, 0.6, -0.8])
    np.testing.assert_allclose(plane.stroke_axes(line, tool)[:, 2], -tool, atol=1e-12)
    np.testing.assert_allclose(plane.stroke_axes(line)[:, 2], [0, 0, 1], atol=1e-12)


def test_a_straight_stroke_along_the_tool_axis_still_has_axes():
    line = np.outer(np.linspace(0, 1, 50), [0.0, 0.0, -100.0])
    C = plane.stroke_axes(line, DOWN)
    np.testing.assert_allclose(C.T @ C, np.eye(3), atol=1e-12)


def test_a_vertical_plane_without_orientation_has_a_definite_normal():
    for noise in (1e-12, -1e-12):
        stroke = wave(np.zeros(3), np.array([90.0, 0, 0]), np.array([0.0, 1.0, noise]))
        np.testing.assert_allclose(plane.stroke_axes(stroke)[:, 2], [0, 1, 0], atol=1e-6)


def test_a_closed_stroke_takes_base_x_for_u_and_base_y_where_x_is_normal():
    s = np.linspace(0, 2 * np.pi, 100)
    flat = 20 * np.stack([np.cos(s), np.sin(s), 0 * s], axis=1)
    np.testing.assert_allclose(plane.stroke_axes(flat, DOWN), np.eye(3), atol=1e-12)
    upright = 20 * np.stack([0 * s, np.cos(s), np.sin(s)], axis=1)
    C = plane.stroke_axes(upright, np.array([-1.0, 0, 0]))
    np.testing.assert_allclose(C[:, 0], [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(C[:, 2], [1, 0, 0], atol=1e-12)


@pytest.mark.parametrize(("gap", "closed"), [(0.0, True), (2.0, True), (60.0, False)])
def test_closed_means_a_gap_below_a_tenth_of_the_extent(gap, closed):
    s = np.linspace(0, 2 * np.pi, 100)
    stroke = 20 * np.stack([np.cos(s), np.sin(s), 0 * s], axis=1)
    stroke += np.outer(s / (2 * np.pi), [gap, 0, 0])
    assert plane.is_closed(stroke) is closed


def test_open_axes_are_the_closest_to_parallel_of_all_planes_through_the_line():
    rng = np.random.default_rng(4)
    e_u = rng.normal(size=3)
    e_u /= np.linalg.norm(e_u)
    normal = np.array([0.0, 0.0, 1.0])
    best = plane.open_axes(e_u, normal)[:, 2] @ normal
    for angle in np.linspace(0, 2 * np.pi, 721):
        turned = rotations.exp(angle * e_u) @ plane.open_axes(e_u, normal)[:, 2]
        assert turned @ normal <= best + 1e-12


@pytest.mark.slow
@given(point, point, st.integers(0, 10_000))
def test_charts_hit_both_ends_and_invert(start, goal, seed):
    if np.linalg.norm(goal - start) < 1.0:
        return
    normal, _ = random_plane(seed)
    e_u = (goal - start) / np.linalg.norm(goal - start)
    if abs(e_u @ normal) > 0.999:
        return
    charts = plane.pair_charts(start[None], goal[None], normal, closed=False)
    ends = charts.coordinates(np.stack([start, goal])[None])[0]
    np.testing.assert_allclose(ends[0], 0.0, atol=1e-9)
    np.testing.assert_allclose(ends[1], [np.linalg.norm(goal - start), 0, 0], atol=1e-7)
    points = np.random.default_rng(seed).normal(size=(1, 6, 3)) * 50
    np.testing.assert_allclose(charts.coordinates(charts.lift(points).position), points, atol=1e-9)


def test_a_given_plane_is_flipped_to_the_tools_side():
    up = Plane(np.zeros(3), np.array([0.0, 0.0, 1.0]))
    under = Plane(np.zeros(3), np.array([0.0, 0.0, -1.0]))
    for given_plane in (up, under):
        np.testing.assert_array_equal(given_plane.facing(DOWN).normal, up.normal)
        np.testing.assert_array_equal(given_plane.facing(-DOWN).normal, under.normal)
        np.testing.assert_array_equal(given_plane.facing(None).normal, up.normal)
    assert up.height(np.array([3.0, 4.0, 5.0])) == 5.0


def test_a_given_normal_stays_where_the_tool_lies_in_the_plane():
    for sign in (1.0, -1.0):
        wall = Plane(np.zeros(3), np.array([sign, 0.0, 0.0]))
        for tilt in (1e-5, -1e-5):
            tool = np.array([tilt, 0.0, -1.0])
            np.testing.assert_array_equal(wall.facing(tool).normal, wall.normal)
    towards_x = np.array([1.0, 0.0, 0.0])
    np.testing.assert_array_equal(wall.facing(towards_x).normal, [-1.0, 0.0, 0.0])


def test_charts_know_their_number_and_normals():
    charts = PlaneCharts(np.zeros((4, 3)), np.broadcast_to(np.eye(3), (4, 3, 3)))
    assert len(charts) == 4
    np.testing.assert_array_equal(charts.normal, np.tile([0.0, 0.0, 1.0], (4, 1)))


@pytest.mark.parametrize("closed", [False, True])
def test_the_charts_of_some_pairs_are_theirs(closed):
    rng = np.random.default_rng(5)
    start, goal = rng.normal(size=(2, 5, 3)) * 80.0
    normal = np.array([0.1, -0.3, 0.95])
    charts = plane.pair_charts(start, goal, normal / np.linalg.norm(normal), closed)
    rows = np.array([3, 1])
    some = charts.rows(rows)
    alone = plane.pair_charts(start[rows], goal[rows], normal / np.linalg.norm(normal), closed)
    for name in ("origin", "axes", "goals", "lengths", "status", "normal"):
        assert np.array_equal(getattr(some, name), getattr(alone, name)), name
    assert (len(some), some.closed) == (2, closed)
    uvw = rng.normal(size=(5, 4, 3))
    lifted = charts.lift(uvw)
    assert charts.coordinates(lifted.position) == pytest.approx(uvw)
    over = charts.over(lifted.position)
    assert (over.shape, over.dtype, over.all()) == ((5, 4), bool, True)
    assert not lifted.outside.any()
    if not closed:
        assert charts.goals[:, 1] == pytest.approx(0.0, abs=1e-9)
        assert (charts.lengths > 0.0).all()
        assert charts.goals[:, 2] == pytest.approx(0.0, abs=1e-9)
        assert charts.lengths == pytest.approx(np.linalg.norm(goal - start, axis=1))


def test_a_stroke_is_closed_by_its_first_and_last_sample_alone():
    square = np.array([[0.0, 0, 0], [30, 0, 0], [30, 40, 0], [0, 40, 0], [0, 0, 0]])
    assert plane.extent(square) == 50.0
    assert plane.is_closed(square)
    assert not plane.is_closed(square[:-1])
    # A thing of shares of the extent.
    for gap, closed in ((0.99 * plane.CLOSED, True), (1.01 * plane.CLOSED, False)):
        ended = square.copy()
        ended[-1, 0] = 50.0 * gap
        assert plane.is_closed(ended) == closed
