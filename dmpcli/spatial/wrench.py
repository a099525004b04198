"""The wrench on the tool between the sensor and the TCP, and the wrench of the tool's own weight.

Forces in N, torques in N·m, lengths in mm. A wrench is one array: force first, then torque. All
wrenches act on the tool.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.rotations import skew

METRE = 1000.0
"""Millimetres: a lever in mm times a force in N is METRE times a torque in N·m."""

LEVER = 0.1
"""m: a torque counts as much as the force that has it at this lever, about a tool's length."""


@dataclass(frozen=True)
class Tool:
    """Where TCP and sensor sit on the flange, and what hangs on the sensor.

    Attributes
    ----------
    tcp_position, tcp_rotation : array, shape (3,) and (3, 3)
        Flange → TCP, mm.
    sensor_position, sensor_rotation : array, shape (3,) and (3, 3)
        Flange → sensor, mm.
    weight : float
        Of everything on the sensor's tool side, N.
    centre : array, shape (3,)
        Its centre of mass, from the sensor's origin, sensor axes, mm.
    inclination : array, shape (2,)
        Angles U and V of the robot's base against the vertical, rad; see `gravity`.
    zero : array, shape (6,), optional
        What the sensor reads with nothing on it, N and N·m; None where it is not known.
    sensor : str
        The sensor that the zero was found with; empty where it is not known.
    """

    tcp_position: Floats
    tcp_rotation: Floats
    sensor_position: Floats
    sensor_rotation: Floats
    weight: float
    centre: Floats
    inclination: Floats = field(default_factory=lambda: np.zeros(2))
    zero: Floats | None = None
    sensor: str = ""

    @property
    def sensor_in_tcp(self) -> Floats:
        """Rotation TCP ← sensor, shape (3, 3): ``R_base←sensor = R_base←TCP @ sensor_in_tcp``."""
        return self.tcp_rotation.T @ self.sensor_rotation

    @property
    def lever(self) -> Floats:
        """From the sensor's origin to the TCP, sensor axes, shape (3,), mm."""
        return self.sensor_rotation.T @ (self.tcp_position - self.sensor_position)

    def flange(self, tcp: Pose) -> Pose:
        """Pose of the flange, or many, where the TCP has a pose."""
        R = tcp.rotation @ self.tcp_rotation.T
        return Pose(tcp.position - R @ self.tcp_position, R)

    def with_zero(self, zero: Floats | None) -> "Tool":
        """Return the same tool with another zero, shape (6,)."""
        return replace(self, zero=zero)


def gravity(weight: float, inclination: Floats) -> Floats:
    """Weight as a vector in base axes, for a robot whose base is inclined.

    ``L = G [cos U sin V, -sin U, -cos U cos V]``: U = V = 0 is a base that stands upright.

    Parameters
    ----------
    weight : float
        N.
    inclination : array, shape (2,)
        U, V in rad.

    Returns
    -------
    array, shape (3,)
        N.
    """
    u, v = inclination
    return weight * np.array([np.cos(u) * np.sin(v), -np.sin(u), -np.cos(u) * np.cos(v)])


def weight_and_inclination(load: Floats) -> tuple[float, Floats]:
    """Weight and inclination of a weight vector; undoes `gravity`.

    ``G = |L|``, ``U = asin(-L_y / G)``, ``V = atan2(L_x, -L_z)``.

    Parameters
    ----------
    load : array, shape (3,)
        Base axes, N.

    Returns
    -------
    weight : float
        N.
    inclination : array, shape (2,)
        U in [-π/2, π/2] and V in (-π, π], rad.
    """
    x, y, z = load
    weight = float(np.linalg.norm(load))
    return weight, np.array([np.arctan2(-y, np.hypot(x, z)), np.arctan2(x, -z)])


def of_weight(R: Floats, load: Floats, centre: Floats) -> Floats:
    """Wrench of the tool's own weight, as the sensor feels it.

    ``F = Rᵀ L``, ``M = c × F``.

    Parameters
    ----------
    R : array, shape (..., 3, 3)
        Base ← sensor.
    load : array, shape (3,)
        Weight as a vector, base axes, N.
    centre : array, shape (3,)
        Centre of mass from the sensor's origin, sensor axes, mm.

    Returns
    -------
    array, shape (..., 6)
        Sensor axes, about the sensor's origin.
    """
    force = np.vecmat(load, R)
    return np.concatenate([force, _torque(centre, force)], axis=-1)


def to_tcp(wrench: Floats, R: Floats, lever: Floats) -> Floats:
    """Move a wrench from the sensor to the TCP, and into base axes.

    ``F = R F_s``, ``M = R (M_s - r × F_s)``.

    Parameters
    ----------
    wrench : array, shape (..., 6)
        Sensor axes, about the sensor's origin.
    R : array, shape (..., 3, 3)
        Base ← sensor.
    lever : array, shape (3,)
        r, from the sensor's origin to the TCP, sensor axes, mm.

    Returns
    -------
    array, shape (..., 6)
        Base axes, about the TCP.
    """
    force, torque = wrench[..., :3], wrench[..., 3:]
    torque = torque - _torque(lever, force)
    return np.concatenate([np.matvec(R, force), np.matvec(R, torque)], axis=-1)


def to_sensor(wrench: Floats, R: Floats, lever: Floats) -> Floats:
    """Move a wrench from the TCP and base axes to the sensor; undoes `to_tcp`.

    Parameters
    ----------
    wrench : array, shape (..., 6)
        Base axes, about the TCP.
    R : array, shape (..., 3, 3)
        Base ← sensor.
    lever : array, shape (3,)
        r, from the sensor's origin to the TCP, sensor axes, mm.

    Returns
    -------
    array, shape (..., 6)
        Sensor axes, about the sensor's origin.
    """
    force, torque = np.vecmat(wrench[..., :3], R), np.vecmat(wrench[..., 3:], R)
    return np.concatenate([force, torque + _torque(lever, force)], axis=-1)


def _torque(lever: Floats, force: Floats) -> Floats:
    """``r × F`` in N·m, of a lever in mm, shape (3,), and forces, shape (..., 3)."""
    torque: Floats
    if force.ndim > 1:
        torque = np.matvec(skew(lever) / METRE, force)
        return torque
    # In plain floats: several times faster, for control loops.
    (x, y, z), (u, v, w) = lever.tolist(), force.tolist()
    torque = np.array([y * w - z * v, z * u - x * w, x * v - y * u])
    return torque / METRE
