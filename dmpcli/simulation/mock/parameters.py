"""What the simulated instruments are made of; every number with its unit."""

from dataclasses import dataclass, field

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.spatial.rotations import from_euler
from dmpcli.spatial.wrench import Tool

PEN_DOWN = from_euler(np.array([np.pi, 0.0, 0.0]))
"""Attitude of a pen that points straight down, Rx(π)."""

PEN = Tool(
    tcp_position=np.array([0.0, 0.0, 160.0]),
    tcp_rotation=np.eye(3),
    sensor_position=np.array([0.0, 0.0, 25.0]),
    sensor_rotation=np.eye(3),
    weight=6.0,
    centre=np.array([1.0, -2.0, 45.0]),
    zero=np.array([1.2, -0.8, 3.5, 0.02, -0.03, 0.01]),
)
"""A printed pen holder on a Mini45: 6 N, sensor 25 mm and pen tip 160 mm below the flange."""


@dataclass(frozen=True)
class ServoParameters:
    """A position servo: each set-point is reached one period after it came, behind a lag.

    Attributes
    ----------
    lag : float
        Time constant of the first-order lag behind the set-points, s.
    speed, turning : float
        Fastest that the set-points are followed, mm/s and rad/s.
    shortest_period, longest_period : float
        s.
    """

    lag: float = 0.03
    speed: float = 1000.0
    turning: float = 1.57
    shortest_period: float = 0.002
    longest_period: float = 0.1


@dataclass(frozen=True)
class DragParameters:
    """The robot's own drag teaching: a heavy arm whose friction is compensated in part.

    Each axis of the base frame stands for a joint: it sticks until `start` of the rated force, then
    slides against a friction that falls to `friction` of it as the slide grows faster (Stribeck).

    Attributes
    ----------
    rated_force, rated_torque : float
        What 100 % is at the TCP, N and N·m. 60 N is what an arm of the 6 kg class carries; no
        maker's figure.
    friction, start : float
        Coulomb friction while sliding and the force that starts a slide, share of the rated one
        (section 3.1 of the paper: 5 % and 10 %).
    stribeck, turning_stribeck : float
        Speed over which the friction falls by 1 - 1/e of the way, mm/s and rad/s.
    mass, inertia : float
        Of the arm, felt at the TCP, N·s²/mm and kg·m².
    damping, turning_damping : float
        Viscous, N·s/mm and N·m·s/rad.
    """

    rated_force: float = 60.0
    rated_torque: float = 6.0
    friction: float = 0.05
    start: float = 0.10
    stribeck: float = 20.0
    turning_stribeck: float = 0.1
    mass: float = 0.015
    inertia: float = 0.2
    damping: float = 0.02
    turning_damping: float = 0.5


@dataclass(frozen=True)
class Plate:
    """A flat plate that pushes back like a spring where the pen presses into it.

    Attributes
    ----------
    point, normal : array, shape (3,)
        A point of its surface, mm, and the unit normal on the tool's side.
    stiffness : float
        N/mm.
    damping : float
        N·s/mm, while in contact; the plate never pulls.
    friction : float
        Coulomb coefficient of the pen.
    sliding : float
        Speed from which the friction is full, mm/s; below, it grows in proportion.
    """

    point: Floats
    normal: Floats = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    stiffness: float = 5.0
    damping: float = 0.01
    friction: float = 0.2
    sliding: float = 5.0

    def under(self, position: Floats) -> tuple[float, Floats]:
        """Return the depth of a point in the plate, mm, and the normal; see `contact.Solid`."""
        return float(self.normal @ (self.point - position)), self.normal


@dataclass(frozen=True)
class SensorParameters:
    """A six-axis sensor like an ATI Mini45, calibration SI-145-5.

    Attributes
    ----------
    limit : array, shape (6,)
        Measuring range, N and N·m.
    noise : array, shape (6,)
        Standard deviation of the white noise of one reading, N and N·m.
    drift : array, shape (6,)
        Standard deviation of the zero's constant drift, N/s and N·m/s.
    highest_rate : float
        Hz.
    """

    limit: Floats = field(default_factory=lambda: np.array([145.0, 145.0, 290.0, 5.0, 5.0, 5.0]))
    noise: Floats = field(default_factory=lambda: np.array([0.02, 0.02, 0.06, 8e-4, 8e-4, 8e-4]))
    drift: Floats = field(default_factory=lambda: np.array([2e-3] * 3 + [2e-5] * 3))
    highest_rate: float = 7000.0


@dataclass(frozen=True)
class Faults:
    """What goes wrong on purpose, and when: s after the lab opened; infinite is never.

    Attributes
    ----------
    estop_at : float
        The emergency stop is pressed.
    silent_at : float
        The sensor sends nothing from then on.
    refuse_at : float
        The controller refuses set-points from then on.
    """

    estop_at: float = np.inf
    silent_at: float = np.inf
    refuse_at: float = np.inf


@dataclass(frozen=True)
class Scene:
    """Everything that the mock lab is made of.

    Attributes
    ----------
    position, rotation : array, shape (3,) and (3, 3)
        Where the TCP stands at the beginning, mm.
    plate : Plate, optional
        None: nothing to touch.
    seed : int
        Of the sensor's noise and drift.
    """

    position: Floats = field(default_factory=lambda: np.array([-551.030, 131.399, -17.560]))
    rotation: Floats = field(default_factory=lambda: PEN_DOWN.copy())
    plate: Plate | None = None
    tool: Tool = PEN
    servo: ServoParameters = field(default_factory=ServoParameters)
    drag_teaching: DragParameters = field(default_factory=DragParameters)
    sensor: SensorParameters = field(default_factory=SensorParameters)
    faults: Faults = field(default_factory=Faults)
    seed: int = 0
