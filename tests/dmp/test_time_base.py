"""Even grids from time stamps as they come."""

import numpy as np
import pytest

from dmpcli.dmp import smoothing, time_base
from dmpcli.spatial import rotations
from dmpcli.spatial.trajectory import Trajectory
from tests.dmp.recordings import jerk, noisy, six_seconds, wave


def bursts(first=7, pause=14):
    """Stamps of 1 ms in a burst, then ones 0.2 s apart, twice."""
    one = np.r_[np.arange(first) * 1e-3, (first - 1) * 1e-3 + 0.2 * np.arange(1, pause + 1)]
    return np.r_[one, one[-1] + one[1:]]


def off_polyline(points, line):
    """Largest distance of points from a polyline."""
    a, b = line[:-1], line[1:]
    d = b - a
    s = np.einsum("ptd,td->pt", points[:, None] - a, d) / np.maximum(np.sum(d * d, 1), 1e-30)
    foot = a + np.clip(s, 0, 1)[..., None] * d
    return np.linalg.norm(points[:, None] - foot, axis=2).min(axis=1).max()


def test_even_recordings_keep_their_samples_to_the_last_bit():
    t, points = six_seconds()
    R = rotations.exp(np.column_stack([t, 0 * t, 0.2 * t]))
    base = time_base.even(Trajectory(t + 3.0, points, R))
    today = smoothing.evenly_sampled(Trajectory(t + 3.0, points, R))
    assert base.stroke.t.tobytes() == today.t.tobytes()
    assert base.stroke.position is points
    assert base.stroke.rotation is R
    assert base.origin == 3.0
    assert (base.gaps, base.merged, base.resampled) == ((), 0, False)


@pytest.mark.parametrize("seed", range(5))
def test_a_burst_and_noise_do_not_overshoot(seed):
    t = bursts()
    points = noisy(wave(jerk(t / t[-1]), 120, 12), 0.15, seed)
    base = time_base.even(Trajectory(t, points))
    assert base.merged == 12
    assert off_polyline(base.stroke.position, points) <= 0.4
    low, high = points.min(axis=0), points.max(axis=0)
    assert np.all((base.stroke.position >= low) & (base.stroke.position <= high))


def test_a_burst_becomes_one_sample_at_its_mean():
    t = np.r_[0.0, 0.1, 0.2, 0.3, 0.4, 0.401, 0.402, 0.5, 0.6, 0.7]
    x = np.arange(10.0)
    R = rotations.exp(np.column_stack([0.01 * x, 0 * x, 0 * x]))
    base = time_base.even(Trajectory(t, np.column_stack([x, 0 * x, 0 * x]), R))
    assert base.merged == 2
    assert len(base.stroke.t) == 8
    assert np.interp(0.401, base.stroke.t, base.stroke.position[:, 0]) == pytest.approx(
        5.0, abs=0.1
    )
    assert rotations.log(base.stroke.rotation)[4, 0] == pytest.approx(0.05, abs=0.002)


def test_a_log_that_is_bursts_throughout_keeps_one_sample_for_each():
    starts = np.arange(60) * 0.1
    t = (starts[:, None] + np.arange(8) * 1e-4).ravel()
    base = time_base.even(Trajectory(t, wave(t / t[-1])))
    assert base.merged == 60 * 7
    assert len(base.stroke.t) == 60
    assert np.abs(base.stroke.position - wave((base.stroke.t + base.origin) / t[-1])).max() < 1e-5


def test_a_faster_stretch_is_thinned_out_and_not_put_in_one_place():
    t = np.r_[np.arange(0.0, 1.0, 0.001), np.arange(1.0, 61.0, 0.01)]
    base = time_base.even(Trajectory(t, wave(t / t[-1])))
    assert np.abs(base.stroke.position - wave((base.stroke.t + base.origin) / t[-1])).max() < 0.01


def test_a_gap_is_filled_and_told_with_its_times():
    t, points = six_seconds()
    kept = (t < 2.0) | (t > 2.5)
    base = time_base.even(Trajectory(t[kept] + 10.0, points[kept]))
    assert base.gaps == ((pytest.approx(11.99), pytest.approx(12.51)),)
    assert len(base.stroke.t) == len(t)
    assert np.abs(base.stroke.position - points).max() < 2.0


def test_jittered_stamps_are_interpolated_within_the_neighbours():
    t, _ = six_seconds()
    t = t + np.random.default_rng(0).uniform(-0.003, 0.003, len(t))
    base = time_base.even(Trajectory(t, wave(jerk(t / 6.0))))
    truth = wave(jerk((base.stroke.t + base.origin) / 6.0))
    assert base.resampled
    assert np.abs(base.stroke.position - truth).max() < 0.02


def test_quaternions_of_a_path_have_no_jump():
    angle = np.linspace(0.0, 12.0, 200)
    R = rotations.exp(np.column_stack([angle, 0 * angle, 0 * angle]))
    q = time_base.continuous_quaternions(R)
    assert np.linalg.norm(np.diff(q, axis=0), axis=1).max() < 0.05
    np.testing.assert_allclose(rotations.from_quaternion(q), R, atol=1e-12)
