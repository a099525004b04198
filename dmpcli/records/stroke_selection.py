"""Some strokes, in the order asked for, of a trajectory file or of the folder of a batch."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dmpcli.arrays import Integers
from dmpcli.errors import InputError
from dmpcli.records import file_io, record, schemas
from dmpcli.records.file_io import Source
from dmpcli.records.record import Record
from dmpcli.records.schemas import OK
from dmpcli.records.storage import Location, located
from dmpcli.records.trajectory_reader import rows_by_id, stored
from dmpcli.spatial.trajectory import StrokeTrajectory

NAMED = 5
"""Ids that a message names."""


@dataclass(frozen=True)
class StrokeSelection:
    """The strokes that are to be executed.

    Attributes
    ----------
    strokes : tuple of StrokeTrajectory
        In the order in which they are drawn; at least one.
    failed : dict of str
        Pairs of the batch without trajectory that were passed over, and why each has none.
    entries : tuple of dict
        The files, for the provenance.
    folder : bool
        Whether it is a batch's folder.
    """

    strokes: tuple[StrokeTrajectory, ...]
    failed: dict[str, str]
    entries: tuple[dict[str, str], ...]
    folder: bool

    def without_events(self) -> "StrokeSelection":
        """Return the strokes without the outputs that they switch."""
        return replace(self, strokes=tuple(replace(one, events=()) for one in self.strokes))


def find(path: str | Source, wanted: Sequence[str] = ()) -> StrokeSelection:
    """Read the strokes that are to be executed.

    Parameters
    ----------
    path : str or Source
        A trajectory file, ``-``, or a batch's folder; or the content of a file.
    wanted : sequence of str
        Their ids, in the order in which they are drawn; none means all, in the file's order.

    Raises
    ------
    InputError
        No such id, or one twice; a pair without trajectory that was asked for, or nothing but
        such pairs; or a file that cannot be streamed, with column and row.
    """
    twice = [name for i, name in enumerate(wanted) if name in wanted[:i]]
    if twice:
        raise InputError(f"--id {twice[0]}: is given twice; a stroke is drawn once in a run")
    if isinstance(path, str) and path != file_io.DASH and (folder := located(path)).is_dir():
        return _in_folder(folder, wanted)
    source, rows = _grouped(path)
    names = _chosen(wanted, list(rows), source.name)
    strokes = tuple(_stroke(source, name, rows[name], {}) for name in names)
    return StrokeSelection(strokes, {}, (record.input_of("trajectory", source),), False)


def _in_folder(folder: Location, wanted: Sequence[str]) -> StrokeSelection:
    pairs = record.decode(file_io.read_table(folder), schemas.PAIRS)
    ids = [str(name) for name in pairs.columns["id"]]
    parts = pairs.columns.get("part", np.full(len(pairs), None))
    rows_of = {name: row for row, name in enumerate(ids)}
    failed = {
        name: str(status)
        for name, status, part in zip(ids, pairs.columns["status"], parts, strict=True)
        if status != OK or not part
    }
    chosen = _chosen(wanted, list(rows_of), str(folder))
    names = [name for name in chosen if name not in failed]
    if wanted and len(names) < len(chosen):
        name = next(name for name in chosen if name in failed)
        raise InputError(f"{folder}: pair {name} has no trajectory: {failed[name]}")
    if not names:
        name, why = next(iter(failed.items()))
        raise InputError(f"{folder}: no pair has a trajectory; the first, {name}: {why}")
    found, entries = {}, [record.input_of("pairs", pairs)]
    in_part: dict[str, list[str]] = {}
    for name in names:
        in_part.setdefault(str(parts[rows_of[name]]), []).append(name)
    # Part by part: the strokes that are drawn stay in memory, the rest of a part does not.
    for part, members in in_part.items():
        source, rows = _grouped(str(file_io.part_in(folder, part, pairs.name)))
        entries.append(record.input_of("trajectory", source))
        for name in members:
            if name not in rows:
                raise InputError(
                    f"{source.name}: holds no stroke {name}, which {file_io.TABLE} says is there; "
                    "generalize the batch again"
                )
            found[name] = _stroke(source, name, rows[name], _pair_facts(pairs, rows_of[name]))
    strokes = tuple(found[name] for name in names)
    return StrokeSelection(strokes, {} if wanted else failed, tuple(entries), True)


def _chosen(wanted: Sequence[str], known: Sequence[str], path: str) -> list[str]:
    """Return the ids to execute."""
    there = set(known)
    for name in wanted:
        if name not in there:
            raise InputError(f"{path}: no stroke has the id {name}; it has {listed(known)}")
    return list(wanted) or list(known)


def listed(ids: Sequence[str]) -> str:
    """Name some ids, and of many how many more there are."""
    more = len(ids) - NAMED
    return ", ".join(ids[:NAMED]) + (f" and {more} more" if more > 0 else "")


def _pair_facts(pairs: Record, row: int) -> dict[str, Any]:
    def three(names: tuple[str, ...]) -> list[float]:
        return [float(pairs.columns[name][row]) for name in names]

    facts: dict[str, Any] = {"start": three(("x0", "y0", "z0")), "goal": three(("xg", "yg", "zg"))}
    if pairs.has(*schemas.NORMAL):
        normal = three(schemas.NORMAL)
        facts |= {"normal": normal} if np.all(np.isfinite(normal)) else {}
    return facts


def _grouped(path: str | Source) -> tuple[Record, dict[str, Integers]]:
    """Read a trajectory file; return it with the rows of each id, in order of appearance."""
    content = path if isinstance(path, Source) else file_io.read(path)
    source = record.decode(content, schemas.TRAJECTORY)
    return source, rows_by_id(source.columns["id"])


def _stroke(source: Record, name: str, rows: Integers, more: Mapping[str, Any]) -> StrokeTrajectory:
    if len(rows) < 2:
        raise InputError(f"{source.name}: stroke {name} has one row; a motion needs at least two")
    return stored(source, name, rows, source.provenance.facts | dict(more))
