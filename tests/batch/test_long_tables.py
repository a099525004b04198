"""A table that is drawn a piece at a time gives the parts of one that is drawn whole."""

import pyarrow.parquet as pq
import pytest

from dmpcli.records import pair_stream
from tests.batch.test_run import content, run, write_pairs
from tests.batch.test_run import learned as learned

SKIP = ("--on-error", "skip")


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
