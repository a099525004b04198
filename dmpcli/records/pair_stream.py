"""Tables of pairs that are too long to be held: read in pieces, one after the other.

A piece is read as a whole table would be, with the lines and rows of the file. Texts with quoted
cells, which may hold line ends, and lines that end otherwise are read whole.
"""

import hashlib
import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace

import numpy as np
import pyarrow as pa

from dmpcli.errors import InputError
from dmpcli.records import file_io, pairs, parquet, schemas, tables, untrusted
from dmpcli.records.file_io import Source
from dmpcli.records.pairs import PairTable
from dmpcli.records.storage import Location

STREAMED = 64 * 2**20
"""Bytes of a text from which on it is read in pieces."""

STREAMED_ROWS = 1_000_000
"""Rows of a Parquet file, likewise."""

ROWS = 200_000
"""Rows of a piece, or as many less as make whole parts."""

_BLOCK = 1 << 22

_BITS_A_ROW = 64


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
    """

    path: Location
    sha256: str
    rows: int
    parquet: bool

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
        found = next(self.pieces(1), None)
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

    def _tables(self, rows: int) -> Iterator[tuple[tables.Table, list[str]]]:
        return self._of_parquet(rows) if self.parquet else self._of_text(rows)

    def _of_parquet(self, rows: int) -> Iterator[tuple[tables.Table, list[str]]]:
        name = str(self.path)
        known = (*pairs.KNOWN, *schemas.PAIRS.columns)
        opened = parquet.opened(self.path, "make it again", text=())
        with untrusted.decoding(name), opened as file:
            names = file.schema_arrow.names
            wanted = [one for one in names if one in pairs.KNOWN]
            unknown = [one for one in names if one not in known]
            before, waiting, held = 0, [], 0
            for batch in file.iter_batches(rows, columns=wanted):
                waiting.append(batch)
                held += len(batch)
                while held >= rows:
                    table = pa.Table.from_batches(waiting)
                    yield tables.of_arrow(name, table.slice(0, rows), before), unknown
                    before, held = before + rows, held - rows
                    waiting = table.slice(rows).to_batches()
            if held:
                yield tables.of_arrow(name, pa.Table.from_batches(waiting), before), unknown

    def _of_text(self, rows: int) -> Iterator[tuple[tables.Table, list[str]]]:
        known = (*pairs.KNOWN, *schemas.PAIRS.columns)
        before, held = 0, None
        for table in self._by_lines(rows):
            held = table if held is None else _joined(held, table)
            # Comments and empty lines are no rows: pieces of so many lines may hold fewer.
            while len(held) >= rows:
                yield replace(_some(held, slice(0, rows)), before=before), _unknown(held, known)
                before += rows
                held = _some(held, slice(rows, None))
        if held is not None and len(held):
            yield replace(held, before=before), _unknown(held, known)

    def _by_lines(self, rows: int) -> Iterator[tables.Table]:
        above = 0
        for head, body in _cut(self.path, rows):
            if any(line.strip()[:1] not in (b"", b"#") for line in body.splitlines()):
                try:
                    table = tables.read(Source(str(self.path), head + body))
                except InputError as error:
                    raise InputError(_further(str(error), above)) from None
                assert table.lines is not None
                yield replace(table, lines=table.lines + above)
            above += body.count(b"\n")


def _unknown(table: tables.Table, known: Collection[str]) -> list[str]:
    return [name for name in table.columns if name not in known]


def _joined(one: tables.Table, other: tables.Table) -> tables.Table:
    """Return the rows of two pieces of a text as one."""
    assert one.lines is not None
    assert other.lines is not None
    columns = {
        name: pa.concat_arrays([values, other.columns[name]])
        for name, values in one.columns.items()
    }
    return replace(other, columns=columns, lines=np.concatenate([one.lines, other.lines]))


def _some(table: tables.Table, rows: slice) -> tables.Table:
    assert table.lines is not None
    columns = {name: values[rows] for name, values in table.columns.items()}
    return replace(table, columns=columns, lines=table.lines[rows])


def _further(text: str, lines: int) -> str:
    """Return a message about a piece with the lines of the whole."""
    return re.sub(r"\bline (\d+)", lambda found: f"line {int(found[1]) + lines}", text)


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
