"""The closed loop as a matrix, against its parts one by one: law, filter, arm by its equations."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from dmpcli.admittance.force_coupling import fast_filter, follow
from dmpcli.admittance.force_law import ForceGains, LawState, advance
from dmpcli.admittance.force_stability import (
    LAG,
    LOSS,
    loop_matrix,
)

PERIOD = 0.02


def delay_of(dead, lag, period=PERIOD):
    """What a landing measures of such an arm: the filter, and half of the later reading, too."""
    filter_, delta, late = fast_filter(5.0, period), (0.0, 0.0), 0.0
    for _ in range(50):
        delta = follow(filter_, delta, 1.0)
        late += period * (1.0 - delta[0])
    return late + 0.25 * period + dead + lag - LOSS


class Loop:
    """A loop in one dimension: `dead` s of dead time, then a critically damped lag, then a spring.

    `sent` are the set-points, the newest first; `arm` its position and speed. The filter is that
    of a tau of 1 s, by which V counts.
    """

    def __init__(self, gains, stiffness, dead, lag, tool, state, filtered, sent, arm, force):
        self.gains, self.stiffness, self.dead, self.tool = gains, stiffness, dead, tool
        self.state, self.delta, self.sent, self.force = state, filtered, list(sent), force
        w = 2.0 / lag
        # Position, speed, command and its rate.
        self.motion = np.zeros((4, 4))
        self.motion[0, 1] = self.motion[2, 3] = 1.0
        self.motion[1] = [-w * w, -2.0 * w, w * w, 0.0]
        (self.x, self.v), self.flows = arm, {}

    def flow(self, dt):
        key = round(dt, 9)
        if key not in self.flows:
            self.flows[key] = expm(dt * self.motion)
        return self.flows[key]

    def cycle(self):
        T = self.gains.period
        self.state = advance(self.gains, self.state, self.force, np.inf)
        self.delta = follow(fast_filter(1.0, T), self.delta, self.state.e)
        self.sent.insert(0, self.delta[0])
        whole, late = int(self.dead / T + 1e-9), self.dead % T
        late = 0.0 if T - late < 1e-9 else late
        then, now, before = self.sent[whole : whole + 3]
        arm = np.array([self.x, self.v, before + (1.0 - late / T) * (now - before), 0.0])
        felt = []
        for begin, end in zip(cuts := sorted({0.0, late, T / 2.0, T}), cuts[1:], strict=False):
            arm[3] = (then - now if begin >= late - 1e-12 else now - before) / T
            arm = self.flow(end - begin) @ arm
            if end in (T / 2.0, T):
                x, v, a = arm[0], arm[1], self.motion[1] @ arm
                felt.append(-self.stiffness * (x + LOSS * v) - self.tool * a)
        (self.x, self.v), self.force = arm[:2], float(np.mean(felt))
        self.sent.pop()


@pytest.mark.slow
@settings(max_examples=12, deadline=None)
@given(st.integers(0, 10_000), st.booleans(), st.integers(0, 45))
def test_a_cycle_of_the_matrix_is_one_of_the_loop_part_by_part(seed, integrates, steps):
    rng = np.random.default_rng(seed)
    gains = ForceGains(
        rng.uniform(0.01, 0.1),
        rng.uniform(0.1, 2.0),
        rng.uniform(0.0, 1.0),
        rng.uniform(0.1, 1.0) if integrates else np.inf,
        PERIOD,
    )
    stiffness, tool, dead = rng.uniform(0.5, 20.0), rng.uniform(0.0, 3e-3), steps * PERIOD / 20.0
    lag = LAG if dead else rng.uniform(0.005, LAG)
    matrix = loop_matrix(gains, stiffness, delay_of(dead, lag), tool)
    known = rng.standard_normal(len(matrix))
    integral = known[0] if integrates else 0.0
    speed, e, delta, rate = known[int(integrates) :][:4]
    sent, (x, v, force) = known[int(integrates) :][4:-3], known[-3:]
    loop = Loop(
        gains,
        stiffness,
        dead,
        lag,
        tool,
        LawState(e, speed, integral),
        (delta, rate),
        sent,
        (x, v),
        force,
    )
    loop.cycle()
    wanted = [loop.state.integral] if integrates else []
    wanted += [loop.state.speed, loop.state.e, *loop.delta, *loop.sent, loop.x, loop.v, loop.force]
    np.testing.assert_allclose(matrix @ known, wanted, atol=1e-7)
