"""The picture of a part: what is seen, by a ray through each pixel."""

import numpy as np
import pytest

from dmpcli.reporting.raster import Camera, rendered
from dmpcli.surfaces.sharp_edges import sharp_edges

CUBE = np.array([[x, y, z] for x in (0.0, 40.0) for y in (0.0, 40.0) for z in (0.0, 40.0)])
SIDES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]]
    + [[2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)


def camera(scale=1.0):
    toward = np.array([2.0, -3.0, 2.5]) / np.linalg.norm([2.0, -3.0, 2.5])
    right = np.cross([0.0, 0.0, 1.0], toward)
    right /= np.linalg.norm(right)
    up = np.cross(toward, right)
    return Camera(right, up, toward, np.array([-40.0, -40.0]), np.array([120.0, 110.0]), scale)


def along_rays(corners, view):
    """Depth at each pixel by intersecting its ray with every triangle (Möller and Trumbore)."""
    h, w = view.shape
    best = np.full((h, w), -np.inf)
    a, b, c = (corners[:, k] for k in range(3))
    p = np.cross(view.toward, c - a)
    size = np.sum((b - a) * p, axis=1)
    for row, column in np.ndindex(h, w):
        at = view.low + (np.array([column, row]) + 0.5) / view.scale
        s = at[0] * view.right + at[1] * view.up - a
        q = np.cross(s, b - a)
        with np.errstate(divide="ignore", invalid="ignore"):
            u, v = np.sum(s * p, axis=1) / size, q @ view.toward / size
            depth = np.sum((c - a) * q, axis=1) / size
        met = (np.abs(size) >= 1e-12) & (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0)
        best[row, column] = depth[met].max(initial=-np.inf)
    return best


def test_each_pixel_shows_what_a_ray_through_it_meets_first():
    # Across the corner of the cube leans a second sheet, so that much is hidden.
    sheet = np.array([[[-10.0, -8.0, 10.0], [50.0, -5.0, 12.0], [20.0, 30.0, 60.0]]])
    corners = np.concatenate([CUBE[SIDES], sheet])
    view = camera(0.35)
    picture = rendered(corners, view)
    expected = along_rays(corners, view)
    assert picture.depth == pytest.approx(expected, abs=1e-9)
    assert picture.there[np.isfinite(expected)].all()


def test_what_lies_behind_is_hidden_and_what_lies_before_is_not():
    view = camera(4.0)
    picture = rendered(CUBE[SIDES], view)
    middle = np.array([[20.0, 20.0, 20.0]])
    assert picture.hides(view, middle, 0.5).tolist() == [True]
    assert picture.hides(view, middle + 60.0 * view.toward, 0.5).tolist() == [False]
    assert picture.hides(view, np.array([[20.0, 0.0, 20.0]]), 0.5).tolist() == [False]


def test_a_cube_has_twelve_edges_and_an_open_box_its_border():
    edges = sharp_edges(CUBE, SIDES)
    assert np.sort(np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)) == pytest.approx([40.0] * 12)
    assert len(sharp_edges(CUBE, SIDES[2:4])) == 4
