"""A batch has the same bytes whoever draws it, however often it is stopped on the way."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from dmpcli import cli
from dmpcli.batch import dataset_folder
from dmpcli.dmp.learning import fit
from dmpcli.dmp.options import FitOptions
from dmpcli.records import draft, file_io, manifest, record, skill
from dmpcli.records.record import Provenance
from tests.dmp.strokes import paper_stroke

DMPCLI = str(Path(sys.executable).with_name("dmpcli"))
COLUMNS = "x0,y0,z0,xg,yg,zg"


@pytest.fixture(scope="module")
def learned(tmp_path_factory):
    path = tmp_path_factory.mktemp("skill") / "s.json"
    result = fit([paper_stroke(turning=True)], FitOptions())
    one = skill.Reproduction(sha256="0", duration=10.0, rms=0, largest=0, end=0, smoothing=0)
    path.write_bytes(skill.encode(result.skill, [one], Provenance("fit")))
    return path


def write_pairs(path, count, bad=()):
    rng = np.random.default_rng(count)
    start = rng.uniform(-300, 300, (count, 3))
    goal = start + rng.uniform([40, -60, -1], [100, 60, 1], (count, 3))
    rows = [",".join(f"{v:.3f}" for v in row) for row in np.hstack([start, goal])]
    for row in bad:
        rows[row] = "1,2,nan,4,5,6"
    path.write_text("\n".join([COLUMNS, *rows]) + "\n")
    return path


def run(learned, folder, table, *options, code=0):
    words = ["generalize", str(learned), "-o", str(folder), "--pairs", str(table)]
    words += ["--rate", "20", "--pairs-per-part", "50", *map(str, options)]
    done = CliRunner().invoke(cli.app, words)
    assert done.exit_code == code, done.stderr
    assert "Traceback" not in done.stderr
    return done.stderr


def content(folder):
    return {path.name: path.read_bytes() for path in Path(folder).iterdir()}


@pytest.fixture(scope="module")
def whole(learned, tmp_path_factory):
    """A table of 230 pairs with two bad ones, and the batch of it drawn in one go."""
    place = tmp_path_factory.mktemp("whole")
    table = write_pairs(place / "p.csv", 230, bad=(60, 229))
    run(learned, place / "batch", table, "--on-error", "skip")
    return table, content(place / "batch")


@pytest.mark.slow
def test_part_n_holds_the_pairs_of_part_n_in_order_and_the_manifest_says_so(whole):
    files = whole[1]
    assert sorted(files) == [
        "_manifest.json",
        "pairs.parquet",
        *(f"part-0000{n}.parquet" for n in range(5)),
    ]
    for number, rows in enumerate([range(50), range(50, 100), range(100, 150)]):
        part = record.decode(file_io.Source("part", files[f"part-0000{number}.parquet"]))
        expected = [str(row + 1) for row in rows if row not in (60, 229)]
        assert list(dict.fromkeys(part.columns["id"])) == expected
    found = manifest.decode(file_io.Source("m", files["_manifest.json"]))
    assert (found.pairs, found.drawn) == (230, 228)
    assert [entry.pairs for entry in found.parts] == [50, 49, 50, 50, 29]
    assert [entry.bytes for entry in found.parts] == [
        len(files[entry.file]) for entry in found.parts
    ]


@pytest.mark.slow
@pytest.mark.parametrize("options", [("--jobs", 2), ("--jobs", 5)])
def test_the_number_of_processes_does_not_change_a_byte(learned, whole, tmp_path, options):
    table, files = whole
    run(learned, tmp_path / "b", table, "--on-error", "skip", *options)
    assert content(tmp_path / "b") == files


@pytest.mark.slow
def test_shards_leave_the_table_and_manifest_to_the_last_run(learned, whole, tmp_path):
    table, files = whole
    for shard in ("2/3", "3/3", "1/3"):
        told = run(learned, tmp_path / "b", table, "--on-error", "skip", "--shard", shard)
        assert f"shard {shard}" in told
        assert not {"_manifest.json", "pairs.parquet"} & set(content(tmp_path / "b"))
    told = run(learned, tmp_path / "b", table, "--on-error", "skip")
    assert "5 of 5 parts were there already" in told
    assert content(tmp_path / "b") == files


@pytest.mark.slow
def test_a_shard_leaves_alone_what_another_one_is_writing(learned, whole, tmp_path):
    table, files = whole
    folder = tmp_path / "b"
    folder.mkdir()
    ours, theirs = (folder / f".part-0000{n}.parquet.x.tmp" for n in (0, 1))
    for half in (ours, theirs):
        half.write_bytes(b"half")
    run(learned, folder, table, "--on-error", "skip", "--shard", "1/2")
    assert not ours.exists()
    assert theirs.exists()
    run(learned, folder, table, "--on-error", "skip")
    assert content(folder) == files


@pytest.mark.slow
def test_a_resumed_run_keeps_whole_parts_and_draws_the_others_again(learned, whole, tmp_path):
    table, files = whole
    folder = tmp_path / "b"
    folder.mkdir()
    for name, data in files.items():
        (folder / name).write_bytes(data)
    (folder / "_manifest.json").unlink()
    (folder / "part-00001.parquet").write_bytes(files["part-00001.parquet"][:-200])
    (folder / "part-00003.parquet").unlink()
    (folder / ".part-00003.parquet.0f.tmp").write_bytes(b"half")
    (folder / "part-00009.parquet").write_bytes(files["part-00002.parquet"])
    (folder / "notes.txt").write_text("mine")
    before = (folder / "part-00002.parquet").stat().st_mtime_ns
    assert "3 of 5 parts" in run(learned, folder, table, "--on-error", "skip")
    assert (folder / "part-00002.parquet").stat().st_mtime_ns == before
    (folder / "notes.txt").unlink()
    assert content(folder) == files


@pytest.mark.slow
@pytest.mark.parametrize("other", [("--rate", 25), ("--float32",), ("--amplitude", "scale")])
def test_parts_of_other_options_are_not_kept(learned, whole, tmp_path, other):
    table, files = whole
    folder = tmp_path / "b"
    folder.mkdir()
    (folder / "part-00000.parquet").write_bytes(files["part-00000.parquet"])
    assert "already" not in run(learned, folder, table, "--on-error", "skip", *other)
    assert content(folder)["part-00000.parquet"] != files["part-00000.parquet"]


@pytest.mark.sweep(kept=1)
@pytest.mark.slow
@pytest.mark.parametrize("jobs", [1, 2])
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_stopped_run_keeps_finished_parts_and_no_manifest(learned, tmp_path, jobs, number, code):
    table = write_pairs(tmp_path / "p.csv", 6000)
    folder = tmp_path / "b"
    command = [DMPCLI, "generalize", learned, "-o", folder, "--pairs", table, "--rate", "100"]
    options = ["--pairs-per-part", "100", "--jobs", str(jobs)]
    process = subprocess.Popen(
        [*map(str, command), *options],
        stderr=subprocess.PIPE,
        # A test run in the background of a shell would hand down that Ctrl-C is ignored.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    deadline = time.monotonic() + 60
    while not list(folder.glob("part-*.parquet")):
        assert time.monotonic() < deadline
        time.sleep(0.01)
    process.send_signal(number)
    _, told = process.communicate(timeout=60)
    assert process.returncode == code
    assert b"Traceback" not in told
    kept = content(folder)
    assert "_manifest.json" not in kept
    assert not [name for name in kept if name.endswith(".tmp")]
    parts = {name: data for name, data in kept.items() if name.startswith("part-")}
    assert 0 < len(parts) < 60
    for data in parts.values():
        record.decode(file_io.Source("part", data))


def children(pid):
    return [int(c) for c in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


@pytest.mark.slow
def test_a_process_that_is_killed_is_told_and_what_it_had_drawn_stays(learned, tmp_path):
    table = write_pairs(tmp_path / "p.csv", 6000)
    folder = tmp_path / "b"
    command = [DMPCLI, "generalize", learned, "-o", folder, "--pairs", table, "--rate", "100"]
    options = ["--pairs-per-part", "100", "--jobs", "2"]
    process = subprocess.Popen([*map(str, command), *options], stderr=subprocess.PIPE)
    while not list(folder.glob("part-*.parquet")):
        time.sleep(0.01)
    drawing = [grandchild for child in children(process.pid) for grandchild in children(child)]
    os.kill(drawing[0], signal.SIGKILL)
    _, told = process.communicate(timeout=60)
    assert process.returncode == 2
    assert b"a process that draws was killed" in told
    assert b"Traceback" not in told
    assert "_manifest.json" not in content(folder)


@pytest.mark.slow
def test_single_precision_keeps_times_and_halves_the_step_of_places(learned, whole, tmp_path):
    table, files = whole
    run(learned, tmp_path / "b", table, "--on-error", "skip", "--float32", "--compression", "lz4")
    for name in ("part-00000.parquet", "part-00004.parquet"):
        single = record.decode(file_io.read(tmp_path / "b" / name))
        double = record.decode(file_io.Source(name, files[name]))
        np.testing.assert_array_equal(single.t, double.t)
        np.testing.assert_allclose(single.position(), double.position(), rtol=6e-8)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--jobs", 0), "--jobs 0: must be 1 to 1024"),
        (("--shard", "0/4"), "--shard 0/4: must be I/N"),
        (("--shard", "5/4"), "--shard 5/4: must be I/N"),
        (("--shard", "half"), "--shard half: must be I/N"),
        (("--pairs-per-part", 0), "--pairs-per-part 0"),
        (("--compression", "gzip"), "--compression gzip: must be zstd"),
        (("--jobs", 2, "--cluster", "tcp://127.0.0.1:1"), "leave --jobs out"),
        (("--cluster", "localhost"), "must be an address"),
    ],
)
def test_wrong_options_are_refused_before_the_folder_is_touched(
    learned, whole, tmp_path, options, message
):
    assert message in run(learned, tmp_path / "b", whole[0], *options, code=2)
    assert not (tmp_path / "b").exists()


@pytest.mark.slow
def test_options_of_batches_belong_to_pairs(learned, tmp_path):
    words = ["generalize", str(learned), "-o", str(tmp_path / "t.parquet"), "--reproduce"]
    done = CliRunner().invoke(cli.app, [*words, "--jobs", "2"])
    assert done.exit_code == 2
    assert "--jobs: belongs to --pairs" in done.stderr


def test_metadata_tell_neither_who_drew_nor_where(whole):
    text = json.dumps(json.loads(whole[1]["_manifest.json"]))
    for word in ("jobs", "shard", "cluster", "/tmp", os.uname().nodename):
        assert word not in text


@pytest.mark.slow
@pytest.mark.parametrize("share", [(), ("--shard", "1/1")])
def test_a_second_run_of_the_same_batch_meanwhile_harms_neither(
    learned, whole, tmp_path, monkeypatch, share
):
    """As a batch system has it that starts a task anew which it took for lost."""
    table, files = whole
    keep, begun = draft.Draft.keep, []

    def meanwhile(self):
        begun.append(self)
        if len(begun) == 3:
            run(learned, tmp_path / "b", table, "--on-error", "skip", *share)
        return keep(self)

    monkeypatch.setattr(draft.Draft, "keep", meanwhile)
    run(learned, tmp_path / "b", table, "--on-error", "skip")
    assert content(tmp_path / "b") == files


@pytest.mark.slow
def test_a_run_whose_parts_another_one_replaced_does_not_end_well(
    learned, whole, tmp_path, monkeypatch
):
    table, _ = whole
    finish = dataset_folder.Folder.finish

    def meanwhile(self, manifest):
        monkeypatch.setattr(dataset_folder.Folder, "finish", finish)
        run(learned, tmp_path / "b", table, "--on-error", "skip", "--float32")
        finish(self, manifest)

    monkeypatch.setattr(dataset_folder.Folder, "finish", meanwhile)
    told = run(learned, tmp_path / "b", table, "--on-error", "skip", code=2)
    assert "part-00000.parquet: another run has removed or replaced it" in told


def test_a_part_whose_folder_is_gone_is_told_with_what_to_do(learned, whole, tmp_path, monkeypatch):
    table, _ = whole
    settle = record.store

    def meanwhile(drawn, stream, form):
        for half in (tmp_path / "b").glob(".part-*"):
            half.unlink()
        settle(drawn, stream, form)

    monkeypatch.setattr(record, "store", meanwhile)
    told = run(learned, tmp_path / "b", table, "--on-error", "skip", code=2)
    assert "somebody removed its folder, or what was written; the same command goes on" in told
