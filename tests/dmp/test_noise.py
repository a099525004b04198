"""How much noise, and of which kind."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dmpcli.dmp import noise
from dmpcli.spatial import rotations
from tests import human_strokes
from tests.dmp.recordings import (
    corners,
    filtered,
    handwriting_and_lines,
    interpolated,
    jerk,
    letters,
    noisy,
    pen_lift,
    six_seconds,
    times,
    wave,
)

SMOOTH = {"wave": six_seconds, "letters": letters, "corners": corners, "lift": pen_lift}


@pytest.mark.slow
@pytest.mark.parametrize("name", SMOOTH)
@pytest.mark.parametrize("sigma", [0.02, 0.1, 0.5])
def test_white_noise_is_estimated_and_called_white(name, sigma):
    _, points = SMOOTH[name]()
    for seed in range(8):
        found = noise.estimate(noisy(points, sigma, seed))
        assert found.kind == "white"
        assert found.typical == pytest.approx(sigma, rel=0.15)


def test_half_a_hundred_samples_are_enough():
    _, points = six_seconds(rate=8.5)
    found = [noise.estimate(noisy(points, 0.1, seed)).typical for seed in range(30)]
    assert np.median(found) == pytest.approx(0.1, rel=0.15)
    assert max(found) <= 0.15


def test_noise_of_one_axis_is_found_along_it():
    _, points = six_seconds()
    direction = np.array([2.0, -1.0, 2.0]) / 3.0
    points = points + np.random.default_rng(3).normal(0.0, 0.2, len(points))[:, None] * direction
    found = noise.estimate(points)
    assert found.sigma[-1] == pytest.approx(0.2, rel=0.15)
    assert abs(found.axes[:, -1] @ direction) > 0.99
    assert np.all(found.sigma[:-1] < 0.01)


@given(
    angles=st.tuples(*[st.floats(-3.0, 3.0)] * 3),
    seed=st.integers(0, 1000),
    sigma=st.floats(0.01, 1.0),
)
@settings(max_examples=20)
def test_a_rotated_recording_has_the_same_noise(angles, seed, sigma):
    _, points = six_seconds()
    points = noisy(points, sigma, seed) * [1.0, 1.0, 0.3]
    Q = rotations.from_euler(np.array(angles))
    here, there = noise.estimate(points), noise.estimate(points @ Q.T + [100.0, -500.0, 3.0])
    assert there.total == pytest.approx(here.total, rel=1e-8)
    np.testing.assert_allclose(there.sigma, here.sigma, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("sigma", [0.02, 0.1, 0.5])
@pytest.mark.parametrize("seed", range(4))
def test_filtered_noise_is_recognised_with_where_it_ends(sigma, seed):
    _, points = six_seconds()
    found = noise.estimate(filtered(points, sigma, seed))
    assert found.kind == "band"
    assert 50.0 * found.reach == pytest.approx(10.0, abs=3.0)
    assert 0.3 < 50.0 * found.stroke < 4.0
    assert found.typical == pytest.approx(sigma, rel=0.4)


@pytest.mark.parametrize("kind", ["linear", "spline"])
@pytest.mark.parametrize("sigma", [0.02, 0.1, 0.5])
def test_noise_that_was_interpolated_is_recognised_with_where_it_ends(kind, sigma):
    for seed in range(4):
        _, points = interpolated(lambda t: wave(jerk(t / 6.0)), sigma, kind, seed)
        found = noise.estimate(points)
        assert found.kind == "band"
        assert 50.0 * found.reach == pytest.approx(15.0, abs=4.0)


def test_samples_on_a_lattice_are_recognised_with_its_step():
    _, points = six_seconds()
    found = noise.estimate(np.round(points / 0.5) * 0.5)
    assert found.kind == "quantised"
    assert found.step == pytest.approx(0.5)
    assert found.typical >= 0.9 * 0.5 / np.sqrt(12.0) * np.sqrt(2 / 3)


def test_rounding_in_a_file_is_no_noise():
    _, points = six_seconds()
    assert noise.estimate(np.round(points, 3)).kind == "white"


def test_errors_of_a_stroke_that_mirrors_itself_are_seen():
    # Every other coefficient of its rounding errors is zero.
    _, points = six_seconds()
    found = noise.estimate(np.round(points / 0.05) * 0.05)
    assert np.sqrt(found.total) == pytest.approx(0.05 / np.sqrt(12) * np.sqrt(2), rel=0.4)


@pytest.mark.parametrize("name", SMOOTH)
def test_no_kind_of_noise_is_seen_where_there_is_none(name):
    _, points = SMOOTH[name]()
    found = noise.estimate(points)
    assert found.kind == "white"
    assert found.typical < 0.01


@pytest.mark.slow
def test_no_kind_of_noise_is_seen_in_human_strokes():
    for shape in human_strokes.shapes():
        for stroke in human_strokes.strokes(shape)[::3]:
            found = noise.estimate(stroke.position)
            assert (found.kind, found.doubted) == ("white", False), shape


def test_few_samples_are_not_judged():
    t = times(1.0, 30.0)
    found = noise.estimate(noisy(wave(t), 0.3))
    assert (found.kind, found.total) == ("unknown", 0.0)


def test_a_plateau_is_the_longest_level_stretch_before_a_fall():
    stroke, level, floor = [9.0, 8.0, 7.0, 6.0], [2.0] * 7, [0.9, 0.0, -0.5, -0.5, -0.5]
    assert noise._level_stretch(stroke + level + floor) == (4, 11)
    # It need not begin behind the stroke, must fall by 1.5 decades behind itself, and stay down.
    assert noise._level_stretch(level + floor) == (0, 7)
    assert noise._level_stretch([-3.0, *level, 1.2, 0.9, 0.9, 0.9, 0.9, 0.9, 0.9]) is None
    assert noise._level_stretch([9.0, *level, 1.0, 0.0, 0.4, 2.0, 2.0]) is None
    # Too short a stretch, and one that slopes.
    assert noise._level_stretch([9.0, 7.0, 2.0, 2.0, 2.0, 2.0, 0.0, -1.0]) is None
    sloping = (2.0 - 0.15 * np.arange(7)).tolist()
    assert noise._level_stretch([9.0, *sloping, 0.0, -1.0, -2.0, -2.0]) is None
    level_enough = (2.0 - 0.11 * np.arange(7)).tolist()
    assert noise._level_stretch([9.0, *level_enough, 0.0, -1.0, -2.0, -2.0]) == (1, 8)


@pytest.mark.parametrize("other", [0.6, 1.4, 1.6])
def test_gaps_that_are_no_multiples_of_the_smallest_make_no_lattice(other):
    """On either side of a whole number."""
    up = np.cumsum(np.tile([1.0, 1.0 + other], 20))
    column = np.r_[up, up[::-1], up][:, None]
    assert noise._lattice_step(column, 10.0) is None
    whole = np.cumsum(np.tile([1.0, 2.0], 20))
    assert noise._lattice_step(np.r_[whole, whole][:, None], 10.0) == 1.0


def test_the_coarsest_axis_tells_the_step_and_one_that_is_none_refuses_all():
    rng = np.random.default_rng(3)
    x = np.cumsum(rng.integers(-1, 2, (400, 2)), axis=0) * [0.1, 0.5]
    assert noise._lattice_step(x, 10.0) == pytest.approx(0.5)
    still = np.column_stack([x, np.zeros(400)])
    assert noise._lattice_step(still, 10.0) == pytest.approx(0.5)
    assert noise._lattice_step(np.column_stack([x, rng.normal(size=400)]), 10.0) is None


def test_thirty_nine_samples_tell_no_noise_and_forty_do():
    x = 0.1 * np.random.default_rng(2).normal(size=(40, 3))
    assert noise.estimate(x[:39]).kind == "unknown"
    assert noise.estimate(x[:39]).total == 0.0
    assert noise.estimate(x).kind == "white"
    assert noise.estimate(x).typical == pytest.approx(0.1, rel=0.5)


def test_a_lattice_is_told_wherever_the_stroke_lies():
    """It is coarse by the stroke's extent, whatever the distance from the base."""
    _, points = six_seconds()
    found = noise.estimate(np.round(points / 0.5) * 0.5 + [20000.0, 0.0, 0.0])
    assert (found.kind, found.step) == ("quantised", pytest.approx(0.5))


