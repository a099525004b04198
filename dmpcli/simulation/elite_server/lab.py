"""The virtual lab: one EC66 with its controller, one tool, one part, one sensor and a hand.

Time is the machine's own. Whoever asks brings the lab up to now: the sensor's box, a request to the
controller, a monitor frame. One lock makes that one experiment.
"""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.kinematics import inverse
from dmpcli.kinematics.models import Arm, model
from dmpcli.simulation.elite_server import monitor
from dmpcli.simulation.elite_server.behaviour import Behaviour
from dmpcli.simulation.elite_server.controller import SimulatedController
from dmpcli.simulation.elite_server.faults import Event
from dmpcli.simulation.elite_server.joint_arm import LAG, FeelingArm, JointArm
from dmpcli.simulation.elite_server.visiting_hand import VisitingHand
from dmpcli.simulation.mock.contact import Solid, Wrist, contact
from dmpcli.simulation.mock.parameters import PEN, PEN_DOWN, SensorParameters
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.wrench import Tool

ROBOT_MODEL = "ec66"

READY = np.radians([0.0, -110.0, -110.0, -50.0, -90.0, 90.0])
"""Elbow up and tool down; of the postures that reach the start the one nearest to this, rad."""


@dataclass(frozen=True)
class LabParameters:
    """What the virtual lab is made of.

    Attributes
    ----------
    position, rotation : array, shape (3,) and (3, 3)
        Where the TCP is parked, mm.
    tool : Tool
        As it truly is.
    ground : Solid or None
        What the tool may touch.
    sensor : SensorParameters
    habits : Behaviour
    events : tuple of Event
        What happens to the controller.
    lag : float
        Of the joints' servos, s.
    seed : int
        Of the sensor's noise and drift.
    physics : callable, optional
        Makes an arm that feels of the setting and its joints, shape (6,), rad; without it the arm
        goes where it is led, and `ground` pushes back like a spring.
    """

    position: Floats
    rotation: Floats = field(default_factory=lambda: PEN_DOWN.copy())
    tool: Tool = PEN
    ground: Solid | None = None
    sensor: SensorParameters = field(default_factory=SensorParameters)
    habits: Behaviour = field(default_factory=Behaviour)
    events: tuple[Event, ...] = ()
    lag: float = LAG
    seed: int = 0
    physics: "Callable[[LabParameters, Floats], FeelingArm] | None" = None


def parked(arm: Arm, tool: Tool, tcp: Pose) -> Floats:
    """Joint angles, shape (6,), rad, that bring the TCP to a pose.

    Of several branches it is the one nearest to the arm's ready posture.

    Parameters
    ----------
    arm : Arm
    tool : Tool
        Tells where the flange is for the TCP.
    tcp : Pose
        In the base frame, mm.

    Raises
    ------
    RefusedError
        The pose is out of reach, or beyond a joint's limit.
    """
    return inverse.nearest(arm, tool.flange(tcp), READY)


class VirtualLab:
    """What the simulated controller and the simulated sensor share; thread-safe.

    Parameters
    ----------
    setting : LabParameters
    hand : VisitingHand, optional
    clock : callable
        Time, s.

    Attributes
    ----------
    controller : SimulatedController
        To be read with `lock` held.
    lock : RLock
    drop : callable
        Called with ``robot``, ``monitor`` or ``both`` when connections shall drop.

    Raises
    ------
    RefusedError
        The arm cannot be parked where the setting says.
    """

    def __init__(
        self,
        setting: LabParameters,
        hand: VisitingHand | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        arm = model(ROBOT_MODEL)
        joints = parked(arm, setting.tool, Pose(setting.position, setting.rotation))
        if setting.physics is None:
            moved = JointArm(arm, setting.tool, joints, setting.lag)
        else:
            moved = setting.physics(setting, joints)
        self.controller = SimulatedController(moved, setting.habits)
        self.lock = threading.RLock()
        self.drop: Callable[[str], None] = lambda _: None
        self._wrist = Wrist(setting.tool, setting.sensor, setting.seed)
        self._ground, self._hand, self._clock = setting.ground, hand, clock
        self._opened = self._now = self.controller.now = clock()
        for event in setting.events:
            if event.at is None:
                self._happen(event)
        later = [(event.at, event) for event in setting.events if event.at is not None]
        self._coming = sorted(later, key=lambda pair: pair[0])

    def call(self, method: str, params: dict[str, Any]) -> Any:
        """Carry out one request to the controller; see `SimulatedController.call`."""
        with self.lock:
            self._advance(self._clock())
            return self.controller.call(method, params)

    def frame(self) -> bytes:
        """Return a monitor frame of now."""
        with self.lock:
            self._advance(self._clock())
            return monitor.frame(self.controller, time.time_ns() // 1_000_000)

    def wrench(self, t: float) -> Floats:
        """Return what the sensor feels at time `t`, shape (6,), N and N·m, out of range or not."""
        with self.lock:
            self._advance(t)
            t = self._now
            arm, noise = self.controller.arm, self._wrist.noise()
            at, pull = arm.posture, np.zeros(6)
            if self._hand is not None:
                pull = self._hand.wrench(t, at.position, at.rotation, at.velocity)
            if isinstance(arm, FeelingArm):
                return self._wrist.shown(arm.felt(), pull, at.rotation, t - self._opened, noise)
            force = contact(self._ground, at.position, at.velocity) + pull
            return self._wrist.sensed(force, at.rotation, t - self._opened, noise)

    def _advance(self, t: float) -> None:
        """Bring the lab up to `t`, through what happens meanwhile."""
        while self._coming and self.controller.entered is not None:
            after, event = self._coming[0]
            if self.controller.entered + after > t:
                break
            self._move(self.controller.entered + after)
            del self._coming[0]
            self._happen(event)
        self._move(t)

    def _move(self, t: float) -> None:
        if t <= self._now:
            return
        self.controller.now = t
        self.controller.arm.advance(t - self._now)
        self._now = t
        if self._hand is not None:
            self._hand.watch(t, self.controller.arm, self.controller.transmission)

    def _happen(self, event: Event) -> None:
        controller = self.controller
        if event.kind == "estop":
            controller.press_estop()
        elif event.kind == "collision":
            controller.collide()
        elif event.kind == "mode":
            controller.switch(int(event.value))
        elif event.kind == "refuse":
            controller.refuses = True
        else:
            self.drop(str(event.value))
