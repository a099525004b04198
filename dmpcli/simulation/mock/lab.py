"""The mock lab: one arm, one plate, one sensor and a hand, advanced by the loop's clock.

The physics is quasi-static: the arm goes where its servo (or its drag teaching) takes it, and the
forces of hand and plate follow from the pose it has. Time advances when somebody asks, on the
sensor's grid, so that simulated and real time give the same experiment.
"""

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.instruments.protocols import Clock, RobotMode, Sample
from dmpcli.simulation.mock.arms import DraggedArm, ServoArm
from dmpcli.simulation.mock.contact import Hand, Wrist, contact
from dmpcli.simulation.mock.parameters import Scene

_GRID_RATE = 100.0
_EPS = 1e-9


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
    outputs : dict of bool
        The robot's digital outputs that were ever switched.
    """

    def __init__(self, clock: Clock, scene: Scene | None = None) -> None:
        self.scene = Scene() if scene is None else scene
        self.clock = clock
        self.hand: Hand | None = None
        self.outputs: dict[str, bool] = {}
        self.arm: ServoArm | DraggedArm = ServoArm(
            self.scene.position, self.scene.rotation, self.scene.servo
        )
        self._opened = self._now = self._tick = clock.now()
        self._step = 1.0 / _GRID_RATE
        self._ticks = 0
        self._samples: list[Sample] = []
        self._streaming = False
        self._seq = 0
        self._wrist = Wrist(self.scene.tool, self.scene.sensor, self.scene.seed)

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
        self._tick_on(self.clock.now())
        taken, self._samples = self._samples, []
        return taken

    def drag_teaching(self) -> None:
        """Hand the arm over to its own drag teaching."""
        self.advance()
        self.arm = DraggedArm(self.arm.position, self.arm.rotation, self.scene.drag_teaching)

    def advance(self) -> None:
        """Bring the lab up to the clock."""
        now = self.clock.now()
        if now > self._now:
            self._tick_on(now)
            self._move(now)

    def _tick_on(self, now: float) -> None:
        """Go on to the last tick of the grid until now."""
        while (tick := self._tick + (self._ticks + 1) * self._step) <= now + _EPS:
            self._move(tick)
            self._ticks += 1
            if self._streaming or isinstance(self.arm, DraggedArm):
                self._feel(tick)

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
        # Drawn for silent samples too: a fault changes nothing that came before it.
        noise = self._wrist.noise()
        self._seq += 1
        if t >= self._opened + self.scene.faults.silent_at - _EPS:
            return
        sensed = self._wrist.sensed(force, self.arm.rotation, t - self._opened, noise)
        limit = self.scene.sensor.limit
        healthy = bool((np.abs(sensed) < limit).all())
        shown = sensed if healthy else np.clip(sensed, -limit, limit)
        self._samples.append(Sample(t, self._seq, shown, healthy, 0))
