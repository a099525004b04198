"""Tables of pairs that are too long to be held: read in pieces, one after the other.

A piece is read as a whole table would be, with the lines and rows of the file. Texts with quoted
cells, which may hold line ends, and lines that end otherwise are read whole.

Of a table of which only some rows are asked for, row groups without any of them are not read, and
lines of others are passed over: they are counted, not parted.
"""

import hashlib
import itertools
import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pyarrow as pa

from dmpcli.arrays import Booleans, Integers
from dmpcli.errors import InputError
from dmpcli.records import columns, file_io, pair_places, pairs, parquet, schemas, tables, untrusted
from dmpcli.records.file_io import Source
from dmpcli.records.pair_places import PairPlaces
from dmpcli.records.pairs import PairTable
from dmpcli.records.storage import Location
from dmpcli.records.table import Table
from dmpcli.records.table_shares import ChosenRows, Share

STREAMED = 64 * 2**20
"""Bytes of a text from which on it is read in pieces."""

STREAMED_ROWS = 1_000_000
"""Rows of a Parquet file, likewise."""

ROWS = 200_000
"""Rows of a piece, or as many less as make whole parts."""

_BLOCK = 1 << 22

_BITS_A_ROW = 64

_PLACES = (*pair_places.COLUMNS, *pair_places.POSE_CELLS)

_BLANK = np.isin(np.arange(256), list(b" \t\r\n#"))
"""Bytes with which a line that is no row may begin."""

_PASSED_OVER = re.compile(rb"[ \t]*(?:#[^\n]*|\r?\n|\r?\Z)")


