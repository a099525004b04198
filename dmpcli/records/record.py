"""A record: one Parquet file between the stages, its columns as arrays and its provenance."""

import contextlib
import json
import os
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, BinaryIO

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from dmpcli.arrays import AnyArray, Booleans, Floats
from dmpcli.errors import InputError
from dmpcli.records import parquet, schemas, untrusted
from dmpcli.records.columns import TYPES, columns_of, dtype_of
from dmpcli.records.file_io import TABLE, Source, parts_of
from dmpcli.records.json_files import loads
from dmpcli.records.schemas import EULER_ANGLES, POSITION, SCHEMAS, Schema
from dmpcli.records.storage import Location, each
from dmpcli.records.untrusted import decoder
from dmpcli.spatial import rotations
from dmpcli.version import __version__

KEY = b"dmpcli"


@dataclass(frozen=True)
class Provenance:
    """Where a file comes from; the same for the same inputs, options and seed.

    Parameters
    ----------
    command : str
        The subcommand that wrote it.
    options : dict
        The options that change the result, defaults included; JSON values.
    inputs : tuple of dict
        ``{"role": ..., "sha256": ...}`` of each input, in order.
    facts : dict
        What later stages need of this kind of file (k, d, tau, alpha_e, normal, ...); JSON values.
    """

    command: str
    options: dict[str, Any] = field(default_factory=dict)
    inputs: tuple[dict[str, str], ...] = ()
    facts: dict[str, Any] = field(default_factory=dict)
    tool: str = __version__


def input_of(role: str, source: "Source | Record") -> dict[str, str]:
    """Return the entry of `Provenance.inputs` for one input."""
    return {"role": role, "sha256": source.sha256}


@dataclass(frozen=True)
class Record:
    """One file of a published schema.

    Attributes
    ----------
    schema : Schema
    columns : dict of array, shape (rows,)
        Missing optional columns are absent; nulls in a number column are NaN. A text column that is
        to be written may be an Arrow array.
    provenance : Provenance
    name : str
        What messages call the file.
    sha256 : str
        Of the file's bytes; empty for one that was not read from a file.
    """

    schema: Schema
    columns: dict[str, AnyArray]
    provenance: Provenance
    name: str = ""
    sha256: str = ""

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    def has(self, *names: str) -> bool:
        """Tell whether all of these columns are there and hold at least one value."""
        return all(n in self.columns and not _all_null(self.columns[n]) for n in names)

    def stack(self, names: Sequence[str]) -> Floats:
        """Return several number columns as one array, shape (rows, len(names))."""
        return np.column_stack([self.columns[n] for n in names]).astype(float)

    @property
    def t(self) -> Floats:
        """Time, shape (rows,), s."""
        return np.asarray(self.columns["t"], dtype=float)

    def position(self, suffix: str = "") -> Floats:
        """TCP positions, shape (rows, 3), mm; `suffix` picks ``ref``, ``plan`` or ``sent``."""
        return self.stack(schemas.suffixed(POSITION, suffix) if suffix else POSITION)

    def rotation(self, suffix: str = "") -> Floats | None:
        """TCP rotations, shape (rows, 3, 3), or None where the file holds no orientation."""
        names = schemas.suffixed(EULER_ANGLES, suffix) if suffix else EULER_ANGLES
        return rotations.from_euler(self.stack(names)) if self.has(*names) else None


def _all_null(column: AnyArray) -> bool:
    return bool(column.dtype.kind == "f" and np.all(np.isnan(column)))


@dataclass(frozen=True)
class Form:
    """How the numbers of a file are stored.

    Attributes
    ----------
    single : bool
        Lengths, angles and forces in single precision: at 1 m a step of 6e-5 mm. Times stay double.
    compression : {'zstd', 'lz4', 'snappy', 'none'}
    """

    single: bool = False
    compression: str = "zstd"


def encode(record: Record, form: Form | None = None) -> bytes:
    """Return the record as the bytes of a Parquet file; the same record gives the same bytes."""
    sink = pa.BufferOutputStream()
    store(record, sink, form)
    return bytes(sink.getvalue().to_pybytes())


