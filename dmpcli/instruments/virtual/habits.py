"""How a simulated controller behaves where nobody could tell of the real one."""

from dataclasses import dataclass, field

from dmpcli.instruments.virtual.motions import Policies
from dmpcli.instruments.virtual.words import Euler


@dataclass(frozen=True)
class Habits:
    """What nobody could tell of the real controller, to be chosen.

    Attributes
    ----------
    policies : Policies
    euler : str
        Which rx, ry, rz its poses mean; see `words.Euler`.
    newline : bool
        Whether its replies end in a newline.
    """

    policies: Policies = field(default_factory=Policies)
    euler: Euler = "xyz"
    newline: bool = False
