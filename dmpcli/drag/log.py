"""What the control loop remembers of each cycle, and the columns of the demonstration file."""

import numpy as np

from dmpcli.arrays import AnyArray, Floats
from dmpcli.instruments.protocols import RobotState, Sample
from dmpcli.primitives.admittance import Pose
from dmpcli.records.schemas import EULER_ANGLES, POSITION, WRENCH, suffixed
from dmpcli.rotations import to_euler_continuous


class Log:
    """One recording, cycle by cycle."""

    def __init__(self) -> None:
        self._t: list[float] = []
        self._states: list[RobotState] = []
        self._references: list[Pose] = []
        self._wrenches: list[Floats] = []
        self._samples: list[Sample] = []
        self._moved = 0.0

    def __len__(self) -> int:
        return len(self._t)

    @property
    def duration(self) -> float:
        """Time of the last row, s; 0 where there is none."""
        return self._t[-1] if self._t else 0.0

    def add(
        self, t: float, state: RobotState, reference: Pose | None, wrench: Floats, sample: Sample
    ) -> None:
        """Remember one cycle.

        Parameters
        ----------
        t : float
            Since the recording began, s.
        state : RobotState
        reference : Pose or None
            Admittance output of this cycle; None where the robot's own drag teaching moves it.
        wrench : array, shape (6,)
            Compensated, at the TCP, base axes.
        sample : Sample
            The newest, as sensed.
        """
        # Nanoseconds: below them are the rounding errors of the clock's sums.
        self._t.append(round(t, 9))
        self._states.append(state)
        if reference is not None:
            self._references.append(reference)
        self._wrenches.append(wrench)
        self._samples.append(sample)
        step = state.position - self._states[0].position
        self._moved = max(self._moved, float(np.sqrt(step @ step)))

    def moved(self, distance: float) -> bool:
        """Tell whether the tool has ever been further than this from where it began, mm."""
        return self._moved > distance

    def still(self, duration: float, distance: float) -> bool:
        """Tell whether the tool has stayed within `distance` (mm) of here for `duration` (s)."""
        if self._t[-1] - self._t[0] < duration:
            return False
        here = self._states[-1].position
        for t, state in zip(reversed(self._t), reversed(self._states), strict=True):
            step = state.position - here
            if float(np.sqrt(step @ step)) > distance:
                return False
            if self._t[-1] - t >= duration:
                break
        return True

    def columns(self) -> dict[str, AnyArray]:
        """Return the columns of the demonstration file, each of shape (rows,)."""
        columns: dict[str, AnyArray] = {"t": np.array(self._t)}
        columns |= _pose_columns(self._states, "")
        if self._references:
            columns |= _pose_columns(self._references, "ref")
        columns |= dict(zip(WRENCH, np.array(self._wrenches).T, strict=True))
        raw = np.array([sample.wrench for sample in self._samples])
        columns |= dict(zip(suffixed(WRENCH, "raw"), raw.T, strict=True))
        columns["sensor_seq"] = np.array([sample.seq for sample in self._samples], dtype=np.int64)
        columns["lost"] = np.array([sample.lost for sample in self._samples], dtype=np.int64)
        return columns


def _pose_columns(poses: list[RobotState] | list[Pose], suffix: str) -> dict[str, AnyArray]:
    position = np.array([pose.position for pose in poses])
    # A pen that points straight down has rx = ±π: unwrapped, so that the column does not jump.
    angles = to_euler_continuous(np.array([pose.rotation for pose in poses]))
    tail = f"_{suffix}" if suffix else ""
    return {name + tail: position[:, i] for i, name in enumerate(POSITION)} | {
        name + tail: angles[:, i] for i, name in enumerate(EULER_ANGLES)
    }
