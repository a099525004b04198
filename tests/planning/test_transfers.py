"""Ways between strokes, against geometry and finite differences that are computed here."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from dmpcli.errors import InputError, RefusedError
from dmpcli.planning import transfers
from dmpcli.planning.transfers import TransferOptions
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.trajectory import StrokeTrajectory
from tests.control.streaming_fakes import PEN_DOWN, WIDE
from tests.minimum_jerk import minimum_jerk

PERIOD = 0.02
WAYS = TransferOptions(20.0, 100.0, 50.0, 20.0, settling=3)


def line(name, start, goal, normal=(0.0, 0.0, 1.0), turn=0.0, seconds=4.0):
    """A straight stroke at minimum jerk; the tool turns about base z on the way."""
    t = np.arange(round(seconds / PERIOD) + 1) * PERIOD
    u = minimum_jerk(t / seconds)
    start, goal = np.asarray(start, float), np.asarray(goal, float)
    spin = Rotation.from_rotvec(np.outer(turn * u, [0.0, 0.0, 1.0])).as_matrix()
    n = np.asarray(normal, float) / np.linalg.norm(normal)
    return StrokeTrajectory(
        t, start + u[:, None] * (goal - start), spin @ PEN_DOWN, np.tile(n, (len(t), 1)), id=name
    )


LEVEL = [
    line("a", (0, 0, 0), (80, 0, 0)),
    line("b", (200, 50, 0), (200, 120, 0), turn=0.5),
    line("c", (-50, -60, 0), (40, -60, 0), turn=-1.0),
]


def toured(strokes, start=None, near=True, ways=WAYS, limits=WIDE, speed=1.0, approach=None):
    start = strokes[0].pose(0) if start is None else start
    return list(transfers.plans(strokes, PERIOD, speed, limits, start, near, ways, approach))


def whole(plans):
    """The set-points and phases of all plans, one after the other as they are sent."""
    position = np.concatenate([p.position for p in plans])
    rotation = np.concatenate([p.rotation for p in plans])
    phases = np.array([p.phase_at(i) for p in plans for i in range(len(p))])
    return position, rotation, phases


def turns(rotation):
    return Rotation.from_matrix(rotation[1:]) * Rotation.from_matrix(rotation[:-1]).inv()


def peaks(position, rotation):
    """Largest speed, acceleration and jerk of the tip, then of its rotation by scipy."""
    for step in (np.diff(position, axis=0), turns(rotation).as_rotvec()):
        held = np.pad(step, ((2, 2), (0, 0)))
        for order in range(3):
            rate = np.diff(held, order, axis=0) / PERIOD ** (order + 1)
            yield np.linalg.norm(rate, axis=1).max()


def speed_of(position):
    return np.linalg.norm(np.diff(position, axis=0), axis=1) / PERIOD


def test_the_strokes_themselves_are_streamed_unchanged_in_order():
    plans = toured(LEVEL)
    assert [p.id for p in plans] == ["a", "b", "c"]
    for p, stroke in zip(plans, LEVEL, strict=True):
        assert np.array_equal(p.position[p.lead : p.last + 1], stroke.position)
        assert np.array_equal(p.rotation[p.lead : p.last + 1], stroke.rotation)
        assert np.array_equal(p.t[p.lead : p.last + 1], stroke.t)


def test_phases_follow_each_other():
    plans = toured(LEVEL)
    for p, expected in zip(
        plans,
        (
            ["stroke", "retract"],
            ["transfer", "approach", "stroke", "retract"],
            ["transfer", "approach", "stroke", "retract"],
        ),
        strict=True,
    ):
        assert list(dict.fromkeys(p.phase_at(i) for i in range(len(p)))) == expected


def test_each_plan_begins_at_rest_where_the_one_before_ends():
    plans = toured(LEVEL)
    for before, after in pairwise(plans):
        assert np.array_equal(before.position[-1], before.position[-2])
        np.testing.assert_allclose(after.position[0], before.position[-1], atol=1e-9)
        np.testing.assert_allclose(after.rotation[0], before.rotation[-1], atol=1e-9)


def test_on_a_level_plate_the_pen_crosses_at_the_clearance_and_goes_straight_up_and_down():
    position, _, phases = whole(toured(LEVEL))
    np.testing.assert_allclose(position[phases == "transfer", 2], 20.0, atol=1e-9)
    ends = np.array([s.position[e, :2] for s in LEVEL for e in (0, -1)])
    for phase in ("retract", "approach"):
        way = position[phases == phase]
        apart = np.linalg.norm(way[:, None, :2] - ends[None], axis=-1).min(axis=1)
        assert apart.max() < 1e-9


def test_every_way_rests_at_its_end_for_the_settling_time():
    p = toured(LEVEL)[1]
    firsts = [first for _, first in p.legs] + [len(p)]
    ways = [(a, b) for a, b in pairwise(firsts) if a != p.lead]
    for first, end in ways:
        assert np.ptp(p.position[max(end - 3, first) : end], axis=0).max() == 0.0
    assert np.ptp(p.position[p.last : p.last + 4], axis=0).max() == 0.0


def test_on_a_tilted_plane_the_pen_leaves_along_the_normal_and_rises_along_base_z():
    tilt = Rotation.from_euler("y", 30, degrees=True).as_matrix()
    n = tilt @ [0, 0, 1]
    strokes = [
        line("a", tilt @ [0, 0, 0], tilt @ [80, 0, 0], n),
        line("b", tilt @ [-60, 40, 0], tilt @ [-90, 40, 0], n),
    ]
    position, _, phases = whole(toured(strokes))
    assert (position @ n)[phases == "transfer"].min() >= 20.0 - 1e-9
    off = position[phases == "retract"] - strokes[0].position[-1]
    off = off[np.linalg.norm(off, axis=1) < 20.001]
    np.testing.assert_allclose(np.cross(off, n), 0.0, atol=1e-9)
    top = max(s.position[:, 2].max() for s in strokes)
    assert position[phases == "transfer"][:, 2].max() == pytest.approx(top + 20.0)


@pytest.mark.parametrize("normal", [(1.0, 0.0, 0.0), (0.0, 0.0, -1.0)])
def test_on_a_wall_or_a_ceiling_height_is_along_the_normal(normal):
    n = np.array(normal)
    strokes = [line("a", (0, 0, 0), (0, 50, 0), n), line("b", (0, 90, 0), (0, 60, 0), n)]
    position, _, phases = whole(toured(strokes))
    np.testing.assert_allclose(position[phases == "transfer"] @ n, 20.0, atol=1e-9)
    assert (position @ n).min() >= -1e-9


def test_faces_that_look_apart_are_refused_by_name():
    under = line("under", (0, 0, -9), (50, 0, -9), (0, 0, -1))
    with pytest.raises(RefusedError, match=r"stroke .*: faces another side"):
        toured([LEVEL[0], under])


def test_a_hill_is_crossed_above_the_stroke_on_it():
    strokes = [
        line("a", (0, 0, 0), (50, 0, 0)),
        line("b", (0, 99, 0), (50, 99, 0)),
        line("top", (0, 50, 70), (50, 50, 70)),
    ]
    position, _, phases = whole(toured(strokes)[1:2])
    assert position[phases == "transfer", 2].max() == pytest.approx(90.0)


def test_without_normals_the_pen_leaves_back_along_the_tool():
    strokes = [replace(s, normal=None) for s in LEVEL[:2]]
    position, _, phases = whole(toured(strokes))
    np.testing.assert_allclose(position[phases == "transfer", 2], 20.0, atol=1e-9)


def test_an_arm_that_stands_elsewhere_rises_before_it_crosses():
    away = Pose(np.array([30.0, -200.0, 0.0]), PEN_DOWN)
    p = toured(LEVEL, start=away, near=False, approach=15.0)[0]
    way = p.position[: p.lead + 1]
    np.testing.assert_allclose(way[0], away.position)
    here, there = away.position[:2], LEVEL[0].position[0, :2]
    beside = np.minimum(
        np.linalg.norm(way[:, :2] - here, axis=1), np.linalg.norm(way[:, :2] - there, axis=1)
    )
    assert beside[way[:, 2] < 19.999].max() < 1e-9
    assert speed_of(way).max() <= 15.0 + 1e-9


def test_an_arm_that_stands_higher_does_not_go_down_to_cross():
    high = Pose(np.array([30.0, -200.0, 150.0]), PEN_DOWN)
    p = toured(LEVEL, start=high, near=False)[0]
    way = p.position[: p.lead]
    crossing = np.linalg.norm(way[:, :2] - LEVEL[0].position[0, :2], axis=1) > 1e-6
    np.testing.assert_allclose(way[crossing, 2], 150.0, atol=1e-9)


def test_each_way_has_its_own_speed():
    position, _, phases = whole(toured(LEVEL))
    for phase, most in (("transfer", 100.0), ("retract", 50.0), ("approach", 20.0)):
        found = speed_of(position)[phases[1:] == phase].max()
        assert 0.95 * most < found <= most + 1e-6, phase


@pytest.mark.parametrize(("factor", "share"), [(0.1, 0.1), (2.0, 1.0)])
def test_a_lower_speed_slows_the_ways_too_and_a_higher_one_does_not_quicken_them(factor, share):
    position, _, phases = whole(toured(LEVEL, speed=factor))
    found = speed_of(position)[phases[1:] == "transfer"].max()
    assert 95.0 * share < found <= 100.0 * share + 1e-6


def test_the_shortest_rotation_is_taken():
    spin = Rotation.from_euler("z", [[170], [-170]], degrees=True).as_matrix()
    plain = [LEVEL[0], line("b", (200, 50, 0), (200, 120, 0))]
    strokes = [replace(s, rotation=R @ s.rotation) for s, R in zip(plain, spin, strict=True)]
    _, rotation, _ = whole(toured(strokes))
    assert np.degrees(turns(rotation).magnitude().sum()) == pytest.approx(20.0, abs=1e-5)


def test_what_the_coupling_may_add_to_a_retract_makes_it_slower():
    plain, spared = toured(LEVEL)[0], toured(LEVEL, ways=replace(WAYS, spare=5.0))[0]
    assert speed_of(plain.position[plain.last :]).max() > 49.0
    assert speed_of(spared.position[spared.last :]).max() * 25.0 / 20.0 <= 50.0 + 1e-6


def test_more_set_points_than_memory_should_hold_are_refused(monkeypatch):
    monkeypatch.setattr(transfers, "LONGEST_TOUR", 1000)
    with pytest.raises(InputError, match="up to c take over 1000"):
        toured(LEVEL)


FINITE = st.floats(-300.0, 300.0)
PLACE = st.tuples(FINITE, FINITE)
TURN = st.floats(-np.pi, np.pi)
ENDS = st.lists(st.tuples(PLACE, PLACE, TURN, TURN), min_size=2, max_size=4)
LEANS = st.tuples(st.floats(-40, 40), st.floats(-40, 40))


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(ends=ENDS, leans=LEANS, factor=st.sampled_from([0.3, 1.0, 3.0]))
def test_any_tour_is_continuous_keeps_every_limit_and_stays_clear_of_the_work(ends, leans, factor):
    """Strokes on one leaning plane: the distance from it is known in closed form."""
    lean = Rotation.from_euler("xy", leans, degrees=True).as_matrix()
    n = lean @ [0.0, 0.0, 1.0]
    strokes = []
    for i, (start, goal, turn, spin) in enumerate(ends):
        a, b = lean @ [*start, 0.0], lean @ [*goal, 0.0]
        seconds = 3.0 * max(2.0, np.linalg.norm(b - a) / 100, 3 * abs(turn))
        stroke = line(str(i), a, b, n, turn, seconds)
        about = Rotation.from_rotvec([0, 0, spin]).as_matrix()
        strokes.append(replace(stroke, rotation=about @ stroke.rotation))
    # As fast as can be asked for: then only the limits bind.
    ways = replace(WAYS, transfer=1e4, retract=1e4, landing=1e4)
    plans = toured(strokes, ways=ways, speed=factor)
    position, rotation, phases = whole(plans)
    limits = (
        WIDE.speed, WIDE.acceleration, WIDE.jerk,
        WIDE.rotation_speed, WIDE.rotation_acceleration, WIDE.rotation_jerk,
    )  # fmt: skip
    within = [x <= 1.0001 * most for x, most in zip(peaks(position, rotation), limits, strict=True)]
    assert all(within), within
    away = position @ n
    # Way ends are placed with a thousandth of a millimetre: shorter ways are left out.
    assert away[phases == "transfer"].min(initial=np.inf) >= 20.0 - 2e-3
    assert away.min() >= -1e-6
    np.testing.assert_allclose(away[phases == "stroke"], 0.0, atol=1e-6)


def test_an_arm_that_stands_higher_crosses_where_it_is():
    start = Pose(np.array([30.0, 80.0, 55.0]), PEN_DOWN)
    position, _, phases = whole(toured(LEVEL[:1], start, near=False))
    crossing = position[phases == "transfer"]
    assert crossing[:, 2].max() == pytest.approx(55.0)
    across = crossing[np.linalg.norm(np.diff(crossing[:, :2], axis=0, prepend=0.0), axis=1) > 0.01]
    np.testing.assert_allclose(across[1:, 2], 55.0, atol=1e-6)
    low, _, phases = whole(
        toured(LEVEL[:1], Pose(start.position * [1, 1, 0], PEN_DOWN), near=False)
    )
    assert low[phases == "transfer"][:, 2].max() == pytest.approx(20.0)


@pytest.mark.parametrize("near", [True, False])
def test_only_the_way_to_the_first_stroke_is_as_slow_as_asked(near):
    start = Pose(np.array([0.5, 0.0, 0.0]) if near else np.array([0.0, 90.0, 0.0]), PEN_DOWN)
    plans = toured(LEVEL, start, near=near, approach=6.0)
    onto = plans[0].position[: plans[0].lead + 1]
    assert speed_of(onto).max() <= 6.0
    assert near or speed_of(onto).max() > 5.9
    assert speed_of(plans[1].position[: plans[1].lead]).max() > 50.0
    # Faster than the others it is not made by it.
    usual = toured(LEVEL, start, near=near)
    quick = toured(LEVEL, start, near=near, approach=500.0)
    np.testing.assert_array_equal(usual[0].position, quick[0].position)


def test_at_half_the_speed_the_ways_are_slower_and_at_twice_they_are_not_quicker():
    tops = {}
    for speed in (0.5, 1.0, 2.0):
        plans = toured(LEVEL, speed=speed)
        tops[speed] = [speed_of(p.position[: p.lead]).max() for p in plans[1:]]
    np.testing.assert_allclose(tops[0.5], np.array(tops[1.0]) / 2.0, rtol=0.02)
    assert tops[2.0] == pytest.approx(tops[1.0])


def test_a_coupling_makes_the_retract_slower_by_what_it_may_add():
    def lasting(ways):
        made = toured(LEVEL[:1], ways=ways)[0]
        return len(made) - 1 - made.last - 2 * ways.settling

    plain, pressed = lasting(WAYS), lasting(replace(WAYS, spare=15.0))
    assert (plain, pressed) == (
        pytest.approx(1.875 * 20.0 / 50.0 / PERIOD, abs=2),
        pytest.approx(1.875 * 35.0 / 50.0 / PERIOD, abs=2),
    )


def test_a_single_stroke_may_end_where_it_ends():
    [made] = transfers.plans(
        LEVEL[:1], PERIOD, 1.0, WIDE, Pose(np.array([0.0, 90.0, 0.0]), PEN_DOWN), False, WAYS, None,
        leave=False,
    )  # fmt: skip
    assert made.last == len(made) - 1
    assert [phase for phase, _ in made.legs] == ["transfer"] * 2 + ["approach", "stroke"]
    # Where only its start counts, an end that faces elsewhere is no hindrance.
    n = np.tile([0.0, 0.0, 1.0], (len(LEVEL[0].t), 1))
    n[-1] = [0.0, 0.0, -1.0]
    bent = replace(LEVEL[0], normal=n)
    transfers.height([bent], PEN_DOWN, 20.0, (0,))
    with pytest.raises(RefusedError, match="stroke a"):
        transfers.height([bent], PEN_DOWN, 20.0)


@pytest.mark.parametrize(("lean", "along"), [(59.9, "base z"), (60.1, "the normals")])
def test_height_is_along_base_z_where_it_leads_away_from_all_faces_by_30_degrees(lean, along):
    n = Rotation.from_euler("y", lean, degrees=True).as_matrix() @ [0.0, 0.0, 1.0]
    found = transfers.height([line("a", (0, 0, 0), (0, 50, 0), n)], PEN_DOWN, 20.0)
    np.testing.assert_allclose(found.up, [0, 0, 1] if along == "base z" else n, atol=1e-12)
    assert found.level == pytest.approx(20.0)


def test_the_stroke_that_faces_furthest_away_is_named():
    faces = [line("a", (0, 0, 0), (50, 0, 0)), line("b", (0, 9, 0), (50, 9, 0))]
    faces += [line("side", (0, 0, 0), (0, 50, 0), (1, 0, -0.6))]
    with pytest.raises(RefusedError, match="stroke side: faces another side"):
        transfers.height(faces, PEN_DOWN, 20.0)


def test_a_tour_of_too_many_set_points_is_refused_by_the_stroke_that_is_too_much(monkeypatch):
    total = np.cumsum([len(p) for p in toured(LEVEL)])
    monkeypatch.setattr(transfers, "LONGEST_TOUR", int(total[1]))
    with pytest.raises(InputError, match="up to c take over"):
        toured(LEVEL)
    monkeypatch.setattr(transfers, "LONGEST_TOUR", int(total[1]) - 1)
    with pytest.raises(InputError, match="up to b take over"):
        toured(LEVEL)
    monkeypatch.setattr(transfers, "LONGEST_TOUR", int(total[2]))
    assert len(toured(LEVEL)) == 3


def test_a_stroke_without_normals_is_left_back_along_the_tool():
    held = Rotation.from_euler("x", 170.0, degrees=True).as_matrix()
    bare = replace(LEVEL[1], normal=None)
    np.testing.assert_array_equal(transfers.off(bare, held, 0), -bare.rotation[0][:, 2])
    np.testing.assert_array_equal(transfers.off(bare, held, -1), -bare.rotation[-1][:, 2])
    none = replace(bare, rotation=None)
    np.testing.assert_allclose(transfers.off(none, held, 0), -held[:, 2])
    over = transfers.Height(np.array([0.0, 0.6, 0.8]), 12.0)
    np.testing.assert_allclose(over.over(np.array([5.0, 0.0, 0.0])), [5.0, 7.2, 9.6])
    np.testing.assert_allclose(over.over(np.array([5.0, 6.0, 8.0]), 4.0), [5.0, 2.4, 3.2])
