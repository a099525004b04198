"""Wave heights: closed forms, scipy's find_peaks as oracle, invariances."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import find_peaks

from dmpcli.metrics.wave_height import ManyWaves, lateral, many_waves, stroke_wave, wave_heights
from tests.minimum_jerk import minimum_jerk

START = np.array([-551.030, 131.399, -17.560])
GOAL = np.array([-660.021, 130.034, -17.538])
UP = np.array([0.0, 0.0, 1.0])


def stroke(height=49.979, periods=1.0, n=501, start=START, goal=GOAL, normal=UP):
    s = np.linspace(0.0, 1.0, n)
    u = minimum_jerk(s)[:, None]
    v = np.cross(normal, goal - start)
    v /= np.linalg.norm(v)
    return start + u * (goal - start) + 0.5 * height * np.sin(2 * np.pi * periods * u) * v


def test_one_sine_period_has_exactly_one_height_of_twice_its_amplitude():
    wave = stroke_wave(stroke(), START, GOAL, UP)
    assert wave.heights == pytest.approx([49.979], abs=1e-4)
    assert wave.mean == pytest.approx(49.979, abs=1e-4)
    assert wave.spread == 0.0
    assert wave.value[0] > 0 > wave.value[1]


def test_the_parabola_finds_the_peak_between_samples():
    # Samples straddle the peak: the largest of them alone would be 0.03 mm short.
    x = (np.arange(40) + 0.5) * 0.16
    wave = wave_heights(25.0 * np.sin(x))
    assert wave.heights[0] == pytest.approx(50.0, abs=2e-3)
    assert np.ptp(25.0 * np.sin(x)) < 50.0 - 0.03
    assert wave.index * 0.16 + 0.08 == pytest.approx([np.pi / 2, 1.5 * np.pi], abs=2e-3)


def test_a_parabola_is_met_exactly_on_both_branches():
    x = np.linspace(-1.0, 1.0, 12) + 0.013
    wave = wave_heights(np.concatenate([x[::-1] ** 2, -(x[1:] ** 2) + 2 * x[0] ** 2]))
    assert wave.value[0] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("periods", [2, 3, 5])
def test_each_further_period_adds_two_heights(periods):
    wave = stroke_wave(stroke(periods=periods, n=2001), START, GOAL, UP)
    assert len(wave.heights) == 2 * periods - 1
    assert wave.heights == pytest.approx(np.full(2 * periods - 1, 49.979), abs=2e-3)


def test_tremor_and_overshoot_at_the_ends_are_no_extrema():
    rng = np.random.default_rng(1)
    path = stroke()
    path[:, 1] += 0.2 * rng.standard_normal(len(path))
    tail = np.linspace(0, np.pi, 40)[:, None] * 0 + GOAL
    tail[:, 1] += 2.0 * np.sin(np.linspace(0, 2 * np.pi, 40))
    wave = stroke_wave(
        np.vstack([START + 0.3 * rng.standard_normal((30, 3)), path, tail]), START, GOAL, UP
    )
    assert len(wave.heights) == 1
    assert wave.mean == pytest.approx(49.979, abs=1.5)


def test_a_line_and_a_single_arch_have_no_height():
    rng = np.random.default_rng(2)
    line = START + np.linspace(0, 1, 500)[:, None] * (GOAL - START)
    shaky = line + 0.1 * rng.standard_normal(line.shape)
    for path in (line, shaky, stroke(periods=0.5)):
        wave = stroke_wave(path, START, GOAL, UP)
        assert wave.heights.size == 0
        assert wave.mean is None
        assert wave.spread is None
    assert wave_heights(np.zeros(10)).heights.size == 0


def test_lateral_is_n_cross_u_whatever_the_normals_part_along_the_line():
    path = START + 7.0 * np.cross(UP, (GOAL - START) / np.linalg.norm(GOAL - START))
    assert lateral(path[None], START, GOAL, UP) == pytest.approx([7.0], abs=1e-3)
    tilted = UP + 0.4 * (GOAL - START) / np.linalg.norm(GOAL - START)
    assert lateral(stroke(), START, GOAL, tilted) == pytest.approx(
        lateral(stroke(), START, GOAL, UP)
    )
    assert lateral(stroke(), START, GOAL, -UP) == pytest.approx(-lateral(stroke(), START, GOAL, UP))


signals = st.lists(
    st.floats(-100, 100, allow_nan=False).map(lambda x: round(x, 3)),
    min_size=3,
    max_size=60,
    unique=True,
)


@pytest.mark.slow
@given(signals)
def test_extrema_are_those_of_scipys_prominence(values):
    v = np.array(values)
    least = 0.1 * np.ptp(v)
    peaks, _ = find_peaks(v, prominence=least)
    troughs, _ = find_peaks(-v, prominence=least)
    found = wave_heights(v).index
    expected = np.sort(np.concatenate([peaks, troughs]))
    assert len(found) == len(expected)
    # The parabola moves an extremum by half a sample at most.
    assert np.abs(found - expected).max(initial=0.0) <= 0.5 + 1e-9


@pytest.mark.slow
@given(signals, st.floats(0.01, 100), st.floats(-1000, 1000))
def test_heights_scale_with_the_signal_and_ignore_its_offset(values, factor, offset):
    v = np.array(values)
    heights = wave_heights(v).heights
    # Round-off at the prominence threshold may admit or drop an extremum; keep off it.
    if len(wave_heights(v, 0.0999).index) == len(wave_heights(v, 0.1001).index):
        assert wave_heights(factor * v + offset).heights == pytest.approx(
            factor * heights, rel=1e-6, abs=1e-6
        )


def turning_points(v):
    """Samples of peaks and troughs of one signal by scipy, and the parabolas' tops by polyfit."""
    least = 0.1 * np.ptp(v)
    at = np.sort(
        np.concatenate([find_peaks(sign * v, prominence=least)[0] for sign in (1.0, -1.0)])
    )
    tops = [np.polynomial.Polynomial.fit([-1, 0, 1], v[i - 1 : i + 2], 2).convert() for i in at]
    offset = np.array([top.deriv().roots()[0] for top in tops])
    return at + offset, np.array([top(x) for top, x in zip(tops, offset, strict=True)])


