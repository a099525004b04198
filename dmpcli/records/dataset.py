"""A batch read part by part: its table of pairs, and the trajectories of one part at a time."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from dmpcli.arrays import AnyArray, Floats, Integers
from dmpcli.errors import InputError
from dmpcli.records import file_io, manifest, parquet, record, schemas, untrusted
from dmpcli.records.columns import check_ids, columns_of, nulls, numbers, taken, viewed
from dmpcli.records.file_io import Source
from dmpcli.records.pairs import GOAL, START
from dmpcli.records.record import Provenance
from dmpcli.records.schemas import DRAWN_ON, NORMAL, OK, Column, Schema
from dmpcli.records.storage import Location, each
from dmpcli.records.trajectory_reader import are_unit, unit_normals

AGAIN = "the command that draws it goes on from the parts that are there"


@dataclass(frozen=True)
class BatchFolder:
    """What the table of a batch says of its pairs: some numbers each.

    Attributes
    ----------
    folder : Path or ObjectPath
    sha256 : str
        Of the table.
    provenance : Provenance
    ids : Arrow array of text, length B
        Of the pairs that have a trajectory, in the order of the table.
    part : array of int, shape (B,)
        Their parts, by place in `files`.
    start, goal : array, shape (B, 3), or None
        mm.
    normal : array, shape (B, 3), or None
        NaN where it is not known.
    files : list of str
        Names of the parts.
    status : Arrow array of text
        Of all pairs.
    others : Arrow array of text
        Ids of all pairs.
    """

    folder: Location
    sha256: str
    provenance: Provenance
    ids: Any
    part: Integers
    start: Floats | None
    goal: Floats | None
    normal: Floats | None
    files: list[str]
    status: Any
    others: Any

    def __len__(self) -> int:
        return len(self.part)

    def rows_of_parts(self) -> list[Integers]:
        """Rows of the pairs that lie in each part, counted among those that have a trajectory."""
        order = np.argsort(self.part, kind="stable")
        ends = np.searchsorted(self.part[order], np.arange(1, len(self.files)))
        return np.split(order, ends)


@dataclass(frozen=True)
class Piece:
    """Whole trajectories of a part, one after the other.

    Attributes
    ----------
    name : str
        What messages call the part.
    facts : dict
        Of the part.
    rows : array of int, shape (k,)
        Of the batch.
    first : array of int, shape (k + 1,)
        Where each trajectory begins among the columns' rows, and where the last one ends.
    columns : dict of array
    """

    name: str
    facts: dict[str, Any]
    rows: Integers
    first: Integers
    columns: dict[str, AnyArray]

    def has(self, *names: str) -> bool:
        """Tell whether all of these columns are there and hold at least one value."""
        return all(name in self._filled for name in names)

    @cached_property
    def _filled(self) -> set[str]:
        columns = self.columns.items()
        # Mostly the first value tells.
        return {n for n, c in columns if not np.isnan(c[0]) or not np.isnan(c).all()}


def part_of(batch: BatchFolder, part: int, rows: Integers) -> BatchFolder:
    """Return what a batch knows of one part alone, by its place in `files`, and its rows.

    Parameters
    ----------
    batch : BatchFolder
    part : int
    rows : array of int, shape (n,)
        Of the pairs in that part, as `rows_of_parts` has them.

    Returns
    -------
    BatchFolder
        With one part, and without the status of any pair.
    """
    none = batch.status.slice(0, 0)

    def own(values: Floats | None) -> Floats | None:
        return None if values is None else values[rows]

    return replace(
        batch,
        ids=taken(batch.ids, rows),
        part=np.zeros(len(rows), dtype=np.int64),
        start=own(batch.start),
        goal=own(batch.goal),
        normal=own(batch.normal),
        files=[batch.files[part]],
        status=none,
        others=none,
    )


def read(folder: Location) -> tuple[BatchFolder, list[str]]:
    """Read the table of a finished batch, and check what its parts say of themselves.

    Returns
    -------
    Batch
    list of str
        What is odd about the folder, though all trajectories are there.

    Raises
    ------
    InputError
        The batch is not finished; a part is missing, damaged, or of another batch; by name.
    """
    source = file_io.read_table(folder)
    batch = _table(folder, source)
    odd = _compared(batch)
    each(folder, lambda file: _footer(batch, file), batch.files)
    return batch, odd


def _table(folder: Location, source: Source) -> BatchFolder:
    with untrusted.decoding(source.name):
        return _decoded(folder, source)


def _decoded(folder: Location, source: Source) -> BatchFolder:
    schema, columns = parquet.one_by_one(source)
    provenance = _provenance(schema.metadata, schemas.PAIRS, source.name)
    named = schemas.PAIRS.columns
    groups = (START, GOAL, NORMAL)
    # Each column goes to its place before the next one is read: the table is never there whole.
    place = {
        name: (group, i)
        for group, names in enumerate(groups)
        for i, name in enumerate(names)
        if set(names) <= set(schema.names)
    }
    numbers: dict[int, Floats] = {}
    texts: dict[str, Any] = {}
    part: Integers | None = None
    files: list[str] = []
    for table in columns:
        name = table.column_names[0]
        if name in ("id", "status"):
            texts[name] = _text(table, name, named[name], source.name)
        elif name == "part":
            part, files = _parts(_text(table, name, named[name], source.name))
        elif name in (*START, *GOAL, *NORMAL):
            values = columns_of(table, {name: named[name]}, source.name, views=True)[name]
            if name in place:
                group, i = place[name]
                numbers.setdefault(group, np.empty((len(values), 3)))[:, i] = values
            del values
        del table
    for name in ("id", "status"):
        if name not in texts:
            raise _missing(name, schema.names, source.name)
    ids = texts["id"]
    if not len(ids):
        raise InputError(f"{source.name}: holds no rows")
    if part is None:
        part = np.full(len(ids), -1)
    for name in files:
        file_io.part_in(folder, name, source.name)
    drawn = np.flatnonzero(part >= 0)
    every = len(drawn) == len(ids)
    if not every:
        part = part[drawn]
        numbers = {group: values[drawn] for group, values in numbers.items()}
    found = BatchFolder(
        folder,
        source.sha256,
        provenance,
        ids if every else taken(ids, drawn),
        part,
        numbers.get(0),
        numbers.get(1),
        numbers.get(2),
        files,
        texts["status"],
        ids,
    )
    # The library keeps what it is done with, and nothing as large is read again.
    pa.default_memory_pool().release_unused()
    return found


def _parts(words: Any) -> tuple[Integers, list[str]]:
    """Return the part of each pair by place among the names, -1 where there is none; the names."""
    encoded = words.dictionary_encode()
    names = [name or "" for name in encoded.dictionary.to_pylist()]
    files = [name for name in names if name]
    place = {name: i for i, name in enumerate(files)}
    # Code -1, no value, takes the last one.
    places = np.array([*(place.get(name, -1) for name in names), -1])
    code = numbers(encoded.indices)  # fill_null would import pandas
    code[nulls(encoded.indices)] = -1
    return places[code], files


def _text(table: Any, name: str, column: Column, file: str) -> Any:
    """Return a text column as one Arrow array."""
    if name not in table.column_names:
        raise _missing(name, table.column_names, file)
    try:
        values = table.column(name).cast(pa.string()).combine_chunks()
    except pa.ArrowException:
        kind = table.column(name).type
        raise InputError(f"{file}: column {name!r} holds {kind}, text is needed") from None
    if column.required and values.null_count:
        raise InputError(f"{file}: column {name!r} has rows without a value; draw the batch again")
    if name == "id":
        check_ids(values, file)
    return values


def _missing(name: str, names: Sequence[str], file: str) -> InputError:
    return InputError(f"{file}: column {name!r} is missing; it has {', '.join(names)}")


def _provenance(metadata: Any, expected: Schema, name: str) -> Provenance:
    """Provenance of a file of one schema, from its metadata."""
    header = record.header_of(_Bare(metadata), name)
    if header.get("schema") != expected.name:
        raise InputError(
            f"{name}: is a {header.get('schema')} file, a {expected.name} file is needed here"
        )
    if header["version"] > expected.version:
        raise InputError(
            f"{name}: {expected.name} version {header['version']} is newer than this program's "
            f"({expected.version}); upgrade dmpcli"
        )
    return Provenance(
        str(header.get("command", "")),
        dict(header.get("options", {})),
        tuple(header.get("inputs", ())),
        dict(header.get("facts", {})),
        str(header.get("tool", "")),
    )


class _Bare:
    """Metadata where `header_of` looks for them."""

    def __init__(self, metadata: Any) -> None:
        self.schema, self.metadata = self, metadata


def _compared(batch: BatchFolder) -> list[str]:
    """Compare the table with the manifest; what is odd."""
    path = batch.folder / file_io.MANIFEST
    if not path.is_file():
        return [
            f"{batch.folder}: {file_io.MANIFEST} is missing, so the batch may not be finished; "
            f"{AGAIN}"
        ]
    found = manifest.decode(file_io.read(path))
    inputs = [entry.model_dump() for entry in found.inputs]
    if inputs != list(batch.provenance.inputs) or found.options != batch.provenance.options:
        raise InputError(
            f"{path}: was written for other inputs or options than {file_io.TABLE}; "
            "draw the batch again"
        )
    listed = {entry.file for entry in found.parts}
    unlisted = next((file for file in batch.files if file not in listed), None)
    if unlisted is not None:
        raise InputError(
            f"{batch.folder / unlisted}: does not belong to {file_io.MANIFEST}; "
            "draw the batch again"
        )
    lost = sorted(listed - set(batch.files))
    if lost:
        raise InputError(
            f"{path}: lists {lost[0]}, of which {file_io.TABLE} knows nothing; draw the batch again"
        )
    there = file_io.parts_of(batch.folder)
    for entry in found.parts:
        part = file_io.part_in(batch.folder, entry.file, str(path))
        size = there[entry.file].st_size if entry.file in there else None
        if size is not None and size != entry.bytes:
            raise InputError(
                f"{part}: has {size} bytes, {file_io.MANIFEST} says {entry.bytes}: it is damaged "
                "or of another batch; draw the batch again"
            )
    more = sorted(set(there) - listed)
    if not more:
        return []
    others = f" and {len(more) - 1} more" if len(more) > 1 else ""
    return [
        f"{batch.folder}: {more[0]}{others} is not in {file_io.MANIFEST} and left out of the report"
    ]


def _footer(batch: BatchFolder, file: str) -> tuple[Any, Provenance]:
    """Open a part and check that it belongs to the batch."""
    path = batch.folder / file
    if not path.is_file():
        raise InputError(f"{path}: is missing, {file_io.TABLE} names it; {AGAIN}")
    part = parquet.opened(path, "draw the batch again", ["id"])
    found = _provenance(part.schema_arrow.metadata, schemas.TRAJECTORY, str(path))
    ours = batch.provenance
    if (found.options, found.inputs) != (ours.options, ours.inputs):
        raise InputError(
            f"{path}: was drawn from other inputs or options than {file_io.TABLE}; "
            "draw the batch again"
        )
    return part, found


def surfaces_of(batch: BatchFolder) -> dict[str, str]:
    """Return SHA-256 of the surfaces that the table names, by what it calls them."""
    source = file_io.read_table(batch.folder)
    with untrusted.decoding(source.name):
        schema, columns = parquet.one_by_one(source)
        if not set(DRAWN_ON) <= set(schema.names):
            return {}
        found = {t.column_names[0]: t.column(0) for t in columns if t.column_names[0] in DRAWN_ON}
        said = pa.table(found).group_by(list(DRAWN_ON), use_threads=False).aggregate([])
        names, hashes = (said.column(name).to_pylist() for name in DRAWN_ON)
    return {name: sha256 for name, sha256 in zip(names, hashes, strict=True) if name and sha256}


def facts_of(batch: BatchFolder) -> dict[str, Any]:
    """Return the facts of a batch's first part; all of them have the same skill."""
    return dict(_footer(batch, batch.files[0])[1].facts) if batch.files else {}


