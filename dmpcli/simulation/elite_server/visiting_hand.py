"""Who drags the tool of the virtual lab: a hand that comes when the arm may be dragged."""

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.simulation.elite_server.joint_arm import JointArm
from dmpcli.simulation.elite_server.motions import Transmission
from dmpcli.simulation.hand import SimulatedHand

REACH = 3.0
"""mm from the start of its stroke within which the hand takes hold."""

PATIENCE = 0.8
"""s for which the arm must have stood still in servo mode: one that draws by itself moves sooner.

Longer than a look-ahead and a soft start together.
"""

# rad, of any joint: at the tool less than 0.1 mm.
_STILL = 1e-4


class VisitingHand:
    """Draws its stroke whenever it may, so many times.

    It takes hold when the arm stands in servo mode at the start of the stroke, and lets go when the
    arm leaves servo mode or has got no set-points for a while. A stroke counts once it was drawn to
    its end.

    Parameters
    ----------
    tutor : SimulatedHand
    start : array, shape (3,)
        Of its stroke, mm.
    lasts : float
        From taking hold to the stroke's end, s.
    strokes : int
        How many it draws.

    Attributes
    ----------
    drawn : int
        Strokes drawn to their end.
    gripping : bool
    track : list
        Time, s, position, mm, and rotation of the TCP at each reading while it grips.
    """

    def __init__(self, tutor: SimulatedHand, start: Floats, lasts: float, strokes: int) -> None:
        self._tutor, self._start = tutor, start
        self._lasts, self._strokes = lasts, strokes
        self._spot: Floats | None = None  # joint angles where it stands
        self._since = self._began = self._fed = -np.inf
        self.drawn = 0
        self.gripping = False
        self.track: list[tuple[float, Floats, Floats]] = []

    def watch(self, t: float, arm: JointArm, transmission: Transmission | None) -> None:
        """Look at the arm: take hold, or let go.

        Parameters
        ----------
        t : float
            s.
        arm : JointArm
        transmission : Transmission or None
            What feeds the arm with set-points.
        """
        if transmission is not None and transmission.running:
            self._fed = t
        elif transmission is None or t - self._fed > PATIENCE:
            self._let_go(t)
        if self.gripping or self.drawn >= self._strokes or self._fed < t:
            return
        if self._spot is None or float(np.abs(arm.joints - self._spot).max()) > _STILL:
            self._spot, self._since = arm.joints, t
        if t - self._since < PATIENCE:
            return
        if float(np.linalg.norm(arm.posture.position - self._start)) <= REACH:
            self.gripping, self._began = True, t
            self._tutor.begin(t)

    def _let_go(self, t: float) -> None:
        if self.gripping and t >= self._began + self._lasts:
            self.drawn += 1
        self.gripping, self._spot = False, None

    def wrench(self, t: float, position: Floats, rotation: Floats, velocity: Floats) -> Floats:
        """Return the hand's wrench on the tool; see `dmpcli.simulation.mock.Hand`."""
        if not self.gripping:
            return np.zeros(6)
        if not self.track or t > self.track[-1][0]:
            self.track.append((t, position, rotation))
        return self._tutor.wrench(t, position, rotation, velocity)
