"""A table that is drawn a piece at a time gives the parts of one that is drawn whole."""

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq
import pytest

from dmpcli.records import pair_stream
from tests.batch.test_run import content, run, write_pairs
from tests.batch.test_run import learned as learned

SKIP = ("--on-error", "skip")
PLANE = '{"point": [0, 0, 0], "normal": [0, 0, 1]}'


@pytest.fixture
def in_pieces(monkeypatch):
    monkeypatch.setattr(pair_stream, "STREAMED", 0)
    monkeypatch.setattr(pair_stream, "ROWS", 100)


@pytest.mark.slow
@pytest.mark.parametrize("options", [(), ("--jobs", 2)])
def test_parts_and_manifest_are_the_same_and_the_table_grows(
    learned, tmp_path, monkeypatch, options
):
    table = write_pairs(tmp_path / "p.csv", 230, bad=(60, 229))
    run(learned, tmp_path / "whole", table, *SKIP)
    monkeypatch.setattr(pair_stream, "STREAMED", 0)
    monkeypatch.setattr(pair_stream, "ROWS", 100)
    told = run(learned, tmp_path / "pieces", table, *SKIP, *options)
    whole, pieces = content(tmp_path / "whole"), content(tmp_path / "pieces")
    assert whole.keys() == pieces.keys()
    for name in whole.keys() - {"pairs.parquet"}:
        assert whole[name] == pieces[name], name
    grown = tmp_path / "pieces" / "pairs.parquet"
    assert pq.read_table(grown).equals(pq.read_table(tmp_path / "whole" / "pairs.parquet"))
    assert pq.read_metadata(grown).num_row_groups == 3
    assert told.count("skipped: line") == 2
    assert "228 strokes drawn, 2 pairs skipped" in told


@pytest.mark.slow
def test_shards_and_a_stopped_run_go_on(learned, tmp_path, in_pieces):
    table = write_pairs(tmp_path / "p.csv", 230, bad=(60,))
    run(learned, tmp_path / "one", table, *SKIP)
    run(learned, tmp_path / "b", table, *SKIP, "--shard", "2/3")
    (tmp_path / "b" / ".pairs.parquet.0f.tmp").write_bytes(b"half")
    (tmp_path / "b" / "part-00009.parquet").write_bytes(
        content(tmp_path / "one")["part-00001.parquet"]
    )
    assert "2 of 5 parts were there already" in run(learned, tmp_path / "b", table, *SKIP)
    assert content(tmp_path / "b") == content(tmp_path / "one")


@pytest.mark.slow
def test_a_bad_pair_in_the_last_piece_stops_before_anything_is_written(
    learned, tmp_path, in_pieces
):
    table = write_pairs(tmp_path / "p.csv", 230, bad=(229,))
    assert "line 231" in run(learned, tmp_path / "b", table, code=2)
    assert not (tmp_path / "b").exists()


def parts_of(folder):
    return {name: bytes_ for name, bytes_ in content(folder).items() if name.startswith("part-")}


@pytest.mark.slow
@pytest.mark.parametrize("groups", [None, 10, 70, 1000])
def test_shards_draw_the_parts_of_the_whole_whatever_the_tables_row_groups(
    learned, tmp_path, monkeypatch, groups
):
    monkeypatch.setattr(pair_stream, "STREAMED_ROWS", 0)
    monkeypatch.setattr(pair_stream, "STREAMED", 0)
    monkeypatch.setattr(pair_stream, "ROWS", 100)
    table = write_pairs(tmp_path / "p.csv", 330, bad=(60, 329))
    if groups is not None:
        cells = pyarrow.csv.read_csv(table)
        table = tmp_path / "p.parquet"
        pq.write_table(cells, table, row_group_size=groups)
    run(learned, tmp_path / "whole", table, *SKIP)
    for shard in ("1/9", "2/3", "1/3", "3/3"):  # the last of nine has no part
        run(learned, tmp_path / "b", table, *SKIP, "--shard", shard)
    assert parts_of(tmp_path / "b") == parts_of(tmp_path / "whole")
    told = run(learned, tmp_path / "b", table, *SKIP)
    assert "7 of 7 parts were there already" in told
    assert content(tmp_path / "b") == content(tmp_path / "whole")


@pytest.mark.slow
def test_a_shard_checks_its_own_rows_and_the_last_run_all(learned, tmp_path, in_pieces):
    table = write_pairs(tmp_path / "p.csv", 230, bad=(120,))
    run(learned, tmp_path / "b", table, "--shard", "1/2", code=2)
    assert "line" not in run(learned, tmp_path / "b", table, "--shard", "2/2")
    assert "line 122" in run(learned, tmp_path / "b", table, code=2)


@pytest.mark.slow
def test_a_shard_without_a_part_says_so(learned, tmp_path, in_pieces):
    table = write_pairs(tmp_path / "p.csv", 60)
    told = run(learned, tmp_path / "b", table, "--shard", "7/9")
    assert "shard 7/9: 0 strokes drawn" in told


