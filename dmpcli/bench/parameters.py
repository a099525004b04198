"""What the bench is made of; every number with its unit."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.bench.links import Links
from dmpcli.bench.workpiece import Flat, Workpiece
from dmpcli.simulation.mock.parameters import PEN, PEN_DOWN
from dmpcli.spatial.wrench import Tool

LONGEST_STEP = 1e-3
"""s."""

FASTEST = 0.45
"""Of a pen's pace times a step; measured: from about 0.8 on a pressed pen rattles by itself."""


@dataclass(frozen=True)
class Pen:
    """A pen that slides in its holder, on a spring.

    Attributes
    ----------
    stiffness : float
        Of the spring, N/mm.
    travel : float
        How far it slides in before it meets its stop, mm.
    mass : float
        Of what slides, kg.
    damping : float
        Share of the critical one.
    radius : float
        Of its round tip, mm.
    friction : float
        Coulomb coefficient on the surface.
    """

    stiffness: float = 2.0
    travel: float = 40.0
    mass: float = 0.03
    damping: float = 0.5
    radius: float = 1.0
    friction: float = 0.2

    @property
    def pace(self) -> float:
        """How fast the pen's end moves by itself, 1/s: its natural frequency, or its damping."""
        return float(np.sqrt(1e3 * self.stiffness / self.mass)) * max(1.0, 2.0 * self.damping)


@dataclass(frozen=True)
class JointServos:
    """Six position servos.

    Attributes
    ----------
    lag : float
        By how much a joint is behind a command that moves evenly, s.
    delay : float
        From the arrival of a set-point to its effect, s.
    stiffness : array, shape (6,)
        By which a joint gives way under a load, N·m/rad.
    rotors : array, shape (6,)
        Inertia of the rotors behind their gears, kg·m².
    shortest_period, longest_period : float
        s.
    """

    lag: float = 0.025
    delay: float = 0.0
    stiffness: Floats = field(default_factory=lambda: np.array([2e4, 2e4, 2e4, 5e3, 5e3, 2e3]))
    rotors: Floats = field(default_factory=lambda: np.array([1.0, 1.0, 1.0, 0.2, 0.2, 0.2]))
    shortest_period: float = 0.002
    longest_period: float = 0.1


@dataclass(frozen=True)
class WristSensor:
    """The six-axis sensor at the flange.

    Attributes
    ----------
    noise : array, shape (6,)
        Standard deviation of the white noise of one reading, N and N·m.
    bias : array, shape (6,)
        By how much its zero differs from the tool's, N and N·m, sensor axes.
    drift : array, shape (6,)
        By how much the zero moves on in a second, N/s and N·m/s, sensor axes.
    latency : float
        From a reading to its arrival, s.
    limit : array, shape (6,)
        Measuring range, N and N·m.
    """

    noise: Floats = field(default_factory=lambda: np.array([0.05] * 3 + [1e-3] * 3))
    bias: Floats = field(default_factory=lambda: np.zeros(6))
    drift: Floats = field(default_factory=lambda: np.zeros(6))
    latency: float = 0.0
    limit: Floats = field(default_factory=lambda: np.array([145.0, 145.0, 290.0, 5.0, 5.0, 5.0]))


@dataclass(frozen=True)
class BenchParameters:
    """Everything that the bench is made of.

    Attributes
    ----------
    arm : str
        Name of a kinematic model (`dmpcli.kinematics.models`).
    links : Links, optional
        The arm as a file describes it. None: by the maker's kinematics and masses.
    position, rotation : array, shape (3,) and (3, 3)
        Where the TCP, the tip of the pen that nothing presses, stands at first; mm.
    tool : Tool
        As it truly is; its zero of None is a sensor that reads 0 with nothing on it.
    pen : Pen
    servos : JointServos
    sensor : WristSensor
    workpiece : Workpiece
        The true surface.
    step : float, optional
        Of the physics, s. None: 1 ms, halved until the pen's spring is slow beside it.
    seed : int
        Of the sensor's noise.
    truth : Path, optional
        A Parquet file to keep what truly happened in.
    """

    arm: str = "ec66"
    links: Links | None = None
    position: Floats = field(default_factory=lambda: np.array([-551.030, 131.399, -17.560]))
    rotation: Floats = field(default_factory=lambda: PEN_DOWN.copy())
    tool: Tool = field(default_factory=lambda: replace(PEN, zero=None))
    pen: Pen = field(default_factory=Pen)
    servos: JointServos = field(default_factory=JointServos)
    sensor: WristSensor = field(default_factory=WristSensor)
    workpiece: Workpiece = field(default_factory=Flat)
    step: float | None = None
    seed: int = 0
    truth: Path | None = None

    @property
    def grid(self) -> float:
        """The step that is taken, s."""
        step = self.step or LONGEST_STEP
        while self.step is None and self.pen.pace * step > FASTEST:
            step /= 2.0
        return step
