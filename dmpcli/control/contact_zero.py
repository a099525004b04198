"""The zero of the force: taken while the tool is lifted and still, just before contact."""

import math

from dmpcli.control.contact_course import REST, SURE, ContactCourse
from dmpcli.control.guarded_motion import towards
from dmpcli.errors import beside

# A force that falls by so much over the last step of the lift is a contact, N, and so many standard
# deviations of a cycle's noise.
_FALLS, _SCATTERS = 0.15, 2.0
# s over which resting forces are averaged, beside the delay that is waited for.
_MEAN = 0.2


class LiftedTool(ContactCourse):
    """The part of a contact's supervision that lifts the tool, and knows what it reads there."""

    @property
    def zeroing(self) -> bool:
        """Whether the tool is still and lifted, so that what it reads now is its zero."""
        return self.state == "free" and self._stage == "zero" and self._waited >= self._settling

    @property
    def _settling(self) -> float:
        return self._lag + REST

    def _lift(self, t: float, force: float, wanted: float) -> None:
        """Lift in two steps, rest after each: a force that falls over the last one is a contact.

        By how much it scatters meanwhile is the noise that everything else is judged by.
        """
        if self._stage == "lift":
            goal, free = self._lifts[0], self.policy.free
            self.law, there = towards(self.law, goal, free, self._period)
            if there:
                self._lifts.pop(0)
                self._stage = "zero" if not self._lifts else "look"
                self._waited = self._sum = self._squares = self._number = 0.0
            return
        if self._waited >= self._settling:
            self._sum, self._number = self._sum + force, self._number + 1.0
            self._squares += force * force
        self._waited += self._period
        if self._waited < self._settling + _MEAN:
            return
        count = max(self._number, 1.0)
        mean = self._sum / count
        scatter = max(self._squares / count - mean * mean, 0.0) * count / max(count - 1.0, 1.0)
        # Of two rests the mean.
        known = self._before is not None
        self.noise = math.sqrt(0.5 * (self.noise**2 + scatter) if known else scatter)
        if self._stage == "look":
            self._before, self._stage = mean, "lift"
        elif self._before is not None and self._before - mean > max(_FALLS, _SCATTERS * self.noise):
            self.fail(
                t,
                "too hard",
                f"still pressed after it was lifted by {self.policy.reach:g} mm: the surface lies "
                "nearer; see where the part is, or raise coupling_reach",
            )
        elif SURE * self.noise > 0.5 * (wanted or self.policy.setpoint):
            self.fail(
                t,
                "free",
                f"the force scatters by {self.noise:.2g} N while the tool is lifted and still: too "
                f"much to feel {wanted or self.policy.setpoint:g} N by; press harder, or have the "
                "sensor filter more",
            )
        elif self._airborne:
            self._settled, self._stage = True, "held"
            self._become("retreating", t)
        else:
            self._become("seeking", t)
            self._stage, self._count = "seek", 0

    def zero_is(self, t: float, size: float) -> None:
        """Say how far the zero was off, N; too far is refused."""
        if size > (most := self.policy.zero_limit):
            self.fail(
                t,
                "free",
                f"the lifted tool reads {beside(size, most, '.2f')} N, over {most:g} N "
                "(coupling_zero_limit): the tool file's zero or weight is another one's, or "
                "something touches the tool; calibrate, and lift it clear",
            )