def store(record: Record, sink: Any, form: Form | None = None) -> None:
    """Write the record as a Parquet file into a path or an open Arrow or Python file.

    Parameters
    ----------
    record : Record
    sink : str or file
        A path is overwritten, and left cut short where writing fails: see `Draft` for whole files.
    form : Form, optional
        Without it double precision, compressed with zstd.

    Raises
    ------
    OSError
        It cannot be written.
    """
    table, said = _arrow_table(record, form or Form())
    pq.write_table(table, sink, **said)


class GrowingRecord:
    """A Parquet file that is written some rows at a time; each time they are a row group.

    Parameters
    ----------
    sink : file
        Open Arrow or Python file.
    form : Form, optional
    """

    def __init__(self, sink: Any, form: Form | None = None) -> None:
        self._sink, self._form = sink, form or Form()
        self._writer: Any = None

    def add(self, record: Record) -> None:
        """Write more rows, of one schema and provenance.

        Raises
        ------
        OSError
        """
        table, said = _arrow_table(record, self._form)
        if self._writer is None:
            self._writer = pq.ParquetWriter(self._sink, table.schema, **said)
        self._writer.write_table(table)

    def close(self) -> None:
        """Write what a file ends with."""
        if self._writer is not None:
            self._writer.close()


def store_groups(records: Iterable[Record], sink: Any, form: Form | None = None) -> None:
    """Write rows that come in groups, each a record of its own, as one Parquet file.

    Parameters
    ----------
    records : iterable of Record
        At least one, of the same columns and provenance.
    sink : file
        Open Arrow or Python file.
    form : Form, optional

    Raises
    ------
    OSError
        It cannot be written.
    """
    with contextlib.closing(GrowingRecord(sink, form)) as growing:
        for one in records:
            growing.add(one)


def _arrow_table(record: Record, form: Form) -> tuple[Any, dict[str, Any]]:
    """Return a record as an Arrow table, and how it is written."""
    fields, arrays = [], []
    for name, column in record.schema.columns.items():
        if name not in record.columns:
            if column.required:
                raise KeyError(f"{record.schema.name} lacks column {name}")
            continue
        single = form.single and column.type == "double" and column.unit != "s"
        kind = pa.float32() if single else TYPES[column.type]
        arrays.append(_arrow(record.columns[name], kind))
        fields.append(
            pa.field(name, kind, metadata={"unit": column.unit, "meaning": column.meaning})
        )
    table = pa.Table.from_arrays(arrays, schema=pa.schema(fields, metadata={KEY: header(record)}))
    said = {
        "compression": form.compression,
        "use_byte_stream_split": [f.name for f in fields if pa.types.is_floating(f.type)],
        "use_dictionary": [f.name for f in fields if not pa.types.is_floating(f.type)],
        "write_page_checksum": True,
    }
    return table, said


def repeated(texts: Sequence[str], counts: int | Sequence[int]) -> Any:
    """Return a text column that holds each text so many times in a row, as an Arrow array.

    Raises
    ------
    InputError
        More text than a column can hold, 2 GiB.
    """
    words = [text.encode() for text in texts]
    each = [counts] * len(words) if isinstance(counts, int) else list(counts)
    content = b"".join([word * count for word, count in zip(words, each, strict=True)])
    if len(content) >= 1 << 31:
        raise InputError("more text than one file can hold; give fewer --pairs-per-part")
    sizes = np.repeat(np.array([len(word) for word in words], dtype=np.int32), each)
    return pa.Array.from_buffers(pa.string(), len(sizes), _text_buffers(sizes, content))


