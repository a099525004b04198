"""Smoothness: closed forms of the minimum-jerk reach, invariances, order of what is smoother."""

import numpy as np
import pytest
from scipy.integrate import quad

from dmpcli.metrics import motion
from tests.minimum_jerk import minimum_jerk


def log_dimensionless_jerk(t, position, **more):
    return float(motion.log_dimensionless_jerk(t, position.T[:, None], **more)[0])


def spectral_arc_length(t, position, **more):
    return float(motion.spectral_arc_length(t, position.T[:, None], **more)[0])


def reach(n=1001, T=1.0, amplitude=100.0):
    s = np.linspace(0, 1, n)
    x = amplitude * minimum_jerk(s)
    return T * s, np.column_stack([x, 0.5 * x, 0 * x])


def test_a_minimum_jerk_reach_has_its_closed_form():
    # 720 A²/T⁵ of squared jerk over a peak speed of 1.875 A/T.
    assert log_dimensionless_jerk(*reach()) == pytest.approx(-np.log(720 / 1.875**2), abs=2e-2)
    finer = log_dimensionless_jerk(*reach(4001), cutoff=None)
    assert finer == pytest.approx(-np.log(720 / 1.875**2), abs=1e-3)


def test_a_sine_has_its_closed_form():
    t = np.linspace(0, 2.0, 2001)
    p = 30 * np.sin(2 * np.pi * t)[:, None]
    # T³/v² ∫j² = T³ w⁶ (T/2) / w²
    expected = -np.log(2.0**3 * (2 * np.pi) ** 4)
    assert log_dimensionless_jerk(t, p, cutoff=None) == pytest.approx(expected, abs=2e-3)


@pytest.mark.parametrize(("T", "amplitude"), [(3.0, 100.0), (1.0, 0.01), (10.0, 700.0)])
def test_amplitude_and_duration_do_not_matter(T, amplitude):
    other = reach(T=T, amplitude=amplitude)
    assert log_dimensionless_jerk(*other, cutoff=None) == pytest.approx(
        log_dimensionless_jerk(*reach(), cutoff=None), abs=1e-6
    )
    # The padded length, and with it the spectrum's resolution, depends on the samples alone.
    assert spectral_arc_length(*other, cutoff=10 / T) == pytest.approx(
        spectral_arc_length(*reach()), abs=1e-3
    )


@pytest.mark.slow
def test_sparc_of_a_minimum_jerk_reach_is_that_of_its_fourier_transform():
    def magnitude(f):
        def speed(s):
            return 30 * s**2 * (1 - s) ** 2

        re = quad(lambda s: speed(s) * np.cos(2 * np.pi * f * s), 0, 1)[0]
        im = quad(lambda s: speed(s) * np.sin(2 * np.pi * f * s), 0, 1)[0]
        return np.hypot(re, im)

    f = np.linspace(0, 10, 2001)
    M = np.array([magnitude(x) for x in f])
    last = np.flatnonzero(M >= 0.05)[-1]
    f, M = f[: last + 1] / f[last], M[: last + 1]
    expected = -np.sum(np.hypot(np.diff(f), np.diff(M)))
    assert spectral_arc_length(*reach()) == pytest.approx(expected, abs=0.02)


def test_sampling_rate_and_uneven_times_hardly_matter():
    t, p = reach(n=1001, T=5.0)
    rng = np.random.default_rng(4)
    pick = np.sort(np.concatenate([[0, 1000], rng.choice(np.arange(1, 1000), 700, replace=False)]))
    for measure in (log_dimensionless_jerk, spectral_arc_length):
        assert measure(t[pick], p[pick]) == pytest.approx(measure(t, p), abs=0.5)
        assert measure(t[::5], p[::5]) == pytest.approx(measure(t, p), abs=0.1)


