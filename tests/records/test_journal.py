import errno
import json
import os
import subprocess
import sys
import time

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dmpcli.errors import InputError, InstrumentError
from dmpcli.records import journal, schemas
from dmpcli.records.file_io import Source
from dmpcli.records.journal import Journal
from dmpcli.records.record import Provenance
from dmpcli.records.row_buffer import RowBuffer

GROUPS = {"t": 1, "place": 3}
KNOWN = Provenance(
    "record", {"seed": 3}, ({"role": "tool", "sha256": "ab" * 32},), {"simulated": True}
)


def add(rows, count):
    for _ in range(count):
        i = len(rows)
        place = np.array([i, 2.0 * i, np.nan if i % 7 == 0 else -i])
        rows.add((0.02 * i, place), (f"wörd{i % 3}",))


def opened(path, **changes):
    rows = RowBuffer(GROUPS, ("word",))
    return rows, Journal(path, rows, schemas.DEMONSTRATION, KNOWN)


def written(path, batches=(10, 1, 25), facts=None):
    """A journal of several batches, as its thread would write them; with an end where facts are."""
    rows, kept = opened(path)
    kept._end_thread()
    sizes = [path.stat().st_size]
    for count in batches:
        add(rows, count)
        kept._write_rows()
        sizes.append(path.stat().st_size)
    if facts is not None:
        kept.finish(facts)
    os.close(kept._file)
    return rows, path.read_bytes(), sizes


def same(found, rows, count):
    assert len(found.rows) == count
    np.testing.assert_array_equal(found.rows.whole(0, count), rows.whole(0, count))
    assert found.rows.words("word") == rows.words("word", 0, count)


def test_a_journal_gives_back_rows_and_provenance(tmp_path):
    rows, content, _ = written(tmp_path / "a.journal")
    found = journal.read(Source("a", content))
    same(found, rows, 36)
    assert found.provenance == KNOWN
    assert found.schema is schemas.DEMONSTRATION
    assert (found.whole, found.unread) == (False, 0)


def test_it_is_an_arrow_stream_that_others_can_read(tmp_path):
    rows, content, _ = written(tmp_path / "a.journal", facts={})
    table = pa.ipc.open_stream(content).read_all()
    assert table.column_names == ["t", "place", "word"]
    assert table["place"].to_pylist()[35] == [35.0, 70.0, pytest.approx(np.nan, nan_ok=True)]
    assert table["word"].to_pylist() == rows.words("word")


def test_the_end_of_a_run_is_in_its_journal(tmp_path):
    rows, content, _ = written(tmp_path / "a.journal", facts={"ended": "duration"})
    found = journal.read(Source("a", content))
    same(found, rows, 36)
    assert found.whole
    assert found.provenance.facts == {"ended": "duration"}


def test_an_end_that_is_no_json_leaves_the_rows_and_the_file_can_still_be_written(tmp_path):
    rows, content, _ = written(tmp_path / "a.journal", facts={"late": float("nan")})
    found = journal.read(Source("a", content))
    same(found, rows, 36)
    assert not found.whole


@pytest.mark.parametrize("end", [b"{", b"[]", b"\xff"])
def test_an_end_that_is_damaged_is_none(tmp_path, end):
    rows, kept = opened(tmp_path / "a.journal")
    kept._end_thread()
    add(rows, 5)
    kept._write_rows()
    nothing, _ = journal._batch(rows, 0, 0, kept._fields)
    kept._stream.write_batch(nothing, custom_metadata={b"facts": end})
    kept._put()
    os.close(kept._file)
    found = journal.read(Source("a", (tmp_path / "a.journal").read_bytes()))
    same(found, rows, 5)
    assert not found.whole
    assert found.provenance == KNOWN


@pytest.mark.parametrize("missing", ["groups", "texts", "provenance"])
@pytest.mark.parametrize("instead", [None, 7])
def test_a_head_that_lacks_something_is_named(missing, instead):
    head = {
        "version": 1,
        "schema": schemas.DEMONSTRATION.name,
        "groups": [["t", 1]],
        "texts": [],
        "provenance": {"command": "record", "options": {}, "inputs": [], "facts": {}},
    }
    head.pop(missing)
    if instead is not None:
        head[missing] = instead
    sink = pa.BufferOutputStream()
    fields = pa.schema([pa.field("t", pa.float64())]).with_metadata(
        {b"dmpcli journal": json.dumps(head).encode()}
    )
    pa.ipc.new_stream(sink, fields).close()
    with pytest.raises(InputError, match=r"a: is damaged in its head; .* cannot be read"):
        journal.read(Source("a", sink.getvalue().to_pybytes()))


@pytest.mark.slow
def test_cut_anywhere_every_whole_batch_is_recovered(tmp_path):
    rows, content, sizes = written(tmp_path / "a.journal", batches=(3, 1, 4))
    counts = np.cumsum([0, 3, 1, 4])
    for cut in range(len(content)):
        whole = counts[np.searchsorted(sizes, cut, side="right") - 1] if cut >= sizes[0] else 0
        if whole == 0:
            with pytest.raises(InputError, match=r"holds no row|within its head"):
                journal.read(Source("a", content[:cut]))
        else:
            found = journal.read(Source("a", content[:cut]))
            same(found, rows, whole)
            assert found.unread == cut - sizes[np.searchsorted(counts, whole)]


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    return written(tmp_path_factory.mktemp("sound") / "a.journal")


