"""What the loop feels: the sensor's wrench, and the force coupling that presses with it."""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from dmpcli.admittance import force_coupling
from dmpcli.admittance.force_coupling import Filter
from dmpcli.admittance.normal_estimation import Vector, dot
from dmpcli.arrays import Floats
from dmpcli.control import guards
from dmpcli.control.contact_supervisor import ContactSupervisor
from dmpcli.control.contact_tally import ContactTally
from dmpcli.control.coupled_plan import lifts, setpoints
from dmpcli.control.force_sensing import Sensing
from dmpcli.control.met_wall import MetWall, against, met, resisting
from dmpcli.control.normal_sensing import NormalPolicy, NormalSense
from dmpcli.instruments.protocols import RobotState, Sample
from dmpcli.planning.plan import Plan

LONG = 0.15
"""A look-ahead beyond which the coupling holds the force badly, s."""

# What the tool meets on its way down, before the zero is taken, as a multiple of the set-point.
_MET = 1.0
# Readings that are remembered of the cycles before.
_REMEMBERED = 6


class ForceTracker:
    """Eq. (10) at work: from the force along the normal to a displacement of the set-point.

    Parameters
    ----------
    supervisor : ContactSupervisor
        One for all strokes of a run.
    filter_ : Filter
        Of the plan's servo period.
    plan : Plan
        With normals.
    override : float or None
        F_d of all of the stroke that is drawn in contact, N; None takes the plan's own.
    tally : ContactTally, optional
        Of the strokes before.
    sense : NormalSense, optional
        What follows the surface's normal.

    Attributes
    ----------
    supervisor : ContactSupervisor
    tally : ContactTally
        What was felt on the strokes, with `on` of all of them.
    sense : NormalSense
        The same of the surface's normal.
    wall : MetWall or None
        What ended the run, if a wall did and its force was seen to rise.
    drift : float or None
        By how much the zero has moved since it was taken, N, where the tool came clear at last.
    """

    def __init__(
        self,
        supervisor: ContactSupervisor,
        filter_: Filter,
        plan: Plan,
        override: float | None = None,
        tally: ContactTally | None = None,
        sense: NormalSense | None = None,
    ) -> None:
        if plan.normal is None:
            raise ValueError("a plan without normals has nothing to press along")
        self.supervisor, self._filter, self._plan = supervisor, filter_, plan
        self._override = override
        self.tally = ContactTally() if tally is None else tally
        self.tally.begin(plan.id)
        self.sense = NormalSense(plan.period, NormalPolicy()) if sense is None else sense
        self.sense.begin()
        self.wall: MetWall | None = None
        self.drift: float | None = None
        self._delta = (0.0, 0.0)
        self._zero, self._zeros = np.zeros(3), 0
        self._wanted = setpoints(plan, supervisor.policy.setpoint, override)
        self._reach = float((plan.position[-1] - plan.position[plan.last]) @ plan.normal[-1])
        self._lifts = lifts(plan, supervisor.policy)
        self._lift = supervisor.policy.reach
        supervisor.lifted(0.0)
        supervisor.begin(airborne=self._wanted[plan.lead] <= 0.0)

    def on(self, plan: Plan) -> "ForceTracker":
        """Return the same supervisor and filter on another plan; nothing was felt there yet."""
        tally, sense = self.tally, self.sense
        return ForceTracker(self.supervisor, self._filter, plan, self._override, tally, sense)

    def follow(self, plan: Plan) -> None:
        """Go on with a plan that is the same up to here, and whose end has moved in its plane."""
        self._plan = plan
        self._wanted = setpoints(plan, self.supervisor.policy.setpoint, self._override)

    @property
    def e(self) -> float:
        """Output of the law, mm along the normal."""
        return self.supervisor.e

    @property
    def settled(self) -> bool:
        """The stroke may begin: the force holds its set-point, or is not asked for at its start."""
        return self.supervisor.settled

    @property
    def failure(self) -> str:
        """Why the run must end; empty while it need not."""
        return self.supervisor.failure

    def wanted(self, index: float) -> float:
        """F_d at a set-point's number, N; 0 where the tool is lifted, and off the stroke."""
        number = int(index + 1e-9)
        return float(self._wanted[min(number, len(self._wanted) - 1)])

    def displace(
        self, index: float, wrench: Floats, t: float = 0.0, position: Floats | None = None
    ) -> Floats:
        """Return what to add to the set-point, shape (3,), mm.

        Parameters
        ----------
        index : float
            Number of the set-point.
        wrench : array, shape (6,)
            On the tool, base axes, N and N·m.
        t : float
            s since the first set-point.
        position : array, shape (3,), optional
            Of the tool, mm; without it nothing is learned of the surface's normal.
        """
        supervisor, plan = self.supervisor, self._plan
        R = plan.rotation[min(round(index), len(plan) - 1)]
        if supervisor.zeroing:
            self._zero = self._zero + R.T @ wrench[:3]
            self._zeros += 1
        elif self._zeros:
            self._zero = self._zero / self._zeros
            self._zeros = 0
            supervisor.zero_is(t, float(np.linalg.norm(self._zero)))
        # In plain floats: arrays of three take ten times as long.
        across = plan.normal_at(index)
        planned = _vector(across)
        fx, fy, fz = felt = _vector(wrench)
        if not self._zeros:
            zx, zy, zz = _vector(R @ self._zero)
            fx, fy, fz = felt = fx - zx, fy - zy, fz - zz
        wanted = self.wanted(index)
        if position is not None and index > plan.lead and supervisor.state == "drawing":
            # Where the surface is: as the force that is asked for changes, the tool's spring does.
            k = supervisor.stiffness
            pushed = (0.0 if k is None else wanted / k) * across
            self.sense.feel(t, felt, _vector(position + pushed), planned)
        else:
            self.sense.lift()
        # The force is held along the surface's own normal, where that is asked for; the tool is
        # displaced along the planned one, so that it draws the plan carried along its normals.
        normal = x, y, z = self.sense.normal(planned)
        force = dot(felt, normal)
        friction = self.sense.friction
        side = (fx - force * x, fy - force * y, fz - force * z)
        resists = resisting(side, self._way(index), friction * force)
        supervisor.step(t, force, resists, wanted, friction)
        if index > plan.lead and wanted > 0.0:
            touching = force > min(supervisor.policy.contact, wanted / 2.0)
            self.tally.add(force, wanted, touching and not supervisor.doubted, supervisor.saturated)
        self._delta = force_coupling.follow(self._filter, self._delta, supervisor.e)
        moved: Floats = self._delta[0] * across
        return moved

    def _way(self, index: float) -> Vector:
        """From the set-point before to this one, mm."""
        plan = self._plan
        number = min(round(index), len(plan) - 1)
        return _vector(plan.position[number] - plan.position[max(number - 1, 0)])

    def look_back(
        self, index: float, readings: Sequence[tuple[float, Floats]], between: float
    ) -> None:
        """Take in what was felt until the arm stood: of a wall, how hard and how stiff it was.

        Parameters
        ----------
        index : float
            Number of the set-point at which it was ended.
        readings : sequence of tuple
            Time, s, and wrench as for `displace`, of each reading from just before the end.
        between : float
            From one reading to the next, s.
        """
        supervisor, plan = self.supervisor, self._plan
        if supervisor.across is None or self.wall is not None or not readings:
            return
        number = min(round(index), len(plan) - 1)
        normal = np.array(self.sense.normal(_vector(plan.normal_at(index))))
        zero = plan.rotation[number] @ self._zero
        felt = [(t, wrench[:3] - zero) for t, wrench in readings]
        velocity = np.array(self._way(index)) / plan.period
        series, speed = against(felt, normal, velocity, self.sense.friction)
        reaction = supervisor.reaction + between
        self.wall = met(supervisor.across, series, speed, reaction, plan.period)
        if self.wall is not None:
            supervisor.failure += f" ({self.wall})"

    def clear(self, readings: Sequence[tuple[float, Floats]], rotation: Floats) -> None:
        """Take in what is felt where the tool has come clear at last: how far its zero has moved.

        Parameters
        ----------
        readings : sequence of tuple
            Time, s, and wrench as for `displace`, of the last readings.
        rotation : array, shape (3, 3)
            Of the tool meanwhile.
        """
        if readings and self.supervisor.state == "retreating" and not self._zeros:
            felt = np.mean([wrench[:3] for _, wrench in readings], axis=0)
            self.drift = float(np.linalg.norm(rotation.T @ felt - self._zero))

    def come(self, index: float, wrench: Floats | None, t: float) -> Floats:
        """Return what to add on the way to the stroke: it ends over the plan, by the reach.

        What is met there, before anything was looked for, ends the run.

        Parameters
        ----------
        index : float
            Number of a set-point before the stroke's first.
        wrench : array, shape (6,), or None
            As in `displace`.
        t : float
            s.
        """
        plan, supervisor = self._plan, self.supervisor
        normal = plan.normal_at(index)
        e = self._lift * float(self._lifts[int(index)])
        supervisor.lifted(e)
        if wrench is not None:
            force = float(normal @ wrench[:3])
            most = _MET * supervisor.policy.setpoint + supervisor.policy.zero_limit
            if force > most:
                supervisor.fail(
                    t,
                    "too hard",
                    f"{force:.1f} N on the way down to stroke {plan.id}: the surface lies nearer "
                    f"than {self._lift:g} mm over the plan; see where the part is",
                    urgent=True,
                )
        self._delta = force_coupling.follow(self._filter, self._delta, e)
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

    def leave(self, index: float, t: float = 0.0) -> Floats:
        """Return the last displacement on the way off the work: it ends where that way ends.

        Nothing is felt any more: the share that is left goes with the way that is left.

        Parameters
        ----------
        index : float
            Number of a set-point after the stroke's last.
        t : float
            s.

        Returns
        -------
        array, shape (3,)
            mm.
        """
        self.supervisor.leaves(t)
        plan, normal = self._plan, self._plan.normal_at(index)
        gone = float((plan.at(index).position - plan.position[plan.last]) @ normal) / self._reach
        left: Floats = max(1.0 - gone, 0.0) * self._delta[0] * normal
        return left

    def retreat(self, index: float, t: float) -> Floats:
        """Return what to add where the plan itself does not leave the work: the tool is lifted.

        Parameters
        ----------
        index : float
            Number of the stroke's last set-point.
        t : float
            s.
        """
        self._delta = force_coupling.follow(self._filter, self._delta, self.supervisor.retreat(t))
        return self.hold(index)

    def facts(self) -> dict[str, Any]:
        """Return what a run file says of the contact; empty where nothing was drawn."""
        supervisor = self.supervisor
        events = [
            {"t": round(one.t, 6), "state": one.state, "detail": one.detail}
            for one in supervisor.events
        ]
        found = self.tally.facts(supervisor.policy.contact)
        if not found:
            return {"contact_events": events}
        found |= {"landing_peak": supervisor.landing_peak} | self.sense.facts()
        if self.wall is not None:
            found["wall"] = asdict(self.wall) | {"unavoidable": self.wall.unavoidable}
        if self.drift is not None:
            found["zero_drift"] = self.drift
        for name in ("stiffness", "delay"):
            if getattr(supervisor, name) is not None:
                found[name] = getattr(supervisor, name)
        return {"contact": found, "contact_events": events}

    def gains(self) -> dict[str, float]:
        """Return the law's gains, once they are known."""
        known = self.supervisor.gains
        if known is None:
            return {}
        found = {"mass": known.mass, "damping": known.damping}
        return found if np.isinf(known.integral) else found | {"integral_time": known.integral}


def _vector(array: Floats) -> Vector:
    """The first three numbers of an array."""
    x, y, z = array[:3].tolist()
    return x, y, z


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
    _heard: deque[Sample] = field(default_factory=lambda: deque(maxlen=_REMEMBERED), repr=False)

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
        self._heard.extend(samples)
        # Not np.mean, which takes ten times as long for one or two.
        sensed = samples[0].wrench
        for sample in samples[1:]:
            sensed = sensed + sample.wrench
        wrench = self.compensate(sensed / len(samples), state.rotation)
        guards.check_wrench(wrench, force, torque)
        return wrench

    def look_back(self, rotation: Floats) -> list[tuple[float, Floats]]:
        """Return what was felt reading by reading, from some cycles ago to now, as far as it came.

        Parameters
        ----------
        rotation : array, shape (3, 3)
            Of the tool meanwhile.

        Returns
        -------
        list of tuple
            Time, s, and wrench on the tool, shape (6,), at the TCP, base axes.
        """
        readings = [*self._heard, *self.sensing.rest()]
        return [(one.t, self.compensate(one.wrench, rotation)) for one in readings]
