"""How the makes differ in what they are told: rate, filter, bias. The records are the same.

An ATI box keeps rate and filter on its web pages. An OnRobot or OptoForce box has no pages: it
takes the period in ms and the number of a filter over UDP, and never answers.
"""

from dataclasses import dataclass

from dmpcli.instruments.netft.protocol import Command, request
from dmpcli.instruments.netft.status import Family


@dataclass(frozen=True)
class Dialect:
    """One make's way to speak.

    Attributes
    ----------
    make : str
    family : str
        Whose status bits.
    highest_rate : float
        Hz, of a box that does not tell.
    pages : bool
        Whether rate and filter are set on its pages, not over UDP.
    bias : bytes
        Request that makes the present reading zero.
    """

    make: str
    family: Family
    highest_rate: float
    pages: bool
    bias: bytes


DIALECTS = {
    "ati": Dialect("ATI", "net f/t", 7000.0, True, request(Command.BIAS)),
    "axia": Dialect("ATI", "axia", 7812.0, True, request(Command.BIAS)),
    "onrobot": Dialect("OnRobot", "onrobot", 1000.0, False, request(Command.BIAS, 255)),
}
_LONGEST_PERIOD = 255


def of(name: str | None, product: str) -> Dialect:
    """Return the dialect of this name; without one, what the product calls itself decides."""
    return DIALECTS[name or ("axia" if "axia" in product.lower() else "ati")]


def period_request(rate: float) -> bytes | None:
    """Encode OnRobot's request for a rate, Hz; None where no whole number of ms gives it."""
    period = 1000.0 / rate
    if not 1 <= round(period) <= _LONGEST_PERIOD or abs(period - round(period)) > 1e-6 * period:
        return None
    return request(Command.PERIOD, round(period))
