import dataclasses

import numpy as np
import pytest

from dmpcli.errors import RefusedError
from dmpcli.planning import preflight, transfers
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.trajectory import StrokeTrajectory
from tests.control.streaming_fakes import LENGTH, PEN_DOWN, START, WIDE, plan, refuse_any, stroke
from tests.minimum_jerk import minimum_jerk


def failed(checks):
    return [c.quantity for c in checks if not c.passed]


def by_name(checks):
    return {c.quantity: c for c in checks}


def test_the_papers_stroke_passes():
    source = stroke(turn=0.5)
    checks = preflight.within_limits(plan(source), source, WIDE)
    checks += preflight.at_rest(source, 1.0, 0.02, WIDE)
    assert failed(checks) == []
    refuse_any(checks)


def test_peaks_are_those_of_the_closed_form():
    """Straight minimum jerk: 1.875 L/T, 5.7735 L/T², 60 L/T³."""
    source = stroke()
    u = (START[0] - source.position[:, 0])[:, None]
    straight = StrokeTrajectory(
        source.t, START - u * np.array([1.0, 0, 0]), source.rotation, id="0"
    )
    checks = by_name(preflight.within_limits(plan(straight), straight, WIDE))
    assert checks["speed"].value == pytest.approx(1.875 * LENGTH / 10, rel=1e-3)
    assert checks["acceleration"].value == pytest.approx(5.7735 * LENGTH / 100, rel=1e-2)
    assert checks["jerk"].value == pytest.approx(60 * LENGTH / 1000, rel=2e-2)
    assert checks["speed"].t == pytest.approx(5.0, abs=0.02)
    assert checks["speed"].row in (250, 251, 252)


@pytest.mark.parametrize(
    ("quantity", "limit"),
    [
        ("speed", {"speed": 20.0}),
        ("acceleration", {"acceleration": 5.0}),
        ("jerk", {"jerk": 6.0}),
        ("rotation speed", {"rotation_speed": 0.1}),
        ("rotation acceleration", {"rotation_acceleration": 0.03}),
        ("rotation jerk", {"rotation_jerk": 0.03}),
    ],
)
def test_each_limit_is_kept_on_its_own(quantity, limit):
    source = stroke(turn=0.8)
    limits = dataclasses.replace(WIDE, **limit)
    checks = preflight.within_limits(plan(source), source, limits)
    assert failed(checks) == [quantity]
    option = "--max-" + quantity.replace(" ", "-")
    with pytest.raises(RefusedError, match=f"^{quantity} .* at t = .*row .* over.*{option}"):
        refuse_any(checks)


def test_the_speed_that_is_advised_passes():
    source = stroke()
    limits = dataclasses.replace(WIDE, speed=20.0, acceleration=4.0)
    checks = by_name(preflight.within_limits(plan(source), source, limits))
    for quantity in ("speed", "acceleration"):
        factor = float(checks[quantity].remedy.split(" times")[0].split()[-1])
        slower = preflight.within_limits(plan(source, speed=factor), source, limits)
        assert by_name(slower)[quantity].passed


def test_a_single_step_is_found_at_its_row():
    source = stroke(first_row=1001)
    position = source.position.copy()
    position[300:] += np.array([0.0, 0.0, 3.0])
    bad = dataclasses.replace(source, position=position)
    check = by_name(preflight.within_limits(plan(bad), bad, WIDE))["acceleration"]
    assert not check.passed
    assert abs(check.row - 1301) <= 1
    assert check.t == pytest.approx(6.0, abs=0.021)


def test_workspace_names_axis_and_row():
    source = stroke()
    top = START[1] + 24.0
    limits = dataclasses.replace(WIDE, workspace=(-900.0, 0.0, 0.0, top, -100.0, 100.0))
    checks = preflight.within_limits(plan(source), source, limits)
    assert failed(checks) == ["distance outside the workspace in y"]
    assert by_name(checks)[failed(checks)[0]].value == pytest.approx(1.0, abs=1e-2)
    roomy = dataclasses.replace(limits, workspace=(-900.0, 0.0, 0.0, top + 2, -100.0, 100.0))
    assert failed(preflight.within_limits(plan(source), source, roomy)) == []


def test_the_approach_is_checked_too():
    source = stroke()
    outside = START + np.array([20.0, 0.0, 0.0])
    limits = dataclasses.replace(WIDE, workspace=(-900.0, START[0] + 1, 0.0, 900.0, -100.0, 100.0))
    made = plan(source, start=Pose(outside, PEN_DOWN), limits=limits)
    checks = preflight.within_limits(made, source, limits)
    assert failed(checks) == ["distance outside the workspace in x"]


