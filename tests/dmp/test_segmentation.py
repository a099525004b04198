"""Idle ends, pauses, approach and retract."""

import numpy as np
import pytest

from dmpcli.dmp import noise, segmentation, smoothing
from dmpcli.spatial import rotations
from dmpcli.spatial.trajectory import Trajectory
from tests import human_strokes
from tests.dmp.recordings import (
    corners,
    jerk,
    letters,
    noisy,
    pen_lift,
    six_seconds,
    wave,
    with_approach,
)

DOWN = np.diag([1.0, -1.0, -1.0])


def segments(t, points, rotation=None):
    R = None if rotation is None else np.tile(rotation, (len(t), 1, 1))
    return segmentation.segment(Trajectory(t, points, R), noise.estimate(points))


@pytest.mark.parametrize("sigma", [0.0, 0.02, 0.1, 0.3])
def test_idle_ends_are_cut_off_whatever_the_noise(sigma):
    t = np.arange(2000) / 100
    points = wave(jerk((t - 7.0) / 6.0))
    for seed in range(10):
        first, last = segments(t, noisy(points, sigma, seed)).moving
        assert last - first == pytest.approx(6.0, abs=0.6 if sigma == 0.0 else 0.4)
        assert (first, last) == (pytest.approx(7.0, abs=0.4), pytest.approx(13.0, abs=0.4))


def test_human_strokes_are_trimmed_as_by_their_speed_alone():
    for shape in human_strokes.shapes()[::6]:
        for stroke in human_strokes.strokes(shape):
            found = segmentation.moving_part(stroke, noise.estimate(stroke.position))
            assert found == smoothing.moving_part(stroke.t, stroke.position), shape


@pytest.mark.parametrize("sigma", [0.0, 0.01, 0.1, 0.3])
@pytest.mark.parametrize("rest", [0.6, 1.0, 5.0])
def test_a_pause_is_found_with_its_times(sigma, rest):
    _, points = six_seconds()
    points = np.r_[points[:300], np.tile(points[300], (round(100 * rest), 1)), points[300:]]
    t = np.arange(len(points)) / 100
    (pause,) = segments(t, noisy(points, sigma)).pauses
    assert pause == (pytest.approx(3.0, abs=0.1), pytest.approx(3.0 + rest, abs=0.1))


def test_two_pauses_are_told_apart():
    _, points = six_seconds()
    rest = np.ones((100, 1))
    points = np.r_[
        points[:250], points[250] * rest, points[250:400], points[400] * rest, points[400:]
    ]
    found = segments(np.arange(len(points)) / 100, noisy(points, 0.1)).pauses
    assert [round(begin, 1) for begin, _ in found] == [2.5, 5.0]


def test_pauses_that_are_cut_out_leave_no_jump():
    _, points = six_seconds()
    still = np.r_[points[:300], np.tile(points[300], (500, 1)), points[300:]]
    R = rotations.exp(np.column_stack([0.01 * still[:, 0], 0 * still[:, 1:]]))
    stroke = Trajectory(np.arange(len(still)) / 100, still, R)
    found = segmentation.segment(stroke, noise.estimate(still))
    closed = segmentation.cut(stroke, pauses=found.pauses)
    assert closed.duration == pytest.approx(6.0, abs=0.2)
    assert len(closed.rotation) == len(closed.t)
    # No step longer than the stroke's own.
    step = np.linalg.norm(np.diff(points, axis=0), axis=1).max()
    assert np.linalg.norm(np.diff(closed.position, axis=0), axis=1).max() <= step + 1e-12
    assert np.ptp(np.diff(closed.t)) < 1e-12


def test_a_cut_keeps_the_samples_that_its_times_name():
    t, points = six_seconds()
    part = segmentation.cut(Trajectory(t, points), 1.0, 2.0)
    assert len(part.t) == 101
    np.testing.assert_array_equal(part.position, points[100:201])
    assert part.t[0] == 0.0
    assert part.t[-1] == pytest.approx(1.0)


@pytest.mark.parametrize("sigma", [0.0, 0.1, 0.3])
@pytest.mark.parametrize(("down", "up"), [(60, 60), (60, 0), (0, 60), (10, 10), (200, 100)])
def test_approach_and_retract_are_found_with_their_times(sigma, down, up):
    _, points = six_seconds()
    t, joined = with_approach(points, down, up)
    found = segments(t, noisy(joined, sigma))
    first = 2.0 if down else 0.0
    if down:
        assert found.approach == (0.0, pytest.approx(first, abs=0.4))
    else:
        assert found.approach is None
    if up:
        assert found.retract == (pytest.approx(first + 6.0, abs=0.4), pytest.approx(t[-1]))
    else:
        assert found.retract is None


