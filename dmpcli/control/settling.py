"""Whether the arm stands still, and has come to rest behind its last set-point."""

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


class RestWindow:
    """The last states of an arm, which rests where none of them is elsewhere.

    Parameters
    ----------
    window : float
        So long it must have stood still, s.
    """

    def __init__(self, window: float) -> None:
        self._window = window
        self._states: deque[RobotState] = deque()

    def rests(self, state: RobotState) -> bool:
        """Take in a state; tell whether the arm has stood still for the whole window by now."""
        states = self._states
        states.append(state)
        # The oldest one that is kept reaches over the window.
        while len(states) > 2 and state.t - states[1].t >= self._window - 1e-9:
            states.popleft()
        spanned = state.t - states[0].t >= self._window - 1e-9
        return spanned and all(_near(state, other) for other in states)

    @property
    def moved(self) -> str:
        """How far apart the states are, in words."""
        newest, oldest = self._states[-1], self._states[0]
        distance, angle = _apart(newest, oldest)
        return f"moved {distance:.3g} mm, {angle:.3g} rad in {newest.t - oldest.t:.2g} s"


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
        return waited >= WINDOW - 1e-9 and all(_near(state, s) for s in self._states)


def _near(state: RobotState, other: RobotState) -> bool:
    distance, angle = _apart(state, other)
    return distance <= _DISTANCE and angle <= _ANGLE


def _apart(state: RobotState, other: RobotState) -> tuple[float, float]:
    moved = float(np.linalg.norm(other.position - state.position))
    return moved, float(np.linalg.norm(log_one(other.rotation @ state.rotation.T)))
