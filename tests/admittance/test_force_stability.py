"""The closed loop as a matrix, against the law itself on a spring that is felt late."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dmpcli.admittance.force_law import ForceGains, LawState, advance, by_rule
from dmpcli.admittance.force_stability import (
    growth,
    is_stable,
    largest_stiffness,
    loop_matrix,
    smallest_damping,
)

PERIOD = 0.02


def gains_of(rng, integrates):
    return ForceGains(
        rng.uniform(0.01, 0.1),
        rng.uniform(0.1, 2.0),
        rng.uniform(0.0, 1.0),
        rng.uniform(0.1, 1.0) if integrates else np.inf,
        PERIOD,
    )


@settings(max_examples=25)
@given(st.integers(0, 10_000), st.booleans())
def test_a_cycle_of_the_matrix_is_one_of_the_law_on_a_spring_felt_late(seed, integrates):
    """Between two cycles the displacement that is felt is interpolated linearly."""
    rng = np.random.default_rng(seed)
    gains, stiffness = gains_of(rng, integrates), rng.uniform(0.5, 20.0)
    delay = rng.uniform(0.0, 0.11)
    whole, share = int(delay / PERIOD), delay / PERIOD % 1.0
    e = rng.standard_normal(whole + 2)  # now, one cycle ago, ...
    state = LawState(e[0], rng.standard_normal(), rng.standard_normal() if integrates else 0.0)
    force = -stiffness * ((1.0 - share) * e[whole] + share * e[whole + 1])
    after = advance(gains, state, force, np.inf)
    wanted = [after.integral, after.speed, after.e, *e[:-1]]
    known = [state.integral, state.speed, *e]
    if not integrates:
        wanted, known = wanted[1:], known[1:]
    np.testing.assert_allclose(loop_matrix(gains, stiffness, delay) @ known, wanted, atol=1e-9)


def simulated(gains, stiffness, delay, cycles=4000):
    """Size of the last tenth of a run over that of the tenth before the middle."""
    whole, share = int(delay / PERIOD), delay / PERIOD % 1.0
    e, state, seen = [1.0] * (whole + 2), LawState(1.0), []
    for _ in range(cycles):
        force = -stiffness * ((1.0 - share) * e[whole] + share * e[whole + 1])
        state = advance(gains, state, force, np.inf)
        e = [state.e, *e[:-1]]
        seen.append(abs(state.e))
        if seen[-1] > 1e12:
            return np.inf
    return max(seen[-400:]) / max(max(seen[1600:2000]), 1e-300)


@pytest.mark.parametrize("delay", [0.03, 0.073])
def test_the_stiffest_contact_is_where_a_run_no_longer_comes_to_rest(delay):
    gains = by_rule(3.0, delay + PERIOD / 2.0, PERIOD)
    most = largest_stiffness(gains, delay)
    assert most > 3.0
    assert is_stable(gains, 0.998 * most, delay)
    assert not is_stable(gains, 1.002 * most, delay)
    assert simulated(gains, 0.97 * most, delay) < 1.0 < simulated(gains, 1.03 * most, delay)
    assert growth(gains, 0.97 * most, delay) < 1.0 < growth(gains, 1.03 * most, delay)


@pytest.mark.parametrize("integral", [np.inf, 0.5])
@pytest.mark.parametrize("delay", [0.03, 0.11])
def test_the_smallest_damping_is_where_a_run_just_comes_to_rest(integral, delay):
    least = smallest_damping(4.0, delay, PERIOD, integral)
    for share, rests in ((1.002, True), (0.998, False)):
        damping = share * least
        gains = ForceGains(PERIOD * damping, damping, 0.0, integral, PERIOD)
        assert is_stable(gains, 4.0, delay) is rests
    # Of a pure delay without an integral it is about 2/π of k·L, the half period counted in.
    if integral == np.inf:
        assert least == pytest.approx(2.0 / np.pi * 4.0 * (delay + PERIOD / 2.0), rel=0.15)
    else:
        assert least > smallest_damping(4.0, delay, PERIOD)