@pytest.mark.parametrize(("n", "noise"), [(60, 0.0), (700, 0.3)])
def test_many_signals_together_have_the_turning_points_of_each(n, noise):
    rng = np.random.default_rng(n)
    slow = np.array([0.5, 1.0, 1.5, 2.5, 3.0, 4.0, 0.7, 1.0])[:, None]
    v = np.sin(2 * np.pi * slow * np.linspace(0.0, 1.0, n) + slow) * rng.uniform(5, 50, 8)[:, None]
    v += noise * rng.standard_normal((8, n)) + rng.uniform(-9, 9, 8)[:, None]
    v[6] = 3.0
    length, closed = np.full(8, 100.0), np.arange(8) == 2
    length[4] = 200.0 * np.ptp(v[4])
    waves = many_waves(v, length, closed)
    assert waves.count == 8
    assert (np.diff(waves.stroke) >= 0).all()
    for i in range(8):
        mine = waves.stroke == i
        if i in (2, 4, 6):  # a closed one, a line, and one that does not swing at all
            assert not mine.any()
            assert np.isnan([waves.mean[i], waves.spread[i]]).all()
            continue
        index, value = turning_points(v[i])
        assert waves.index[mine] == pytest.approx(index, abs=1e-6)
        assert waves.value[mine] == pytest.approx(value, abs=1e-9)
        heights = np.abs(np.diff(value))
        if len(heights):
            assert waves.mean[i] == pytest.approx(heights.mean())
            assert waves.spread[i] == pytest.approx(heights.max() - heights.min(), abs=1e-9)
        else:
            assert np.isnan(waves.mean[i])
            assert np.isnan(waves.spread[i])
    rows = [0, 1, 3, 5, 7]
    joined = ManyWaves.joined([wave_heights(v[i]) for i in rows])
    assert joined.count == 5
    assert np.array_equal(np.array(rows)[joined.stroke], waves.stroke)
    assert np.array_equal(joined.index, waves.index)
    assert np.array_equal(joined.value, waves.value)
    assert np.array_equal(joined.heights, waves.heights)


def test_heights_of_many_are_between_neighbours_of_one_stroke():
    waves = ManyWaves(3, np.array([0, 0, 0, 2, 2]), np.arange(5.0), np.array([5.0, -3, 4, 40, 10]))
    assert waves.heights.tolist() == [8.0, 7.0, 30.0]
    assert waves.mean == pytest.approx([7.5, np.nan, 30.0], nan_ok=True)
    assert waves.spread == pytest.approx([1.0, np.nan, 0.0], nan_ok=True)


@pytest.mark.parametrize("seed", range(4))
def test_a_signal_that_pauses_turns_where_one_without_pauses_does(seed):
    rng = np.random.default_rng(seed)
    v = np.cumsum(rng.standard_normal(80))
    pauses = rng.integers(1, 4, len(v))
    pauses[[0, -1]] = 3  # at rest before and after, as demonstrations are
    first = np.cumsum(pauses) - pauses
    least = 0.1 * np.ptp(v)
    turns = np.sort(np.concatenate([find_peaks(s * v, prominence=least)[0] for s in (1.0, -1.0)]))
    found = wave_heights(np.repeat(v, pauses)).index
    assert len(found) == len(turns)
    assert (np.abs(found - first[turns]) <= 0.5).all()


def test_a_signal_is_a_line_below_a_share_of_the_start_goal_distance():
    v = np.sin(np.linspace(0.0, 9.0, 200))
    swing = np.ptp(v)
    assert wave_heights(v, length=swing / 0.00799).heights.size == 0
    assert wave_heights(v, length=swing / 0.00801).heights.size == 2


def test_columns_are_read_at_the_extrema():
    t = np.arange(501) * 0.02
    wave = stroke_wave(stroke(), START, GOAL, UP)
    assert wave.at(t) == pytest.approx(wave.index * 0.02)
    columns = wave.at(np.column_stack([t, 5.0 - 2.0 * t]))
    expected = np.column_stack([wave.index * 0.02, 5.0 - 0.04 * wave.index])
    assert columns == pytest.approx(expected)
