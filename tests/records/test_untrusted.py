"""Bytes that others wrote end as one line with their name; our own defects do not hide there."""

import io
import json
import time

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from dmpcli.cli import app
from dmpcli.errors import InputError
from dmpcli.records import (
    journal,
    json_files,
    manifest,
    parquet,
    record,
    recordings,
    schemas,
    static_poses,
    tables,
    untrusted,
)
from dmpcli.records.file_io import Source
from dmpcli.records.record import Form, Provenance, Record
from dmpcli.settings.layers import resolve
from dmpcli.settings.record import RecordSettings

T = np.arange(200) * 0.02
DRAWN = Record(
    schemas.DEMONSTRATION,
    {"t": T, "x": np.sin(T), "y": T, "z": T * 0.0},
    Provenance("record", {"seed": 1}),
)


def written(table, **how):
    sink = io.BytesIO()
    pq.write_table(table, sink, **how)
    return sink.getvalue()


def test_what_a_decoder_did_not_foresee_is_the_files_fault():
    @untrusted.decoder
    def read(source):
        return [][len(source.content)]

    with pytest.raises(
        InputError, match=r"a\.csv: cannot be read \(IndexError: list index"
    ) as told:
        read(Source("a.csv", b"x"))
    assert isinstance(told.value.__cause__, IndexError)
    with (
        pytest.raises(InputError, match=r"a: its head needs more memory than there is"),
        untrusted.decoding("a", "its head"),
    ):
        raise MemoryError
    with pytest.raises(InputError, match=r"a: line 3"), untrusted.decoding("b"):
        raise InputError("a: line 3: is wrong")
    with pytest.raises(KeyboardInterrupt), untrusted.decoding("b"):
        raise KeyboardInterrupt


@pytest.mark.parametrize("where", ["outside", "in a reader"])
def test_a_defect_outside_of_a_reader_keeps_its_traceback_and_exit_code_1(
    where, tmp_path, monkeypatch
):
    from dmpcli.workflows import fit

    def planted(*_, **__):
        return 1 / 0

    (tmp_path / "a.parquet").write_bytes(record.encode(DRAWN))
    if where == "outside":
        monkeypatch.setattr(fit, "fit", planted)
    else:
        monkeypatch.setattr(record, "columns_of", planted)
    words = ["fit", str(tmp_path / "a.parquet"), "-o", str(tmp_path / "skill.json")]
    result = CliRunner().invoke(app, words)
    if where == "outside":
        assert isinstance(result.exception, ZeroDivisionError)
        assert result.exit_code == 1
    else:
        assert result.exit_code == 2
        assert "a.parquet: cannot be read (ZeroDivisionError" in result.stderr


@pytest.mark.slow
def test_a_small_file_that_would_fill_the_memory_is_refused_before_it_does():
    rows = 20_000_000
    zeros = pa.Array.from_buffers(pa.float64(), rows, [None, pa.py_buffer(bytes(8 * rows))])
    content = written(pa.table(dict.fromkeys("txyz", zeros)))
    assert len(content) < 1_000_000
    before = pa.total_allocated_bytes()
    for read in (recordings.read, tables.read, record.decode):
        with pytest.raises(InputError, match=r"MiB of memory, more than the 384 MiB") as told:
            read(Source("a.parquet", content))
        assert "a.parquet" in str(told.value)
    assert pa.total_allocated_bytes() - before < 1 << 20


def test_a_dictionary_cannot_blow_its_text_up():
    words = pa.DictionaryArray.from_arrays(
        pa.array(np.zeros(100_000, np.int32)), pa.array(["x" * 100_000])
    )
    content = written(pa.table({"id": words}))
    with pytest.raises(InputError, match="MiB of memory, more than"):
        tables.read(Source("a.parquet", content))


@pytest.mark.thorough
def test_a_table_of_many_columns_is_refused_at_once():
    header = ",".join(f"c{i}" for i in range(100_000))
    begin = time.monotonic()
    with pytest.raises(InputError, match="100,000 columns, more than the 10,000"):
        tables.read(Source("a.csv", f"{header}\n{header}\n".encode()))
    wide = written(pa.table({f"c{i}": pa.array([1.0]) for i in range(20_000)}))
    with pytest.raises(InputError, match="20,000 columns, more than the 10,000"):
        tables.read(Source("a.parquet", wide))
    assert time.monotonic() - begin < 30.0  # it hung for 90 s; no measure of speed


