"""What the loop feels: the sensor's newest wrench, and the force coupling that presses with it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import InstrumentError
from dmpcli.instruments.protocols import Clock, RobotState, Sensor
from dmpcli.primitives import coupling
from dmpcli.primitives.coupling import Displacement, Filter, Law
from dmpcli.streaming.plan import Plan

# Without a fresh sample for so long the sensor counts as dead, s.
SILENCE = 0.1
# A zero is taken over this time, s.
ZERO_TIME = 0.5
# The force has settled when it stays this near to the set-point for this long.
SETTLED_SHARE, SETTLED_TIME = 0.1, 0.1


def at_rest(sensor: Sensor, clock: Clock, long: bool) -> Floats:
    """Wait at rest for the sensor's first samples.

    Parameters
    ----------
    sensor : Sensor
        Started.
    clock : Clock
    long : bool
        Wait long enough for a zero to be taken from them.

    Returns
    -------
    array, shape (n, 6)
        As sensed, N and N·m.

    Raises
    ------
    InstrumentError
        Nothing came.
    """
    pause = ZERO_TIME if long else SILENCE
    clock.sleep_until(clock.now() + pause)
    samples = sensor.poll()
    if not samples:
        raise InstrumentError(
            f"force sensor: sends nothing within {pause:g} s; check cable and power"
        )
    return np.array([sample.wrench for sample in samples])


class Sensing:
    """The newest compensated wrench of a sensor.

    Parameters
    ----------
    sensor : Sensor
        Started.
    compensate : callable
        From the wrench as sensed, shape (6,), and the tool's rotation to the wrench on the tool,
        at the TCP, in base axes.
    first : array, shape (6,)
        A reading from before the loop, as sensed.
    """

    def __init__(
        self, sensor: Sensor, compensate: Callable[[Floats, Floats], Floats], first: Floats
    ) -> None:
        self._sensor = sensor
        self._compensate = compensate
        self._sensed = first
        self._heard: float | None = None

    def read(self, state: RobotState) -> Floats:
        """Return the mean wrench since the last call, or the one before.

        Parameters
        ----------
        state : RobotState
            For the time and the tool's rotation.

        Returns
        -------
        array, shape (6,)
            N and N·m.

        Raises
        ------
        InstrumentError
            The sensor is silent, or flags itself or a saturated reading.
        """
        samples = self._sensor.poll()
        for sample in samples:
            if not sample.healthy:
                raise InstrumentError(
                    f"force sensor: sample {sample.seq} is saturated or flagged as faulty; "
                    "check its range and cable"
                )
        if samples:
            self._sensed = np.mean([sample.wrench for sample in samples], axis=0)
            self._heard = samples[-1].t
        self._heard = state.t if self._heard is None else self._heard
        silent = state.t - self._heard
        if silent > SILENCE:
            raise InstrumentError(f"force sensor: silent for {silent:.2f} s; check cable and power")
        return self._compensate(self._sensed, state.rotation)


class Pressing:
    """Eq. (10) at work: from the force along the normal to a displacement of the set-point.

    Parameters
    ----------
    law : Law
    filter_ : Filter
        Of the plan's servo period.
    plan : Plan
        With normals.

    Attributes
    ----------
    e : float
        Output of the admittance model, mm along the normal.
    """

    def __init__(self, law: Law, filter_: Filter, plan: Plan) -> None:
        self._law = law
        self._filter = filter_
        self._plan = plan
        self._state = Displacement()
        self._delta = np.zeros(2)
        self._calm = 0.0
        self._sought = 0.0
        self._seek = law.setpoint / float(law.model.damping[0])  # mm/s, without contact
        if plan.normal is None:
            raise ValueError("a plan without normals has nothing to press along")
        lift = np.sum(plan.derivatives()[0][:, 0] * plan.normal[:-1], axis=-1)
        self._retreats = np.append(lift > self._seek, False)

    @property
    def e(self) -> float:
        """Output of the admittance model, mm along the normal."""
        return self._state.e

    @property
    def settled(self) -> bool:
        """The force has stayed near its set-point."""
        return self._calm >= SETTLED_TIME

    @property
    def given_up(self) -> str:
        """Why no contact can be had; empty while there is hope."""
        law = self._law
        if not self._state.touched and law.clamp - abs(self._state.e) < 1e-9:
            return f"no contact within {law.clamp:g} mm of the plan"
        if self._sought > 5.0 + 2.0 * law.clamp / self._seek:
            return f"the force does not settle at {law.setpoint:g} N"
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
        near = abs(force - self._law.setpoint) <= SETTLED_SHARE * self._law.setpoint
        self._calm = self._calm + period if near else 0.0
        self._sought += period
        retreat = bool(self._retreats[min(int(index), len(self._plan) - 1)])
        self._state = coupling.displace(self._law, self._state, force, retreat)
        self._delta = coupling.follow(self._filter, self._delta, self._state.e)
        moved: Floats = self._delta[0] * normal
        return moved


@dataclass(frozen=True)
class Touch:
    """What the loop feels with: a sensor, and the coupling if it was asked for."""

    sensing: Sensing
    pressing: Pressing | None = None
