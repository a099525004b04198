"""What a run file says of the contact, counted by hand."""

import numpy as np
import pytest

from dmpcli.control.contact_tally import ContactTally


def test_forces_errors_and_shares_are_those_of_the_cycles_that_were_to_press():
    tally = ContactTally()
    tally.begin("a")
    for force, touching in ((5.0, True), (0.25, False), (6.0, True), (4.0, True)):
        tally.add(force, 5.0, touching, force == 6.0)
    tally.begin("b")
    tally.add(3.0, 3.0, True, False)
    tally.begin("lifted")
    found = tally.facts(0.5)
    assert (found["least"], found["mean"], found["largest"]) == (0.25, 3.65, 6.0)
    assert (found["share"], found["saturated"]) == (0.8, 0.2)
    assert found["rms_error"] == pytest.approx(np.sqrt((4.75**2 + 1.0 + 1.0) / 5.0))
    assert found["shares"] == {"a": 0.75, "b": 1.0}
    assert [tally.share(name) for name in ("a", "b", "lifted")] == [0.75, 1.0, 1.0]
    assert tally.felt == [5.0, 0.25, 6.0, 4.0, 3.0]


def test_where_no_force_was_wanted_nothing_is_said():
    tally = ContactTally()
    tally.begin("a")
    assert tally.facts(0.5) == {}
