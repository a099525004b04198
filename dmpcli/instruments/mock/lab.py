"""The mock lab: one arm, one plate, one sensor and a hand, advanced by the loop's clock.

The physics is quasi-static: the arm goes where its servo (or its drag teaching) takes it, and the
forces of hand and plate follow from the pose it has. Time advances when somebody asks, on the
sensor's grid, so that simulated and real time give the same experiment.
"""

from typing import Protocol

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.instruments.mock.arms import DraggedArm, ServoArm
from dmpcli.instruments.mock.parameters import Plate, Scene
from dmpcli.instruments.protocols import Clock, RobotMode, Sample
from dmpcli.primitives import wrench

_GRID_RATE = 100.0
_EPS = 1e-9


class Hand(Protocol):
    """Whoever holds the tool."""

    def wrench(self, t: float, position: Floats, rotation: Floats, velocity: Floats) -> Floats:
        """Return the hand's wrench on the tool at the TCP, base axes, shape (6,).

        `t` is the lab's clock, s; `velocity`, shape (6,), in mm/s and rad/s.
        """


class Lab:
    """What the mock sensor and the mock robot share.

    Parameters
    ----------
    clock : Clock
    scene : Scene

    Attributes
    ----------
    hand : Hand or None
        Who holds the tool; nobody at first.
    """

    def __init__(self, clock: Clock, scene: Scene | None = None) -> None:
        self.scene = Scene() if scene is None else scene
        self.clock = clock
        self.hand: Hand | None = None
        self.arm: ServoArm | DraggedArm = ServoArm(
            self.scene.position, self.scene.rotation, self.scene.servo
        )
        self._opened = self._now = self._tick = clock.now()
        self._step = 1.0 / _GRID_RATE
        self._ticks = 0
        self._samples: list[Sample] = []
        self._streaming = False
        self._seq = 0
        self._rng = np.random.default_rng([self.scene.seed, 0x5E])
        self._drift = self.scene.sensor.drift * self._rng.standard_normal(6)
        tool = self.scene.tool
        self._load = wrench.gravity(tool.weight, tool.inclination)
        self._sensor_in_tcp, self._lever = tool.sensor_in_tcp, tool.lever
        self._zero = np.zeros(6) if tool.zero is None else tool.zero

    @property
    def mode(self) -> RobotMode:
        """The robot's mode at the time that the lab has reached."""
        pressed = self._now >= self._opened + self.scene.faults.estop_at - _EPS
        return "emergency stop" if pressed else "ready"

    @property
    def refuses(self) -> bool:
        """Whether the controller refuses set-points."""
        return self._now >= self._opened + self.scene.faults.refuse_at - _EPS

    def stream(self, rate: float) -> None:
        """Let the sensor stream from now on; the grid of the physics becomes the sensor's."""
        self.advance()
        self._step, self._tick, self._ticks = 1.0 / rate, self._now, 0
        self._streaming = True

    def end_stream(self) -> None:
        """Let the sensor stop."""
        self._streaming = False
        self._samples.clear()

    def take_samples(self) -> list[Sample]:
        """Hand out what the sensor has sent since the last call."""
        self.advance()
        taken, self._samples = self._samples, []
        return taken

    def drag_teaching(self) -> None:
        """Hand the arm over to its own drag teaching."""
        self.advance()
        self.arm = DraggedArm(self.arm.position, self.arm.rotation, self.scene.drag_teaching)

    def advance(self) -> None:
        """Bring the lab up to the clock."""
        now = self.clock.now()
        if now <= self._now:
            return
        while (tick := self._tick + (self._ticks + 1) * self._step) <= now + _EPS:
            self._move(tick)
            self._ticks += 1
            if self._streaming or isinstance(self.arm, DraggedArm):
                self._feel(tick)
        self._move(now)

    def _move(self, t: float) -> None:
        estop = self._opened + self.scene.faults.estop_at
        if t > estop:
            if self._now < estop:
                self.arm.advance(estop - self._now)
            self.arm.stand_still()
        elif t > self._now:
            self.arm.advance(t - self._now)
        self._now = max(t, self._now)

    def _feel(self, t: float) -> None:
        arm = self.arm
        force = contact(self.scene.plate, arm.position, arm.velocity)
        if self.hand is not None:
            force = force + self.hand.wrench(t, arm.position, arm.rotation, arm.velocity)
        if isinstance(arm, DraggedArm) and self.mode == "ready":
            arm.wrench = force
        if self._streaming:
            self._sense(t, force)

    def _sense(self, t: float, force: Floats) -> None:
        tool, sensor = self.scene.tool, self.scene.sensor
        noise = sensor.noise * self._rng.standard_normal(6)
        self._seq += 1
        if t >= self._opened + self.scene.faults.silent_at - _EPS:
            return
        R = self.arm.rotation @ self._sensor_in_tcp
        sensed = (
            wrench.to_sensor(force, R, self._lever)
            + wrench.of_weight(R, self._load, tool.centre)
            + self._zero
            + (t - self._opened) * self._drift
            + noise
        )
        healthy = bool(np.all(np.abs(sensed) < sensor.limit))
        read = np.clip(sensed, -sensor.limit, sensor.limit)
        self._samples.append(Sample(t, self._seq, read, healthy, 0))


def contact(plate: Plate | None, position: Floats, velocity: Floats) -> Floats:
    """Wrench of the plate on the pen: spring, damper and friction; it pushes, it never pulls.

    The pen touches with its tip, which is the TCP: there is no torque about it.

    Parameters
    ----------
    plate : Plate, optional
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
    if plate is None:
        return force
    depth = float(plate.normal @ (plate.point - position))
    if depth <= 0.0:
        return force
    away = float(plate.normal @ velocity[:3])
    push = max(plate.stiffness * depth - plate.damping * away, 0.0)
    along = velocity[:3] - away * plate.normal
    speed = float(np.sqrt(along @ along))
    rub = plate.friction * push / max(speed, plate.sliding)
    force[:3] = push * plate.normal - rub * along
    return force
