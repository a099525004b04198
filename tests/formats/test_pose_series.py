"""Recordings of any length: in blocks, by time, and the same as if all were in memory."""

import io

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from dmpcli.errors import InputError
from dmpcli.formats import pose_series
from dmpcli.formats.pose_series import PoseBlocks, Series
from dmpcli.records import record
from dmpcli.workflows.import_file import demonstrations


def rows_of(count, seed=0):
    rng = np.random.default_rng(seed)
    s = np.linspace(0.0, 1.0, count)
    # Past straight down and through ry = 90 degrees, with full turns on the way.
    R = Rotation.from_euler("xyz", np.column_stack([np.pi + 9 * s, 4 * s, 15 * s]))
    place = np.column_stack([s, np.sin(9 * s), 0.1 * np.cos(7 * s)])
    return np.hstack([place, R.as_quat()]), rng.normal(size=(count, 6))


def series(stamps, rows, frame="base"):
    made = Series(rows.shape[1], frame)
    for stamp, row in zip(stamps, rows.tolist(), strict=True):
        made.add(int(stamp), tuple(row))
    return made


@settings(max_examples=40, deadline=None)
@given(
    stamps=st.lists(st.integers(0, 400), min_size=2, max_size=200),
    held=st.integers(1, 60),
    size=st.integers(1, 90),
    far=st.sampled_from([0, 4]),
)
def test_blocks_are_the_rows_by_time_each_stamp_once_wherever_they_lie(stamps, held, size, far):
    rows, _ = rows_of(len(stamps))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pose_series, "_HELD", held)
        patch.setattr(pose_series, "_FAR", far)
        found = PoseBlocks(series([1000 * s for s in stamps], rows))
        parts = list(found.blocks(size))
    first = {s: i for i, s in reversed(list(enumerate(stamps)))}
    kept = [first[s] for s in sorted(first)]
    np.testing.assert_allclose(
        np.concatenate([part.t for part in parts]), [s * 1e-6 for s in sorted(first)], atol=1e-15
    )
    np.testing.assert_array_equal(
        np.concatenate([part.position for part in parts]), rows[kept, :3] * 1000.0
    )
    assert found.repeated == len(stamps) - len(kept)
    assert all(len(part) <= size for part in parts)


def test_the_wrench_of_a_block_is_that_of_the_whole(monkeypatch):
    monkeypatch.setattr(pose_series, "_HELD", 16)
    rows, felt = rows_of(150)
    at = np.arange(150) * 1_000_000
    own = np.linspace(-3_000_000, 200_000_000, 70).astype(int)
    found = PoseBlocks(series(at, rows), series(own, felt[:70]))
    parts = np.concatenate([part.wrench for part in found.blocks(11)])
    plain = [np.interp((at - own[0]) * 1e-9, (own - own[0]) * 1e-9, c) for c in felt[:70].T]
    np.testing.assert_array_equal(parts, np.column_stack(plain))
    np.testing.assert_array_equal(parts, found.whole().wrench)


def test_the_first_bad_row_is_named_wherever_it_lies(monkeypatch):
    monkeypatch.setattr(pose_series, "_HELD", 10)
    for bad in (3, 25, 39):
        rows, _ = rows_of(40)
        rows[bad, 4] = np.nan
        rows[39, 0] = np.inf
        made = series(np.arange(40), rows)
        assert made.judged()[0] == bad
    rows, _ = rows_of(40)
    rows[12, 3:] *= 2.0
    assert series(np.arange(40), rows).judged() == (12, "the quaternion has norm 2, not 1")


def test_a_full_disk_is_told_with_the_folder_that_can_be_changed(monkeypatch):
    monkeypatch.setattr(pose_series, "_HELD", 4)

    def full():
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(pose_series.tempfile, "TemporaryFile", full)
    with pytest.raises(InputError, match=r"No space left.*TMPDIR"):
        series(np.arange(9), rows_of(9)[0])


def test_a_file_in_groups_holds_what_a_file_in_one_does_and_a_single_group_its_bytes(monkeypatch):
    rows, felt = rows_of(300)
    at = np.arange(300) * 1_000_000
    found = PoseBlocks(series(at, rows), series(at, felt))

    def written(size):
        monkeypatch.setattr(PoseBlocks.blocks, "__defaults__", (size,))
        sink = io.BytesIO()
        record.store_groups(demonstrations(found, (), {}, "a"), sink)
        return sink.getvalue()

    one, many = written(1000), written(64)
    files = [pq.ParquetFile(io.BytesIO(content)) for content in (one, many)]
    assert [file.num_row_groups for file in files] == [1, 5]
    first, second = (file.read() for file in files)
    for name in first.column_names:
        np.testing.assert_allclose(second[name], first[name], atol=1e-12)
    [whole] = demonstrations(found.whole(), (), {}, "a")
    assert one == record.encode(whole)
    plain = pa.BufferOutputStream()
    pq.write_table(
        first, plain, compression="zstd", use_byte_stream_split=first.column_names,
        use_dictionary=[], write_page_checksum=True,
    )  # fmt: skip
    assert pq.read_table(pa.BufferReader(plain.getvalue())).equals(first)
    assert len(plain.getvalue()) == len(one)
