"""Recordings and numbers of many kinds, and limits met from both sides: cases of `test_kept`.

Each is quick, so that many may stand side by side; what is right in closed form is tested beside
the modules themselves.
"""

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from dmpcli.dmp import (
    agreement,
    arc_length,
    common_timing,
    contact_heights,
    copies,
    demonstrations,
    feasibility,
    forced_model,
    knot_refinement,
    learning,
    least_squares,
    noise,
    path_registration,
    pauses,
    pieces,
    regression,
    rollout,
    segmentation,
    sides,
    spline_ends,
    spline_smoothing,
    stroke_plane,
    taught_strokes,
    time_base,
    time_scaling,
    tool_speed,
    transformation_system,
)
from dmpcli.dmp.alignment import align
from dmpcli.dmp.basis_search import Quality
from dmpcli.dmp.canonical_system import even_in_time
from dmpcli.dmp.curve import Curve
from dmpcli.dmp.demonstrations import ComparedPath
from dmpcli.dmp.drawn_strokes import GeneralizeOptions
from dmpcli.dmp.generalization import charts_of, draw
from dmpcli.dmp.options import FitOptions
from dmpcli.dmp.path_registration import Correspondence
from dmpcli.dmp.preprocessing import preprocess
from dmpcli.dmp.rollout import Pairs
from dmpcli.dmp.skill import TaskFrame
from dmpcli.dmp.tool_speed import Pace
from dmpcli.errors import DmpError
from dmpcli.spatial import rotations
from dmpcli.spatial.trajectory import Trajectory
from dmpcli.surfaces.cylinder import Cylinder
from dmpcli.surfaces.plane import Plane
from dmpcli.surfaces.sphere import Sphere
from tests import cases, human_strokes
from tests.dmp.recordings import jerk, noisy

CASES: list[Callable] = []
DOWN = np.diag([1.0, -1.0, -1.0])
PLATE = Plane(np.zeros(3), np.array([0.0, 0.0, 1.0]))
DRUM = Cylinder(np.array([0.0, 0.0, -60.0]), np.array([0.0, 1.0, 0.0]), 60.0)
BALL = Sphere(np.array([0.0, 0.0, -150.0]), 150.0)


def case(make):
    CASES.append(make)
    return make


# Recordings.


def along(corners, seconds, step=0.01, soft=True):
    """A polyline passed from rest to rest, or at one speed; shape (T, 3)."""
    corners = np.asarray(corners, dtype=float)
    way = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))]
    share = np.linspace(0.0, 1.0, round(seconds / step) + 1)
    share = jerk(share) if soft else share
    return np.column_stack([np.interp(way[-1] * share, way, c) for c in corners.T])


def shape(rng):
    """A loop, a zigzag, a wave or a curve of chance, flat but for a little; shape (T, 3)."""
    seconds, kind = rng.uniform(2.0, 6.0), rng.integers(5)
    s = jerk(np.linspace(0.0, 1.0, round(100 * seconds) + 1))
    if kind == 0:
        return along(np.cumsum(rng.normal(size=(6, 3)) * [40, 40, 0.5], axis=0), seconds)
    if kind == 1:
        a = 2.0 * np.pi * rng.uniform(1.0, 5.0) * s
        return np.column_stack([150 * s + 20 * np.sin(a), 25 * np.cos(a), rng.uniform(0, 3) * s])
    if kind == 2:
        way = rng.normal(size=(3, 3)) * [60, 40, 1]
        return sum(np.outer(np.sin(np.pi * (k + 0.5) * s), way[k]) for k in range(3))
    if kind == 3:
        return along(
            np.cumsum(rng.normal(size=(5, 3)) * [50, 50, 0.2], axis=0), seconds, soft=False
        )
    return cases.wave(s, rng.uniform(30, 300), rng.uniform(0.1, 60), rng.uniform(0.5, 4.0))


def strayed(x, rng):
    """With an approach and a retract of chance, straight or bent, slow or at full speed."""
    for end in (0, -1):
        length, lean = rng.choice([0.0, 4.0, 6.0, 15.0, 40.0, 90.0]), rng.uniform(0.0, 1.2)
        if length == 0.0:
            continue
        way = length * np.array([np.sin(lean), 0.3 * lean * rng.normal(), np.cos(lean)])
        s = np.linspace(0.0, 1.0, rng.integers(20, 150))
        s = jerk(s) if rng.random() < 0.6 else s
        motion = x[end] + (1.0 - s)[:, None] * way
        motion[:, 0] += rng.choice([0.0, 0.1, 0.3]) * length * s * (1.0 - s)
        x = np.r_[motion[:-1], x] if end == 0 else np.r_[x, motion[-2::-1]]
    return x


def rested(x, rng):
    """With rests of chance in it, and idle ends."""
    for _ in range(rng.integers(0, 3)):
        at = rng.integers(5, len(x) - 5)
        creep = np.linspace(0.0, rng.choice([0.0, 0.3, 2.0]), rng.integers(10, 150))[:, None]
        x = np.r_[x[:at], x[at] + creep * [0.8, 0.6, 0.0], x[at:] + creep[-1] * [0.8, 0.6, 0.0]]
    before, after = rng.choice([0, 3, 40, 200], 2)
    return np.r_[np.tile(x[:1], (before, 1)), x, np.tile(x[-1:], (after, 1))]


