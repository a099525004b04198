"""The verdict before a motion, on plans whose lengths and times are known."""

import dataclasses

import numpy as np

from dmpcli.control.execution_plan import CheckedPlan
from dmpcli.control.preflight_table import MOST_ROWS, table
from dmpcli.planning.preflight import Check
from dmpcli.spatial.pose import Pose
from tests.control.streaming_fakes import PEN_DOWN, START, plan, stroke

PASSED = Check("speed", 30.0, 250.0, "mm/s", 5.0, 251, "")
NEAR = Check("jerk", 49_000.0, 50_000.0, "mm/s³", None, None, "", "in the transfer")
OVER = Check("acceleration", 3000.0, 2250.0, "mm/s²", 0.1, 6, "")
OUT = Check("distance outside the workspace in x", 0.5, 0.0, "mm", 1.0, 51, "")
INSIDE = Check("distance outside the workspace in x", 0.0, 0.0, "mm", 0.0, 1, "")


def checked(name, *checks):
    return CheckedPlan(dataclasses.replace(plan(), id=name), list(checks))


def length():
    return np.linalg.norm(np.diff(stroke().position, axis=0), axis=1).sum()


def test_one_stroke_has_a_line_for_each_check_and_says_how_long_it_is():
    lines = table([checked("a", PASSED, NEAR)]).splitlines()
    assert lines[0] == (f"stroke: {length():.3f} mm in 10.000 s, 501 set-points every 0.02 s")
    assert lines[1].split() == ["check", "value", "limit", "unit", "at"]
    assert lines[2].split() == ["speed", "30", "250", "mm/s", "5.000", "s", "(row", "251)", "ok"]
    assert lines[3].split() == ["jerk", "49000", "50000", "mm/s³", "in", "the", "transfer", "ok"]
    assert lines[4] == "may be executed"
    # Numbers stand to the right, words to the left.
    assert lines[2].index("30 ") + 1 == lines[3].index("49000") + 4
    assert lines[2].index("mm/s") == lines[3].index("mm/s³")


def test_what_is_over_its_limit_is_refused():
    lines = table([checked("a", PASSED, OVER)]).splitlines()
    assert lines[3].endswith("TOO MUCH")
    assert lines[4] == "refused"


def test_the_way_to_a_stroke_is_told_beside_its_own_time():
    led = plan(start=Pose(START + [0.0, 40.0, 0.0], PEN_DOWN))
    head = table([CheckedPlan(led, [PASSED])]).splitlines()[0]
    assert f"{length():.3f} mm in 10.000 s, 501 set-points" in head
    assert head.endswith(f", after an approach of {led.lead * 0.02:.3f} s")


def test_of_several_strokes_each_shows_what_is_nearest_to_its_limit():
    lines = table([checked("a", PASSED, NEAR, INSIDE), checked("b", PASSED, INSIDE)]).splitlines()
    assert lines[0] == (
        f"2 strokes: {2 * length():.3f} mm in 20.000 s; with the ways between them 20.040 s"
    )
    assert lines[2].split()[:6] == ["a", f"{length():.3f}", "10.000", "0.020", "jerk", "49000"]
    assert lines[3].split()[:5] == ["b", f"{length():.3f}", "10.000", "0.020", "speed"]
    assert lines[4] == "may be executed"
    bad = table([checked("a", PASSED, OUT), checked("b", OVER, NEAR), checked("c", PASSED)])
    assert "a " in bad.splitlines()[2]
    assert "outside the workspace" in bad.splitlines()[2]
    assert "acceleration" in bad.splitlines()[3]
    assert bad.endswith("refused: 2 of 3")


def test_of_many_strokes_those_are_shown_that_fail_or_come_nearest_in_their_order():
    of = [checked(f"s{i}", dataclasses.replace(PASSED, value=5.0 * (i % 40))) for i in range(40)]
    of[3] = checked("s3", OVER)
    of[8] = checked("s8", dataclasses.replace(PASSED, value=np.nan))
    lines = table(of).splitlines()
    assert lines[1] == f"the {MOST_ROWS} of them that fail or come nearest to a limit:"
    shown = [line.split()[0] for line in lines[3:-1]]
    assert shown == ["s3", "s8", *(f"s{i}" for i in range(22, 40))]
    assert lines[-1] == "refused: 2 of 40"
    assert "come nearest" not in table(of[10:30])
