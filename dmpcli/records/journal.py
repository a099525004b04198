"""The journal of a run that cannot be made again: its rows on disk while they come.

An Arrow IPC stream beside the output. A thread of its own writes whatever rows came since the last
time and syncs them to disk, twice a second; the loop never waits for it. After a crash, a full disk
or a power cut `recover` makes the proper file of what is there. The stream's metadata hold what the
proper file needs, each batch the CRC-32 of its rows, and the last batch of a run that came to its
end what it ended with: from such a journal the very same file is made.
"""

import contextlib
import fcntl
import io
import json
import os
import threading
import time
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from dmpcli.arrays import Floats
from dmpcli.errors import InputError, InstrumentError
from dmpcli.records import file_io
from dmpcli.records.columns import arrow
from dmpcli.records.file_io import Source
from dmpcli.records.record import Provenance
from dmpcli.records.row_buffer import RowBuffer
from dmpcli.records.schemas import SCHEMAS, Schema
from dmpcli.records.untrusted import decoder

SUFFIX = file_io.JOURNAL
VERSION = 1
EVERY = 0.5
"""s between two writings; with the time that a sync takes this stays below one second."""
LONGEST_BEHIND = 3.0
"""s: a disk that takes longer for one writing counts as failed."""
_MOST_ROWS = 8192
_MOST_GROUPS, _WIDEST = 256, 64
"""Groups of numbers in a row, and numbers in a group: far more than any run has."""
_KEY, _CHECK, _END = b"dmpcli journal", b"crc32", b"facts"


def beside(output: str) -> Path | None:
    """Return the journal's name for an output; None for what is not a file with a name."""
    file = Path(output)
    if output == file_io.DASH or (file.exists() and not file.is_file()):
        return None
    return file.with_name(file.name + SUFFIX)


class Journal:
    """The rows of one run, on disk half a second after they came.

    Parameters
    ----------
    path : Path
    rows : RowBuffer
        Filled by the loop, and by nobody else.
    schema : Schema
        Of the proper file.
    provenance : Provenance
        What is known before the run.

    Raises
    ------
    InputError
        There is such a journal already, or it cannot be written.
    """

    def __init__(self, path: Path, rows: RowBuffer, schema: Schema, provenance: Provenance) -> None:
        self.path = path
        self._rows = rows
        self._written = 0
        self._since: float | None = None
        self._failure: InstrumentError | None = None
        self._done = threading.Event()
        self._thread: threading.Thread | None = None
        header = {"version": VERSION, "schema": schema.name, "groups": list(rows.groups.items())}
        header |= {"texts": rows.texts, "provenance": asdict(provenance)}
        text = json.dumps(header, sort_keys=True, allow_nan=False).encode()
        self._fields = _fields(rows)
        self._sink = io.BytesIO()
        self._stream = pa.ipc.new_stream(self._sink, self._fields.with_metadata({_KEY: text}))
        self._file = _created(path)
        try:
            # The metadata go out with the first batch.
            self._stream.write_batch(_batch(rows, 0, 0, self._fields)[0])
            self._put()
            file_io.sync_folder(path.parent)
        except OSError as error:
            self.discard()
            raise InputError(f"{path}: cannot be written: {error.strerror}") from None
        self._thread = threading.Thread(target=self._keep, name="journal", daemon=True)
        self._thread.start()

    def hindrance(self) -> InstrumentError | None:
        """Return why the journal cannot go on; None while it can. It never waits."""
        since = self._since
        if self._failure is None and since is not None:
            behind = time.monotonic() - since
            if behind > LONGEST_BEHIND:
                self._failure = InstrumentError(
                    f"{self.path}: the disk has not taken the journal for {behind:.1f} s, stopped; "
                    "use a faster disk"
                )
        return self._failure

    def finish(self, facts: Mapping[str, Any]) -> None:
        """Write the rest of the rows, and what the run ended with; the file stays.

        Parameters
        ----------
        facts : mapping
            Of the proper file's provenance.
        """
        self._end_thread()
        if self._failure is not None:
            return
        try:
            self._write_rows()
            text = _told(facts)
            if text is None:
                return  # the rows are there, and the file has yet to be written
            nothing, _ = _batch(self._rows, 0, 0, self._fields)
            self._stream.write_batch(nothing, custom_metadata={_END: text})
            self._stream.close()
            self._put()
        except OSError as error:
            self._failed(error)

    def discard(self) -> None:
        """Remove the journal: the proper file is there, or there was nothing to keep."""
        self._end_thread()
        with contextlib.suppress(OSError):
            self.path.unlink()
        with contextlib.suppress(OSError):
            os.close(self._file)

    def _end_thread(self) -> None:
        self._done.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def _keep(self) -> None:
        """Write what came, again and again; the journal's thread."""
        due = time.monotonic() + EVERY
        while not self._done.wait(max(due - time.monotonic(), 0.0)):
            due += EVERY
            try:
                self._write_rows()
            except OSError as error:
                self._failed(error)
                return

    def _failed(self, error: OSError) -> None:
        self._failure = InstrumentError(
            f"{self.path}: the journal cannot be written, stopped: {error.strerror}; make room"
        )

    def _write_rows(self) -> None:
        while (count := min(len(self._rows) - self._written, _MOST_ROWS)) > 0:
            self._since = time.monotonic()
            batch, check = _batch(self._rows, self._written, self._written + count, self._fields)
            self._stream.write_batch(batch, custom_metadata={_CHECK: str(check)})
            self._put()
            self._written += count
            self._since = None

    def _put(self) -> None:
        """Bring what the stream has made to the disk."""
        content = self._sink.getvalue()
        self._sink.seek(0)
        self._sink.truncate()
        while content:
            content = content[os.write(self._file, content) :]
        os.fsync(self._file)


