"""What the simulated sensor box is: make, scale, range, rates, ports."""

from dataclasses import dataclass, field

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.instruments.netft.settings import Scale
from dmpcli.instruments.netft.status import SATURATED, Family

INTERNAL_RATE = 7000
"""Readings per second inside a Net F/T box, Hz; a record is every n-th of them."""


@dataclass(frozen=True)
class BoxSettings:
    """A simulated box.

    Attributes
    ----------
    family : str
        ``net f/t``, ``axia`` or ``onrobot``. An OnRobot box has no pages and no TCP interface.
    product, configuration, serial : str
    scale : Scale
        Of the counts that it sends.
    limit : array, shape (6,)
        Measuring range, N and N·m: an ATI Mini45, SI-145-5.
    rate : int
        RDT records per second at first, Hz.
    records : int
        In one datagram of a buffered stream.
    host : str
        Address it listens on.
    rdt_port, http_port, tcp_port : int
        0 asks for a free one.
    """

    family: Family = "net f/t"
    product: str = "Net F/T"
    configuration: str = "Mini45 SI-145-5"
    serial: str = "FT00000"
    scale: Scale = field(default_factory=lambda: Scale(1e6, 1e6, "N", "N-m"))
    limit: Floats = field(default_factory=lambda: np.array([145.0, 145.0, 290.0, 5.0, 5.0, 5.0]))
    rate: int = 1000
    records: int = 10
    host: str = "127.0.0.1"
    rdt_port: int = 0
    http_port: int = 0
    tcp_port: int = 0

    @property
    def pages(self) -> bool:
        """Whether it has web pages and the TCP interface."""
        return self.family != "onrobot"

    @property
    def saturated(self) -> int:
        """Status of a reading beyond the range."""
        return SATURATED[self.family]


def rounded_up(rate: int) -> tuple[int, float]:
    """Return the rate that a box makes of the one asked for, as it prints it and as it is, Hz.

    Parameters
    ----------
    rate : int
        1 to 7000 Hz; it becomes the next one that divides the internal rate.
    """
    true = INTERNAL_RATE / (INTERNAL_RATE // min(max(rate, 1), INTERNAL_RATE))
    return round(true), true
