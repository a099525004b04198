"""Whether an arm stands still after its last set-point."""

from collections import deque

import numpy as np

from dmpcli.errors import InstrumentError
from dmpcli.instruments.protocols import RobotState, ServoInfo
from dmpcli.spatial.rotations import log_one

WINDOW = 0.05
"""s: what has moved less than `_DISTANCE` and `_ANGLE` for so long stands still."""

PATIENCE = 2.0
"""s beyond the look-ahead, after which an arm that still moves has failed."""

_DISTANCE, _ANGLE = 0.02, 0.001  # mm, rad


class SettlingDetector:
    """Waits for an arm to come to rest; the last set-point is sent on and on meanwhile.

    What is left in a controller's queue is motion that has not been done yet: to leave the servo
    now would cut it off.

    Parameters
    ----------
    info : ServoInfo
    period : float
        s.
    """

    def __init__(self, info: ServoInfo, period: float) -> None:
        self._info, self._period = info, period
        self._states: deque[RobotState] = deque()
        self._begun: float | None = None

    def reached(self, state: RobotState) -> bool:
        """Tell whether the arm stands still.

        Parameters
        ----------
        state : RobotState
            Of this cycle; the first one is that of the cycle that sends the last set-point.

        Raises
        ------
        InstrumentError
            It does not come to rest.
        """
        self._begun = state.t if self._begun is None else self._begun
        self._states.append(state)
        while state.t - self._states[0].t > WINDOW + self._period / 2.0:
            self._states.popleft()
        waited = state.t - self._begun - self._info.lookahead
        if waited > PATIENCE:
            raise InstrumentError(
                "robot: does not come to rest after its last set-point; see what moves it"
            )
        return waited >= WINDOW - 1e-9 and all(self._near(state, s) for s in self._states)

    def _near(self, state: RobotState, other: RobotState) -> bool:
        moved = float(np.linalg.norm(other.position - state.position))
        turned = float(np.linalg.norm(log_one(other.rotation @ state.rotation.T)))
        return moved <= _DISTANCE and turned <= _ANGLE
