"""Contact as a state: who looks for the surface, believes it, holds the force, and gives up.

Before each stroke the tool is lifted off the plan and held still: what it feels there is the zero.
Then it seeks the surface along the normal at a guarded speed. A force that rises with displacement
is a contact; its slope and what it rises by after a stop give stiffness and delay, and these the
gains. While it draws, the force may be lost, too large, or swing: each is a state of its own, and
what must not go on is a `failure`, at once where `urgent`.

Forces are along the normal, N, positive where the surface pushes; e is in mm along the normal,
positive away from the surface. Scalars only: this runs once a cycle.
"""

import math
from collections.abc import Callable
from dataclasses import replace

from dmpcli.admittance.contact_estimation import RiseTest
from dmpcli.admittance.force_law import ForceGains, LawState, advance, by_rule
from dmpcli.admittance.force_stability import is_stable
from dmpcli.admittance.oscillation import AlternationDetector
from dmpcli.control.contact_policy import ContactEvent, ContactPolicy, ContactState
from dmpcli.control.guarded_motion import sinking, towards
from dmpcli.control.landing import Landing

# How near the force must stay to its set-point, as a share of it, and for so long, s.
NEAR, NEAR_TIME = 0.1, 0.1
# In a landing the force may be so many times the limit of a stroke: it is met at first sight.
_LANDING = 1.5
# The lift is looked at this far before its end: a force that still falls is a contact, mm and N.
_STEP, _FALLS = 1.0, 0.15
# s over which resting forces are averaged, beside the delay that is waited for.
_MEAN, _REST = 0.2, 0.1
# Until a landing has come near to its set-point its gains are softened so much.
_GENTLE = 1.5
# Stiffness that is taken where nothing was measured, N/mm.
_USUAL = 5.0
# A tool that has not come to hold its force by then never will, s.
_LONGEST = 60.0

# Of what a delay is measured at, no more than this is believed, s.
_LATEST = 0.5
# Of an oscillation: alternations within so many delays, of a share of the set-point, or N.
_SWINGS, _WITHIN, _SWING_SHARE, _SWING = 6, 20.0, 0.3, 0.5
# Saturation is told once it has lasted so long, s.
_SATURATED = 0.1
# Fastest that is looked for a surface whose stiffness is known, mm/s, and the force it may cost.
_KNOWN, _COST = 8.0, 0.4


