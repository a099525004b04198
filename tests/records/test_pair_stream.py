"""A table that is read in pieces says what it says when it is read whole."""

import io
from dataclasses import replace
from itertools import chain

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dmpcli.errors import InputError
from dmpcli.records import file_io, pair_stream, pairs
from dmpcli.records.table_shares import ChosenRows, Share

HEADER = "id,x0,y0,z0,xg,yg,zg,surface,colour"


@pytest.fixture(autouse=True)
def short(monkeypatch):
    monkeypatch.setattr(pair_stream, "STREAMED", 0)
    monkeypatch.setattr(pair_stream, "STREAMED_ROWS", 0)
    monkeypatch.setattr(pair_stream, "_BLOCK", 37)


def lines_of(count):
    return [f"k{i},{i},2,3,4,{i}.5,6,part{i % 3}.stl,red" for i in range(count)]


def write(path, lines, end="\n"):
    path.write_bytes((end.join([HEADER, *lines]) + end).encode())
    return path


def joined(path, rows):
    stream = pair_stream.opened(path)
    assert stream.sha256 == file_io.read(path).sha256
    stream.check_ids(rows)
    return list(stream.pieces(rows))


def same(path, rows):
    whole, pieces = pairs.read(file_io.read(path)), joined(path, rows)
    assert [len(one) for one in pieces[:-1]] == [rows] * (len(pieces) - 1)
    assert list(chain(*(one.ids for one in pieces))) == whole.ids
    assert list(chain(*(one.status for one in pieces))) == whole.status
    start = np.concatenate([one.pairs.start for one in pieces])
    np.testing.assert_array_equal(start, whole.pairs.start)
    row = 0
    for one in pieces:
        assert one.unknown == whole.unknown
        for i in range(len(one)):
            assert one.place(i) == whole.place(row)
            mine = one.places.places[one.places.of[i]]
            assert mine == whole.places.places[whole.places.of[row]]
            row += 1


@pytest.mark.slow
@settings(deadline=None, max_examples=25)
@given(count=st.integers(1, 12), rows=st.integers(1, 5), data=st.data())
def test_pieces_are_the_table_whatever_stands_between_its_rows(tmp_path_factory, count, rows, data):
    lines = lines_of(count)
    for _ in range(data.draw(st.integers(0, 6))):
        odd = data.draw(st.sampled_from(["", "# a comment", "   ", "k,1,nan,3,4,5,6,,"]))
        at = data.draw(st.integers(0, len(lines)))
        lines.insert(at, odd.replace("k,", f"odd{len(lines)},"))
    end = data.draw(st.sampled_from(["\n", "\r\n"]))
    same(write(tmp_path_factory.mktemp("t") / "p.csv", lines, end), rows)


def test_parquet_tables_likewise(tmp_path):
    table = pa.csv.read_csv(io.BytesIO("\n".join([HEADER, *lines_of(11)]).encode()))
    pq.write_table(table, tmp_path / "p.parquet", row_group_size=4)
    for rows in (1, 3, 5, 11, 20):
        same(tmp_path / "p.parquet", rows)


def test_rows_without_ids_are_numbered_through(tmp_path):
    lines = [line.partition(",")[2] for line in lines_of(5)]
    (tmp_path / "p.csv").write_text("\n".join([HEADER.partition(",")[2], *lines]) + "\n")
    ids = chain(*(one.ids for one in joined(tmp_path / "p.csv", 2)))
    assert list(ids) == list("12345")


def test_two_rows_of_one_id_are_told_wherever_they_stand(tmp_path):
    lines = lines_of(9)
    lines[7] = lines[7].replace("k7", "k1")
    with pytest.raises(InputError, match=r"'id', line 9: 'k1' is also in line 3; ids must differ"):
        joined(write(tmp_path / "p.csv", lines), 3)


def test_a_line_of_another_length_is_told_by_its_number_in_the_file(tmp_path):
    lines = lines_of(9)
    lines[6] += ",1"
    with pytest.raises(InputError, match="line 8 has 10 columns"):
        joined(write(tmp_path / "p.csv", lines), 2)


def test_quoted_cells_and_old_line_ends_are_read_whole(tmp_path):
    quoted = lines_of(3)
    quoted[1] = quoted[1].replace("red", '"red\nor blue"')
    assert pair_stream.opened(write(tmp_path / "q.csv", quoted)) is None
    assert pair_stream.opened(write(tmp_path / "r.csv", lines_of(3), "\r")) is None


def test_short_tables_are_read_whole(tmp_path, monkeypatch):
    monkeypatch.setattr(pair_stream, "STREAMED", 1000)
    assert pair_stream.opened(write(tmp_path / "p.csv", lines_of(3))) is None


