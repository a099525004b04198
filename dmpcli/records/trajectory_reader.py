"""The trajectories of a file: one reader for all who draw, measure or describe them."""

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np

from dmpcli.arrays import AnyArray, Floats, Integers
from dmpcli.errors import InputError
from dmpcli.records import schemas
from dmpcli.records.record import Record
from dmpcli.spatial import output_events
from dmpcli.spatial.output_events import OutputEvent
from dmpcli.spatial.rotations import from_euler
from dmpcli.spatial.trajectory import StrokeTrajectory

LARGEST_FORCE = 1e4
"""More along the normal is a slip of the unit, N."""

UNIT = 1e-3
"""By how much the length of a unit normal may miss 1, and its direction another's, rad."""


def rows_by_id(ids: AnyArray) -> dict[str, Integers]:
    """Return the rows of each id, in order of first appearance."""
    ids = np.asarray(ids, dtype=object)  # of a record that is not yet written an Arrow array
    borders = np.flatnonzero(np.concatenate([[True], ids[1:] != ids[:-1], [True]]))
    runs: dict[str, list[Integers]] = {}
    for first, last in pairwise(borders.tolist()):
        runs.setdefault(str(ids[first]), []).append(np.arange(first, last))
    return {name: np.concatenate(rows) for name, rows in runs.items()}


def stored(
    record: Record, name: str, rows: Integers, facts: Mapping[str, Any] | None = None
) -> StrokeTrajectory:
    """Return some rows of a record as one trajectory.

    Parameters
    ----------
    record : Record
        Of a trajectory file or a run.
    name : str
        Its id.
    rows : array of int, shape (n,)
    facts : mapping, optional
        What is known of it; by default what the file says.

    Raises
    ------
    InputError
        Time does not increase; an orientation or normal is missing here and there; a normal is
        no unit vector, or is not the one that the file or the batch names. By column and row.
    """
    facts = dict(record.provenance.facts if facts is None else facts)
    t = record.t[rows]
    back = np.flatnonzero(np.diff(t) <= 0.0)
    if len(back):
        at = int(back[0]) + 1
        raise InputError(
            f"{_of(record)}column 't', row {rows[at] + 1}: {t[at]:g} s does not come after "
            f"{t[at - 1]:g} s; time must increase from row to row"
        )
    angles = _optional(record, schemas.EULER_ANGLES, rows)
    return StrokeTrajectory(
        t,
        record.position()[rows],
        None if angles is None else from_euler(angles),
        _normals(record, rows, facts),
        name,
        int(rows[0]) + 1 if len(rows) else 1,
        facts,
        _events(record, rows, t),
        _forces(record, rows),
    )


def _events(record: Record, rows: Integers, t: Floats) -> tuple[OutputEvent, ...]:
    if schemas.EVENT not in record.columns or record.schema is not schemas.TRAJECTORY:
        return ()
    try:
        return output_events.read(record.columns[schemas.EVENT][rows].tolist(), t)
    except output_events.NotPlacedError as error:
        raise InputError(f"{_of(record)}column {schemas.EVENT!r}, {error}") from None


def _of(record: Record) -> str:
    return f"{record.name}: " if record.name else ""


def _optional(record: Record, names: tuple[str, ...], rows: Integers) -> Floats | None:
    """Return columns that a trajectory may lack altogether, but not here and there."""
    nothing = np.full(len(record), np.nan)
    values = np.column_stack([record.columns.get(name, nothing)[rows] for name in names])
    missing = np.isnan(values)
    if missing.all():
        return None
    if missing.any():
        row, column = np.argwhere(missing)[0]
        raise InputError(
            f"{_of(record)}column {names[column]!r}, row {rows[row] + 1}: no value, though the "
            f"stroke has some of {', '.join(names)}; fill it in or leave them all out"
        )
    return np.asarray(values, dtype=float)


def _forces(record: Record, rows: Integers) -> Floats | None:
    """Return the force set-points of some rows, shape (n,); None where the file states none."""
    found = _optional(record, ("fn",), rows) if record.schema is schemas.TRAJECTORY else None
    if found is None:
        return None
    bad = np.flatnonzero(~((found[:, 0] >= 0.0) & (found[:, 0] <= LARGEST_FORCE)))
    if len(bad):
        raise InputError(
            f"{_of(record)}column 'fn', row {rows[bad[0]] + 1}: {found[bad[0], 0]:g} N; a force "
            f"along the normal is 0 (lifted) to {LARGEST_FORCE:g} N"
        )
    return found[:, 0]


def _normals(record: Record, rows: Integers, facts: Mapping[str, Any]) -> Floats | None:
    """Return the unit normals, shape (n, 3): of each row, else the one that the file names."""
    named, normals = facts.get("normal"), _optional(record, schemas.NORMAL, rows)
    one = None if named is None else np.broadcast_to(np.asarray(named, float), (len(rows), 3))
    return unit_normals(_of(record), normals, one, rows)


def are_unit(x: Floats, y: Floats, z: Floats) -> bool:
    """Tell whether vectors by their components (n,) are surely unit vectors; takes little time."""
    squared = x * x
    squared += y * y
    squared += z * z
    # Lengths within a small tolerance of 1 have squares within twice as much, but for its square.
    return bool(squared.min() >= 1.0 - 1.9 * UNIT and squared.max() <= 1.0 + 1.9 * UNIT)


def unit_normals(
    name: str, normals: Floats | None, named: Floats | None, rows: Integers
) -> Floats | None:
    """Return the unit normals of some rows, shape (n, 3); None where nothing says them.

    Parameters
    ----------
    name : str
        What messages begin with.
    normals : array, shape (n, 3), or None
        By row.
    named : array, shape (n, 3), or None
        What file or batch name for all rows of a trajectory; NaN where they name none.
    rows : array of int, shape (n,)
        Of the file, from 0.

    Raises
    ------
    InputError
        One is no unit vector, or the two contradict each other.
    """
    for some, where in ((named, "that the file names"), (normals, "")):
        if some is not None:
            length = np.linalg.norm(some, axis=1)
            bad = np.flatnonzero(np.abs(length - 1.0) > UNIT)
            if len(bad):
                where = where or f"at row {rows[bad[0]] + 1}"
                raise InputError(
                    f"{name}the normal {where} has length {length[bad[0]]:.4g}; a unit normal is "
                    "needed"
                )
    if normals is not None and named is not None:
        apart = np.linalg.norm(normals - named, axis=1)
        bad = np.flatnonzero(apart > 2.0 * UNIT)
        if len(bad):
            angle = np.degrees(2.0 * np.arcsin(min(0.5 * apart[bad[0]], 1.0)))
            raise InputError(
                f"{name}the normal at row {rows[bad[0]] + 1} (nx, ny, nz) lies {angle:.3g}° off "
                "the one that is named for the whole stroke; leave one of them out"
            )
    found = named if normals is None else normals
    return None if found is None else found / np.linalg.norm(found, axis=1, keepdims=True)
