"""Parquet records: exact round trips, stable bytes, and every way a file can be wrong."""

import json

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.errors import InputError
from dmpcli.records import record, schemas
from dmpcli.records.columns import LARGEST
from dmpcli.records.file_io import Source
from dmpcli.records.record import Provenance, Record


def demonstration(rows=12, **extra):
    t = np.arange(rows) * 0.02
    columns = {"t": t, "x": t * 3.0, "y": -t, "z": t * 0 + 1e-17} | extra
    provenance = Provenance("record", {"seed": 3}, ({"role": "tool", "sha256": "0" * 64},))
    return Record(schemas.DEMONSTRATION, columns, provenance)


def table_source(table):
    sink = pa.BufferOutputStream()
    pq.write_table(table, sink)
    return Source("bad.parquet", bytes(sink.getvalue().to_pybytes()))


def with_header(columns, **header):
    base = {"schema": "demonstration", "version": 1, "tool": "0", "command": "record"}
    table = pa.table(columns)
    return table.replace_schema_metadata({"dmpcli": json.dumps(base | header)})


@pytest.mark.slow
@given(st.lists(st.none() | st.text()))
def test_texts_round_trip_whatever_their_letters(values):
    column = record._arrow(values, pa.string())
    column.validate(full=True)
    assert column.to_pylist() == values


@pytest.mark.slow
@given(st.lists(st.floats(-LARGEST, LARGEST), min_size=1, max_size=30))
def test_floats_round_trip_exactly(values):
    x = np.array(values)
    source = Source("a", record.encode(demonstration(len(x), x=x)))
    np.testing.assert_array_equal(record.decode(source).columns["x"], x)


def test_the_same_record_gives_the_same_bytes():
    assert record.encode(demonstration()) == record.encode(demonstration())


def test_provenance_round_trips_and_says_frame_and_euler_order():
    found = record.decode(Source("a", record.encode(demonstration())))
    assert found.provenance == demonstration().provenance
    header = json.loads(
        pq.read_schema(Source("a", record.encode(found)).open()).metadata[b"dmpcli"]
    )
    assert header["frame"] == "robot base"
    assert "X-Y-Z intrinsic" in header["euler"]
    assert not {"time", "host", "path", "user"} & set(header)


def test_every_field_carries_its_unit():
    schema = pq.read_schema(Source("a", record.encode(demonstration())).open())
    assert schema.field("x").metadata[b"unit"] == b"mm"
    assert schema.field("t").metadata[b"unit"] == b"s"
    for kind in schemas.SCHEMAS.values():
        assert all(column.unit for column in kind.columns.values())


@pytest.mark.slow
@given(st.lists(st.tuples(st.text(max_size=4), st.integers(0, 3)), min_size=1, max_size=20))
def test_repeated_texts_are_those_of_a_plain_loop(words):
    texts, counts = zip(*words, strict=True)
    found = record.repeated(texts, counts)
    found.validate(full=True)
    assert found.to_pylist() == [text for text, count in words for _ in range(count)]
    assert record.repeated(texts, 2).to_pylist() == [text for text in texts for _ in range(2)]


def test_opposite_infinities_are_no_nulls():
    column = record._arrow(np.array([np.inf, 1.0, -np.inf]), pa.float64())
    assert column.to_pylist() == [np.inf, 1.0, -np.inf]
    assert column.null_count == 0


def test_missing_orientation_stays_missing_and_nan_is_stored_as_null():
    rx = np.full(12, np.nan)
    found = record.decode(Source("a", record.encode(demonstration(rx=rx, ry=rx, rz=rx))))
    assert found.rotation() is None
    table = pq.read_table(Source("a", record.encode(demonstration(rx=rx))).open())
    assert table.column("rx").null_count == 12


@pytest.mark.parametrize("keep", [0.0, 0.2, 0.6, 0.99])
def test_a_truncated_file_is_named(keep):
    content = record.encode(demonstration())
    with pytest.raises(InputError, match=r"cut\.parquet: is not a Parquet file, or it is trunc"):
        record.decode(Source("cut.parquet", content[: int(keep * len(content))]))


@pytest.mark.slow
@given(st.integers(0, 10_000), st.integers(1, 255))
def test_a_flipped_byte_never_ends_in_a_traceback(position, flip):
    content = bytearray(record.encode(demonstration()))
    content[position % len(content)] ^= flip
    try:
        record.decode(Source("flipped.parquet", bytes(content)))
    except InputError as error:
        assert "flipped.parquet" in str(error)


@given(st.binary(max_size=200))
def test_any_bytes_are_refused_by_name(content):
    with pytest.raises(InputError, match="noise"):
        record.decode(Source("noise", content))


NUMBERS = {"t": [0.0, 1.0], "x": [0.0, 1.0], "y": [0.0, 1.0], "z": [0.0, 1.0]}


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (pa.table(NUMBERS), "not written by dmpcli"),
        (with_header(NUMBERS, schema="trajectory"), "is a trajectory file, a demonstration"),
        (with_header(NUMBERS, schema="poem"), "unknown schema 'poem'"),
        (with_header(NUMBERS, version=2), "version 2 is newer than this program's"),
        (with_header({k: v for k, v in NUMBERS.items() if k != "y"}), "column 'y' is missing"),
        (with_header(NUMBERS | {"x": ["one", "two"]}), "column 'x' holds string, numbers"),
        (with_header(NUMBERS | {"x": [0.0, None]}), "column 'x', row 2: no value"),
        (with_header(NUMBERS | {"z": [float("inf"), 0.0]}), "column 'z', row 1: inf is not"),
        (with_header(NUMBERS | {"y": [0.0, float("nan")]}), "column 'y', row 2: nan is not"),
        (with_header({k: pa.array([], pa.float64()) for k in NUMBERS}), "holds no rows"),
        (with_header(NUMBERS).replace_schema_metadata({"dmpcli": "{"}), "metadata are damaged"),
        (with_header(NUMBERS, version=True), "metadata are damaged"),
        (with_header(NUMBERS, options=[]), "metadata are damaged"),
        (with_header(NUMBERS, inputs=3), "metadata are damaged"),
        (with_header(NUMBERS, facts=[1]), "metadata are damaged"),
        (with_header(NUMBERS, facts={"normal": [0, 1]}), "metadata are damaged"),
        (with_header(NUMBERS, facts={"start": "x"}), "metadata are damaged"),
        (with_header(NUMBERS, facts={"tau": "soon"}), "metadata are damaged"),
        (with_header(NUMBERS, facts={"end_heights": [8.0]}), "metadata are damaged"),
        (with_header(NUMBERS, facts={"beyond_tolerance": {"rms": 1.0}}), "metadata are damaged"),
        (with_header(NUMBERS, facts={"over_surface": 2.0}), "metadata are damaged"),
    ],
)
def test_what_is_wrong_is_named_with_column_and_row(table, message):
    with pytest.raises(InputError, match=message) as caught:
        record.decode(table_source(table), schemas.DEMONSTRATION)
    assert str(caught.value).startswith("bad.parquet")


def test_parts_that_are_not_ours_are_found_in_a_folder(tmp_path):
    (tmp_path / "part-00000.parquet").write_bytes(record.encode(demonstration()))
    assert record.foreign_parts(tmp_path) == []
    pq.write_table(pa.table(NUMBERS), tmp_path / "part-00001.parquet")
    (tmp_path / "pairs.parquet").write_bytes(b"notes")
    (tmp_path / "other.txt").write_bytes(b"notes")
    assert record.foreign_parts(tmp_path) == ["pairs.parquet", "part-00001.parquet"]
