"""Stiffness, delay and doubt of a contact, against scipy, closed forms and limits that are met."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dmpcli.admittance.contact_estimation import (
    RiseTest,
    delay_of_move,
    line,
    static_stiffness,
)


@settings(max_examples=25)
@given(st.integers(0, 10_000), st.integers(3, 12))
def test_a_line_is_that_of_least_squares_with_its_standard_error(seed, n):
    from scipy.stats import linregress

    rng = np.random.default_rng(seed)
    depth = np.cumsum(rng.uniform(0.01, 0.3, n))
    force = 3.0 * depth + 0.2 * rng.standard_normal(n)
    found, oracle = line(depth.tolist(), force.tolist()), linregress(depth, force)
    assert found.slope == pytest.approx(oracle.slope, rel=1e-9)
    assert found.offset == pytest.approx(oracle.intercept, rel=1e-9, abs=1e-9)
    assert found.deviation == pytest.approx(oracle.stderr, rel=1e-6)


def test_fewer_points_tell_a_line_without_its_deviation_or_none():
    two = line([0.0, 0.5], [1.0, 2.0])
    assert (two.slope, two.offset, two.deviation) == (2.0, 1.0, math.inf)
    assert line([0.5], [2.0]) == line([0.5, 0.5], [1.0, 3.0])
    assert (line([0.5], [2.0]).slope, line([0.5], [2.0]).offset) == (0.0, 2.0)
    assert (line([], []).slope, line([], []).offset) == (0.0, 0.0)
    # Three points on a line leave nothing.
    assert line([0.0, 1.0, 2.0], [1.0, 3.0, 5.0]).deviation == 0.0


@pytest.mark.parametrize("late", [0, 1, 3, 6])
@pytest.mark.parametrize("deeper", [0.6, -0.4])
def test_the_delay_of_a_move_is_by_how_much_its_force_comes_later(late, deeper):
    """A ramp, a rest of 20 cycles; the force is that of some cycles before, 5 N/mm and 2 N."""
    depth = 1.0 + deeper * np.clip(np.arange(40) / 8.0, 0.0, 1.0)
    felt = 2.0 + 5.0 * (np.concatenate([np.full(late, 1.0), depth])[: len(depth)] - 1.0)
    rested = ((1.0, 2.0), (1.0 + deeper, 2.0 + 5.0 * deeper))
    found = delay_of_move(list(zip(depth, felt, strict=True)), rested, 0.02)
    assert found == pytest.approx(0.02 * late, abs=1e-12)


def test_a_move_that_is_none_has_no_delay_and_none_is_felt_before_it():
    way = [(1.0, 2.0), (1.5, 4.0)]
    assert delay_of_move(way, ((1.0, 2.0), (1.0, 5.0)), 0.02) == 0.0
    assert delay_of_move(way, ((1.0, 2.0), (1.5, 2.0)), 0.02) == 0.0
    early = [(1.0, 4.5), (1.2, 4.5), (1.5, 4.5)]
    assert delay_of_move(early, ((1.0, 2.0), (1.5, 4.5)), 0.02) == 0.0


def test_two_resting_points_tell_a_stiffness_where_they_lie_far_enough_apart():
    assert static_stiffness((1.0, 1.5), (2.0, 3.5), 1.5) == 3.0
    assert static_stiffness((1.5, 1.0), (3.5, 2.0), 1.5) == 3.0
    assert static_stiffness((1.0, 1.5), (2.0, 3.46875), 1.5) is None
    assert static_stiffness((1.0, 1.5), (3.5, 2.0), 1.0) is None
    assert static_stiffness((1.0, 1.0), (2.0, 4.0), 1.0) is None


def doubting(force=1.0, wanted=16.0, depth=2.0, stiffness=2.0, slack=0.5):
    test = RiseTest(slack)
    assert test.believed(force, wanted, depth, stiffness)
    return test


def test_a_force_that_is_too_small_may_stay_while_the_tool_goes_in_by_twice_what_is_missing():
    # 15 N are missing: 7.5 mm at 2 N/mm, twice that and the slack.
    assert doubting().believed(1.0, 16.0, 2.0 + 15.5, 2.0)
    assert not doubting().believed(1.0, 16.0, 2.0 + 15.53125, 2.0)


def test_beyond_that_it_must_have_risen_by_a_quarter_of_what_a_contact_would():
    # From -4 N: 8.5 mm may pass; after 9 mm a quarter of 18 N must be there.
    assert doubting(-4.0, 4.0).believed(0.5, 4.0, 11.0, 2.0)
    assert not doubting(-4.0, 4.0).believed(0.46875, 4.0, 11.0, 2.0)


def test_half_of_what_is_wanted_is_believed_and_begins_anew():
    test = doubting()
    assert test.believed(8.0, 16.0, 50.0, 2.0)
    # Counted from here again.
    assert test.believed(1.0, 16.0, 60.0, 2.0)
    assert test.believed(1.0, 16.0, 75.5, 2.0)
    assert not test.believed(1.0, 16.0, 75.53125, 2.0)
    assert not doubting().believed(7.96875, 16.0, 60.0, 2.0)