def _told(facts: Mapping[str, Any]) -> bytes | None:
    """Return facts as JSON; None where they are not to be written so."""
    try:
        return json.dumps(dict(facts), sort_keys=True, allow_nan=False).encode()
    except (ValueError, TypeError):
        return None


def _created(path: Path) -> int:
    """Open a new file that no other process has; the lock ends with the process."""
    try:
        file = os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666)
    except FileExistsError:
        raise _taken(path) from None
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from None
    with contextlib.suppress(OSError):  # some network file systems know no locks
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    return file


def refuse_taken(path: Path) -> None:
    """Refuse a journal's name that another run has or has left; for before anything is opened.

    Raises
    ------
    InputError
    """
    if path.exists():
        raise _taken(path)


def _taken(path: Path) -> InputError:
    if _locked(path):
        return InputError(f"{path}: another dmpcli is writing it; choose another -o")
    return InputError(
        f"{path}: a run that did not end left this journal; bring it home with "
        f"'dmpcli recover {path} -o FILE', or remove it"
    )


def _locked(path: str | Path) -> bool:
    """Tell whether a process that is still there writes this journal."""
    try:
        with open(path, "rb") as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    return False


def _fields(rows: RowBuffer) -> Any:
    number = pa.float64()
    numbers = [
        pa.field(name, number if width == 1 else pa.list_(number, width), nullable=False)
        for name, width in rows.groups.items()
    ]
    return pa.schema([*numbers, *(pa.field(n, pa.string(), nullable=False) for n in rows.texts)])


def _batch(rows: RowBuffer, first: int, last: int, fields: Any) -> tuple[Any, int]:
    """Return rows as an Arrow batch, and their checksum."""
    widths = rows.groups.values()
    parts = np.split(rows.whole(first, last), np.cumsum(list(widths))[:-1], axis=1)
    flat = [np.ascontiguousarray(part).reshape(-1) for part in parts]
    words = [rows.words(name, first, last) for name in rows.texts]
    columns = [_listed(values, width) for values, width in zip(flat, widths, strict=True)]
    columns += [_texts(column) for column in words]
    return pa.RecordBatch.from_arrays(columns, schema=fields), _checksum(flat, words)


def _listed(values: Floats, width: int) -> Any:
    plain = arrow(values)
    return plain if width == 1 else pa.FixedSizeListArray.from_arrays(plain, width)


def _texts(words: Sequence[str]) -> Any:
    coded = [word.encode() for word in words]
    ends = np.cumsum([0, *map(len, coded)], dtype=np.int32)
    buffers = [None, pa.py_buffer(ends), pa.py_buffer(b"".join(coded))]
    return pa.Array.from_buffers(pa.string(), len(coded), buffers)


def _checksum(flat: Iterable[Floats], words: Iterable[Sequence[str]]) -> int:
    check = 0
    for values in flat:
        check = zlib.crc32(values.data, check)
    for column in words:
        check = zlib.crc32("\n".join(column).encode(), check)
    return check


