"""Deviation: geometry worked out by hand, brute force as oracle, rigid invariance."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.metrics import deviation
from dmpcli.metrics.deviation import Taught, nearest_distance


def brute(points, polyline):
    """Distance of each point to the nearest of all segments, one segment after the other."""
    best = np.full(len(points), np.inf)
    for a, b in itertools.pairwise(polyline):
        length = np.dot(b - a, b - a)
        share = np.clip((points - a) @ (b - a) / (length or 1.0), 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(points - a - share[:, None] * (b - a), axis=1))
    return best


def test_distances_to_segments_and_beyond_their_ends():
    polyline = np.array([[0.0, 0, 0], [10, 0, 0], [10, 0, 0], [10, 5, 0]])
    points = np.array([[4.0, 3, 0], [-3, 4, 0], [10, 5, 2], [12, 2, 0], [0, 0, 0]])
    assert nearest_distance(points, polyline) == pytest.approx([3, 5, 2, 2, 0], abs=1e-12)


@given(st.integers(0, 2**32 - 1), st.integers(2, 30), st.integers(1, 30), st.sampled_from([2, 3]))
def test_nearest_distance_is_brute_forces(seed, corners, count, d):
    rng = np.random.default_rng(seed)
    polyline = 800 + 100 * rng.standard_normal((corners, d))
    points = 800 + 100 * rng.standard_normal((count, d))
    points[0] = polyline[0]
    expected = brute(points, polyline)
    assert nearest_distance(points, polyline) == pytest.approx(expected, abs=1e-9)


def test_long_files_are_done_in_blocks_with_the_same_result():
    rng = np.random.default_rng(3)
    polyline = np.cumsum(rng.standard_normal((3000, 3)), axis=0)
    points = rng.standard_normal((900, 3)) * 30
    whole = nearest_distance(points, polyline)
    assert whole[::97] == pytest.approx(brute(points[::97], polyline), abs=1e-9)


def test_every_point_of_a_parallel_line_is_off_by_the_gap():
    line = np.column_stack([np.linspace(0, 10, 50), np.zeros(50)])
    off = nearest_distance(line + np.array([0.0, 0.25]), line)
    assert off == pytest.approx(np.full(50, 0.25), abs=1e-12)


@pytest.mark.parametrize("count", [1, 7])
def test_same_shape_late_along_it_deviates_in_phase_but_not_in_shape(count):
    t = np.linspace(0, 1, 201)
    line = np.column_stack([100 * t, 0 * t, 0 * t])
    late = np.column_stack([100 * t**2, 0 * t, 0 * t])
    strokes = np.repeat(late.T[:, None], count, axis=1)
    got = Taught(t, line).deviations(5 + 2 * t, strokes, np.ones(count))
    assert got.nearest_max == pytest.approx(np.zeros(count), abs=1e-9)
    assert got.phase_max == pytest.approx(np.full(count, 25.0), abs=1e-2)
    # The integral of (t - t²)² over [0, 1] is 1/30.
    assert got.phase_rms == pytest.approx(np.full(count, 100 / np.sqrt(30)), rel=1e-2)


@pytest.mark.slow
@given(st.integers(0, 2**32 - 1), st.integers(2, 40), st.floats(0.2, 5.0))
def test_many_strokes_together_are_as_far_as_each_from_every_segment(seed, corners, stretch):
    rng = np.random.default_rng(seed)
    taught = np.cumsum(rng.standard_normal((corners, 3)), axis=0)
    strokes = 3 * rng.standard_normal((6, 15, 3)) + taught.mean(axis=0)
    factors = np.array([stretch, 1.0, 1.0, stretch, 1.0, 1.0])
    found = Taught(np.arange(corners), taught).deviations(
        np.arange(15.0), strokes.transpose(2, 0, 1), factors
    )
    for i, (stroke, factor) in enumerate(zip(strokes, factors, strict=True)):
        far = brute(stroke, taught * [factor, 1.0, 1.0])
        assert found.nearest_max[i] == pytest.approx(far.max(), abs=1e-7)
        assert found.nearest_rms[i] == pytest.approx(np.sqrt(np.mean(far**2)), abs=1e-7)


@pytest.mark.parametrize("count", [2, 5])
def test_at_the_same_share_of_the_time_the_gap_is_what_was_added(count):
    rng = np.random.default_rng(count)
    t = np.sort(np.concatenate([[3.0, 9.0], rng.uniform(3.0, 9.0, 80)]))
    place = np.column_stack([10 * t, (t - 4) ** 2, np.sin(t)])
    stretch = np.linspace(0.5, 2.0, count)
    gap = rng.uniform(-5.0, 5.0, (3, count, 1)) * [[[1.0]], [[2.0]], [[0.5]]]
    # Half as fast, begun at another time: each stroke is the demonstration and its own gap.
    strokes = np.stack(
        [np.outer(stretch, place[:, 0]), *(np.tile(c, (count, 1)) for c in place.T[1:])]
    )
    found = Taught(t, place).deviations(50.0 + 2.0 * t, strokes + gap, stretch)
    size = np.linalg.norm(gap[..., 0], axis=0)
    assert found.phase_rms == pytest.approx(size)
    assert found.phase_max == pytest.approx(size)


def curve(kind, m=300):
    """A demonstration that comes near itself again, with a stretch where it stands still."""
    s = np.linspace(0.0, 1.0, m)
    still = np.interp(s, [0.0, 0.3, 0.4, 1.0], [0.0, 0.4, 0.4, 1.0])
    a = 2 * np.pi * still
    match kind:
        case "eight":
            return np.column_stack([40 * np.sin(a), 25 * np.sin(2 * a), 2 * np.cos(a)])
        case "spiral":
            return np.column_stack([6 * a * np.cos(3 * a), 6 * a * np.sin(3 * a), a])
        case _:  # there and back along one line, nearly
            return np.column_stack([60 * np.sin(a / 2), 1e-3 * a, 0 * a])


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["eight", "spiral", "and back"])
@pytest.mark.parametrize("late", [0.0, 0.15])
def test_the_nearest_place_is_found_however_far_along_the_demonstration_it_is(kind, late):
    rng = np.random.default_rng(1)
    taught = curve(kind)
    m, n = len(taught), 60
    s = np.linspace(0.0, 1.0, n)
    strokes, stretch = [], np.array([0.4, 1.0, 1.0, 1.7, 3.0])
    for factor, off in zip(stretch, (0.0, 1e-5, 0.3, 3.0, 30.0), strict=True):
        phase = np.clip(s + late * np.sin(2 * np.pi * s), 0.0, 1.0) * (m - 1)
        base = np.column_stack([np.interp(phase, np.arange(m), c) for c in taught.T])
        strokes.append(base * [factor, 1.0, 1.0] + off * rng.standard_normal((n, 3)))
    together = np.stack(strokes).transpose(2, 0, 1)
    found = Taught(np.linspace(0.0, 4.0, m), taught).deviations(s, together, stretch)
    for i, (stroke, factor) in enumerate(zip(strokes, stretch, strict=True)):
        far = brute(stroke, taught * [factor, 1.0, 1.0])
        assert found.nearest_max[i] == pytest.approx(far.max(), abs=1e-7)
        assert found.nearest_rms[i] == pytest.approx(np.sqrt(np.mean(far**2)), abs=1e-7)


def test_clearances_are_the_least_distances_to_segments_beyond_each_reach():
    rng = np.random.default_rng(7)
    place = np.cumsum(rng.normal(size=(22, 3)), axis=0)
    place[12] = place[11]  # a segment of no length
    found = deviation._clearance(place)
    for known, reach in zip(found, deviation._REACHES, strict=True):
        for i in range(0, 22, 3):
            beyond = [k for k in range(21) if k < i - reach or k >= i + reach]
            far = [brute(place[i : i + 1], place[k : k + 2])[0] for k in beyond]
            assert known[i] == pytest.approx(min(far, default=np.inf), abs=1e-7)
            assert known[i] <= min(far, default=np.inf)


def test_clearances_of_long_curves_are_those_of_their_parts():
    """They are found in blocks."""
    s = np.linspace(0.0, 1.0, 700)
    place = np.column_stack([100 * s, 20 * np.sin(20 * s), 0 * s])
    found = deviation._clearance(place)[0]
    for i in (0, 46, 47, 699):
        beyond = np.delete(np.arange(699), np.arange(max(i - 1, 0), min(i + 1, 699)))
        far = min(brute(place[i : i + 1], place[k : k + 2])[0] for k in beyond)
        assert found[i] == pytest.approx(far, abs=1e-7)
