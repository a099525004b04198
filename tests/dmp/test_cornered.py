"""Strokes with corners, judged by their closed form: what is smooth between them stays so."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.interpolate import BSpline

from dmpcli.dmp import (
    corner_blends,
    corner_pieces,
    corner_search,
    least_squares,
    noise,
    spline_ends,
)
from dmpcli.dmp.noise import Noise
from dmpcli.dmp.spline_smoothing import smooth
from tests.dmp.recordings import blended, corners, jerk, letters, noisy, six_seconds


def smoothed(t, points):
    return smooth(points, float(t[-1]), noise.estimate(points))


def off(spline, t, truth, sigma):
    return np.linalg.norm(spline(t) - truth, axis=1) / sigma


def along(V, speed, rate=100.0):
    """Times and points of a way through V at one speed."""
    way = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(V, axis=0), axis=1))]
    t = np.arange(0.0, way[-1] / speed, 1.0 / rate)
    return t, np.column_stack([np.interp(speed * t, way, c) for c in V.T])


def polyline(seed, rate=100.0):
    """Three to eleven legs in space that turn by 20 to 150° between them."""
    rng = np.random.default_rng(seed)
    legs = int(rng.integers(3, 12))
    turn = rng.choice([-1.0, 1.0], legs) * rng.uniform(np.radians(20), np.radians(150), legs)
    heading = np.cumsum(turn)
    move = np.column_stack([np.cos(heading), np.sin(heading), rng.normal(0.0, 0.3, legs)])
    moves = move * rng.uniform(10.0, 60.0, (legs, 1))
    V = np.concatenate([np.zeros((1, 3)), np.cumsum(moves, axis=0)])
    return along(V, rng.uniform(20.0, 80.0), rate)


@pytest.mark.sweep(kept=1)
@pytest.mark.slow
@pytest.mark.parametrize("sigma", [0.02, 0.1, 0.5])
def test_a_zigzag_is_as_near_at_its_corners_as_asked(sigma):
    t, truth = corners()
    exact = np.linalg.norm(smoothed(t, truth)(t, 2), axis=1).max()
    for seed in range(200, 203):
        spline = smoothed(t, noisy(truth, sigma, seed))
        e = off(spline, t, truth, sigma)
        assert np.sqrt(np.mean(e**2)) <= 0.7
        assert e.max() <= 4.0
        assert e[[0, -1]].max() <= 1.5
        assert np.linalg.norm(spline(t, 2), axis=1).max() <= 1.5 * exact
    assert spline.corners >= 20


@pytest.mark.sweep(kept=1)
@pytest.mark.slow
@pytest.mark.parametrize("rate", [40.0, 100.0, 400.0])
def test_any_polyline_is_kept_within_three_times_its_noise(rate):
    """Four times is asked: within that a corner is rounded as far as the samples do not object."""
    for seed in range(300, 306):
        t, truth = polyline(seed, rate)
        spline = smoothed(t, noisy(truth, 0.05, seed))
        e = off(spline, t, truth, 0.05)
        assert e.max() <= 3.0
        assert np.sqrt(np.mean(e**2)) <= 0.6
        assert spline.corners >= 1


@pytest.mark.thorough
def test_what_is_smooth_between_corners_stays_smooth():
    """Letters, then a polyline: letters have no corner, and the polyline all of its own."""
    t, first = letters(6.0)
    _, second = along(np.array([[0, 0, 0], [30, 5, 0], [35, 40, 0], [70, 30, 0.0]]), 40.0)
    truth = np.concatenate([first, second[1:] + first[-1]])
    t = np.arange(len(truth)) / 100.0
    points = noisy(truth, 0.05, 1)
    spline = smoothed(t, points)
    e = off(spline, t, truth, 0.05)
    assert e.max() <= 2.0
    assert spline.corners == 3
    inside = t < 5.5
    exact = smoothed(t, truth)
    peaks = [np.linalg.norm(s(t[inside], 2), axis=1).max() for s in (spline, exact)]
    assert peaks[0] <= 1.3 * peaks[1]


@pytest.mark.sweep(kept=1)
@pytest.mark.slow
@pytest.mark.parametrize("sigma", [0.02, 0.1, 0.5])
def test_smooth_strokes_have_no_corners(sigma):
    for t, truth in (six_seconds(), six_seconds(20.0), letters(8.0)):
        for seed in range(3):
            assert smoothed(t, noisy(truth, sigma, seed)).corners == 0


@pytest.mark.sweep(kept=1)
@pytest.mark.slow
@pytest.mark.parametrize("sigma", [0.02, 0.1, 0.5])
def test_a_stroke_that_stops_where_it_turns_is_not_kinked(sigma):
    """From rest to rest by five legs: it turns, but its velocity does not jump."""
    V = np.array([[0, 0, 0], [60, 20, 0], [80, 70, 0], [20, 60, 0], [10, 10, 0], [90, 0, 0.0]])
    u = jerk(np.arange(1, 121) / 120.0)[:, None]
    truth = np.concatenate([V[:1], *(a + (b - a) * u for a, b in pairwise(V))])
    t = np.arange(len(truth)) / 100.0
    exact = np.linalg.norm(smoothed(t, truth)(t, 2), axis=1).max()
    for seed in range(5):
        spline = smoothed(t, noisy(truth, sigma, seed))
        assert np.linalg.norm(spline(t, 2), axis=1).max() <= 1.5 * exact
        assert spline.rests == (True, True)


@pytest.mark.slow
def test_a_stroke_with_corners_moved_and_reversed_is_smoothed_alike():
    t, truth = polyline(7)
    points = noisy(truth, 0.1, 7)
    spline = smoothed(t, points)
    a = 0.7
    R = np.array([[np.cos(a), -np.sin(a), 0.0], [np.sin(a), np.cos(a), 0.0], [0.0, 0.0, 1.0]])
    moved = smoothed(t, points @ R.T + [500.0, -200.0, 30.0])
    np.testing.assert_allclose(moved(t), spline(t) @ R.T + [500.0, -200.0, 30.0], atol=1e-6)
    assert moved.corners == spline.corners
    # A corner between two samples may be looked for from the other side first.
    np.testing.assert_allclose(smoothed(t, points[::-1])(t)[::-1], spline(t), atol=0.02)


@pytest.mark.parametrize("place", [60.0, 60.3, 60.5, 60.9])
def test_a_corner_is_found_to_a_part_of_a_sample(place):
    j = np.arange(121.0)
    truth = np.column_stack([0.5 * j, 0.4 * np.abs(j - place), 0.0 * j])
    white = Noise(np.eye(3), np.full(3, 0.02))
    points = noisy(truth, 0.02, 3)
    found = corner_search.candidates(points, white, straight=False)
    assert len(found) == 1
    at = corner_search.located(points, found, white)
    # ± 3 standard deviations of where two lines of 60 samples meet.
    assert abs(at[0] - place) <= 3.0 * 0.02 * np.sqrt(8.0 / 60.0) / 0.8


@pytest.mark.slow
def test_a_rounded_corner_that_is_taken_for_one_is_rounded_as_its_samples_are():
    """By 0.1 s, at 0.5 mm of noise: taken for sharp it would be accelerated twice as much."""
    peaks, off_by = [], []
    for seed in range(9300, 9308):
        t, truth, peak = blended(seed, 0.1)
        spline = smoothed(t, noisy(truth, 0.5, seed))
        peaks.append(np.linalg.norm(spline(t, 2), axis=1).max() / peak)
        off_by.append(off(spline, t, truth, 0.5).max())
    assert np.median(peaks) <= 1.5
    assert max(off_by) <= 4.0


@pytest.mark.parametrize("sigma", [0.02, 0.1, 0.5])
@pytest.mark.parametrize("half", [6.0, 9.5])
def test_a_blend_is_as_long_as_the_samples_tell(half, sigma):
    j = np.arange(121.0)
    jump = np.array([[0.3, 1.5, 0.0]])
    corners = np.array([60.3])
    ramp = np.maximum(np.minimum(j - 60.3 + half, 2.0 * half), 0.0)
    blend = ramp**2 / (4.0 * half) + np.maximum(j - 60.3 - half, 0.0)
    inside = (blend - np.maximum(j - 60.3, 0.0))[:, None] * jump
    added = corner_blends.added(121, corners, jump, np.array([half]))
    np.testing.assert_allclose(added, inside, atol=1e-12)
    found = corner_blends.likely(noisy(inside, sigma, 3), corners, jump, sigma, False)
    # The likeliest by its tip, jump · half / 4, which the samples beside it tell within σ.
    assert abs(found[0] - half) * np.linalg.norm(jump) / 4.0 <= sigma + 0.08 * half * 0.38


def test_a_sharp_corner_is_rounded_by_what_cannot_be_told_at_most():
    """By σ at its tip, and where the samples do not speak against it by twice that."""
    jump, corners = np.array([[0.0, 0.9, 0.0]]), np.array([50.4])
    least = corner_blends.least(101, corners, jump, 0.5)
    assert least * 0.9 / 4.0 == pytest.approx(0.5)
    for seed in range(20):
        rest = noisy(np.zeros((101, 3)), 0.5, seed)
        assert corner_blends.likely(rest, corners, jump, 0.5, False) == least
        assert least <= corner_blends.likely(rest, corners, jump, 0.5, True) <= 2.0 * least
    # No farther than half of the shorter leg.
    assert corner_blends.least(101, np.array([2.0]), jump, 0.5) == 1.0


def test_noise_alone_has_no_corners():
    for seed in range(40):
        points = noisy(np.zeros((400, 3)), 1.0, seed)
        white = Noise(np.eye(3), np.ones(3))
        assert corner_search.candidates(points, white, straight=False) == []


def test_pieces_meet_by_the_least_change_of_all():
    """Against the least squares of all coefficients under the same conditions."""
    rng = np.random.default_rng(5)
    x = np.cumsum(rng.normal(0.0, 0.02, (90, 2)), axis=0)
    x += np.column_stack([np.arange(90.0), np.abs(np.arange(90.0) - 44.4)])
    white = Noise(np.eye(2), np.full(2, 0.3))
    edges = [0.0, 20.7, 44.4, 89.0]
    pieces = [corner_pieces.between(x, a, b, white, 0.18, np.zeros(0)) for a, b in pairwise(edges)]
    assert all(piece.smooth for piece in pieces)
    values, _ = corner_pieces.joined(pieces, [1, 1])
    j = np.arange(90.0)
    columns = []
    conditions = []
    for k, piece in enumerate(pieces):
        low, high = edges[k], edges[k + 1]
        inside = (j > low) & (j <= high) if k else j <= high
        for power in range(int(piece.size)):
            columns.append(np.where(inside, (j - low) ** power, 0.0))
            row = np.zeros(2)
            if k:
                row[k - 1] -= 0.0**power
            if k < 2:
                row[k] += (high - low) ** power
            conditions.append(row)
    A, C = np.array(columns).T, np.array(conditions).T
    system = np.block([[A.T @ A, C.T], [C, np.zeros((2, 2))]])
    right = np.concatenate([A.T @ x, np.zeros((2, 2))])
    solution = np.linalg.lstsq(system, right, rcond=None)[0]
    np.testing.assert_allclose(values, A @ solution[: A.shape[1]], atol=1e-6)


@pytest.mark.parametrize("breaks", [[0, 1, 2, 3, 4.0], [0, 0.3, 1, 2.5, 2.6, 4]])
def test_derivatives_at_a_spline_s_first_knot_are_scipys(breaks):
    knots = np.pad(breaks, 5, mode="edge")
    each = BSpline(knots, np.eye(len(breaks) + 4), 5)
    rows = spline_ends.derivatives(knots)
    for order in range(6):
        np.testing.assert_allclose(rows[order], each(0.0, order)[:6], rtol=1e-9, atol=1e-9)


def test_a_short_piece_has_no_more_coefficients_than_samples():
    rng = np.random.default_rng(2)
    x = rng.normal(0.0, 30.0, (60, 2))
    white = Noise(np.eye(2), np.full(2, 0.1))
    for high in np.linspace(3.2, 20.0, 30):
        piece = corner_pieces.between(x, 0.0, high, white, 0.02, np.arange(60.0))
        assert piece is None or piece.size <= len(piece.values)
    assert least_squares.DEGREE == 5


@pytest.mark.parametrize(("seconds", "sigma", "seed"), [(0.15, 0.5, 9506), (0.1, 0.5, 9517)])
def test_a_corner_whose_pieces_follow_the_noise_is_none(seconds, sigma, seed):
    t, truth, peak = blended(seed, seconds)
    points = noisy(truth, sigma, seed)
    spline = smooth(points, float(t[-1]), noise.estimate(points))
    assert np.max(np.linalg.norm(spline(t, 2), axis=1)) < 5.0 * peak
