"""Hostile files: every reader on thousands of damaged and crafted inputs, each reproducible.

Each reader starts from sound files and reads mutations of them, in a process of its own whose
memory is bounded and in which an alarm ends what takes longer than five seconds. A mutation must
be read, or refused as an input (`InputError`); what else comes out is told with the seed that
makes it again::

    python -m benchmarks.mutations [--count N] [--seed S] [--jobs J] [READER ...]
    python -m benchmarks.mutations --again READER NUMBER [--seed S]    # one, with its traceback

``--keep FOLDER`` leaves the inputs that were not held there.
"""

import argparse
import contextlib
import io
import json
import multiprocessing
import resource
import signal
import sys
import time
import traceback
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from dmpcli.errors import DmpError
from dmpcli.instruments.netft import settings as netft_settings
from dmpcli.records import (
    journal,
    learned_skill,
    lines,
    manifest,
    mesh,
    pairs,
    pose,
    record,
    recordings,
    schemas,
    static_poses,
    surface,
    tables,
    tool,
    touched,
)
from dmpcli.records.file_io import Source
from dmpcli.records.layouts import LAYOUTS
from dmpcli.records.record import Form, Provenance, Record
from dmpcli.records.row_buffer import RowBuffer
from dmpcli.records.trajectory_reader import rows_by_id, stored

SAMPLES = Path(__file__).parent.parent / "sample_runs"

LONGEST = 5.0
"""s that one input may take."""

MEMORY = 2**30
"""Bytes beyond what the process has at its start."""

Read = Callable[[Source], object]


class Hang(BaseException):
    """Not an Exception: no boundary may take it for the file's fault."""


@dataclass(frozen=True)
class Reader:
    """What is fed, and from where it starts.

    Attributes
    ----------
    name : str
    read : callable
    file : str
        What messages call the input; its ending may matter.
    seeds : tuple of bytes
        Sound inputs.
    """

    name: str
    read: Read
    file: str
    seeds: tuple[bytes, ...]


@dataclass
class Findings:
    """What became of a reader's mutations.

    Attributes
    ----------
    read, refused : int
    held : list of str
        One line for each that was neither: number, kind and where.
    slowest : float
        s.
    """

    read: int = 0
    refused: int = 0
    slowest: float = 0.0
    grown: int = 0
    held: list[str] = field(default_factory=list)


# Sound inputs.

_T = np.arange(40) * 0.02
_P = Provenance("record", {"seed": 1}, ({"role": "tool", "sha256": "0" * 64},), {"ended": "asked"})


