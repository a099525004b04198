"""Force/torque sensors that speak RDT over UDP: ATI Net F/T and Axia, OnRobot and OptoForce."""

from dmpcli.instruments.address import Address
from dmpcli.instruments.netft import options
from dmpcli.instruments.netft.driver import NetFtSensor
from dmpcli.instruments.protocols import Clock

__all__ = ["NetFtSensor", "make"]


def make(address: Address, clock: Clock) -> NetFtSensor:
    """Make the sensor that a ``netft://HOST[:PORT]`` URL names; nothing is opened yet.

    Parameters
    ----------
    address : Address
        Its options are those of `dmpcli.instruments.netft.options`.
    clock : Clock
        What the loop sleeps on; the real one.

    Raises
    ------
    InputError
        An option is unknown, or its value is wrong.
    """
    return NetFtSensor(address.host, address.port, options.read(address), clock)
