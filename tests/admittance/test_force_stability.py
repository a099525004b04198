"""The closed loop's eigenvalues, against the loop itself, stepped in small steps of time."""

import numpy as np
import pytest

from dmpcli.admittance.force_coupling import fast_filter
from dmpcli.admittance.force_law import ForceGains, LawState, advance
from dmpcli.admittance.force_stability import (
    LAG,
    LOSS,
    MARGIN,
    growth,
    is_safe,
    is_stable,
    loop_matrix,
    steadied,
)
from tests.admittance.damping import smallest_damping

PERIOD, FINE = 0.02, 100
"""s of a cycle, and steps in it."""


def measured_delay(dead, lag):
    """From a displacement to its force, s: the filter, the arm, half a period of its two readings.

    The damping of the contact shortens what is met.
    """
    made, x, short = fast_filter(1.0, PERIOD), np.zeros(2), 0.0
    for _ in range(4000):  # what the filter's step response is short of 1, summed up
        x = made.transition @ x + made.response
        short += 1.0 - x[0]
    return short * PERIOD + PERIOD / 4.0 + dead + lag - LOSS


def swings(gains, stiffness, dead, tool=0.0, cycles=900):
    """Size of the last sixth of a run in such a contact over that of the third before."""
    made, delta, state = fast_filter(1.0, PERIOD), np.zeros(2), LawState(1.0)
    sent, x, v, w, seen = [0.0] * 12, 0.0, 0.0, 2.0 / LAG, []
    dt, force = PERIOD / FINE, 0.0
    for _ in range(cycles):
        state = advance(gains, state, force, np.inf)
        delta = made.transition @ delta + made.response * state.e
        sent = [delta[0], *sent[:-1]]
        readings = []
        for n in range(1, FINE + 1):
            # Each set-point is taken up evenly over the cycle after it, a dead time later.
            behind = (n * dt - dead) / PERIOD
            cycle = int(np.ceil(behind)) - 1
            share = behind - cycle
            older, newer = sent[1 - cycle], sent[-cycle]
            target = older + share * (newer - older)
            a = w * w * (target - x) - 2.0 * w * v
            v += dt * a
            x += dt * v
            if n in (FINE // 2, FINE):
                readings.append(stiffness * (x + LOSS * v) + tool * a)
        force = -float(np.mean(readings))
        seen.append(abs(x))
        if seen[-1] > 1e9:
            return np.inf
    return max(seen[-150:]) / max(max(seen[-450:-150]), 1e-300)


@pytest.mark.slow
@pytest.mark.parametrize("dead", [0.0, 0.05])
@pytest.mark.parametrize("integral", [np.inf, 0.6])
def test_the_smallest_damping_is_where_a_run_just_comes_to_rest(integral, dead):
    delay = measured_delay(dead, LAG)
    least = smallest_damping(4.0, delay, PERIOD, integral)
    for share, rests in ((1.03, True), (0.97, False)):
        damping = share * least
        gains = ForceGains(PERIOD * damping, damping, 0.0, integral, PERIOD)
        assert is_stable(gains, 4.0, delay) is rests
        assert bool(swings(gains, 4.0, dead) < 1.0) is rests


@pytest.mark.parametrize("tool", [0.0, 3e-4])
def test_growth_by_cycle_is_that_of_a_run(tool):
    delay = measured_delay(0.05, LAG)
    least = smallest_damping(4.0, delay, PERIOD)
    gains = ForceGains(PERIOD * 0.9 * least, 0.9 * least, 0.0, np.inf, PERIOD)
    grown = swings(gains, 4.0, 0.05, tool, cycles=700)
    # From the third before to the last sixth its largest lies 150 cycles later.
    assert growth(gains, 4.0, delay, tool) ** 150 == pytest.approx(grown, rel=0.15)
    assert np.abs(np.linalg.eigvals(loop_matrix(gains, 4.0, delay))).max() > 1.0


def test_what_is_safe_is_stable_when_it_answers_more_quickly_too():
    delay = measured_delay(0.03, LAG)
    least = smallest_damping(5.0, delay, PERIOD)
    gains = ForceGains(PERIOD * least, least, 0.0, np.inf, PERIOD)
    assert is_safe(gains.softened(1.01 * MARGIN), 5.0, delay)
    assert not is_safe(gains.softened(0.99 * MARGIN), 5.0, delay)
    assert is_stable(gains.softened(0.99 * MARGIN), 5.0, delay)


def test_gains_are_softened_as_far_as_a_contact_needs_and_no_further():
    delay = measured_delay(0.03, LAG)
    least = smallest_damping(5.0, delay, PERIOD)
    gains = ForceGains(PERIOD * least, least, 0.0, np.inf, PERIOD)
    calm = gains.softened(2.0)
    assert steadied(calm, 5.0, delay) is calm
    found = steadied(gains, 5.0, delay)
    assert found is not None
    assert is_safe(found, 5.0, delay)
    assert not is_safe(found.softened(1.0 / 1.21), 5.0, delay)
    assert steadied(gains, 5e3, delay) is None