@dataclass(frozen=True)
class JournalContent:
    """What a journal holds.

    Attributes
    ----------
    schema : Schema
        Of the proper file.
    provenance : Provenance
        Of the proper file; where the run did not come to its end, without the facts of the end.
    rows : RowBuffer
    whole : bool
        Whether the run came to its end.
    unread : int
        Bytes at the end that hold no whole batch.
    """

    schema: Schema
    provenance: Provenance
    rows: RowBuffer
    whole: bool
    unread: int


@decoder
def read(source: Source) -> JournalContent:
    """Read a journal, wherever it breaks off.

    Raises
    ------
    InputError
        Not a journal, one of a newer version, one that is being written, or one without a row.
    """
    if _locked(source.name):
        raise InputError(f"{source.name}: is still being written; end that run first")
    reader = pa.BufferReader(source.content)
    header, stream = _opened(reader, source.name)
    rows, provenance = _begun(header, source.name)
    whole, read_to = False, reader.tell()
    while not whole:
        try:
            batch, notes = stream.read_next_batch_with_custom_metadata()
            batch.validate(full=True)
            said = {} if notes is None else notes.to_dict()
            facts = _ended(said)
            if facts is not None:
                provenance, whole = replace(provenance, facts=facts), True
            elif not _take(rows, batch, said):
                break
        # Damaged bytes, whatever is wrong with them: what came before is whole by its checksums.
        except Exception:
            break
        read_to = reader.tell()
    if not len(rows):
        raise InputError(
            f"{source.name}: holds no row: the run broke off before one was written, and there is "
            "nothing to recover"
        )
    unread = 0 if whole else len(source.content) - read_to
    return JournalContent(SCHEMAS[header["schema"]], provenance, rows, whole, unread)


def _opened(reader: Any, name: str) -> tuple[dict[str, Any], Any]:
    """Return a journal's header and its stream of batches."""
    try:
        stream = pa.ipc.open_stream(reader)
        header = json.loads((stream.schema.metadata or {})[_KEY])
        version = int(header["version"])
    except (pa.ArrowException, OSError, KeyError, ValueError, TypeError):
        raise InputError(
            f"{name}: is no journal of dmpcli (they are called FILE{SUFFIX}), or it breaks off "
            "within its head"
        ) from None
    if version > VERSION or header.get("schema") not in SCHEMAS:
        raise InputError(
            f"{name}: journal version {version} of {header.get('schema')!r} is newer than this "
            f"program's ({VERSION}); upgrade dmpcli"
        )
    return header, stream


def _begun(header: Mapping[str, Any], name: str) -> tuple[RowBuffer, Provenance]:
    """Return what a header says of rows and run."""
    try:
        known = header["provenance"]
        provenance = Provenance(**known | {"inputs": tuple(known["inputs"])})
        groups = {str(group): int(width) for group, width in header["groups"]}
        # Before memory is taken for them.
        if not (0 < len(groups) <= _MOST_GROUPS and min(groups.values()) > 0):
            raise ValueError
        if max(groups.values()) > _WIDEST or len(header["texts"]) > _MOST_GROUPS:
            raise ValueError
        return RowBuffer(groups, [str(text) for text in header["texts"]]), provenance
    except (KeyError, TypeError, ValueError):
        raise InputError(f"{name}: is damaged in its head; its rows cannot be read") from None


def _ended(notes: Mapping[bytes, bytes]) -> dict[str, Any] | None:
    """Return what the run ended with, where a batch says it."""
    try:
        facts = json.loads(notes[_END])
    except (KeyError, ValueError):
        return None
    return facts if isinstance(facts, dict) else None


def _take(rows: RowBuffer, batch: Any, notes: Mapping[bytes, bytes]) -> bool:
    """Add a batch to the rows; False where it is not what was written."""
    if batch.num_rows == 0:
        return True
    flat = [_numbers(batch.column(name)) for name in rows.groups]
    words = {name: batch.column(name).to_pylist() for name in rows.texts}
    if notes.get(_CHECK) != str(_checksum(flat, words.values())).encode():
        return False
    parts = [v.reshape(-1, n) for v, n in zip(flat, rows.groups.values(), strict=True)]
    rows.extend(np.column_stack(parts), words)
    return True


def _numbers(column: Any) -> Floats:
    flat = column.flatten() if pa.types.is_fixed_size_list(column.type) else column
    return np.frombuffer(flat.buffers()[1], dtype=np.float64, count=len(flat))
