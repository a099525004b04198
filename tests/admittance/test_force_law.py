import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.admittance.contact_estimation import (
    RiseTest,
    delay_of_move,
    line,
    static_stiffness,
)
from dmpcli.admittance.force_coupling import fast_filter, follow
from dmpcli.admittance.force_law import (
    INTEGRAL_DELAYS,
    ForceGains,
    LawState,
    advance,
    by_rule,
)
from dmpcli.admittance.force_stability import (
    LAG,
    MARGIN,
    growth,
    is_safe,
    is_stable,
    steadied,
)
from dmpcli.admittance.oscillation import AlternationDetector
from tests.admittance.damping import smallest_damping
from tests.control.contact_plant import Plant

PERIOD = 0.02


def measured_delay(cycles):
    """Of a plant: filter of eq. (10), taken up evenly, mean of half a period, dead time, lag.

    The plant takes up a set-point a cycle after it came, and so many more.
    """
    filter_, delta, late = fast_filter(5.0, PERIOD), (0.0, 0.0), 0.0
    for _ in range(50):
        delta = follow(filter_, delta, 1.0)
        late += 1.0 - delta[0]
    return (late + 0.25 + 1.0 + cycles) * PERIOD + LAG


def swings_of(gains, stiffness, cycles, mass, seconds=10.0):
    """Amplitudes, early and late, of an arm in steps of 2 ms that presses on what never ends."""
    plant = Plant(stiffness, cycles, LAG, lambda t: 100.0, noise=0.0, mass=mass)
    filter_, delta, state = fast_filter(5.0, PERIOD), np.zeros(2), LawState(0.01)
    force, out = plant.step(0.0) - 100.0 * stiffness, []
    for _ in range(round(seconds / PERIOD)):
        state = advance(gains, state, force, math.inf)
        delta = follow(filter_, delta, state.e)
        force = plant.step(float(delta[0])) - 100.0 * stiffness
        out.append(state.e)
    early, late = np.abs(np.array_split(out, 4))[[1, 3]]
    return early.max(), late.max()


@pytest.mark.sweep(kept=6)
@pytest.mark.slow
@pytest.mark.parametrize("mass", [1e-6, 0.6, 3.0])
@pytest.mark.parametrize("cycles", [0, 2, 4])
@pytest.mark.parametrize("stiffness", [0.5, 3.0, 20.0])
def test_the_predicted_bound_is_where_the_loop_of_an_arm_in_small_steps_begins_to_grow(
    stiffness, cycles, mass
):
    """The plant's contact has no loss, and its lag is not told: within an eighth."""
    delay = measured_delay(cycles)
    bound = smallest_damping(stiffness, delay, PERIOD, tool=1e-3 * mass)
    for share, grows in ((1.0 / 1.12, True), (1.12, False)):
        D = share * bound
        gains = ForceGains(PERIOD * D, D, 0.0, math.inf, PERIOD)
        early, late = swings_of(gains, stiffness, cycles, mass)
        assert (late > early) == grows


# Stiffness, N/mm; delay that the rule took and the one measured, s; and the damping, as a share of
# stiffness times the first, below which the bench's physics began to swing.
MET = [
    (0.49, 0.055, 0.029, 0.41),
    (0.49, 0.075, 0.049, 0.39),
    (0.49, 0.095, 0.069, 0.26),
    (0.49, 0.135, 0.109, 0.51),
    (1.9, 0.055, 0.032, 0.1),
    (1.9, 0.075, 0.052, 0.41),
    (1.9, 0.095, 0.072, 0.53),
    (1.9, 0.135, 0.112, 0.62),
    (4.43, 0.055, 0.032, 0.32),
    (4.43, 0.075, 0.052, 0.48),
    (4.43, 0.095, 0.072, 0.56),
    (4.43, 0.135, 0.112, 0.62),
    (13.24, 0.055, 0.027, 0.37),
    (13.24, 0.075, 0.049, 0.51),
    (13.24, 0.095, 0.069, 0.56),
    (11.03, 0.135, 0.101, 0.72),
]


