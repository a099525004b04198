"""The log of a run, row by row, and the columns of its file."""

from dataclasses import dataclass, field

import numpy as np

from dmpcli import rotations
from dmpcli.arrays import AnyArray, Floats
from dmpcli.records.schemas import EULER_ANGLES, POSITION, WRENCH, suffixed

Pose = tuple[Floats, Floats]


@dataclass(frozen=True)
class Row:
    """One servo cycle.

    Attributes
    ----------
    t : float
        When the actual pose was read, s since the first deadline.
    t_plan : float
        Time along the trajectory file, s; after a missed deadline it lags further behind `t`.
    planned, sent, actual : tuple of array, shape (3,) and (3, 3)
        mm; a cycle that stopped before it sent repeats the last set-point.
    deadline, lateness : float
        When the set-point was due, s since the first, and how much later it was sent, s.
    wrench : array, shape (6,), or None
        Compensated, at the TCP, base axes.
    coupling : float
        e of eq. (10), mm.
    state, phase : str
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


@dataclass
class Log:
    """Rows of a run, kept whatever ends it."""

    rows: list[Row] = field(default_factory=list)


def columns(log: Log, oriented: bool, sensed: bool, coupled: bool) -> dict[str, AnyArray]:
    """Return the columns of a run file.

    Parameters
    ----------
    log : Log
        At least one row.
    oriented : bool
        Whether the trajectory states an orientation; without one the planned angles are absent.
    sensed, coupled : bool
        Whether there was a sensor, and a force coupling.
    """
    rows = log.rows
    out: dict[str, AnyArray] = {
        name: np.array([getattr(row, name) for row in rows], dtype=float)
        for name in ("t", "t_plan", "deadline", "lateness")
    }
    poses = (("planned", "plan", oriented), ("sent", "sent", True), ("actual", "", True))
    for attribute, suffix, turned in poses:
        pairs = [getattr(row, attribute) for row in rows]
        out |= _split(np.array([p for p, _ in pairs]), POSITION, suffix)
        if turned:
            angles = rotations.to_euler_continuous(np.array([R for _, R in pairs]))
            out |= _split(angles, EULER_ANGLES, suffix)
    if sensed:
        nothing = np.full(6, np.nan)
        wrench = np.array([nothing if row.wrench is None else row.wrench for row in rows])
        out |= _split(wrench, WRENCH, "")
    if coupled:
        out["coupling"] = np.array([row.coupling for row in rows])
    for name in ("state", "phase"):
        out[name] = np.array([getattr(row, name) for row in rows], dtype=object)
    return out


def _split(values: Floats, names: tuple[str, ...], suffix: str) -> dict[str, AnyArray]:
    keys = suffixed(names, suffix) if suffix else names
    return {key: values[:, i] for i, key in enumerate(keys)}
