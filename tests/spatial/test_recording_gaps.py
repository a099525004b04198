"""What of a recording lies beyond gaps that nobody can fill in."""

import numpy as np
import pytest

from dmpcli.spatial import recording_gaps

# Samples 0 to 49, 50 to 99 after a minute, 100 to 149 after an hour.
T = np.arange(150) / 50.0 + np.repeat([0.0, 60.0, 3660.0], 50)


@pytest.mark.parametrize(
    ("start", "until", "kept"),
    [
        (None, None, (0, 150)),
        (61.0, 62.0, (50, 100)),
        (30.0, 62.0, (50, 100)),
        (None, 0.9, (0, 50)),
        (None, 30.0, (0, 50)),
        (3000.0, None, (100, 150)),
        (3662.0, None, (100, 150)),
        (61.0, None, (50, 150)),
        (0.5, 61.5, (0, 100)),
    ],
)
def test_what_long_gaps_part_from_the_times_asked_for_is_left_out(start, until, kept):
    assert recording_gaps.inside(T, start, until) == slice(*kept)


def test_a_gap_that_can_be_filled_in_parts_nothing():
    t = np.arange(100) / 50.0
    t[60:] += 20 / 50.0
    assert recording_gaps.inside(t, 1.7, 2.0) == slice(0, 100)