@pytest.mark.parametrize(("stiffness", "taken", "late", "met"), MET)
def test_what_is_refused_lies_within_a_factor_of_two_of_what_physics_shows(
    stiffness, taken, late, met
):
    """A tool of 6 N; nobody has told of the arm's lag, or of what the pen's holder damps."""
    integral = INTEGRAL_DELAYS * taken
    bound = smallest_damping(stiffness, late, PERIOD, integral, 6e-3 / 9.80665)
    assert 0.5 < MARGIN * bound / (stiffness * taken) / met < 2.0


@pytest.mark.slow
@given(
    st.floats(0.05, 200.0),
    st.floats(0.005, 0.4),
    st.sampled_from([0.004, 0.01, 0.02, 0.04]),
    st.sampled_from([0.0, 0.6e-3, 3e-3]),
)
def test_gains_by_the_rule_are_stable_with_some_to_spare(stiffness, beyond, period, tool):
    delay = beyond + 0.8 * period
    gains = by_rule(stiffness, delay + period / 2.0, period, tool=tool)
    made = steadied(gains, stiffness, delay, tool)
    assert is_safe(made, stiffness, delay, tool)
    # At the servos' usual lag the rule by itself is.
    assert made == gains or beyond < LAG


def test_for_a_long_delay_the_bound_is_the_known_one():
    """In continuous time an integrator k/(D s) behind a delay L is stable below D = 2 k L / π."""
    bound = smallest_damping(3.0, 1.0, PERIOD)
    assert bound == pytest.approx(2.0 / math.pi * 3.0 * 1.0, rel=0.03)


def test_gains_near_those_that_begin_to_swing_are_not_safe():
    bound = smallest_damping(2.0, 0.06, PERIOD)
    for share, stable, safe in ((0.98, False, False), (1.05, True, False), (1.15, True, True)):
        gains = ForceGains(PERIOD * share * bound, share * bound, 0.0, math.inf, PERIOD)
        assert (is_stable(gains, 2.0, 0.06), is_safe(gains, 2.0, 0.06)) == (stable, safe)


def test_a_growing_loop_is_told_from_a_dying_one_by_its_eigenvalue():
    gains = by_rule(2.0, 0.1, PERIOD)
    assert growth(gains, 2.0, 0.09) < 1.0 < growth(gains, 5.0, 0.09)


def test_the_integral_takes_away_what_a_receding_surface_leaves():
    gains, k, v = by_rule(2.0, 0.06, PERIOD), 2.0, 1.0
    state, depth, force = LawState(), 0.0, 5.0
    for _ in range(500):
        state = advance(gains, state, force - 5.0, 10.0)
        depth += v * PERIOD
        force = 5.0 - k * (state.e + depth)
    assert force == pytest.approx(5.0, abs=1e-3)


def test_at_its_largest_speed_nothing_winds_up():
    gains, state = by_rule(2.0, 0.06, PERIOD), LawState()
    for _ in range(200):
        state = advance(gains, state, -5.0, 3.0)
    assert state.saturated
    assert state.speed == -3.0
    assert abs(state.integral) <= 5.0 * PERIOD + 1e-12


@pytest.mark.slow
@given(st.floats(0.05, 50.0), st.floats(0.01, 0.3), st.floats(0.5, 20.0), st.floats(-15.0, 15.0))
def test_when_e_has_ended_what_it_added_decays_and_the_goal_is_reached(k, delay, tau, e):
    """Over random stable gains: e is held, released, and the filter of eq. (10) forgets it."""
    assert is_stable(by_rule(k, delay + PERIOD, PERIOD), k, delay + PERIOD / 2.0)
    filter_, state = fast_filter(tau, PERIOD), np.zeros(2)
    for _ in range(100):
        state = follow(filter_, state, e)
    assert state[0] == pytest.approx(e, abs=1e-9)
    for _ in range(100):
        state = follow(filter_, state, 0.0)
    assert abs(state[0]) < 1e-9


