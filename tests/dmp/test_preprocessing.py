"""From a recording to a smooth stroke, as a whole."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from dmpcli.dmp.preprocessing import preprocess
from dmpcli.errors import InputError
from dmpcli.spatial import rotations
from dmpcli.spatial.trajectory import Trajectory
from tests.dmp.recordings import jerk, noisy, six_seconds, times, wave, with_approach
from tests.dmp.strokes import paper_stroke


def nearest(points, truth):
    return cKDTree(truth).query(points)[0]


def height(result):
    return np.ptp(result.position(np.linspace(0.0, result.duration, 2001))[:, 1])


@pytest.mark.slow
def test_half_a_millimetre_of_noise_over_thirty_seeds():
    t, truth = six_seconds()
    dense = wave(np.linspace(0.0, 1.0, 4001))
    ends, rms = [], []
    for seed in range(30):
        result = preprocess(Trajectory(t, noisy(truth, 0.5, seed)))
        drawn = result.position(np.linspace(0.0, result.duration, 200))
        rms.append(np.sqrt(np.mean(nearest(drawn, dense) ** 2)))
        ends += [np.linalg.norm(drawn[0] - truth[0]), np.linalg.norm(drawn[-1] - truth[-1])]
    assert np.median(ends) <= 0.4
    assert np.quantile(ends, 0.9) <= 0.75
    assert max(ends) <= 1.2
    assert max(rms) <= 0.15


@pytest.mark.parametrize("sigma", [0.02, 0.1, 0.3])
def test_rest_before_and_after_is_cut_off_and_told(sigma):
    t = np.arange(2000) / 100
    result = preprocess(Trajectory(t, noisy(wave(jerk((t - 7) / 6)), sigma)))
    assert result.duration == pytest.approx(6.0, abs=0.4)
    assert result.trimmed == (pytest.approx(7.0, abs=0.3), pytest.approx(7.0, abs=0.3))
    assert sum(result.trimmed) + result.duration == pytest.approx(t[-1])
    assert result.sigma == pytest.approx(sigma, rel=0.15)
    whole = preprocess(Trajectory(t, noisy(wave(jerk((t - 7) / 6)), sigma)), trim=False)
    assert whole.duration == pytest.approx(t[-1])


def test_approach_and_retract_once_cut_leave_the_wave():
    _, truth = six_seconds()
    t, joined = with_approach(truth, 60, 60)
    stroke = Trajectory(t + 100.0, joined)
    told = preprocess(stroke)
    cut = preprocess(stroke, start=told.approach[1], until=told.retract[0])
    # What was cut off as it was told is not told again.
    assert (cut.approach, cut.retract) == (None, None)
    assert height(cut) == pytest.approx(50.0, abs=0.2)
    assert np.abs(cut.position(np.linspace(0, cut.duration, 500))[:, 2]).max() < 0.2


@pytest.mark.sweep(kept=2)
@pytest.mark.slow
@pytest.mark.parametrize("sigma", [0.0, 0.01, 0.1])
def test_a_pause_once_cut_leaves_the_wave(sigma):
    _, truth = six_seconds()
    points = np.r_[truth[:300], np.tile(truth[300], (500, 1)), truth[300:]]
    stroke = Trajectory(np.arange(len(points)) / 100, noisy(points, sigma))
    told = preprocess(stroke)
    assert told.pauses == ((pytest.approx(3.0, abs=0.1), pytest.approx(8.0, abs=0.1)),)
    assert told.duration > 10.0
    cut = preprocess(stroke, cut_pauses=True)
    assert cut.pauses == told.pauses
    assert cut.duration == pytest.approx(6.0, abs=0.3)
    assert height(cut) == pytest.approx(50.0, abs=0.2)
    t = np.linspace(0.0, cut.duration, 1000)
    speed = np.linalg.norm(cut.position(t, 1), axis=1).max()
    true = np.linalg.norm(np.gradient(truth, 0.01, axis=0), axis=1).max()
    assert speed <= 1.05 * true


def test_eleven_good_samples_are_interpolated():
    t = times(6.0)
    result = preprocess(Trajectory(t[::60], wave(jerk(t[::60] / 6), 100, 20)))
    assert result.cutoff is None
    assert result.position.noise.kind == "unknown"
    at = np.linspace(0.0, result.duration, 500)
    true = wave(jerk((at + result.trimmed[0]) / 6), 100, 20)
    assert np.linalg.norm(result.position(at) - true, axis=1).max() <= 0.1


def test_orientation_is_smoothed_by_its_own_noise_and_turns_with_the_recording():
    t, truth = six_seconds()
    angles = np.column_stack([np.pi + 0.3 * np.sin(t), 0.2 * np.cos(t), 0.4 * t])
    R = rotations.from_euler(angles)
    rng = np.random.default_rng(4)
    noisy_R = rotations.exp(rng.normal(0.0, 0.01, (len(t), 3))) @ R
    stroke = Trajectory(t, noisy(truth, 0.1), noisy_R)
    result = preprocess(stroke, trim=False)
    off = np.linalg.norm(rotations.log(np.swapaxes(R, 1, 2) @ result.rotation(t)), axis=1)
    assert np.sqrt(np.mean(off**2)) <= 0.005
    Q = rotations.from_euler(np.array([0.4, -1.0, 2.0]))
    turned = preprocess(Trajectory(t, stroke.position @ Q.T + 100.0, Q @ noisy_R), trim=False)
    np.testing.assert_allclose(turned.rotation(t), Q @ result.rotation(t), atol=1e-9)
    np.testing.assert_allclose(turned.position(t), result.position(t) @ Q.T + 100.0, atol=1e-9)


def test_a_turn_through_all_angles_is_smoothed_without_a_jump():
    t = times(8.0)
    R = rotations.exp(np.column_stack([0 * t, 0 * t, 1.5 * t])) @ np.diag([1.0, -1.0, -1.0])
    result = preprocess(Trajectory(t, wave(t / 8.0), R), trim=False)
    off = np.linalg.norm(rotations.log(np.swapaxes(R, 1, 2) @ result.rotation(t)), axis=1)
    assert off.max() < 1e-6


def test_gaps_and_times_are_those_of_the_recording():
    t, truth = six_seconds()
    kept = (t < 2.0) | (t > 2.4)
    result = preprocess(Trajectory(t[kept] + 50.0, truth[kept]))
    assert result.gaps == ((pytest.approx(1.99), pytest.approx(2.41)),)


def test_what_does_not_move_or_is_cut_to_nothing_is_refused():
    t, truth = six_seconds()
    with pytest.raises(InputError, match="does not move"):
        preprocess(Trajectory(t, np.tile(truth[0], (len(t), 1))))
    with pytest.raises(InputError, match=r"from 5\.95 s: 6 samples"):
        preprocess(Trajectory(t, truth), start=5.95)
    with pytest.raises(InputError, match="0 samples"):
        preprocess(Trajectory(t, truth), start=4.0, until=3.0)


def test_a_long_recording_is_smoothed_as_a_short_one():
    t = np.arange(40_001) / 1000
    truth = np.column_stack([5.0 * t, 20.0 * np.sin(2 * np.pi * 0.2 * t), 0 * t])
    result = preprocess(Trajectory(t, noisy(truth, 0.1)), trim=False)
    assert np.linalg.norm(result.position(t) - truth, axis=1).max() <= 0.1
    assert result.sigma == pytest.approx(0.1, rel=0.02)


def test_shares_of_the_band_are_of_half_the_sampling_rate():
    stroke = paper_stroke(801)
    assert preprocess(stroke).half_rate == pytest.approx(40.0)
