"""The acceleration of what is drawn, by the noise-free stroke and by scipy's least squares."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from dmpcli.dmp import least_acceleration, noise
from dmpcli.dmp.noise import Noise
from dmpcli.dmp.spline_smoothing import smooth
from tests.dmp.recordings import blended, corners, noisy, six_seconds, times


def white(sigma, axes=3):
    return Noise(np.eye(axes), np.full(axes, sigma))


def bends(y):
    return np.linalg.norm(np.diff(y, 2, axis=0), axis=1)


def turned(seconds, law, rate=100.0, angle=90.0, speed=60.0, seed=0):
    """Two to four turns, each within so many seconds by a law of its own: times, points, peak."""
    rng = np.random.default_rng(seed)
    lasts = rng.uniform(0.6, 1.2, int(rng.integers(3, 6)))
    t = times(lasts.sum(), rate)
    # Integrated on a grid twenty times as fine.
    fine = np.arange(20 * (len(t) - 1) + 1) / (20.0 * rate)
    heading = np.zeros_like(fine)
    for end, sign in zip(np.cumsum(lasts)[:-1], rng.choice([-1.0, 1.0], len(lasts)), strict=False):
        heading += sign * np.radians(angle) * law(np.clip((fine - end) / seconds + 0.5, 0.0, 1.0))
    v = speed * np.column_stack([np.cos(heading), np.sin(heading), 0.0 * fine])
    way = np.cumsum(0.5 * (v[1:] + v[:-1]), axis=0) / (20.0 * rate)
    points = np.concatenate([np.zeros((1, 3)), way])[::20]
    peak = np.linalg.norm(np.gradient(v, fine, axis=0), axis=1).max()
    return t, points, peak


LAWS = {
    "arc": lambda u: u,
    "clothoid": lambda u: np.where(u < 0.5, 2.0 * u**2, 1.0 - 2.0 * (1.0 - u) ** 2),
    "minimum jerk": lambda u: u**3 * (10.0 - 15.0 * u + 6.0 * u**2),
}


def ratios(t, truth, peak, sigma, seed):
    """Of the peak acceleration to the true one, and errors by σ: RMS and largest."""
    points = noisy(truth, sigma, seed)
    spline = smooth(points, float(t[-1]), noise.estimate(points))
    off = np.linalg.norm(spline(t) - truth, axis=1) / sigma
    acceleration = np.linalg.norm(spline(t, 2), axis=1).max()
    return acceleration / peak, float(np.sqrt(np.mean(off**2))), off.max()


@pytest.mark.sweep(kept=1)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("seconds", "sigma"), [(0.1, 0.5), (0.1, 0.1), (0.15, 0.5), (0.2, 0.1), (0.3, 0.1)]
)
def test_a_rounded_corner_is_accelerated_as_much_as_in_truth(seconds, sigma):
    for seed in range(9510, 9522):
        acceleration, rms, largest = ratios(*blended(seed, seconds), sigma, seed)
        assert acceleration <= 1.5
        assert rms <= 1.0
        assert largest <= 4.0


@pytest.mark.sweep(kept=1)
@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("rate", [100.0, 400.0])
def test_turns_of_other_shapes_are_accelerated_as_much_as_in_truth(law, rate):
    for seed, angle in enumerate([30.0, 60.0, 90.0, 120.0]):
        t, truth, peak = turned(0.15, LAWS[law], rate, angle, seed=seed)
        acceleration, rms, largest = ratios(t, truth, peak, 0.2, seed)
        assert acceleration <= 1.5
        assert rms <= 1.0
        assert largest <= 4.0


def test_what_follows_the_noise_is_drawn_straight():
    """A line, with a piece that swings by a part of the noise within a few samples."""
    j = np.arange(200.0)
    line = np.column_stack([0.5 * j, 0.2 * j, 0.0 * j])
    swings = line.copy()
    swings[98:103, 1] += 0.3 * np.sin(0.5 * np.pi * np.arange(5))
    calm = least_acceleration.calmed(noisy(line, 0.5, 3), swings, white(0.5))
    assert bends(calm).max() < 0.1 * bends(swings).max()
    np.testing.assert_allclose(calm[:40], swings[:40], atol=1e-12)


@pytest.mark.parametrize("sigma", [0.01, 0.02])
def test_a_corner_that_the_samples_tell_stays(sigma):
    j = np.arange(201.0)
    sharp = np.column_stack([0.5 * j, 0.9 * np.maximum(j - 100.0, 0.0), 0.0 * j])
    assert least_acceleration.calmed(noisy(sharp, sigma, 1), sharp, white(sigma)) is None


def test_no_sample_goes_off_by_more_than_it_tells():
    """And where no more is known, a corner is rounded: an arm is accelerated the less."""
    j = np.arange(201.0)
    sharp = np.column_stack([0.5 * j, 0.9 * np.maximum(j - 100.4, 0.0), 0.0 * j])
    for seed in range(10):
        points = noisy(sharp, 0.5, seed)
        calm = least_acceleration.calmed(points, sharp, white(0.5))
        off = np.linalg.norm(calm - sharp, axis=1).max()
        lost = (np.sum((points - calm) ** 2) - np.sum((points - sharp) ** 2)) / 0.25
        # By 1.5 σ, and by 2.5 where the samples are as near to it.
        assert off <= (0.75 if lost > 1.0 else 1.25)
        assert lost <= 6.0
        assert bends(calm).max() < 0.7 * bends(sharp).max()


@pytest.mark.parametrize("rate", [100.0, 1000.0])
def test_what_is_smooth_stays_as_it_is(rate):
    _, truth = six_seconds(rate)
    for sigma in (0.02, 0.5):
        assert least_acceleration.calmed(noisy(truth, sigma, 0), truth, white(sigma)) is None


@pytest.mark.parametrize("kind", ["band", "quantised", "unknown"])
def test_of_noise_that_is_not_white_a_sample_says_little(kind):
    _, truth = corners()
    found = Noise(np.eye(3), np.full(3, 0.5), kind)
    assert least_acceleration.calmed(truth, truth, found) is None


@pytest.mark.parametrize("cap", [0.5, 0.2, 0.1])
def test_multipliers_are_those_of_the_nearest_stroke_within_a_cap(cap):
    """Against bounded least squares: a line of two coefficients, and second differences between."""
    rng = np.random.default_rng(4)
    j = np.arange(42.0)
    y = np.maximum(j - 20.3, 0.0) + 0.05 * np.cumsum(rng.normal(size=42)) * (np.abs(j - 20) < 4)
    given = np.diff(y, 2)[:, None]
    [u] = least_acceleration._multipliers([given], np.array([cap]), np.array([np.inf]))
    nearest = y - np.convolve(u[:, 0], [1.0, -2.0, 1.0])
    A = np.column_stack([np.ones(42), j, *np.maximum(j - np.arange(1.0, 41.0)[:, None], 0.0)])
    most = np.r_[np.inf, np.inf, np.full(40, cap)]
    right = A @ lsq_linear(A, y, (-most, most), tol=1e-12).x
    assert np.abs(np.diff(nearest, 2)).max() <= 1.06 * cap
    assert np.sum((nearest - right) ** 2) <= 0.03 * np.sum((y - right) ** 2)


def test_caps_that_go_off_too_far_are_rejected_with_others_or_alone():
    j = np.arange(60.0)
    given = np.diff(np.maximum(j - 30.0, 0.0), 2)[:, None]
    other = 0.3 * given
    caps, limits = np.array([0.2, 0.2]), np.array([0.01, 10.0])
    found = least_acceleration._multipliers([given, other], caps, limits)
    assert found[0] is None
    [alone] = least_acceleration._multipliers([other], caps[1:], limits[1:])
    np.testing.assert_allclose(found[1], alone, atol=1e-12)


def test_a_wide_window_changes_as_its_means_are_multiplied():
    """By cubic B-splines: the fourth differences of multipliers are the change's second ones."""
    window = least_acceleration._Window.over(100, 740, 2000)
    u = np.sin(np.linspace(0.0, np.pi, window.count))[:, None] ** 4
    change = window.change(u)
    assert change.shape == (642, 1)
    wide = np.pad(u[:, 0], 2)
    fourth = np.convolve(wide, [1.0, -4.0, 6.0, -4.0, 1.0], "same")[2:-2]
    middles = window.begin + 0.5 * (window.each - 1) + window.each * np.arange(window.count)
    at = np.arange(window.low, window.high)
    expected = np.interp(at, middles, -fourth)
    inside = (at >= middles[2]) & (at <= middles[-3])
    second = np.diff(change[:, 0], 2)
    assert np.abs(second - expected)[inside].max() <= 0.02 * np.abs(fourth).max()
    assert np.abs(change[[0, -1]]).max() <= 1e-9