def test_stick_and_slip_is_less_smooth_than_the_reach_by_both_measures():
    t, p = reach(n=501, T=10.0)
    jerky = p + 2.0 * np.round(p / 10.0)
    for measure in (log_dimensionless_jerk, spectral_arc_length):
        assert measure(t, jerky) < measure(t, p) - 0.5


def test_noise_above_the_cutoff_hardly_counts():
    t, p = reach(n=5001, T=10.0)
    noisy = p + 0.05 * np.sin(2 * np.pi * 40 * t)[:, None]
    assert log_dimensionless_jerk(t, noisy) == pytest.approx(log_dimensionless_jerk(t, p), abs=0.2)
    assert log_dimensionless_jerk(t, noisy, cutoff=None) < log_dimensionless_jerk(t, p) - 5


def test_standing_still_has_no_smoothness():
    t = np.linspace(0, 1, 100)
    assert np.isnan(log_dimensionless_jerk(t, np.zeros((100, 3))))
    assert np.isnan(spectral_arc_length(t, np.zeros((100, 3))))


def slow_and_rough(n=120, dt=0.05):
    """Strokes of 20 Hz, too few to filter: smooth, rough, lopsided, and one at rest."""
    rng = np.random.default_rng(8)
    s = np.linspace(0.0, 1.0, n)
    smooth = np.stack([80 * minimum_jerk(s), 9 * np.sin(np.pi * s), 0 * s])
    rough = np.cumsum(rng.standard_normal((3, n)), axis=1)
    lopsided = np.stack([50 * s**4, 20 * s**3, s])
    return dt * np.arange(n), np.stack([smooth, rough, lopsided, np.ones((3, n))], axis=1)


def sparc_as_published(speed, rate, cutoff=10.0, padding=4, threshold=0.05):
    """Balasubramanian, Melendez-Calderon, Burdet 2012, with 2015's cut by amplitude."""
    size = int(2 ** (np.ceil(np.log2(len(speed))) + padding))
    f, share = np.arange(size) * rate / size, np.abs(np.fft.fft(speed, size))
    share, f = share[f <= cutoff] / share.max(), f[f <= cutoff]
    last = np.flatnonzero(share >= threshold)[-1]
    f, share = f[: last + 1] / f[last], share[: last + 1]
    return -np.sum(np.hypot(np.diff(f), np.diff(share)))


def test_sparc_of_many_strokes_is_the_published_one_of_each():
    t, strokes = slow_and_rough()
    found = motion.spectral_arc_length(t, strokes)
    assert np.isnan(found[3])
    for i in range(3):
        speed = np.linalg.norm(np.diff(strokes[:, i]), axis=0) / 0.05
        assert found[i] == pytest.approx(sparc_as_published(speed, 20.0), rel=1e-9)
        alone = motion.spectral_arc_length(t, strokes[:, i : i + 1])
        assert found[i] == pytest.approx(alone[0], rel=1e-9)


def test_jerk_of_many_strokes_is_that_of_each_by_finite_differences():
    t, strokes = slow_and_rough()
    found = motion.log_dimensionless_jerk(7.0 + t, strokes)
    assert np.isnan(found[3])
    for i in range(3):
        jerk = np.diff(strokes[:, i], 3).T / 0.05**3
        squared = np.sum(jerk**2, axis=1)
        # From one end to the other: the first and the last value hold for a sample more.
        integral = 0.05 * np.sum(squared[np.clip(np.arange(-1, len(jerk) + 1), 0, len(jerk) - 1)])
        peak = np.max(np.linalg.norm(np.diff(strokes[:, i]).T, axis=1)) / 0.05
        assert found[i] == pytest.approx(-np.log(t[-1] ** 3 * integral / peak**2), rel=1e-9)


def test_a_movement_is_as_smooth_backwards():
    t, strokes = slow_and_rough()
    for measure in (motion.log_dimensionless_jerk, motion.spectral_arc_length):
        back = measure(t, strokes[..., ::-1])
        assert back == pytest.approx(measure(t, strokes), rel=1e-9, nan_ok=True)


