"""The log of a run, row by row, and the columns of its file."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from dmpcli.arrays import AnyArray, Floats
from dmpcli.records.row_buffer import RECOVERED, RowBuffer
from dmpcli.records.schemas import (
    EULER_ANGLES,
    EVENT,
    FELT_NORMAL,
    GOAL,
    JOINTS,
    POSITION,
    WRENCH,
    suffixed,
)
from dmpcli.spatial import rotations
from dmpcli.spatial.pose import Pose


@dataclass(frozen=True)
class Row:
    """One servo cycle.

    Attributes
    ----------
    t : float
        When the actual pose was read, s since the first deadline.
    t_plan : float
        Time along the trajectory file, s; after a missed deadline it lags further behind `t`.
    planned, sent, actual : Pose
        A cycle that stopped before it sent repeats the last set-point.
    deadline, lateness : float
        When the set-point was due, s since the first, and how much later it was sent, s.
    wrench : array, shape (6,), or None
        Compensated, at the TCP, base axes.
    coupling : float
        e of eq. (10), mm.
    force : float
        F_d of eq. (10), N.
    contact : str
        State of the contact.
    state, phase : str
    id : str or None
        The stroke that the set-point lies on; None on the way to, from and between strokes.
    joints : array, shape (n,), or None
        Actual, rad.
    event : str
        Outputs that were switched in this cycle.
    goal : array, shape (3,), or None
        To which the stroke is drawn, mm, where it may move.
    normal : array, shape (3,), or None
        Of the surface, as estimated.
    """

    t: float
    t_plan: float
    planned: Pose
    sent: Pose
    actual: Pose
    deadline: float
    lateness: float
    wrench: Floats | None
    coupling: float
    state: str
    phase: str
    id: str | None = None
    joints: Floats | None = None
    event: str = ""
    force: float = 0.0
    contact: str = ""
    goal: Floats | None = None
    normal: Floats | None = None


CONTACT = "contact"

_TIMES = ("t", "t_plan", "deadline", "lateness")
_POSES = (("planned", "plan"), ("sent", "sent"), ("actual", ""))


class RunLog:
    """Rows of a run, kept whatever ends it.

    Parameters
    ----------
    oriented : bool
        Whether the trajectory states an orientation; without one the planned angles are absent.
    sensed, coupled : bool
        Whether there is a sensor, and a force coupling.
    joints : int
        How many joint angles the arm tells; 0 where none.
    switching : bool
        Whether outputs are switched.
    moving : bool
        Whether the goal may move.

    Attributes
    ----------
    rows : RowBuffer
        ``clock`` is the loop's clock, which no file keeps.
    """

    def __init__(
        self,
        oriented: bool = True,
        sensed: bool = False,
        coupled: bool = False,
        joints: int = 0,
        switching: bool = False,
        moving: bool = False,
    ) -> None:
        groups = dict.fromkeys(("clock", *_TIMES), 1)
        for name, _ in _POSES:
            turned = oriented or name != "planned"
            groups |= {name: 3} | ({f"{name}_rotation": 9} if turned else {})
        groups |= ({"wrench": 6} if sensed else {}) | (
            {"coupling": 1, "fn": 1, "normal": 3} if coupled else {}
        )
        groups |= {"goal": 3} if moving else {}
        self._joints = joints if joints <= len(JOINTS) else 0
        groups |= {"joints": self._joints} if self._joints else {}
        texts = [EVENT] if switching else []
        self._texts = ("state", "phase", "id", *texts, *([CONTACT] if coupled else []))
        self._switching, self._moving = switching, moving
        self.rows = RowBuffer(groups, self._texts)
        self._oriented, self._sensed, self._coupled = oriented, sensed, coupled

    def __len__(self) -> int:
        return len(self.rows)

    def add(self, clock: float, row: Row) -> None:
        """Remember one cycle.

        Parameters
        ----------
        clock : float
            The loop's clock, s.
        row : Row
        """
        planned, sent, actual = (_numbers(at) for at in (row.planned, row.sent, row.actual))
        planned = planned if self._oriented else planned[:1]
        felt: tuple[float | Floats, ...] = ()
        if self._sensed:
            felt = (np.nan if row.wrench is None else row.wrench,)
        if self._coupled:
            felt += (row.coupling, row.force, np.nan if row.normal is None else row.normal)
        if self._moving:
            felt += (np.nan if row.goal is None else row.goal,)
        if self._joints:
            told = row.joints is not None and len(row.joints) == self._joints
            felt += (row.joints if told and row.joints is not None else np.nan,)
        times = (row.t, row.t_plan, row.deadline, row.lateness)
        words = [row.state, row.phase, row.id or ""]
        words += [row.event] if self._switching else []
        words += [row.contact] if self._coupled else []
        self.rows.add((clock, *times, *planned, *sent, *actual, *felt), words)

    def columns(self) -> dict[str, AnyArray]:
        """Return the columns of the run file, each of shape (rows,)."""
        return columns(self.rows)


def columns(rows: RowBuffer) -> dict[str, AnyArray]:
    """Return the columns of a run file, each of shape (rows,).

    Parameters
    ----------
    rows : RowBuffer
        At least one; of a `RunLog`, this one or a journal's.
    """
    out: dict[str, AnyArray] = {name: rows.numbers(name) for name in _TIMES}
    for name, suffix in _POSES:
        out |= _split(rows.numbers(name), POSITION, suffix)
        if f"{name}_rotation" in rows.groups:
            angles = rotations.to_euler_continuous(rows.rotations(f"{name}_rotation"))
            out |= _split(angles, EULER_ANGLES, suffix)
    if "wrench" in rows.groups:
        out |= _split(rows.numbers("wrench"), WRENCH, "")
    if "coupling" in rows.groups:
        out["coupling"] = rows.numbers("coupling")
    if "fn" in rows.groups:
        out["fn"] = rows.numbers("fn")
    if "normal" in rows.groups and np.isfinite(rows.numbers("normal")).any():
        out |= dict(zip(FELT_NORMAL, rows.numbers("normal").T, strict=True))
    if "goal" in rows.groups:
        out |= dict(zip(GOAL, rows.numbers("goal").T, strict=True))
    if "joints" in rows.groups:
        angles = rows.numbers("joints").reshape(len(rows), -1)
        out |= dict(zip(JOINTS, angles.T, strict=False))
    out |= {name: np.array(rows.words(name), dtype=object) for name in ("state", "phase")}
    for name in ("id", EVENT, CONTACT):
        if name in rows.texts:
            out[name] = np.array([word or None for word in rows.words(name)], dtype=object)
    return out


def recovered(known: Mapping[str, AnyArray], options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the facts of a run of which only a journal is left.

    Parameters
    ----------
    known : dict of array
        Columns of its file.
    options : mapping
        Of its provenance; the servo period.
    """
    from dmpcli.metrics.timing import punctuality

    found = punctuality(known["deadline"], known["lateness"], float(options["period"]))
    late = {"p50": found.median, "p99": found.p99, "max": found.worst}
    ended = {"reason": RECOVERED, "completed": False}
    return ended | {"missed": found.missed, "lateness": late}


def _numbers(pose: Pose) -> tuple[Floats, ...]:
    return pose.position, pose.rotation


def _split(values: Floats, names: tuple[str, ...], suffix: str) -> dict[str, AnyArray]:
    keys = suffixed(names, suffix) if suffix else names
    return {key: values[:, i] for i, key in enumerate(keys)}
