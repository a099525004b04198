"""What the control loop remembers of each cycle, and the columns of the demonstration file."""

import numpy as np

from dmpcli.admittance.model import DragState
from dmpcli.arrays import AnyArray, Floats
from dmpcli.instruments.protocols import RobotState, Sample
from dmpcli.records.row_buffer import RECOVERED, RowBuffer
from dmpcli.records.schemas import EULER_ANGLES, POSITION, WRENCH, suffixed
from dmpcli.spatial.rotations import to_euler_continuous


class DemonstrationLog:
    """One recording, cycle by cycle.

    Parameters
    ----------
    referred : bool
        Whether a reference leads the arm; its own drag teaching has none.

    Attributes
    ----------
    rows : RowBuffer
        ``clock`` is the loop's clock, which no file keeps; ``t`` counts from the recording's start.
    """

    def __init__(self, referred: bool = True) -> None:
        groups = {"clock": 1, "t": 1, "position": 3, "rotation": 9}
        if referred:
            groups |= {"reference_position": 3, "reference_rotation": 9}
        groups |= {"wrench": 6, "sensed": 6, "sensor_seq": 1, "lost": 1}
        self.rows = RowBuffer(groups)
        self._first: Floats | None = None
        self._here: Floats = np.zeros(3)
        self._moved, self._t, self._since = 0.0, 0.0, 0

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def duration(self) -> float:
        """Time of the last row, s; 0 where there is none."""
        return self._t

    def add(
        self,
        t: float,
        state: RobotState,
        reference: DragState | None,
        wrench: Floats,
        sample: Sample,
    ) -> None:
        """Remember one cycle.

        Parameters
        ----------
        t : float
            Since the recording began, s.
        state : RobotState
        reference : DragState or None
            Admittance output of this cycle; None where the robot's own drag teaching moves it.
        wrench : array, shape (6,)
            Compensated, at the TCP, base axes.
        sample : Sample
            The newest, as sensed.
        """
        # Nanoseconds: below them are the rounding errors of the clock's sums.
        self._t = round(t, 9)
        led = () if reference is None else (reference.position, reference.rotation)
        felt = (wrench, sample.wrench, sample.seq, sample.lost)
        self.rows.add((state.t, self._t, state.position, state.rotation, *led, *felt))
        self._here = state.position
        if self._first is None:
            self._first = state.position
        step = state.position - self._first
        self._moved = max(self._moved, float(np.sqrt(step @ step)))

    def moved(self, distance: float) -> bool:
        """Tell whether the tool has ever been further than this from where it began, mm."""
        return self._moved > distance

    def still(self, duration: float, distance: float) -> bool:
        """Tell whether the tool has stayed within `distance` (mm) of here for `duration` (s)."""
        behind = int(np.count_nonzero(self._t - self.rows.numbers("t", self._since) >= duration))
        if not behind:
            return False
        # The last row that is old enough; those before it are never looked at again.
        self._since += behind - 1
        away = self.rows.numbers("position", self._since) - self._here
        return bool((away * away).sum(axis=1).max() <= distance**2)

    def columns(self) -> dict[str, AnyArray]:
        """Return the columns of the demonstration file, each of shape (rows,)."""
        return columns(self.rows)


def columns(rows: RowBuffer) -> dict[str, AnyArray]:
    """Return the columns of the demonstration file, each of shape (rows,).

    Parameters
    ----------
    rows : RowBuffer
        Of a `DemonstrationLog`, this one or a journal's.
    """
    out: dict[str, AnyArray] = {"t": rows.numbers("t")}
    out |= _pose_columns(rows, "position", "rotation", "")
    if "reference_position" in rows.groups:
        out |= _pose_columns(rows, "reference_position", "reference_rotation", "ref")
    out |= dict(zip(WRENCH, rows.numbers("wrench").T, strict=True))
    out |= dict(zip(suffixed(WRENCH, "raw"), rows.numbers("sensed").T, strict=True))
    # Whole numbers below 2⁵³ are exact as floats.
    return out | {name: rows.numbers(name).astype(np.int64) for name in ("sensor_seq", "lost")}


def recovered() -> dict[str, str]:
    """Return the facts of a recording of which only a journal is left."""
    return {"ended": RECOVERED}


def _pose_columns(rows: RowBuffer, place: str, attitude: str, suffix: str) -> dict[str, AnyArray]:
    position = rows.numbers(place)
    # A pen that points straight down has rx = ±π: unwrapped, so that the column does not jump.
    angles = to_euler_continuous(rows.rotations(attitude))
    tail = f"_{suffix}" if suffix else ""
    return {name + tail: position[:, i] for i, name in enumerate(POSITION)} | {
        name + tail: angles[:, i] for i, name in enumerate(EULER_ANGLES)
    }
