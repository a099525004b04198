"""Whether the arm has drawn what it acknowledged: it has moved, and it has come to where it should.

Set-points that are taken are only promises. The following error lets an arm that stands still draw
any stroke that is shorter than itself, and a closed stroke of any arm ends where it began. So each
stroke must have begun to move the arm, half as far as it leads away from its start, and must have
ended within a tolerance; what a run ends with must have come to rest there.
"""

import math

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import InstrumentError, beside
from dmpcli.instruments.protocols import RobotState
from dmpcli.planning.plan import Plan
from dmpcli.spatial.pose import Pose

TOLERANCE, ANGLE = 1.0, 0.0175
"""How far off the last set-point an arm may come to rest, mm and rad."""

# A stroke that leads no further away, mm and rad, tells nothing of whether the arm has moved.
_STIRS, _TURNS = 0.1, 0.01
_SHARE = 0.5


class ArrivalMonitor:
    """Watches the arm along one plan.

    Parameters
    ----------
    plan : Plan
    tolerance, angle : float
        mm and rad.
    coupled : bool
        Whether a force coupling leads the arm along the normal: then only what is across it counts.

    Attributes
    ----------
    started : bool
        Whether the arm has moved as the stroke asks it to.
    near : bool
        Whether it was seen at the stroke's end, once that had been sent.
    looked : bool
        Whether anybody has looked since.
    """

    def __init__(self, plan: Plan, tolerance: float, angle: float, coupled: bool = False) -> None:
        self._plan, self._tolerance, self._angle = plan, tolerance, angle
        self._normal = plan.normal_at(plan.last) if coupled else None
        self._far = self._farthest(plan)
        positions = plan.position[plan.lead : plan.last + 1]
        rotations = plan.rotation[plan.lead : plan.last + 1].reshape(len(positions), 9)
        self._turn = _angle(float((rotations @ rotations[0]).min()))
        self._first: RobotState | None = None
        self._latest: RobotState | None = None
        self._moves, self._turns = self._far <= _STIRS, self._turn <= _TURNS
        self.near = self.looked = False

    @property
    def started(self) -> bool:
        """Whether the arm has moved, and turned, where the stroke asks it to."""
        return self._moves and self._turns

    @property
    def arrived(self) -> bool:
        """Whether the stroke is drawn, as far as the arm's own pose tells."""
        return self.started and self.near

    def follow(self, plan: Plan) -> None:
        """Go on with a plan whose end has moved; what was seen of the arm counts on."""
        self._plan = plan
        self._far = self._farthest(plan)
        self._moves = self._moves or self._far <= _STIRS

    def _farthest(self, plan: Plan) -> float:
        """How far a stroke leads away from its start, mm."""
        positions = plan.position[plan.lead : plan.last + 1]
        away = positions - positions[0]
        if self._normal is not None and plan.normal is not None:
            normals = plan.normal[plan.lead : plan.last + 1]
            away = away - np.vecdot(away, normals)[:, None] * normals
        return math.sqrt(float(np.vecdot(away, away).max()))

    def see(self, state: RobotState, index: float) -> None:
        """Look at the arm while a set-point is sent.

        Parameters
        ----------
        state : RobotState
        index : float
            The set-point's number in the plan.
        """
        if index < self._plan.lead:
            return
        if self._first is None:
            self._first = state
        first, self._latest = self._first, state
        if not self._moves:
            away = state.position - first.position
            self._moves = float(away @ away) >= (_SHARE * self._far) ** 2
        if not self._turns:
            trace = float(state.rotation.ravel() @ first.rotation.ravel())
            self._turns = trace <= 1.0 + 2.0 * math.cos(_SHARE * self._turn)
        if not self.near and index >= self._plan.last:
            self.looked = True
            gap, turn = self._gap(state, self._plan.at(self._plan.last))
            self.near = gap <= self._tolerance and turn <= self._angle

    def refuse(self) -> None:
        """Say that the arm has not drawn the stroke.

        Raises
        ------
        InstrumentError
        """
        if not self.started or self._latest is None:
            raise InstrumentError(
                f"robot: took every set-point of stroke {self._plan.id} and has not moved as they "
                "ask; see its pendant, its brakes and what controls it"
            )
        end = self._plan.at(self._plan.last)
        raise self._missed(self._latest, end, f"did not come to the end of stroke {self._plan.id}")

    def check_rest(self, state: RobotState, goal: Pose) -> None:
        """Refuse the end of a run whose arm rests elsewhere than at the last set-point.

        Raises
        ------
        InstrumentError
        """
        gap, turn = self._gap(state, goal)
        if not (gap <= self._tolerance and turn <= self._angle):
            raise self._missed(state, goal, "rests elsewhere than at its last set-point")

    def _gap(self, state: RobotState, goal: Pose) -> tuple[float, float]:
        away: Floats = state.position - goal.position
        if self._normal is not None:
            away = away - (away @ self._normal) * self._normal
        return math.sqrt(away @ away), _angle(float(state.rotation.ravel() @ goal.rotation.ravel()))

    def _missed(self, state: RobotState, goal: Pose, how: str) -> InstrumentError:
        gap, turn = self._gap(state, goal)
        return InstrumentError(
            f"robot: {how}: it is {beside(gap, self._tolerance, '.2f')} mm, "
            f"{beside(turn, self._angle, '.4f')} rad away, over {self._tolerance:g} mm, "
            f"{self._angle:.3g} rad (--arrival-tolerance, --arrival-angle); see its pendant"
        )


def _angle(trace: float) -> float:
    """Angle of a rotation of this trace, rad."""
    return math.acos(min(max((trace - 1.0) / 2.0, -1.0), 1.0))  # in this order a NaN stays one
