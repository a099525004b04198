import contextlib
import gc
import sys

import pytest

from dmpcli.control.loop_timing import LoopTiming, undisturbed


def test_each_part_of_a_cycle_is_measured_from_where_it_counts():
    pace = LoopTiming()
    for i in range(100):
        pace.add(10.0 + i, 10.001 + i, 10.003 + i, 10.004 + i)
    pace.missed = 2
    facts = pace.facts()
    assert facts["wake"]["p50"] == pytest.approx(0.001)
    assert facts["lateness"]["p99"] == pytest.approx(0.003)
    assert facts["work"]["max"] == pytest.approx(0.003)
    assert facts["missed"] == 2
    assert "3.00 ms late (median)" in str(pace)
    assert "2 of 102 periods missed" in str(pace)


def test_rounding_makes_nothing_early():
    pace = LoopTiming()
    pace.add(1.0, 1.0 - 1e-16, 1.0 - 1e-16, 1.0)
    assert pace.facts()["wake"]["p50"] == 0.0


def test_no_cycle_no_facts():
    assert LoopTiming().facts() == {}
    assert str(LoopTiming()) == "no cycle ran"


def test_housekeeping_waits_and_comes_back():
    before = (gc.isenabled(), sys.getswitchinterval())
    with contextlib.suppress(ZeroDivisionError), undisturbed():
        assert not gc.isenabled()
        assert sys.getswitchinterval() < before[1]
        raise ZeroDivisionError
    assert (gc.isenabled(), sys.getswitchinterval()) == pytest.approx(before)
    assert gc.get_freeze_count() == 0
