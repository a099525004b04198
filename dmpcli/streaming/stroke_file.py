"""One stroke out of a trajectory file, or out of the folder of a batch."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import InputError
from dmpcli.records import record, schemas, streams
from dmpcli.records.pairs import OK
from dmpcli.records.record import Record
from dmpcli.rotations import from_euler
from dmpcli.streaming.plan import Stroke

_NAMED = 5


@dataclass(frozen=True)
class Found:
    """A stroke and what its file says beside it.

    Attributes
    ----------
    stroke : Stroke
    facts : dict
        Of the file, with the start, goal and normal of a batch's pair.
    source : Record
        The file, for the provenance.
    """

    stroke: Stroke
    facts: dict[str, Any]
    source: Record


def find(path: str, wanted: str | None) -> Found:
    """Read the stroke that is to be executed.

    Parameters
    ----------
    path : str
        A trajectory file, ``-``, or a batch's folder.
    wanted : str, optional
        The id; needed where there are several.

    Raises
    ------
    InputError
        Several strokes and no id, no such id, a pair without trajectory, or a file that cannot be
        streamed; names column and row.
    """
    if path == streams.DASH or not Path(path).is_dir():
        return _in_file(path, wanted, {})
    folder = Path(path)
    pairs = record.decode(streams.read(folder / streams.TABLE), schemas.PAIRS)
    row = _row_of(pairs, wanted, path)
    name, status = str(pairs.columns["id"][row]), str(pairs.columns["status"][row])
    if status != OK or "part" not in pairs.columns:
        raise InputError(f"{path}: pair {name} has no trajectory: {status}")
    return _in_file(str(folder / str(pairs.columns["part"][row])), name, _pair_facts(pairs, row))


def _row_of(pairs: Record, wanted: str | None, path: str) -> int:
    ids = pairs.columns["id"].astype(str)
    usable = ids[pairs.columns["status"].astype(str) == OK]
    rows = np.flatnonzero(ids == _choose(usable, wanted, path, ids))
    return int(rows[0])


def _choose(
    usable: np.ndarray[Any, Any], wanted: str | None, path: str, known: np.ndarray[Any, Any]
) -> str:
    """Return the id to execute."""
    if wanted is not None:
        if wanted not in known:
            raise InputError(f"{path}: no stroke has the id {wanted}; it has {_listed(known)}")
        return wanted
    if len(usable) != 1:
        raise InputError(
            f"{path}: holds {len(usable)} strokes; pick one with --id ({_listed(usable)})"
        )
    return str(usable[0])


def _listed(ids: np.ndarray[Any, Any]) -> str:
    names = ", ".join(map(str, ids[:_NAMED]))
    return names + (", ..." if len(ids) > _NAMED else "")


def _pair_facts(pairs: Record, row: int) -> dict[str, Any]:
    def three(names: tuple[str, ...]) -> list[float]:
        return [float(pairs.columns[name][row]) for name in names]

    facts: dict[str, Any] = {"start": three(("x0", "y0", "z0")), "goal": three(("xg", "yg", "zg"))}
    if pairs.has(*schemas.NORMAL):
        normal = three(schemas.NORMAL)
        facts |= {"normal": normal} if np.all(np.isfinite(normal)) else {}
    return facts


def _in_file(path: str, wanted: str | None, more: Mapping[str, Any]) -> Found:
    source = record.decode(streams.read(path), schemas.TRAJECTORY)
    ids = source.columns["id"].astype(str)
    known = ids[np.sort(np.unique(ids, return_index=True)[1])]
    name = _choose(known, wanted, source.name, known)
    rows = np.flatnonzero(ids == name)
    facts = dict(source.provenance.facts) | dict(more)
    t = source.t[rows]
    if len(t) < 2:
        raise InputError(f"{source.name}: stroke {name} has one row; a motion needs at least two")
    back = np.flatnonzero(np.diff(t) <= 0)
    if len(back):
        at = int(back[0]) + 1
        raise InputError(
            f"{source.name}: column 't', row {rows[at] + 1}: {t[at]:g} s does not come after "
            f"{t[at - 1]:g} s; time must increase from row to row"
        )
    angles = _optional(source, schemas.EULER_ANGLES, rows)
    stroke = Stroke(
        name,
        t,
        source.position()[rows],
        None if angles is None else from_euler(angles),
        _normals(source, rows, facts),
        int(rows[0]) + 1,
    )
    return Found(stroke, facts, source)


def _optional(source: Record, names: tuple[str, ...], rows: Any) -> Floats | None:
    """Return columns that a stroke may lack altogether, but not here and there."""
    nothing = np.full(len(source), np.nan)
    values = np.column_stack([source.columns.get(name, nothing)[rows] for name in names])
    missing = np.isnan(values)
    if missing.all():
        return None
    if missing.any():
        row, column = np.argwhere(missing)[0]
        raise InputError(
            f"{source.name}: column {names[column]!r}, row {rows[row] + 1}: no value, though the "
            f"stroke has some of {', '.join(names)}; fill it in or leave them all out"
        )
    return np.asarray(values, dtype=float)


def _normals(source: Record, rows: Any, facts: Mapping[str, Any]) -> Floats | None:
    normals = _optional(source, schemas.NORMAL, rows)
    if normals is None:
        if facts.get("normal") is None:
            return None
        normals = np.broadcast_to(np.asarray(facts["normal"], dtype=float), (len(rows), 3))
    length = np.linalg.norm(normals, axis=1)
    bad = np.flatnonzero(np.abs(length - 1.0) > 1e-3)
    if len(bad):
        raise InputError(
            f"{source.name}: the normal at row {rows[bad[0]] + 1} has length "
            f"{length[bad[0]]:.4g}; a unit normal is needed"
        )
    unit: Floats = normals / length[:, None]
    return unit