def test_an_approach_may_end_in_a_corner_at_full_speed():
    t = np.arange(601) / 100
    main = wave(t / 6.0)
    q = np.arange(0.0, 1.0, 0.01)[:, None]
    joined = np.r_[main[0] + (1 - q) * [0, 0, 60.0], main, main[-1] + q[1:] * [0, 0, 60.0]]
    found = segments(np.arange(len(joined)) / 100, noisy(joined, 0.05))
    assert found.approach[1] == pytest.approx(1.0, abs=0.1)
    assert found.retract[0] == pytest.approx(7.0, abs=0.1)


def test_the_tool_tells_the_approach_of_a_straight_stroke():
    s = jerk(np.arange(601) / 600)
    t, joined = with_approach(np.column_stack([300 * s, 0 * s, 0 * s]), 60, 60)
    assert segments(t, joined, DOWN).approach is not None
    assert segments(t, joined).approach is None


def strokes_without():
    t, flat = six_seconds()
    u = t / 6.0
    s = jerk(u)
    yield "wave", t, flat
    yield "wall", t, flat[:, [0, 2, 1]]
    yield (
        "hop",
        t,
        flat + 20 * (jerk((u - 0.4) / 0.1) - jerk((u - 0.55) / 0.1))[:, None] * [0, 0, 1],
    )
    land = 3 * (1 - jerk(u / 0.1)) + 3 * jerk((u - 0.9) / 0.1)
    yield "soft landing", t, flat + land[:, None] * [0, 0, 1]
    small = wave(s, 109, 50) - [54.5, 0, 0]
    yield "bow", t, small + [0, 0, 600] - np.sqrt(600**2 - small[:, :1] ** 2) * [0, 0, 1]
    dome = np.sqrt(80**2 - small[:, 0] ** 2 - small[:, 1] ** 2)
    yield "dome", t, small + dome[:, None] * [0, 0, 1]
    arch = np.pi * (1 - s)
    yield "half a pipe", t, np.column_stack([60 * np.cos(arch), small[:, 1], 60 * np.sin(arch)])
    yield "helix", t, np.column_stack([30 * np.cos(8 * s), 30 * np.sin(8 * s), 60 * s])
    yield (
        "seam",
        t,
        np.column_stack([300 * s, 0.2 * np.sin(6 * np.pi * s), 1.2 * np.sin(np.pi * s)]),
    )
    yield "line", t, np.column_stack([300 * s, 0 * s, 0 * s])
    for name, V in (
        ("Z", [[0, 0], [60, 0], [0, 60], [60, 60]]),
        ("U", [[0, 60], [0, 0], [60, 0], [60, 60]]),
    ):
        V = np.column_stack([np.array(V, float), np.zeros(4)])
        way = np.r_[0, np.cumsum(np.linalg.norm(np.diff(V, axis=0), axis=1))]
        yield name, t, np.column_stack([np.interp(way[-1] * s, way, c) for c in V.T])
    yield "lift", *pen_lift()
    yield "letters", *letters()
    yield "corners", *corners()


@pytest.mark.slow
@pytest.mark.parametrize("case", list(strokes_without()), ids=lambda case: case[0])
def test_no_approach_and_no_pause_where_there_is_none(case):
    _, t, points = case
    for sigma in (0.0, 0.05, 0.3):
        for rotation in (None, DOWN):
            if rotation is not None and case[0] == "wall":
                continue
            found = segments(t, noisy(points, sigma, 1), rotation)
            assert (found.approach, found.retract, found.pauses) == (None, None, ())


def test_human_strokes_have_no_approach_and_no_pause():
    for shape in human_strokes.shapes()[1::3]:
        stroke = human_strokes.strokes(shape)[0]
        found = segments(stroke.t, stroke.position)
        assert (found.approach, found.retract, found.pauses) == (None, None, ()), shape


def test_what_bends_by_a_tenth_of_its_chord_is_straight_and_more_is_not():
    arch = np.array([[0.0, 0, 0], [5, 1, 0], [5, 1, 0], [10, 0, 0]])
    assert segmentation._straight(arch) == 3
    assert segmentation._straight(arch * [1.0, 1.001, 1.0]) == 2
    assert segmentation._bend(arch) == 0.1
    assert segmentation._bend(np.r_[arch, arch[:1]]) == np.inf


def test_runs_of_flags_are_told_by_their_begins_and_ends():
    flags = np.array([1, 1, 0, 1, 0, 1, 1, 1], dtype=bool)
    assert segmentation._runs(flags) == ([0, 3, 5], [2, 4, 8])
    assert [segmentation._first_run(flags, n) for n in (1, 2, 3, 4)] == [0, 0, 5, None]
    assert segmentation._runs(np.zeros(3, dtype=bool)) == ([], [])


