"""Lead and tilt: the axis is where its definition says, and the tool's own turn about it stays."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.dmp.inclination import Inclination, inclined, travel
from dmpcli.spatial import rotations
from tests.minimum_jerk import minimum_jerk

DOWN = np.array([np.pi, 0.0, 0.0])
ANGLES = st.floats(-1.2, 1.2)


def unit(a):
    return a / np.linalg.norm(a, axis=-1, keepdims=True)


def axes_of(euler):
    return -rotations.from_euler(euler)[..., 2]


def still(position):
    """A tool that points down along a path, and flat frames (1, 1, 3, 3)."""
    return np.broadcast_to(DOWN, position.shape), np.eye(3)[None, None]


@pytest.mark.slow
@given(ANGLES, ANGLES, st.floats(-np.pi, np.pi))
def test_on_a_line_lead_and_tilt_are_the_angles_of_a_protractor(lead, tilt, heading):
    c, s = np.cos(heading), np.sin(heading)
    along, left, up = np.array([c, s, 0.0]), np.array([-s, c, 0.0]), np.array([0.0, 0.0, 1.0])
    position = (np.linspace(0.0, 50.0, 80)[:, None] * along)[None]
    euler = np.broadcast_to(DOWN, position.shape)
    frames = np.stack([along, left, up], axis=-1)[None, None]
    axis = axes_of(inclined(euler, frames, position, Inclination(lead, tilt)))
    np.testing.assert_allclose(np.arctan2(axis @ along, axis @ up), lead, atol=1e-9)
    np.testing.assert_allclose(np.arctan2(axis @ left, axis @ up), tilt, atol=1e-9)


def test_on_a_circle_the_lead_goes_around_with_the_travel():
    angle = np.linspace(0.0, 2.0 * np.pi, 721)
    position = 30.0 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)[None]
    euler, frames = still(position)
    axis = axes_of(inclined(euler, frames, position, Inclination(np.radians(20.0), 0.0)))[0]
    tangent = np.stack([-np.sin(angle), np.cos(angle), 0 * angle], axis=-1)
    true = np.cos(np.radians(20.0)) * np.eye(3)[2] + np.sin(np.radians(20.0)) * tangent
    off = np.degrees(np.arccos(np.clip(np.sum(axis * true, axis=1), -1.0, 1.0)))
    assert off.max() < 0.02


def test_tilt_alone_leans_to_plus_v_wherever_the_stroke_turns():
    t = np.linspace(0.0, 1.0, 301)
    position = np.stack([100 * t, 20 * np.sin(12 * t), 0 * t], axis=-1)[None]
    euler, frames = still(position)
    axis = axes_of(inclined(euler, frames, position, Inclination(0.0, 0.3)))
    np.testing.assert_allclose(axis, np.broadcast_to([0, np.sin(0.3), np.cos(0.3)], axis.shape))


@pytest.mark.slow
@given(st.tuples(*[st.floats(-0.6, 0.6)] * 3), ANGLES, ANGLES)
def test_the_smallest_rotation_leads_to_the_axis(lean, lead, tilt):
    position = np.linspace(0.0, 50.0, 40)[None, :, None] * np.array([1.0, 0.0, 0.0])
    before = rotations.from_euler(np.array(lean)) @ rotations.from_euler(DOWN)
    euler = np.broadcast_to(rotations.to_euler(before), position.shape)
    frames = np.eye(3)[None, None]
    R = rotations.from_euler(inclined(euler, frames, position, Inclination(lead, tilt)))[0, 20]
    wanted = unit(np.array([np.tan(lead), np.tan(tilt), 1.0]))
    np.testing.assert_allclose(-R[:, 2], wanted, atol=1e-9)
    turn = np.linalg.norm(rotations.log(R @ before.T))
    assert np.isclose(turn, np.arccos(np.clip(-before[:, 2] @ wanted, -1.0, 1.0)), atol=1e-6)


def test_a_stroke_that_turns_about_on_the_spot_rises_to_the_normal_there_without_a_jump():
    t = np.linspace(0.0, 2.0 * np.pi, 1001)
    position = np.stack([30.0 * np.sin(t), 0 * t, 0 * t], axis=-1)[None]
    euler, frames = still(position)
    axis = axes_of(inclined(euler, frames, position, Inclination(0.35, 0.0)))[0]
    assert np.isclose(axis[50, 0], np.sin(0.35))
    assert np.isclose(axis[500, 0], -np.sin(0.35))
    assert abs(axis[250, 0]) < 0.05
    moved = np.linalg.norm(np.diff(position[0], axis=0), axis=1)
    turned = np.linalg.norm(np.diff(axis, axis=0), axis=1)
    assert turned.max() < 0.4  # no flip of 2 sin(lead) within one sample
    assert turned[moved > 0.15].max() < 0.05


def test_a_path_that_stands_still_has_a_direction_and_a_point_has_none():
    line = np.linspace(0.0, 40.0, 60)[:, None] * np.array([0.6, 0.8, 0.0])
    stops = np.concatenate([np.repeat(line[:1], 20, axis=0), line, np.repeat(line[-1:], 20, 0)])
    up = np.broadcast_to(np.eye(3)[2], stops[None].shape)
    np.testing.assert_allclose(travel(stops[None], up)[0], np.tile([0.6, 0.8, 0.0], (100, 1)))
    point = np.zeros((1, 5, 3))
    assert np.abs(travel(point, up[:, :5])).max() == 0.0


def test_what_a_path_does_within_a_hundredth_of_a_millimetre_of_its_rest_is_no_direction():
    t = np.linspace(0.0, 1.0, 401)
    s = minimum_jerk(t)
    position = np.stack([80 * s, 0 * s, 0 * s], axis=-1)[None]
    position[0, :12, 1] = 0.005 * np.sin(np.arange(12))
    up = np.broadcast_to(np.eye(3)[2], position.shape)
    ahead = travel(position, up)[0]
    assert np.degrees(np.arctan2(np.abs(ahead[:, 1]), ahead[:, 0])).max() < 1.0


def test_a_path_of_one_sample_has_no_direction():
    assert travel(np.ones((2, 1, 3)), np.ones((2, 1, 3))).tolist() == [[[0.0] * 3]] * 2


def test_paths_beside_one_another_have_each_its_own_directions():
    t = np.linspace(0.0, 1.0, 60)
    a = np.stack([40 * np.sin(3 * t), 40 * (1 - np.cos(3 * t)), 0 * t], axis=-1)
    paths = np.stack([a, a[::-1] * [1.0, 2.0, 1.0], np.tile(a[:1], (60, 1)), 3 * a + 500.0])
    up = np.broadcast_to(np.eye(3)[2], paths.shape)
    together = travel(paths, up)
    for i, path in enumerate(paths):
        np.testing.assert_allclose(together[i], travel(path[None], up[:1])[0], atol=1e-12)
    # A circle's tangents, by its closed form.
    angle = 3 * t[5:-5]
    tangent = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    np.testing.assert_allclose(together[0, 5:-5], tangent, atol=2e-3)
