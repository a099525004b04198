"""What a contact supervisor goes by: limits, speeds and what it does where contact is lost."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from dmpcli.admittance.force_law import ForceGains

ContactState = Literal[
    "free",
    "seeking",
    "landing",
    "drawing",
    "lost",
    "too hard",
    "oscillating",
    "retreating",
]
# So many changes are named one by one.
_NAMED = 12
OnContactLoss = Literal["seek", "hold", "stop"]


@dataclass(frozen=True)
class ContactPolicy:
    """Limits of the coupling itself, apart from those of the plan and of the arm.

    Attributes
    ----------
    setpoint : float
        F_d where the plan states none, N.
    contact : float
        N; less is no contact.
    reach : float
        How far off the plan's start the surface is looked for, to both sides, mm.
    again : float
        How far it is looked for towards the work where contact is lost, mm.
    seek : float
        Guarded speed of looking for it, mm/s.
    free : float
        Speed of the tool where it touches nothing: lifting and retreating, mm/s.
    clamp : float
        How far off the plan the surface may be while it is drawn on, mm; what the tool is
        compressed by does not count.
    rate : float
        Largest speed of the correction, mm/s.
    limit : float
        Largest force along the normal, times the set-point.
    drag, rub : float
        Force across the normal that is no friction any more: more than `drag` N and `rub` times
        the normal force, or 0.2 more than the friction that was felt times it.
    patience : float
        s without contact until it counts as lost.
    on_loss : {'seek', 'hold', 'stop'}
    delay : float
        From a displacement to its force, as far as the arm tells, s.
    stiffness, whole_delay : float or None
        What the person says of tool and surface in series, N/mm, and of the loop, s; None measures.
    gains : ForceGains or None
        What the person chose; None is by the rule.
    spring : float
        K of eq. (10), N/mm.
    zero_limit : float
        What the lifted tool may read beside its zero, N.
    least_share : float
        Share of the stroke in contact, below which it does not count as drawn, 0 to 1.
    tool_mass : float
        Of what the sensor carries, kg: it feels its inertia.
    """

    setpoint: float
    contact: float = 0.5
    reach: float = 6.0
    again: float = 6.0
    seek: float = 2.0
    free: float = 10.0
    clamp: float = 15.0
    rate: float = 10.0
    limit: float = 2.0
    drag: float = 2.0
    rub: float = 0.4
    patience: float = 0.06
    on_loss: OnContactLoss = "seek"
    delay: float = 0.05
    stiffness: float | None = None
    whole_delay: float | None = None
    gains: ForceGains | None = None
    spring: float = 0.0
    zero_limit: float = 2.0
    least_share: float = 0.95
    tool_mass: float = 0.0


@dataclass(frozen=True)
class ContactEvent:
    """One change of state.

    Attributes
    ----------
    t : float
        s since the first set-point.
    state : str
    detail : str
    """

    t: float
    state: ContactState
    detail: str = ""

    def __str__(self) -> str:
        """Say it in one line."""
        more = f": {self.detail}" if self.detail else ""
        return f"contact at {self.t:.2f} s: {self.state}{more}"


def course(events: Sequence[ContactEvent]) -> str:
    """Name the changes of a run with their times; of many, how often each state was entered.

    Parameters
    ----------
    events : sequence of ContactEvent
    """
    pairs = zip(events, [None, *events], strict=False)
    # An event that changes no state says something else, as of limits that are met.
    changes = [one for one, last in pairs if last is None or one.state != last.state]
    if len(changes) <= _NAMED:
        return ", ".join(f"{one.state} at {one.t:.2f} s" for one in changes)
    count = Counter(one.state for one in changes)
    return ", ".join(f"{number} × {state}" for state, number in count.items())
