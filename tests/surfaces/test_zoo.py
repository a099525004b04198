"""CAD-like parts: strokes on a patch are drawn, others drawn or refused for what happens."""

from collections import Counter

import pytest

from tests.surfaces import zoo
from tests.surfaces.judge import verdicts


def judged(name, count, seed):
    """Judge a part's strokes: none wrong, every refusal confirmed; return both verdicts."""
    on_patch, anywhere = verdicts(zoo.mesh(name), count, seed)
    assert on_patch.count == anywhere.count == count
    for found in (on_patch, anywhere):
        assert not found.wrong, found
        assert not found.unconfirmed, found
    return on_patch, anywhere


def rates(verdicts):
    """Share drawn, and share refused without a geodesic."""
    verdicts = list(verdicts)
    count = sum(found.count for found in verdicts)
    refused = sum((Counter(found.refused) for found in verdicts), Counter())
    return 1.0 - refused.total() / count, refused["NO_GEODESIC"] / count


def check(found):
    """Hold the verdicts on all parts against what is asked of them together."""
    patches, anywhere = zip(*found, strict=True)
    drawn, _ = rates(patches)
    assert drawn >= 0.98
    drawn, lost = rates(anywhere)
    assert drawn >= 0.9
    assert lost <= 0.01


def test_the_zoo_is_as_large_as_it_is_meant_to_be():
    assert len(zoo.PARTS) >= 12


@pytest.mark.slow
@pytest.mark.parametrize("name", zoo.PARTS)
def test_no_part_is_taken_for_a_noisy_scan(name):
    assert zoo.mesh(name).shape.noisy_share <= 0.001


@pytest.mark.thorough
def test_strokes_on_parts_are_drawn_right_or_refused_for_what_the_tracer_meets_too():
    check([judged(name, 12, 2) for name in zoo.PARTS])
