import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.errors import InputError
from dmpcli.simulation.elite_server.faults import CHOICES, KINDS, SHARES, Event, LabFaults, parse


def test_without_specifications_nothing_goes_wrong():
    faults = parse([])
    assert faults == LabFaults()
    assert faults.habits.policies.underrun == "hold"
    assert faults.habits.policies.jump == "alarm"


@pytest.mark.parametrize("kind", SHARES)
def test_a_share_of_datagrams(kind):
    assert parse([f"{kind}=0.25"]).shares == {kind: 0.25}


def test_the_sensor_falls_silent_and_saturates_at_a_time_or_from_the_beginning():
    faults = parse(["silence@2.5", "saturation"])
    assert (faults.silence, faults.saturation) == (2.5, 0.0)
    assert parse([]).silence == math.inf


@pytest.mark.parametrize(
    ("text", "event"),
    [
        ("estop@3", Event("estop", 3.0)),
        ("estop", Event("estop", None)),
        ("collision@0.5", Event("collision", 0.5)),
        ("mode@1", Event("mode", 1.0, 0)),
        ("mode=teach", Event("mode", None, 0)),
        ("mode=play@2", Event("mode", 2.0, 1)),
        ("refuse@1", Event("refuse", 1.0)),
        ("drop@1", Event("drop", 1.0, "both")),
        ("drop=monitor@1", Event("drop", 1.0, "monitor")),
    ],
)
def test_what_happens_to_the_controller(text, event):
    assert parse([text]).events == (event,)


@pytest.mark.parametrize("kind", CHOICES)
def test_every_unknown_behaviour_can_be_chosen(kind):
    chosen = [parse([f"{kind}={value}"]).habits for value in CHOICES[kind]]
    assert len(set(chosen)) == len(CHOICES[kind])
    assert chosen[0] == parse([]).habits


def test_several_specifications_add_up():
    faults = parse(["loss=0.1", "estop@1", "underrun=alarm", "drop=robot@2", "newline=yes"])
    assert faults.shares == {"loss": 0.1}
    assert [event.kind for event in faults.events] == ["estop", "drop"]
    assert faults.habits.policies.underrun == "alarm"
    assert faults.habits.newline


@pytest.mark.parametrize(
    ("texts", "hint"),
    [
        (["explode@1"], "no such fault; there are loss, "),
        (["loss"], "after loss= a number is needed, 0 to 1"),
        (["loss=2"], "after loss= a number is needed, 0 to 1"),
        (["loss=0.1@3"], "leave @ out"),
        (["silence@soon"], "after @ a number is needed, 0 or more s"),
        (["estop@-1"], "after @ a number is needed, 0 or more s"),
        (["estop@nan"], "after @ a number is needed"),
        (["estop=hard@1"], "takes no value, only a time: estop@T"),
        (["silence=1"], "takes no value, only a time: silence@T"),
        (["underrun=panic"], "one of hold, decelerate, alarm"),
        (["jump"], "say which: jump=alarm|ignore|clamp"),
        (["jump=alarm@2"], "leave @ out"),
        (["mode=fast"], "one of teach, play"),
        (["drop"], "say when the connection drops: drop@T"),
        (["estop@1", "estop@2"], "estop is given twice"),
        ([""], "no such fault"),
    ],
)
def test_a_specification_that_is_not_understood_is_named_with_what_would_do(texts, hint):
    with pytest.raises(InputError) as caught:
        parse(texts)
    assert hint in str(caught.value)
    assert str(caught.value).startswith(f"--fault {texts[-1]}")


@pytest.mark.slow
@given(st.lists(st.one_of(st.text(), st.from_regex(rf"({'|'.join(KINDS)})(=\w*)?(@.*)?"))))
def test_any_text_is_understood_or_refused(texts):
    try:
        assert isinstance(parse(texts), LabFaults)
    except InputError as error:
        assert "--fault " in str(error)