# --- what a landing tells


def test_a_line_is_found_with_how_well_it_is_known():
    rng = np.random.default_rng(1)
    depth = np.linspace(0.0, 1.0, 30)
    found = line(depth.tolist(), (0.5 + 3.0 * depth + 0.05 * rng.standard_normal(30)).tolist())
    slope, offset = np.polyfit(depth, 0.5 + 3.0 * depth, 1)
    assert found.slope == pytest.approx(slope, abs=4.0 * found.deviation)
    assert found.offset == pytest.approx(offset, abs=0.1)
    assert 0.01 < found.deviation < 0.1


@pytest.mark.parametrize("lag", [0.0, 0.04])
@pytest.mark.parametrize("delay", [0, 3, 7])
@pytest.mark.parametrize("way", [0.3, -0.7])
def test_the_delay_is_that_of_the_move_whatever_its_shape(lag, delay, way):
    k, T = 4.0, 0.001
    led = np.clip(np.arange(1500) * T * 2.0, 0.0, abs(way)) * np.sign(way)
    lagging, x = [], 0.0
    for value in led:
        x = value if lag == 0.0 else x + (value - x) * (1.0 - math.exp(-T / lag))
        lagging.append(x)
    felt = 2.0 + k * np.concatenate([np.zeros(delay * 10), lagging])[: len(led)]
    rested = ((0.0, 2.0), (float(led[-1]), 2.0 + k * float(led[-1])))
    found = delay_of_move(list(zip(led, felt, strict=True)), rested, T)
    assert found == pytest.approx(0.01 * delay + lag, abs=0.002)


def test_two_resting_points_tell_the_stiffness_unless_they_are_one():
    assert static_stiffness((1.0, 1.5), (2.0, 4.0), 1.0) == pytest.approx(4.0)
    assert static_stiffness((1.0, 1.5), (2.0, 2.1), 1.0) is None
    assert static_stiffness((1.5, 1.0), (2.0, 4.0), 1.0) is None


def test_a_reading_that_stays_while_the_tool_moves_in_is_no_contact():
    test = RiseTest(slack=0.3)
    assert all(test.believed(1.0, 5.0, 0.01 * n, 2.0) for n in range(400))
    assert not test.believed(1.0, 5.0, 4.5, 2.0)


def test_a_force_that_rises_as_it_should_is_believed():
    test = RiseTest(slack=0.3)
    assert all(test.believed(0.5 + 2.0 * 0.01 * n, 5.0, 0.01 * n, 2.0) for n in range(1000))


# --- swinging


def swings(signal, size=1.0, count=5, window=2.0, rate=50.0):
    detector = AlternationDetector(size, count, window)
    times = [n / rate for n, value in enumerate(signal) if detector.feel(n / rate, value)]
    return times[0] if times else None


def test_an_oscillation_is_named_within_its_count_of_half_periods():
    t = np.arange(0.0, 6.0, 0.02)
    assert 4 * 0.25 - 0.1 < swings(2.0 * np.sin(2.0 * np.pi * 2.0 * t)) < 5 * 0.25


@pytest.mark.parametrize("seed", range(5))
def test_noise_steps_and_slow_changes_are_no_oscillation(seed):
    rng, t = np.random.default_rng(seed), np.arange(0.0, 20.0, 0.02)
    noise = 0.1 * rng.standard_normal(len(t))
    assert swings(noise) is None
    assert swings(noise + 5.0 * (t > 5.0)) is None
    assert swings(noise + 3.0 * np.sin(2.0 * np.pi * 0.2 * t)) is None


def test_what_dies_away_is_told_from_what_grows():
    t = np.arange(0.0, 3.0, 0.02)
    for growth_, grows in ((0.5, True), (-0.7, False)):
        detector = AlternationDetector(0.3, 6, 3.0)
        for at in t:
            detector.feel(at, 2.0 * np.exp(growth_ * at) * np.sin(2.0 * np.pi * 2.0 * at))
        assert detector.grows == grows
