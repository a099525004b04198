"""Parts of a stroke: where they begin and end, and that each goes from rest to rest."""

import numpy as np
import pytest

from dmpcli.dmp.pieces import Path, inside, retimed
from dmpcli.dmp.tool_speed import Pace

STROKE = np.linspace(0.0, 10.0, 501)
LINE = np.stack([30.0 * STROKE, 0 * STROKE, 0 * STROKE], axis=-1)


def outside_of(*parts):
    x = LINE[:, 0]
    return np.any([(x > a) & (x < b) for a, b in parts], axis=0)


def test_parts_run_from_their_first_to_their_last_sample_and_short_ones_are_left_out():
    outside = outside_of((100.2, 150.1), (154.3, 200.3))
    spans = inside(STROKE, LINE, outside, 5.0)
    at = [(30.0 * a, 30.0 * b) for a, b in spans]
    np.testing.assert_allclose(at, [(0.0, 100.2), (200.4, 300.0)])
    assert len(inside(STROKE, LINE, outside, 3.0)) == 3
    assert inside(STROKE, LINE, np.ones(501, dtype=bool), 0.0) == []
    assert inside(STROKE, LINE, np.zeros(501, dtype=bool), 5.0) == [(0.0, 10.0)]


@pytest.mark.parametrize("pace", [None, Pace(40.0)])
def test_each_part_goes_from_rest_to_rest_on_the_same_path_and_all_is_in_order(pace):
    spans = inside(STROKE, LINE, outside_of((100.0, 150.0)), 5.0)
    times, cuts = retimed(spans, STROKE, Path(STROKE, LINE), pace, 50.0, 1.0, (0.5, 0.5))
    assert (times[0], times[-1]) == (0.0, 10.0)
    assert np.all(np.diff(times) >= 0.0)
    for (first, end), (begin, last) in zip(cuts, spans, strict=True):
        part = times[first:end]
        assert (part[0], part[-1]) == (begin, last)
        v = 30.0 * np.diff(part) * 50.0
        assert max(v[0], v[-1]) < 2.0
        assert v.max() == pytest.approx(40.0 if pace else 30.0, rel=0.02)


def test_a_stroke_s_own_end_is_as_soft_as_it_was_asked_to_be():
    spans = inside(STROKE, LINE, outside_of((100.0, 150.0)), 5.0)
    times, cuts = retimed(spans, STROKE, None, None, 50.0, 1.0, (0.0, 0.0))
    first, last = (30.0 * np.diff(times[a:b]) * 50.0 for a, b in cuts)
    assert first[0] == pytest.approx(30.0, rel=0.02)
    assert last[-1] == pytest.approx(30.0, rel=0.02)
    assert max(first[-1], last[0]) < 2.0
