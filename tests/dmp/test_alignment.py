"""Several demonstrations at common times: truths in closed form."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dmpcli.dmp import smoothing
from dmpcli.dmp.alignment import ComparedPath, align
from dmpcli.errors import InputError
from tests.human_strokes import strokes
from tests.nearest import nearest_rms

FINE = np.linspace(0.0, 1.0, 20001)


def wave(u, length=300.0, height=50.0):
    """Points of one sine wave at parts u of its length along x."""
    return np.stack([length * u, 0.5 * height * np.sin(2 * np.pi * u), 0 * u], axis=-1)


def jerk(r):
    r = np.clip(r, 0.0, 1.0)
    return r**3 * (10.0 - 15.0 * r + 6.0 * r**2)


def drawn(law, duration, rate=100.0, path=wave, **more):
    t = np.linspace(0.0, 1.0, round(duration * rate) + 1)
    return ComparedPath(duration, path(law(t)), **more)


def hesitating(r):
    return np.where(
        r < 0.4,
        0.4 * jerk(r / 0.4),
        np.where(r < 0.65, 0.4, 0.4 + 0.6 * jerk((r - 0.65) / 0.35)),
    )


def timings():
    """One wave with four time laws: the last rests from 3.2 to 5.2 s of 8."""
    laws = [jerk, lambda r: jerk(r**1.6), lambda r: jerk(r**0.6), hesitating]
    return [drawn(law, T) for law, T in zip(laws, [6.0, 6.0, 6.0, 8.0], strict=True)]


def length(x):
    return float(np.sum(np.linalg.norm(np.diff(x, axis=0), axis=1)))


def peak_acceleration(x, duration):
    second = np.diff(x, 2, axis=-2) / (duration / (x.shape[-2] - 1)) ** 2
    return float(np.max(np.linalg.norm(second, axis=-1)))


def test_one_path_with_four_timings_is_that_path():
    found = align(timings())
    assert np.ptp(found.mean[:, 1]) == pytest.approx(50.0, abs=0.01)
    assert nearest_rms(found.mean, wave(FINE)) < 1e-3
    assert np.max(found.spread) < 1e-3
    assert found.doubts == ()
    assert not np.any(found.deviations)


def test_equal_parts_of_the_duration_would_flatten_it():
    assert np.ptp(align(timings(), "time").mean[:, 1]) < 35.0


def test_a_pause_of_one_in_four_is_left_out_and_told():
    found = align(timings())
    (rest,) = found.rests
    assert (rest.index, rest.left_out) == (3, True)
    assert rest.start == pytest.approx(3.2, abs=0.15)
    assert rest.end == pytest.approx(5.2, abs=0.15)
    assert found.duration < 6.2
    # Nobody slows down where only one rested.
    there = int(np.argmin(np.abs(found.mean[:, 0] - 120.0)))
    speed = np.linalg.norm(np.gradient(found.mean, found.grid, axis=0), axis=1)
    assert speed[there] > 0.8 * np.median(speed)
    own = max(peak_acceleration(d.x, d.duration) for d in timings())
    assert peak_acceleration(found.x, found.duration) < 1.3 * own


def test_a_pause_of_most_is_kept():
    even, _, _, pausing = timings()
    found = align([pausing, even, pausing])
    assert [rest.left_out for rest in found.rests] == [False, False]
    still = np.linalg.norm(np.diff(found.mean, axis=0), axis=1) < 1e-6
    assert found.grid[1] * np.sum(still) > 0.4 * 2.0
    assert nearest_rms(found.mean, wave(FINE)) < 1e-3
    assert peak_acceleration(found.x, found.duration) < 1.3 * peak_acceleration(
        pausing.x, pausing.duration
    )


def stopping(*places):
    """A wave at constant pace with a rest of 0.8 s at each of some places, easing in and out."""
    bounds = [0.0, *places, 1.0]
    parts = []
    for a, b in pairwise(bounds):
        moving = a + (b - a) * jerk(np.linspace(0.0, 1.0, round(60 + 300 * (b - a))))
        parts += [moving, np.full(80, b)]
    u = np.concatenate(parts[:-1])
    return ComparedPath((len(u) - 1) / 100.0, wave(u))


def test_rests_that_follow_each_other_closely_are_not_one():
    found = align([stopping(0.3, 0.35), stopping(0.325, 0.7), stopping(0.5, 0.9)])
    assert nearest_rms(found.mean, wave(FINE)) < 0.05
    assert np.ptp(found.mean[:, 1]) == pytest.approx(50.0, abs=0.1)
    assert len(found.rests) == 6
    assert max(rest.end - rest.start for rest in found.rests) < 1.2


def test_a_tool_that_turns_in_place_is_no_pause_to_leave_out():
    pausing = timings()[3]
    r = np.linspace(0.0, 1.0, len(pausing.x))
    turned = np.stack([jerk((r - 0.42) / 0.2)], axis=1)
    others = [
        ComparedPath(d.duration, d.x, angles=np.full((len(d.x), 1), 0.5)) for d in timings()[:3]
    ]
    found = align([ComparedPath(8.0, pausing.x, angles=turned), *others])
    assert [rest.left_out for rest in found.rests] == [False]
    assert found.angles is not None
    steps = np.abs(np.diff(found.angles[0, :, 0]))
    assert np.max(steps) < 0.03
    assert found.angles[0, -1, 0] == pytest.approx(1.0, abs=1e-6)


def test_times_lead_from_end_to_end_and_never_back():
    for how in ("none", "time", "path"):
        demonstrations = timings()
        found = align(demonstrations, how)
        assert found.times.shape == (4, 801)
        assert np.all(np.diff(found.times, axis=1) >= 0.0)
        np.testing.assert_allclose(found.times[:, 0], 0.0)
        np.testing.assert_allclose(found.times[:, -1], [6.0, 6.0, 6.0, 8.0], atol=1e-9)


def test_seconds_as_recorded_rest_at_the_goal():
    found = align([drawn(jerk, 6.0), drawn(jerk, 8.0)], "none")
    assert found.duration == 8.0
    np.testing.assert_array_equal(found.times[0], np.minimum(found.grid, 6.0))
    np.testing.assert_allclose(found.x[0, -1], [300.0, 0.0, 0.0], atol=1e-9)


def test_one_alone_stays_to_the_last_bit():
    d = timings()[3]
    found = align([d])
    np.testing.assert_array_equal(found.x[0], d.x)
    np.testing.assert_array_equal(found.times[0], found.grid)
    assert found.rests == ()
    assert found.duration == d.duration


def scattered(seed, n=3, loops=False):
    """Waves with timings, slow changes of shape and, if asked, of local length; smooth."""
    rng = np.random.default_rng(seed)
    result = []
    for _ in range(n):
        a, b, c = rng.uniform(-1.0, 1.0, 3)

        def path(u, a=a, b=b, c=c):
            x = wave(u)
            x[:, 1] += 3.0 * np.sin(np.pi * u) * (a + b * np.cos(3 * np.pi * u))
            x[:, 2] += 2.0 * c * np.sin(2 * np.pi * u)
            if loops:
                x[:, 1] += 12.0 * a * np.exp(-(((u - 0.6) / 0.08) ** 2))
            return x

        power = rng.uniform(0.7, 1.4)
        result.append(drawn(lambda r, p=power: jerk(r**p), rng.uniform(4.0, 8.0), path=path))
    return result


@pytest.mark.slow
@given(st.integers(0, 10_000), st.permutations(range(4)))
@settings(max_examples=6, deadline=None)
def test_the_order_of_demonstrations_changes_nothing(seed, order):
    demonstrations = scattered(seed, 4, loops=True)
    found = align(demonstrations)
    other = align([demonstrations[i] for i in order])
    np.testing.assert_allclose(other.x, found.x[list(order)], atol=1e-9)
    np.testing.assert_allclose(other.spread, found.spread, atol=1e-9)
    assert other.duration == pytest.approx(found.duration, abs=1e-12)


@pytest.mark.slow
@given(st.integers(0, 10_000))
@settings(max_examples=5, deadline=None)
def test_each_demonstration_twice_changes_nothing(seed):
    demonstrations = scattered(seed, 3, loops=True)
    found, twice = align(demonstrations), align(demonstrations * 2)
    np.testing.assert_allclose(twice.x[3:], found.x, atol=1e-9)
    np.testing.assert_allclose(twice.spread, found.spread, atol=1e-9)
    assert {d.index % 3 for d in twice.doubts} == {d.index for d in found.doubts}


@pytest.mark.slow
@given(st.lists(st.tuples(st.floats(0.6, 1.7), st.floats(-0.9, 0.9)), min_size=2, max_size=4))
@settings(max_examples=5, deadline=None)
def test_time_laws_of_one_path_align_to_that_path(laws):
    def law(power, lean):
        return lambda r: jerk((r + lean * np.sin(np.pi * r) / np.pi) ** power)

    demonstrations = [
        drawn(law(power, 0.9 * lean), 5.0 + i) for i, (power, lean) in enumerate(laws)
    ]
    found = align(demonstrations)
    assert nearest_rms(found.mean, wave(FINE)) < 0.05
    assert np.max(found.distances) < 0.05
    assert found.doubts == ()


def looped(second):
    """A line with two loops of radius 20 mm and `second`; also where each fifth of it ends."""

    def loop(x0, radius):
        a = np.linspace(0.0, 2 * np.pi, 800)
        return np.stack([x0 + radius * np.sin(a), radius * (1 - np.cos(a)), 0 * a], axis=1)

    def line(x0, x1):
        return np.linspace([x0, 0.0, 0.0], [x1, 0.0, 0.0], 400)

    parts = [line(0, 60), loop(60, 20), line(60, 120), loop(120, second), line(120, 180)]
    points = np.concatenate([parts[0], *(part[1:] for part in parts[1:])])
    ends = np.cumsum([length(part) for part in parts])
    s = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))

    def path(u):
        return np.stack([np.interp(u * s[-1], s, points[:, i]) for i in range(3)], axis=1)

    return path, ends / ends[-1]


def test_features_meet_where_one_loop_is_larger():
    paths = [looped(20.0), looped(30.0)]
    found = align([drawn(lambda r: r, 8.0, path=path) for path, _ in paths])
    assert np.all(found.deviations > 0.02)
    # At constant speed, time tells the place: the ends of the parts are reached together.
    reached = [
        np.interp(8.0 * ends, t, found.grid)
        for t, (_, ends) in zip(found.times, paths, strict=True)
    ]
    assert np.max(np.abs(reached[0] - reached[1])) < 0.01 * found.duration
    without = [8.0 * ends for _, ends in paths]
    assert np.max(np.abs(without[0] - without[1])) > 0.05 * 8.0
    # The mean has a loop of 25 mm, and is not jagged.
    mean = 180.0 + 2 * np.pi * (20.0 + 25.0)
    assert length(found.mean) == pytest.approx(mean, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("shape", ["Sine", "WShape", "heee", "Leaf_2"])
def test_human_strokes_keep_their_length(shape):
    demonstrations = []
    for stroke in strokes(shape):
        even = smoothing.evenly_sampled(stroke)
        rate = (len(even.t) - 1) / even.duration
        x = smoothing.low_pass(even.position, rate, 40.0 / even.duration)
        demonstrations.append(ComparedPath(even.duration, x - x[-1]))
    found = align(demonstrations)
    mean = np.mean([length(d.x) for d in demonstrations])
    assert length(found.mean) == pytest.approx(mean, rel=0.012)
    assert found.doubts == ()


def test_noise_smoothed_first_leaves_the_wave():
    rng = np.random.default_rng(4)
    demonstrations = []
    for d in timings():
        noisy = d.x + rng.normal(0.0, 0.3, d.x.shape)
        x = smoothing.low_pass(noisy, 100.0, 2.5)
        demonstrations.append(ComparedPath(d.duration, x, noise=0.07))
    found = align(demonstrations)
    assert np.ptp(found.mean[:, 1]) == pytest.approx(50.0, abs=0.2)
    assert nearest_rms(found.mean, wave(FINE)) < 0.1
    assert [rest.left_out for rest in found.rests] == [True]
    assert found.doubts == ()


def test_spread_is_that_of_the_paths():
    def at_height(height):
        return lambda u: wave(u) + np.array([0.0, 0.0, height]) * np.sin(np.pi * u)[:, None]

    found = align([drawn(jerk, 6.0, path=at_height(h)) for h in (-1.0, 0.0, 1.0)])
    half = int(np.argmin(np.abs(found.mean[:, 0] - 150.0)))
    assert found.spread[half, 2] == pytest.approx(np.sqrt(2 / 3), abs=1e-3)
    assert found.distances[0] == pytest.approx(
        1.5 * np.sqrt(np.mean(found.x[0, :, 2] ** 2)), rel=1e-3
    )


@pytest.mark.parametrize("n", [3, 4, 6])
def test_an_outlier_is_named_with_its_distance(n):
    def higher(u):
        return wave(u) + np.stack([0 * u, 0 * u, 25.0 * np.sin(np.pi * u)], axis=1)

    found = align([*scattered(3, n - 1), drawn(jerk, 6.0, path=higher)])
    (doubt,) = found.doubts
    assert (doubt.index, doubt.kind) == (n - 1, "outlier")
    assert doubt.distance == pytest.approx(found.distances[n - 1])
    assert doubt.distance > 12.0


@given(st.integers(0, 10_000), st.integers(2, 5))
@settings(max_examples=6, deadline=None)
def test_ordinary_scatter_makes_no_alarm(seed, n):
    assert align(scattered(seed, n)).doubts == ()


def test_the_opposite_direction_is_told_in_either_chart():
    def bump(u):
        return wave(u) + np.stack([0 * u, 30.0 * np.sin(np.pi * u) ** 2 * u, 0 * u], axis=1)

    forth = [drawn(jerk, T, path=bump) for T in (5.0, 6.0)]
    back = bump(1.0 - jerk(np.linspace(0.0, 1.0, 601)))
    in_own_chart = (back - back[0]) * [-1.0, -1.0, 1.0]
    for x in (back, in_own_chart):
        found = align([*forth, ComparedPath(6.0, x)])
        assert [(d.index, d.kind) for d in found.doubts] == [(2, "opposite")]


def test_another_shape_is_told_as_that():
    def arch(u):
        return np.stack([300.0 * u, 200.0 * np.sin(np.pi * u), 0 * u], axis=1)

    found = align([*scattered(1, 3), drawn(jerk, 6.0, path=arch)])
    assert [(d.index, d.kind) for d in found.doubts] == [(3, "shape")]


def test_another_start_on_a_closed_path_is_told():
    def pear(u, start=0.0):
        a = 2 * np.pi * (u + start)
        radius = 40.0 + 12.0 * np.cos(a) + 6.0 * np.sin(2 * a)
        x = np.stack([radius * np.cos(a), radius * np.sin(a), 0 * a], axis=1)
        return x - x[0]

    paths = [pear, pear, lambda u: pear(u, 0.3)]
    found = align([drawn(jerk, 5.0 + i, path=path) for i, path in enumerate(paths)])
    (doubt,) = found.doubts
    assert (doubt.index, doubt.kind) == (2, "start")
    assert 0.6 < doubt.shift < 0.8
    assert align([drawn(jerk, 5.0, path=pear), drawn(jerk, 6.0, path=pear)]).doubts == ()


def test_few_samples_are_enough():
    found = align([drawn(jerk, 6.0, rate=10.0 / 6.0), drawn(lambda r: jerk(r**1.2), 6.0)])
    assert nearest_rms(found.mean, wave(FINE)) < 1.5
    assert found.x.shape == (2, 601, 3)


def test_angles_come_along():
    def law(power):
        return lambda r: jerk(r**power)

    demonstrations = []
    for power in (0.8, 1.0, 1.3):
        d = drawn(law(power), 6.0)
        demonstrations.append(ComparedPath(6.0, d.x, angles=0.01 * d.x[:, :1]))
    found = align(demonstrations)
    assert found.angles is not None
    np.testing.assert_allclose(found.angles, 0.01 * found.x[..., :1], atol=1e-9)
    assert found.spread.shape == (601, 4)
    carried = found.tracks[2].carry(demonstrations[2].x)
    np.testing.assert_allclose(carried, found.x[2], atol=1e-9)


def test_what_does_not_move_is_refused():
    with pytest.raises(InputError, match="demonstration 2 does not move"):
        align([drawn(jerk, 6.0), ComparedPath(6.0, np.zeros((100, 3)))])


def test_common_times_do_not_jump():
    found = align(timings()[:3])
    for earlier, later in pairwise(np.diff(found.times, axis=1)[:, 1:].T):
        assert np.all(np.abs(later - earlier) < 0.05)
