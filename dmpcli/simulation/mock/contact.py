"""What the tool feels and what the sensor in the wrist makes of it, whichever arm carries them."""

from collections.abc import Iterator
from typing import Protocol

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.simulation.mock.parameters import SensorParameters
from dmpcli.spatial import wrench
from dmpcli.spatial.wrench import Tool

# Readings whose noise is drawn at once: the loop that asks for them has other work to do.
_DRAWN = 256


class Hand(Protocol):
    """Whoever holds the tool."""

    def wrench(self, t: float, position: Floats, rotation: Floats, velocity: Floats) -> Floats:
        """Return the hand's wrench on the tool at the TCP, base axes, shape (6,).

        Parameters
        ----------
        t : float
            The lab's clock, s.
        position, rotation : array, shape (3,) and (3, 3)
            Of the TCP in the base frame, mm.
        velocity : array, shape (6,)
            Of the TCP, base axes, mm/s and rad/s.

        Returns
        -------
        array, shape (6,)
            N and N·m.
        """


class Solid(Protocol):
    """Something solid that the tool may touch: its shape, and what it is made of."""

    @property
    def stiffness(self) -> float:
        """N/mm."""

    @property
    def damping(self) -> float:
        """N·s/mm."""

    @property
    def friction(self) -> float:
        """Coulomb coefficient of the pen."""

    @property
    def sliding(self) -> float:
        """Speed from which the friction is full, mm/s; below, it grows in proportion."""

    def under(self, position: Floats) -> tuple[float, Floats]:
        """Return how deep a point lies in it, mm, and the unit normal there.

        The depth is negative above the surface; the normal, shape (3,), is on the tool's side.
        """


def contact(ground: Solid | None, position: Floats, velocity: Floats) -> Floats:
    """Wrench of the ground on the pen: spring, damper and friction; it pushes, it never pulls.

    The pen touches with its tip, which is the TCP: there is no torque about it.

    Parameters
    ----------
    ground : Solid, optional
    position : array, shape (3,)
        Pen tip, mm.
    velocity : array, shape (6,)
        mm/s and rad/s.

    Returns
    -------
    array, shape (6,)
        N and N·m, base axes, about the TCP.
    """
    force = np.zeros(6)
    if ground is None:
        return force
    depth, normal = ground.under(position)
    if depth <= 0.0:
        return force
    away = float(normal @ velocity[:3])
    push = max(ground.stiffness * depth - ground.damping * away, 0.0)
    along = velocity[:3] - away * normal
    speed = float(np.sqrt(along @ along))
    rub = ground.friction * push / max(speed, ground.sliding)
    force[:3] = push * normal - rub * along
    return force


class Wrist:
    """A sensor between flange and tool: it feels what pulls at the tool, and the tool's own weight.

    Its zero is off and drifts, and every reading has white noise.

    Parameters
    ----------
    tool : Tool
        As it truly is; a zero of None is a sensor that reads 0 with nothing on it.
    sensor : SensorParameters
    seed : int
        Of noise and drift.
    """

    def __init__(self, tool: Tool, sensor: SensorParameters, seed: int) -> None:
        self._sensor = sensor
        self._rng = np.random.default_rng([seed, 0x5E])
        self._drift = sensor.drift * self._rng.standard_normal(6)
        self._load = wrench.gravity(tool.weight, tool.inclination)
        self._centre = tool.centre
        self._sensor_in_tcp, self._lever = tool.sensor_in_tcp, tool.lever
        self._zero = np.zeros(6) if tool.zero is None else tool.zero
        self._noise = self._drawn()

    def noise(self) -> Floats:
        """Draw the noise of one reading, shape (6,)."""
        return next(self._noise)

    def _drawn(self) -> Iterator[Floats]:
        while True:
            yield from self._sensor.noise * self._rng.standard_normal((_DRAWN, 6))

    def sensed(self, force: Floats, rotation: Floats, age: float, noise: Floats) -> Floats:
        """Return one reading, shape (6,), N and N·m, sensor axes; it may be out of range.

        Parameters
        ----------
        force : array, shape (6,)
            Wrench on the tool at the TCP, base axes.
        rotation : array, shape (3, 3)
            Of the TCP.
        age : float
            How long the zero has drifted, s.
        noise : array, shape (6,)
        """
        R = rotation @ self._sensor_in_tcp
        weight = wrench.of_weight(R, self._load, self._centre)
        return self.shown(weight, force, rotation, age, noise)

    def shown(
        self, felt: Floats, force: Floats, rotation: Floats, age: float, noise: Floats
    ) -> Floats:
        """Return one reading where what acts at the sensor is known in part.

        Parameters
        ----------
        felt : array, shape (6,)
            At the sensor, sensor axes, with the tool's weight.
        force, rotation, age, noise
            What else acts on the tool, and the rest, as in `sensed`.
        """
        R = rotation @ self._sensor_in_tcp
        pulled = wrench.to_sensor(force, R, self._lever)
        return pulled + felt + self._zero + age * self._drift + noise
