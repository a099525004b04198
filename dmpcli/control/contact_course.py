"""What all of a contact's supervision shares: state, correction, what was measured and told.

Forces are along the normal, N, positive where the surface pushes; e is in mm along the normal,
positive away from the surface. Scalars only: this runs once a cycle.
"""

from collections.abc import Callable
from dataclasses import replace

from dmpcli.admittance.contact_estimation import RiseTest
from dmpcli.admittance.force_law import ForceGains, LawState
from dmpcli.admittance.oscillation import AlternationDetector
from dmpcli.control.contact_policy import ContactEvent, ContactPolicy, ContactState
from dmpcli.control.landing import Landing

# The lift is looked at this far before its end, mm.
_STEP = 1.0
# s that a resting force is waited for, beside the delay.
REST = 0.1
# So many standard deviations of its noise a force is no noise.
SURE = 3.0


class ContactCourse:
    """What is known of one tool's contact, and what has happened to it, stroke after stroke.

    Parameters
    ----------
    policy : ContactPolicy
    period : float
        s.
    tell : callable, optional
        Told each event as it happens.

    Attributes
    ----------
    state : str
    events : list of ContactEvent
    law : LawState
    gains : ForceGains or None
        Once they are known.
    stiffness, delay : float or None
        As measured, N/mm and s.
    failure : str
        Why the run must end; empty while it need not.
    urgent : bool
        Whether it must end at once.
    doubted : bool
        A force is felt that does not rise with displacement.
    saturated : bool
        In this cycle the correction met its own limits.
    landing_peak : float
        Largest force of the landings, N.
    noise : float
        Standard deviation of a cycle's force while the tool was lifted and still, N.
    across : float or None
        Force across the normal that ended the run, if a wall did, N.
    """

    def __init__(
        self,
        policy: ContactPolicy,
        period: float,
        tell: Callable[[ContactEvent], None] = lambda _: None,
    ) -> None:
        self.policy, self._period, self._tell = policy, period, tell
        self._least = policy.contact
        self.state: ContactState = "free"
        self.events: list[ContactEvent] = []
        self.law = LawState()
        self.gains: ForceGains | None = policy.gains
        self.stiffness: float | None = None
        self.delay: float | None = policy.whole_delay
        self.failure, self.urgent = "", False
        self.doubted = self.saturated = False
        self.landing_peak = self.noise = 0.0
        self.across: float | None = None
        self._softened = False
        self.begin()

    def begin(self, airborne: bool = False) -> None:
        """Get ready for the next stroke's start.

        Parameters
        ----------
        airborne : bool
            Whether the tool is lifted there by the plan itself: then only the zero is taken.
        """
        policy, self._airborne = self.policy, airborne
        self.state, self._stage = "free", "lift"
        self.law = replace(self.law, speed=0.0, integral=0.0)
        self._waited = self._clock = self._absent = self._saturation = self._calm = 0.0
        self._near = 0.0
        self._count = 0
        self._settled = False
        self._lifts = [max(policy.reach - _STEP, 0.0), policy.reach]
        if airborne:
            self._lifts = [self.law.e]
        self._before: float | None = None
        self._sum = self._squares = self._number = 0.0
        self._felt: list[tuple[float, float]] = []
        self._landing: Landing | None = None
        self._lost_at = 0.0
        self._rise = RiseTest(slack=0.3)
        self._swings: AlternationDetector | None = None

    @property
    def e(self) -> float:
        """The correction, mm along the normal."""
        return self.law.e

    @property
    def settled(self) -> bool:
        """Whether the stroke may begin, or go on."""
        return self._settled

    def fail(self, t: float, state: ContactState, why: str, urgent: bool = False) -> None:
        """End it.

        Parameters
        ----------
        t : float
            s, of the event that is told.
        state : str
            What it ends in: ``lost``, ``too hard`` and so on.
        why : str
            For the user: what was found, and the remedy.
        urgent : bool
            Whether the run must end at once, not at leisure.
        """
        self._become(state, t, why)
        self.failure, self.urgent = why, urgent

    @property
    def _lag(self) -> float:
        known = self.policy.whole_delay
        return (self.policy.delay if known is None else known) + self._period

    @property
    def reaction(self) -> float:
        """From a displacement to what is done about its force, s."""
        return self._known_delay + self._period

    @property
    def _known_delay(self) -> float:
        return self.policy.delay if self.delay is None else self.delay

    def _become(self, state: ContactState, t: float, detail: str = "") -> None:
        self.state = state
        self._absent = 0.0
        self._note(t, detail)

    def _note(self, t: float, detail: str) -> None:
        event = ContactEvent(t, self.state, detail)
        self.events.append(event)
        self._tell(event)
