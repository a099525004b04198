import numpy as np
import pytest

from dmpcli.dmp import reference_paths
from dmpcli.metrics.wave_height import stroke_wave

START = np.array([-551.030, 131.399, -17.560])
GOAL = np.array([-660.021, 130.034, -17.538])
UP = np.array([0.0, 0.0, 1.0])
T = 10.0
t = np.arange(501) * 0.02


def test_minimum_jerk_begins_and_ends_at_rest_and_is_symmetric():
    s = reference_paths.minimum_jerk(t, T)
    assert (s[0], s[250], s[-1]) == (0.0, 0.5, 1.0)
    np.testing.assert_allclose(s + s[::-1], 1.0, atol=1e-12)
    speed = np.gradient(s, 0.02)
    assert speed.max() == pytest.approx(1.875 / T, rel=1e-4)
    assert speed[0] < 1e-5
    assert reference_paths.minimum_jerk(np.array([-1.0, 11.0]), T).tolist() == [0.0, 1.0]


def test_the_sine_has_its_wave_height_its_ends_and_bulges_to_plus_v_first():
    p = reference_paths.sine(START, GOAL, 49.979, t, T)
    np.testing.assert_allclose(p[[0, -1]], [START, GOAL], atol=1e-12)
    wave = stroke_wave(
        reference_paths.sine(START, GOAL, 49.979, np.linspace(0, T, 20001), T), START, GOAL, UP
    )
    assert wave.heights.tolist() == pytest.approx([49.979], abs=1e-4)
    assert wave.value[0] > 0 > wave.value[1]


def test_v_is_normal_cross_u():
    u, v = reference_paths.directions(np.zeros(3), np.array([0.0, 2.0, 0.0]), UP)
    np.testing.assert_allclose((u, v), ([0, 1, 0], [-1, 0, 0]), atol=1e-15)
    # Only the part of the normal that is square to u matters.
    _, same = reference_paths.directions(
        np.zeros(3), np.array([0.0, 2.0, 0.0]), np.array([0, 0.7, 1])
    )
    np.testing.assert_allclose(same, v, atol=1e-15)


def test_the_sine_lies_in_the_plane_of_its_normal():
    tilted = np.array([0.3, 0.0, 1.0])
    start, goal = np.zeros(3), np.array([0.0, 50.0, 0.0])
    p = reference_paths.sine(start, goal, 20.0, t, T, periods=2.0, normal=tilted)
    np.testing.assert_allclose(p @ tilted, 0.0, atol=1e-12)


def test_the_line_is_straight():
    p = reference_paths.line(START, GOAL, t, T)
    np.testing.assert_allclose(np.cross(p - START, GOAL - START), 0.0, atol=1e-9)
    np.testing.assert_allclose(p[[0, -1]], [START, GOAL], atol=1e-12)


def test_the_circle_keeps_its_radius_and_closes():
    p = reference_paths.circle(START, GOAL, t, T)
    radius = np.linalg.norm(p - (START + GOAL) / 2, axis=1)
    np.testing.assert_allclose(radius, np.linalg.norm(GOAL - START) / 2, rtol=1e-12)
    np.testing.assert_allclose(p[[0, -1]], [START, START], atol=1e-10)
    np.testing.assert_allclose(p[250], GOAL, atol=1e-10)


def test_the_polyline_passes_its_points_with_minimum_jerk_along_the_arc():
    points = np.array([[0.0, 0, 0], [30.0, 0, 0], [30.0, 40.0, 0], [30.0, 40.0, 50.0]])
    p = reference_paths.polyline(points, t, T)
    np.testing.assert_allclose(p[[0, -1]], points[[0, -1]])
    walked = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(p, axis=0)).sum(axis=1))])
    np.testing.assert_allclose(walked, 120.0 * reference_paths.minimum_jerk(t, T), atol=1e-9)
