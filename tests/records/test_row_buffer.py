import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.records.row_buffer import RowBuffer

GROUPS = {"t": 1, "place": 3, "turn": 9}


def filled(count, texts=("word",)):
    rows = RowBuffer(GROUPS, texts)
    for i in range(count):
        rows.add((i, np.full(3, i + 0.5), np.full((3, 3), -1.0 * i)), [f"w{i}" for _ in texts])
    return rows


def test_rows_come_back_as_they_were_added_over_the_borders_of_blocks():
    rows = filled(5000)
    assert len(rows) == 5000
    np.testing.assert_array_equal(rows.numbers("t"), np.arange(5000.0))
    np.testing.assert_array_equal(rows.numbers("place", 2040)[:, 1], np.arange(2040, 5000) + 0.5)
    assert rows.rotations("turn").shape == (5000, 3, 3)
    assert rows.words("word", 4095, 4097) == ["w4095", "w4096"]


@pytest.mark.slow
@given(st.lists(st.integers(0, 3000), max_size=4))
def test_adding_many_at_once_is_adding_one_by_one(sizes):
    one, many = filled(sum(sizes)), RowBuffer(GROUPS, ("word",))
    at = 0
    for size in sizes:
        many.extend(one.whole(at, at + size), {"word": one.words("word", at, at + size)})
        at += size
    np.testing.assert_array_equal(many.whole(0, len(many)), one.whole(0, len(one)))
    assert many.words("word") == one.words("word")


def test_a_row_counts_only_once_it_is_whole():
    rows = RowBuffer({"t": 1})
    seen = []

    class Watching(float):
        def __float__(self):
            seen.append(len(rows))
            return 1.0

    rows.add((Watching(),))
    assert set(seen) <= {0}
    assert len(rows) == 1


def test_no_rows_are_empty_columns():
    rows = RowBuffer(GROUPS, ("word",))
    assert rows.numbers("t").shape == (0,)
    assert rows.numbers("place").shape == (0, 3)
    assert rows.words("word") == []
