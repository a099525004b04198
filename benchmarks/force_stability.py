"""Where the force begins to swing: predicted from what a landing measures, and met in physics.

``python -m benchmarks.force stability`` makes ``out/force-stability.svg`` and ``.png``.

On the bench the pen rests on the plane with 5 N; stiffness and delay are taken as a landing takes
them, from a small move between two resting points. Then the law holds the force with less and less
damping (mass and integral by the rule: M = T·D, T_i = 4·L) after a set-point that rises by 1 N: it
swings where later deviations are larger than earlier ones. The boundary is found by bisection.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.force_cases import FORCE, LAG, PERIOD, ROOT, START, UP, Case, said_of
from dmpcli.admittance.force_coupling import fast_filter, follow
from dmpcli.admittance.force_law import (
    DAMPING_SHARE,
    INTEGRAL_DELAYS,
    ForceGains,
    LawState,
    advance,
)
from dmpcli.admittance.force_stability import smallest_damping
from dmpcli.bench import options
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
        self._filter, self._delta = fast_filter(5.0, PERIOD), np.zeros(2)
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

    def land(self) -> tuple[float, float]:
        """Return stiffness and delay as a landing takes them, N/mm and s."""
        landing = Landing(FORCE, 2.0, 10.0, 2.0 * self._told + 0.1, PERIOD, [])
        while landing.found is None:
            assert not landing.failure, landing.failure
            self.lead(landing.step(self.law, self.force))
        return landing.found.stiffness, max(self._told, landing.found.delay)

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
    stiffness, delay : float
        As measured, N/mm and s; the delay with half a period.
    predicted, measured : float
        Smallest damping that holds the force still, by stiffness and delay.
    """

    pen: float
    cycles: int
    stiffness: float
    delay: float
    predicted: float
    measured: float


def boundary(pen: float, cycles: int) -> Boundary:
    """Predict one boundary, and look for it."""
    k, late = Press(pen, cycles).land()
    whole = late + PERIOD / 2.0
    least = smallest_damping(k, late, PERIOD, INTEGRAL_DELAYS * whole) / (k * whole)
    low, high = _LEAST, _MOST
    for _ in range(_STEPS):
        middle = float(np.sqrt(low * high))
        gains = held_by(middle, k, whole)
        low, high = (middle, high) if swings(Press(pen, cycles), k, gains) else (low, middle)
    return Boundary(pen, cycles, k, whole, least, float(np.sqrt(low * high)))


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
        delays = np.linspace(0.045, 0.17, 26)
        least = [
            smallest_damping(1.0, late - PERIOD / 2.0, PERIOD, INTEGRAL_DELAYS * late)
            for late in delays
        ]
        axes.fill_between(
            1e3 * delays, 0.0, least, color="#D40000", alpha=0.10, lw=0, label="predicted: swings"
        )
        axes.plot(1e3 * delays, least, color="#D40000", label="predicted bound")
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
            axes.plot(
                [1e3 * one.delay for one in own],
                [one.measured * one.delay for one in own],
                mark,
                color=colours[pen],
                ms=5,
                label=f"met on the bench, pen of {pen:g} N/mm",
            )
        axes.set_xlim(45.0, 170.0)
        axes.set_ylim(0.0, 0.17)
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
    print("\n## stability: D/(k·L) where the force begins to swing\n")
    print("| pen, N/mm | cycles | k̂, N/mm | L, ms | predicted | met | met / predicted |")
    print("| ---: |" + " ---: |" * 6)
    found = []
    for pen in STIFFNESS:
        for cycles in CYCLES:
            one = boundary(pen, cycles)
            found.append(one)
            print(
                f"| {pen:g} | {cycles} | {one.stiffness:.2f} | {1e3 * one.delay:.0f} | "
                f"{one.predicted:.2f} | {one.measured:.2f} | {one.measured / one.predicted:.2f} |",
                flush=True,
            )
    drawn(found)
    print(f"\n{_FIGURE.relative_to(ROOT)}.svg and .png")