class ContactSupervisor:
    """The state of one tool's contact, stroke after stroke.

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
        self.landing_peak = 0.0
        self._softened = False
        self.begin()

    # --- what others ask

    @property
    def e(self) -> float:
        """The correction, mm along the normal."""
        return self.law.e

    @property
    def zeroing(self) -> bool:
        """Whether the tool is still and lifted, so that what it reads now is its zero."""
        return self.state == "free" and self._stage == "zero" and self._waited >= self._settling

    @property
    def settled(self) -> bool:
        """Whether the stroke may begin, or go on."""
        return self._settled

    @property
    def retreated(self) -> bool:
        """Whether the tool has come clear of the work after a stroke."""
        return self._stage == "clear"

    # --- what others do

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
        self._sum = self._number = 0.0
        self._felt: list[tuple[float, float]] = []
        self._landing: Landing | None = None
        self._lost_at = 0.0
        self._rise = RiseTest(slack=0.3)
        self._swings: AlternationDetector | None = None

    def lifted(self, e: float) -> None:
        """Say that the tool has come down to a point e over the plan instead."""
        self.law = LawState(e)

    def step(self, t: float, force: float, across: float, wanted: float) -> float:
        """Take in one cycle's force; return e, mm.

        Parameters
        ----------
        t : float
            s since the first set-point.
        force, across : float
            Along the normal, and its size across it, N.
        wanted : float
            F_d at this set-point, N; 0 where the tool is lifted.
        """
        self.saturated = False
        if self.failure:
            return self.law.e
        # A set-point near or below it would count as no contact.
        contact = self.policy.contact
        self._least = min(contact, wanted / 2.0) if wanted > 0.0 else contact
        touches = self.state in ("drawing", "landing", "lost", "seeking")
        if touches and wanted > 0.0:
            self._guard(t, force, across, wanted)
        if self.urgent:
            return self.law.e
        if self.state == "free":
            self._lift(t, force)
        elif wanted <= 0.0:
            self._held(t)
        elif self.state == "seeking":
            self._seek(t, force, wanted)
        elif self.state == "landing":
            self._land(t, force, wanted)
        elif self.state == "lost":
            self._lost(t, force)
        elif self.state == "retreating":
            self._resume(t, force, wanted)
        else:
            self._draw(t, force, wanted)
        return self.law.e

    def retreat(self, t: float) -> float:
        """Lift the tool off the work after a stroke; return e, mm."""
        if self._stage not in ("leave", "clear"):
            pressed = self.policy.setpoint / self.stiffness if self.stiffness else 0.0
            self._goal = max(self.law.e + pressed, self.law.e) + self.policy.reach
            self._stage = "leave"
            self._become("retreating", t)
        if self._stage == "leave":
            free = self.policy.free
            self.law, there = towards(self.law, self._goal, free, self._period)
            self._stage = "clear" if there else "leave"
        return self.law.e

    def leaves(self, t: float) -> None:
        """Say that the plan itself leads the tool off the work."""
        if self.state != "retreating":
            self._become("retreating", t)

    def fail(self, t: float, state: ContactState, why: str, urgent: bool = False) -> None:
        """End it."""
        self._become(state, t, why)
        self.failure, self.urgent = why, urgent

    # --- before contact

    @property
    def _settling(self) -> float:
        return self._lag + _REST

    @property
    def _lag(self) -> float:
        known = self.policy.whole_delay
        return (self.policy.delay if known is None else known) + self._period

    def _lift(self, t: float, force: float) -> None:
        """Lift in two steps, rest after each: a force that falls over the last one is a contact."""
        if self._stage == "lift":
            goal, free = self._lifts[0], self.policy.free
            self.law, there = towards(self.law, goal, free, self._period)
            if there:
                self._lifts.pop(0)
                self._stage = "zero" if not self._lifts else "look"
                self._waited = self._sum = self._number = 0.0
            return
        if self._waited >= self._settling:
            self._sum, self._number = self._sum + force, self._number + 1.0
        self._waited += self._period
        if self._waited < self._settling + _MEAN:
            return
        mean = self._sum / max(self._number, 1.0)
        if self._stage == "look":
            self._before, self._stage = mean, "lift"
        elif self._before is not None and self._before - mean > _FALLS:
            self.fail(
                t,
                "too hard",
                f"still pressed after it was lifted by {self.policy.reach:g} mm: the surface lies "
                "nearer; see where the part is, or raise coupling_reach",
            )
        elif self._airborne:
            self._settled, self._stage = True, "held"
            self._become("retreating", t)
        else:
            self._become("seeking", t)
            self._stage, self._count = "seek", 0

    def zero_is(self, t: float, size: float) -> None:
        """Say how far the zero was off, N; too far is refused."""
        if size > self.policy.zero_limit:
            self.fail(
                t,
                "free",
                f"the lifted tool reads {size:.2f} N, over {self.policy.zero_limit:g} N "
                "(coupling_zero_limit): the tool file's zero or weight is another one's, or "
                "something touches the tool; calibrate, and lift it clear",
            )

    # --- looking for the surface

    @property
    def _speed(self) -> float:
        """How fast a surface is looked for: known ones quicker, by what the delay costs."""
        policy, k = self.policy, self.stiffness or self.policy.stiffness
        slow = min(policy.seek, 0.4 * policy.setpoint)
        if k is None:
            return slow
        quick = _COST * policy.setpoint / (k * (self._known_delay + _REST))
        return max(min(quick, _KNOWN), min(slow, quick))

    @property
    def _known_delay(self) -> float:
        return self.policy.delay if self.delay is None else self.delay

    def _seek(self, t: float, force: float, wanted: float) -> None:
        policy = self.policy
        again = self._settled
        self._count = self._count + 1 if force > self._least else 0
        if not self._count:
            self._felt.clear()
        self._felt.append((-self.law.e, force))
        if self._count >= 2:
            self._become("landing", t, f"{force:.2f} N at {self.law.e:+.2f} mm off the plan")
            self._near = 0.0
            if again:
                self._stage = "settle"
                self.law = replace(self.law, speed=0.0, integral=0.0)
            else:
                self._stage, free, T = "probe", policy.free, self._period
                lag = 2.0 * self._lag + _REST
                self._landing = Landing(wanted, self._speed, free, lag, T, self._felt[1:])
                self.law = sinking(self.law, self._speed, self._period)
            return
        lowest = max(self._lost_at - policy.again, -policy.clamp) if again else -policy.reach
        if self.law.e <= lowest + 1e-9:
            if again:
                self.fail(
                    t,
                    "lost",
                    f"contact was lost and not found again within {policy.again:g} mm: the part "
                    "ends there, or falls away",
                )
            else:
                self.fail(
                    t,
                    "lost",
                    f"no contact within {policy.reach:g} mm of the plan (coupling_reach); check "
                    "surface and sensor",
                )
            return
        self.law = sinking(self.law, self._speed, self._period)

    # --- landing

    def _land(self, t: float, force: float, wanted: float) -> None:
        self._clock += self._period
        self.landing_peak = max(self.landing_peak, force)
        if self._clock > _LONGEST:
            late = (
                f" behind a delay of {self._known_delay:.3g} s" if self._known_delay > 0.15 else ""
            )
            self.fail(t, "landing", f"the force does not settle at {wanted:g} N{late}")
        elif self._stage == "probe":
            self._probe(t, force)
        else:
            self._settle(t, force, wanted)

    def _probe(self, t: float, force: float) -> None:
        """Go in, rest, press, rest; then take stiffness, delay and gains from what was felt."""
        assert self._landing is not None
        landing, policy = self._landing, self.policy
        self.law = landing.step(self.law, force)
        if force <= self._least / 2.0 and landing.found is None and not landing.resting:
            self._become("seeking", t, f"{force:.2f} N: it was no contact")
            self._count = 0
        elif landing.failure:
            self.fail(
                t,
                "landing",
                f"no contact within {policy.reach:g} mm of the plan: {landing.failure}; check the "
                "tool's zero and the surface",
            )
        elif landing.found is not None:
            self.stiffness = landing.found.stiffness
            if policy.whole_delay is None:
                self.delay = max(policy.delay, min(landing.found.delay, _LATEST))
            self._choose()
            if not self._refused(t):
                self._stage, self._near = "settle", 0.0

    def _choose(self) -> None:
        """Take the gains by the rule, unless they were chosen."""
        policy = self.policy
        if policy.gains is None:
            k = policy.stiffness or self.stiffness or _USUAL
            whole = self._known_delay + self._period / 2.0
            self.gains = by_rule(k, whole, self._period, policy.spring)
        self._swings = None

    def _refused(self, t: float) -> bool:
        """Refuse gains that the contact just measured would make swing."""
        k, delay = self.stiffness, self._known_delay
        if self.gains is None or k is None or is_stable(self.gains, k, delay):
            return False
        self.fail(
            t,
            "oscillating",
            f"damping {self.gains.damping:.3g} N·s/mm is unstable on a contact of {k:.3g} N/mm "
            f"behind {delay:.3g} s: leave the gains to the rule, or use a softer tool or a "
            "shorter look-ahead",
        )
        return True

    def _settle(self, t: float, force: float, wanted: float) -> None:
        self._hold_force(t, force, wanted)
        near = abs(force - wanted) <= NEAR * wanted
        self._near = self._near + self._period if near else 0.0
        if self._settled:
            if force >= 0.5 * wanted:
                self._become("drawing", t)
            elif force <= self._least:
                self._absent += self._period
                if self._absent > self.policy.patience:
                    self._lose(t)
            else:
                self._absent = 0.0
            return
        if self._near >= 3.0 * self._known_delay + NEAR_TIME:
            self._settled = True
            k, peak = self.stiffness or 0.0, self.landing_peak
            self._become("drawing", t, f"stiffness {k:.3g} N/mm, landing peak {peak:.2f} N")

    # --- drawing

    def _draw(self, t: float, force: float, wanted: float) -> None:
        if force <= self._least:
            # Held: taken as a contact that pushes too little, no force would lead into the air.
            self._absent += self._period
            self.law = replace(self.law, speed=0.0)
            if self._absent > self.policy.patience:
                self._lose(t)
            return
        self._absent = 0.0
        self._hold_force(t, force, wanted)

    def _hold_force(self, t: float, force: float, wanted: float) -> None:
        """One step of the law, within the coupling's own limits."""
        if self.gains is None:
            self._choose()
        assert self.gains is not None
        policy, before, gains = self.policy, self.law, self.gains
        if not self._settled and self._near < self._known_delay + NEAR_TIME:
            # The last part of a landing is not to overshoot: slower, and with nothing summed up.
            gains = replace(gains.softened(_GENTLE), integral=math.inf)
        made = advance(gains, before, force - wanted, policy.rate)
        k = self.stiffness or policy.stiffness or _USUAL
        surface = made.e + max(force, 0.0) / k
        if abs(surface) > policy.clamp and surface * made.speed > 0.0:
            made = LawState(before.e, 0.0, before.integral, saturated=True)
        self.law = made
        self._saturate(t, made.saturated, abs(surface) > policy.clamp)
        self.doubted = not self._rise.believed(force, wanted, -made.e, k)
        if self.doubted:
            self._lose(t, f"{force:.2f} N that does not rise with displacement")
            return
        self._listen(t, force - wanted, wanted)

    def _saturate(self, t: float, saturated: bool, clamped: bool) -> None:
        self.saturated = saturated
        before = self._saturation
        self._saturation = before + self._period if saturated else 0.0
        if before < _SATURATED <= self._saturation:
            which = (
                f"{self.policy.clamp:g} mm (coupling_clamp)"
                if clamped
                else (f"{self.policy.rate:g} mm/s (coupling_rate)")
            )
            self._note(t, f"saturated: the correction has reached {which}")

    def _listen(self, t: float, error: float, wanted: float) -> None:
        """Soften the gains of a loop that swings, once; stop one that swings on."""
        if self._swings is None:
            size = max(_SWING_SHARE * wanted, _SWING)
            window = _WITHIN * (self._known_delay + self._period)
            self._swings = AlternationDetector(size, _SWINGS, window)
        if not (self._swings.feel(t, error) and self._swings.grows):
            return
        swing = f"the force swings by {self._swings.swing:.2f} N"
        if self._softened or self.gains is None:
            self.fail(
                t,
                "oscillating",
                f"{swing} with softer gains too: give --stiffness and --delay of the true loop, or "
                "use a softer tool or a shorter look-ahead",
                urgent=True,
            )
            return
        before = self.state
        self._become("oscillating", t, f"{swing}: gains halved")
        self._softened, self.gains = True, self.gains.softened(2.0)
        self._swings.reset()
        self._become(before, t)

    # --- trouble

    def _guard(self, t: float, force: float, across: float, wanted: float) -> None:
        """Stop at once at a force that the tool must not meet."""
        policy = self.policy
        most = policy.limit * max(wanted, 2.0 * policy.contact)
        if self.state == "landing" and not self._settled:
            most *= _LANDING
        if force > most:
            k = "" if self.stiffness is None else f" on {self.stiffness:.3g} N/mm"
            self.fail(
                t,
                "too hard",
                f"{force:.1f} N along the normal, over {most:.1f} N{k} behind "
                f"{self._known_delay:.2g} s: a wall, a ramp, or a surface that is stiffer than the "
                "loop can follow",
                urgent=True,
            )
        elif across > policy.drag + policy.rub * max(force, 0.0):
            self.fail(
                t,
                "too hard",
                f"{across:.1f} N across the normal beside {force:.1f} N along it: the tool has met "
                "a wall or an edge",
                urgent=True,
            )

    def _lose(self, t: float, why: str = "") -> None:
        policy = self.policy
        if policy.on_loss == "stop":
            self.fail(t, "lost", "contact was lost (--on-contact-loss stop)")
            return
        if self.state != "lost":
            self._become("lost", t, why)
        self._lost_at, self._count = self.law.e, 0
        self.law = replace(self.law, speed=0.0, integral=0.0)
        self._felt.clear()
        if policy.on_loss == "seek" and not why:
            self._become("seeking", t)
        elif why:
            self.fail(t, "lost", f"{why}: it is no contact; check the tool's zero")

    def _lost(self, t: float, force: float) -> None:
        """Hold, and go on where the surface comes back."""
        self._count = self._count + 1 if force > self._least else 0
        if self._count >= 2:
            self._stage = "settle"
            self._become("landing", t, f"{force:.2f} N")

    # --- lifted parts of a stroke

    def _held(self, t: float) -> None:
        """Keep the correction where the plan lifts the tool: the surface is where it was."""
        if self.state != "retreating":
            self._become("retreating", t)
        self.law = LawState(self.law.e)

    def _resume(self, t: float, force: float, wanted: float) -> None:
        """Land again where the plan sets the tool down."""
        self._stage, self._settled, self._absent = "settle", True, 0.0
        self._lost_at = self.law.e
        if force > self._least:
            self._become("landing", t, f"{force:.2f} N")
            self._settle(t, force, wanted)
        else:
            self._become("seeking", t)
            self._count = 0

    # --- events

    def _become(self, state: ContactState, t: float, detail: str = "") -> None:
        self.state = state
        self._absent = 0.0
        self._note(t, detail)

    def _note(self, t: float, detail: str) -> None:
        event = ContactEvent(t, self.state, detail)
        self.events.append(event)
        self._tell(event)