def recordings(seed, count=16):
    """Even recordings of chance: shapes with approaches, rests, noise, tools and turns."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        x = rested(strayed(shape(rng), rng), rng)
        x = noisy(x, rng.choice([0.0, 0.01, 0.05, 0.3]), int(rng.integers(1000)))
        step = rng.choice([0.004, 0.01, 0.025])
        tool = rotations.exp(rng.uniform(0.0, 0.9) * np.array([0.6, 0.8, 0.0])) @ DOWN
        turn = rotations.exp(rng.normal(size=3))
        R = np.tile(turn @ tool, (len(x), 1, 1)) if rng.random() < 0.6 else None
        yield Trajectory(step * np.arange(len(x)), x @ turn.T, R)


def parts(strokes):
    return [segmentation.segment(one, noise.estimate(one.position)) for one in strokes]


def even(x, rotation=None, step=0.01):
    R = None if rotation is None else np.tile(rotation, (len(x), 1, 1))
    return Trajectory(step * np.arange(len(x)), np.asarray(x, dtype=float), R)


for number in range(5):

    def parts_of_chance(seed=number):
        return parts(recordings(100 + seed))

    parts_of_chance.__name__ = f"parts_of_recordings_of_chance_{number}"
    case(parts_of_chance)


@case
def parts_of_chance_turned_back():
    return parts(replace(s, position=s.position[::-1].copy()) for s in recordings(110))


@case
def parts_of_human_strokes_with_approaches():
    rng = np.random.default_rng(5)
    found: list = []
    for name in human_strokes.shapes()[::5]:
        x = human_strokes.strokes(name)[1].position
        for _ in range(2):
            found += parts([even(strayed(x, rng), DOWN, 0.008)])
    return found


@case
def approaches_of_all_lengths_to_a_long_stroke():
    """Some end within the first few of the points that are looked at."""
    corners = np.column_stack([10.0 * np.arange(31), 90.0 * (np.arange(31) % 2), np.zeros(31)])
    main = along(corners, 12.0, soft=False)
    found: list = []
    for length in (5.5, 7.0, 12.0, 18.0, 19.5, 25.0, 30.0, 45.0):
        s = np.linspace(0.0, 1.0, 40)[:-1, None]
        lift = s * [0.0, 0.0, length]
        whole = np.r_[main[0] + lift[::-1] + [0, 0, length / 39], main, main[-1] + lift[1:]]
        found += parts([even(whole), even(whole[:-38]), even(whole[39:])])
    return found


@case
def brackets_with_short_bottoms():
    """Down, along and up: of a bottom too short nothing is told, whatever the tool says."""
    found: list = []
    for bottom in (3, 6, 8, 9, 9.4, 9.8, 10.2, 10.6, 11, 12, 14, 20, 40):
        corners = [[0, 0, 100], [0, 0, 0], [bottom, 0, 0], [bottom, 0, 90]]
        for tool in (DOWN, None):
            found += parts([even(along(corners, 3.0), tool), even(along(corners[:3], 3.0), tool)])
    return found


@case
def brackets_without_one_of_their_legs():
    """About where what is left of the points is just enough."""
    found: list = []
    for bottom in np.arange(13.0, 19.0, 0.25):
        x = along([[0, 0, 100], [0, 0, 0], [bottom, 0, 0]], 3.0, soft=False)
        found += parts([even(x, DOWN), even(x[::-1], DOWN)])
    return found


@case
def corners_of_all_angles_between_approach_and_stroke():
    found: list = []
    main = cases.wave(np.linspace(0.0, 1.0, 400), 300.0, 40.0)
    for degrees in (20, 35, 42, 44, 45, 47, 60, 90, 120):
        a = np.radians(degrees)
        for length in (20.0, 60.0):
            s = np.linspace(1.0, 0.0, 80)[:-1, None]
            x = np.r_[main[0] + s * length * np.array([-np.cos(a), 0, np.sin(a)]), main]
            found += parts([even(x), even(x[::-1])])
    return found


@case
def approaches_that_rise_by_little():
    """Each of the limits on the rise is the one that counts for some of them."""
    found: list = []
    s = jerk(np.linspace(0.0, 1.0, 300))
    q = np.linspace(1.0, 0.0, 60)[:-1, None]
    for size, thick in ((20.0, 0.0), (150.0, 0.0), (400.0, 0.0), (60.0, 4.0), (60.0, 8.0)):
        a = 2.0 * np.pi * s
        main = np.column_stack([size * np.cos(a), size * np.sin(a), thick * np.sin(3 * a)])
        for rise in (4.0, 5.5, 8.0, 12.0, 18.0, 26.0, 34.0):
            found += parts([even(np.r_[main[0] + q * [0, 0, rise], main])])
    return found


@case
def what_is_straight_and_what_strays():
    rng = np.random.default_rng(7)
    found: list = []
    for _ in range(40):
        bend = rng.uniform(0.0, 0.5)
        s = np.linspace(0.0, 1.0, rng.integers(3, 60))
        x = np.column_stack([50 * s, 50 * bend * s**2, 0 * s])
        x[rng.integers(len(x)) :] += rng.normal(size=3) * rng.choice([0.0, 4.0])
        found += [[segmentation._straight(x), segmentation._bend(x)]]
        main = rng.normal(size=(120, 3)) * [40, rng.choice([0.2, 1.0, 30]), 0.3]
        tool = rotations.exp(rng.normal(size=3))[:, 2]
        normal = segmentation._normal(main, tool)
        found += [None if normal is None else np.abs(normal)]
        found += [segmentation._normal(main, None) is None]
        head = np.linspace(0, 1, 9)[::-1, None] * [rng.uniform(0, 8), 0.0, rng.uniform(-14, 14)]
        up = np.array([0.0, 0.0, 1.0])
        found += [segmentation._is_stray(head, main, up, s) for s in (0.0, 0.3, 1.0)]
    return found


@case
def tremors_are_no_pauses():
    """Small turns whose period is the one that rests are looked for with."""
    found: list = []
    t = 0.01 * np.arange(500)
    for period in (0.1, 0.15, 0.3, 0.6):
        a = 2.0 * np.pi * t / period
        for size, way in ((2.0, 0.05), (2.0, 5.0), (0.2, 20.0)):
            x = np.column_stack([way * t + size * np.sin(a), size * np.cos(a), 0 * t])
            found += parts([even(np.r_[along([[-90, 0, 0], x[0]], 1.5), x[1:]])])
    return found


@case
def stays_and_their_ends():
    rng = np.random.default_rng(8)
    found: list = []
    for one in recordings(120, 6):
        n = noise.estimate(one.position)
        motion = segmentation._motion(one, n)
        core = segmentation._core(motion)
        found += [motion, core, segmentation._departure(motion), segmentation._pauses(motion, core)]
        for _ in range(6):
            begin = int(rng.integers(len(one.t) - 3))
            end = int(rng.integers(begin + 1, len(one.t)))
            hidden = rng.choice([0.1, 1.0, 10.0])
            found += [segmentation._stay(motion, begin, end, hidden)]
            found += [segmentation._sharp(one, motion, n, (begin, end))]
    return found


@case
def recordings_cut_anywhere():
    found: list = []
    for one in recordings(130, 5):
        end = one.duration
        for start, until, rests in (
            (None, 0.5 * end, ()),
            (0.3 * end, None, ((0.4 * end, 0.5 * end), (0.7 * end, 0.71 * end))),
            (0.25 * end, 0.75 * end, ((0.2 * end, 0.3 * end), (0.74 * end, end))),
            (None, None, ((0.0, 0.1 * end), (0.9 * end, end))),
        ):
            found.append(segmentation.cut(one, start, until, rests))
        part = segmentation.moving_part(one, noise.estimate(one.position))
        found.append((part.start, part.stop))
    return found


@case
def recordings_of_chance_made_smooth():
    found: list = []
    for one in recordings(140, 5):
        for more in ({}, {"cut_pauses": True}, {"start": 0.4, "until": 0.8 * one.duration}):
            p = preprocess(one, **more)
            t = np.linspace(0.0, p.duration, 30)
            found += [p.position(t), p.position(t, 1), p.trimmed, p.pauses, p.approach, p.retract]
            found += [p.intervals, p.smoothed_noise, p.smoothed_angular_noise, p.position.rests]
            found += [] if p.rotation is None else [p.rotation(t)]
    return found


# Noise.


@case
def plateaus_of_spectra():
    rng = np.random.default_rng(11)
    found: list = []
    for _ in range(250):
        count = int(rng.integers(6, 30))
        first, end = np.sort(rng.integers(0, count, 2))
        level = 6.0 - rng.choice([0.2, 0.5]) * np.arange(count)
        level[first:end] = level[first] + rng.choice([0.0, 0.1, 0.14]) * np.arange(end - first)
        level[end:] -= rng.choice([0.2, 0.4, 1.4, 1.6, 3.0])
        level[end + int(rng.integers(1, 8)) :] += rng.choice([0.0, 0.8, 2.0])
        level += rng.choice([0.0, 0.05, 0.3]) * rng.normal(size=count)
        level[int(rng.integers(count))] -= rng.choice([0.0, 3.0])
        at = noise._level_stretch(level.tolist())
        found.append(-1 if at is None else 100 * at[0] + at[1])
    return found


@case
def lattices_and_what_is_none():
    rng = np.random.default_rng(12)
    found: list = []
    for _ in range(60):
        steps = rng.choice([1.0, 2.0, 1.6, 1.4, 1.005, 3.02], (200, 3), p=[0.6, 0.3] + [0.025] * 4)
        x = 0.1 * np.cumsum(steps * rng.choice([-1, 0, 1], (200, 3)), axis=0)
        x = x[:, : rng.integers(1, 4)] * rng.choice([1.0, 1e-3])
        found.append(noise._lattice_step(x, rng.choice([0.05, 10.0, 900.0])))
        found.append(noise._lattice_step(np.round(x, 1)[:: rng.integers(1, 30)], 1.0))
    return found


@case
def noise_of_few_samples_and_of_many():
    rng = np.random.default_rng(13)
    found: list = []
    for count in (38, 39, 40, 41, 160, 161, 16384, 16385):
        s = np.linspace(0.0, 1.0, count)
        x = cases.wave(s) + 0.1 * rng.normal(size=(count, 3)) * [1.0, 0.3, 0.0]
        found += [noise.estimate(x), noise.estimate(np.round(x, 1))]
    for count in (8, 20, 60, 400):
        c = rng.normal(size=(count, 3)) * [1.0, 0.7, 0.2]
        axes, sigma = noise._spread(c)
        found += [np.abs(axes), sigma, noise._along(c), noise._along(c[:3])]
    return found


# Rests.


@case
def rests_of_few_samples_and_of_many():
    rng = np.random.default_rng(14)
    found: list = []
    for count in (5, 6, 7, 8, 12, 40, 160):
        for step in (0.01, 0.06, 0.2):
            for _ in range(3):
                speed = rng.choice([0.0, 0.0, 0.02, 1.0], count)
                x = np.cumsum(speed[:, None] * rng.normal(size=(count, 2)), axis=0)
                x[0] -= 9.0
                found += pauses.rests(step * np.arange(count), x, rng.choice([0.0, 0.02]))
    return found


@case
def rests_left_out_and_turned_in():
    rng = np.random.default_rng(15)
    found: list = []
    for _ in range(12):
        x = np.cumsum(rng.normal(size=(150, 2)), axis=0)
        at = np.sort(rng.choice(np.arange(1, 149), 6, replace=False))
        cuts = [(int(a), int(b)) for a, b in at.reshape(-1, 2)][: rng.integers(1, 4)]
        found += [pauses.without(x, cuts)]
        angles = np.cumsum(rng.normal(size=(150, 3)), axis=0) * 3e-3
        found += [pauses.turning(angles, cut) for cut in cuts]
    for _ in range(6):
        strokes = []
        for _ in range(3):
            x = cases.wave(jerk(np.linspace(0.0, 1.0, 200)))
            k, long = int(rng.choice([60, 64, 100])), int(rng.choice([0, 30, 60]))
            x = np.insert(x, [k] * long, x[k], axis=0)
            angles = np.zeros((len(x), 1))
            angles[k + long // 2 :] = rng.choice([0.0, 0.1])
            strokes.append(ComparedPath(0.02 * (len(x) - 1), x, 0.01, angles))
        told = demonstrations.rests_of(strokes)
        found += [told.stays, told.cuts, told.held, told.told]
        together = align(strokes, "path", 60)
        found += [together.duration, together.mean, together.times, together.rests]
    return found


# Laws of time, and places that correspond.


def law(speeds, seconds=4.0):
    t = np.linspace(0.0, seconds, len(speeds))
    s = np.r_[0.0, np.cumsum(0.5 * (speeds[1:] + speeds[:-1]) * np.diff(t))]
    return arc_length.monotone(t, s, np.asarray(speeds, dtype=float))


def some_laws():
    u = np.linspace(0.0, 1.0, 81)
    return [
        law(20.0 + 10.0 * np.sin(7.0 * u)),
        law(30.0 * np.abs(u - 0.4)),
        law(np.where(np.abs(u - 0.6) < 0.05, 0.0, 25.0 * np.sin(np.pi * u) + 0.1), 6.0),
        law(40.0 * jerk(4.0 * u) * jerk(4.0 * (1.0 - u)), 2.0),
        law(np.linspace(1.0, 50.0, 700)),
    ]


@case
def laws_that_run_on():
    laws = some_laws()
    at = np.linspace(0.0, 1.0, 33)
    found: list = []
    for one in laws:
        for places in ((0.0,), (0.03,), (0.4,), (0.6,), (0.2, 0.25), (1.0, 0.5)):
            on = common_timing.running_on(one, places)
            found += [on, on.place(on.duration * at), on.time(on.length * at)]
    return found


@case
def laws_in_the_mean():
    laws = some_laws()
    bent = Correspondence().pinned({0.3: 0.42, 0.6: 0.7})
    flat = Correspondence().pinned({0.5: 0.2})
    found: list = []
    for some, how in (
        (laws[:2], [Correspondence(), bent]),
        (laws[1:4], [bent, flat, Correspondence()]),
        (laws, [Correspondence(), bent, flat, bent, flat]),
    ):
        for samples in (20, 900):
            found += [common_timing.mean_law(some, how, samples)]
    return found


@case
def places_pinned_and_smoothed():
    rng = np.random.default_rng(16)
    straight = path_registration._averages()
    at = np.linspace(0.0, 1.0, 25)
    found: list = []
    for _ in range(6):
        c = path_registration._monotone(straight + 0.05 * rng.normal(size=len(straight)))
        pins = dict(zip(rng.uniform(-0.1, 1.1, 4), rng.uniform(0.0, 1.0, 4), strict=True))
        for one in (
            Correspondence(c),
            Correspondence(c).pinned(pins),
            Correspondence().pinned(pins),
        ):
            found += [one, one(at), one.slope(at), one.inverse(at), one.deviation(), one.straight]
        own = np.sort(rng.integers(0, path_registration.PLACES, 700))
        common = np.sort(np.r_[np.arange(path_registration.PLACES), rng.integers(0, 401, 299)])
        found += [path_registration._deviation(own, common)]
        path = rng.normal(size=(path_registration.PLACES, 2))
        found += [path_registration._at(path, c), path_registration._features(path[None], 3.0)]
    return found


@case
def doubts_about_some_of_many():
    rng = np.random.default_rng(17)
    u = np.linspace(0.0, 1.0, 101)
    found: list = []
    plain = np.column_stack([200 * u, 30 * np.sin(7 * u), 12 * u * (1 - u) * (2 - u)])
    ring = np.column_stack([40 * np.cos(2 * np.pi * u), 25 * np.sin(2 * np.pi * u), 3 * np.sin(u)])
    for base in (plain, ring):
        for count in (2, 3, 4, 5, 6, 7):
            paths = base + 0.4 * rng.normal(size=(count, 1, 3))
            for _ in range(2):
                for i in rng.choice(count, int(rng.integers(0, count)), replace=False):
                    paths[i] = (
                        paths[i, ::-1],
                        paths[i] * [1.0, 1.7, 1.0],
                        np.roll(paths[i], 17, axis=0),
                        paths[i] + [0, 25 * u[i], 0],
                        agreement._reversed(paths[i])[-1],
                    )[rng.integers(5)]
                gone = rng.choice(count, int(rng.integers(0, count)), replace=False)
                found += [agreement.reversals(paths), agreement.distances(paths)]
                found += [agreement.strangers(paths, np.full(count, 0.1), gone)]
                found += [agreement._apart(paths), agreement.spread(paths), agreement.extent(paths)]
    for gap in (0.1, 0.24, 0.26, 0.5):
        arc = ring[: int(100 * (1.0 - gap))]
        found += [agreement._closed(arc), len(agreement._reversed(arc))]
        found += [agreement._rotated(np.roll(ring[:-1], 9, axis=0), ring[:-1])]
    return found


# Splines.


@case
def curves_limited_in_their_band():
    rng = np.random.default_rng(18)
    found: list = []
    for count in (30, 61):
        curve = Curve.through(np.cumsum(rng.normal(size=(count, 2)), axis=0), 3.0, count - 1)
        for intervals in (4, 12, count - 2, count - 1, count):
            found += [curve.limited(intervals, 40)]
        found += [curve.even(17), curve(np.array([0.0, 1.1]), 1)]
    return found


@case
def residuals_that_noise_explains_or_not():
    rng = np.random.default_rng(19)
    found: list = []
    for count, intervals in ((90, 4), (700, 2), (1000, 3), (1100, 12)):
        design = least_squares.uniform(count, intervals)
        white = noise.Noise(np.eye(2), np.full(2, 0.1))
        steps = noise.Noise(np.eye(2), np.full(2, 0.1), "quantised", step=0.3)
        t = np.linspace(0.0, 1.0, count)
        for size, period in ((0.0, 1.0), (0.03, 1.4), (0.06, 3.0), (0.2, 9.0), (0.5, 40.0)):
            x = 0.1 * rng.normal(size=(count, 2))
            x[:, 0] += size * np.sin(2.0 * np.pi * period * t)
            x[count // 3] += size
            for kind in (white, steps):
                for first in (True, False):
                    found += [knot_refinement._doubted(x, design, kind, x, first)]
    return found


@case
def intervals_that_suit():
    rng = np.random.default_rng(20)
    found: list = []
    for count in (45, 90, 400, 1500):
        s = np.linspace(0.0, 1.0, count)
        for periods in (0.5, 3.0, 12.0):
            x = 20.0 * np.sin(2.0 * np.pi * periods * s)[:, None] * [1.0, 0.5]
            for sigma in (0.02, 0.5):
                y = x + sigma * rng.normal(size=x.shape)
                found.append([spline_smoothing._intervals(y, 2.0 * sigma**2)])
                found.append(spline_smoothing._best(y, 2.0 * sigma**2, 8))
        found += [spline_smoothing._averaged(x, n) for n in (20, 100, 200)]
    found += [spline_smoothing._ladder(k) for k in range(16)]
    return [*found, [spline_smoothing._rung(k) for k in (2, 5, 7, 8, 9, 16, 40)]]


@case
def splines_halved_at_corners():
    found: list = []
    for seed, count in ((1, 200), (2, 450)):
        x = along([[0, 0, 0], [40, 0, 0], [50, 45, 0], [90, 40, 6]], 0.01 * count, soft=False)
        x = noisy(x, 0.05, seed)[:, :2]
        n = noise.Noise(np.eye(2), np.full(2, 0.05))
        for intervals in (4, 9, 30):
            design = least_squares.uniform(len(x), intervals)
            halved = knot_refinement.halved(design, design.coefficients(x), x, n)
            found += [None] if halved is None else [halved[0].breaks, halved[1]]
    return found


@case
def ends_at_rest_and_others():
    found: list = []
    t = np.linspace(0.0, 1.0, 120)
    for bend in (0.0, 0.002, 0.02, 0.3):
        x = np.column_stack([jerk(t) + bend * t, t**2 * (3 - 2 * t) + bend * t**2])
        for intervals in (3, 6, 7, 14):
            design = least_squares.uniform(len(t), intervals)
            c = design.coefficients(x)
            for variance in (1e-12, 1e-8, 1e-5, 1e-3):
                found += [spline_ends.end(design, c, variance, back) for back in (False, True)]
                found += [spline_ends.with_ends(design, c, variance)]
    design = least_squares.uniform(120, 9)
    return [*found, spline_ends.end(design, np.zeros((14, 2)), 0.0, False)]


# Planes.


@case
def planes_of_offsets_of_chance():
    rng = np.random.default_rng(21)
    found: list = []
    for k in range(10):
        closed = k % 2 == 1
        a = np.linspace(0.0, (2.0 if closed else 1.2) * np.pi, 90)
        x = np.column_stack([50 * np.cos(a), 30 * np.sin(a), rng.choice([0.0, 0.2, 4.0]) * a])
        x[40:60, 2] += rng.choice([0.0, 0.5, 8.0])
        x = x @ rotations.exp(rng.normal(size=3)).T + 100.0 * rng.normal(size=3)
        one = stroke_plane._Offsets.of(x, closed)
        n = rotations.exp(rng.normal(size=3))[:, 2]
        found += [one, one.spread, one.across(n), one.heights(n)]
        found += [np.abs(stroke_plane._least_absolute(one.q, one.e_u))]
        tools = [n, None][k % 3 == 2 :]
        found += [stroke_plane.stroke_planes([x] * len(tools), tools, 0.05, closed)]
        found += [stroke_plane.stroke_planes([x], [n], 0.05, closed, 3.0 * n)]
    for _ in range(12):
        normals = rng.normal(size=(3, 3)) * [1.0, 1.0, rng.choice([0.2, 3.0])]
        found += [stroke_plane._alike(normals / np.linalg.norm(normals, axis=1)[:, None])]
        h = rng.normal(size=30) + rng.choice([-3.0, -0.5, 0.0, 0.5, 3.0])
        found += [stroke_plane._side_of_lift(h, near) for near in (0.3, 2.0)]
    return found


@case
def planes_of_several_at_angles():
    found: list = []
    wave = cases.wave(np.linspace(0.0, 1.0, 200), 200.0, 40.0)
    for degrees in (4.0, 14.0, 16.0, 29.0, 31.0, 50.0):
        turned = wave @ cases.about("x", degrees).T
        for others in ([wave, turned], [wave, turned, wave[::-1]], [turned, wave * [1, 0.05, 1]]):
            for tool in (None, cases.about("x", 40.0)[:, 2]):
                found += [stroke_plane.stroke_planes(others, [tool] * len(others), 0.0, False)]
    for share in (0.01, 0.015, 0.03):
        line = wave * [1.0, 5.0 * share, 1.0]
        for tools in ([None], [np.array([0.0, 0.8, 0.6])]):
            found += [stroke_plane.stroke_planes([line], tools, 0.0, False)]
    back = np.r_[wave, wave[::-1]] * [1.0, 0.01, 1.0] + [0.0, 400.0, 50.0]
    return [*found, stroke_plane.stroke_planes([back], [None], 0.0, True)]


# Learning.


def frame_of(rng, turned=0.5):
    C = rotations.exp(turned * rng.normal(size=3))
    start = 10.0 * rng.normal(size=3)
    return TaskFrame(start, start + 50.0 * C[:, 0], C, C @ rotations.exp(0.3 * rng.normal(size=3)))


@case
def frames_in_the_mean():
    rng = np.random.default_rng(22)
    found: list = []
    for count in (1, 2, 3, 4):
        for turned in (0.1, 0.8, 3.0):
            frames = [SimpleNamespace(frame=frame_of(rng, turned)) for _ in range(count)]
            found += [taught_strokes.mean_frame(frames, closed) for closed in (False, True)]
    return found


def swung(seconds, heights, closed, tool=True, force=None, count=61):
    """A short stroke over z = 0 by its heights, pressed by a force."""
    s = jerk(np.linspace(0.0, 1.0, count))
    a = 2.0 * np.pi * s
    flat = [25 - 25 * np.cos(a), 18 * np.sin(a)] if closed else [80 * s, 12 * np.sin(1.5 * a)]
    x = np.column_stack([*flat, heights(s)])
    R = rotations.exp(np.column_stack([0.1 * np.sin(a), 0.2 * s, 0.1 * s])) @ DOWN
    felt = None
    if force is not None:
        felt = force(s)[:, None] * [-0.1, 0.05, 1.0]
    t = np.linspace(0.0, seconds, count)
    return Trajectory(t, x, R if tool else None, contact_force=felt)


def on(surface, stroke):
    """The same over another surface, its heights kept."""
    at = surface.closest(stroke.position * [1.0, 1.0, 0.0])
    x = at.position + stroke.position[:, 2:] * at.normal
    return replace(stroke, position=x)


def learned(strokes, surface=None, **options):
    """What was learned with few functions, without what it was learned from."""
    fit = learning.fit(strokes, FitOptions(basis=16, **options), surface)
    t = np.linspace(0.0, fit.skill.duration, 25)
    return [fit.skill, fit.skill.taught_force(t), fit.reproductions, fit.plane, fit.lost]


def bow(s):
    return 4.0 * np.sin(np.pi * s)


def press(s):
    return 3.0 + 2.0 * np.sin(np.pi * s) + s


@case
def several_with_force_learned():
    strokes = [
        swung(3.0, lambda s: -press(s) / 4.0, False, force=press),
        swung(3.4, lambda s: -press(s) / 5.0, False, force=lambda s: 1.2 * press(s)),
    ]
    up = (0.0, 0.0, 3.0)
    return [
        learned(strokes, force_profile=True, normal=up),
        learned(strokes, force_profile=True, normal=up, align="time"),
        learned(strokes[:1], force_profile=True, normal=up, regression="ridge"),
        learned(strokes[:1], PLATE, force_profile=True),
        learned(strokes),
    ]


@case
def several_learned_on_surfaces():
    one, two = swung(3.0, bow, False), swung(2.5, lambda s: 0.5 * bow(s), False)
    found = [learned([on(DRUM, one), on(DRUM, two)], DRUM), learned([on(BALL, two)], BALL)]
    pressed = on(BALL, swung(3.0, lambda s: 0 * s, False, force=press))
    return [*found, learned([pressed], BALL, force_profile=True)]


@case
def closed_ones_learned_on_surfaces():
    found: list = []
    for tool in (True, False):
        one, two = swung(3.0, bow, True, tool), swung(2.6, lambda s: 0 * s, True, tool)
        found += [learned([on(BALL, one), on(BALL, two)], BALL), learned([one, two])]
    return found


@case
def strokes_learned_with_very_few_functions():
    one = swung(3.0, bow, False)
    found: list = []
    for count in (1, 2, 3):
        for how in ("lwr", "ridge"):
            fit = learning.fit([one], FitOptions(basis=count, regression=how))
            found += [fit.skill, fit.reproductions]
    return found


@case
def what_noise_explains_of_distances():
    rng = np.random.default_rng(23)
    found: list = []
    for count in (10, 400):
        for sigma in (0.0, 0.1, 0.5):
            d = np.abs(0.3 * rng.normal(size=count))
            found.append(learning._beyond_noise(d, sigma))
    quality = Quality(0.1, 0.5, 0.0, None, 0.0)
    return [*found, learning.with_lost(quality, [(0.1, 0.6), (0.3, 0.2)])]


@case
def closed_or_open():
    a = np.linspace(0.0, 2.0 * np.pi, 100)
    ring = np.column_stack([40 * np.cos(a), 40 * np.sin(a), 0 * a])
    found: list = []
    for cuts in ((0,), (3,), (6,), (9,), (30,), (0, 6), (0, 40), (40, 0), (40, 1), (6, 9, 1)):
        try:
            found.append(taught_strokes._closed([ring[: 100 - k] for k in cuts]))
        except DmpError as error:
            found.append(str(error))
    return found


@case
def speeds_held_on_bends():
    found: list = []
    t = np.linspace(0.0, 3.0, 90)
    for path in (
        along([[0, 0, 0], [60, 0, 0], [60, 40, 0], [0, 40, 9]], 0.89, soft=False),
        np.column_stack([30 * np.cos(3 * t), 30 * np.sin(3 * t), 2 * t]),
        np.column_stack([60 * t, 0 * t, 0 * t]),
    ):
        arc = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))]
        s = np.linspace(0.0, arc[-1], 150)
        bend = tool_speed._bend(arc, path, s)
        found.append(bend)
        for cap in (20.0 + 0 * s, 20.0 + 30.0 * np.cos(s / 9.0) ** 2):
            found += [tool_speed._timed(s, cap.copy(), limit) for limit in (50.0, 900.0)]
        even_t = tool_speed._in_time(*tool_speed._timed(s, 40.0 + 0 * s, 300.0))
        found += [even_t[0][::50], even_t[1][::50], even_t[2]]
        found.append(tool_speed.passed(t, path, Pace(50.0, 500.0), 10.0))
        found += [tool_speed.held(path, 30.0, v) for v in (10.0, 60.0)]
    return found


@case
def stamps_of_chance():
    rng = np.random.default_rng(24)
    found: list = []
    for _ in range(14):
        steps = np.full(int(rng.integers(20, 60)), 0.02)
        for _ in range(int(rng.integers(0, 4))):
            at = int(rng.integers(len(steps)))
            steps[at : at + int(rng.integers(1, 7))] = rng.choice([0.001, 0.006, 0.05, 0.11])
        if rng.random() < 0.3:
            steps = np.tile([0.0005, 0.0005, 0.04], 12)
        steps = steps * (1.0 + rng.choice([0.0, 5e-5, 0.02]) * rng.uniform(-1, 1, len(steps)))
        t = 5.0 + np.r_[0.0, np.cumsum(steps)]
        x = np.column_stack([9 * t, np.sin(7 * t), 0 * t])
        R = rotations.exp(np.column_stack([2.0 * t, 0.3 * t, 0 * t]))
        found.append(time_base.even(Trajectory(t, x, R, contact_force=x[:, ::-1].copy())))
        found.append(time_base._usual_step(steps))
        found.append(time_base._bursts(t, 0.02))
    return found


@case
def parts_of_chance_between_others():
    rng = np.random.default_rng(25)
    found: list = []
    for _ in range(8):
        stroke = np.linspace(0.0, 5.0, 120)
        x = np.cumsum(rng.normal(size=(120, 3)) * [1.0, 0.5, 0.0] + [0.6, 0, 0], axis=0)
        outside = np.zeros(120, dtype=bool)
        for at in rng.integers(0, 120, 3):
            outside[at : at + int(rng.integers(1, 25))] = True
        outside[0], outside[-1] = rng.random(2) < 0.3
        path = pieces.Path(stroke, x)
        for least in (0.0, 15.0):
            spans = pieces.inside(stroke, x, outside, least)
            found += [spans, [path.within(s) for s in spans]]
            for pace in (None, Pace(30.0, 300.0)):
                eases = tuple(rng.choice([0.0, 0.3, 2.0], 2))
                if spans:
                    found += [pieces.retimed(spans, stroke, path, pace, 12.0, 0.7, eases)]
    return found


@case
def strokes_of_few_functions_drawn():
    one = swung(3.0, lambda s: -press(s) / 4.0, False, force=press)
    options = FitOptions(basis=16, force_profile=True, normal=(0.0, 0.0, 1.0))
    pressing = learning.fit([one], options).skill
    lifted = learning.fit([swung(3.0, lambda s: 6 * jerk(3 * s - 1), False)], FitOptions(basis=16))
    ring = learning.fit([swung(3.0, bow, True)], FitOptions(basis=16)).skill
    start = np.array([[0.0, 0, 0], [20.0, 5, 0]])
    goal = start + [[70.0, 10, 0], [-50.0, 60, 0]]
    seconds = np.array([3.0, 4.0])
    found: list = []
    for skill in (pressing, lifted.skill, ring):
        for surface in (PLATE, None, BALL):
            ends = start, (start if skill.closed else goal)
            pairs = Pairs(*(e if surface is None else surface.closest(e).position for e in ends))
            heights = contact_heights.contact_heights(skill, None, 0.5)
            for style in (
                {"ease_in": 0.3, "heights": heights},
                {"force": 2.0, "orientation": "surface"},
                {"turn": 0.7, "size": 1.4, "amplitude": "scale"},
            ):
                more = GeneralizeOptions(**({"rate": 8.0} | style))
                found += draw(skill, pairs, seconds, surface, more)
    return found


@case
def few_functions_to_turned_pairs():
    """Tools asked for at both ends, at the start alone or not at all; copies; both models."""
    one = swung(3.0, lambda s: 0 * s, False)
    start = np.array([[0.0, 0, 0], [20.0, 5, 0], [0, 9, 0]])
    goal = start + [[70.0, 10, 0], [-50.0, 60, 0], [3.0, 90, 0]]
    R = rotations.exp(np.array([[0.1, 0.2, 0.9], [0.0, 0.3, -1.0], [0.2, 0, 2.0]])) @ DOWN
    asked = (
        Pairs(start, goal),
        Pairs(start, goal, R),
        Pairs(start, goal, R, R[::-1].copy()),
        copies.copied(Pairs(start[:1], goal[:1], R[:1]), 3, 7.0),
    )
    found: list = []
    for options in (
        {},
        {"tau": 2.0, "damping": 9.0, "regression": "ridge"},
        {"model": "original"},
        {"model": "original", "forcing_scale": "distance"},
        {"learning": "paper", "alpha_1": 1.6},
    ):
        skill = learning.fit([one], FitOptions(basis=16, **options)).skill
        shared = rollout.curves(skill, np.linspace(0.0, skill.duration, 9))
        found.append(shared)
        for pairs in asked:
            charts = None if skill.model == "original" else charts_of(skill, pairs, PLATE)
            for more in ({}, {"amplitude": "scale"}, {"orientation": "surface"}):
                drawn = rollout.roll_out(skill, shared, pairs, charts, **more)
                found += [drawn.position, drawn.euler]
            seconds = np.full(len(pairs), skill.duration)
            style = GeneralizeOptions(ease_in=0.2, ease_out=0.4)
            admitted = feasibility.admit(skill, pairs, seconds, style, PLATE, 0.5)
            found += [admitted, admitted.admitted, admitted.distance]
            found += [feasibility.tool_axis(skill, pairs), sides.turned_over(skill, pairs, BALL)]
    return found


@case
def laws_of_chance_there_and_back():
    rng = np.random.default_rng(26)
    found: list = []
    for count in (2, 3, 9, 60):
        t = np.r_[0.0, np.cumsum(rng.uniform(0.01, 0.5, count - 1))]
        s = np.r_[0.0, np.cumsum(rng.choice([0.0, 1.0, 9.0], count - 1) + 1e-3)]
        one = arc_length.monotone(t, s, rng.choice([0.0, 5.0, 80.0], count))
        found += [one, one.length, one.duration, one.place(t[-1] * np.linspace(0, 1, 13))]
        found += [one.time(s[-1] * np.linspace(-0.1, 1.1, 13))]
    x = np.cumsum(rng.normal(size=(12, 2)), axis=0)
    path = demonstrations.through(np.linspace(0.0, 2.0, 12), x)
    found += [arc_length.of_path(path, np.linspace(0.0, 2.0, n)) for n in (5, 30)]
    for seconds, rate, ease in (
        (3.0, 10.0, (0.0, 0.0)),
        (3.02, 10.0, (0.5, 1.0)),
        (1.0, 9.0, (1, 1)),
    ):
        found.append(time_scaling.timing(seconds, rate, 2.0, 0.7, *ease))
    return [*found, time_scaling.eased(np.linspace(-0.5, 3.0, 15), 1.0)]


@case
def springs_of_chance():
    rng = np.random.default_rng(27)
    found: list = []
    for count in (1, 2, 5, 24):
        for rule in ("spacing", "power"):
            basis = even_in_time(count, 3.0, 1.1, 1.3, rule)
            s = np.exp(-1.3 / 1.1 * np.linspace(0.0, 3.0, 17))
            w = rng.normal(size=(2, count))
            found += [basis, basis.reach, basis.banded, basis.mean(s, w), basis.normalized(s)]
            found += [basis.exponents(s[:3]), basis.window(s)]
            forcing = np.column_stack([np.sin(5 * s), s])
            found += [regression.lwr(basis, s, s, forcing), regression.ridge(basis, s, s, forcing)]
        k, d = rng.uniform(20.0, 90.0, 2), rng.uniform(4.0, 30.0, 2)
        spring = transformation_system.TransformationGains(k, d, rng.uniform(0.3, 2.0))
        t = np.r_[0.0, np.cumsum(rng.uniform(0.0, 0.4, 7))]
        found += [transformation_system.transition(spring, t)]
        found += [transformation_system.homogeneous(spring, t)]
        found += [transformation_system.longest_step(spring, 3.0, count)]
        model = forced_model.forced_model(count, k[0], d[0], 0.6, 1.2, "spacing")
        found += [model.samples, model.a, model.b, model.c, model.end, model.end_responses]
        found += [model.end_moves, model.start_move, model.response(w)]
    return found
