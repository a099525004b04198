"""Strokes on surfaces: closed-form charts of cylinder and sphere, and tools tilted on purpose."""

import numpy as np
import pytest

from dmpcli.metrics import on_surface
from dmpcli.spatial import rotations

R = 60.0
LENGTH = 80.0


def stroke(height=50.0, n=401):
    s = np.linspace(0.0, 1.0, n)
    v = 0.5 * height * np.sin(2 * np.pi * s)
    return np.column_stack([LENGTH * s - 6.0 * np.sin(2 * np.pi * s), v])


def unit(v):
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def on_cylinder(uv, slant=0.6):
    """Cylinder about y; the start-goal geodesic is a helix at `slant` to the circles."""
    c, s = np.cos(slant), np.sin(slant)
    a = (uv[:, 0] * c - uv[:, 1] * s) / R
    y = uv[:, 0] * s + uv[:, 1] * c
    point = np.column_stack([R * np.sin(a), y, R * np.cos(a)])
    around = np.column_stack([np.cos(a), np.zeros_like(a), -np.sin(a)])
    e_y = np.array([0.0, 1.0, 0.0])
    return point, c * around + s * e_y, -s * around + c * e_y


def on_sphere(uv):
    """Sphere about the origin; the start-goal geodesic is its equator."""
    a, b = uv[:, 0] / R, uv[:, 1] / R
    point = R * np.column_stack([np.cos(b) * np.cos(a), np.cos(b) * np.sin(a), np.sin(b)])
    e_u = np.column_stack([-np.sin(a), np.cos(a), np.zeros_like(a)])
    e_v = np.column_stack([-np.sin(b) * np.cos(a), -np.sin(b) * np.sin(a), np.cos(b)])
    return point, e_u, e_v


def closest_on_sphere(points):
    normal = unit(points)
    return R * normal, normal


def test_wave_height_is_measured_along_the_surface():
    assert on_surface.wave_along(stroke(49.98), LENGTH).mean == pytest.approx(49.98, abs=1e-3)
    assert on_surface.wave_along(stroke(0.1), LENGTH).mean is None
    assert on_surface.wave_along(np.full((5, 2), np.nan), LENGTH) is None


def test_contact_is_told_by_the_share_of_the_path_and_the_lift_of_the_rest():
    # 30 mm down, 8 mm up within 2 mm, 40 mm lifted: samples crowd where the pen is down.
    x = np.concatenate([np.linspace(0.0, 30.0, 3001), np.linspace(32.0, 72.0, 41)])
    height = np.where(x > 31.0, 8.0, 0.2)
    touching, lift = on_surface.contact(np.column_stack([x, 0 * x, height]), height, 1.0)
    assert touching == pytest.approx(30.0 / 72.0, abs=0.08)
    assert lift == 8.0
    assert on_surface.contact(np.column_stack([x, 0 * x, 0 * x]), 0 * x, 1.0) == (1.0, 0.0)
    # A tool that stands still has no path to have a share of.
    assert on_surface.contact(np.zeros((4, 3)), np.array([0.0, 0.0, 0.0, 5.0]), 1.0) == (0.75, 5.0)


def test_distance_leaves_out_the_intended_height():
    uv = stroke()
    point, e_u, e_v = on_sphere(uv)
    w = 0.3 * np.sin(0.1 * uv[:, 0])
    lifted = point + w[:, None] * np.cross(e_u, e_v)
    assert on_surface.distance(lifted, closest_on_sphere, w).max() < 1e-12
    assert on_surface.distance(lifted, closest_on_sphere) == pytest.approx(np.abs(w), abs=1e-12)
    assert on_surface.height(lifted, closest_on_sphere) == pytest.approx(w, abs=1e-12)
    taught = np.column_stack([uv, w])
    assert on_surface.height_there(uv[::3], taught) == pytest.approx(w[::3])


def test_the_demonstrations_height_is_read_on_the_segment_beside():
    taught = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 5.0], [10.0, 8.0, 7.0], [30.0, 8.0, 7.0]])
    uv = np.array([[2.0, 1.0], [6.5, -0.5], [10.5, 2.0], [9.0, 6.0], [-4.0, 0.0], [40.0, 9.0]])
    expected = [1.0, 3.25, 5.5, 6.5, 0.0, 7.0]
    assert on_surface.height_there(uv, taught) == pytest.approx(expected)


def test_each_sample_touches_for_half_the_way_to_either_neighbour():
    x = np.array([0.0, 1.0, 3.0, 7.0])
    path = np.column_stack([0 * x, x, 0 * x])
    height = np.array([0.5, 2.0, -0.5, -3.0])
    # An end has one neighbour, which counts for both.
    touching, lift = on_surface.contact(path, height, 0.5)
    assert touching == pytest.approx((2.0 + 6.0) / (2.0 + 3.0 + 6.0 + 8.0))
    assert lift == 2.0


def test_tilt_is_the_angle_by_which_the_tool_was_turned():
    point, e_u, e_v = on_sphere(stroke())
    normal = np.cross(e_u, e_v)
    upright = np.stack([e_u, -e_v, -normal], axis=-1)
    assert on_surface.tilt(upright, normal).max() < 1e-9
    angle = np.linspace(0.0, 3.0, len(point))
    turned = rotations.exp(angle[:, None] * e_u) @ upright
    assert on_surface.tilt(turned, normal) == pytest.approx(angle, abs=1e-9)


def test_stretch_is_one_on_a_cylinder_and_the_cosine_on_a_parallel():
    uv = stroke(n=4001)
    assert on_surface.stretch(on_cylinder(uv)[0], uv) == pytest.approx(1.0, abs=1e-6)
    parallel = np.column_stack([np.linspace(0, LENGTH, 2001), np.full(2001, 25.0)])
    pieces = on_surface.stretch(on_sphere(parallel)[0], parallel)
    assert len(pieces) == on_surface.PIECES
    assert pieces == pytest.approx(np.cos(25.0 / R), abs=1e-6)


def test_stretch_bears_samples_at_rest():
    uv = np.repeat(stroke(), [50] + [1] * 399 + [50], axis=0)
    assert on_surface.stretch(on_cylinder(uv)[0], uv) == pytest.approx(1.0, abs=1e-3)
