"""Smoothing of frames: ripple goes, constant turning stays, ends stay."""

import numpy as np
import pytest

from dmpcli.spatial import rotations
from dmpcli.surfaces import frame_smoothing
from tests.surfaces import cases, fields


def paths(B=3, T=400, total=120.0):
    s = fields.strokes(np.full(B, total), T, 0)[..., :1]
    return s, s * np.array([0.6, 0.0, 0.8])


def test_steady_turning_about_one_axis_is_kept_but_near_the_ends():
    s, position = paths()
    axes = rotations.exp(s / 80.0 * np.array([0.0, 1.0, 0.0]))
    out = frame_smoothing.smoothed(axes, position, 3.0)
    np.testing.assert_allclose(out, axes, atol=1e-5)
    np.testing.assert_array_equal(frame_smoothing.smoothed(axes, position, 0.0), axes)


def test_the_response_to_a_crease_is_that_of_a_gaussian_of_the_same_width():
    from scipy.stats import norm

    s, position = paths(2, 4000)
    angle = np.where(s < 60.0, 0.0, 0.4)
    axes = rotations.exp(angle * np.array([1.0, 0.0, 0.0]))
    out = frame_smoothing.smoothed(axes, position, 4.0)
    share = np.arctan2(out[0, :, 2, 1], out[0, :, 2, 2])
    part = norm.cdf(s[0, :, 0], 60.0, 4.0)
    expected = np.arctan2(part * np.sin(0.4), 1 - part + part * np.cos(0.4))
    np.testing.assert_allclose(share, expected, atol=0.01)
    np.testing.assert_allclose(out[:, [0, -1]], axes[:, [0, -1]], atol=1e-12)
    np.testing.assert_allclose(
        np.swapaxes(out, -1, -2) @ out, np.broadcast_to(np.eye(3), out.shape), atol=1e-12
    )


def test_the_turning_of_a_curved_surface_stays_and_ripple_goes():
    """A sine over wavelengths of 40 and 3 mm: a gain of 2 g - g², with g of three averages."""
    s = np.linspace(0.0, 120.0, 4001)[None, :, None]
    position = s * np.array([0.6, 0.0, 0.8])
    inside = slice(400, -400)
    for wavelength, size in ((40.0, 0.1), (3.0, 0.01)):
        turn = np.sin(2.0 * np.pi * s / wavelength)
        out = frame_smoothing.smoothed(
            rotations.exp(size * turn * np.array([1.0, 0.0, 0.0])), position, 2.0
        )
        gain = np.sinc(2.0 * 2.0 / wavelength) ** 3
        share = -np.arctan2(out[0, :, 1, 2], out[0, :, 2, 2])
        expected = size * (2.0 * gain - gain**2) * turn[0, :, 0]
        np.testing.assert_allclose(share[inside], expected[inside], atol=2e-3 * size)


def test_over_a_crease_frames_never_turn_beyond_either_side_by_more_than_six_tenths_of_a_degree():
    s, position = paths(1, 4000)
    for angle in np.radians([1.0, 5.0, 10.0, 20.0, 45.0, 89.0]):
        axes = rotations.exp(np.where(s < 60.0, 0.0, angle) * np.array([0.0, 1.0, 0.0]))
        out = frame_smoothing.smoothed(axes, position)
        turned = np.arctan2(out[0, :, 0, 2], out[0, :, 2, 2])
        beyond = max(-turned.min(), turned.max() - angle)
        assert beyond <= np.radians(0.6)


def test_a_path_alone_is_smoothed_as_among_others():
    _, position = paths()
    rng = np.random.default_rng(0)
    axes = rotations.exp(0.05 * rng.normal(size=position.shape))
    together = frame_smoothing.smoothed(axes, position)
    for i in range(3):
        one = frame_smoothing.smoothed(axes[i : i + 1], position[i : i + 1])
        np.testing.assert_allclose(one[0], together[i], atol=1e-9)


def test_standing_still_is_no_harm():
    s, position = paths()
    position[:, 100:200] = position[:, 100:101]
    position[2] = 0.0
    axes = rotations.exp(s / 80.0 * np.array([0.0, 1.0, 0.0]))
    assert np.isfinite(frame_smoothing.smoothed(axes, position)).all()


@pytest.mark.sweep(kept=3)
@pytest.mark.slow
@pytest.mark.parametrize("name", cases.SURFACES)
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_frames_of_meshes_turn_little_more_than_those_of_the_true_surface(name, noise):
    mesh, case = cases.mesh(name, 20_000), cases.case(name, 8)
    if noise:
        rng = np.random.default_rng(1)
        mesh = type(mesh)(mesh.V + noise * rng.normal(size=mesh.V.shape), mesh.F)
    _, lift = cases.drawn(mesh, case)
    raw, smooth = (
        cases.turns(a).max()
        for a in (lift.axes, frame_smoothing.smoothed(lift.axes, lift.position))
    )
    assert smooth <= 1.5 * cases.turns(case.axes).max() + 0.3
    assert smooth <= raw + 0.01