def test_a_column_twice_is_named():
    table = pa.Table.from_arrays([pa.array([1.0]), pa.array([2.0])], names=["x", "x"])
    with pytest.raises(InputError, match=r"a\.parquet: column 'x' is there twice"):
        tables.read(Source("a.parquet", written(table)))


DEEP = b"[" * 100_000 + b"]" * 100_000


@pytest.mark.parametrize(
    "content", [DEEP, b'{"schema": ' + DEEP + b"}", b'{"a":' * 50_000 + b"1" + b"}" * 50_000]
)
def test_deep_json_is_one_line(content):
    with pytest.raises(InputError, match=r"^a\.json: "):
        manifest.decode(Source("a.json", content))
    table = pa.table({"t": [1.0]}).replace_schema_metadata({record.KEY: content})
    with pytest.raises(InputError, match="metadata are damaged"):
        record.decode(Source("a.parquet", written(table)))


def test_json_of_many_objects_is_refused_before_they_are_made():
    content = b'{"a": [' + b"[]," * 12_000_000 + b"[]]}"
    with pytest.raises(InputError, match="MiB that are read of a JSON file"):
        json_files.json_document(Source("a.json", content))


@pytest.mark.parametrize(
    "text",
    [
        "[record]\nmass = " + "9" * 5000,
        "[record]\nmass = " + "[" * 5000,
        "[record]\n" + ".".join(["a"] * 50_000) + " = 1",
        "[record]\nx = {" + ".".join(["a"] * 50_000) + " = 1}",
        "[record]\nx = " + "{a = " * 5000,
        "[record]\nx = 0000-00-00",
        "[record]\nmass = 1e999999",
    ],
)
def test_toml_that_its_parser_trips_over_is_one_line(text, tmp_path):
    file = tmp_path / "a.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"a\.toml"):
        resolve(RecordSettings, {}, None, file)


def test_a_file_of_settings_has_an_end(tmp_path):
    file = tmp_path / "a.toml"
    file.write_bytes(b"#" * 1_000_000)
    with pytest.raises(InputError, match="no file of settings"):
        resolve(RecordSettings, {}, None, file)


@pytest.mark.parametrize("width", [0, -1, 2**40, "9" * 5000, None])
def test_a_journals_head_takes_no_memory_that_no_run_needs(width):
    head = {"version": 1, "schema": "demonstration", "groups": [["t", width]], "texts": []}
    head["provenance"] = {"command": "record", "options": {}, "inputs": [], "facts": {}}
    sink, fields = io.BytesIO(), pa.schema([pa.field("t", pa.float64())])
    text = json.dumps(head).encode()
    with pa.ipc.new_stream(sink, fields.with_metadata({b"dmpcli journal": text})):
        pass
    with pytest.raises(InputError, match=r"a\.journal: "):
        journal.read(Source("a.journal", sink.getvalue()))


def test_a_damaged_page_is_told_by_its_checksum():
    """Without compression nothing else would tell that numbers are not those that were written."""
    content = record.encode(DRAWN, Form(compression="none"))
    x = DRAWN.columns["x"]
    split = np.frombuffer(x.tobytes(), np.uint8).reshape(-1, 8).T.tobytes()
    at = content.index(split)
    for shift in (0, 700, 1599):
        damaged = bytearray(content)
        damaged[at + shift] ^= 1
        with pytest.raises(InputError, match=r"a\.parquet: .*damaged"):
            record.decode(Source("a.parquet", bytes(damaged)))
    back = record.decode(Source("a.parquet", content))
    assert back.columns["x"].tobytes() == x.tobytes()


def test_files_without_checksums_are_read_as_before():
    ours = parquet.table(Source("a", record.encode(DRAWN)))
    plain = Source("a.parquet", written(ours, write_page_checksum=False))
    back = record.decode(plain)
    for name, column in DRAWN.columns.items():
        assert back.columns[name].tobytes() == column.tobytes()
    assert back.provenance == DRAWN.provenance


def test_many_poses_are_read_in_one_pass():
    """Once it took a copy of all positions for each pose."""
    n = 20_000
    rows = {name: np.linspace(0.0, 1.0, n) for name in ("t", "x", "y", "z", "rx", "ry", "rz")}
    rows |= {f"{name}_raw": rows["t"] for name in schemas.WRENCH}
    rows["samples"] = np.ones(n, np.int64)
    content = record.encode(Record(schemas.POSES, rows, Provenance("calibrate")))
    poses, _ = static_poses.decode(Source("a", content))
    assert poses[-1].position.tolist() == [1.0, 1.0, 1.0]
