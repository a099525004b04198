"""Contact as a state: who looks for the surface, believes it, holds the force, and gives up.

Before each stroke the tool is lifted off the plan and held still: what it feels there is the zero.
Then it seeks the surface along the normal at a guarded speed. A force that rises with displacement
is a contact; its slope and what it rises by after a stop give stiffness and delay, and these the
gains. While it draws, the force may be lost, too large, or swing: each is a state of its own, and
what must not go on is a `failure`, at once where `urgent`.

Forces are along the normal, N, positive where the surface pushes; e is in mm along the normal,
positive away from the surface. Scalars only: this runs once a cycle.
"""

from dmpcli.admittance.force_law import LawState
from dmpcli.control.contact_course import SURE
from dmpcli.control.contact_search import SoughtSurface
from dmpcli.control.contact_zero import LiftedTool
from dmpcli.control.guarded_motion import towards


class ContactSupervisor(LiftedTool, SoughtSurface):
    """The state of one tool's contact, stroke after stroke: what each cycle's force leads to.

    Its parameters and attributes are those of `ContactCourse`; the zero, the search and the force
    that is held are parts of their own.
    """

    @property
    def retreated(self) -> bool:
        """Whether the tool has come clear of the work after a stroke."""
        return self._stage == "clear"

    def lifted(self, e: float) -> None:
        """Say that the tool has come down to a point e over the plan instead."""
        self.law = LawState(e)

    def step(
        self, t: float, force: float, across: float, wanted: float, friction: float = 0.0
    ) -> float:
        """Take in one cycle's force; return e, mm.

        Parameters
        ----------
        t : float
            s since the first set-point.
        force, across : float
            Along the normal, and its size across it, N.
        wanted : float
            F_d at this set-point, N; 0 where the tool is lifted.
        friction : float
            Coulomb's coefficient as it was felt; 0 where it was not yet.
        """
        self.saturated = False
        if self.failure:
            return self.law.e
        # A set-point near or below it would count as no contact.
        contact = max(self.policy.contact, SURE * self.noise)
        self._least = min(contact, wanted / 2.0) if wanted > 0.0 else contact
        touches = self.state in ("drawing", "landing", "lost", "seeking")
        if touches and wanted > 0.0:
            self._guard(t, force, across, wanted, friction)
        if self.urgent:
            return self.law.e
        if self.state == "free":
            self._lift(t, force, wanted)
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
