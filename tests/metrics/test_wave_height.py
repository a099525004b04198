"""Wave heights: closed forms, scipy's find_peaks as oracle, invariances."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import find_peaks

from dmpcli.metrics.wave_height import lateral, stroke_wave, wave_heights
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


def test_columns_are_read_at_the_extrema():
    t = np.arange(501) * 0.02
    wave = stroke_wave(stroke(), START, GOAL, UP)
    assert wave.at(t) == pytest.approx(wave.index * 0.02)
    assert wave.at(stroke()).shape == (2, 3)