@pytest.mark.slow
@settings(max_examples=400)
@given(data=st.data())
def test_damage_costs_rows_but_never_changes_one(sound, data):
    """A block that the disk never wrote reads as zeros; any byte may be any other."""
    rows, content, sizes = sound
    at = data.draw(st.integers(sizes[0], len(content) - 1))
    length = data.draw(st.integers(1, 600))
    junk = data.draw(st.one_of(st.just(bytes(length)), st.binary(min_size=1, max_size=60)))
    damaged = content[:at] + junk + content[at + len(junk) :]
    try:
        found = journal.read(Source("a", damaged))
    except InputError as error:
        assert "holds no row" in str(error)
    else:
        same(found, rows, len(found.rows))


@given(head=st.binary(max_size=200))
def test_what_is_no_journal_is_named(head):
    with pytest.raises(InputError, match="is no journal"):
        journal.read(Source("a", head))


def test_a_journal_of_a_newer_version_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(journal, "VERSION", 2)
    _, content, _ = written(tmp_path / "a.journal")
    monkeypatch.setattr(journal, "VERSION", 1)
    with pytest.raises(InputError, match=r"version 2.*newer.*upgrade"):
        journal.read(Source("a", content))


def test_a_journal_that_is_there_is_never_overwritten(tmp_path):
    path = tmp_path / "a.journal"
    _, content, _ = written(path)
    with pytest.raises(InputError, match="dmpcli recover"):
        opened(path)
    assert path.read_bytes() == content


def test_a_journal_that_is_being_written_is_left_alone(tmp_path):
    path = tmp_path / "a.journal"
    _, kept = opened(path)
    try:
        with pytest.raises(InputError, match="another dmpcli is writing it"):
            opened(path)
        with pytest.raises(InputError, match="still being written"):
            journal.read(Source(str(path), path.read_bytes()))
    finally:
        kept.discard()
    assert not path.exists()


def test_the_thread_writes_by_itself(tmp_path):
    path = tmp_path / "a.journal"
    rows, kept = opened(path)
    empty = path.stat().st_size
    add(rows, 100)
    for _ in range(1000):
        if path.stat().st_size > empty:
            break
        time.sleep(0.02)
    content = path.read_bytes()
    kept.discard()
    same(journal.read(Source("a", content)), rows, 100)


def test_a_full_disk_is_a_hindrance_and_what_was_written_stays(tmp_path, monkeypatch):
    path = tmp_path / "a.journal"
    rows, kept = opened(path)
    kept._end_thread()
    add(rows, 10)
    kept._write_rows()
    assert kept.hindrance() is None
    full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    write = os.write

    def half(file, content):
        if len(content) < 100:
            raise full
        return write(file, content[: len(content) // 2])

    monkeypatch.setattr(os, "write", half)
    add(rows, 10)
    kept.finish({"ended": "duration"})
    hindrance = kept.hindrance()
    assert isinstance(hindrance, InstrumentError)
    assert "No space left on device" in str(hindrance)
    os.close(kept._file)
    found = journal.read(Source("a", path.read_bytes()))
    same(found, rows, 10)
    assert found.unread > 0


def test_a_disk_that_hangs_is_a_hindrance(tmp_path):
    _, kept = opened(tmp_path / "a.journal")
    kept._since = time.monotonic() - 2.0 * journal.LONGEST_BEHIND
    assert "has not taken the journal" in str(kept.hindrance())
    kept.discard()


def test_a_folder_that_takes_no_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"none.*cannot be written"):
        opened(tmp_path / "none" / "a.journal")


@pytest.mark.parametrize("output", ["-", "/dev/null", "/"])
def test_what_is_not_a_named_file_has_no_journal(output):
    assert journal.beside(output) is None


def test_the_header_holds_no_place_and_no_time(tmp_path):
    _, content, _ = written(tmp_path / "a.journal")
    header = json.loads(pa.ipc.open_stream(content).schema.metadata[b"dmpcli journal"])
    assert set(header) == {"version", "schema", "groups", "texts", "provenance"}
    assert str(tmp_path).encode() not in content


@pytest.mark.slow
def test_it_is_written_without_pandas():
    code = (
        "import sys, pathlib, tempfile;"
        "from dmpcli.records import journal, row_buffer, record, schemas;"
        "d = tempfile.TemporaryDirectory(); r = row_buffer.RowBuffer({'t': 1}, ('w',));"
        "j = journal.Journal(pathlib.Path(d.name) / 'j', r, schemas.RUN, record.Provenance('x'));"
        "r.add((1.0,), ('a',)); j.finish({}); j.discard(); print('pandas' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True)
    assert done.stdout.strip() == b"False"
