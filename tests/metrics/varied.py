"""Strokes and numbers of many kinds, in counts that all differ: cases of `test_kept`."""

from collections.abc import Callable

import numpy as np

from dmpcli.metrics import (
    deviation,
    many_on_surface,
    motion,
    on_surface,
    pose_error,
    timing,
    wave_height,
)
from dmpcli.spatial import rotations
from dmpcli.spatial.trajectory import Trajectory
from dmpcli.surfaces.sphere import Sphere

CASES: list[Callable] = []


def case(make):
    CASES.append(make)
    return make


def strokes(rng, count, samples):
    """Curves of chance, some with rests and some that come near themselves again, (B, n, 3)."""
    s = np.linspace(0.0, 1.0, samples)
    made = []
    for k in range(count):
        a = rng.uniform(2.0, 9.0) * (
            np.interp(s, [0, 0.4, 0.5, 1], [0, 0.5, 0.5, 1]) if k % 2 else s
        )
        x = np.stack([rng.uniform(5, 90) * s, 9 * np.sin(a), rng.uniform(0, 3) * np.cos(a)], -1)
        made.append(x + rng.choice([0.0, 0.05, 0.6]) * rng.normal(size=x.shape))
    return np.array(made)


@case
def waves_of_chance():
    rng = np.random.default_rng(1)
    found: list = []
    for samples in (2, 3, 7, 40, 90):
        v = strokes(rng, 5, samples)[..., 1]
        v[1] = np.round(v[1])
        v[2] = 0.01 * v[2]
        closed = np.array([False, True, False, False, False])
        for share in (0.02, 0.3, 0.9):
            many = wave_height.many_waves(v, np.full(5, 60.0), closed, share)
            found += [many, many.ends, many.heights, many.mean, many.spread]
            found += [wave_height.wave_heights(x, share, 9.0) for x in v]
        least = np.full(5, 0.5)
        found += wave_height._without_ripple(v, least, *wave_height._corners(v))
        found += wave_height._turning_points(v, least)
        found.append(wave_height._next_moves(np.sign(np.diff(v))))
    return found


@case
def corners_of_level_signals():
    rng = np.random.default_rng(2)
    found: list = []
    for _ in range(8):
        v = np.cumsum(rng.integers(-1, 2, (3, 25)), axis=1).astype(float)
        found += [*wave_height._corners(v), *wave_height._turning_points(v, np.array([1.0, 2, 3]))]
    return found


@case
def motions_of_chance():
    rng = np.random.default_rng(3)
    found: list = []
    for samples, step in ((5, 0.1), (17, 1 / 16), (33, 0.02), (120, 0.01)):
        x = strokes(rng, 4, samples)
        x[3] = x[3, 0]
        t = 3.0 + step * np.arange(samples)
        bent = t + 0.3 * step * np.sin(np.arange(samples))
        p = x.transpose(2, 0, 1)
        for at in (t, bent):
            found.append(motion.motions(at, p, x[:, 1], x[:, -2]))
            found += [motion._even(at, p, cut) for cut in (None, 0.45 / step, 0.4 / step)]
            found += [
                motion.spectral_arc_length(at, p, cut) for cut in (0.5 / step, 0.2 / step, 1.0)
            ]
            found += [motion.log_dimensionless_jerk(at, p, cut) for cut in (None, 4.0)]
        found += [motion.path_length(x[0]), motion.path_length(x[1, :, :2])]
    return found


@case
def deviations_of_chance():
    rng = np.random.default_rng(4)
    found: list = []
    for corners, samples in ((2, 9), (12, 30), (90, 70)):
        place = strokes(rng, 1, corners)[0]
        taught = deviation.Taught(np.sort(rng.uniform(0, 9, corners)), place)
        for count in (1, 3, 4, 6):
            wide = rng.uniform(0.4, 2.0, count)
            x = strokes(rng, count, samples) + rng.choice([0.0, 3.0], (count, 1, 1))
            found.append(
                taught.deviations(np.linspace(0.0, 2.0, samples), x.transpose(2, 0, 1), wide)
            )
        found.append(deviation._clearance(place))
        points = x.transpose(2, 0, 1)[:, 0]
        corner = rng.integers(0, corners, samples)
        near = 5.0 + rng.random(samples)
        some = np.full(samples, 1.3)
        found.append(taught._reach(points, corner, near, some))
        found += taught._shifted(points, some, corner, near)
        for reach in (1, 4):
            found += [taught._within(points, some, corner, reach)]
    return found


@case
def heights_of_many_over_a_surface():
    rng = np.random.default_rng(5)
    ball = Sphere(np.array([0.0, 0.0, -90.0]), 90.0)
    found: list = []
    for corners, samples in ((2, 5), (30, 17), (60, 40)):
        place = strokes(rng, 1, corners)[0]
        taught = many_on_surface.TaughtHeights(np.linspace(0.0, 1.0, corners), place)
        x = strokes(rng, 3, samples)
        wide = np.array([0.5, 1.0, 1.7])
        found.append(taught.at(np.linspace(0.0, 1.0, samples), x.transpose(2, 0, 1)[:2], wide))
        found.append(taught._clear)
        at = ball.closest(x)
        found.append(many_on_surface.heights(x, at.position, at.normal))
        found.append(many_on_surface.tilts(rotations.exp(0.1 * x)[..., 2], at.normal))
        found.append(many_on_surface.path_lengths(x))
        found.append(many_on_surface.stretched_lengths(place[:, :2], wide))
        for one in x:
            found += [on_surface.height_there(one[:, :2], place)]
            found += [on_surface.contact(one, one[:, 2], band) for band in (0.0, 0.7, 9.0)]
            found += [on_surface.stretch(one, one[:, :2], pieces) for pieces in (1, 6, 100)]
    return found


@case
def poses_paired_and_aligned():
    rng = np.random.default_rng(6)
    found: list = []
    for n, m, most in ((9, 4, 0.01), (4, 9, 0.02), (30, 23, 0.004), (1, 5, 0.5)):
        a, b = np.sort(rng.uniform(0, 0.4, n)), np.sort(rng.uniform(0.05, 0.5, m))
        found += [pose_error.associate(a, b, most), pose_error._nearest(a, b, most)]
    for count in (2, 3, 7):
        x, y = rng.normal(size=(2, count, 3))
        for scaled in (True, False):
            fit = pose_error.alignment(x, y * [1, 1, -1], scaled)
            found += [] if fit is None else [fit.scale, fit.pose.position, fit.pose.rotation]
        R = rotations.exp(rng.normal(size=(2, count, 3)))
        t = np.arange(float(count))
        for turned in ((R[0], R[1]), (R[0], None), (None, None)):
            one, two = Trajectory(t, x, turned[0]), Trajectory(t, y, turned[1])
            found += [pose_error.absolute(one, two), pose_error.relative(one, two)]
    return found


@case
def loops_that_are_late():
    found: list = []
    deadline = np.r_[0.0, 0.02, 0.04, 0.1, 0.12, 0.16]
    for late in (np.zeros(6), 0.01 * np.arange(6.0), np.r_[np.zeros(5), 0.3]):
        found += [timing.punctuality(deadline, late, 0.02), timing.spread(late)]
    return found
