"""From two URLs to the bench: mock instruments in one lab, or the drivers that are installed."""

from collections.abc import Iterable
from dataclasses import dataclass

from dmpcli.errors import InputError, InstrumentError
from dmpcli.instruments import registry
from dmpcli.instruments.address import MOCK, Address, in_provenance, need_tool, split
from dmpcli.instruments.protocols import Clock, Sample, Sensor, SensorInfo, Servo
from dmpcli.simulation.mock import Lab, MockSensor, MockServo, Scene
from dmpcli.simulation.mock import options as mock
from dmpcli.spatial.wrench import Tool

__all__ = [
    "MOCK",
    "Address",
    "NoSensor",
    "Workcell",
    "check",
    "connect",
    "in_provenance",
    "need_tool",
    "parse",
    "repeatable",
]


@dataclass(frozen=True)
class Workcell:
    """The instruments of one run.

    Attributes
    ----------
    robot : Servo
    sensor : Sensor
        `NoSensor` beside a real robot where none was asked for.
    lab : Lab or None
        What the mock ones share; None where any instrument is real.
    simulated : bool
        Whether any of it is.
    lock_step : bool
        Whether all of it keeps to whatever clock it was given.
    note : str or None
        What the person should know before the arm moves.
    """

    robot: Servo
    sensor: Sensor
    lab: Lab | None
    simulated: bool
    lock_step: bool
    note: str | None = None


class NoSensor:
    """Stands where no sensor was asked for."""

    def open(self) -> SensorInfo:
        """There is nothing to open.

        Raises
        ------
        InstrumentError
        """
        raise InstrumentError("force sensor: none was named; give --sensor URL")

    def start(self, rate: float) -> None:  # noqa: ARG002
        """There is nothing to start."""
        self.open()

    def poll(self) -> list[Sample]:
        """Nothing comes."""
        return []

    def close(self) -> None:
        """Nothing is open."""


def parse(url: str, role: str) -> Address:
    """Take a URL apart, and make sure that there is a driver for it.

    Parameters
    ----------
    url, role : str
        As in `address.split`.

    Raises
    ------
    InputError
        No driver is registered for the scheme in this role, host or port is missing or wrong, or
        an option of the mock is unknown or is not a number in its range.
    """
    scheme, colon, _ = url.partition(":")
    # Looking up the drivers would slow down the start of every rehearsal, which needs none.
    if not colon or (scheme != "mock" and scheme not in registry.schemes(role)):
        choices = ", ".join([MOCK, *(f"{s}://HOST" for s in registry.schemes(role))])
        raise InputError(f"--{role} {url}: no such instrument; a {role} is one of {choices}")
    address = split(url, role)
    if address.simulated:
        mock.numbers(address.options, f"--{role} {url}")
    return address


def repeatable(addresses: Iterable[Address]) -> bool:
    """Tell whether a run can be made again: all of its instruments keep to simulated time.

    One real instrument makes it a measurement, which is paced by the real clock and whose file is
    not replaced unasked.

    Parameters
    ----------
    addresses : iterable of Address
    """
    return all(address.simulated or registry.lock_step(address) for address in addresses)


def check(robot: str, sensor: str | None = MOCK, allow_mixed: bool = False) -> tuple[Address, ...]:
    """Parse the URLs and refuse what must not stand on one bench, before anything is opened.

    Parameters
    ----------
    robot : str
    sensor : str or None
        None where nothing feels a force.
    allow_mixed : bool
        Let a real instrument stand beside a mock one.

    Returns
    -------
    tuple of Address
        Of the robot and, where there is one, of the sensor.

    Raises
    ------
    InputError
        A URL is wrong; or one is real and one is mock without `allow_mixed`.
    """
    addresses = [parse(robot, "robot")]
    if sensor is not None:
        addresses.append(parse(sensor, "sensor"))
    real = [a for a in addresses if not a.simulated]
    if len(addresses) == 2 and len(real) == 1 and not allow_mixed:
        other = "sensor" if real[0].role == "robot" else "robot"
        raise InputError(
            f"{real[0]} beside a mock {other}: give --{other} too, or --allow-mixed if it is meant"
        )
    return tuple(addresses)


def connect(
    robot: str,
    sensor: str | None,
    clock: Clock,
    *,
    allow_mixed: bool = False,
    scene: Scene | None = None,
    tool: Tool | None = None,
) -> Workcell:
    """Make the instruments that the URLs name; nothing is opened yet.

    Mock instruments share one lab. What either URL says of it beats `scene`. A mock one beside a
    real one has a lab of its own, in which nobody draws.

    Parameters
    ----------
    robot : str
    sensor : str or None
        None where nothing feels a force.
    clock : Clock
        What the run's loop sleeps on; real where an instrument is.
    allow_mixed : bool
        Let a real instrument stand beside a mock one.
    scene : Scene, optional
        The lab where the URLs say nothing.
    tool : Tool, optional
        On the flange of a real robot.

    Raises
    ------
    InputError
        As in `check`; a driver does not know an option or cannot be loaded; or the two URLs say
        different things of the one lab.
    """
    addresses = check(robot, sensor, allow_mixed)
    mocks = [a for a in addresses if a.simulated]
    options: dict[str, float | None] = {}
    for address in mocks:
        for key, value in mock.numbers(address.options, str(address)).items():
            if options.setdefault(key, value) != value:
                raise InputError(
                    f"--robot {robot} and --sensor {sensor}: {key} differs, and they share one "
                    "lab; say it once"
                )
    lab = Lab(clock, mock.arranged(scene or Scene(), options))
    arm, note = _robot(addresses[0], lab, clock, tool)
    feeler = _sensor(addresses[1], lab, clock) if sensor is not None else NoSensor()
    if sensor is None and mocks:
        feeler = MockSensor(lab)
    whole = len(mocks) == len(addresses)
    steps = [repeatable([address]) for address in addresses]
    return Workcell(arm, feeler, lab if whole else None, any(steps), all(steps), note)


def _robot(address: Address, lab: Lab, clock: Clock, tool: Tool | None) -> tuple[Servo, str | None]:
    if address.simulated:
        return MockServo(lab), None
    from dmpcli.instruments import servo_adapter  # a rehearsal starts sooner without

    driver = registry.robot_factory(address.scheme)(address, clock)
    untold = f"{address}: no --tool FILE, so the TCP is the flange or what the robot takes for it"
    return servo_adapter.servo(driver, clock, tool), untold if tool is None else None


def _sensor(address: Address, lab: Lab, clock: Clock) -> Sensor:
    if address.simulated:
        return MockSensor(lab)
    return registry.sensor_factory(address.scheme)(address, clock)