def _arrow(values: Any, kind: Any) -> Any:
    """One column for pyarrow; NaN and None become null."""
    if isinstance(values, pa.Array):
        return values
    # From buffers: pa.array would import pandas, a third of a second, only to ask what this is.
    if kind == pa.string():
        known = np.array([value is not None for value in values], dtype=bool)
        texts = list(values) if known.all() else ["" if v is None else v for v in values]
        content = "".join(texts).encode()
        sizes = np.fromiter(map(len, texts), np.int32, len(texts))
        if len(content) != sizes.sum():  # some letter takes more than one byte
            sizes = np.fromiter((len(text.encode()) for text in texts), np.int32, len(texts))
        return pa.Array.from_buffers(kind, len(texts), _text_buffers(sizes, content, known))
    valid = None
    if values.dtype.kind == "f" and _may_hold_nan(values):
        valid = _validity(~np.isnan(values))
    data = np.ascontiguousarray(values, dtype=dtype_of(kind))
    return pa.Array.from_buffers(kind, len(data), [valid, pa.py_buffer(data)])


def _text_buffers(sizes: AnyArray, content: bytes, known: Booleans | None = None) -> list[Any]:
    """Return Arrow's buffers of texts that have so many bytes each."""
    ends = np.zeros(len(sizes) + 1, dtype=np.int32)
    np.cumsum(sizes, out=ends[1:])
    return [
        None if known is None else _validity(known),
        pa.py_buffer(ends),
        pa.py_buffer(content),
    ]


def _may_hold_nan(values: Floats) -> bool:
    # A sum is NaN where one of its terms is: this tells without an array of answers.
    with np.errstate(over="ignore", invalid="ignore"):
        return bool(np.isnan(values.sum()))


def _validity(known: Booleans) -> Any:
    """Return Arrow's bitmap of the values that are there; None where all are."""
    return None if known.all() else pa.py_buffer(np.packbits(known, bitorder="little"))


