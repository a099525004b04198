"""Tables of text: numbers parsed at once are those that are parsed column by column."""

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.records import tables
from dmpcli.records.file_io import Source

CELLS = st.floats(-1e6, 1e6).map(repr) | st.sampled_from(["0", "-.5", "7.", "1e3", "1e-300", "3 "])


def both(text):
    source = Source("a.csv", text.encode())
    return tables.read(source), tables.read(source, texts=("id",))


@pytest.mark.slow
@given(st.lists(st.tuples(CELLS, CELLS), min_size=1, max_size=20))
def test_both_ways_give_the_same_numbers(rows):
    plain, quick = both("a,b\n" + "\n".join(f"{a},{b}" for a, b in rows) + "\n")
    for name in "ab":
        np.testing.assert_array_equal(quick.floats(name), plain.floats(name))


def test_numbers_are_parsed_at_once_and_names_and_stamps_stay_text():
    _, quick = both("id,t,x\n7,1700000000.123456789,1.5\n7,1700000000.223456789,2.5\n")
    assert [quick.columns[name].type for name in ("id", "t")] == [pa.string(), pa.string()]
    assert quick.columns["x"].dtype == float


@pytest.mark.parametrize("cell", ["", "nan", "inf", "abc", "1,5", "NULL"])
def test_a_cell_that_is_no_plain_number_is_shown_as_it_stands(cell):
    plain, quick = both(f't,x\n0,1\n1,"{cell}"\n2,3\n')
    assert quick.columns["x"].type == pa.string()
    assert quick.shown("x", 1) == plain.shown("x", 1)
    np.testing.assert_array_equal(quick.floats("x"), plain.floats("x"))
