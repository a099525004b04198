"""Laws of arc length by time: scipy's Hermite splines and quadrature are the oracles."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.interpolate import CubicHermiteSpline, make_interp_spline

from dmpcli.dmp.arc_length import TimeLaw, monotone, of_path
from dmpcli.dmp.common_timing import mean_law, running_on
from dmpcli.dmp.path_registration import Correspondence
from tests.minimum_jerk import minimum_jerk

T = np.array([0.0, 0.5, 0.8, 2.0, 2.6])
S = np.array([0.0, 4.0, 5.0, 5.0, 11.0])
SPEED = np.array([6.0, 5.0, 0.0, 0.0, 14.0])


def test_place_and_speed_are_those_of_the_hermite_spline_and_time_is_its_inverse():
    law, spline = TimeLaw(T, S, SPEED), CubicHermiteSpline(T, S, SPEED)
    assert (law.length, law.duration) == (11.0, 2.6)
    t = np.linspace(0.0, 2.6, 301)
    place, speed = law.place(t)
    assert place == pytest.approx(spline(t), abs=1e-12)
    assert speed == pytest.approx(spline(t, 1), abs=1e-10)
    s = np.linspace(0.0, 11.0, 211)
    again, _ = law.place(law.time(s))
    assert again == pytest.approx(s, abs=1e-9)
    moving = (t < 0.8) | (t > 2.0)
    assert law.time(place[moving]) == pytest.approx(t[moving], abs=1e-4)
    # While it stands still, the earliest time; beyond its ends, the ends'.
    assert law.time(np.array([5.0, -1.0, 12.0])) == pytest.approx([0.8, 0.0, 2.6], abs=1e-6)


def test_slopes_beyond_three_chords_are_held_so_that_nothing_turns_back():
    rng = np.random.default_rng(4)
    for _ in range(30):
        t = np.cumsum(rng.uniform(0.1, 1.0, 12))
        s = np.cumsum(rng.uniform(0.0, 1.0, 12) * (rng.uniform(size=12) > 0.2))
        wild = rng.normal(0.0, 10.0, 12)
        law = monotone(t, s, wild)
        chord = np.diff(s) / np.diff(t)
        most = 3.0 * np.array([min(chord[max(i - 1, 0) : i + 1]) for i in range(12)])
        assert law.speed == pytest.approx(np.minimum(np.maximum(wild, 0.0), most))
        assert (np.diff(law.place(np.linspace(t[0], t[-1], 500))[0]) >= -1e-12).all()


def test_the_length_of_a_path_is_that_of_quadrature():
    t = np.linspace(0.0, 3.0, 40)
    points = np.stack([20 * np.cos(t), 20 * np.sin(t), 5 * t**2], axis=1)
    path = make_interp_spline(t, points, k=5)
    law = of_path(path, np.linspace(0.0, 3.0, 201))
    for at in (0.5, 1.7, 3.0):
        expected = quad(lambda x: np.linalg.norm(path(x, 1)), 0.0, at, epsabs=1e-11)[0]
        place, speed = law.place(np.array([at]))
        assert place[0] == pytest.approx(expected, abs=1e-5)
        assert speed[0] == pytest.approx(np.linalg.norm(path(at, 1)), rel=1e-3)


def reach(duration, power=1.0, length=80.0, n=401):
    """A minimum-jerk reach whose time runs unevenly; ``t`` even, from 0."""
    u = np.linspace(0.0, 1.0, n)
    s = length * minimum_jerk(u**power)
    t = duration * u
    return monotone(t, s, np.gradient(s, t))


def test_the_mean_law_is_at_each_place_when_the_demonstrations_are_in_the_mean():
    laws = [reach(4.0), reach(6.0, 1.3, 95.0), reach(2.0, 0.8, 60.0)]
    same = [Correspondence()] * 3
    mean = mean_law(laws, same, 500)
    assert mean.duration == pytest.approx(4.0)
    assert mean.length == pytest.approx(1.0)
    place = np.linspace(0.02, 0.98, 40)
    share = np.mean([law.time(law.length * place) / law.duration for law in laws], axis=0)
    assert mean.time(place) == pytest.approx(4.0 * share, abs=2e-4)
    # Its slope too: slowness is the mean slowness.
    at = mean.time(place)
    slow = [law.length / law.place(law.time(law.length * place))[1] / law.duration for law in laws]
    assert mean.place(at)[1] == pytest.approx(1.0 / (4.0 * np.mean(slow, axis=0)), rel=5e-3)


def test_the_mean_of_one_law_is_that_law():
    law = reach(3.0, 1.2)
    mean = mean_law([law], [Correspondence()], 400)
    t = np.linspace(0.0, 3.0, 50)
    assert law.length * mean.place(t)[0] == pytest.approx(law.place(t)[0], abs=2e-3)


def test_places_are_held_together_where_they_are_pinned():
    pinned = Correspondence().pinned({0.3: 0.5, 0.8: 0.9, 0.6: 0.2})
    assert pinned(np.array([0.0, 0.3, 0.8, 1.0])) == pytest.approx([0.0, 0.5, 0.9, 1.0])
    place = np.linspace(0.0, 1.0, 101)
    assert (np.diff(pinned(place)) > 0.0).all()
    assert pinned.inverse(pinned(place)) == pytest.approx(place, abs=1e-5)
    h = 1e-6
    steep = (pinned(place[1:-1] + h) - pinned(place[1:-1] - h)) / (2 * h)
    assert pinned.slope(place[1:-1]) == pytest.approx(steep, rel=1e-3, abs=1e-4)
    assert pinned.deviation() == pytest.approx(np.abs(pinned(place) - place).max(), abs=1e-3)
    assert not pinned.straight
    # One that is out of order alone leaves the identity, as do places at the ends.
    assert Correspondence().straight
    assert Correspondence().pinned({1.0: 0.5}).straight
    assert Correspondence().deviation() == 0.0
    assert Correspondence().slope(place).tolist() == [1.0] * 101
    t = np.linspace(0.0, 2.0, 201)
    even = [monotone(t, 50.0 * t, np.full(201, 50.0))] * 2
    both = mean_law(even, [Correspondence(), pinned], 400)
    expected = 2.0 * np.mean([place, pinned(place)], axis=0)
    assert both.time(place) == pytest.approx(expected, abs=1e-4)


def test_a_hand_that_slows_down_somewhere_runs_on_with_the_speed_beside():
    t = np.linspace(0.0, 4.0, 801)
    speed = 30.0 * (1.0 - 0.95 * np.exp(-(((t - 2.0) / 0.05) ** 2)))
    s = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(t))])
    law = monotone(t, s, speed)
    assert running_on(law, []) is law
    on = running_on(law, [0.5])
    assert np.array_equal(on.s, law.s)
    assert on.length == law.length
    # All of it at 30 mm/s, but for what little is left at the rims of the slow stretch.
    assert on.duration == pytest.approx(law.length / 30.0, rel=2e-3)
    assert on.speed == pytest.approx(np.full(801, 30.0), rel=0.05)
    even = monotone(t, 30.0 * t, np.full(801, 30.0))
    same = running_on(even, [0.2, 0.9])
    assert same.t == pytest.approx(even.t)
    assert same.speed == pytest.approx(even.speed)
    elsewhere = running_on(law, [0.2])
    assert elsewhere.duration == pytest.approx(law.duration, abs=1e-3)
