"""A contact in one dimension: servo lag, pure delay, a spring and noise; the oracle of the tests.

It shares nothing with the code under test: the tool's height over the plan follows what was
commanded through a first-order lag, solved exactly between cycles, and the spring pushes where the
tool is below the surface.
"""

import math

import numpy as np

from dmpcli.admittance.force_coupling import fast_filter, follow
from dmpcli.control.contact_policy import ContactPolicy
from dmpcli.control.contact_supervisor import ContactSupervisor

PERIOD = 0.02
SUBSTEPS = 10


class Plant:
    """A tool on a spring over a surface.

    `surface(t)` is its height over the plan, mm, None where there is none; `cycles` delay the
    command. The sensor reads the mean over the last half period, `bias` beside its zero; of a tool
    of `mass`, kg, it feels the inertia too, and the arm takes up its command more softly.
    """

    def __init__(
        self,
        stiffness,
        cycles=0,
        lag=0.025,
        surface=lambda t: 0.0,
        noise=0.05,
        seed=0,
        bias=0.0,
        mass=0.0,
    ):
        self.mass, self.half, self.speed = mass, 0.0, 0.0
        self.stiffness, self.lag, self.surface = stiffness, lag, surface
        self.queue = [0.0] * (cycles + 1)
        self.rng = np.random.default_rng([seed, 7])
        self.noise, self.bias = noise, bias
        self.height, self.command, self.t = 0.0, 0.0, 0.0
        self.force = 0.0

    def step(self, displacement):
        """One period: the command runs to the next set-point, the tool after it."""
        self.queue.append(displacement)
        target, before = self.queue.pop(0), self.command
        dt = PERIOD / SUBSTEPS
        felt = []
        for n in range(SUBSTEPS):
            self.command = before + (target - before) * (n + 1) / SUBSTEPS
            goal, lag = self.command, self.lag
            if self.mass:
                lag = 0.5 * self.lag
                self.half += (self.command - self.half) * (1.0 - math.exp(-dt / lag))
                goal = self.half
            way = (goal - self.height) * (1.0 - math.exp(-dt / lag))
            inertia = 1e-3 * self.mass * (way / dt - self.speed) / dt
            self.height, self.speed = self.height + way, way / dt
            self.t += dt
            h = self.surface(self.t)
            self.force = 0.0 if h is None else self.stiffness * max(h - self.height, 0.0)
            felt.append(self.force - inertia)
        self.command = target
        mean = float(np.mean(felt[SUBSTEPS // 2 :]))
        return mean + self.bias + self.noise * self.rng.standard_normal()


class Rig:
    """The supervisor with the filter of eq. (10) and a plant, cycle after cycle."""

    def __init__(self, plant, setpoint=5.0, told_delay=None, **policy):
        self.plant = plant
        cycles = len(plant.queue) - 1
        if told_delay is None:
            told_delay = PERIOD + plant.lag
        del cycles
        self.supervisor = ContactSupervisor(
            ContactPolicy(setpoint, delay=told_delay, **policy), PERIOD
        )
        self.filter, self.delta = fast_filter(5.0, PERIOD), np.zeros(2)
        self.wanted = setpoint
        self.zero, self.zeros = 0.0, 0
        self.rows = []
        self.t, self.force = 0.0, 0.0

    def cycle(self, wanted=None):
        wanted = self.wanted if wanted is None else wanted
        sup = self.supervisor
        if sup.zeroing:
            self.zero, self.zeros = self.zero + self.force, self.zeros + 1
            felt = self.force
        else:
            if self.zeros:
                self.zero, self.zeros = self.zero / self.zeros, 0
                sup.zero_is(self.t, abs(self.zero))
            felt = self.force - self.zero
        e = sup.step(self.t, felt, 0.0, wanted)
        self.delta = follow(self.filter, self.delta, e)
        self.force = self.plant.step(float(self.delta[0]))
        self.t += PERIOD
        self.rows.append((self.t, sup.state, e, self.plant.force, wanted))

    def land(self, longest=30.0):
        while not (self.supervisor.settled or self.supervisor.failure) and self.t < longest:
            self.cycle()
        return self

    def draw(self, seconds, wanted=None):
        begun = len(self.rows)
        for _ in range(round(seconds / PERIOD)):
            if self.supervisor.failure:
                break
            self.cycle(None if wanted is None else wanted(self.t))
        return np.array([(f, w) for _, _, _, f, w in self.rows[begun:]]).reshape(-1, 2)

    @property
    def peak(self):
        return max(row[3] for row in self.rows)

    @property
    def states(self):
        seen = []
        for _, state, *_ in self.rows:
            if not seen or seen[-1] != state:
                seen.append(state)
        return seen
