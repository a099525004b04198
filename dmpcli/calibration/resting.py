"""A dwell of the tool: wait until it rests, then average its pose and what the sensor reads."""

from collections import deque
from collections.abc import Callable, Sequence

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.control import guards
from dmpcli.control.force_sensing import Sensing
from dmpcli.errors import InstrumentError
from dmpcli.instruments.protocols import Clock, RobotState, Sample, Servo
from dmpcli.records.static_poses import StaticPose
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.rotations import exp, log

STILL, STILL_ANGLE = 0.05, 0.002
"""mm and rad: what stays within these of its mean is at rest."""

STEP = 0.02
"""s between two looks at the arm."""


class Watcher:
    """Looks at an arm that somebody else moves, or nobody.

    Parameters
    ----------
    servo : Servo
        Open.
    clock : Clock
    sensing : Sensing, optional
        Without it the readings of a dwell are NaN.
    """

    def __init__(self, servo: Servo, clock: Clock, sensing: Sensing | None = None) -> None:
        self._servo, self._clock, self._sensing = servo, clock, sensing
        self._begin = clock.now()

    def look(self) -> tuple[RobotState, list[Sample]]:
        """Return the state and the readings after the next step of time.

        Raises
        ------
        InstrumentError
            An instrument is silent, or says what must not be believed.
        """
        self._clock.sleep_until(self._clock.now() + STEP)
        state = self._servo.state()
        guards.check_pose(state)
        heard = [] if self._sensing is None else self._sensing.hear(self._clock.now())
        return state, heard

    def rests(
        self, settle: float, patience: float, stop: Callable[[], bool] = lambda: False
    ) -> bool:
        """Wait until the tool has rested for `settle` s; False after `patience` s, or if stopped.

        Parameters
        ----------
        settle, patience : float
            s.
        stop : callable
            Read at each step.
        """
        begin = self._clock.now()
        states: deque[tuple[float, RobotState]] = deque()
        while not stop():
            state, _ = self.look()
            now = self._clock.now()
            states.append((now, state))
            while now - states[0][0] > settle + 1e-9:
                states.popleft()
            if now - begin >= settle - 1e-9 and at_rest(*_spread([s for _, s in states])):
                return True
            if now - begin > patience:
                break
        return False

    def dwell(self, duration: float) -> StaticPose:
        """Average over so many seconds; whether it rested meanwhile is in the result.

        Parameters
        ----------
        duration : float
            s.

        Raises
        ------
        InstrumentError
            An instrument is silent, or says what must not be believed.
        """
        begin = self._clock.now()
        states: list[RobotState] = []
        heard: list[Sample] = []
        while not states or self._clock.now() < begin + duration - 1e-9:
            state, samples = self.look()
            states.append(state)
            # What came before the dwell belongs to the motion.
            heard += [sample for sample in samples if sample.t > begin]
        if self._sensing is not None and len(heard) < 2:
            raise InstrumentError(
                f"force sensor: {len(heard)} readings in {duration:g} s; dwell longer"
            )
        mean = _mean(states)
        moved, turned = _spread(states)
        t = self._clock.now() - self._begin
        return StaticPose(t, mean.position, mean.rotation, moved, turned, *_readings(heard))


def at_rest(moved: float, turned: float) -> bool:
    """Tell whether a tool that strayed so far from its mean, mm and rad, counts as resting."""
    return moved <= STILL and turned <= STILL_ANGLE


def _mean(states: Sequence[RobotState]) -> Pose:
    """Mean of poses close to each other."""
    first = states[0].rotation
    turns = log(np.array([state.rotation for state in states]) @ first.T)
    position = np.mean([state.position for state in states], axis=0)
    return Pose(position, np.asarray(exp(turns.mean(axis=0)) @ first))


def _spread(states: Sequence[RobotState]) -> tuple[float, float]:
    """Furthest of the poses from their mean, mm and rad."""
    mean = _mean(states)
    away = np.array([state.position for state in states]) - mean.position
    turns = log(np.array([state.rotation for state in states]) @ mean.rotation.T)
    moved, turned = (float(np.linalg.norm(part, axis=-1).max()) for part in (away, turns))
    return moved, turned


def _readings(samples: Sequence[Sample]) -> tuple[Floats, Floats, int, float]:
    """Mean, standard deviation, number and unsteadiness of readings."""
    n = len(samples)
    if n == 0:
        return np.full(6, np.nan), np.full(6, np.nan), 0, 0.0
    wrenches = np.array([sample.wrench for sample in samples])
    halves = wrenches[: n // 2, :3].mean(axis=0), wrenches[n // 2 :, :3].mean(axis=0)
    change = float(np.linalg.norm(halves[1] - halves[0]))
    return wrenches.mean(axis=0), wrenches.std(axis=0, ddof=1), n, change
