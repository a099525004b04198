"""Plane, cylinder and sphere: geodesics and charts against other ways to compute them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from dmpcli.spatial import rotations
from dmpcli.surfaces.cylinder import Cylinder
from dmpcli.surfaces.plane import Plane
from dmpcli.surfaces.sphere import Sphere
from dmpcli.surfaces.surface import Status, Surface

R = rotations.exp(np.array([0.3, -0.5, 0.8]))
CENTRE = np.array([-550.0, 40.0, -20.0])
SURFACES: dict[str, Surface] = {
    "plane": Plane(CENTRE, R[:, 2]),
    "cylinder": Cylinder(CENTRE, R[:, 0], 60.0),
    "sphere": Sphere(CENTRE, 150.0),
}
every_surface = pytest.mark.parametrize("name", SURFACES)


def some_points(surface, seed, count=6, spread=40.0):
    """Points of one side of the surface, near each other."""
    rng = np.random.default_rng(seed)
    return surface.closest(CENTRE + R @ [0.0, 0.0, 100.0] + rng.normal(size=(count, 3)) * spread)


def geodesic(surface, origin, direction, length):
    """Integrate the geodesic's equation, acceleration along the normal only, numerically."""

    def motion(_, z):
        x, t = z[:3], z[3:]
        n = surface.closest(x).normal
        h = 1e-5
        turn = (surface.closest(x + h * t).normal - surface.closest(x - h * t).normal) / (2 * h)
        return np.concatenate([t, -(turn @ t) * n])

    return solve_ivp(
        motion, (0, length), np.concatenate([origin, direction]), rtol=1e-9, atol=1e-9
    ).y[:, -1]


@every_surface
def test_walks_follow_the_geodesic_equation(name):
    surface = SURFACES[name]
    at = some_points(surface, 1, 3)
    direction = np.cross(at.normal, [0.3, 0.4, -0.9])
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    walked = surface.walk(at.position, direction, np.full(3, 70.0))
    for i in range(3):
        end = geodesic(surface, at.position[i], direction[i], 70.0)
        np.testing.assert_allclose(walked.position[i], end[:3], atol=1e-4)
        np.testing.assert_allclose(walked.direction[i], end[3:], atol=1e-6)


@pytest.mark.slow
@every_surface
@given(seed=st.integers(0, 10_000), length=st.floats(-90.0, 90.0))
def test_walking_there_and_back_is_the_identity(name, seed, length):
    surface = SURFACES[name]
    at = some_points(surface, seed, 1)
    direction = np.cross(at.normal, [0.3, 0.4, -0.9])
    there = surface.walk(at.position, direction, np.array([length]))
    back = surface.walk(there.position, there.direction, np.array([-length]))
    np.testing.assert_allclose(back.position, at.position, atol=1e-9)
    assert surface.closest(there.position).distance[0] < 1e-9


@every_surface
def test_connections_arrive(name):
    surface = SURFACES[name]
    a, b = some_points(surface, 2), some_points(surface, 3)
    link = surface.connect(a.position, b.position)
    assert (link.status == Status.DRAWN).all()
    end = surface.walk(a.position, link.direction, link.length)
    np.testing.assert_allclose(end.position, b.position, atol=1e-9)


@every_surface
def test_charts_run_from_start_to_goal_and_keep_distances_across(name):
    surface = SURFACES[name]
    a, b = some_points(surface, 4), some_points(surface, 5)
    charts = surface.charts(a.position, b.position, side=R[:, 2])
    assert (charts.status == Status.DRAWN).all()
    u, v = charts.lengths[:, None] * np.array([0.0, 0.5, 1.0, 0.5]), np.array([0, 0, 0, 20.0])
    lift = charts.lift(np.stack([u, 0 * u + v, 0 * u], axis=-1))
    np.testing.assert_allclose(lift.position[:, 0], a.position, atol=1e-9)
    np.testing.assert_allclose(lift.position[:, 2], b.position, atol=1e-9)
    np.testing.assert_allclose(charts.goals[:, 0], charts.lengths)
    C = lift.axes
    np.testing.assert_allclose(
        np.swapaxes(C, -1, -2) @ C, np.broadcast_to(np.eye(3), C.shape), atol=1e-12
    )
    assert (np.linalg.det(C) > 0.9).all()
    assert ((lift.normal[:, 0] @ R[:, 2]) > 0).all()
    # 20 mm across is a geodesic distance of 20 mm, at a right angle to the centre line.
    link = surface.connect(lift.position[:, 1], lift.position[:, 3])
    np.testing.assert_allclose(link.length, 20.0, atol=1e-9)
    np.testing.assert_allclose(np.sum(link.direction * C[:, 1, :, 0], axis=1), 0.0, atol=1e-9)
    np.testing.assert_allclose(link.direction, C[:, 1, :, 1], atol=1e-9)


@every_surface
def test_w_stands_off_along_the_normal(name):
    surface = SURFACES[name]
    a, b = some_points(surface, 6), some_points(surface, 7)
    lift = surface.charts(a.position, b.position).lift(
        np.tile([5.0, 7.0, 3.0], (len(a.normal), 4, 1))
    )
    foot = lift.position - 3.0 * lift.normal
    np.testing.assert_allclose(surface.closest(foot).distance, 0.0, atol=1e-9)
    np.testing.assert_allclose(surface.closest(lift.position).distance, 3.0, atol=1e-9)


@every_surface
def test_closed_strokes_take_their_plane_s_axes_and_know_their_goal(name):
    surface = SURFACES[name]
    a = some_points(surface, 8)
    nearby = surface.closest(a.position + np.array([3.0, -4.0, 2.0])).position
    closed = R @ rotations.exp(np.array([0.2, 0.1, 0.0]))
    charts = surface.charts(a.position, nearby, side=R[:, 2], closed=closed)
    np.testing.assert_array_equal(charts.lengths, 0.0)
    C = charts.lift(np.zeros((len(nearby), 1, 3))).axes[:, 0]
    turn = rotations.smallest_between(closed[:, 2], C[..., 2])
    np.testing.assert_allclose(turn @ closed[:, 0], C[..., 0], atol=1e-9)
    there = charts.lift(charts.goals[:, None]).position[:, 0]
    np.testing.assert_allclose(there, nearby, atol=1e-9)


def test_what_has_no_geodesic_is_named():
    ball, bar = SURFACES["sphere"], SURFACES["cylinder"]
    top = CENTRE + np.array([[0.0, 0.0, 150.0]])
    assert ball.connect(top, 2 * CENTRE - top).status[0] == Status.OPPOSITE
    assert ball.connect(top, top).status[0] == Status.COINCIDENT
    on_bar = bar.closest(top).position
    assert bar.connect(on_bar, on_bar).status[0] == Status.COINCIDENT
    lift = ball.charts(top, top + [[50.0, 0.0, 0.0]]).lift(np.array([[[5.0, 240.0, 0.0]]]))
    assert lift.status[0] == Status.FOLDED
    assert len({status.reason for status in Status}) == len(Status)
    assert len({status.remedy for status in Status}) == len(Status)
