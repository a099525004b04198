"""Strokes learned and drawn in many ways: results that are kept, see `tests/kept.py`."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from dmpcli.dmp import (
    agreement,
    arc_length,
    basis_search,
    common_timing,
    contact_heights,
    copies,
    demonstrations,
    end_conditions,
    feasibility,
    forced_model,
    inclination,
    learning,
    least_squares,
    noise,
    paper_preprocessing,
    path_registration,
    pauses,
    pieces,
    recall,
    reference_paths,
    regression,
    rollout,
    segmentation,
    sides,
    smoothing,
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
from dmpcli.dmp.canonical_system import even_in_time
from dmpcli.dmp.demonstrations import ComparedPath
from dmpcli.dmp.drawn_strokes import GeneralizeOptions
from dmpcli.dmp.fit_result import Fit, ReproductionMeasures
from dmpcli.dmp.flat_directions import moving_axes
from dmpcli.dmp.force_profile import ForceProfile
from dmpcli.dmp.generalization import charts_of, draw, seen_from
from dmpcli.dmp.inclination import Inclination
from dmpcli.dmp.options import FitOptions
from dmpcli.dmp.path_registration import Correspondence
from dmpcli.dmp.preprocessing import preprocess
from dmpcli.dmp.rollout import Pairs
from dmpcli.dmp.tool_speed import Pace
from dmpcli.errors import DmpError
from dmpcli.spatial import rotations
from dmpcli.spatial.trajectory import Trajectory
from dmpcli.surfaces.cylinder import Cylinder
from dmpcli.surfaces.keep_off import KeepOff
from dmpcli.surfaces.plane import Plane
from dmpcli.surfaces.sphere import Sphere
from tests import cases, human_strokes
from tests.dmp import recordings, varied
from tests.dmp.strokes import circle, paper_stroke
from tests.kept import Kept

KEPT = Kept(__file__)
PLATE = Plane(np.zeros(3), np.array([0.0, 0.0, 1.0]))
DRUM = Cylinder(np.array([0.0, 0.0, -60.0]), np.array([0.0, 1.0, 0.0]), 60.0)
BALL = Sphere(np.array([0.0, 0.0, -150.0]), 150.0)
SEED = 3
HUMAN = ("Angle", "GShape", "Sine", "Worm")


def random():
    return np.random.default_rng(SEED)


@cache
def recorded():
    """Recordings by name, as tables (T, 4 or 8) of `tests.cases` have them."""
    return {
        "loops": cases.loops()[::3],
        "letters": cases.letters()[:1200],
        "corners": cases.corners(),
        "lean wall": cases.wall(20.0),
        "pen lift": cases.pen_lift(True),
        "blind lift": cases.pen_lift(),
        "seam": cases.seam(),
        "hesitation": cases.timing("hesitation"),
        "idle": cases.idle(0.05, random()),
        "noisy": cases.noisy(0.15, random()),
        "uneven": cases.uneven(random()),
        "nearly closed": cases.nearly_closed(),
        "few": cases.few(),
        "pause": cases.pause(random()),
        "approach": cases.approach(),
        "retract": cases.retract(),
        "saddle": cases.on_saddle(20.0),
        "bow": cases.on_bow(),
        "filtered": cases.filtered(0.2, 10.0, random()),
        "quantised": cases.quantised(0.2),
        "interpolated": cases.interpolated(0.1, random()),
        "aslant": cases.aslant(20.0, "y"),
        "hop": cases.hop(),
        "in plate": cases.tool_in_plate(),
        "above": cases.above(3.0),
    }


def stroke_of(table):
    R = rotations.from_quaternion(table[:, 4:8]) if table.shape[1] == 8 else None
    return Trajectory(table[:, 0], table[:, 1:4], R)


def named(name):
    return stroke_of(recorded()[name])


NAMES = tuple(recorded())


def thinned(x, count=60):
    return x[:: max(1, len(x) // count)]


def summary(p):
    """What preprocessing found, and the smooth stroke at a few places."""
    t = np.linspace(0.0, p.duration, 80)
    R = None if p.rotation is None else p.rotation(t)
    return [
        replace(p.position, spline=None),
        p.position(t),
        p.position(t, 1),
        R,
        p.trimmed,
        p.gaps,
        p.pauses,
        p.approach,
        p.retract,
        p.merged,
        p.resampled,
        p.duration,
        p.cutoff,
        p.sigma,
        p.half_rate,
        p.intervals,
        p.smoothed_noise,
        p.smoothed_angular_noise,
    ]


def fitted(fit):
    """What was learned, without what it was learned from."""
    plane = fit.plane
    alignment = fit.alignment
    if alignment is not None:
        alignment = [
            alignment.duration,
            alignment.mean,
            alignment.distances,
            alignment.doubts,
            alignment.rests,
            alignment.deviations,
            alignment.times,
        ]
    return [fit.skill, fit.reproductions, plane, alignment, fit.alternative, fit.lost]


@cache
def learned(name, **options):
    return learning.fit([named(name)], FitOptions(**options)).skill


@cache
def paper(turning=False, **options):
    return learning.fit([paper_stroke(turning=turning)], FitOptions(**options)).skill


@cache
def ring():
    return learning.fit([circle()], FitOptions(regression="ridge")).skill


@KEPT.case
def noise_of_recordings():
    found: list = [noise.estimate(named(name).position) for name in NAMES]
    return [
        found,
        [n.along(np.eye(3)[:, :2]) for n in found[::4]],
        [n.typical for n in found],
        [n.total for n in found],
        noise.estimate(named("noisy").position, partial=False),
    ]


@KEPT.case
def noise_of_uneven_axes_and_filters():
    _t, points = recordings.six_seconds()
    x = [recordings.noisy(points, s, 1) for s in ([0.3, 0.1, 0.01], 0.05, [0.0, 0.2, 0.2])]
    x += [recordings.filtered(points, 0.2, 2, cutoff=f) for f in (3.0, 8.0, 20.0)]
    x += [
        recordings.interpolated(lambda at: recordings.wave(recordings.jerk(at / 6.0)), 0.1, kind)[1]
        for kind in ("linear", "cubic")
    ]
    x += [np.round(points / s) * s for s in (0.01, 0.05, 1.0)]
    x += [recordings.noisy(points, 0.1, 4)[::7], recordings.noisy(points, 0.1, 5)[::13]]
    return [noise.estimate(one) for one in x]


@KEPT.case
def axes_that_move():
    flat = named("noisy").position
    found: list = []
    for scale in ([1, 1, 1], [1, 1e-4, 0], [1, 0, 0], [1, 5e-3, 5e-3]):
        x = flat * np.array(scale, dtype=float)
        found.append(moving_axes(x, noise.estimate(x)))
    return [np.abs(a) for a in found]


@KEPT.case
def even_grids():
    found: list = [time_base.even(named(name)) for name in ("uneven", "pause", "noisy", "few")]
    t, _points = recordings.six_seconds()
    R = rotations.exp(np.column_stack([0.2 * t, 0 * t, 0.1 * t]))
    rng = random()
    jittered = t + rng.uniform(-0.003, 0.003, len(t))
    kept = (t < 2.0) | (t > 2.12)
    bursts = np.sort(np.r_[t[::5], t[::5] + 4e-4])
    for at in (jittered, t[kept], bursts, t**1.1, np.r_[t[:300], t[300:] + 0.06]):
        share = np.clip(at / 6.0, 0.0, 1.0)
        force = np.column_stack([0 * at, at, 1.0 + 0 * at])
        turned = rotations.exp(np.column_stack([0.3 * share, 0.1 * share**2, 0 * share]))
        found.append(
            time_base.even(Trajectory(at, recordings.wave(share), turned, contact_force=force))
        )
    return [found, time_base.continuous_quaternions(R[::50])]


@KEPT.case
def parts_of_recordings():
    found: list = []
    for name in NAMES:
        base = time_base.even(named(name)).stroke
        for x in (base.position, recordings.noisy(base.position, 0.1, 2)):
            one = Trajectory(base.t, x, base.rotation)
            found.append(segmentation.segment(one, noise.estimate(x)))
    for down, up, sigma in ((60, 0, 0.1), (10, 10, 0.02), (0, 30, 0.0), (4, 40, 0.05), (7, 6, 0.0)):
        t, x = recordings.with_approach(recordings.six_seconds()[1], down, up, 1.2)
        x = recordings.noisy(x, sigma, 6)
        found.append(segmentation.segment(Trajectory(t, x), noise.estimate(x)))
    for aside in (0.2, 0.6, 0.9, 1.2):
        points = recordings.six_seconds()[1]
        q = (1.0 - recordings.jerk(np.arange(0.0, 1.5, 0.01) / 1.5))[:, None]
        x = np.concatenate([points[0] + q * [-60 * aside, 10.0 * aside, 50.0], points])
        one = Trajectory(0.01 * np.arange(len(x)), x)
        found.append(segmentation.segment(one, noise.estimate(x)))
        turned = Trajectory(one.t, x[::-1].copy())
        found.append(segmentation.segment(turned, noise.estimate(x[::-1])))
    return found


@KEPT.case
def pauses_of_many_lengths():
    found: list = []
    _, points = recordings.six_seconds()
    for rest in (0.15, 0.25, 0.35, 0.5, 1.0):
        for sigma in (0.0, 0.02, 0.1, 0.3):
            for creep in (0.0, 0.5, 2.0):
                still = points[300] + np.linspace(0.0, creep, round(100 * rest))[:, None] * [
                    1,
                    0,
                    0,
                ]
                x = np.r_[points[:300], still, points[300:] + [creep, 0, 0]]
                x = recordings.noisy(x, sigma, 7)
                one = Trajectory(0.01 * np.arange(len(x)), x)
                found.append(segmentation.segment(one, noise.estimate(x)).pauses)
                found.append(pauses.rests(one.t, x, sigma))
    return found


@KEPT.case
def pauses_left_out():
    x = np.cumsum(random().normal(size=(400, 2)), axis=0)
    cuts = ([(100, 140)], [(20, 30), (34, 60), (300, 380)], [(2, 5), (390, 397)])
    return [pauses.without(x, c) for c in cuts]


@KEPT.case
def idle_ends():
    found: list = []
    for name in ("idle", "pause", "hesitation", "noisy", "loops"):
        s = named(name)
        part = segmentation.moving_part(s, noise.estimate(s.position))
        found += [(part.start, part.stop)]
        part = smoothing.moving_part(s.t, s.position)
        found += [(part.start, part.stop)]
    s = named("pause")
    found.append(segmentation.cut(s, 0.5, 9.25, ((3.0, 7.99),)))
    found.append([smoothing.low_pass(thinned(s.position), 20.0, f) for f in (2.0, 6.0, None)])
    found.append(smoothing.differentiated(thinned(s.t), thinned(s.position)))
    return found


@KEPT.case
def recordings_made_smooth():
    return [summary(preprocess(named(name))) for name in NAMES if name != "letters"]


@KEPT.case
def recordings_made_smooth_as_asked():
    ways = ({"cutoff": 4.0}, {"trim": False}, {"start": 1.0, "until": 4.5}, {"cut_pauses": True})
    return [
        summary(preprocess(named(name), **w)) for name in ("idle", "pause", "aslant") for w in ways
    ]


@KEPT.case
def splines_through_noise():
    found: list = []
    _t, points = recordings.six_seconds()
    for x in (
        points,
        recordings.noisy(points, 0.1),
        recordings.filtered(points, 0.3),
        np.round(points / 0.1) * 0.1,
        recordings.corners()[1],
        0.05 * points,
        recordings.noisy(points[::8], 0.3),
    ):
        n = noise.estimate(x)
        for more in ({}, {"cutoff": 3.0}, {"resampled": True}):
            s = spline_smoothing.smooth(x, 6.0, n, **more)
            found.append([replace(s, spline=None), s(np.linspace(0, 6, 50)), s.finest])
    return found


@KEPT.case
def ends_of_splines():
    found: list = []
    x = recordings.noisy(recordings.six_seconds()[1], 0.1, 8)
    for intervals in (10, 40):
        design = least_squares.uniform(len(x), intervals)
        c = design.coefficients(x)
        for variance in (1e-4, 0.03, 1.0):
            found += [spline_ends.with_ends(design, c, variance)]
            found += [spline_ends.end(design, c, variance, True)]
    return found


@KEPT.case
def paper_stroke_learned():
    ways = (
        {},
        {"regression": "ridge"},
        {"basis": 30},
        {"widths": "power"},
        {"tolerance": 0.02},
        {"passes": 2, "basis": 60},
        {"damping": 30.0, "tau": 0.4, "alpha_1": 1.5},
        {"learning": "paper"},
        {"model": "original"},
        {"model": "original", "forcing_scale": "distance", "regression": "ridge"},
        {"learning": "paper", "basis": 25, "cutoff": 5.0, "trim": False},
    )
    return [fitted(learning.fit([paper_stroke(turning=True)], FitOptions(**w))) for w in ways]


@KEPT.case
def recordings_learned():
    names = (
        "lean wall",
        "pen lift",
        "blind lift",
        "seam",
        "hesitation",
        "idle",
        "noisy",
        "uneven",
        "nearly closed",
        "few",
        "pause",
        "approach",
        "bow",
        "quantised",
        "aslant",
        "in plate",
    )
    return [fitted(learning.fit([named(name)], FitOptions())) for name in names]


@KEPT.case
def recordings_learned_on_surfaces():
    found: list = []
    position = cases.wave(cases.U6, 109.0, 40.0)
    a = position[:, 0] / 60.0
    w = 4.0 * cases.jerk((cases.T6 - 2.0) / 1.0) * cases.jerk((5.0 - cases.T6) / 1.0)
    drum = np.column_stack([(60 + w) * np.sin(a), position[:, 1], (60 + w) * np.cos(a) - 60.0])
    tilt = np.column_stack([np.pi + 0.1 * np.sin(a), a, 0.2 * a])
    for surface, x in ((DRUM, drum), (PLATE, position + [0, 0, 0.4])):
        one = Trajectory(cases.T6, x, rotations.from_euler(tilt))
        found.append(fitted(learning.fit([one], FitOptions(), surface)))
        skill = found[-1][0]
        found.append([contact_heights.contact_heights(skill, c) for c in (None, 0.0, 0.5, 5.0)])
        found.append(contact_heights.end_heights(skill, found[-1][0]))
        found.append(contact_heights.demonstrated_scale(skill, np.linspace(0, 6, 20)))
        found.append(found[-2][0])
    return found


@KEPT.case
def closed_strokes_learned():
    return [fitted(learning.fit([circle()], FitOptions(regression=r))) for r in ("lwr", "ridge")]


@KEPT.case
def several_learned():
    found: list = []
    three = [stroke_of(cases.timing(n)) for n in ("even", "slow_start", "hesitation")]
    three[1] = replace(three[1], position=three[1].position * [1.02, 0.95, 1.0])
    for how in ("path", "time", "none"):
        found += [fitted(learning.fit(three, FitOptions(align=how)))]
    human = human_strokes.strokes("Sine")[:3]
    found.append(fitted(learning.fit(human, FitOptions())))
    found.append(fitted(learning.fit(three, FitOptions(learning="paper"))))
    return found


@KEPT.case
def several_aligned():
    found: list = []
    for shape in HUMAN:
        paths = []
        for s in human_strokes.strokes(shape)[:4]:
            s = smoothing.evenly_sampled(s) if smoothing.is_even(s.t) else time_base.even(s).stroke
            x = thinned(s.position, 300)
            paths.append(ComparedPath(float(s.t[-1]), x - x[-1], 0.05, 0.01 * x[:, :1]))
        for how in ("path", "time"):
            a = align(paths, how, 200)
            found.append(
                [
                    a.duration,
                    a.mean,
                    a.spread,
                    a.distances,
                    a.doubts,
                    a.rests,
                    a.deviations,
                    a.times,
                    a.angles,
                ]
            )
    return found


@KEPT.case
def strange_ones_among_several():
    u = np.linspace(0.0, 1.0, 301)
    wave = cases.wave(u, 300.0, 50.0)
    odd = [
        wave[::-1],
        wave * [1, 1.6, 1],
        wave + [0, 20, 0] * np.sin(9 * u)[:, None],
        np.column_stack([300 * u, 40 * np.sin(np.pi * u), 0 * u]),
    ]
    rng, found = random(), []
    for x in odd:
        paths = np.array([wave + rng.normal(0, 0.5, 3) for _ in range(3)] + [x])
        found += [
            agreement.reversals(paths),
            agreement.distances(paths),
            agreement.extent(paths),
            agreement.strangers(paths, np.full(4, 0.1), np.empty(0, dtype=int)),
            agreement.strangers(paths[1:], np.full(3, 0.1), np.array([2])),
            agreement.spread(paths),
            agreement.pooled_mean(paths),
        ]
    loop = (
        np.array(
            [
                [np.cos(2 * np.pi * (u + s)), 0.6 * np.sin(2 * np.pi * (u + s)), 0 * u]
                for s in (0.0, 0.01, 0.3)
            ]
        ).transpose(0, 2, 1)
        * 40.0
    )
    return [
        *found,
        agreement.strangers(loop, np.full(3, 0.01), np.empty(0, dtype=int)),
        agreement.reversals(loop),
    ]


@KEPT.case
def places_that_correspond():
    s = np.linspace(0.0, 1.0, path_registration.PLACES)
    paths = []
    for r in (20.0, 26.0, 30.0):
        x = np.column_stack([300 * s + r * np.sin(6 * np.pi * s), r * np.cos(6 * np.pi * s), 5 * s])
        arc = np.r_[0, np.cumsum(np.linalg.norm(np.diff(x, axis=0), axis=1))]
        paths.append(np.column_stack([np.interp(arc[-1] * s, arc, c) for c in x.T]))
    paths[1][:200] *= [1.0, 1.3, 1.0]
    found = path_registration.register(np.array(paths), np.array([True, True, True]), 0.05)
    place = np.linspace(0.0, 1.0, 41)
    more = path_registration.register(np.array(paths), np.array([True, False, True]), 2.0)
    return [
        [
            c,
            c(place),
            c.slope(place),
            c.inverse(place),
            c.deviation(),
            c.pinned({0.3: 0.34, 0.7: 0.66})(place),
        ]
        for c in [*found, *more]
    ]


@KEPT.case
def planes_of_strokes():
    found: list = []
    tools = (
        None,
        np.array([0.0, 0.0, 1.0]),
        cases.about("x", 40.0)[:, 2],
        cases.about("y", 70.0)[:, 2],
    )
    for name in NAMES:
        x = named(name).position
        closed = name == "nearly closed"
        found += [
            stroke_plane.stroke_planes([x], [tool], 0.05, closed)
            for tool in tools[:: 1 + 2 * closed]
        ]
    several = [named(n).position for n in ("hop", "noisy", "blind lift")]
    for tool in tools:
        found.append(stroke_plane.stroke_planes(several, [tool] * 3, 0.1, False))
    found.append(
        stroke_plane.stroke_planes(several, [None] * 3, 0.1, False, np.array([0.1, 0.2, 1.0]))
    )
    return found


@KEPT.case
def strokes_in_their_charts():
    found: list = []
    for name in ("aslant", "pen lift", "in plate", "bow", "nearly closed"):
        strokes, plane, closed = taught_strokes.taught_strokes(
            [preprocess(named(name))], FitOptions(), None
        )
        for s in strokes:
            found += [[s.frame, s.length, s.curve.even(40), plane, closed]]
        found.append(taught_strokes.mean_frame(strokes, closed))
    return found


@KEPT.case
def skills_recalled():
    found: list = []
    for name in ("noisy", "seam", "hesitation"):
        seen = preprocess(named(name))
        [taught], _, _ = taught_strokes.taught_strokes([seen], FitOptions(), None)
        found.append(recall.recalled(paper(), taught))
        found.append(recall.recalled(learned(name), taught))
    choices = FitOptions(learning="paper")
    skill = learning.fit([named("noisy")], choices).skill
    found.append(
        recall.recalled_as_paper(skill, named("noisy"), preprocess(named("noisy")), choices)
    )
    return found


START = np.array([[0.0, 0.0, 0.0], [0.0, 90.0, 0.0], [40.0, -60.0, 0.0]])
GOAL = START + [[109.0, 0.0, 0.0], [70.0, 60.0, 0.0], [-20.0, 140.0, 0.0]]
PAIRS = Pairs(START, GOAL)
TURNED = Pairs(
    START,
    GOAL,
    rotations.from_euler(np.array([[3.1, 0.1, a] for a in (0, 0.5, -1)])),
    rotations.from_euler(np.array([[3.0, -0.1, a] for a in (0.2, 0.7, 1)])),
)


class Band:
    """All with x between two numbers."""

    def __init__(self, low, high):
        self.low, self.high = low, high

    def holds(self, points):
        return (points[..., 0] > self.low) & (points[..., 0] < self.high)


def drawn(skill, pairs, surface, duration=6.0, **style):
    style = {"rate": 20.0} | style
    return draw(skill, pairs, np.full(len(pairs), duration), surface, GeneralizeOptions(**style))


STYLES = (
    {},
    {"amplitude": "scale"},
    {"orientation": "surface"},
    {"ease_in": 0.5, "ease_out": 1.0},
    {"pace": Pace(40.0)},
    {"pace": Pace(200.0, 500.0)},
    {"inclination": Inclination(0.3, -0.1)},
    {"keep_off": KeepOff(None, (Band(30.0, 50.0),)), "on_border": "split"},
    {"keep_off": KeepOff(None, (Band(60.0, 70.0),)), "on_border": "clip"},
    {"keep_off": KeepOff(None, (Band(60.0, 70.0),)), "on_border": "split", "pace": Pace(60.0)},
)


@KEPT.case
def strokes_drawn_on_a_plate():
    return [drawn(paper(True), pairs, PLATE, **s) for s in STYLES for pairs in (PAIRS, TURNED)]


@KEPT.case
def strokes_drawn_without_a_surface():
    skills = (paper(True), paper(True, model="original"), paper(False, learning="paper"))
    return [drawn(skill, PAIRS, None, **s) for skill in skills for s in STYLES[:3:2]]


@KEPT.case
def strokes_drawn_on_round_parts():
    found: list = []
    for surface in (DRUM, BALL):
        start, goal = surface.closest(START).position, surface.closest(GOAL).position
        for style in (*STYLES[:3], STYLES[6], STYLES[7], STYLES[4]):
            found += [drawn(paper(True), Pairs(start, goal), surface, **style)]
    return found


@KEPT.case
def rings_drawn():
    found: list = []
    for style in ({}, {"size": 2.0}, {"turn": 1.0}, {"size": 0.5, "turn": -2.0}):
        found.append(drawn(ring(), Pairs(START, START), PLATE, **style))
        found.append(drawn(ring(), Pairs(START, START), None, **style))
        ball = BALL.closest(START).position
        found.append(drawn(ring(), Pairs(ball, ball), BALL, **style))
    return found


def in_one(drawn):
    """Positions and angles of roll-outs, (B, T, 6)."""
    return np.concatenate([drawn.position, drawn.euler], axis=-1)


@KEPT.case
def poses_and_curves():
    skill = paper(True)
    found: list = []
    for surface in (PLATE, None, DRUM):
        pairs = (
            TURNED
            if surface is not DRUM
            else Pairs(DRUM.closest(START).position, DRUM.closest(GOAL).position)
        )
        charts = charts_of(skill, pairs, surface)
        shared = rollout.curves(skill, np.linspace(0.0, skill.duration, 60))
        for more in ({}, {"amplitude": "scale"}, {"orientation": "surface"}):
            found += [in_one(rollout.roll_out(skill, shared, pairs, charts, **more))]
    original = paper(True, model="original")
    shared = rollout.curves(original, np.linspace(0.0, original.duration, 60))
    found += [shared, in_one(rollout.roll_out(original, shared, TURNED, None))]
    return found


@KEPT.case
def copies_side_by_side():
    pairs = copies.copied(PAIRS, 3, 8.0)
    found: list = [copies.ends(paper(), pairs, s, 0.0) for s in (PLATE, None)]
    return [
        pairs.shift,
        found,
        copies.ends(ring(), copies.copied(Pairs(START, START), 2, 5.0), PLATE, 0.4),
        drawn(paper(), pairs, PLATE)[1::4],
    ]


@KEPT.case
def what_is_feasible():
    skill = paper(True)
    starts = np.zeros((8, 3))
    goals = np.array(
        [
            [109, 0, 0],
            [1e-7, 0, 0],
            [0, 0, 50],
            [5000, 0, 0],
            [2, 0, 0],
            [100, 0, 4],
            [60, 60, 0.4],
            [400, 0, 0],
        ],
        dtype=float,
    )
    pairs, duration = Pairs(starts, goals), np.full(8, 6.0)
    duration[6], duration[7] = 0.3, 1e6
    found: list = []
    for s in (skill, ring(), paper(True, model="original"), learned("nearly closed")):
        for surface in (PLATE, None, BALL):
            style = GeneralizeOptions(ease_in=0.4, ease_out=0.4, allow_stretch=surface is BALL)
            one = feasibility.admit(s, pairs, duration, style, surface, 0.5)
            found += [one, one.admitted, one.distance]
        found += [feasibility.nearly_closed(s), feasibility.most_stretch(s)]
    found.append(feasibility.snapped(Pairs(starts + [0, 0, 0.3], goals), PLATE))
    found += [feasibility.tool_axis(s, p) for s in (skill, paper()) for p in (PAIRS, TURNED)]
    return found


@KEPT.case
def sides_of_a_surface():
    guessed = learned("hesitation")
    under = Plane(np.zeros(3), np.array([0.0, 0.6, -0.8]))
    found: list = []
    for surface in (PLATE, under, BALL, DRUM):
        found += [
            sides.turned_over(guessed, PAIRS, surface),
            sides.normals_at(surface, START),
            sides.taught_side(guessed, surface, START),
            sides.taught_side(paper(True), surface, START),
            seen_from(guessed, GeneralizeOptions(), PAIRS, surface),
        ]
    return found


@KEPT.case
def tools_that_lean():
    t = np.linspace(0.0, 1.0, 60)
    position = np.stack(
        [
            np.column_stack([90 * t, 20 * np.sin(8 * t), 3 * t]),
            np.column_stack([30 * np.cos(6 * t), 30 * np.sin(6 * t), 0 * t]),
            np.column_stack([40 * np.sin(6 * t), 0 * t, 0 * t]),
        ]
    )
    euler = np.broadcast_to([3.0, 0.1, 0.2], position.shape) + 0.1 * np.sin(9 * t)[:, None]
    frames = np.eye(3)[None, None]
    normal = np.broadcast_to([0.0, 0.0, 1.0], position.shape)
    return [
        inclination.inclined(euler, frames, position, Inclination(a, b))
        for a, b in ((0.3, 0.0), (0.0, -0.4), (0.5, 0.2))
    ] + [inclination.travel(position, normal)]


@KEPT.case
def paces():
    t = np.linspace(0.0, 10.0, 801)
    u = recordings.jerk(t / 10.0)
    paths = (
        cases.wave(u, 300, 60, 3),
        cases.CORNERS[np.minimum((30 * u).astype(int), 30)] * 1.0,
        np.column_stack([50 * np.cos(5 * u), 50 * np.sin(5 * u), 4 * u]),
    )
    found: list = [
        tool_speed.passed(t, p, Pace(v, a), 25.0)
        for p in paths[::2]
        for v, a in ((30.0, 1000.0), (150.0, 400.0), (400.0, 3000.0))
    ]
    return [found, [tool_speed.held(p, 80.0, 30.0) for p in paths]]


@KEPT.case
def functions_and_searches():
    found: list = []
    for count, rule in ((1, "spacing"), (7, "spacing"), (40, "power"), (300, "spacing")):
        basis = even_in_time(count, 6.0, 3.0, 1.2, rule)
        s = np.linspace(1.0, 0.1, 50)
        found += [
            basis,
            basis.reach,
            basis.banded,
            basis.mean(s, np.sin(np.arange(2 * count)).reshape(2, count)),
            basis.normalized(s),
        ]
    points = cases.wave(np.linspace(0, 1, 120)) + [0.0, 1.0, 2.0]
    found.append(basis_search.nearest(points, cases.wave(np.linspace(0, 1, 90))))
    found.append(basis_search.waves(points, points * [1, 0.9, 1]))
    found.append(
        basis_search.judged(
            np.hstack([points, points / 99]), np.hstack([points * 1.01, points / 98]), False
        )
    )
    for path in ("sine", "line", "circle"):
        t = np.linspace(0.0, 5.0, 40)
        more = (30.0,) if path == "sine" else ()
        found.append(getattr(reference_paths, path)(START[1], GOAL[1], *more, t, 5.0))
    found.append(reference_paths.polyline(cases.CORNERS[:6], np.linspace(0.0, 5.0, 40), 5.0))
    return found


@KEPT.case
def forces_learned_and_drawn():
    from tests.dmp.test_force_profile import learned as pressed
    from tests.dmp.test_force_profile import pressed_stroke

    found: list = []
    for lift in (None, lambda t: 5.0 + 0 * t):
        skill = pressed(pressed_stroke(noise=0.05, samples=401, lift=lift))
        heights = contact_heights.contact_heights(skill, None)
        found += [
            skill.force,
            skill.taught_force(np.linspace(0, 10, 30)),
            heights,
            drawn(skill, PAIRS, PLATE, heights=heights),
            drawn(skill, PAIRS, PLATE, heights=heights, force=4.0),
        ]
    return found


@KEPT.case
def springs_and_their_answers():
    found: list = []
    for k, d, tau in (([100.0, 100.0], [20.0, 20.0], 2.0), ([50.0, 300.0], [20.0, 8.0], 0.7)):
        spring = transformation_system.TransformationGains(np.array(k), np.array(d), tau)
        t = np.array([0.0, 0.1, 0.35, 0.9, 2.0])
        step = transformation_system.longest_step(spring, 2.0, 40)
        wide = transformation_system.longest_step(spring, 200.0, 2)

        def pull(s):
            return np.stack([np.sin(5.0 * s), s**2], axis=-1)

        found += [
            step,
            wide,
            transformation_system.transition(spring, t),
            transformation_system.homogeneous(spring, t),
            transformation_system.forced(spring, pull, np.linspace(0.0, 2.0, 9), step),
        ]
        basis = even_in_time(12, 2.0, tau, 1.2)
        one = transformation_system.TransformationGains(np.array(k[1:]), np.array(d[1:]), tau)
        ends = end_conditions.end_responses(one, basis, 1.2, 2.0)
        paths = np.cos(np.outer(np.linspace(0, 1, 30), np.arange(1.0, 7.0)))
        moves = end_conditions.end_moves(paths, ends)
        weights = np.sin(np.arange(24.0)).reshape(2, 12)
        found += [
            ends,
            moves,
            end_conditions.start_move(paths, np.linspace(1, 0, 30), 12),
            end_conditions.corrections(weights, np.ones((2, 2)), ends, moves),
        ]
    found += [transformation_system.quadrature(n) for n in (1, 2, 6)]
    found.append(transformation_system.critical(np.array([20.0, 3.0])))
    return found


@KEPT.case
def weights_by_regression():
    found: list = []
    for count in (5, 30, 90):
        basis = even_in_time(count, 6.0, 3.0, 1.0)
        s = np.exp(-np.linspace(0.0, 6.0, 400) / 3.0)
        forcing = np.column_stack([np.sin(9 * s), s**2 - 0.3])
        found += [regression.lwr(basis, s, s, forcing), regression.ridge(basis, s, s, forcing)]
        if basis.banded:
            banded = regression.BandedRegression(basis, s)
            found += [banded.fit("lwr", forcing, n) for n in (1, 3)]
            found.append(banded.fit("ridge", forcing))
        model = forced_model.forced_model(count, 100.0, 20.0, 0.5, 1.0, "spacing")
        found += [
            model.samples,
            model.a,
            model.b,
            model.c,
            model.end,
            model.end_responses,
            model.end_moves,
            model.start_move,
            model.response(np.ones((1, count))),
        ]
    return found


@KEPT.case
def splines_by_least_squares():
    found: list = []
    x = np.cumsum(random().normal(size=(900, 2)), axis=0)
    for design in (
        least_squares.uniform(300, 20),
        least_squares.uniform(900, 60),
        least_squares.uniform(300, 7, 0.3, 0.02),
        least_squares.Design(300, 0.0, 0.05, np.array([0.0, 1, 3, 4, 8, 15]), False),
        least_squares.Design(900, 0.0, 0.05, np.linspace(0.0, 45.0, 70), False),
    ):
        y = x[: design.count]
        c = design.coefficients(y)
        found += [
            design.gram,
            design.right(y),
            c,
            design.values(c),
            design.residual(y),
            design.intervals,
            design.size,
            design.knots,
        ]
    return found


@KEPT.case
def laws_of_time():
    t = np.linspace(0.0, 4.0, 41)
    laws = [
        arc_length.monotone(t, 50.0 * (t / 4.0) ** p, 12.5 * p * (t / 4.0) ** (p - 1))
        for p in (1.0, 1.4, 2.0)
    ]
    found: list = [laws, [law.time(np.linspace(-1.0, 51.0, 30)) for law in laws]]
    found += [law.place(np.linspace(0.0, 4.0, 30)) for law in laws]
    bent = Correspondence().pinned({0.3: 0.4, 0.7: 0.75})
    found.append(common_timing.mean_law(laws, [Correspondence(), bent, Correspondence()], 60))
    found.append(common_timing.running_on(laws[1], [0.3, 0.8]))
    for ease in ((0.0, 0.0), (0.5, 0.2), (2.0, 2.0)):
        found.append(time_scaling.timing(3.03, 25.0, 6.0, 3.0, *ease))
        found.append(time_scaling.eased(t, ease[0]))
    x = named("hesitation").position
    [rest] = demonstrations.rests_of([ComparedPath(8.0, x)] * 3).held[0].values()
    path = ComparedPath(8.0, x)
    for cuts, held in (((), {}), ([rest], {}), ((), {0: rest})):
        moving = demonstrations.of_stroke(path, cuts, held)
        found += [moving.duration, moving.law, moving.stays, moving.skipped]
        found.append(moving.at(np.linspace(0.0, 1.0, 20)))
    return found


@KEPT.case
def parts_between_others():
    stroke = np.linspace(0.0, 10.0, 301)
    x = np.column_stack([30.0 * stroke, 10 * np.sin(stroke), 0 * stroke])
    outside = (np.sin(2.0 * stroke) > 0.7) | ((stroke > 7.0) & (stroke < 7.1))
    found: list = []
    for least in (0.0, 20.0, 60.0):
        spans = pieces.inside(stroke, x, outside, least)
        path = pieces.Path(stroke, x)
        found += [spans, [path.within(s) for s in spans]]
        for pace in (None, Pace(50.0)):
            found.append(pieces.retimed(spans, stroke[::3], path, pace, 20.0, 1.3, (0.2, 0.0)))
    return found


@KEPT.case
def demonstrations_prepared_as_the_paper_has_it():
    found: list = []
    for name in ("idle", "noisy", "aslant", "nearly closed"):
        for options in ({}, {"basis": 20}, {"cutoff": 3.0, "trim": False}):
            p = paper_preprocessing.prepare(named(name), FitOptions(learning="paper", **options))
            found.append([p.signal, p.frame, p.closed, p.removed, p.trimmed, p.cutoff])
    return found


def refused(call):
    """Name what a call is refused with; nothing where it goes through."""
    try:
        call()
    except (DmpError, ValueError) as error:
        return type(error).__name__
    return ""


@KEPT.case
def what_is_refused():
    plain, turning = paper_stroke(), paper_stroke(turning=True)
    bare = replace(plain, rotation=None)
    still = replace(bare, position=0.0 * bare.position)
    pressed = replace(plain, contact_force=np.tile([0.0, 0.0, -3.0], (len(plain.t), 1)))

    def fit(strokes, **options):
        return lambda: learning.fit(strokes, FitOptions(**options))

    calls = [
        fit([plain, bare]),
        fit([bare, plain, turning]),
        fit([plain, turning, bare]),
        fit([still]),
        fit([still], learning="paper"),
        fit([plain], force_profile=True),
        fit([pressed], force_profile=True),
        fit([plain], start=20.0),
        fit([plain], until=0.0),
        fit([plain], start=2.0, until=2.01),
        fit([few_of(plain, 3)]),
        fit([few_of(plain, 8)]),
        fit([plain, circle()]),
        fit([circle(), circle()]),
    ]
    calls += [
        fit([plain], learning="paper", **one)
        for one in (
            {"normal": (0, 0, 1.0)},
            {"tolerance": 1.0},
            {"passes": 2},
            {"align": "time"},
            {},
        )
    ]
    return [refused(call) for call in calls]


def few_of(stroke, count):
    rows = np.linspace(0, len(stroke.t) - 1, count).astype(int)
    R = None if stroke.rotation is None else stroke.rotation[rows]
    return Trajectory(stroke.t[rows], stroke.position[rows], R)


@KEPT.case
def forces_of_springs():
    from dmpcli.dmp.force_profile import unsprung

    force = np.concatenate([np.linspace(-1.0, 6.0, 80), np.linspace(6.0, 0.0, 40)])
    found: list = [unsprung(-force / k + lift, force) for k in (0.5, 2.0) for lift in (0.0, 4.0)]
    quality = basis_search.Quality(0.1, 0.4, 0.2, (50.0, 49.0), 0.01)
    found += [
        learning.with_lost(quality, lost) for lost in ([], [(0.2, 0.1)], [(0.0, 0.9), (0.3, 0)])
    ]
    heights = contact_heights.ContactHeights(0.5, 0.2, 0.1, 0.0, 1.0, 3.0)
    w = np.linspace(-2.0, 4.0, 60)
    found += [
        heights.drawn(w),
        heights.deep,
        contact_heights.pressed(w, 4.0, heights),
        contact_heights.pressed(w, w + 3.0, heights),
        contact_heights.pressed(w, None, heights),
    ]
    return found


@KEPT.case
def what_is_meant_where_nothing_is_said():
    found: list = [
        FitOptions(),
        GeneralizeOptions(),
        Pace(1.0),
        ComparedPath(1.0, np.zeros(1)),
        basis_search.Tolerance(1.0),
        Correspondence(),
        agreement.Doubt(0, "shape", 1.0),
    ]
    zeros = np.zeros(2)
    found += [
        noise.Noise(np.eye(2), zeros),
        ForceProfile(zeros, 1.0, 0.0, 0.0, 0.0),
        Fit(None, [], []),
        ReproductionMeasures(zeros, zeros, 0.0, 0.0, 0.0),
    ]
    for depth, band in ((1.0, 0.5), (0.4, 0.5), (0.5, 0.5), (1.0, 0.0)):
        found.append(contact_heights.ContactHeights(band, 0.0, 0.0, depth, 1.0, 0.0).deep)
    t = np.linspace(0.0, 1.0, 9)
    return [*found, [demonstrations.through(t[:n], t[:n, None]).k for n in range(2, 10)]]


for more in varied.CASES:
    KEPT.case(more)


@pytest.mark.sweep(kept=15)
@pytest.mark.slow
@pytest.mark.parametrize("name", KEPT.cases)
def test_results_are_those_that_were_kept(name):
    KEPT.check(name)
