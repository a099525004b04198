"""How a simulated controller behaves where nobody could tell of the real one."""

from dataclasses import dataclass, field

from dmpcli.simulation.elite_server.motions import Policies
from dmpcli.simulation.elite_server.parameters import Euler


@dataclass(frozen=True)
class Behaviour:
    """What nobody could tell of the real controller, to be chosen.

    Attributes
    ----------
    policies : Policies
    euler : str
        Which rx, ry, rz its poses mean; see `parameters.Euler`.
    newline : bool
        Whether its replies end in a newline.
    """

    policies: Policies = field(default_factory=Policies)
    euler: Euler = "xyz"
    newline: bool = False