def test_a_time_midway_between_samples_names_those_on_either_side():
    t = np.arange(11.0)
    stroke = Trajectory(t, np.outer(t, np.ones(3)), contact_force=np.outer(t, [0, 0, 1.0]))
    assert segmentation.cut(stroke, until=4.5).position[-1, 0] == 5.0
    assert segmentation.cut(stroke, until=4.4).position[-1, 0] == 4.0
    assert segmentation.cut(stroke, start=4.5).position[0, 0] == 4.0
    assert segmentation.cut(stroke, start=4.6).position[0, 0] == 5.0
    for pause, left in (((2.5, 6.5), [0, 1, 2, 3, 8, 9, 10]), ((2.4, 6.4), [0, 1, 2, 7, 8, 9, 10])):
        part = segmentation.cut(stroke, pauses=(pause,))
        assert part.position[:, 0].tolist() == left
        assert part.contact_force[:, 2].tolist() == left
        assert part.t.tolist() == list(range(7))
    assert segmentation.cut(stroke, 0.0, 10.0) is stroke


def test_small_turns_in_the_time_of_a_rest_are_none():
    """What comes back to its place after 0.3 s, again and again, has no net way."""
    t = 0.01 * np.arange(600)
    a = 2.0 * np.pi * t / 0.3
    turns = np.column_stack([0.05 * t + 2.0 * np.sin(a), 2.0 * np.cos(a), 0.0 * t])
    way = jerk(np.arange(150) / 150)[:, None] * [90.0, 0.0, 0.0]
    points = np.r_[turns[0] - way[:0:-1], turns, turns[-1] + way[1:]]
    assert segments(0.01 * np.arange(len(points)), points).pauses == ()


@pytest.mark.parametrize("length", [18.0, 22.0, 40.0])
def test_short_approaches_to_a_long_stroke_end_at_its_corner(length):
    """They end within the first few of the points along the path that are looked at."""
    legs = np.column_stack([10.0 * np.arange(31), 90.0 * (np.arange(31) % 2), np.zeros(31)])
    way = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(legs, axis=0), axis=1))]
    s = np.linspace(0.0, way[-1], 1200)
    main = np.column_stack([np.interp(s, way, c) for c in legs.T])
    q = np.linspace(1.0, 0.0, 21)[:-1, None]
    down, up = main[0] + q * [0, 0, length], main[-1] + q[::-1] * [0, 0, length]
    points = np.r_[down, main, up]
    found = segments(0.01 * np.arange(len(points)), points)
    assert found.approach == (0.0, pytest.approx(0.2, abs=0.03))
    assert found.retract == (pytest.approx(12.19, abs=0.03), pytest.approx(12.39))


@pytest.mark.parametrize(("bottom", "told"), [(25.0, False), (30.0, False), (33.0, True)])
def test_between_two_strays_a_twentieth_of_the_points_must_be_left(bottom, told):
    """Each of them reaches around its corner as far as a straight line may bend."""
    V = np.array([[0, 0, 100], [0, 0, 0], [bottom, 0, 0], [bottom, 0, 90]], dtype=float)
    way = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(V, axis=0), axis=1))]
    s = way[-1] * jerk(np.arange(301) / 300)
    found = segments(
        np.arange(301) / 100, np.column_stack([np.interp(s, way, c) for c in V.T]), DOWN
    )
    assert (found.approach is not None) == told
    assert (found.retract is not None) == told


def test_a_turn_to_and_fro_without_noise_is_no_pause():
    """It leaves its place at once, within fewer samples than a rest would take."""
    x = np.r_[np.linspace(0.0, 100.0, 201), np.linspace(100.0, 0.0, 201)[1:]]
    points = np.column_stack([x, np.zeros((len(x), 2))])
    motion = segmentation._Motion(points, np.full(len(x), 50.0), 0.01, 1, 0.0)
    first, last = segmentation._stay(motion, 198, 203, 0.6)
    # 0.5 mm a sample: one on either side of the turn is within 0.6 mm of its place.
    assert 198 <= first <= 200 <= last <= 202


@pytest.mark.parametrize(("bottom", "told"), [(12.0, False), (15.5, False), (24.0, True)])
def test_behind_an_approach_a_twentieth_of_the_points_must_be_left(bottom, told):
    V = np.array([[0, 0, 100], [0, 0, 0], [bottom, 0, 0]], dtype=float)
    way = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(V, axis=0), axis=1))]
    s = way[-1] * jerk(np.arange(301) / 300)
    found = segments(
        np.arange(301) / 100, np.column_stack([np.interp(s, way, c) for c in V.T]), DOWN
    )
    assert (found.approach is not None) == told


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("along", [16.0, 25.0, 60.0])
def test_the_rest_at_the_recordings_own_end_is_not_where_a_short_stroke_is_met(along, turned):
    """100 mm down and some along, at one pace without a rest: met at the corner."""
    t = np.arange(301) / 100.0
    way = (100.0 + along) * jerk(t / 3.0)
    points = np.column_stack(
        [np.clip(way - 100.0, 0.0, None), 0.0 * t, np.clip(100.0 - way, 0, None)]
    )
    corner = float(np.interp(100.0, way, t))
    found = segments(t, points[::-1] if turned else points, DOWN)
    assert (found.approach is None) is turned
    assert (found.retract is None) is not turned
    told = 3.0 - found.retract[0] if turned else found.approach[1]
    assert told == pytest.approx(corner, abs=0.1)
