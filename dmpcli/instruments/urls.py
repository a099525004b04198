"""URLs name instruments: ``mock:`` with its options; the makes to come are known by name."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from urllib.parse import parse_qsl

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import InputError
from dmpcli.instruments.mock import Faults, Lab, MockSensor, MockServo, Plate, Scene
from dmpcli.instruments.protocols import Clock, Sensor, Servo
from dmpcli.rotations import from_euler

MOCK = "mock:"

REAL = {"sensor": ("netft",), "robot": ("elite", "ur")}
"""Schemes of real instruments, which this version does not speak yet."""

MOCK_KEYS = {
    "x": "mm, where the TCP stands at the beginning",
    "y": "mm",
    "z": "mm",
    "rx": "rad, X-Y-Z Euler angles",
    "ry": "rad",
    "rz": "rad",
    "plate": "mm, height of a level plate; 'none' for no plate",
    "stiffness": "N/mm, of the plate",
    "friction": "1, of the pen on the plate",
    "lag": "s, of the servo",
    "speed": "mm/s, fastest that the servo follows",
    "seed": "1, of the sensor's noise and drift",
    "estop_at": "s after the start, the emergency stop is pressed",
    "silent_at": "s after the start, the sensor falls silent",
    "refuse_at": "s after the start, the controller refuses set-points",
}
"""What may follow ``mock:?``, as key=value pairs joined by ``&``."""

_NOT_NEGATIVE = {"friction", "lag", "seed", "estop_at", "silent_at", "refuse_at"}
_POSITIVE = {"stiffness", "speed"}
_SMALLEST, _LARGEST, _LONGEST_LAG = 1e-6, 1e6, 10.0


@dataclass(frozen=True)
class Address:
    """One instrument's URL, taken apart.

    Attributes
    ----------
    role : str
        ``sensor`` or ``robot``.
    scheme : str
    host : str
        Empty for the mock.
    options : dict
        Options of the mock; values are numbers, None for ``none``.
    """

    role: str
    scheme: str
    host: str = ""
    options: Mapping[str, float | None] = field(default_factory=dict)

    @property
    def simulated(self) -> bool:
        """Whether this is the mock."""
        return self.scheme == "mock"


def parse(url: str, role: str) -> Address:
    """Take a URL apart.

    Parameters
    ----------
    url : str
        ``mock:``, ``mock:?plate=-17.5&stiffness=5``, ``netft://HOST``, ...
    role : str
        ``sensor`` or ``robot``: which option it was given to.

    Raises
    ------
    InputError
        The scheme is unknown or is not one for this role, the host is missing, or an option of
        the mock is unknown or is not a number in its range.
    """
    scheme, colon, rest = url.partition(":")
    choices = ", ".join([MOCK, *(f"{s}://HOST" for s in REAL[role])])
    if not colon or scheme not in ("mock", *REAL[role]):
        raise InputError(f"--{role} {url}: no such instrument; a {role} is one of {choices}")
    if scheme != "mock":
        host = rest.removeprefix("//").split("/")[0]
        if not rest.startswith("//") or not host:
            raise InputError(f"--{role} {url}: needs a host, as in {scheme}://192.168.1.1")
        return Address(role, scheme, host)
    if rest and not rest.startswith("?"):
        raise InputError(f"--{role} {url}: the mock has no host; options follow as mock:?key=value")
    return Address(role, scheme, options=_mock_options(url, role, rest.removeprefix("?")))


def _mock_options(url: str, role: str, query: str) -> dict[str, float | None]:
    options: dict[str, float | None] = {}
    try:
        pairs = parse_qsl(query, keep_blank_values=True, strict_parsing=bool(query))
    except ValueError:
        raise InputError(f"--{role} {url}: options are key=value pairs joined by &") from None
    for key, text in pairs:
        where = f"--{role} {url}: {key}"
        if key not in MOCK_KEYS:
            raise InputError(f"{where}: the mock has no such option; it has {', '.join(MOCK_KEYS)}")
        if key in options:
            raise InputError(f"{where}: is given twice")
        options[key] = None if (key, text) == ("plate", "none") else _number(where, key, text)
    return options


def _number(where: str, key: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{where} = {text!r}: a finite number is needed ({MOCK_KEYS[key]})")
    largest = _LONGEST_LAG if key == "lag" else _LARGEST
    if abs(value) > largest and key != "seed":
        raise InputError(f"{where} = {text}: must lie within ±{largest:g} ({MOCK_KEYS[key]})")
    if value < 0.0 and key in _NOT_NEGATIVE:
        raise InputError(f"{where} = {text}: must not be negative ({MOCK_KEYS[key]})")
    if value < _SMALLEST and key in _POSITIVE:
        raise InputError(f"{where} = {text}: must be {_SMALLEST:g} or more ({MOCK_KEYS[key]})")
    if key == "seed" and value != int(value):
        raise InputError(f"{where} = {text}: must be a whole number")
    return value


def in_provenance(url: str | None) -> str | None:
    """Return what a file may say of an instrument: all of a mock's URL, of a real one its scheme.

    Parameters
    ----------
    url : str or None
        None where there is no such instrument.
    """
    if url is None or url.startswith(MOCK):
        return url
    return url.partition(":")[0]


def repeatable(addresses: Iterable[Address]) -> bool:
    """Tell whether a run can be made again: all of its instruments are simulated.

    One real instrument makes it a measurement, which is paced by the real clock and whose file is
    not replaced unasked.

    Parameters
    ----------
    addresses : iterable of Address
    """
    return all(address.simulated for address in addresses)


def need_tool(sensor: Address, given: bool) -> None:
    """Refuse a real sensor without the tool on it; the mock knows its own.

    Parameters
    ----------
    sensor : Address
    given : bool
        Whether there is a tool file.

    Raises
    ------
    InputError
    """
    if not (sensor.simulated or given):
        raise InputError(
            f"--sensor {sensor.scheme}://{sensor.host}: a real sensor needs its tool: --tool FILE"
        )


@dataclass(frozen=True)
class Bench:
    """The instruments of one run.

    Attributes
    ----------
    robot : Servo
    sensor : Sensor
    lab : Lab or None
        Behind the mock ones; None when the robot is real.
    simulated : bool
        Whether any of it is.
    """

    robot: Servo
    sensor: Sensor
    lab: Lab | None
    simulated: bool


def check(robot: str, sensor: str, allow_mixed: bool = False) -> tuple[Address, Address]:
    """Parse both URLs and refuse what cannot be run, before anything is opened.

    Parameters
    ----------
    robot, sensor : str
        URLs.
    allow_mixed : bool
        Let a real instrument stand beside a mock one.

    Returns
    -------
    tuple of Address
        Of the robot and of the sensor.

    Raises
    ------
    InputError
        A URL is wrong; one is real and one is mock without `allow_mixed`; or one is real, which
        this version does not speak.
    """
    addresses = parse(robot, "robot"), parse(sensor, "sensor")
    real = [a for a in addresses if not a.simulated]
    if len(real) == 1 and not allow_mixed:
        other = "sensor" if real[0].role == "robot" else "robot"
        raise InputError(
            f"--{real[0].role} {real[0].scheme}://{real[0].host} beside a mock {other}: "
            f"give --{other} too, or --allow-mixed if it is meant"
        )
    if real:
        raise InputError(
            f"--{real[0].role} {real[0].scheme}://{real[0].host}: this version speaks {MOCK} only; "
            f"the {real[0].scheme} driver is not part of it"
        )
    return addresses


def connect(
    robot: str,
    sensor: str,
    clock: Clock,
    *,
    allow_mixed: bool = False,
    scene: Scene | None = None,
) -> Bench:
    """Make the instruments that two URLs name; nothing is opened yet.

    Mock instruments share one lab. What either URL says of it beats `scene`.

    Parameters
    ----------
    robot, sensor : str
        URLs.
    clock : Clock
        What the run's loop sleeps on.
    allow_mixed : bool
        Let a real instrument stand beside a mock one.
    scene : Scene, optional
        The lab where the URLs say nothing.

    Raises
    ------
    InputError
        As in `check`; or the two URLs say different things of the one lab.
    """
    first, second = check(robot, sensor, allow_mixed)
    for key in first.options.keys() & second.options.keys():
        if first.options[key] != second.options[key]:
            raise InputError(
                f"--robot {robot} and --sensor {sensor}: {key} differs, and they share one lab; "
                "say it once"
            )
    lab = Lab(clock, arranged(scene or Scene(), {**first.options, **second.options}))
    return Bench(MockServo(lab), MockSensor(lab), lab, simulated=True)


def arranged(scene: Scene, options: Mapping[str, float | None]) -> Scene:
    """Return a scene changed by the options of a ``mock:`` URL.

    Parameters
    ----------
    scene : Scene
    options : mapping
        By the keys of `MOCK_KEYS`.
    """

    def number(key: str, otherwise: float) -> float:
        value = options.get(key)
        return otherwise if value is None else value

    def numbers(keys: str, otherwise: Floats) -> Floats:
        each = keys.split()
        return np.array([number(k, float(o)) for k, o in zip(each, otherwise, strict=True)])

    rotation = scene.rotation
    if options.keys() & {"rx", "ry", "rz"}:
        # Angles that are not given are those of a pen that points straight down.
        rotation = from_euler(numbers("rx ry rz", np.array([np.pi, 0.0, 0.0])))
    return replace(
        scene,
        position=numbers("x y z", scene.position),
        rotation=rotation,
        plate=_plate(scene.plate, options),
        servo=replace(
            scene.servo,
            lag=number("lag", scene.servo.lag),
            speed=number("speed", scene.servo.speed),
        ),
        faults=Faults(
            estop_at=number("estop_at", scene.faults.estop_at),
            silent_at=number("silent_at", scene.faults.silent_at),
            refuse_at=number("refuse_at", scene.faults.refuse_at),
        ),
        seed=int(number("seed", scene.seed)),
    )


def _plate(plate: Plate | None, options: Mapping[str, float | None]) -> Plate | None:
    if "plate" in options:
        height = options["plate"]
        plate = None if height is None else Plate(point=np.array([0.0, 0.0, height]))
    if plate is None:
        return None
    stiffness, friction = options.get("stiffness"), options.get("friction")
    return replace(
        plate,
        stiffness=plate.stiffness if stiffness is None else stiffness,
        friction=plate.friction if friction is None else friction,
    )
