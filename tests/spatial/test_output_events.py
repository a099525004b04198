"""Where outputs are switched along a stroke, by arithmetic; and the column that holds it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.errors import InputError
from dmpcli.spatial import output_events
from dmpcli.spatial.output_events import NotPlacedError, OutputEvent

T = np.linspace(0.0, 2.0, 101)
LINE = np.column_stack([50.0 * T, 0.0 * T, 0.0 * T])  # 50 mm/s
HOP = np.where((T > 0.5) & (T < 1.5), 5.0, 0.0)


def places(*texts, position=LINE, height=None):
    return output_events.placed(output_events.asked(texts), T, position, height)


def test_a_distance_is_that_along_the_path():
    turn = LINE.copy()
    turn[51:] = [50.0, 0.0, 0.0] + 50.0 * (T[51:, None] - 1.0) * [0.0, 1.0, 0.0]
    found = places("on@12.5mm:DO1", "off@75mm:DO1", position=turn)
    assert [(event.on, event.output) for event in found] == [(True, "DO1"), (False, "DO1")]
    np.testing.assert_allclose([event.t for event in found], [0.25, 1.5], atol=1e-12)


def test_ends_and_lifts_are_found_in_time_order():
    found = places(
        *("on@touch:DO1", "off@end:DO1", "on@start:DO1", "off@lift:DO1"), height=HOP, position=LINE
    )
    assert [event.deed for event in found] == ["on DO1", "off DO1", "on DO1", "off DO1"]
    # 1 mm is crossed a fifth of the way from one sample to the next, and four fifths down.
    wanted = [0.0, 0.5 + 0.02 / 5, 1.48 + 0.02 * 4 / 5, 2.0]
    np.testing.assert_allclose([event.t for event in found], wanted, atol=1e-9)


@pytest.mark.parametrize(
    ("text", "words"),
    [("on@100.1mm:DO1", "the path ends after 100.000 mm"), ("on@lift:DO1", "nowhere lifted")],
)
def test_what_has_no_place_on_the_stroke_is_said(text, words):
    with pytest.raises(NotPlacedError, match=words):
        places(text, height=0.0 * T)


@pytest.mark.parametrize(
    "text", ["on:DO1", "on@12:DO1", "up@start:DO1", "on@start:1", "on@-3mm:DO1", "on@nanmm:DO1", ""]
)
def test_what_is_no_event_is_refused_with_an_example(text):
    with pytest.raises(InputError, match=r"as in on@12.5mm:DO1"):
        output_events.asked([text])


def test_an_event_that_is_given_twice_is_refused():
    with pytest.raises(InputError, match="twice"):
        output_events.asked(["on@5mm:DO1", "on@5.0mm:DO1"])


EVENT = st.builds(OutputEvent, st.floats(0.0, 2.0), st.sampled_from(["DO1", "TO0"]), st.booleans())


@pytest.mark.slow
@given(st.lists(EVENT, max_size=8))
def test_a_column_holds_them_to_a_nanosecond(events):
    events = sorted(events, key=lambda event: event.t)
    found = output_events.read(output_events.stored(events, T), T)
    assert [event.deed for event in found] == [event.deed for event in events]
    np.testing.assert_allclose(
        [event.t for event in found], [event.t for event in events], atol=2e-10
    )


@pytest.mark.parametrize("text", ["on", "on DO1 +0.5", "on DO1, off DO2", "on DO1 +-1", "an DO1"])
def test_a_text_that_is_none_is_refused_by_row(text):
    with pytest.raises(NotPlacedError, match="row 4"):
        output_events.read([None, None, None, text, *[None] * 97], T)
