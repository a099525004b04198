"""What a make of robot has to offer: one small protocol in the controller's own units.

A driver speaks its controller's wire and nothing else. It declares in which space, units and form
its set-points and states are; `dmpcli.instruments.servo_adapter` turns a
driver into the `Servo` that the loops drive, in mm, rad and rotation matrices, and is the one place
where anything is converted. `docs/drivers.md` shows how a make is added in one file.
"""

from collections.abc import Callable
from dataclasses import InitVar, dataclass
from typing import Literal, Protocol, runtime_checkable

from dmpcli.arrays import Floats
from dmpcli.instruments.protocols import Controlled, RobotMode, ServoInfo
from dmpcli.kinematics import models
from dmpcli.kinematics.models import Arm

Space = Literal["joint", "pose"]
"""What a set-point is: joint angles, or a pose of the TCP."""

LengthUnit = Literal["mm", "m"]
AngleUnit = Literal["rad", "deg"]

Orientation = Literal["xyz euler", "zyx euler", "rotation vector", "quaternion"]
"""Form of the last numbers of a pose: intrinsic X-Y-Z, R = Rx(rx) Ry(ry) Rz(rz); fixed axes,
R = Rz(rz) Ry(ry) Rx(rx); a rotation vector; or a unit quaternion w, x, y, z."""


@dataclass(frozen=True, kw_only=True)
class DriverInfo(ServoInfo):
    """What a servo driver declares of its controller, beside what the loops ask of any servo.

    Attributes
    ----------
    space : str
    length, angle : str
        Units of its set-points and states.
    orientation : str
        Form of its poses.
    model : str or Arm or None
        Name of the kinematic model (`dmpcli.kinematics.models`), which ``joint`` needs; or the
        model itself, of a controller that knows its arm's own lengths.
    base_turn, flange_turn : float
        By how much the controller's base and flange frames are turned about z against those of the
        model, rad.
    tolerance : tuple of float
        By how much the joints' pose may differ from the reported one at the start, mm and rad.
    remedy : str
        What to say where it differs by more: which options change it.
    pacing : str
        Drivers of version 0.1 declared it; nothing reads it.
    """

    space: Space
    length: LengthUnit
    angle: AngleUnit
    orientation: Orientation
    model: str | Arm | None = None
    base_turn: float = 0.0
    flange_turn: float = 0.0
    tolerance: tuple[float, float] = (2.0, 0.02)
    remedy: str = ""
    pacing: InitVar[str | None] = None

    @property
    def arm(self) -> Arm | None:
        """The kinematic model.

        Raises
        ------
        InputError
            There is none of that name.
        """
        return models.model(self.model) if isinstance(self.model, str) else self.model


@dataclass(frozen=True)
class DriverState:
    """What a controller reports, in the units that its driver declares.

    Attributes
    ----------
    t : float
        When it was read, s, on the loop's clock.
    mode : str
        Anything but ``ready`` forbids motion.
    joints : array, shape (n,), or None
        Actual joint angles.
    pose : array, shape (6,) or (7,), or None
        Actual pose of the controller's TCP in its base frame; position first. A driver in joint
        space needs to give it only in the first state, for the check against the joints.
    detail : str
        What the controller says about a mode that is not ``ready``; empty where it says nothing.
    busy : bool or None
        Whether it says that a motion or program is under way; None where it does not tell.
    """

    t: float
    mode: RobotMode
    joints: Floats | None = None
    pose: Floats | None = None
    detail: str = ""
    busy: bool | None = None


class ServoDriver(Controlled, Protocol):
    """One make of robot controller."""

    def connect(self) -> DriverInfo:
        """Connect and make sure that it may be driven; InstrumentError or RefusedError if not."""

    def state(self) -> DriverState:
        """Return what the controller last reported; InstrumentError when that is too old."""

    def send(self, target: Floats) -> bool:
        """Send one set-point; False when the controller did not take it.

        `target` holds joint angles, shape (n,), or a pose, shape (6,) or (7,), as declared.
        """


@runtime_checkable
class HaltingDriver(Protocol):
    """What a driver offers besides `ServoDriver` if it can stop the arm while its call hangs."""

    def halt(self) -> None:
        """Stop the arm now, without waiting for the call that hangs; called by another thread.

        What it raises says that the arm may still move.
        """


@runtime_checkable
class InverseDriver(Protocol):
    """What a driver in joint space offers besides `ServoDriver` if its controller can be asked."""

    def inverse(self, pose: Floats, near: Floats) -> Floats | None:
        """Joint angles of a TCP pose as the controller computes them, in the declared units.

        `near` holds joint angles that it should start from. None where it is not to be asked.
        """


@runtime_checkable
class OutputDriver(Protocol):
    """What a driver offers besides `ServoDriver` if it can switch the controller's outputs."""

    def output(self, name: str) -> None:
        """Take note that an output will be switched; asks the controller nothing.

        InputError where it has none of this name.
        """

    def switch(self, name: str, on: bool) -> None:
        """Switch an output, within a period; InstrumentError where the controller does not do it.

        A driver that can be halted beside a call that hangs switches off there what is on.
        """


@runtime_checkable
class PlanDriver(Protocol):
    """What a driver offers besides `ServoDriver` if its controller plays a whole plan by itself."""

    def upload(self, targets: Floats, period: float, meanwhile: Callable[[], None]) -> None:
        """Hand over every set-point of a plan, `period` s apart.

        Nothing moves.

        Parameters
        ----------
        targets : array, shape (n, 6) or (n, 7)
            Joint angles or poses as `ServoDriver.send` takes them, in the declared units.
        period : float
            s.
        meanwhile : callable
            Called before each request; what it raises ends the upload.

        Raises
        ------
        RefusedError, InstrumentError
            The controller does not take them.
        """

    def play(self) -> None:
        """Let the controller begin; it keeps the time until the plan's end or `ServoDriver.stop`.

        `ServoDriver.start` came before, `ServoDriver.send` never comes.
        """