def share_of(path, size, index, count):
    share = Share(size, lambda part: part % count == index)
    return replace(pair_stream.opened(path), share=share)


def same_share(path, rows, size, index, count):
    whole = pairs.read(file_io.read(path))
    ours = [row for row in range(len(whole)) if row // size % count == index]
    pieces = list(share_of(path, size, index, count).pieces(rows))
    assert [len(one) for one in pieces[:-1]] == [rows] * (len(pieces) - 1)
    assert [row for one in pieces for row in one.numbers.tolist()] == ours
    assert list(chain(*(one.ids for one in pieces))) == [whole.ids[row] for row in ours]
    assert list(chain(*(one.status for one in pieces))) == [whole.status[row] for row in ours]
    start = np.concatenate([np.empty((0, 3)), *(one.pairs.start for one in pieces)])
    np.testing.assert_array_equal(start, whole.pairs.start[ours])
    places = [one.place(i) for one in pieces for i in range(len(one))]
    assert places == [whole.place(row) for row in ours]


def with_odd_lines(lines):
    found = []
    for i, line in enumerate(lines):
        found += [["# a comment", "", "  ", "k,1,nan,3,4,5,6,,"][i % 4]] if i % 3 == 0 else []
        found.append(line)
    return [line.replace("k,", f"odd{i},") for i, line in enumerate(found)]


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize(("size", "count"), [(1, 2), (2, 3), (3, 2), (5, 4), (30, 2)])
def test_a_share_of_a_text_is_its_rows_of_the_whole(tmp_path, end, size, count):
    path = write(tmp_path / "p.csv", with_odd_lines(lines_of(20)), end)
    for index in range(count):
        same_share(path, 2 * size, size, index, count)


@pytest.mark.parametrize("group", [1, 3, 4, 7, 100])
@pytest.mark.parametrize(("size", "count"), [(1, 2), (2, 3), (3, 2), (30, 2)])
def test_a_share_of_parquet_is_its_rows_whatever_its_row_groups(tmp_path, group, size, count):
    table = pa.csv.read_csv(io.BytesIO("\n".join([HEADER, *lines_of(23)]).encode()))
    pq.write_table(table.drop_columns(["id"]), tmp_path / "p.parquet", row_group_size=group)
    for index in range(count):
        same_share(tmp_path / "p.parquet", 2 * size, size, index, count)


def test_row_groups_without_a_row_of_the_share_are_not_read(tmp_path):
    path = tmp_path / "p.parquet"
    table = pa.csv.read_csv(io.BytesIO("\n".join([HEADER, *lines_of(12)]).encode()))
    pq.write_table(table, path, row_group_size=4, write_page_checksum=True)
    column = pq.read_metadata(path).row_group(1).column(1)
    content = bytearray(path.read_bytes())
    begin = column.dictionary_page_offset or column.data_page_offset
    for i in range(begin, begin + column.total_compressed_size):
        content[i] ^= 0xFF
    path.write_bytes(content)
    with pytest.raises(InputError):
        list(pair_stream.opened(path).pieces(4))
    rows = [one.numbers.tolist() for one in share_of(path, 4, 0, 2).pieces(4)]
    assert rows == [[0, 1, 2, 3], [8, 9, 10, 11]]


def test_lines_of_others_are_counted_not_parted_and_messages_name_the_files_lines(tmp_path):
    lines = lines_of(12)
    lines[6] += ",1"
    path = write(tmp_path / "p.csv", ["# a comment", *lines])
    assert [len(one) for one in share_of(path, 2, 0, 2).pieces(2)] == [2, 2, 2]
    lines[9] += ",1"
    path = write(tmp_path / "p.csv", ["# a comment", *lines])
    with pytest.raises(InputError, match="line 12 has 10 columns"):
        list(share_of(path, 2, 0, 4).pieces(2))


@given(st.data())
def test_chosen_rows_are_told_like_those_of_a_share_and_groups_stay_together(data):
    numbers = np.flatnonzero(data.draw(st.lists(st.booleans(), min_size=1, max_size=60)))
    groups, left = [], len(numbers)
    while left:
        groups.append(data.draw(st.integers(0, min(left, 7))))
        left -= groups[-1]
    chosen = ChosenRows(numbers, groups)
    begin, end = sorted(data.draw(st.tuples(st.integers(0, 60), st.integers(0, 60))))
    here = [n for n in numbers.tolist() if begin <= n < end]
    assert chosen.rows(begin, end).tolist() == here
    assert chosen.count(end) - chosen.count(begin) == len(here)
    sizes, taken, ends = chosen.pieces(8), 0, {0, *np.cumsum(groups).tolist()}
    while taken < len(numbers):
        size = next(sizes)
        assert 0 < size <= 8
        taken += size
        assert taken >= len(numbers) or taken in ends
