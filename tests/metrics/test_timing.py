"""Deadline statistics of a loop."""

import numpy as np
import pytest

from dmpcli.metrics.timing import punctuality, spread


def test_quantiles():
    lateness = np.full(1000, 1e-4)
    lateness[:20] = 5e-3
    lateness[0] = 0.015
    got = punctuality(0.02 * np.arange(1000), lateness, period=0.02)
    assert (got.median, got.worst, got.missed, got.cycles) == (1e-4, 0.015, 0, 1000)
    assert got.p99 == pytest.approx(5e-3)


def test_gaps_between_deadlines_are_missed_ones():
    """65 ms late at the third: three deadlines pass without a set-point; later one more does."""
    number = np.array([0, 1, 2, 6, 7, 9])
    lateness = np.array([0.0, 0.0, 0.065, 0.0, 0.025, 0.0])
    assert punctuality(0.02 * number, lateness, 0.02).missed == 4


def test_one_cycle_misses_nothing():
    assert punctuality(np.array([0.0]), np.array([0.0]), np.inf).missed == 0


def test_a_spread_is_median_99th_percentile_and_maximum():
    found = spread(np.arange(1001.0)[::-1])
    assert found == {"p50": 500.0, "p99": 990.0, "max": 1000.0}
