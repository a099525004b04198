"""The readers of files of ours, and of tables, surfaces and pages of others."""

import functools
import io
import json
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from benchmarks.mutations.guard import Read, Reader
from dmpcli.errors import InputError
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

SAMPLES = Path(__file__).parents[2] / "sample_runs"

_T = np.arange(24) * 0.02
_P = Provenance("record", {"seed": 1}, ({"role": "tool", "sha256": "0" * 64},), {"ended": "asked"})


def _columns(schema: schemas.Schema) -> dict[str, Any]:
    n = len(_T)
    found: dict[str, Any] = {}
    for i, (name, column) in enumerate(schema.columns.items()):
        if column.type == "string":
            alike = name == "id" and schema is not schemas.PAIRS
            found[name] = np.array([str(i // 12 if alike else i) for i in range(n)], dtype=object)
            if name == schemas.EVENT:
                found[name] = np.array(["on DO1 +0.005", None] * (n // 2), dtype=object)
        elif column.type == "int64":
            found[name] = np.arange(1, n + 1)
        else:
            found[name] = 0.1 * np.sin(_T + i)
    found["t"] = np.concatenate([_T[: n // 2], _T[: n // 2]]) if "id" in found else _T
    if "fn" in found:
        found["fn"] = np.abs(found["fn"])
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
        return f"{0.02 * i if j == 0 else 1 + i % (j + 3) + 0.2 * i * (name[0] in 'xyz'):.6g}"

    rows = [names.split()]
    rows += [[cell(i, j, name) for j, name in enumerate(rows[0])] for i in range(20)]
    return "".join(separator.join(row) + "\n" for row in rows).encode()


def _foreign_parquet() -> bytes:
    sink = io.BytesIO()
    pq.write_table(
        pa.table({"t": _T} | {name: 20.0 * _T + i for i, name in enumerate("xyz")}), sink
    )
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
    from pydantic import TypeAdapter, ValidationError

    from dmpcli.settings import layers
    from dmpcli.settings.record import RecordSettings

    try:
        text = source.content.decode("utf-8")
    except UnicodeDecodeError:
        raise InputError(f"{source.name}: is no text, which is told where it is read") from None
    _, said = layers._toml_section(source.name, text, "record")
    try:
        return TypeAdapter(RecordSettings).validate_python(said)
    except ValidationError as error:
        line = layers._first(error, RecordSettings, {}, dict.fromkeys(said, source.name))
        raise InputError(f"{source.name}: {line}") from None


def _pages(source: Source) -> object:
    try:
        netft_settings.calibration_page(source.content)
        return netft_settings.read_pages(source.content)
    except ValueError as error:  # who has fetched them says of which box
        raise InputError(f"{source.name}: {error}") from None


def _inspected(source: Source) -> object:
    from dmpcli.reporting import inspection

    found = inspection.inspected(source)
    return inspection.as_text(found, 100), inspection.as_json(found)


def _points(source: Source) -> object:
    from dmpcli.simulation import reference_strokes

    return reference_strokes.read_points(source)


Sound = tuple[Read, str, tuple[bytes, ...]]
"""How it is read, what messages call it, and sound inputs."""


def _mesh(name: str) -> Callable[[], Sound]:
    return lambda: (mesh.decode, f"a.{name.split()[0]}", _meshes()[name])


_SOUND: dict[str, Callable[[], Sound]] = {
    "demonstration": lambda: (recordings.read, "a.parquet", _parquet(schemas.DEMONSTRATION)),
    "trajectory": lambda: (
        _strokes,
        "a.parquet",
        _parquet(schemas.TRAJECTORY, normal=[0, 0, 1]),
    ),
    "run": lambda: (
        lambda s: record.decode(s, schemas.RUN),
        "a.parquet",
        _parquet(schemas.RUN),
    ),
    "pairs": lambda: (pairs.read, "a.parquet", _parquet(schemas.PAIRS)),
    "poses": lambda: (static_poses.decode, "a.parquet", _parquet(schemas.POSES)),
    "foreign parquet": lambda: (recordings.read, "a.parquet", (_foreign_parquet(),)),
    "recording csv": lambda: (
        recordings.read,
        "a.csv",
        (_csv("t x y z rx ry rz"), _csv("t x[mm] y[mm] z[mm]", ";")),
    ),
    "recording tum": lambda: (
        lambda s: recordings.read(s, LAYOUTS["tum"]),
        "a.txt",
        (_tum(),),
    ),
    "recording motive": lambda: (
        lambda s: recordings.read(s, LAYOUTS["motive"]),
        "a.csv",
        (_motive(),),
    ),
    "pairs csv": lambda: (pairs.read, "a.csv", (_csv("id x0 y0 z0 xg yg zg duration"),)),
    "keep-out csv": lambda: (lines.read, "a.csv", (_csv("id x y z"),)),
    "touched csv": lambda: (touched.read, "a.csv", (_csv("x y z rx ry rz px py pz ax ay az"),)),
    "reference csv": lambda: (_points, "a.csv", (_csv("x y z"),)),
    "table": lambda: (tables.read, "a.csv", (_csv("a b c"), _foreign_parquet())),
    "skill": lambda: (learned_skill.read, "a.json", (_skill(),)),
    "tool": lambda: (tool.decode, "a.json", _json(_TOOL)),
    "pose": lambda: (pose.decode, "a.json", _json(_POSE)),
    "surface": lambda: (surface.load, "a.json", _json(*_SURFACES)),
    "manifest": lambda: (manifest.decode, "a.json", _json(_MANIFEST)),
    "journal": lambda: (journal.read, "a.journal", (_journal(),)),
    "settings": lambda: (_settings, "a.toml", (_TOML,)),
    "sensor pages": lambda: (_pages, "page", (_API,)),
    **{name: _mesh(name) for name in ("stl", "stl text", "obj", "off", "ply", "ply binary")},
}

_APART = ("journal", "settings", "sensor pages")
"""What `inspect` does not take: journals, settings without their name, pages."""


def _every() -> Sound:
    seeds = (sound()[2] for name, sound in _SOUND.items() if name not in _APART)
    return _inspected, "a.bin", tuple(content for some in seeds for content in some)


def make(name: str, folder: Path | None = None) -> Reader:  # noqa: ARG001
    """Return a reader by its name; none of these needs a folder."""
    return Reader(name, *(_every() if name == "inspect" else _SOUND[name]()))


MAKES = {name: functools.partial(make, name) for name in (*_SOUND, "inspect")}
"""All of them, by name."""
