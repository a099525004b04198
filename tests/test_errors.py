import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli import errors
from dmpcli.admittance.model import AdmittanceLaw, check_stable
from dmpcli.errors import InputError, about, beside, printable
from dmpcli.kinematics import chain, inverse, models
from dmpcli.records import tolerance_mark
from dmpcli.workflows.ranges import within


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


def beyond_joint_limit():
    arm = models.model("ec66")
    narrow = replace(arm, limits=np.radians(np.tile([-57.3, 57.3], (6, 1))))
    q = np.array([np.radians(57.3004), -0.9, 0.9, 0.5, -0.9, 0.7])
    inverse.nearest(narrow, chain.forward(narrow, q), q)


@pytest.mark.parametrize(
    ("refuse", "told"),
    [
        (
            lambda: within("--start", [0.0, -1000000.1], 1e6),
            r"--start: -1000000\.1 is beyond 1e\+06",
        ),
        (lambda: within("--goal", [1000000.1], 1e6), r"--goal: 1000000\.1 is beyond"),
        (
            lambda: check_stable(
                AdmittanceLaw(np.full(6, 0.01), np.full(6, 1.0000001), np.zeros(6), 0.02)
            ),
            r"= 0\.040000004 not below 4M = 0\.04 ",
        ),
        (beyond_joint_limit, r"would turn to 57\.3004°, beyond -57\.3° to 57\.3°"),
    ],
)
def test_no_refusal_rounds_a_number_onto_its_bound(refuse, told):
    with pytest.raises(errors.DmpError, match=told):
        refuse()


def test_a_skills_mark_names_two_lengths_that_differ():
    said = tolerance_mark.text("a", {"rms": 0.02, "largest": 0.40004, "tolerance": 0.1})
    assert "largest 0.40004 mm, beyond its tolerance of 0.1 mm, 0.4 mm anywhere" in said


def test_a_skills_mark_does_not_call_a_path_beyond_that_is_within():
    said = tolerance_mark.text("a", {"rms": 0.004, "largest": 0.074, "tolerance": 0.1})
    assert "keeps the path, RMS 0.004 mm, largest 0.074 mm, but not the wave height" in said
