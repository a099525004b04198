import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.errors import InputError, about, beside, printable


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


@pytest.mark.parametrize(
    ("said", "shown"),
    [
        ("a\x1b[2Jb", r"a\u001b[2Jb"),
        ("a\rdmpcli: done", r"a\u000ddmpcli: done"),
        ("\x9b31m \x7f", r"\u009b31m \u007f"),
        ("moc.\u202egpj", r"moc.\u202egpj"),
        ("bad\udcff", r"bad\udcff"),
        ("a\u2028b\x85", r"a\u2028b\u0085"),
        ("first\nsecond\tthird", "first\nsecond\tthird"),
        ("name\ndmpcli: done, all is well", "name\n  dmpcli: done, all is well"),
        ("mm² ± 3° – Größe 長さ", "mm² ± 3° – Größe 長さ"),
    ],
)
def test_what_would_move_a_cursor_or_hide_words_is_shown(said, shown):
    assert printable(said) == shown
    assert json.loads(printable(json.dumps(said, ensure_ascii=False)).replace("\n", "")) == said


def test_a_file_is_named_once_however_many_say_it():
    for said in ("row 3: no value", "a.csv: row 3: no value"):
        with pytest.raises(InputError) as told, about("a.csv"):
            raise InputError(said)
        assert str(told.value) == "a.csv: row 3: no value"
