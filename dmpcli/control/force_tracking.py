"""What the loop feels: the sensor's wrench, and the force coupling that presses with it."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from dmpcli.admittance import force_coupling
from dmpcli.admittance.force_coupling import CouplingLaw, Displacement, Filter
from dmpcli.arrays import Floats
from dmpcli.control import guards
from dmpcli.control.force_sensing import Sensing
from dmpcli.instruments.protocols import RobotState
from dmpcli.planning.plan import Plan

# The force has settled when it stays this near to the set-point for this long.
SETTLED_SHARE, SETTLED_TIME = 0.1, 0.1
LONG = 0.15
"""A look-ahead beyond which the coupling holds the force badly, s."""
# A coupling so slow that it has found nothing by then is a mistake, s.
LONGEST_SEEKING = 60.0


class ForceTracker:
    """Eq. (10) at work: from the force along the normal to a displacement of the set-point.

    Parameters
    ----------
    law : CouplingLaw
    filter_ : Filter
        Of the plan's servo period.
    plan : Plan
        With normals.
    lookahead : float
        By how much the arm lags its set-points, s: what the force does is
        seen that much later, and must have lasted so long.

    Attributes
    ----------
    law : CouplingLaw
    felt : list of float
        Forces along the normal on the stroke, of `on` on all strokes, N.
    e : float
        Output of the admittance model, mm along the normal.
    """

    def __init__(
        self, law: CouplingLaw, filter_: Filter, plan: Plan, lookahead: float = 0.0
    ) -> None:
        self.law = law
        self._lookahead = lookahead
        self._filter = filter_
        self._plan = plan
        self._state = Displacement()
        self._delta = np.zeros(2)
        self._calm = 0.0
        self._found = False
        self.felt: list[float] = []
        self._sought = 0.0
        self._seek = law.setpoint / float(law.model.damping[0])  # mm/s, without contact
        if plan.normal is None:
            raise ValueError("a plan without normals has nothing to press along")
        lift = np.sum(np.diff(plan.position, axis=0) * plan.normal[:-1], axis=-1) / plan.period
        self._retreats = np.append(lift > self._seek, False)
        self._reach = float((plan.position[-1] - plan.position[plan.last]) @ plan.normal[-1])

    def on(self, plan: Plan) -> "ForceTracker":
        """Return the same law and filter on another plan; nothing was felt there yet."""
        other = ForceTracker(self.law, self._filter, plan, self._lookahead)
        other.felt = self.felt
        return other

    @property
    def e(self) -> float:
        """Output of the admittance model, mm along the normal."""
        return self._state.e

    @property
    def settled(self) -> bool:
        """The force has stayed near its set-point."""
        return self._calm >= max(SETTLED_TIME, self._lookahead)

    @property
    def given_up(self) -> str:
        """Why no contact can be had; empty while there is hope."""
        law = self.law
        if not self._state.touched and law.clamp - abs(self._state.e) < 1e-9:
            return f"no contact within {law.clamp:g} mm of the plan"
        if self._sought > min(5.0 + 2.0 * law.clamp / self._seek, LONGEST_SEEKING):
            said = f"the force does not settle at {law.setpoint:g} N"
            if self._lookahead > LONG:
                return f"{said} behind a look-ahead of {self._lookahead:g} s, which is long"
            return said
        return ""

    def displace(self, index: float, wrench: Floats) -> Floats:
        """Return what to add to the set-point, shape (3,), mm.

        Parameters
        ----------
        index : float
            Number of the set-point.
        wrench : array, shape (6,)
            On the tool, base axes, N and N·m.
        """
        normal, period = self._plan.normal_at(index), self._plan.period
        force = float(normal @ wrench[:3])
        near = abs(force - self.law.setpoint) <= SETTLED_SHARE * self.law.setpoint
        self._calm = self._calm + period if near else 0.0
        self._sought += period
        retreat = bool(self._retreats[min(int(index), len(self._plan) - 1)])
        self._found = self._found or self.settled
        if index > self._plan.lead:
            self.felt.append(force)
        # Until it has settled once, a contact that is lost again is sought like the first.
        state = self._state if self._found else replace(self._state, touched=False)
        self._state = force_coupling.displace(self.law, state, force, retreat)
        self._delta = force_coupling.follow(self._filter, self._delta, self._state.e)
        return self.hold(index)

    def hold(self, index: float) -> Floats:
        """Return the last displacement again, along the normal of a set-point; it does not grow.

        For a cycle that feels no force and for one that comes to rest: taken as contact lost, no
        force would make the tool seek the surface.

        Parameters
        ----------
        index : float
            Number of the set-point.

        Returns
        -------
        array, shape (3,)
            mm.
        """
        held: Floats = self._delta[0] * self._plan.normal_at(index)
        return held

    def leave(self, index: float) -> Floats:
        """Return the last displacement on the way off the work: it ends where that way ends.

        Nothing is felt any more: the share that is left goes with the way that is left.

        Parameters
        ----------
        index : float
            Number of a set-point after the stroke's last.

        Returns
        -------
        array, shape (3,)
            mm.
        """
        plan, normal = self._plan, self._plan.normal_at(index)
        gone = float((plan.at(index)[0] - plan.position[plan.last]) @ normal) / self._reach
        left: Floats = max(1.0 - gone, 0.0) * self._delta[0] * normal
        return left


@dataclass(frozen=True)
class ForceInput:
    """What the loop feels with.

    Attributes
    ----------
    sensing : Sensing
    compensate : callable
        From the wrench as sensed, shape (6,), and the tool's rotation to the wrench on the tool,
        at the TCP, in base axes.
    pressing : ForceTracker or None
        The coupling if it was asked for.
    """

    sensing: Sensing
    compensate: Callable[[Floats, Floats], Floats]
    pressing: ForceTracker | None = None

    def feel(
        self, state: RobotState, now: float, force: float = np.inf, torque: float = np.inf
    ) -> Floats | None:
        """Return the mean wrench of the last period or two, or the newest one while it is fresh.

        Parameters
        ----------
        state : RobotState
            For the tool's rotation.
        now : float
            s, on the loop's clock.
        force, torque : float
            The most that the tool may meet, N and N·m.

        Returns
        -------
        array, shape (6,), or None
            N and N·m; None where no sample is fresh enough to be believed.

        Raises
        ------
        InstrumentError
            The sensor is silent, or a sample must not be believed.
        RefusedError
            The tool meets more.
        """
        samples = self.sensing.recent(now)
        if not samples:
            return None
        # Not np.mean, which takes ten times as long for one or two.
        sensed = samples[0].wrench
        for sample in samples[1:]:
            sensed = sensed + sample.wrench
        wrench = self.compensate(sensed / len(samples), state.rotation)
        guards.check_wrench(wrench, force, torque)
        return wrench