def cut(source, first, last):
    return dataclasses.replace(
        source,
        t=source.t[first:last],
        position=source.position[first:last],
        rotation=None if source.rotation is None else source.rotation[first:last],
    )


@pytest.mark.parametrize(
    ("first", "last", "quantity", "option"),
    [(200, 501, "speed at the start", "--ease-in"), (0, 300, "speed at the end", "--ease-out")],
)
def test_a_file_in_motion_at_an_end_is_refused_with_the_remedy(first, last, quantity, option):
    checks = preflight.at_rest(cut(stroke(), first, last), 1.0, 0.02, WIDE)
    assert failed(checks) == [quantity]
    with pytest.raises(RefusedError, match=option):
        refuse_any(checks)


def test_rotation_in_motion_at_an_end_is_refused():
    source = stroke(turn=1.0)
    still = dataclasses.replace(source, position=np.broadcast_to(START, (501, 3)))
    assert failed(preflight.at_rest(cut(still, 100, 501), 1.0, 0.02, WIDE)) == [
        "rotation at the start"
    ]


def test_end_velocity_is_that_of_the_motion_and_goes_with_the_speed():
    """v(t) = 2 + 3 t: the parabola through three samples is exact."""
    t = np.arange(50) * 0.02
    position = START + (2.0 * t + 1.5 * t**2)[:, None] * np.array([0.6, 0.8, 0.0])
    source = StrokeTrajectory(t, position, id="0")
    start, end = preflight.at_rest(source, 1.0, 0.02, WIDE)
    assert start.value == pytest.approx(2.0)
    assert end.value == pytest.approx(2.0 + 3.0 * t[-1])
    assert preflight.at_rest(source, 0.5, 0.02, WIDE)[0].value == pytest.approx(1.0)
    assert start.limit == pytest.approx(0.2 * 2250.0 * 0.02)


def test_the_arm_must_stand_at_the_start():
    assert failed(preflight.near_start(1.9, 0.03, 2.0, 0.035)) == []
    assert len(failed(preflight.near_start(2.1, 0.03, 2.0, 0.035))) == 1
    assert len(failed(preflight.near_start(2.1, 0.04, 2.0, 0.035))) == 2
    with pytest.raises(RefusedError, match="--approach"):
        refuse_any(preflight.near_start(2.1, 0.0, 2.0, 0.035))


def test_what_is_not_a_number_passes_no_check():
    check = preflight.Check("speed", float("nan"), 250.0, "mm/s", None, None, "")
    assert not check.passed


def test_the_peak_of_a_stroke_is_told_by_its_own_time_and_row_whatever_leads_to_it():
    """Straight minimum jerk is fastest half-way, row 7 + 250, and bends most at 0.2113 of it."""
    source = stroke(first_row=7)
    way = LENGTH * minimum_jerk(source.t / 10.0)
    straight = StrokeTrajectory(
        source.t, START + way[:, None] * [1.0, 0.0, 0.0], source.rotation, None, first_row=7, id="0"
    )
    for start, lead in ((Pose(START, PEN_DOWN), 0), (Pose(START + [0.0, 60.0, 0.0], PEN_DOWN), 50)):
        made = plan(straight, start=start, approach=100.0)
        assert made.lead >= lead
        checks = by_name(preflight.within_limits(made, straight, WIDE))
        assert checks["speed"].t == pytest.approx(5.0, abs=0.03)
        assert checks["speed"].row == pytest.approx(257, abs=2)
        assert checks["speed"].value == pytest.approx(1.875 * LENGTH / 10.0, rel=1e-3)
    bends = by_name(preflight.within_limits(plan(straight), straight, WIDE))["acceleration"]
    assert min(abs(bends.t - at) for at in (2.113, 7.887)) < 0.05
    assert bends.value == pytest.approx(5.7735 * LENGTH / 100.0, rel=1e-2)


def test_a_check_says_quantity_place_limit_and_remedy():
    at = preflight.Check("speed", 260.0, 250.0, "mm/s", 1.5, 76, "slow it down")
    assert str(at) == (
        "speed 260 mm/s at t = 1.500 s (row 76) is over the limit of 250 mm/s; slow it down"
    )
    way = preflight.Check("jerk", 9.0, 8.0, "mm/s³", None, None, "raise it", "in the transfer")
    assert str(way) == "jerk 9 mm/s³ in the transfer is over the limit of 8 mm/s³; raise it"
    bare = preflight.Check("angle", 1.0, 0.5, "rad", None, None, "turn")
    assert str(bare) == "angle 1 rad is over the limit of 0.5 rad; turn"
    assert preflight.Check("speed", 250.0, 250.0, "mm/s", None, None, "").passed


