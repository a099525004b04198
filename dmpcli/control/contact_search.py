"""The surface is looked for, and the landing measures it: stiffness, delay and so the gains."""

from dataclasses import replace

from dmpcli.admittance.force_stability import is_safe, steadied
from dmpcli.control.contact_course import REST, SURE
from dmpcli.control.contact_holding import NEAR, NEAR_TIME, HeldForce
from dmpcli.control.guarded_motion import sinking
from dmpcli.control.landing import Landing

# A tool that has not come to hold its force by then never will, s.
_LONGEST = 60.0
# Of what a delay is measured at, no more than this is believed, s.
_LATEST = 0.5
# No nearer than this to a set-point is asked of a reading, N.
_NOISE = 0.15
# Fastest that is looked for a surface whose stiffness is known, mm/s, and the force it may cost.
_KNOWN, _COST = 8.0, 0.4


class SoughtSurface(HeldForce):
    """The part of a contact's supervision that finds the surface and measures the contact."""

    @property
    def _speed(self) -> float:
        """How fast a surface is looked for: known ones quicker, by what the delay costs."""
        policy, k = self.policy, self.stiffness or self.policy.stiffness
        slow = min(policy.seek, 0.4 * policy.setpoint)
        if k is None:
            return slow
        quick = _COST * policy.setpoint / (k * (self._known_delay + REST))
        return max(min(quick, _KNOWN), min(slow, quick))

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
                lag = 2.0 * self._lag + REST
                touched = self._felt[1:]
                self._landing = Landing(wanted, self._speed, free, lag, T, touched, self.noise)
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
        speed = self._again(wanted) if again else self._speed
        self.law = sinking(self.law, speed, self._period)

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
            late = min(landing.found.delay, _LATEST)
            if policy.whole_delay is None:
                # The gains are on the safe side of what the arm tells of itself.
                self.delay = max(policy.delay, late)
            self._choose()
            if not self._refused(t, late):
                self._stage, self._near = "settle", 0.0

    def _refused(self, t: float, late: float) -> bool:
        """Refuse gains that the contact just measured would make swing; `late` is its delay, s.

        Those by the rule are softened instead: a heavy tool on a quick arm needs that.
        """
        k, tool = self.stiffness, self.policy.tool_mass
        if self.gains is None or k is None:
            return False
        chosen = self.policy.gains is not None
        held = None if chosen else steadied(self.gains, k, late, 1e-3 * tool)
        if held is not None or (chosen and is_safe(self.gains, k, late, 1e-3 * tool)):
            self.gains = held or self.gains
            return False
        heavy = f" with a tool of {tool:.3g} kg, whose inertia is felt too" if tool else ""
        self.fail(
            t,
            "oscillating",
            f"damping {self.gains.damping:.3g} N·s/mm is unstable on a contact of {k:.3g} N/mm "
            f"behind {late:.3g} s{heavy}: leave the gains to the rule, or use a softer or lighter "
            "tool, or a shorter look-ahead",
        )
        return True

    def _settle(self, t: float, force: float, wanted: float) -> None:
        self._hold_force(t, force, wanted)
        near = abs(force - wanted) <= max(NEAR * wanted, _NOISE, SURE * self.noise)
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
