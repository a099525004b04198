"""Rests in the middle of strokes whose rests are known, and strokes without them."""

import numpy as np
import pytest

from dmpcli.dmp.pauses import rests, step, turning, without
from tests.minimum_jerk import minimum_jerk

RATE = 100.0


def stopping(*pauses, seconds=1.0, reach=60.0):
    """Minimum-jerk reaches one after the other, with rests of so many samples between them."""
    reached = [np.zeros(1)]
    for i in range(len(pauses) + 1):
        s = np.arange(1, int(RATE * seconds) + 1) / (RATE * seconds)
        reached.append(reach * (i + minimum_jerk(s)))
        if i < len(pauses):
            reached.append(np.full(pauses[i], reach * (i + 1)))
    x = np.concatenate(reached)
    return np.arange(len(x)) / RATE, np.stack([x, 0.5 * x, 0 * x], axis=1)


@pytest.mark.parametrize("pause", [60, 120])
def test_a_rest_is_found_where_it_is_and_as_long(pause):
    t, x = stopping(pause, 2 * pause)
    found = rests(t, x, 0.0)
    assert len(found) == 2
    for (a, b), first, count in zip(found, (100, 200 + pause), (pause, 2 * pause), strict=True):
        # A minimum-jerk reach is hardly moving in its last and first tenths.
        assert first - 16 <= a <= first
        assert first + count <= b <= first + count + 16


def test_rests_at_the_ends_and_short_ones_are_none():
    t, x = stopping(5)
    assert rests(t, x, 0.0) == []
    still = np.concatenate([np.repeat(x[:1], 80, axis=0), x, np.repeat(x[-1:], 80, axis=0)])
    assert rests(np.arange(len(still)) / RATE, still, 0.0) == []
    assert rests(t[:4], x[:4], 0.0) == []


def test_a_tool_turns_in_a_rest_if_any_of_its_angles_goes_a_degree_from_first_to_last_sample():
    angles = np.zeros((20, 3))
    angles[5:, 1] = np.radians(0.9)
    assert not turning(angles, (2, 10))
    angles[10, 1] = np.radians(2.2)
    assert turning(angles, (2, 10))
    assert not turning(angles, (2, 9))
    assert turning(angles, (10, 12))
    assert not turning(angles, (11, 19))


def test_without_its_rests_a_stroke_goes_on_where_it_rested():
    _, x = stopping(60, 120)
    joined, kept = without(x, [(100, 160), (260, 380)])
    expected = np.concatenate([np.arange(101), np.arange(161, 261), np.arange(381, len(x))])
    assert kept.tolist() == expected.tolist()
    # It rested at one place each time, so that nothing needs to be spread.
    assert np.array_equal(joined, x[kept])


def test_what_a_rest_drifted_by_is_spread_in_halves_over_either_side():
    n, (a, b) = 1000, (400, 500)
    x = np.zeros((n, 2))
    x[b:, 0] = 1.0
    x[a : b + 1, 0] = np.linspace(0.0, 1.0, b - a + 1)
    x[:, 1] = 3.0
    joined, kept = without(x, [(a, b)])
    assert kept.tolist() == [*range(a + 1), *range(b + 1, n)]
    assert np.array_equal(joined[:, 1], np.full(len(kept), 3.0))
    # 2 % of the samples on either side: half of the drift up to the rest, half after it.
    wide = 20
    rise = step(np.arange(wide + 1) / wide)
    assert joined[a - wide : a + 1, 0] == pytest.approx(0.5 * rise)
    fall = 1.0 - 0.5 * step(np.arange(wide - 1, -1, -1) / wide)
    assert joined[a + 1 : a + 1 + wide, 0] == pytest.approx(fall)
    assert not joined[: a - wide, 0].any()
    assert (joined[a + 1 + wide :, 0] == 1.0).all()


def test_drifts_of_rests_close_together_do_not_overlap():
    x = np.zeros((1000, 1))
    x[404:], x[410:] = 1.0, 3.0
    joined, _ = without(x, [(400, 404), (406, 410)])
    assert joined[0, 0] == 0.0
    assert joined[-1, 0] == 3.0
    assert (np.diff(joined[:, 0]) >= -1e-12).all()
    assert np.diff(joined[:, 0]).max() < 1.1


def test_the_step_is_smooth():
    assert step(np.array([0.0, 0.5, 1.0])).tolist() == [0.0, 0.5, 1.0]
    r = np.linspace(0.0, 1.0, 101)
    assert step(r) == pytest.approx(minimum_jerk(r))


def test_a_rest_may_fill_all_but_the_ends_of_a_stroke():
    t = 0.06 * np.arange(7)
    x = np.array([0.0, 100, 100, 100, 100, 100, 200])[:, None]
    assert rests(t, x, 0.0) == [(1, 5)]
    assert rests(t[:6], x[1:], 0.0) == []
    assert rests(t[:6], x[:6], 0.0) == []


def test_a_joint_is_blended_on_both_sides_and_moves_nothing_else():
    u = np.r_[np.arange(101.0), np.full(20, 100.0), np.arange(101.0, 180.0)]
    x = np.column_stack([u, np.where(np.arange(200) < 120, 0.0, 3.0)])
    joined, kept = without(x, [(100, 120)])
    assert kept.tolist() == [*range(101), *range(121, 200)]
    assert joined[100] == pytest.approx(joined[101] - [1.0, 0.0], abs=0.2)
    assert joined[100] == pytest.approx(0.5 * (x[100] + x[120]))
    np.testing.assert_array_equal(joined[:97], x[:97])
    np.testing.assert_array_equal(joined[105:], x[125:])


def test_a_tool_turns_where_one_of_its_angles_moves_by_a_degree():
    angles = np.zeros((30, 3))
    angles[12, 1] = np.radians(1.1)
    assert turning(angles, (5, 12))
    assert turning(angles, (12, 20))
    assert not turning(angles, (5, 11))
    assert not turning(angles, (13, 20))
    assert not turning(0.8 * angles, (5, 20))
