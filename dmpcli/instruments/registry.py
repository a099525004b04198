"""Which drivers are installed: Python entry points, one group for sensors and one for robots.

The name of an entry point is the URL's scheme, its value a factory ``make(address, clock)`` that
returns a `Sensor` or a `ServoDriver`. Those of this package are registered in the same way as those
of any other. A factory whose attribute ``lock_step`` is true makes instruments that have no time of
their own: their world goes on as far as the clock that they are given, real or simulated. Its
attribute ``port`` is the port that a URL without one means.
"""

import sys
from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING, Any, TypeAlias

from dmpcli.errors import InputError
from dmpcli.instruments.address import Address
from dmpcli.instruments.protocols import Clock, Sensor

if TYPE_CHECKING:
    from importlib.metadata import EntryPoints

    from dmpcli.instruments.driver_protocol import ServoDriver

SensorFactory = Callable[[Address, Clock], Sensor]
RobotFactory: TypeAlias = "Callable[[Address, Clock], ServoDriver]"

GROUPS = {"sensor": "dmpcli.sensors", "robot": "dmpcli.robots"}
"""Entry-point group of each role."""


def schemes(role: str) -> list[str]:
    """Return the schemes that a driver is installed for, sorted.

    Parameters
    ----------
    role : str
        ``sensor`` or ``robot``.
    """
    return sorted({point.name for point in _installed(role)})


def sensor_factory(scheme: str) -> SensorFactory:
    """Return what makes the sensor of a scheme.

    Raises
    ------
    InputError
        There is none, there are two, or its package cannot be imported.
    """
    factory: SensorFactory = _load("sensor", scheme)
    return factory


def robot_factory(scheme: str) -> RobotFactory:
    """Return what makes the servo driver of a scheme.

    Raises
    ------
    InputError
        There is none, there are two, or its package cannot be imported.
    """
    factory: RobotFactory = _load("robot", scheme)
    return factory


def lock_step(address: Address) -> bool:
    """Tell whether an instrument keeps to whatever clock it is given: its factory says so.

    Raises
    ------
    InputError
        Its driver cannot be had.
    """
    return bool(getattr(_load(address.role, address.scheme), "lock_step", False))


def default_port(address: Address) -> int | None:
    """Return the port that a URL without one means; None where its factory does not say.

    Raises
    ------
    InputError
        Its driver cannot be had.
    """
    port = getattr(_load(address.role, address.scheme), "port", None)
    return port if isinstance(port, int) else None


def _installed(role: str) -> "EntryPoints":
    from importlib import metadata  # a rehearsal needs no drivers and starts sooner without

    return _read(metadata.entry_points, GROUPS[role], tuple(sys.path))


@lru_cache(maxsize=8)
def _read(
    entry_points: "Callable[..., EntryPoints]", group: str, _path: tuple[str, ...]
) -> "EntryPoints":
    """Read them once a process: it goes through all packages on the path, and a URL asks often."""
    return entry_points(group=group)


def _load(role: str, scheme: str) -> Any:
    found = [point for point in _installed(role) if point.name == scheme]
    values = sorted({point.value for point in found})
    if not found:
        raise InputError(f"--{role} {scheme}: no driver is installed for it")
    if len(values) > 1:
        raise InputError(
            f"--{role} {scheme}: {' and '.join(values)} both claim it; uninstall one of them"
        )
    try:
        return found[0].load()
    except (ImportError, AttributeError) as error:
        raise InputError(
            f"--{role} {scheme}: its driver {values[0]} cannot be loaded: {error}"
        ) from None
