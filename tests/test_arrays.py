"""Values are numbered in the order in which they are first seen, however they are spread."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.arrays import first_seen

WHOLE = st.integers(-3, 3) | st.integers(-(1 << 40), 1 << 40)


@pytest.mark.parametrize("kind", [np.int64, np.float64])
@given(values=st.lists(WHOLE, max_size=30))
def test_values_are_numbered_as_a_dictionary_does(kind, values):
    known: dict[int, int] = {}
    numbers = [known.setdefault(value, len(known)) for value in values]
    found, first = first_seen(np.array(values, dtype=kind))
    assert found.tolist() == numbers
    assert first.tolist() == [values.index(value) for value in known]
