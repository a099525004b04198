"""Where the force begins to swing: predicted, and met in physics.

``python -m benchmarks.force stability`` makes ``out/force-stability.svg`` and ``.png``.

On the bench the pen rests on the plane with 5 N; stiffness and delay are taken as a landing takes
them, from a small move between two resting points. Then the law holds the force with less and less
damping (mass and integral by the rule: M = T·D, T_i = 4·L) after a set-point that rises by 1 N: it
swings where later deviations are larger than earlier ones. The boundary is found by bisection.

Two predictions stand beside it. What `execute` refuses gains by knows stiffness and delay as a
landing measures them, and the tool's mass by its file; lag and damping are what is usual. The model
here knows what the bench is made of: the servos' lag, the pen's damper, what hangs on the sensor.
Both know the filter of eq. (10), set-points that are taken up evenly, and that the sensor feels the
tool's inertia too, by which a soft pen on a heavy tool pushes less the quicker it swings.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.force_cases import FORCE, LAG, PERIOD, ROOT, START, UP, Case, said_of
from benchmarks.force_runs import effective
from dmpcli.admittance.force_coupling import fast_filter, follow
from dmpcli.admittance.force_law import (
    DAMPING_SHARE,
    INTEGRAL_DELAYS,
    ForceGains,
    LawState,
    advance,
)
from dmpcli.admittance.force_stability import MARGIN, smallest_damping
from dmpcli.arrays import Floats
from dmpcli.bench import options
from dmpcli.bench.parameters import BenchParameters
from dmpcli.bench.scene import GRAVITY
from dmpcli.bench.world import World
from dmpcli.control.landing import Landing
from dmpcli.spatial.pose import Pose

STIFFNESS, CYCLES = (0.5, 2.0, 5.0, 20.0), (0, 1, 2, 4)
# Of the bisection: from and to this D/(k·L), in so many halvings of its logarithm.
_LEAST, _MOST, _STEPS = 0.05, 1.3, 6
# N; mm/s, beyond any: at a limit of its speed a loop swings without growing; delays over which a
# trial is watched; N, a standard deviation that is none.
_RISE, _FASTEST, _DELAYS, _SWINGS = 0.5, 1e3, 50.0, 0.02
_FIGURE = ROOT / "out" / "force-stability"


class Press:
    """The pen on the plane, led along the normal as `execute` leads it; no noise.

    Parameters
    ----------
    pen : float
        N/mm.
    cycles : int
        Delay of the servos.

    Attributes
    ----------
    force : float
        Mean of the last period's two readings, N.
    law : LawState
    """

    def __init__(self, pen: float, cycles: int) -> None:
        bench = {"stiffness": repr(pen), "delay": repr(PERIOD * cycles), "noise": "0"}
        said = said_of(Case("", bench=bench), 0) | {"z": repr(float(START[2]))}
        self._world = World(options.parameters("ec66", said))
        self._world.start(PERIOD)
        self._at = self._world.pose
        self._filter, self._delta = fast_filter(5.0, PERIOD), (0.0, 0.0)
        self._told = PERIOD + LAG + PERIOD * cycles
        self.force, self.law = 0.0, LawState()

    def lead(self, law: LawState) -> None:
        """Lead the tool where the law says, for one period."""
        world, self.law = self._world, law
        self._delta = follow(self._filter, self._delta, law.e)
        goal = Pose(self._at.position + self._delta[0] * UP, self._at.rotation)
        world.send(world.joints_of(goal, world.reference.position))
        felt = [world.step(PERIOD / 2.0)[1][2] for _ in range(2)]
        self.force = float(np.mean(felt))

    def land(self) -> tuple[float, float, float]:
        """Return stiffness and delay as a landing takes and as it measures them, N/mm and s."""
        landing = Landing(FORCE, 2.0, 10.0, 2.0 * self._told + 0.1, PERIOD, [])
        while landing.found is None:
            assert not landing.failure, landing.failure
            self.lead(landing.step(self.law, self.force))
        found = landing.found
        return found.stiffness, max(self._told, found.delay), found.delay

    def hold(self, gains: ForceGains, wanted: float, seconds: float) -> list[float]:
        """Hold a force for so long, or until it is wholly off; return it, N."""
        felt: list[float] = []
        while len(felt) < seconds / PERIOD and (not felt or abs(felt[-1] - wanted) < 0.8 * wanted):
            self.lead(advance(gains, self.law, self.force - wanted, _FASTEST))
            felt.append(self.force)
        return felt


@dataclass(frozen=True)
class Boundary:
    """Where one contact begins to swing.

    Attributes
    ----------
    pen : float
        Nominal stiffness, N/mm.
    cycles : int
    stiffness, delay, late : float
        As measured, N/mm and s; the delay that the rule takes, with half a period, and as measured.
    refused, predicted, measured : float
        Smallest damping that holds the force still, by stiffness and delay: what `execute` goes
        by, the model's, and what is met.
    """

    pen: float
    cycles: int
    stiffness: float
    delay: float
    late: float
    refused: float
    predicted: float
    measured: float


class Model:
    """The loop in one dimension, as the bench is made.

    Parameters
    ----------
    pen : float
        N/mm.
    cycles : int
        Delay of the servos.
    """

    STEPS = 20

    def __init__(self, pen: float, cycles: int) -> None:
        usual = BenchParameters()
        self._k, self._cycles, self._lag = effective(pen), cycles, usual.servos.lag
        mass = usual.tool.weight / GRAVITY - usual.pen.mass
        share = self._k / pen  # what the arm's own give leaves of the pen's
        damping = 2.0 * usual.pen.damping * np.sqrt(1e3 * pen * usual.pen.mass)
        self._damping, self._mass = 1e-3 * damping * share, 1e-3 * mass
        self._filter = fast_filter(5.0, PERIOD)

    def growth(self, gains: ForceGains) -> float:
        """Largest eigenvalue of one cycle."""
        size = 9 + self._cycles
        cycle = np.column_stack([self._after(gains, unit) for unit in np.eye(size)])
        return float(np.abs(np.linalg.eigvals(cycle)).max())

    def _after(self, gains: ForceGains, before: Floats) -> Floats:
        """The state a cycle later: ∫f, ė, e, the filter, set-points, command, arm, force."""
        integral, speed, e, *way = before[:5]
        coming, (command, x, v, force) = list(before[5:-4]), before[-4:]
        law = advance(gains, LawState(e, speed, integral), force, np.inf)
        delta = follow(self._filter, (way[0], way[1]), law.e)
        coming.append(float(delta[0]))
        target = coming.pop(0)
        w, dt = 2.0 / self._lag, PERIOD / self.STEPS
        rate = (target - command) / PERIOD
        decay = np.exp(-w * dt) * np.array([[1.0 + w * dt, dt], [-w * w * dt, 1.0 - w * dt]])
        error = np.array([x - command + self._lag * rate, v - rate])
        felt = []
        for n in range(1, self.STEPS + 1):
            error = decay @ error
            x, v = command + n * dt * rate - self._lag * rate + error[0], rate + error[1]
            a = -w * w * error[0] - 2.0 * w * error[1]
            if n in (self.STEPS // 2, self.STEPS):
                felt.append(-self._k * x - self._damping * v - self._mass * a)
        law_state = [law.integral, law.speed, law.e, *delta]
        return np.array([*law_state, *coming, target, x, v, np.mean(felt)])


def boundary(pen: float, cycles: int) -> Boundary:
    """Predict one boundary, and look for it."""
    k, taken, late = Press(pen, cycles).land()
    whole = taken + PERIOD / 2.0
    tool = 1e-3 * BenchParameters().tool.weight / GRAVITY
    bound = smallest_damping(k, late, PERIOD, INTEGRAL_DELAYS * whole, tool)
    refused = MARGIN * bound / (k * whole)
    model = Model(pen, cycles)
    bounds = []
    for steps, unstable in (
        (2 * _STEPS, lambda gains: model.growth(gains) > 1.0),
        (_STEPS, lambda gains: swings(Press(pen, cycles), k, gains)),
    ):
        low, high = _LEAST, _MOST
        for _ in range(steps):
            middle = float(np.sqrt(low * high))
            low, high = (middle, high) if unstable(held_by(middle, k, whole)) else (low, middle)
        bounds.append(float(np.sqrt(low * high)))
    return Boundary(pen, cycles, k, whole, late, refused, *bounds)


def held_by(share: float, stiffness: float, delay: float) -> ForceGains:
    """Gains by the rule but for their damping, a share of stiffness times delay."""
    damping = share * stiffness * delay
    return ForceGains(PERIOD * damping, damping, 0.0, INTEGRAL_DELAYS * delay, PERIOD)


def swings(press: Press, stiffness: float, gains: ForceGains) -> bool:
    """Whether a force that is held by these gains does not rest."""
    delay = gains.integral / INTEGRAL_DELAYS
    down = LawState(-FORCE / stiffness)
    for _ in range(round((8.0 * delay + 0.2) / PERIOD)):
        press.lead(down)
    felt = press.hold(gains, FORCE + _RISE, _DELAYS * delay)
    if len(felt) < _DELAYS * delay / PERIOD - 1:
        return True
    early, late = np.array_split(np.array(felt), 3)[1:]
    return bool(late.std() > max(early.std(), _SWINGS))


def drawn(found: list[Boundary]) -> Any:
    """Draw the map: smallest damping by stiffness over the delay, predicted and met."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    from dmpcli.reporting.style import RC

    with mpl.rc_context(RC):
        figure = Figure(figsize=(5.6, 3.8), layout="constrained")
        axes = figure.subplots()
        delays = np.array([0.045, 0.15])
        axes.plot(
            1e3 * delays,
            DAMPING_SHARE * delays,
            color="#009E73",
            ls="--",
            label=f"rule, D = {DAMPING_SHARE:g} k L",
        )
        colours = dict(zip(STIFFNESS, ("#0072B2", "#E69F00", "#9A4F96", "#000000"), strict=True))
        for pen, mark in zip(STIFFNESS, "os^D", strict=True):
            own = [one for one in found if one.pen == pen]
            late = [1e3 * one.delay for one in own]
            colour = colours[pen]
            axes.plot(late, [one.predicted * one.delay for one in own], color=colour, lw=0.9)
            axes.plot(late, [one.refused * one.delay for one in own], ":", color=colour, lw=1.1)
            axes.plot(
                late,
                [one.measured * one.delay for one in own],
                mark,
                color=colour,
                ms=5,
                label=f"pen of {pen:g} N/mm: predicted (line), refused (dots), met",
            )
        axes.set_xlim(45.0, 150.0)
        axes.set_ylim(0.0, 0.14)
        axes.set_xlabel("delay L from a displacement to its force, with half a period, ms")
        axes.set_ylabel("damping by stiffness D/k, s")
        axes.legend(loc="upper left", fontsize=7)
        _FIGURE.parent.mkdir(exist_ok=True)
        for kind in ("svg", "png"):
            metadata = {"Date": None} if kind == "svg" else {}
            figure.savefig(_FIGURE.with_suffix(f".{kind}"), dpi=110, metadata=metadata)
        return figure


def main() -> None:
    """Print the boundaries, and draw them."""
    print("\n## stability: D/(k·L) below which the force swings\n")
    print(
        "| pen, N/mm | cycles | k̂, N/mm | L, ms | measured, ms | refused | predicted | met "
        "| refused/met | predicted/met |"
    )
    print("| ---: |" + " ---: |" * 9)
    found = []
    for pen in STIFFNESS:
        for cycles in CYCLES:
            one = boundary(pen, cycles)
            found.append(one)
            print(
                f"| {pen:g} | {cycles} | {one.stiffness:.2f} | {1e3 * one.delay:.0f} | "
                f"{1e3 * one.late:.0f} | {one.refused:.2f} | {one.predicted:.2f} | "
                f"{one.measured:.2f} | {one.refused / one.measured:.2f} | "
                f"{one.predicted / one.measured:.2f} |",
                flush=True,
            )
    drawn(found)
    print(f"\n{_FIGURE.relative_to(ROOT)}.svg and .png")