def pieces(
    batch: BatchFolder, columns: Sequence[str], parts: Sequence[int] | None = None
) -> Iterator[Piece]:
    """Yield the trajectories of a batch, one part or less at a time.

    Parameters
    ----------
    batch : BatchFolder
    columns : sequence of str
        Beside ``t x y z``, as far as a part has them.
    parts : sequence of int, optional
        Only these, by place in `BatchFolder.files`.

    Raises
    ------
    InputError
        A part is damaged, or does not hold the pairs that the table says.
    """
    rows_of = batch.rows_of_parts()
    for number in range(len(batch.files)) if parts is None else parts:
        rows = rows_of[number]
        done = 0
        for piece in _part(batch, batch.files[number], rows, columns):
            done += len(piece.rows)
            yield piece
        if done < len(rows):
            lost = batch.ids[int(rows[done])].as_py()
            raise InputError(
                f"{batch.folder / batch.files[number]}: lacks pair {lost!r}, which {file_io.TABLE} "
                "says it holds; draw the batch again"
            )


def _part(batch: BatchFolder, file: str, rows: Integers, columns: Sequence[str]) -> Iterator[Piece]:
    """Whole trajectories of one part; one that goes on in the next row group waits for it."""
    part, provenance = _footer(batch, file)
    name = str(batch.folder / file)
    known = part.schema_arrow.names
    if "id" not in known:
        raise InputError(f"{name}: column 'id' is missing; it has {', '.join(known)}")
    named = schemas.TRAJECTORY.columns
    wanted = {n: named[n] for n in ("t", "x", "y", "z", *columns)}
    chosen = ["id", *(n for n in wanted if n in known)]
    expected = taken(batch.ids, rows)
    done, offset = 0, 0

    def piece(held: _Held) -> Iterator[Piece]:
        nonlocal done, offset
        ids, first, found = held
        _same(name, ids, expected, done)
        if len(ids):
            some = rows[done : done + len(ids)]
            made = Piece(name, provenance.facts, some, first, found)
            _check_normals(made, batch, offset)
            yield made
            offset += int(first[-1])
        done += len(ids)

    # Trajectories mostly have one length: then none goes on in the next table.
    each = max(1, part.metadata.num_rows // max(1, len(rows)))
    at_once = _at_once(part.metadata, len(chosen) - 1, each)
    held: _Held | None = None
    for group, table in _tables(part, name, (batch.folder / file).stat().st_size, chosen, at_once):
        with untrusted.decoding(name, f"row group {group + 1}"):
            found = columns_of(table, wanted, name, views=True)
            ids, first = _runs(table.column("id"), name)
        if held is not None:
            before, (ids, first, found) = _divided(held, (ids, first, found))
            yield from piece(before)
        held = ids, first, found
        del table, found
    if held is not None:
        yield from piece(held)


_Held = tuple[list[str], Integers, dict[str, AnyArray]]
"""Ids of trajectories, where each begins, with the end, and their samples."""

_ROWS = 3 << 16
"""Samples of larger row groups that are read at once."""

_WHOLE = 1 << 23
"""Numbers of a row group that is read whole, 64 MiB of them: a tenth quicker than in pieces."""


def _at_once(metadata: Any, columns: int, each: int) -> int:
    """Return how many rows of so many columns to read at once, of trajectories of so many rows."""
    groups = range(metadata.num_row_groups)
    largest = max((metadata.row_group(i).num_rows for i in groups), default=0)
    if largest * columns <= _WHOLE:
        return max(1, int(largest))
    return max(1, _ROWS // each) * each


def _tables(
    part: Any, name: str, size: int, columns: list[str], at_once: int
) -> Iterator[tuple[int, Any]]:
    """Tables of so many rows of an open part, with the row group that each comes from."""
    for group in range(part.metadata.num_row_groups):
        parquet.judge(name, part, size, [group])
        some = part.iter_batches(at_once, row_groups=[group], columns=columns, use_threads=False)
        while True:
            try:
                with untrusted.decoding(name, f"row group {group + 1}"):
                    rows = next(some, None)
            except InputError:
                raise InputError(f"{name}: is damaged inside; draw the batch again") from None
            if rows is None:
                break
            if rows.num_rows:
                yield group, pa.Table.from_batches([rows])


def _divided(one: _Held, other: _Held) -> tuple[_Held, _Held]:
    """Move a trajectory that begins in one table and goes on in the next to the latter."""
    if one[0][-1] != other[0][0]:
        return one, other
    (ids, first, found), last = one, int(one[1][-2])
    whole = {n: np.concatenate([found[n][last:], c]) for n, c in other[2].items()}
    begin = np.concatenate([[0], other[1][1:] + (int(first[-1]) - last)])
    return (ids[:-1], first[:-1], {n: c[:last] for n, c in found.items()}), (
        other[0],
        begin,
        whole,
    )


def _check_normals(piece: Piece, batch: BatchFolder, offset: int) -> None:
    """Refuse normals that are no unit vectors, or not those of the table or the part."""
    if not piece.has(*schemas.NORMAL):
        return
    named = np.full((len(piece.rows), 3), np.nan)
    if batch.normal is not None:
        named = batch.normal[piece.rows]
    if piece.facts.get("normal") is not None:
        named = np.where(np.isfinite(named), named, piece.facts["normal"])
    if not np.isfinite(named).any() and are_unit(*(piece.columns[n] for n in schemas.NORMAL)):
        return
    unit_normals(
        f"{piece.name}: ",
        np.column_stack([piece.columns[n] for n in schemas.NORMAL]),
        np.repeat(named, np.diff(piece.first), axis=0),
        offset + np.arange(int(piece.first[-1])),
    )


def _runs(column: Any, name: str) -> tuple[list[str], Integers]:
    """Ids in turn, and where each one begins, with the end."""
    if column.null_count:
        raise InputError(f"{name}: column 'id' has rows without a value; draw the batch again")
    words = (
        column.unify_dictionaries().combine_chunks() if column.num_chunks > 1 else column.chunk(0)
    )
    if not pa.types.is_dictionary(words.type):
        words = words.dictionary_encode()
    code = viewed(words.indices)  # asarray would import pandas
    first = np.concatenate([[0], np.flatnonzero(code[1:] != code[:-1]) + 1, [len(code)]])
    ids = taken(words.dictionary, code[first[:-1]]).cast(pa.string()).to_pylist()
    return ids, first.astype(np.int64)


def _same(name: str, ids: list[str], expected: Any, done: int) -> None:
    """Check that these are the next pairs that the part should hold."""
    meant = expected.slice(done, len(ids)).to_pylist()
    if ids == meant:
        return
    i = next((i for i, (a, b) in enumerate(zip(ids, meant, strict=False)) if a != b), len(meant))
    where = f"where {file_io.TABLE} says {meant[i]!r}" if i < len(meant) else "as one too many"
    raise InputError(f"{name}: holds pair {ids[i]!r} {where}; draw the batch again")


def states_of(batch: BatchFolder) -> tuple[dict[str, int], list[dict[str, Any]]]:
    """Count the pairs by status, the reasons without the place of each row.

    Returns
    -------
    dict of int
        Pairs per reason; `OK` for those with a trajectory.
    list of dict
        For each other reason ``reason``, ``count`` and the id of the ``first``; the commonest
        first.
    """
    status = batch.status
    place = r"^(?:line|row) [0-9]+(?:, pair .*?: |, |: )"
    reason = pc.replace_substring_regex(status, place, "")
    # A cell as it stands in the table is each row's own.
    reason = pc.replace_substring_regex(reason, r"^(column '[^']*'): .* (is )", r"\1 \2")
    far = r"^(?:start|goal|start or goal) lies [0-9.]+(?: and [a-z]+ [0-9.]+)? mm off ([^;]*).*$"
    reason = pc.replace_substring_regex(reason, far, r"start or goal lies off \1")
    words = reason.dictionary_encode()
    code = viewed(words.indices)  # asarray would import pandas
    names = words.dictionary.to_pylist()
    counts = np.bincount(code, minlength=len(names))
    states = {name: int(n) for name, n in zip(names, counts, strict=True)}
    _, first = np.unique(code, return_index=True)
    failures = [
        {"reason": name, "count": int(n), "first": batch.others[int(row)].as_py()}
        for name, n, row in zip(names, counts, first, strict=True)
        if name != OK
    ]
    return states, sorted(failures, key=lambda entry: -int(entry["count"]))
