"""Elite EC series: JSON-RPC on port 8055, monitor on 8056, ``elite://HOST``."""

from dmpcli.instruments.address import Address
from dmpcli.instruments.driver_protocol import ServoDriver
from dmpcli.instruments.elite.file_driver import FileDriver
from dmpcli.instruments.elite.settings import RPC_PORT, read
from dmpcli.instruments.elite.stream_driver import StreamDriver
from dmpcli.instruments.protocols import Clock


def make(address: Address, clock: Clock) -> ServoDriver:
    """Return the driver of an ``elite://`` URL; nothing is opened yet.

    Parameters
    ----------
    address : Address
    clock : Clock
        Real: the controller's time cannot be simulated.

    Raises
    ------
    InputError
        An option is unknown or out of range.
    """
    settings = read(address)
    return FileDriver(settings, clock) if settings.mode == "file" else StreamDriver(settings, clock)


make.port = RPC_PORT  # type: ignore[attr-defined]  # see `registry`