@pytest.mark.slow
def test_a_plane_seen_by_tools_of_the_table_is_seen_by_every_shard_as_by_all(
    learned, tmp_path, in_pieces
):
    """Rows of one shard alone would turn the plane over."""
    rng = np.random.default_rng(1)
    start = np.column_stack([rng.uniform(-300, 300, (150, 2)), np.zeros(150)])
    ends = np.hstack([start, start + [60.0, 20.0, 0.0]])
    rows = []
    for i, row in enumerate(ends.round(3).tolist()):
        tool = [0, 0, 0] if 50 <= i < 100 else [np.pi, 0, 0]
        rows.append(",".join(map(str, [*row, *tool])))
    table = tmp_path / "p.csv"
    table.write_text("\n".join(["x0,y0,z0,xg,yg,zg,rx0,ry0,rz0", *rows]) + "\n")
    (tmp_path / "plane.json").write_text(PLANE)
    options = [*SKIP, "--surface", tmp_path / "plane.json"]
    run(learned, tmp_path / "whole", table, *options)
    for shard in ("2/3", "1/3", "3/3"):
        run(learned, tmp_path / "b", table, *options, "--shard", shard)
    assert parts_of(tmp_path / "b") == parts_of(tmp_path / "whole")


def write_sites(path, rows, mixed):
    """Pairs on eight planes, and on one that is not there, each with its own unit or stand-off."""
    rng = np.random.default_rng(5)
    start = np.column_stack([rng.uniform(-300, 300, (rows, 2)), np.zeros(rows)])
    ends = np.hstack([start, start + [60.0, 20.0, 0.0]]).round(3)
    ends[rows // 2, 3] = np.nan  # a pair that is none
    of = np.arange(rows) * 9 // rows
    of = rng.permutation(of) if mixed else of
    path.with_name("plane.json").write_text(PLANE)
    cells = {name: ends[:, i] for i, name in enumerate(("x0", "y0", "z0", "xg", "yg", "zg"))}
    cells["surface"] = ["missing.json" if i == 4 else "plane.json" for i in of]
    cells["pose"] = [f"0 0 {i} 0 0 0" for i in of]
    cells["in"] = ["part"] * rows
    cells["offset"] = [0.5 if i == 7 else 0.0 for i in of]
    table = pa.table(cells)
    if path.suffix == ".parquet":
        pq.write_table(table, path, row_group_size=70)
    else:
        plain = pyarrow.csv.WriteOptions(quoting_style="none", quoting_header="none")
        pyarrow.csv.write_csv(table, path, plain)
        lines = path.read_text().splitlines()
        path.write_text("\n".join([*lines[:40], "# a comment", "", *lines[40:]]) + "\n")
    return path


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["csv", "parquet"])
@pytest.mark.parametrize("mixed", [False, True])
def test_shards_of_a_table_that_names_surfaces_draw_the_parts_of_the_whole(
    learned, tmp_path, monkeypatch, kind, mixed
):
    monkeypatch.setattr(pair_stream, "STREAMED_ROWS", 0)
    monkeypatch.setattr(pair_stream, "STREAMED", 0)
    monkeypatch.setattr(pair_stream, "ROWS", 100)
    table = write_sites(tmp_path / f"p.{kind}", 330, mixed)
    few = (*SKIP, "--pairs-per-part", 20, "--surfaces-per-part", 2)
    run(learned, tmp_path / "whole", table, *few)
    for shard in ("2/3", "1/3", "3/3", "99/99"):  # the last has no part
        run(learned, tmp_path / "b", table, *few, "--shard", shard)
    assert len(parts_of(tmp_path / "whole")) > 12
    assert parts_of(tmp_path / "b") == parts_of(tmp_path / "whole")
    run(learned, tmp_path / "b", table, *few)
    assert content(tmp_path / "b") == content(tmp_path / "whole")


@pytest.mark.slow
def test_a_shard_of_a_table_that_names_surfaces_reads_nothing_else_of_others_rows(
    learned, tmp_path, monkeypatch
):
    monkeypatch.setattr(pair_stream, "STREAMED", 0)
    monkeypatch.setattr(pair_stream, "ROWS", 100)
    table = write_sites(tmp_path / "p.csv", 330, mixed=True)
    seen, decoded = [], pair_stream.pairs.decoded

    def noted(piece):
        found = decoded(piece)
        seen.append(found.numbers)
        return found

    monkeypatch.setattr(pair_stream.pairs, "decoded", noted)
    few = (*SKIP, "--pairs-per-part", 20, "--surfaces-per-part", 2)
    run(learned, tmp_path / "b", table, *few, "--shard", "1/5")
    rows = np.unique(np.concatenate(seen[1:]))  # the first row tells the columns
    assert 0 < len(rows) < 110
