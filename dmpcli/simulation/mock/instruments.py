"""The mock lab behind the two protocols that real instruments obey."""

from dmpcli.arrays import Floats, finite
from dmpcli.errors import InstrumentError
from dmpcli.instruments import outputs
from dmpcli.instruments.protocols import RobotState, Sample, SensorInfo, ServoInfo
from dmpcli.simulation.mock.arms import DraggedArm
from dmpcli.simulation.mock.lab import Lab


class MockSensor:
    """The lab's force/torque sensor.

    Parameters
    ----------
    lab : Lab
    """

    def __init__(self, lab: Lab) -> None:
        self._lab = lab

    def open(self) -> SensorInfo:
        """Connect."""
        sensor = self._lab.scene.sensor
        return SensorInfo("mock", sensor.highest_rate, sensor.limit)

    def start(self, rate: float) -> None:
        """Begin to stream at `rate` Hz; the first sample comes one interval from now.

        Raises
        ------
        InstrumentError
            The sensor cannot stream at this rate.
        """
        highest = self._lab.scene.sensor.highest_rate
        if not 0.0 < rate <= highest:
            raise InstrumentError(
                f"mock sensor: cannot stream at {rate:g} Hz, only up to {highest:g}"
            )
        self._lab.stream(rate)

    def poll(self) -> list[Sample]:
        """Return the samples since the last call, oldest first."""
        return self._lab.take_samples()

    def close(self) -> None:
        """Stop streaming."""
        self._lab.end_stream()


class MockServo:
    """The lab's arm.

    Parameters
    ----------
    lab : Lab
    """

    def __init__(self, lab: Lab) -> None:
        self._lab = lab
        self._started = False

    def open(self) -> ServoInfo:
        """Connect."""
        servo = self._lab.scene.servo
        # A set-point is reached one period after it came, behind the lag; 20 ms is the usual one.
        return ServoInfo("mock", (servo.shortest_period, servo.longest_period), 0.02 + servo.lag)

    def state(self) -> RobotState:
        """Return the actual pose and mode now."""
        lab = self._lab
        lab.advance()
        return RobotState(
            lab.clock.now(), lab.arm.position.copy(), lab.arm.rotation.copy(), lab.mode
        )

    def start(self, period: float) -> None:
        """Enter servo mode.

        Raises
        ------
        InstrumentError
            The period is out of range, or the arm is in drag teaching or not ready.
        """
        lab = self._lab
        lab.advance()
        servo = lab.scene.servo
        if not servo.shortest_period <= period <= servo.longest_period:
            raise InstrumentError(
                f"mock robot: cannot take a set-point every {period:g} s, only every "
                f"{servo.shortest_period:g} to {servo.longest_period:g} s"
            )
        if isinstance(lab.arm, DraggedArm):
            raise InstrumentError("mock robot: is in drag teaching; it takes no set-points")
        if lab.mode != "ready":
            raise InstrumentError(f"mock robot: cannot start, its state is {lab.mode}")
        lab.arm.start(period)
        self._started = True

    def drag(self) -> None:
        """Hand the arm over to its own drag teaching.

        Raises
        ------
        InstrumentError
            The arm is not ready.
        """
        self._lab.advance()
        if self._lab.mode != "ready":
            raise InstrumentError(f"mock robot: cannot be dragged, its state is {self._lab.mode}")
        self._started = False
        self._lab.drag_teaching()

    def send(self, position: Floats, rotation: Floats) -> bool:
        """Send one set-point; False when not started, not ready, refused, or not finite."""
        lab = self._lab
        lab.advance()
        if not self._started or isinstance(lab.arm, DraggedArm):
            return False
        if lab.mode != "ready" or lab.refuses:
            return False
        if not finite(position, rotation):
            return False
        lab.arm.send(position, rotation)
        return True

    def check_output(self, name: str) -> None:
        """Make sure that there is an output of this name: DO0 to DO31.

        Raises
        ------
        InputError
        """
        outputs.number(name, "mock robot", 0, 31)

    def switch(self, name: str, on: bool) -> None:
        """Switch an output."""
        self._lab.advance()
        self._lab.outputs[name] = on

    def stop(self) -> None:
        """Leave servo mode or drag teaching and stand still at once."""
        self._lab.advance()
        self._lab.arm.stand_still()
        self._started = False

    def close(self) -> None:
        """Disconnect; stops first."""
        self.stop()
