"""The force that is held: gains by rule, the coupling's own limits, swings, walls and losses."""

import math
from dataclasses import replace

from dmpcli.admittance.force_law import LawState, advance, by_rule
from dmpcli.admittance.oscillation import AlternationDetector
from dmpcli.control.contact_course import ContactCourse
from dmpcli.errors import beside

# How near the force must stay to its set-point, as a share of it, and for so long, s.
NEAR, NEAR_TIME = 0.1, 0.1
# In a landing the force may be so many times the limit of a stroke: it is met at first sight.
_LANDING = 1.5
# An error of more than this share of the set-point is not summed up.
_STEPS = 0.5
# Until a landing has come near to its set-point its gains are softened so much.
_GENTLE = 1.5
# Where a surface that was lost is met again the force may rise over the set-point by this share of
# it, after the delay and so many periods; no faster than this, mm/s.
_MORE, _CYCLES, _FASTEST = 0.5, 2.0, 20.0
# Stiffness that is taken where nothing was measured, N/mm.
_USUAL = 5.0
# Of an oscillation: alternations within so many delays, of a share of the set-point, or N.
_SWINGS, _WITHIN, _SWING_SHARE, _SWING = 6, 20.0, 0.3, 0.5
# The same in standard deviations of the noise, where that is more.
_SWING_NOISE = 8.0
# What a friction that is known may be off by, and a tilt may add.
_RUBS = 0.2
# Saturation is told once it has lasted so long, s.
_SATURATED = 0.1


class HeldForce(ContactCourse):
    """The part of a contact's supervision that holds a force once the tool touches."""

    def _choose(self) -> None:
        """Take the gains by the rule, unless they were chosen."""
        policy = self.policy
        if policy.gains is None:
            k = policy.stiffness or self.stiffness or _USUAL
            whole = self._known_delay + self._period / 2.0
            tool = 1e-3 * policy.tool_mass
            self.gains = by_rule(k, whole, self._period, policy.spring, tool)
        self._swings = None

    def _draw(self, t: float, force: float, wanted: float) -> None:
        if force <= self._least:
            self._absent += self._period
            self._regain(wanted)
            if self._absent > self.policy.patience:
                self._lose(t)
            return
        self._absent = 0.0
        self._hold_force(t, force, wanted)

    def _again(self, wanted: float) -> float:
        """How fast a surface that was lost is gone after, mm/s: what that costs is known."""
        k = self.stiffness or self.policy.stiffness or _USUAL
        late = self._known_delay + _CYCLES * self._period
        return min(_MORE * wanted / (k * late), _FASTEST)

    def _regain(self, wanted: float) -> None:
        """Go on after a surface that has just fallen away, where it is to be sought.

        Taken as a contact that pushes too little, no force would lead into the air.
        """
        policy, law, speed = self.policy, self.law, self._again(wanted)
        if policy.on_loss == "seek" and law.e - speed * self._period > -policy.clamp:
            self.law = LawState(law.e - speed * self._period, -speed, law.integral)
        else:
            self.law = replace(law, speed=0.0)

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
        if abs(force - wanted) > _STEPS * wanted:
            # What has stepped, or was just met, is no slope that the integral has to follow.
            made = replace(made, integral=before.integral)
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
            size = max(_SWING_SHARE * wanted, _SWING, _SWING_NOISE * self.noise)
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

    def _guard(self, t: float, force: float, across: float, wanted: float, friction: float) -> None:
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
                f"{beside(force, most, '.1f')} N along the normal, over "
                f"{beside(most, force, '.1f')} N{k} behind "
                f"{self._known_delay:.2g} s: a wall, a ramp, or a surface that is stiffer than the "
                "loop can follow",
                urgent=True,
            )
        elif across > policy.drag + max(policy.rub, friction + _RUBS) * max(force, 0.0):
            self.across = across
            self.fail(
                t,
                "too hard",
                f"{across:.1f} N across the normal beside {force:.1f} N along it: the tool has met "
                "a wall or an edge, or rubs harder than coupling_drag and coupling_rub allow",
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
        seeks = policy.on_loss == "seek" and not why
        self.law = replace(self.law, speed=self.law.speed if seeks else 0.0, integral=0.0)
        self._felt.clear()
        if seeks:
            self._become("seeking", t)
        elif why:
            self.fail(t, "lost", f"{why}: it is no contact; check the tool's zero")

    def _lost(self, t: float, force: float) -> None:
        """Hold, and go on where the surface comes back."""
        self._count = self._count + 1 if force > self._least else 0
        if self._count >= 2:
            self._stage = "settle"
            self._become("landing", t, f"{force:.2f} N")
