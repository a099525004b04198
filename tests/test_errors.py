import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.errors import beside


@pytest.mark.parametrize(
    ("value", "bound", "form", "text"),
    [
        (110.0, 100.0, ".0f", "110"),
        (100.3, 100.0, ".0f", "100.3"),
        (100.04, 100.0, ".0f", "100.04"),
        (4.998, 5.0, ".2f", "4.998"),
        (5.0, 5.0, ".2f", "5.00"),
        (250.001, 250.0, ".5g", "250.001"),
        (math.nan, 5.0, ".2f", "nan"),
        (math.inf, 5.0, ".2f", "inf"),
    ],
)
def test_a_number_gets_the_digits_that_tell_it_from_its_bound(value, bound, form, text):
    assert beside(value, bound, form) == text


@given(st.floats(1e-3, 1e4), st.floats(1e-6, 1e-1), st.sampled_from([".0f", ".2f", ".3g"]))
def test_no_number_crosses_or_meets_its_bound(bound, share, form):
    for value in (bound * (1.0 + share), bound * (1.0 - share)):
        text = float(beside(value, bound, form))
        assert (text - bound) * (value - bound) > 0.0
