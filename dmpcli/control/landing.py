"""The landing: from the first touch, at an even speed, to what is known of the contact.

The tool goes on until the force tells enough, rests, presses on by a small way or backs off, and
rests again. Two resting points give the stiffness, whatever delays there are, and the way from one
to the other by how much the force is late.
"""

from dataclasses import dataclass

from dmpcli.admittance.contact_estimation import Line, delay_of_move, line, static_stiffness
from dmpcli.admittance.force_law import LawState
from dmpcli.control.guarded_motion import sinking, towards

# Shares of the set-point: where the way in stops, what two resting points differ by, and where
# they lie apart already.
_STOPS, _APART, _BACK = 0.35, 0.2, 0.55
_PRESSES = 0.8
# N by which the force must have risen on the way in, or that share of a set-point below 1 N: of
# less the noise of a reading makes any slope.
_RISE = 0.35
# The same in standard deviations of the noise, where that is more.
_SURE_RISE = 7.0
# A surface so soft that it is none, N/mm.
SOFTEST = 0.05
# The way from one resting point to the other is no longer, mm.
_LONGEST = 20.0
# s over which resting forces are averaged, beside the delay that is waited for.
_MEAN, _LONGEST_MEAN = 0.12, 1.0
# How well they are to be known beside the noise, as a share of the set-point.
_KNOWN = 0.02


@dataclass(frozen=True)
class MeasuredContact:
    """What a landing has found.

    Attributes
    ----------
    stiffness : float
        N/mm.
    delay : float
        From a displacement to its force, s.
    """

    stiffness: float
    delay: float


class Landing:
    """One landing.

    Parameters
    ----------
    wanted : float
        Set-point, N.
    speed : float
        Of the way in, mm/s.
    pressing : float
        Fastest for the way between the two resting points, mm/s.
    lag : float
        s that are waited for a force to settle.
    period : float
        s.
    touched : list of tuple of float
        Depth, mm, and force, N, of the cycles in which it was felt already.
    noise : float
        Standard deviation of a cycle's force, N.

    Attributes
    ----------
    found : MeasuredContact or None
    failure : str
        Why it is no contact; empty while it may be one.
    """

    def __init__(
        self,
        wanted: float,
        speed: float,
        pressing: float,
        lag: float,
        period: float,
        touched: list[tuple[float, float]],
        noise: float = 0.0,
    ) -> None:
        self._wanted, self._speed, self._pressing = wanted, speed, pressing
        self._lag, self._period = lag, period
        mean = (noise / (_KNOWN * wanted)) ** 2 * period
        self._mean = min(max(_MEAN, mean), _LONGEST_MEAN)
        self._rise = max(_RISE * min(wanted, 1.0), min(_SURE_RISE * noise, 0.4 * wanted))
        self._ramp = list(touched)
        self._stage = "ramp"
        self._waited = self._sum = 0.0
        self._number = 0
        self._fit = Line(0.0, 0.0, 0.0)
        self._goal = 0.0
        self._rested: list[tuple[float, float]] = []
        self._way: list[tuple[float, float]] = []
        self.found: MeasuredContact | None = None
        self.failure = ""

    @property
    def resting(self) -> bool:
        """Whether the tool rests on the surface, or goes from one resting point to the other."""
        return self._stage != "ramp"

    def step(self, state: LawState, force: float) -> LawState:
        """Take in one cycle's force; return where to go on to."""
        if self._stage == "ramp":
            return self._go_in(state, force)
        if self._rested:
            self._way.append((-state.e, force))
        if self._stage == "press":
            state, there = towards(state, self._goal, self._pressing, self._period)
            if there:
                self._rest()
            return state
        self._waited += self._period
        if self._waited > self._lag:
            self._sum, self._number = self._sum + force, self._number + 1
        if self._waited > self._lag + self._mean:
            self._rested.append((-state.e, self._sum / self._number))
            self._judge(state)
        return LawState(state.e)

    def _go_in(self, state: LawState, force: float) -> LawState:
        self._ramp.append((-state.e, force))
        depth, first = self._ramp[-1][0], self._ramp[0]
        pressed = depth - first[0]
        if pressed > 2.0 and self._slope().slope < SOFTEST:
            self.failure = f"{force:.2f} N that do not rise over {pressed:.1f} mm of displacement"
        risen = force - first[1] >= self._rise
        if force >= _STOPS * self._wanted and risen and len(self._ramp) >= 3:
            self._fit = self._slope()
            self._rest()
            return LawState(state.e)
        return sinking(state, self._speed, self._period)

    def _slope(self) -> Line:
        return line([d for d, _ in self._ramp], [f for _, f in self._ramp])

    def _rest(self) -> None:
        self._stage, self._waited, self._sum, self._number = "rest", 0.0, 0.0, 0

    def _judge(self, state: LawState) -> None:
        """Go on to the second resting point, or take what two of them tell."""
        (depth, force) = self._rested[0]
        if len(self._rested) == 1:
            slope = self._fit.slope
            if slope < SOFTEST:
                self.failure = f"{force:.2f} N that do not rise with displacement"
                return
            gap = self._wanted - force
            if abs(gap) < (1.0 - _BACK) * self._wanted:
                gap = -_BACK * force
            way = _PRESSES * gap / slope
            self._goal = state.e - min(max(way, -_LONGEST), _LONGEST)
            self._stage = "press"
            return
        stiffness = static_stiffness(
            (depth, self._rested[1][0]), (force, self._rested[1][1]), 0.5 * _APART * self._wanted
        )
        if stiffness is None or stiffness < SOFTEST:
            self.failure = (
                f"{self._rested[1][1]:.2f} N that do not change over "
                f"{abs(self._rested[1][0] - depth):.2f} mm of displacement"
            )
            return
        late = delay_of_move(self._way, (self._rested[0], self._rested[1]), self._period)
        self.found = MeasuredContact(stiffness, late)