@pytest.mark.parametrize("seed", [0, 15, 26])
@pytest.mark.parametrize("sigma", [0.05, 0.5])
def test_handwriting_before_straight_lines_is_not_counted_as_noise_but_doubted(sigma, seed):
    """Its spectrum is level up to some 2 Hz and falls behind, as that of filtered noise does."""
    _, points = handwriting_and_lines(seed, glyphs=40)
    found = noise.estimate(noisy(points, sigma, seed))
    assert (found.kind, found.doubted) == ("white", True)
    assert found.typical == pytest.approx(sigma, rel=0.15)


@pytest.mark.slow
@pytest.mark.parametrize("rate", [50.0, 100.0, 250.0])
@pytest.mark.parametrize("glyphs", [12, 24, 40, 80])
def test_no_handwriting_is_noise_at_any_rate_however_much_there_is(glyphs, rate):
    for seed in range(100, 110):
        _, points = handwriting_and_lines(seed, glyphs, rate=rate)
        for x in (points, points[::-1]):
            assert noise.estimate(noisy(x, 0.15, seed)).kind == "white"


@pytest.mark.parametrize("part", ["first", "last", "middle"])
def test_what_ends_within_the_recording_is_not_counted_as_noise_but_doubted(part):
    _, points = six_seconds()
    moved = filtered(0.0 * points, 0.5, 3)
    there = {"first": slice(0, 400), "last": slice(200, None), "middle": slice(100, 500)}[part]
    x = noisy(points, 0.005, 1)
    x[there] += moved[there]
    found = noise.estimate(x)
    assert (found.kind, found.doubted) == ("white", True)
    assert found.typical < 0.05


def test_noise_of_a_held_tool_is_noise_however_little_else_moves():
    still = np.zeros((601, 3))
    assert noise.estimate(filtered(still, 0.01, 2), held=True).kind == "band"
    assert noise.estimate(filtered(still, 0.01, 2)).kind == "white"


def test_noise_of_a_part_of_the_band_is_throughout_where_every_window_has_it():
    everywhere = filtered(np.zeros((601, 3)), 1.0, 5)
    assert noise._throughout(everywhere, 15, 50, np.ones(3))
    for gap in (slice(0, 200), slice(250, 400), slice(450, None)):
        partly = everywhere.copy()
        partly[gap] = 0.0
        assert not noise._throughout(partly, 15, 50, np.ones(3))
