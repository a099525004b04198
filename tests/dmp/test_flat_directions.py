"""Directions that hold nothing but noise, and those that hold a little more."""

import numpy as np
import pytest
from scipy.special import chdtri

from dmpcli.dmp import noise
from dmpcli.dmp.flat_directions import _flat, moving_axes
from dmpcli.spatial import rotations
from tests.dmp.recordings import corners, noisy, six_seconds

Q = rotations.from_euler(np.array([0.7, -0.4, 2.1]))


def moving(points):
    return moving_axes(points - points.mean(axis=0), noise.estimate(points))


def test_the_height_of_a_flat_stroke_is_flat_in_any_plane():
    _, truth = six_seconds()
    kept = [moving(noisy(truth, 0.1, seed) @ Q.T) for seed in range(30)]
    assert sum(axes.shape[1] == 2 for axes in kept) >= 29
    assert np.abs(kept[0].T @ Q[:, 2]).max() < 1e-3


def test_without_noise_a_height_that_only_rounding_makes_is_flat_in_any_plane():
    _, truth = corners()
    for Q_turned in (np.eye(3), Q, Q @ Q):
        assert moving(truth @ Q_turned.T).shape == (3, 2)
    bow = np.sin(np.linspace(0.0, np.pi, len(truth)))
    raised = truth + np.outer(bow, [0.0, 0.0, 1e-3])
    for Q_turned in (np.eye(3), Q):
        assert moving(raised @ Q_turned.T).shape == (3, 3)


@pytest.mark.parametrize(("height", "seconds"), [(0.2, 4.0), (0.5, 0.3), (1.0, 0.05)])
def test_a_bow_a_hop_and_a_spike_are_not(height, seconds):
    t, truth = six_seconds()
    lifted = truth.copy()
    lifted[:, 2] = height * np.exp(-(((t - 3.0) / (0.5 * seconds)) ** 2))
    for seed in range(10):
        assert moving(noisy(lifted, 0.1, seed)).shape == (3, 3)


def test_one_direction_is_always_kept():
    assert moving(noisy(np.zeros((200, 4)), 0.1)).shape == (4, 1)


@pytest.mark.parametrize("order", [1, 2, 512])
def test_one_cosine_is_motion_where_noise_would_hardly_have_its_power(order):
    """Octaves of 1024 samples: ten, and each may be taken for motion by a tenth of the chance."""
    count = 1024
    octave = 2 ** int(np.ceil(np.log2(order)))
    limit = chdtri(octave, 1e-3 / 10)
    cosine = np.cos(np.pi * order * (np.arange(count) + 0.5) / count)
    for part, flat in ((0.98, True), (1.02, False)):
        assert _flat(np.sqrt(part * limit * 2.0 / count) * cosine) == flat