def _columns(schema: schemas.Schema) -> dict[str, Any]:
    n = len(_T)
    found: dict[str, Any] = {}
    for i, (name, column) in enumerate(schema.columns.items()):
        if column.type == "string":
            found[name] = np.array(["1"] * (n // 2) + ["2"] * (n - n // 2), dtype=object)
        elif column.type == "int64":
            found[name] = np.arange(1, n + 1)
        else:
            found[name] = 0.1 * np.sin(_T + i)
    found["t"] = np.concatenate([_T[: n // 2], _T[: n // 2]]) if "id" in found else _T
    if "nx" in found:
        found |= {"nx": 0.0 * _T, "ny": 0.0 * _T, "nz": 1.0 + 0.0 * _T}
    return found


def _parquet(schema: schemas.Schema, **facts: Any) -> tuple[bytes, ...]:
    provenance = Provenance(_P.command, _P.options, _P.inputs, _P.facts | facts)
    whole = Record(schema, _columns(schema), provenance)
    return record.encode(whole), record.encode(whole, Form(compression="none"))


def _csv(names: str, separator: str = ",") -> bytes:
    def cell(i: int, j: int, name: str) -> str:
        if name == "id" and names.split()[1] == "x":
            return "ab"[i % 2]
        return f"{0.02 * i if j == 0 else i % (j + 3) + 0.2 * i * (name[0] in 'xyz'):.6g}"

    rows = [names.split()]
    rows += [[cell(i, j, name) for j, name in enumerate(rows[0])] for i in range(20)]
    return "".join(separator.join(row) + "\n" for row in rows).encode()


def _foreign_parquet() -> bytes:
    sink = io.BytesIO()
    pq.write_table(pa.table({name: _T + i for i, name in enumerate(("t", *"xyz"))}), sink)
    return sink.getvalue()


def _motive() -> bytes:
    head = [
        "Format Version,1.23,Take Name,a,Length Units,Millimeters,Rotation Type,Quaternion",
        "",
        ",Type,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body",
        ",Name" + ",pen" * 7,
        ",ID" + ",1" * 7,
        ",,Rotation,Rotation,Rotation,Rotation,Position,Position,Position",
        "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z",
    ]
    rows = [f"{i},{0.02 * i:.3f},0,0,0,1,{5 * i},{2 * i},{i}" for i in range(20)]
    return "\n".join([*head, *rows, ""]).encode()


def _tum() -> bytes:
    rows = [f"{1e9 + 0.02 * i:.3f} {0.01 * i:g} 0.5 {0.002 * i:g} 0 0 0 1" for i in range(20)]
    return "\n".join(["# timestamp tx ty tz qx qy qz qw", *rows, ""]).encode()


def _skill() -> bytes:
    from dmpcli.workflows import library

    demonstration = library.read(SAMPLES / "reference.parquet")
    return library.fit(demonstration, basis=10, tolerance=5.0).content


_TOOL = {
    "schema": "tool",
    "version": 2,
    "flange_to_tcp": {"position": [0, 0, 100], "rotation": [0, 0, 0]},
    "flange_to_sensor": {"position": [0, 0, 30]},
    "payload": {"weight": 4.0, "centre_of_mass": [0, 0, 40], "zero": None},
}
_POSE = {
    "position": [1, 2, 3],
    "rotation": [0, 0.1, 0],
    "residuals": {"points": 4, "rms": 0.1, "largest": 0.2},
    "unit": "mm",
}
_SURFACES = (
    {"point": [0, 0, 0], "normal": [0, 0, 1]},
    {"point": [0, 0, 0], "axis": [0, 0, 1], "radius": 50},
    {"schema": "sphere", "version": 1, "centre": [0, 0, 0], "radius": 50},
)
_MANIFEST = {
    "schema": "manifest",
    "version": 1,
    "tool": "0.1.0",
    "options": {"rate": 50},
    "inputs": [{"role": "pairs", "sha256": "00"}],
    "pairs": 2,
    "drawn": 2,
    "parts": [{"file": "part-00000.parquet", "pairs": 2, "rows": 40, "bytes": 1000}],
}
_TOML = b"""[units]
length = "mm"

[record]
mass = [0.005, 0.005, 0.01, 0.1, 0.1, 0.1]
damping = [0.06, 0.06, 0.4, 2.0, 2.0, 2.0]
stiffness = [0, 0, 0, 0, 0, 0]
control_rate = 50.0
drag = "admittance"
"""
_API = b"""<?xml version="1.0" encoding="UTF-8"?>
<netft><prodname>NetFT</prodname><setbias>0;1;2;3;4;5</setbias><cfgcpf>1000000</cfgcpf>
<cfgcpt>1000000</cfgcpt><scfgfu>N</scfgfu><scfgtu>N-m</scfgtu><cfgmr>100;100;200;4;4;4</cfgmr>
<comrdte>Enabled</comrdte><comrdtrate>100</comrdtrate><comrdtbsiz>1</comrdtbsiz></netft>
"""


def _json(*documents: dict[str, Any]) -> tuple[bytes, ...]:
    return tuple(json.dumps(document, indent=1).encode() for document in documents)


def _grid(size: int = 3) -> tuple[list[tuple[float, float, float]], list[tuple[int, int, int]]]:
    places = [(10.0 * i, 10.0 * j, float(i * j)) for i in range(size) for j in range(size)]
    faces = []
    for i in range(size - 1):
        for j in range(size - 1):
            a = i * size + j
            faces += [(a, a + size, a + 1), (a + 1, a + size, a + size + 1)]
    return places, faces


def _meshes() -> dict[str, tuple[bytes, ...]]:
    V, F = _grid()
    corners = np.array(V, dtype="<f4")[np.array(F)]
    facet = np.dtype([("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")])
    facets = np.zeros(len(F), facet)
    facets["c"] = corners
    binary = bytes(80) + len(F).to_bytes(4, "little") + facets.tobytes()
    text = "solid a\n" + "".join(
        "facet normal 0 0 1\nouter loop\n"
        + "".join(f"vertex {x:g} {y:g} {z:g}\n" for x, y, z in corner.tolist())
        + "endloop\nendfacet\n"
        for corner in corners
    )
    obj = "".join(f"v {x:g} {y:g} {z:g}\n" for x, y, z in V)
    obj += "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in F) + "f 1 4 5 2\n"
    off = f"OFF\n{len(V)} {len(F)} 0\n" + "".join(f"{x:g} {y:g} {z:g}\n" for x, y, z in V)
    off += "".join(f"3 {a} {b} {c}\n" for a, b, c in F)

    def head(kind: str) -> str:
        return (
            f"ply\nformat {kind} 1.0\ncomment a\nelement vertex {len(V)}\nproperty float x\n"
            "property float y\nproperty float z\n"
            f"element face {len(F)}\nproperty list uchar int vertex_indices\nend_header\n"
        )

    ply = head("ascii") + "".join(f"{x:g} {y:g} {z:g}\n" for x, y, z in V)
    ply += "".join(f"3 {a} {b} {c}\n" for a, b, c in F)
    packed = np.array(V, "<f4").tobytes() + b"".join(
        b"\x03" + np.array(face, "<i4").tobytes() for face in F
    )
    strip = (
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
        "property float z\nelement tristrips 1\nproperty list int int vertex_indices\n"
        "end_header\n0 0 0\n10 0 0\n0 10 0\n10 10 0\n4 0 1 2 3\n"
    )
    return {
        "stl": (binary,),
        "stl text": ((text + "endsolid a\n").encode(),),
        "obj": (obj.encode(),),
        "off": (off.encode(),),
        "ply": (ply.encode(), strip.encode()),
        "ply binary": (head("binary_little_endian").encode() + packed,),
    }


def _journal() -> bytes:
    import tempfile

    rows = RowBuffer({"t": 1, "position": 3, "rotation": 9}, ["state"])
    for i in range(30):
        rows.add([0.02 * i, np.arange(3.0), np.eye(3)], ["ready"])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.journal"
        kept = journal.Journal(path, rows, schemas.RUN, _P)
        kept.finish({"ended": "asked"})
        content = path.read_bytes()
        kept.discard()
    return content


def _strokes(source: Source) -> object:
    whole = record.decode(source, schemas.TRAJECTORY)
    return [stored(whole, name, rows) for name, rows in rows_by_id(whole.columns["id"]).items()]


def _settings(source: Source) -> object:
    from dmpcli.settings import layers
    from dmpcli.settings.record import RecordSettings

    try:
        text = source.content.decode("utf-8")
    except UnicodeDecodeError:
        return None  # told where the file is read
    _, said = layers._toml_section(source.name, text, "record")
    from pydantic import TypeAdapter, ValidationError

    try:
        return TypeAdapter(RecordSettings).validate_python(said)
    except ValidationError as error:
        return layers._first(error, RecordSettings, {}, dict.fromkeys(said, source.name))


def _pages(source: Source) -> object:
    try:
        netft_settings.calibration_page(source.content)
        return netft_settings.read_pages(source.content)
    except ValueError:
        return None


def _inspected(source: Source) -> object:
    from dmpcli.reporting import inspection

    found = inspection.inspected(source)
    return inspection.as_text(found, 100), inspection.as_json(found)


def readers() -> dict[str, Reader]:
    """Return all readers, by name."""
    from dmpcli.simulation import reference_strokes

    meshes = _meshes()
    demonstration = _parquet(schemas.DEMONSTRATION)
    made: list[tuple[str, Read, str, tuple[bytes, ...]]] = [
        ("demonstration", recordings.read, "a.parquet", demonstration),
        ("trajectory", _strokes, "a.parquet", _parquet(schemas.TRAJECTORY, normal=[0, 0, 1])),
        ("run", lambda s: record.decode(s, schemas.RUN), "a.parquet", _parquet(schemas.RUN)),
        ("pairs", pairs.read, "a.parquet", _parquet(schemas.PAIRS)),
        ("poses", static_poses.decode, "a.parquet", _parquet(schemas.POSES)),
        ("foreign parquet", recordings.read, "a.parquet", (_foreign_parquet(),)),
        (
            "recording csv",
            recordings.read,
            "a.csv",
            (
                _csv("t x y z rx ry rz"),
                _csv("time[s] x[mm] y[mm] z[mm]", ";"),
            ),
        ),
        ("recording tum", lambda s: recordings.read(s, LAYOUTS["tum"]), "a.txt", (_tum(),)),
        (
            "recording motive",
            lambda s: recordings.read(s, LAYOUTS["motive"]),
            "a.csv",
            (_motive(),),
        ),
        ("pairs csv", pairs.read, "a.csv", (_csv("id x0 y0 z0 xg yg zg duration"),)),
        ("keep-out csv", lines.read, "a.csv", (_csv("id x y z"),)),
        ("touched csv", touched.read, "a.csv", (_csv("x y z rx ry rz px py pz ax ay az"),)),
        ("reference csv", reference_strokes.read_points, "a.csv", (_csv("x y z"),)),
        ("table", tables.read, "a.csv", (_csv("a b c"), _foreign_parquet())),
        ("skill", learned_skill.read, "a.json", (_skill(),)),
        ("tool", tool.decode, "a.json", _json(_TOOL)),
        ("pose", pose.decode, "a.json", _json(_POSE)),
        ("surface", surface.load, "a.json", _json(*_SURFACES)),
        ("manifest", manifest.decode, "a.json", _json(_MANIFEST)),
        ("journal", journal.read, "a.journal", (_journal(),)),
        ("settings", _settings, "a.toml", (_TOML,)),
        ("sensor pages", _pages, "page", (_API,)),
        *((name, mesh.decode, f"a.{name.split()[0]}", seeds) for name, seeds in meshes.items()),
    ]
    every = tuple(content for _, _, _, seeds in made for content in seeds)
    made.append(("inspect", _inspected, "a.bin", every))
    return {name: Reader(name, read, file, seeds) for name, read, file, seeds in made}


# Mutations.

_NUMBERS = (
    "0", "-1", "1", "-0", "1e308", "-1e308", "1e-320", "nan", "inf", "-inf", "4294967295",
    "2147483648", "-2147483649", "9223372036854775808", "99999999999999999999", "0x10", "1e",
    "1,5", "", "null", "9" * 400, "9" * 5000, "0." + "3" * 300, "true", '"x"', "[]", "{}",
)  # fmt: skip
_WORDS = (
    b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", b"\r", b"\n\n", b'"', b"'", b",", b";", b"#", b"\\",
    b"\xc2\x85", b"\xe2\x80\xa8", b"[" * 2000, b"{" * 2000, b"(", b"\x1b[2J",
)  # fmt: skip


def mutated(reader: Reader, random: Random) -> bytes:
    """Return one mutation of one of a reader's sound inputs."""
    content = random.choice(reader.seeds)
    crafted = content[:4] == b"PAR1"
    if crafted and random.random() < 0.6:
        return _crafted(content, random)
    if content[:1] == b"{" and random.random() < 0.5:
        return _redone(content, random)
    for _ in range(random.choice((1, 1, 1, 2, 3, 8))):
        content = _changed(content, random)
    return content


def _changed(content: bytes, random: Random) -> bytes:
    at = random.randrange(len(content) + 1)
    to = min(at + random.choice((1, 1, 2, 4, 8, 64, 512)), len(content))
    how = random.randrange(10)
    if how == 0:
        return content[:at]
    if how == 1:
        return content[:at] + content[to:]
    if how == 2:
        return content[:at] + content[at:to] * random.choice((2, 3, 100)) + content[to:]
    if how == 3:
        return content[:at] + random.choice(_WORDS) + content[at:]
    if how == 4:
        return content[:at] + random.randbytes(to - at) + content[to:]
    if how == 5 and at < len(content):
        return content[:at] + bytes([content[at] ^ 1 << random.randrange(8)]) + content[at + 1 :]
    if how == 6:
        value = random.choice((0, 1, 2**31 - 1, 2**31, 2**32 - 1, 2**63, 2**64 - 1, 1000))
        size = random.choice((1, 2, 4, 8))
        packed = (value % 256**size).to_bytes(size, random.choice(("little", "big")))
        return content[:at] + packed + content[at + size :]
    if how == 7:
        other = random.randrange(len(content) + 1)
        return content[:at] + content[other : other + to - at] + content[to:]
    return _numbered(content, random)


def _numbered(content: bytes, random: Random) -> bytes:
    """Put another number where one stands in a text."""
    places = [i for i, byte in enumerate(content[:20000]) if 48 <= byte <= 57]
    if not places:
        return content[: len(content) // 2]
    at = to = random.choice(places)
    while to < len(content) and content[to : to + 1] in b"0123456789.eE+-" and content[to] > 0:
        to += 1
    while at and content[at - 1 : at] in b"0123456789.eE+-" and content[at - 1] > 0:
        at -= 1
    return content[:at] + random.choice(_NUMBERS).encode() + content[to:]


_VALUES: tuple[Any, ...] = (
    None, True, 0, -1, 1.5, 1e308, -1e-320, 2**63, 2**70, "", "x", "\x00\x1b", [], {}, [1], [[1]],
    {"a": 1}, [1e308] * 3, [0.0] * 6, "é" * 300, [None] * 3, float("nan"), float("inf"),
)  # fmt: skip


def _redone(content: bytes, random: Random) -> bytes:
    """Change values of a JSON document, or its keys."""
    document = json.loads(content)
    for _ in range(random.choice((1, 1, 2, 4))):
        _shuffle(document, random)
    return json.dumps(document).encode()


def _shuffle(document: Any, random: Random) -> None:
    while isinstance(document, dict | list) and document:
        keys = list(document) if isinstance(document, dict) else list(range(len(document)))
        key = random.choice(keys)
        if isinstance(document[key], dict | list) and document[key] and random.random() < 0.7:
            document = document[key]
            continue
        how = random.randrange(4)
        if how == 0:
            del document[key]
        elif how == 1 and isinstance(document, dict):
            document[random.choice(("schema", "version", "x", "", key + "_"))] = document[key]
        elif how == 2 and isinstance(document, list):
            document += document[: random.choice((1, 3, 1000))]
        else:
            document[key] = random.choice(_VALUES)
        return


def _crafted(content: bytes, random: Random) -> bytes:
    """Write a Parquet table anew, with something odd about it."""
    table = pq.read_table(io.BytesIO(content))
    for _ in range(random.choice((1, 1, 2, 3))):
        table = _odd(table, random)
    sink = io.BytesIO()
    compression = random.choice(("zstd", "none", "snappy", "gzip"))
    try:
        pq.write_table(
            table, sink, compression=compression, row_group_size=random.choice((1, 7, 10**6))
        )
    except (pa.ArrowException, ValueError, TypeError):
        return content[: random.randrange(len(content))]
    return sink.getvalue()


def _odd(table: Any, random: Random) -> Any:
    how = random.randrange(8)
    if table.num_columns == 0 or table.num_rows == 0:
        return table
    i = random.randrange(table.num_columns)
    name, n = table.column_names[i], table.num_rows
    if how == 0:
        return table.remove_column(i)
    if how == 1:
        return table.append_column(name, table.column(i))
    if how == 2:
        return table.set_column(i, name, random.choice(_columns_of_others(n)))
    if how == 3:
        return table.slice(random.randrange(n), random.choice((0, 1, 2, n)))
    if how == 4:
        metadata = dict(table.schema.metadata or {})
        key = b"dmpcli"
        if key in metadata:
            with contextlib.suppress(ValueError):
                metadata[key] = _redone(metadata[key], random)
            if random.random() < 0.3:
                metadata[key] = _changed(metadata[key], random)
        return table.replace_schema_metadata(metadata)
    if how == 5:
        order = list(range(n))
        random.shuffle(order)
        return table.take(pa.array(order))
    if how == 6:
        values = table.column(i).to_pylist()
        values[random.randrange(n)] = None
        with contextlib.suppress(pa.ArrowException):
            return table.set_column(i, name, pa.array(values, type=table.column(i).type))
        return table
    values = [random.choice((np.nan, np.inf, -np.inf, 1e308, -1e308, 0.0, 5e-324))] * n
    return table.set_column(i, name, pa.array(values))


def _columns_of_others(n: int) -> list[Any]:
    """Columns of kinds that no file of ours has."""
    return [
        pa.array(["x"] * n),
        pa.array([""] * n),
        pa.array(["1.5"] * n),
        pa.array([b"\xff\xfe"] * n),
        pa.array(["é" * 50] * n).dictionary_encode(),
        pa.array([[1.0, 2.0]] * n),
        pa.array([{"a": 1}] * n),
        pa.array([True] * n),
        pa.array([None] * n, type=pa.null()),
        pa.array([2**62] * n),
        pa.array([0] * n, type=pa.timestamp("ns")),
        pa.array([10**15] * n, type=pa.timestamp("us", "UTC")),
        pa.array([1] * n, type=pa.date32()),
        pa.array([1] * n, type=pa.time64("us")),
        pa.array([1] * n, type=pa.duration("s")),
        pa.array([1] * n).cast(pa.decimal128(30, 3)),
        pa.array([1.0] * n, type=pa.float32()),
        pa.array([np.float16(1.0)] * n, type=pa.float16()),
        pa.array([255] * n, type=pa.uint8()),
        pa.array([2**64 - 1] * n, type=pa.uint64()),
        pa.array(["id"] * n, type=pa.large_string()),
        pa.array([b"1234"] * n, type=pa.binary(4)),
    ]


# The guard.


@contextlib.contextmanager
def _alarmed() -> Iterator[None]:
    def ring(*_: object) -> None:
        raise Hang

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, LONGEST)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def tried(reader: Reader, content: bytes) -> tuple[str, str]:
    """Read one input; return ``read``, ``refused`` or what is wrong, and where."""
    source = Source(reader.file, content or b" ")
    begin = time.monotonic()
    try:
        with _alarmed(), warnings.catch_warnings():
            warnings.simplefilter("error")
            reader.read(source)
    except DmpError as error:
        kind = type(error.__cause__).__name__ if error.__cause__ else ""
        if "needs more memory" in str(error):
            return "memory", _where(error)
        if isinstance(error.__cause__, Warning):
            return f"warning: {error.__cause__}", _where(error.__cause__)
        if reader.file not in str(error):
            return f"no name of the file: {error}", kind
    except Hang as hang:
        return "hang", _where(hang)
    except MemoryError as error:
        return "memory", _where(error)
    except Exception as error:
        return f"{type(error).__name__}: {error}", _where(error)
    else:
        return ("read", "") if time.monotonic() - begin < LONGEST else ("hang", "")
    return ("refused", "") if time.monotonic() - begin < LONGEST else ("hang", "")


def _where(error: BaseException) -> str:
    frames = [f for f in traceback.extract_tb(error.__traceback__) if "dmpcli" in f.filename]
    return f"{Path(frames[-1].filename).name}:{frames[-1].lineno}" if frames else ""


def run(reader: Reader, count: int, seed: int, keep: Path | None = None) -> Findings:
    """Read so many mutations in this process; mutation n is the same whatever came before it."""
    found = Findings()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for number in range(count):
        content = mutated(reader, Random(f"{seed} {reader.name} {number}"))
        begin = time.monotonic()
        kind, where = tried(reader, content)
        found.slowest = max(found.slowest, time.monotonic() - begin)
        if kind == "read":
            found.read += 1
        elif kind == "refused":
            found.refused += 1
        else:
            found.held.append(f"{reader.name} {number}: {kind[:150]} ({where})")
            if keep is not None:
                (keep / f"{reader.name}-{number}").write_bytes(content)
    found.grown = 1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
    return found


def _bounded(task: tuple[str, int, int, Path | None]) -> tuple[str, Findings]:
    name, count, seed, keep = task
    reader = readers()[name]
    run(reader, 20, seed + 1)  # what is loaded once is not the inputs'
    with Path("/proc/self/statm").open(encoding="ascii") as statm:
        size = int(statm.read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (size + MEMORY, size + MEMORY))
    return name, run(reader, count, seed, keep=keep)


def main() -> None:
    """Command line."""
    known = readers()
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("reader", nargs="*", help=f"{', '.join(known)}; all of them by default")
    parser.add_argument("--count", type=int, default=2000, help="mutations of each [2000]")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--keep", type=Path, help="folder for the inputs that were not held")
    parser.add_argument("--again", action="store_true", help="one mutation: READER NUMBER")
    asked = parser.parse_args()
    if asked.again:
        reader = known[" ".join(asked.reader[:-1])]
        content = mutated(reader, Random(f"{asked.seed} {reader.name} {asked.reader[-1]}"))
        sys.stdout.buffer.write(content[:2000] + b"\n")
        sys.stdout.flush()
        reader.read(Source(reader.file, content or b" "))
        return
    if asked.keep is not None:
        asked.keep.mkdir(parents=True, exist_ok=True)
    tasks = [(name, asked.count, asked.seed, asked.keep) for name in asked.reader or known]
    print(
        f"{'reader':20} {'read':>7} {'refused':>8} {'slowest, s':>10} {'grown, MiB':>10}  not held"
    )
    failed = 0
    context = multiprocessing.get_context("forkserver")
    with context.Pool(asked.jobs, maxtasksperchild=1) as pool:
        for name, found in pool.imap_unordered(_bounded, tasks, chunksize=1):
            failed += len(found.held)
            print(
                f"{name:20} {found.read:7} {found.refused:8} {found.slowest:10.2f} "
                f"{found.grown / 2**20:10.0f}  {len(found.held)}",
                flush=True,
            )
            for line in found.held[:12]:
                print(f"    {line!a}", flush=True)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
