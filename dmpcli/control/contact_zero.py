"""The zero of the force: taken while the tool is lifted and still, just before contact."""

from dmpcli.control.contact_course import REST, ContactCourse
from dmpcli.control.guarded_motion import towards

# A force that falls by so much over the last step of the lift is a contact, N.
_FALLS = 0.15
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
