"""What every sensor and every robot must offer: two small protocols and their values.

A driver converts at the edge: whatever it speaks on the wire, these values are in mm, rad, s, N and
N·m, rotations as matrices, times on the clock that the loop runs on.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, Protocol, runtime_checkable

from dmpcli.arrays import Floats
from dmpcli.spatial.pose import Pose

RobotMode = Literal["ready", "stopped", "emergency stop", "protective stop", "fault", "not ready"]


VIRTUAL = "virtual"
"""Serial number of a simulated box, by which files tell it over the wire."""


@dataclass(frozen=True)
class SensorInfo:
    """What a force/torque sensor says of itself.

    Attributes
    ----------
    make : str
    rate : float
        Samples per second, Hz.
    limit : array, shape (6,)
        Measuring range per axis, N and N·m; a reading at the limit is saturated.
    product, serial : str
        What it is and which one, where it tells; empty where it does not.
    """

    make: str
    rate: float
    limit: Floats
    product: str = ""
    serial: str = ""

    @property
    def identity(self) -> str:
        """All that tells this sensor from another one."""
        return " ".join(part for part in (self.make, self.product, self.serial) if part)

    @property
    def virtual(self) -> bool:
        """Whether it belongs to a lab that ``dmpcli simulate`` serves."""
        return self.serial == VIRTUAL


@dataclass(frozen=True)
class Sample:
    """One reading of the sensor, as sensed.

    Attributes
    ----------
    t : float
        When it arrived, s, on the loop's clock.
    seq : int
        The sensor's own sequence number.
    wrench : array, shape (6,)
        N and N·m, in the sensor's axes, about its origin, acting on the tool.
    healthy : bool
        False when the sensor flags itself, or the reading is saturated.
    lost : int
        Samples lost since the start.
    reason : str
        Why it is not healthy, where the driver knows.
    """

    t: float
    seq: int
    wrench: Floats
    healthy: bool
    lost: int
    reason: str = ""


class Sensor(Protocol):
    """A six-axis force/torque sensor."""

    def open(self) -> SensorInfo:
        """Connect; InstrumentError when it cannot be reached."""

    def start(self, rate: float) -> None:
        """Begin to stream at `rate` Hz."""

    def poll(self) -> list[Sample]:
        """Return the samples that arrived since the last call, oldest first; never waits."""

    def close(self) -> None:
        """Stop streaming and disconnect; may be called twice."""


@dataclass(frozen=True)
class ServoInfo:
    """What a position-servo interface says of itself.

    Attributes
    ----------
    make : str
    period_range : tuple of float
        Shortest and longest servo period it takes, s.
    lookahead : float
        Time between a set-point's arrival and its being reached, s.
    queues : bool
        Whether it takes one set-point per period from a queue of one look-ahead, by its own clock.
        Each deadline without a set-point then leaves the queue one shorter for good, unless the
        set-points that are owed are handed in later: they only queue, each for its own period.
    period_step : float
        Servo periods are whole multiples of it, s; 0 takes any.
    """

    make: str
    period_range: tuple[float, float]
    lookahead: float
    queues: bool = False
    period_step: float = 0.0


@dataclass(frozen=True)
class RobotState:
    """Where the tool is and whether the arm may move.

    Attributes
    ----------
    t : float
        s, on the loop's clock.
    position : array, shape (3,)
        Actual TCP, mm, base frame.
    rotation : array, shape (3, 3)
    mode : str
        Anything but ``ready`` forbids motion.
    joints : array, shape (n,), or None
        Actual joint angles, rad, where the robot tells them.
    detail : str
        What the controller says about a mode that is not ``ready``.
    busy : bool or None
        Whether its controller says that a motion or program is under way; None where it does not
        tell.
    """

    t: float
    position: Floats
    rotation: Floats
    mode: RobotMode
    joints: Floats | None = None
    detail: str = ""
    busy: bool | None = None

    @property
    def pose(self) -> Pose:
        """The actual pose of the TCP."""
        return Pose(self.position, self.rotation)


class Controlled(Protocol):
    """What a controller and the servo that is made of it have in common."""

    def start(self, period: float) -> None:
        """Enter servo mode with one set-point every `period` s."""

    def stop(self) -> None:
        """Leave servo mode and stand still at once; may be called twice."""

    def close(self) -> None:
        """Disconnect; stops first if still moving; may be called twice."""


class Servo(Controlled, Protocol):
    """A robot arm that takes TCP set-points in time."""

    def open(self) -> ServoInfo:
        """Connect; InstrumentError when it cannot be reached."""

    def state(self) -> RobotState:
        """Return the actual pose and mode now."""

    def send(self, position: Floats, rotation: Floats) -> bool:
        """Send one set-point; False when the controller did not take it."""


@runtime_checkable
class DragTeaching(Protocol):
    """What a robot with a drag teaching of its own offers besides `Servo`."""

    def drag(self) -> None:
        """Hand the arm over to its own drag teaching, until `Servo.stop`."""


@runtime_checkable
class OutputSwitching(Protocol):
    """What a robot whose controller's digital outputs can be switched offers besides `Servo`."""

    def check_output(self, name: str) -> None:
        """Make sure that there is an output of this name; InputError where there is not."""

    def switch(self, name: str, on: bool) -> None:
        """Switch an output now, while the arm moves or stands."""


@runtime_checkable
class PlanPlayer(Protocol):
    """What a robot that plays a whole plan by itself offers besides `Servo`."""

    def upload(
        self, position: Floats, rotation: Floats, period: float, meanwhile: Callable[[], None]
    ) -> None:
        """Hand over set-points `period` s apart; nothing moves.

        Parameters
        ----------
        position, rotation : array, shape (n, 3) and (n, 3, 3)
            Of the TCP in the base frame, mm.
        period : float
            s.
        meanwhile : callable
            Called again and again, for it may take long; it must not call the robot, and what it
            raises ends the upload.

        Raises
        ------
        RefusedError, InstrumentError
            The arm cannot run them, or the controller does not take them.
        """

    def play(self) -> None:
        """Begin to move; the controller keeps the time, until the end or `Servo.stop`."""


class Clock(Protocol):
    """Real or simulated time, s, from any origin."""

    def now(self) -> float:
        """Return the time."""

    def sleep_until(self, t: float) -> None:
        """Return when `t` has come; at once if it has passed."""
