"""The law of several hands: it runs on over rests, and its nodes are apart in time."""

import numpy as np
import pytest

from dmpcli.dmp import arc_length, common_timing
from dmpcli.dmp.path_registration import Correspondence

U = np.linspace(0.0, 1.0, 201)


def resting(seconds=4.0):
    """A hand that slows down to rest in the middle of 100 mm and speeds up again."""
    speed = 100.0 * np.abs(U - 0.5)
    t = seconds * U
    s = np.r_[0.0, np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(t))]
    return arc_length.monotone(t, s, speed)


def test_a_hand_that_rested_goes_through_there_as_fast_as_beside():
    law = resting()
    found = common_timing.running_on(law, [0.5])
    share = law.s / law.length
    near = np.abs(share - 0.5) < 0.02
    usual = np.mean(np.interp([0.44, 0.56], share, law.speed))
    np.testing.assert_allclose(found.speed[near], usual)
    np.testing.assert_allclose(
        np.diff(found.t)[near[1:] & near[:-1]], np.diff(law.s)[near[1:] & near[:-1]] / usual
    )
    far = np.abs(share - 0.5) > 0.061
    np.testing.assert_allclose(found.speed[far], law.speed[far])
    np.testing.assert_array_equal(found.s, law.s)
    assert found.duration < law.duration
    assert common_timing.running_on(law, []) is law


def test_what_rests_beside_a_place_too_is_left_as_it_is():
    s = np.array([0.0, 50.0, 50.0, 100.0])
    law = arc_length.monotone(np.array([0.0, 1.0, 3.0, 4.0]), s, np.zeros(4))
    assert common_timing.running_on(law, [0.5]).duration == pytest.approx(4.0)


def test_nodes_nearer_in_time_than_can_be_told_are_one_and_the_last_stays():
    """Half of the path within the last ten billionth of the time."""
    t = np.r_[np.linspace(0.0, 0.9, 599), 1.0 - 1e-10, 1.0]
    s = np.r_[np.linspace(0.0, 50.0, 599), 50.5, 100.0]
    law = arc_length.monotone(t, s, np.full(601, 50.0))
    found = common_timing.mean_law([law], [Correspondence()], 60)
    assert found.t[-1] == pytest.approx(1.0, abs=1e-12)
    assert found.s[-1] == 1.0
    assert (found.t[0], found.s[0]) == (0.0, 0.0)
    assert np.diff(found.t).min() > 1e-9
    assert (np.diff(found.s) > 0.0).all()


def test_the_common_law_of_one_hand_is_its_own_by_parts_of_the_length():
    law = resting()
    found = common_timing.mean_law([law, law], [Correspondence()] * 2, 500)
    t = np.linspace(0.0, 4.0, 50)
    np.testing.assert_allclose(found.place(t)[0], law.place(t)[0] / law.length, atol=1e-4)
    assert found.duration == pytest.approx(4.0)


def test_places_come_at_the_mean_of_the_times_at_which_the_hands_are_there():
    even = arc_length.monotone(2.0 * U, 80.0 * U, np.full(201, 40.0))
    late = arc_length.monotone(6.0 * U, 50.0 * U**2, 50.0 * U / 3.0)
    found = common_timing.mean_law([even, late], [Correspondence()] * 2, 800)
    assert found.duration == pytest.approx(4.0)
    place = np.linspace(0.05, 0.95, 19)
    when = 0.5 * (place + np.sqrt(place))
    np.testing.assert_allclose(found.time(place), 4.0 * when, atol=1e-3)
