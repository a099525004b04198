"""A landing on springs of known stiffness and delay, and on what is none."""

import numpy as np
import pytest

from dmpcli.admittance.force_law import LawState
from dmpcli.control.guarded_motion import sinking, towards
from dmpcli.control.landing import Landing

PERIOD, SPEED, PRESSING, LAG = 0.02, 2.0, 10.0, 0.1


def landed(force_of, wanted=5.0, touched=((0.0, 0.0), (0.04, 0.08)), late=0, cycles=400):
    """Land, with a force that is a function of depth, mm, some cycles before."""
    landing = Landing(wanted, SPEED, PRESSING, LAG, PERIOD, list(touched))
    state, depths, forces = LawState(-touched[-1][0], -SPEED), [touched[-1][0]] * (late + 1), []
    for _ in range(cycles):
        forces.append(force_of(depths[-1 - late]))
        state = landing.step(state, forces[-1])
        depths.append(-state.e)
        if landing.found is not None or landing.failure:
            break
    return landing, depths[late:], forces


@pytest.mark.parametrize("late", [0, 1, 3])
@pytest.mark.parametrize("stiffness", [0.5, 2.0, 12.0])
def test_a_spring_is_measured_with_its_delay(stiffness, late):
    landing, _, _ = landed(lambda depth: stiffness * depth, late=late)
    assert landing.found.stiffness == pytest.approx(stiffness, rel=1e-9)
    assert landing.found.delay == pytest.approx(late * PERIOD, abs=1e-9)
    assert landing.failure == ""
    assert landing.resting


def test_the_way_in_ends_at_about_a_third_of_the_force_and_both_rests_last_as_long():
    _, depths, forces = landed(lambda depth: 2.0 * depth)
    first = next(i for i, force in enumerate(forces) if force >= 0.35 * 5.0)
    # Rests there for the lag and the mean, then presses by 0.8 of what is missing.
    rest = depths.count(depths[first])
    assert rest == pytest.approx((LAG + 0.12) / PERIOD + 2.0, abs=1.01)
    assert depths[first : first + rest] == [depths[first]] * rest
    assert depths.count(depths[-1]) == pytest.approx(rest, abs=1.01)
    assert depths[-1] - depths[first] == pytest.approx(0.8 * (5.0 - forces[first]) / 2.0)
    assert max(forces) < 5.0


def test_one_that_is_pressed_far_enough_already_backs_off():
    landing, depths, forces = landed(
        lambda depth: 60.0 * depth, touched=[(0.0, 0.0), (0.02, 1.2), (0.06, 3.6)]
    )
    assert forces[0] == pytest.approx(3.6)
    assert depths[-1] < depths[1]
    # Back by 0.8 of 0.55 of what it felt there.
    assert depths[1] - depths[-1] == pytest.approx(0.8 * 0.55 * 3.6 / 60.0, rel=1e-6)
    assert landing.found.stiffness == pytest.approx(60.0)


@pytest.mark.parametrize(("share", "backs"), [(0.54, False), (0.56, True)])
def test_it_backs_off_where_less_than_45_per_cent_of_the_force_are_missing(share, backs):
    def force(depth):
        return share * 5.0 + 5.0 * (depth - 0.1)

    touched = [(0.0, force(0.0)), (0.05, force(0.05)), (0.1, share * 5.0)]
    landing, depths, _ = landed(force, touched=touched)
    assert (depths[-1] < 0.1) == backs
    assert landing.found.stiffness == pytest.approx(5.0)


@pytest.mark.parametrize(("slope", "fails"), [(0.049, True), (0.051, False)])
def test_a_force_that_hardly_rises_is_no_contact_after_two_millimetres(slope, fails):
    landing, depths, _ = landed(lambda depth: slope * depth, wanted=1.0, touched=((0.0, 0.0),))
    if not fails:
        assert landing.found.stiffness == pytest.approx(slope)
        return
    assert "do not rise over 2.0 mm" in landing.failure
    # Told at the first cycle that lies deeper, and not before.
    deep = [depth for depth in depths[:-1] if depth > 2.0]
    assert len(deep) == 1


def test_an_offset_that_does_not_rise_between_two_rests_is_no_contact():
    landing, _, _ = landed(lambda depth: min(2.0 * depth, 1.8), touched=((0.0, 0.0), (0.5, 1.0)))
    assert "do not change over" in landing.failure
    flat, _, _ = landed(lambda depth: 2.0, touched=((0.0, 2.0), (0.04, 2.0)))
    assert flat.failure.startswith("2.00 N that do not rise over 2.0 mm")


@pytest.mark.parametrize(("noise", "rise"), [(0.0, 0.35), (0.05, 0.35), (0.08, 0.56), (1.0, 2.0)])
def test_the_way_in_goes_on_until_the_force_has_risen_beyond_its_noise(noise, rise):
    """By 0.35 N or seven deviations, but by no more than 0.4 of the set-point."""
    landing = Landing(5.0, SPEED, PRESSING, LAG, PERIOD, [(0.0, 3.0), (0.01, 3.0)], noise)
    felt = 3.0
    while not landing.resting:
        felt += 0.02
        landing.step(LawState(-felt), felt)
    assert felt - 3.0 == pytest.approx(rise, abs=0.02 + 1e-9)


@pytest.mark.slow
def test_a_soft_contact_is_pressed_by_twenty_millimetres_at_the_most():
    _, depths, _ = landed(lambda depth: 0.06 * depth, wanted=9.0, cycles=9000)
    rest = next(i for i in range(2, len(depths)) if depths[i] == depths[i - 1])
    assert depths[-1] - depths[rest] == pytest.approx(20.0)


def test_a_way_goes_from_and_to_rest_by_the_acceleration_and_stops_at_its_goal():
    """200 mm/s²: 4 mm/s more each period, and never faster than it can stop in what is left."""
    state, speeds = LawState(0.0), []
    for _ in range(200):
        before = state.e
        state, there = towards(state, 3.0, 10.0, PERIOD)
        speeds.append((state.e - before) / PERIOD)
        if there:
            break
    assert state == LawState(3.0)
    assert speeds[:4] == pytest.approx([4.0, 8.0, 10.0, 10.0])
    assert max(speeds) == pytest.approx(10.0)
    for speed, left in zip(speeds, 3.0 - 0.02 * np.cumsum([0.0, *speeds]), strict=False):
        assert speed <= (2.0 * 200.0 * left) ** 0.5 + 1e-9
    back, there = towards(LawState(2.0, 0.5), -1.0, 10.0, PERIOD)
    assert (back.speed, there) == (pytest.approx(-4.5), False)
    assert towards(LawState(1.0, 3.0), 1.0, 10.0, PERIOD) == (LawState(1.0), True)


def test_sinking_speeds_up_to_its_speed_and_turns_at_once():
    state = sinking(LawState(1.0, 5.0), 7.0, PERIOD)
    assert (state.speed, state.e) == (-4.0, pytest.approx(0.92))
    state = sinking(state, 7.0, PERIOD)
    assert (state.speed, state.e) == (-7.0, pytest.approx(0.78))


@pytest.mark.parametrize(("left", "there"), [(np.nextafter(1e-9, 0.0), True), (1e-9, False)])
def test_a_way_that_stands_still_is_at_its_goal_within_a_millionth_of_a_micrometre(left, there):
    assert towards(LawState(0.0), left, 0.0, 0.02)[1] is there