def test_uneven_samples_of_a_polyline_are_read_on_it():
    """Corners are samples at the even times, so that what lies between changes nothing."""
    t, strokes = slow_and_rough()
    rng = np.random.default_rng(2)
    even = np.linspace(0.0, t[-1], 2 * len(t) - 1)
    finer = np.sort(np.concatenate([t, t[:-1] + rng.uniform(0.005, 0.045, len(t) - 1)]))
    read = np.stack([[np.interp(finer, t, row) for row in part] for part in strokes])
    at_even = np.stack([[np.interp(even, t, row) for row in part] for part in strokes])
    found = motion.log_dimensionless_jerk(finer, read, cutoff=None)
    expected = motion.log_dimensionless_jerk(even, at_even, cutoff=None)
    assert found == pytest.approx(expected, rel=1e-6, nan_ok=True)


def test_a_spectrum_is_read_up_to_its_cutoff_and_that_line_too():
    """Of 16 Hz the line at half the rate is the last, and loud where a stroke goes by jerks."""
    t = np.arange(33) / 16.0
    jerky = np.cumsum(np.where(np.arange(33) % 2, 3.0, 1.0))
    strokes = np.stack([jerky, 0.5 * jerky, 0 * jerky])[:, None]
    speed = np.linalg.norm(np.diff(strokes[:, 0]), axis=0) * 16.0
    for cutoff in (8.0, 7.5):
        found = motion._sparc(1 / 16.0, strokes, cutoff)[0]
        assert found == pytest.approx(sparc_as_published(speed, 16.0, cutoff), rel=1e-9)
    assert motion._sparc(1 / 16.0, strokes, 8.0)[0] < motion._sparc(1 / 16.0, strokes, 7.5)[0]
    assert (
        motion.spectral_arc_length(t, strokes, 8.0)[0] == motion._sparc(1 / 16.0, strokes, 8.0)[0]
    )


def test_the_arc_ends_at_the_last_loud_line():
    spectra = np.array([[1, 0.5, 0.04, 0], [1, 0.04, 0.05, 0], [1, 0.01, 0, 0], [1, 0.8, 0.6, 0.5]])
    found = motion._arc(spectra)
    assert found[0] == pytest.approx(-np.hypot(1.0, 0.5))
    assert found[1] == pytest.approx(-np.hypot(0.5, 0.96) - np.hypot(0.5, 0.01))
    assert np.isnan(found[2])
    assert found[3] == pytest.approx(-sum(np.hypot(1 / 3, d) for d in (0.2, 0.2, 0.1)))


def test_no_line_is_loud_beyond_the_one_that_is_told():
    """However few samples, and at the ends of a stroke that begins and stops at once."""
    rng = np.random.default_rng(5)
    for n in (5, 16, 61):
        speed = np.abs(np.cumsum(rng.normal(size=(6, n)), axis=1)) + [
            [0.0],
            [9],
            [0],
            [9],
            [0],
            [9],
        ]
        size = 16 * 2 ** int(np.ceil(np.log2(n)))
        told = motion._loud_at_most(motion._roughness(speed), speed.sum(axis=1), size)
        spectrum = np.abs(np.fft.rfft(speed, size)) / speed.sum(axis=1)[:, None]
        last = np.array([np.flatnonzero(one >= 0.05)[-1] for one in spectrum])
        assert (last <= told).all()
        sine = 0.5 * np.sqrt(1.000001 * np.abs(np.diff(np.pad(speed, ((0, 0), (2, 2))), 2)).sum(1)
                             / (0.05 * speed.sum(axis=1)))  # fmt: skip
        bound = np.where(sine < 1, np.arcsin(np.minimum(sine, 1)) / np.pi, 0.5) * size
        np.testing.assert_allclose(told, np.ceil(bound))