@dataclass(frozen=True)
class PairStream:
    """A table of pairs that is read in pieces, as often as is asked for.

    Attributes
    ----------
    path : Path or ObjectPath
    sha256 : str
    rows : int
        How many it has; of a text, at most.
    parquet : bool
    share : Share or ChosenRows, optional
        Only these rows are read.
    """

    path: Location
    sha256: str
    rows: int
    parquet: bool
    share: Share | ChosenRows | None = None
    _held: list[tuple[Table, list[str]]] | None = field(default=None, repr=False)

    @property
    def asked(self) -> int:
        """How many rows are read; of a text, at most."""
        return self.rows if self.share is None else self.share.count(self.rows)

    def of_share(self, share: Share | ChosenRows, rows: int) -> "PairStream":
        """Return a stream of these rows alone, read once if they are no more than a piece has."""
        own = replace(self, share=share)
        return own if own.asked > rows else replace(own, _held=list(own._tables(rows)))

    def pieces(self, rows: int) -> Iterator[PairTable]:
        """Yield the pairs, so many at once.

        Raises
        ------
        InputError
            As `pairs.read`.
        """
        for table, unknown in self._tables(rows):
            with untrusted.decoding(str(self.path)):
                yield replace(pairs.decoded(table), unknown=unknown)

    def first(self) -> PairTable:
        """Return the first pair, which tells the columns of all.

        Raises
        ------
        InputError
            As `pairs.read`.
        """
        found = next(replace(self, share=None, _held=None).pieces(1), None)
        if found is None:
            raise InputError(f"{self.path}: holds no rows; it needs a header and at least one row")
        return found

    def check_ids(self, rows: int) -> None:
        """Refuse a table of which two rows have one id, so many rows at once.

        Numbers of ids are marked in as many bits as makes few of them fall together by chance;
        those that do are compared in a second pass.

        Raises
        ------
        InputError
        """
        bits = int(np.clip(_BITS_A_ROW * self.rows, 1 << 10, 1 << 32))
        marks = np.zeros(bits // 8 + 1, dtype=np.uint8)
        suspects: set[str] = set()
        for table, _ in self._tables(rows):
            if "id" not in table.columns:
                return
            ids = table.texts("id")
            at = np.fromiter(map(hash, ids), np.int64, len(ids)) % bits
            place, bit = at >> 3, (1 << (at & 7)).astype(np.uint8)
            marked = (marks[place] & bit) != 0
            suspects |= {ids[i] for i in np.flatnonzero(marked).tolist()}
            np.bitwise_or.at(marks, place, bit)
        if not suspects:
            return
        seen: dict[str, str] = {}
        for table, _ in self._tables(rows):
            for row, name in enumerate(table.texts("id")):
                if name not in suspects:
                    continue
                if name in seen:
                    raise InputError(
                        f"{self.path}: column 'id', {table.at(row)}: {name!r} is also in "
                        f"{seen[name]}; ids must differ"
                    )
                seen[name] = table.at(row)

    def places(self, rows: int) -> Iterator[PairPlaces]:
        """Yield where pairs lie, as the pieces of so many of them say it, and read nothing else.

        Raises
        ------
        InputError
            As `pairs.read`.
        """
        for table, _ in self._tables(rows, _PLACES):
            with untrusted.decoding(str(self.path)):
                found = pair_places.read(table, [schemas.OK] * len(table))
            assert found is not None
            yield found

    def _tables(
        self, rows: int, only: Collection[str] | None = None
    ) -> Iterator[tuple[Table, list[str]]]:
        """Yield pieces, with no columns but these where they are said, and unknown columns."""
        if self._held is not None:
            return iter(self._held)
        return self._of_parquet(rows, only) if self.parquet else self._of_text(rows, only)

    def _piece_sizes(self, rows: int) -> Iterator[int]:
        return itertools.repeat(rows) if self.share is None else self.share.pieces(rows)

    def _of_parquet(
        self, rows: int, only: Collection[str] | None
    ) -> Iterator[tuple[Table, list[str]]]:
        name = str(self.path)
        known = (*pairs.KNOWN, *schemas.PAIRS.columns)
        opened = parquet.opened(self.path, "make it again", text=())
        with untrusted.decoding(name), opened as file:
            names = file.schema_arrow.names
            wanted = [one for one in names if one in (only or pairs.KNOWN)]
            unknown = [one for one in names if one not in known]
            waiting, numbers = [], np.empty(0, dtype=np.int64)
            sizes = self._piece_sizes(rows)
            size = next(sizes)
            for batch, there in self._batches(file, rows, wanted):
                waiting.append(batch)
                numbers = np.concatenate([numbers, there])
                while len(numbers) >= size:
                    table = pa.Table.from_batches(waiting)
                    yield tables.of_arrow(name, table.slice(0, size), numbers[:size]), unknown
                    numbers, waiting = numbers[size:], table.slice(size).to_batches()
                    size = next(sizes)
            if len(numbers):
                yield tables.of_arrow(name, pa.Table.from_batches(waiting), numbers), unknown

    def _batches(
        self, file: Any, rows: int, wanted: list[str]
    ) -> Iterator[tuple[pa.RecordBatch, Integers]]:
        """Yield what is asked for of a Parquet file, at most so many rows at once, and which."""
        begin = 0
        for group in range(file.metadata.num_row_groups):
            end = begin + file.metadata.row_group(group).num_rows
            if self.share is not None and not self.share.count(end) > self.share.count(begin):
                begin = end
                continue
            for batch in file.iter_batches(rows, row_groups=[group], columns=wanted):
                there = np.arange(begin, begin + len(batch))
                if self.share is not None:
                    there = self.share.rows(begin, begin + len(batch))
                    some = batch.take(columns.arrow(there - begin))
                else:
                    some = batch
                begin += len(batch)
                yield some, there

    def _of_text(
        self, rows: int, only: Collection[str] | None
    ) -> Iterator[tuple[Table, list[str]]]:
        known = (*pairs.KNOWN, *schemas.PAIRS.columns)
        held = None
        sizes = self._piece_sizes(rows)
        size = next(sizes)
        for table in self._by_lines(rows, only):
            held = table if held is None else _joined(held, table)
            # Comments and empty lines are no rows: pieces of so many lines may hold fewer.
            while len(held) >= size:
                yield _some(held, slice(0, size)), _unknown(held, known)
                held = _some(held, slice(size, None))
                size = next(sizes)
        if held is not None and len(held):
            yield held, _unknown(held, known)

    def _by_lines(self, rows: int, only: Collection[str] | None) -> Iterator[Table]:
        above = before = 0
        for head, body in _cut(self.path, rows):
            begins, ends = _lines_of(body)
            lines = np.flatnonzero(_are_rows(body, begins))
            there = np.arange(before, before + len(lines))
            text, of = body, np.arange(len(begins))
            if self.share is not None:
                there = self.share.rows(before, before + len(lines))
                of = lines[there - before]
                text = b"".join([body[begins[line] : ends[line]] for line in of.tolist()])
            if len(there):
                yield self._parted(head, text, of + above + 1, there, only)
            before += len(lines)
            above += len(begins)

    def _parted(
        self,
        head: bytes,
        text: bytes,
        lines: Integers,
        rows: Integers,
        only: Collection[str] | None,
    ) -> Table:
        """Part rows of a text, whose lines follow the head in the file by so many lines."""
        before = head.count(b"\n")
        try:
            table = tables.read(Source(str(self.path), head + text), only=only)
        except InputError as error:
            raise InputError(_further(str(error), before, lines)) from None
        assert table.lines is not None
        return replace(table, lines=before + lines[table.lines - before - 1], rows=rows)


def _unknown(table: Table, known: Collection[str]) -> list[str]:
    return [name for name in table.columns if name not in known]


def _joined(one: Table, other: Table) -> Table:
    """Return the rows of two pieces of a text as one."""
    assert one.lines is not None
    assert other.lines is not None
    assert one.rows is not None
    assert other.rows is not None
    joined = {
        name: pa.concat_arrays([values, other.columns[name]])
        for name, values in one.columns.items()
    }
    return replace(
        other,
        columns=joined,
        lines=np.concatenate([one.lines, other.lines]),
        rows=np.concatenate([one.rows, other.rows]),
    )


def _some(table: Table, rows: slice) -> Table:
    assert table.lines is not None
    assert table.rows is not None
    some = {name: values[rows] for name, values in table.columns.items()}
    return replace(table, columns=some, lines=table.lines[rows], rows=table.rows[rows])


def _further(text: str, head: int, lines: Integers) -> str:
    """Return a message about a piece with the lines of the whole, after so many of a head."""

    def there(found: re.Match[str]) -> str:
        line = int(found[1])
        return f"line {line if line <= head else head + lines[line - head - 1]}"

    return re.sub(r"\bline (\d+)", there, text)


def _lines_of(body: bytes) -> tuple[Integers, Integers]:
    """Where the lines of a text begin and, with their ends, end."""
    ends = np.flatnonzero(np.frombuffer(body, dtype=np.uint8) == ord("\n")) + 1
    if body and not body.endswith(b"\n"):
        ends = np.append(ends, len(body))
    return np.concatenate([[0], ends[:-1]]).astype(np.int64)[: len(ends)], ends


def _are_rows(body: bytes, begins: Integers) -> Booleans:
    """Tell which lines are neither empty nor of comment."""
    rows = np.ones(len(begins), dtype=bool)
    for line in np.flatnonzero(_BLANK[np.frombuffer(body, dtype=np.uint8)[begins]]).tolist():
        rows[line] = _PASSED_OVER.match(body, begins[line]) is None
    return rows


def opened(path: Location) -> PairStream | None:
    """Return a table that is to be read in pieces; None where it had better be read whole.

    Raises
    ------
    InputError
        The file cannot be read.
    """
    if str(path) == file_io.DASH or not path.is_file():
        return None
    try:
        size = path.stat().st_size
        with path.open("rb") as stream:
            packed = stream.read(4) == parquet.MAGIC
        if packed:
            with untrusted.decoding(str(path)):
                rows = parquet.footer(path).num_rows
            if rows <= STREAMED_ROWS:
                return None
        elif size <= STREAMED:
            return None
        sha256, ends = hashlib.sha256(), 0
        with path.open("rb") as stream:
            while block := stream.read(_BLOCK):
                sha256.update(block)
                if packed:
                    continue
                if b'"' in block or b"\r" in block.replace(b"\r\n", b"").removesuffix(b"\r"):
                    return None
                ends += block.count(b"\n")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    return PairStream(path, sha256.hexdigest(), rows if packed else ends, packed)


def _cut(path: Location, rows: int) -> Iterator[tuple[bytes, bytes]]:
    """Yield the lines before the rows of a text, and so many more lines each time."""
    with path.open("rb") as stream:
        head = b""
        while line := stream.readline():
            head += line
            if line.strip(b" \t\r\n\xef\xbb\xbf")[:1] not in (b"", b"#"):
                break
        rest, ended = b"", False
        while rest or not ended:
            blocks, count = [rest], rest.count(b"\n")
            while count < rows and not ended:
                block = stream.read(_BLOCK)
                blocks.append(block)
                count += block.count(b"\n")
                ended = not block
            body = b"".join(blocks)
            end = len(body) if count < rows else _line_end(body, rows)
            rest = body[end:]
            if end:
                yield head, body[:end]


def _line_end(body: bytes, lines: int) -> int:
    """Return where so many lines of a text end."""
    ends = np.flatnonzero(np.frombuffer(body, dtype=np.uint8) == ord("\n"))
    return int(ends[lines - 1]) + 1
