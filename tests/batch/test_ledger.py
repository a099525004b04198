"""A ledger says of parts what they say themselves, as long as they are as they were."""

import json
import os

import numpy as np

from dmpcli.batch.dataset_folder import Folder
from dmpcli.batch.part import Job, Outcome
from dmpcli.batch.task import Task
from dmpcli.dmp.drawn_strokes import GeneralizeOptions
from dmpcli.records import dataset, file_io, record, schemas
from dmpcli.records.record import Form, Provenance, Record
from dmpcli.workflows import batches
from tests.batch.test_run import content, run, write_pairs
from tests.batch.test_run import learned as learned


def job_of(folder, **options):
    style = GeneralizeOptions()
    return Job(
        Task(None, None, style), True, Provenance("generalize", options), Form(), str(folder)
    )


def put(folder, job, number):
    columns = {"id": np.array(["1"] * 3, dtype=object), "t": np.arange(3.0)}
    columns |= dict.fromkeys("xyz", np.zeros(3))
    outcome = Outcome(number, {7: "why"}, {8: 2.5}, 1, pieces={9: [([0.0], [1.0], 2.0)]}, slow=2)
    facts = {"part": outcome.fact()}
    p = Provenance("generalize", job.provenance.options, (), facts)
    path = folder / job.file_of(number)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(record.encode(Record(schemas.TRAJECTORY, columns, p)))
    size = path.stat().st_size
    return Outcome(
        number,
        outcome.failed,
        outcome.clipped,
        1,
        3,
        size,
        pieces={9: [[[0.0], [1.0], 2.0]]},
        slow=2,
    )


def opened(job, numbers, whole=True):
    folder = Folder(job)
    folder.open(whole)
    kept = folder.kept(numbers, lambda _: [])
    folder.leave()
    return kept


def test_a_line_says_what_the_part_says_and_spares_its_footer(tmp_path, monkeypatch):
    job = job_of(tmp_path)
    made = {number: put(tmp_path, job, number) for number in range(3)}
    assert opened(job, range(3)) == made
    [ledger] = tmp_path.glob("_ledger-*")
    assert len(ledger.read_text().splitlines()) == 4
    monkeypatch.setattr(Folder, "_outcome", None)
    assert opened(job, range(3)) == made


def test_parts_that_are_not_as_they_were_are_asked_themselves(tmp_path):
    job = job_of(tmp_path)
    for number in range(4):
        put(tmp_path, job, number)
    opened(job, range(4))
    whole = (tmp_path / "part-00001.parquet").read_bytes()
    (tmp_path / "part-00001.parquet").write_bytes(whole[:-9])
    (tmp_path / "part-00002.parquet").unlink()
    os.utime(tmp_path / "part-00003.parquet", ns=(1, 1))
    assert sorted(opened(job, range(4))) == [0, 3]
    assert not (tmp_path / "part-00001.parquet").exists()


def test_the_ledger_of_another_batch_is_none_and_half_a_line_is_passed_over(tmp_path):
    job = job_of(tmp_path)
    put(tmp_path, job, 0)
    opened(job, [0])
    [ledger] = tmp_path.glob("_ledger-*")
    text = ledger.read_text()
    ledger.write_text(text + text.splitlines()[1][:20])
    put(tmp_path, job, 1)
    assert sorted(opened(job, [0, 1])) == [0, 1]
    assert json.loads(ledger.read_text().splitlines()[-1])["part"]["number"] == 1
    assert opened(job_of(tmp_path, rate=9), [0, 1]) == {}


def test_many_parts_lie_in_several_folders_and_are_read_from_there(learned, tmp_path, monkeypatch):
    table = write_pairs(tmp_path / "p.csv", 230, bad=(60,))
    run(learned, tmp_path / "flat", table, "--on-error", "skip")
    monkeypatch.setattr(batches, "MOST_IN_ONE", 3)
    monkeypatch.setattr(file_io, "MOST_IN_FOLDER", 2)
    run(learned, tmp_path / "b", table, "--on-error", "skip", "--shard", "2/2")
    told = run(learned, tmp_path / "b", table, "--on-error", "skip")
    assert "2 of 5 parts were there already" in told
    names = [f"part-{n // 2:02d}/part-{n:05d}.parquet" for n in range(5)]
    assert list(file_io.parts_of(tmp_path / "b")) == names
    assert not list((tmp_path / "b").glob("_ledger*"))
    flat = content(tmp_path / "flat")
    for name in names:
        assert (tmp_path / "b" / name).read_bytes() == flat[name.split("/")[1]]
    batch, odd = dataset.read(tmp_path / "b")
    assert (batch.files, odd, len(batch)) == (names, [], 229)
    assert record.foreign_parts(tmp_path / "b") == []
    (tmp_path / "b" / "part-00" / "part-00000.parquet").write_bytes(b"somebody's")
    assert record.foreign_parts(tmp_path / "b") == ["part-00/part-00000.parquet"]