def header(record: Record) -> bytes:
    """Return the metadata of a record as they stand in its file."""
    p = record.provenance
    entries = {
        "schema": record.schema.name,
        "version": record.schema.version_of(record.columns),
        "tool": p.tool,
        "command": p.command,
        "options": p.options,
        "inputs": list(p.inputs),
        "facts": p.facts,
        "frame": schemas.FRAME,
        "euler": schemas.EULER,
    }
    return json.dumps(entries, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()


@decoder
def decode(source: Source, expected: Schema | None = None) -> Record:
    """Read one of our Parquet files.

    Parameters
    ----------
    source : Source
    expected : Schema, optional
        The only schema that will do; without it any of ours will.

    Raises
    ------
    InputError
        Not a Parquet file, truncated, not one of ours, of another schema, of a newer version, a
        required column missing or of the wrong type, or a value that is not finite.
    """
    table = parquet.table(source)
    header = header_of(table, source.name)
    schema = SCHEMAS.get(str(header.get("schema")))
    if schema is None:
        raise InputError(f"{source.name}: unknown schema {header.get('schema')!r}")
    if expected is not None and schema is not expected:
        raise InputError(
            f"{source.name}: is a {schema.name} file, a {expected.name} file is needed here"
        )
    version = header.get("version", 0)
    if version > schema.version:
        raise InputError(
            f"{source.name}: {schema.name} version {version} is newer than this program's "
            f"({schema.version}); upgrade dmpcli"
        )
    return Record(
        schema,
        columns_of(table, schema.columns, source.name),
        Provenance(
            str(header.get("command", "")),
            dict(header.get("options", {})),
            tuple(header.get("inputs", ())),
            dict(header.get("facts", {})),
            str(header.get("tool", "")),
        ),
        source.name,
        source.sha256,
    )


def is_ours(source: Source) -> bool:
    """Tell whether a source is a Parquet file that carries our metadata.

    A damaged Parquet file counts as ours, so that `decode` says what is wrong with it.
    """
    if source.content[:4] != parquet.MAGIC:
        return False
    try:
        with untrusted.decoding(source.name):
            return KEY in (pq.read_schema(source.open()).metadata or {})
    except InputError:
        return True


def header_of(table: Any, name: str) -> dict[str, Any]:
    """Return our metadata of a pyarrow table; InputError where there is none or it is broken."""
    metadata = table.schema.metadata or {}
    if KEY not in metadata:
        raise InputError(
            f"{name}: a Parquet file, but not written by dmpcli; fit can read it, see fit --help"
        )
    try:
        odd: list[str] = []
        header = loads(metadata[KEY], odd)
        header = None if odd else header
    except (ValueError, RecursionError):
        header = None
    if not isinstance(header, dict) or not _sound(header):
        raise InputError(f"{name}: its dmpcli metadata are damaged; make the file again")
    return header


def _sound(header: dict[str, Any]) -> bool:
    """Tell whether metadata hold what their readers rely on."""
    facts, inputs = header.get("facts", {}), header.get("inputs", [])
    return (
        type(header.get("version")) is int
        and isinstance(header.get("options", {}), dict)
        and isinstance(inputs, list)
        and all(isinstance(entry, dict) for entry in inputs)
        and isinstance(facts, dict)
        and _sound_facts(facts)
        and isinstance(facts.get("trajectory", {}), dict)
        and _sound_facts(facts.get("trajectory", {}))
        and all(isinstance(facts.get(key, []), list) for key in ("strokes", "drawn", "remaining"))
        and all(_sound_stroke(stroke) for stroke in facts.get("strokes", []))
        and ("drawn" in facts) == ("remaining" in facts)
    )


def _sound_stroke(said: object) -> bool:
    return isinstance(said, dict) and isinstance(said.get("id"), str) and _sound_facts(said)


_SIZES = {
    **dict.fromkeys(("normal", "start", "goal"), 3),
    **dict.fromkeys(("k", "d", "alpha_e"), 6),
    "end_heights": 2,
}
_GROUPS = {
    "beyond_tolerance": ("tolerance", "rms", "largest"),
    "over_surface": ("band", "removed", "offset"),
}
_NUMBERS = ("tau", "duration", "rate", "size", "turn")


def _sound_facts(facts: dict[str, Any]) -> bool:
    lists = (
        isinstance(facts[key], list)
        and len(facts[key]) == size
        and all(_is_number(value) for value in facts[key])
        for key, size in _SIZES.items()
        if key in facts
    )
    groups = (
        isinstance(facts[key], dict) and all(_is_number(facts[key].get(name)) for name in names)
        for key, names in _GROUPS.items()
        if key in facts
    )
    numbers = (_is_number(facts[key]) for key in _NUMBERS if key in facts)
    return all(lists) and all(groups) and all(numbers)


def _is_number(value: object) -> bool:
    return type(value) in (int, float) and bool(np.isfinite(value))  # type: ignore[call-overload]


_FOOTER = 8
"""Bytes at the end of a Parquet file: the length of its footer, and its mark."""


def _may_be_ours(stream: BinaryIO) -> bool:
    """Tell a file with our metadata, or a damaged or empty one; without parsing its footer."""
    if stream.read(4) != parquet.MAGIC:
        stream.seek(0)
        return stream.read(1) == b""
    end = stream.seek(0, os.SEEK_END)
    stream.seek(max(0, end - _FOOTER))
    tail = stream.read()
    size = int.from_bytes(tail[:4], "little")
    if tail[4:] != parquet.MAGIC or not 0 < size <= end - _FOOTER:
        return True
    stream.seek(end - _FOOTER - size)
    # As Thrift's compact protocol writes the key: a string field, its length, its letters.
    return b"\x18" + bytes([len(KEY)]) + KEY in stream.read(size)


def foreign_parts(folder: Location, known: Collection[str] = ()) -> list[str]:
    """Names of files in a dataset folder that stand where ours would, but are not ours.

    A damaged Parquet file, or an empty one, counts as ours: a power cut can leave such parts.

    Parameters
    ----------
    folder : Path or ObjectPath
    known : collection of str
        Names that are known to be ours.
    """
    names = sorted([*parts_of(folder), TABLE]) if folder.is_dir() else []
    asked = [name for name in names if name not in known]
    ours = each(folder, lambda name: _is_ours_or_none(folder / name), asked)
    return [name for name, one in zip(asked, ours, strict=True) if not one]


def _is_ours_or_none(file: Location) -> bool:
    """Tell whether a file may be ours; one that is not there counts as such."""
    if not file.is_file():
        return True
    try:
        with file.open("rb") as stream:
            return _may_be_ours(stream)
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {error.strerror}") from None
