"""Deadline statistics of a loop."""

import numpy as np
import pytest

from dmpcli.measures.timing import punctuality


def test_quantiles_and_missed_deadlines():
    lateness = np.full(1000, 1e-4)
    lateness[:20] = 5e-3
    lateness[0] = 0.025
    got = punctuality(lateness, period=0.02)
    assert (got.median, got.worst, got.missed, got.cycles) == (1e-4, 0.025, 1, 1000)
    assert got.p99 == pytest.approx(5e-3)


def test_a_cycle_late_by_exactly_one_period_is_missed():
    assert punctuality(np.array([0.0, 0.02, 0.0199]), 0.02).missed == 1
