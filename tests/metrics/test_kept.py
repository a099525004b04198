"""Measures of strokes of many kinds: results that are kept, see `tests/kept.py`."""

import numpy as np
import pytest

from dmpcli.metrics import (
    contact,
    deviation,
    motion,
    on_surface,
    paper_values,
    pose_error,
    timing,
    wave_height,
)
from dmpcli.spatial import rotations
from dmpcli.spatial.trajectory import Trajectory
from dmpcli.surfaces.plane import Plane
from dmpcli.surfaces.sphere import Sphere
from tests import cases, human_strokes
from tests.kept import Kept
from tests.metrics import varied
from tests.nearest import nearest_rms

KEPT = Kept(__file__)
U = cases.jerk(np.linspace(0.0, 1.0, 241))
T = np.linspace(0.0, 6.0, 241)


def strokes():
    """Strokes (B, 241, 3): waves of several periods, heights and noise; one that stands still."""
    rng = np.random.default_rng(2)
    made = [cases.wave(U, 300, h, p) for h, p in ((50, 1), (20, 2.5), (8, 4), (0.0, 1))]
    made += [made[0] + rng.normal(0, 0.4, (241, 3)), made[1] * [1, 1, 0] + [0, 0, 5]]
    made += [np.column_stack([40 * np.cos(9 * U), 30 * np.sin(9 * U), 6 * U])]
    return np.array(made)


@KEPT.case
def waves():
    found: list = []
    for x in strokes():
        for more in ({}, {"prominence": 0.3}, {"length": 300.0}):
            one = wave_height.wave_heights(x[:, 1], **more)
            found += [one, one.heights, one.mean, one.spread, one.at(np.array([0.0, 40.5, 240.0]))]
        found.append(
            wave_height.stroke_wave(x, x[0], x[-1] + [0, 0, 1e-3], np.array([0, 0.6, 0.8]))
        )
        found.append(on_surface.wave_along(x[:, :2], 300.0))
    return found


@KEPT.case
def waves_of_many():
    v = strokes()[..., 1]
    found: list = []
    for closed in (False, True):
        many = wave_height.many_waves(v, np.full(len(v), 300.0), np.full(len(v), closed))
        found += [many, many.ends, many.heights, many.mean, many.spread]
    joined = wave_height.ManyWaves.joined([wave_height.wave_heights(x) for x in v])
    return [*found, joined, joined.mean, joined.heights]


@KEPT.case
def motions():
    x = strokes().transpose(2, 0, 1)
    found: list = [motion.motions(T**1.2, x, x[:, :, 0].T + 0.1, x[:, :, -1].T - 0.2)]
    for cutoff in (4.0, 10.0, 30.0):
        found.append(motion.log_dimensionless_jerk(T, x, cutoff))
        found.append(motion.spectral_arc_length(T, x, cutoff))
    found.append(motion.log_dimensionless_jerk(T, x, None))
    for shape in human_strokes.shapes()[::9]:
        s = human_strokes.strokes(shape)[0]
        y = s.position.T[:, None]
        found += [
            motion.path_length(s.position),
            motion.spectral_arc_length(s.t, y),
            motion.log_dimensionless_jerk(s.t, y),
        ]
    return found


@KEPT.case
def deviations():
    found: list = []
    x = strokes()
    for other in (x[4], x[1], x[6]):
        found.append([deviation.nearest_distance(one, other) for one in x])
        found.append([nearest_rms(one, other) for one in x])
    taught = deviation.Taught(T, x[0])
    place = np.stack([x[k] * [1.1, 1, 1] for k in (0, 4, 1)]).transpose(2, 0, 1)
    found.append(taught.deviations(np.linspace(0, 6, 241), place, np.array([1.1, 1.0, 0.9])))
    return found


@KEPT.case
def strokes_over_surfaces():
    ball = Sphere(np.array([0.0, 0.0, -150.0]), 150.0)
    plate = Plane(np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.6, 0.8]))
    found: list = []
    R = rotations.from_euler(np.column_stack([np.pi + 0.1 * U, 0.2 * U, U]))
    for surface in (ball, plate):

        def closest(points, surface=surface):
            at = surface.closest(points)
            return at.position, at.normal

        for x in strokes()[[0, 4, 6]]:
            h = on_surface.height(x, closest)
            found += [
                on_surface.distance(x, closest),
                on_surface.distance(x, closest, 2.0),
                h,
                on_surface.contact(x, h, 4.0),
                on_surface.tilt(R, closest(x)[1]),
                on_surface.stretch(closest(x)[0], x[:, :2]),
            ]
    uv = strokes()[0]
    found.append(on_surface.height_there(uv[:, :2], np.column_stack([uv[:, :2], U])))
    return found


@KEPT.case
def errors_of_poses():
    rng = np.random.default_rng(3)
    s = np.linspace(0, 1, 120)
    position = np.column_stack([110 * s, 25 * np.sin(6 * s), 8 * s**2])
    rotation = rotations.exp(np.column_stack([0.4 * s, 0.3 * np.sin(3 * s), 0.2 + s]))
    a = Trajectory(0.02 * np.arange(120), position, rotation)
    R = rotations.exp(np.array([0.1, 0.2, -0.4]))
    b = Trajectory(a.t + 0.003, 1.1 * position @ R.T + rng.normal(0, 0.2, (120, 3)), R @ rotation)
    found: list = [pose_error.absolute(a, b), pose_error.relative(a, b)]
    for scaled in (False, True):
        fit = pose_error.alignment(a.position, b.position, scaled)
        found += [
            fit.scale,
            fit.pose.position,
            fit.pose.rotation,
            pose_error.absolute(a, fit.apply(b)),
        ]
    found += [pose_error.associate(a.t, b.t[::3]), pose_error.associate(a.t[::2], b.t[5::5], 0.004)]
    return [*found, pose_error.summary(np.abs(np.sin(np.arange(31.0))))]


@KEPT.case
def contacts_and_times():
    force = 3.0 + 3.0 * np.sin(np.arange(90.0))
    late = np.abs(np.sin(np.arange(80.0))) ** 6 * 0.05
    experiments = [
        [e.printed(r) for r in ("demonstration", "original", "modified")]
        for e in paper_values.EXPERIMENTS
    ]
    return [
        [contact.contact(force, f) for f in (0.0, 1.0, 5.0)],
        timing.spread(force),
        timing.punctuality(0.02 * np.arange(80), late, 0.02),
        experiments,
    ]


for more in varied.CASES:
    KEPT.case(more)


@pytest.mark.slow
@pytest.mark.parametrize("name", KEPT.cases)
def test_results_are_those_that_were_kept(name):
    KEPT.check(name)
