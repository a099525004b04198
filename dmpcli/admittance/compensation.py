"""From what the sensor senses to the wrench that moves the tool.

Zero offset, tool weight, centre of mass and inclination come off; the rest is moved to the TCP and
into base axes; then a low-pass at the sensor's rate and a continuous dead-band.
"""

import math

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.spatial import wrench
from dmpcli.spatial.wrench import Tool


class Compensation:
    """Static compensation of one tool: no memory, one reading or many.

    Parameters
    ----------
    tool : Tool
        With its zero, or see `zeroed`.
    """

    def __init__(self, tool: Tool) -> None:
        self.tool = tool
        self._zero = np.zeros(6) if tool.zero is None else tool.zero
        self._load = wrench.gravity(tool.weight, tool.inclination)
        self._sensor_in_tcp, self._lever = tool.sensor_in_tcp, tool.lever

    def __call__(self, sensed: Floats, rotation: Floats) -> Floats:
        """Return the external wrench on the tool.

        ``F_ext = F - F0 - Rᵀ L``, ``M_ext = M - M0 - c × Rᵀ L``, then moved to the TCP.

        Parameters
        ----------
        sensed : array, shape (..., 6)
            N and N·m, sensor axes, about the sensor's origin.
        rotation : array, shape (..., 3, 3)
            Of the TCP in base axes.

        Returns
        -------
        array, shape (..., 6)
            At the TCP, base axes.
        """
        R = rotation @ self._sensor_in_tcp
        external = sensed - self._zero - wrench.of_weight(R, self._load, self.tool.centre)
        return wrench.to_tcp(external, R, self._lever)


def rest_zero(tool: Tool, sensed: Floats, rotation: Floats) -> Floats:
    """Zero of the sensor from readings at rest with nothing on the tool, as 'bias' takes it.

    Parameters
    ----------
    tool : Tool
    sensed : array, shape (n, 6)
        N and N·m, sensor axes.
    rotation : array, shape (3, 3)
        Of the TCP in base axes meanwhile.

    Returns
    -------
    array, shape (6,)
        Their mean, less the tool's weight.
    """
    load = wrench.gravity(tool.weight, tool.inclination)
    weight = wrench.of_weight(rotation @ tool.sensor_in_tcp, load, tool.centre)
    return np.asarray(sensed.mean(axis=0) - weight)


class LowPass:
    """First-order low-pass, stepped at the sensor's rate; it starts from the first value.

    The pole is that of the continuous filter: a step is met to 1 - 1/e after 1/(2π cut-off).

    Parameters
    ----------
    cutoff : float
        Hz.
    rate : float
        Hz.
    """

    def __init__(self, cutoff: float, rate: float) -> None:
        self._share = 1.0 - np.exp(-2.0 * np.pi * cutoff / rate)
        self._value: Floats | None = None

    def __call__(self, value: Floats) -> Floats:
        """Take one value in and return the filtered one."""
        old = value if self._value is None else self._value
        self._value = old + self._share * (value - old)
        return self._value


def dead_band(value: Floats, force: float, torque: float) -> Floats:
    """Shorten force and torque by the width of the dead-band, each as a vector; continuous.

    Taken as vectors the tool answers alike in every direction, whatever the axes.

    Parameters
    ----------
    value : array, shape (6,)
        N and N·m.
    force, torque : float
        Width: what is not larger counts as nothing, N and N·m.

    Returns
    -------
    array, shape (6,)
    """
    out = np.zeros(6)
    for half, width in ((slice(0, 3), force), (slice(3, 6), torque)):
        part = value[half]
        length = math.sqrt(part @ part)
        if length > width:
            out[half] = part * (1.0 - width / length)
    return out
