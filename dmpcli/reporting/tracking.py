"""Where an arm was on its way, which it follows one look-ahead behind its set-points."""

from dataclasses import replace

import numpy as np

from dmpcli.arrays import Floats, Integers
from dmpcli.records.record import Record
from dmpcli.records.schemas import EULER_ANGLES, JOINTS, POSITION, WRENCH

_ACTUAL = {"t", *POSITION, *EULER_ANGLES, *WRENCH, *JOINTS}


def lookahead_of(run: Record) -> float:
    """Return by how much the arm lags its set-points as the run's file says, s; 0 without."""
    return float(run.provenance.facts.get("lookahead") or 0.0)


def reached(run: Record, rows: Integers) -> Record:
    """Return some rows of a run with what the arm did one look-ahead after their set-points.

    Of rows that repeat one report of the controller only the first is left.

    Parameters
    ----------
    run : Record
    rows : array of int, shape (n,)
        In order.
    """
    due = np.asarray(run.columns["deadline"], dtype=float)
    later = np.searchsorted(due, due[rows] + lookahead_of(run) - 1e-9)
    there, kept = np.unique(np.minimum(later, len(due) - 1), return_index=True)
    new = np.diff(run.t[there], prepend=-np.inf) != 0.0
    there, rows = there[new], rows[kept][new]
    columns = {
        name: column[there if name in _ACTUAL else rows] for name, column in run.columns.items()
    }
    return replace(run, columns=columns)


def tracking(run: Record) -> Floats:
    """Distance of the arm from where the plan was one look-ahead before, shape (n,), mm."""
    lookahead, planned = lookahead_of(run), run.position("plan")
    if lookahead > 0.0:
        due = np.asarray(run.columns["deadline"], dtype=float)
        planned = np.column_stack([np.interp(run.t - lookahead, due, axis) for axis in planned.T])
    off: Floats = np.linalg.norm(run.position() - planned, axis=1)
    return off
