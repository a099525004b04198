"""A table is cut into parts from its words alone: every row once, few surfaces, one stand-off."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.batch import cut


@pytest.mark.slow
@given(st.integers(1, 60), st.integers(1, 70))
def test_without_surfaces_the_order_is_that_of_the_table(rows, size):
    found = cut.in_order(np.arange(rows), size)
    assert found.count == -(-rows // size)
    joined = np.concatenate([found.rows(n) for n in range(found.count)])
    np.testing.assert_array_equal(joined, np.arange(rows))


@pytest.mark.slow
@given(
    st.lists(st.tuples(st.integers(-1, 6), st.sampled_from([0.0, 1.5])), min_size=1, max_size=80),
    st.integers(1, 9),
    st.integers(1, 4),
    st.integers(1, 100),
)
def test_each_row_lies_in_one_part_of_few_surfaces_and_one_offset(rows, size, most, window):
    site, offset = (np.array(column) for column in zip(*rows, strict=True))
    before = cut.WINDOW
    try:
        cut.WINDOW = window
        found = cut.by_site(site, offset, size, most)
    finally:
        cut.WINDOW = before
    parts = [found.rows(n) for n in range(found.count)]
    np.testing.assert_array_equal(np.sort(np.concatenate(parts)), np.arange(len(rows)))
    for part in parts:
        assert 0 < len(part) <= size
        assert (np.diff(part) > 0).all()
        assert len(np.unique(site[part])) <= most
        assert len(np.unique(offset[part])) == 1


def test_rows_of_one_surface_come_together():
    site = np.tile(np.arange(100), 50)
    found = cut.by_site(site, np.zeros(5000), 500, 10)
    assert found.count == 10
    for number in range(10):
        assert np.unique(site[found.rows(number)]).tolist() == list(
            range(10 * number, 10 * number + 10)
        )


def test_a_thousand_surfaces_are_not_one_part_however_few_their_pairs():
    found = cut.by_site(np.arange(1000), np.zeros(1000), 2000, 16)
    assert found.count == -(-1000 // 16)