@pytest.mark.parametrize(
    ("name", "option", "order"),
    [("speed", "speed", 1), ("acceleration", "acceleration", 2), ("jerk", "jerk", 3)],
)
def test_the_speed_that_is_advised_goes_with_the_root_of_what_is_too_much(name, option, order):
    source = stroke()
    value = by_name(preflight.within_limits(plan(source), source, WIDE))[name].value
    limits = dataclasses.replace(WIDE, **{name: value / 3.0})
    check = by_name(preflight.within_limits(plan(source), source, limits))[name]
    factor = np.floor(100.0 * 3.0 ** (-1.0 / order)) / 100.0
    assert check.remedy == (
        f"slow it down to {factor:g} times its speed with --speed, or raise --max-{option} if the "
        "arm may"
    )
    # A hundredth of its speed is the least that is advised, and a limit that is kept advises none.
    hopeless = dataclasses.replace(WIDE, **{name: value / 1e7})
    assert by_name(preflight.within_limits(plan(source), source, hopeless))[name].remedy == (
        f"raise --max-{option} if the arm may"
    )


def test_a_way_that_breaks_a_limit_is_told_by_its_name_and_has_no_row():
    source = stroke()
    away = START + [0.0, 60.0, 0.0]
    made = plan(source, start=Pose(away, PEN_DOWN), approach=100.0)
    limits = dataclasses.replace(WIDE, speed=50.0)
    check = by_name(preflight.within_limits(made, source, limits))["speed"]
    assert (check.t, check.row, check.place) == (None, None, "in the approach")
    assert check.value == pytest.approx(100.0, rel=2e-2)
    # Within its limit it is the stroke's own peak that is told.
    check = by_name(preflight.within_limits(made, source, WIDE))["speed"]
    assert check.value < 50.0
    assert check.place == ""


@pytest.mark.parametrize(("axis", "side"), [(a, s) for a in range(3) for s in (0, 1)])
def test_each_side_of_the_workspace_is_kept_to_the_last_bit(axis, side):
    source = stroke()
    made = plan(source)
    box = np.column_stack([made.position.min(axis=0), made.position.max(axis=0)])
    limits = dataclasses.replace(WIDE, workspace=tuple(box.ravel()))
    assert failed(preflight.within_limits(made, source, limits)) == []
    box[axis, side] += (0.5, -0.5)[side]
    limits = dataclasses.replace(WIDE, workspace=tuple(box.ravel()))
    [bad] = [c for c in preflight.within_limits(made, source, limits) if not c.passed]
    assert bad.quantity == f"distance outside the workspace in {'xyz'[axis]}"
    assert bad.value == pytest.approx(0.5)
    row = (np.argmin, np.argmax)[side](made.position[:, axis])
    assert bad.row == row + 1
    assert bad.t == pytest.approx(0.02 * row)
    assert "clearance" not in bad.remedy


def test_a_transfer_that_leaves_the_workspace_may_be_lowered():
    source = stroke(normal=(0.0, 0.0, 1.0))
    ways = transfers.TransferOptions(20.0, 100.0, 50.0, 20.0)
    [made] = transfers.plans([source], 0.02, 1.0, WIDE, Pose(START, PEN_DOWN), True, ways)
    box = (-900.0, 900.0, -900.0, 900.0, -100.0, START[2] + 15.0)
    checks = preflight.within_limits(made, source, dataclasses.replace(WIDE, workspace=box))
    [bad] = [c for c in checks if not c.passed]
    assert (bad.quantity, bad.place) == ("distance outside the workspace in z", "in the retract")
    assert bad.value == pytest.approx(5.0)
    assert bad.remedy.startswith("move the stroke, lower --clearance, or widen --workspace (z -100")


def test_two_samples_tell_their_straight_velocity_and_three_a_parabolas():
    t = np.array([1.0, 1.5])
    short = StrokeTrajectory(t, np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 4.0]]), first_row=9, id="0")
    start, end = preflight.at_rest(short, 1.0, 0.02, WIDE)
    assert start.value == pytest.approx(10.0)
    assert end.value == pytest.approx(10.0)
    assert (start.t, start.row, end.t, end.row) == (0.0, 9, 0.5, 10)
    assert "--ease-in S, which brings it from rest" in start.remedy
    assert "--ease-out S, which brings it to rest" in end.remedy
    uneven = np.array([0.0, 0.1, 0.4])
    y = (2.0 * uneven + 3.0 * uneven**2)[:, None] * [1.0, 0.0, 0.0]
    start, end = preflight.at_rest(StrokeTrajectory(uneven, y, id="0"), 1.0, 0.02, WIDE)
    assert start.value == pytest.approx(2.0)
    assert end.value == pytest.approx(2.0 + 6.0 * 0.4)
