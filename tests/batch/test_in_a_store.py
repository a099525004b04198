"""A batch in an object store has the bytes of one on this machine, whatever befalls it."""

import os
import pickle
import re
import signal
import subprocess

import pytest
from typer.testing import CliRunner

from dmpcli import cli
from dmpcli.batch import ledger
from dmpcli.batch.part import Job
from dmpcli.batch.task import Task
from dmpcli.dmp.drawn_strokes import GeneralizeOptions
from dmpcli.records.record import Form, Provenance
from tests.batch.test_run import DMPCLI, content, write_pairs
from tests.batch.test_run import learned as learned
from tests.object_store import BUCKET, SECRETS, Fault, environment_of, served, used
from tests.records.meshes import box, written

MANY = 230
OPTIONS = ["--rate", "20", "--pairs-per-part", "50", "--on-error", "skip"]


@pytest.fixture(scope="module")
def running():
    with served() as store:
        yield store


@pytest.fixture
def store(running, monkeypatch):
    with used(running, monkeypatch) as store:
        yield store


@pytest.fixture(scope="module")
def whole(learned, tmp_path_factory):
    """A table of pairs with two bad ones, and the batch of it in a folder of this machine."""
    place = tmp_path_factory.mktemp("whole")
    table = write_pairs(place / "p.csv", MANY, bad=(60, 229))
    run(learned, table, place / "batch")
    return table, content(place / "batch")


def run(skill, table, output, *options, code=0):
    words = ["generalize", skill, "-o", output, "--pairs", table, *OPTIONS, *options]
    done = CliRunner().invoke(cli.app, [str(word) for word in words])
    assert done.exit_code == code, (done.stderr, done.exception)
    assert not any(secret in done.stderr for secret in SECRETS.values())
    return done.stderr


def put(store, path, key):
    store.client().upload_file(str(path), BUCKET, key)
    return f"s3://{BUCKET}/{key}"


@pytest.mark.thorough
def test_a_batch_of_a_store_has_the_bytes_of_one_of_a_folder(learned, whole, store):
    table, files = whole
    skill, pairs = put(store, learned, "in/s.json"), put(store, table, "in/p.csv")
    run(skill, pairs, f"s3://{BUCKET}/a b/batch/")
    assert store.objects("a b/batch/") == files


@pytest.mark.slow
def test_processes_and_shards_write_the_same_into_a_store(learned, whole, store):
    table, files = whole
    run(learned, table, f"s3://{BUCKET}/jobs", "--jobs", 2)
    assert store.objects("jobs/") == files
    for shard in ("2/2", "1/2"):
        run(learned, table, f"s3://{BUCKET}/shards", "--shard", shard)
        assert not {"_manifest.json", "pairs.parquet"} & set(store.objects("shards/"))
    told = run(learned, table, f"s3://{BUCKET}/shards")
    assert "5 of 5 parts were there already" in told
    assert store.objects("shards/") == files


def footers_read(store):
    return {
        match[1] for r in store.requests if (match := re.match(r"GET .*(part-\d+)\.parquet", r))
    }


@pytest.mark.slow
def test_a_run_that_was_killed_goes_on_in_the_store(learned, whole, store):
    table, files = whole
    url = f"s3://{BUCKET}/killed"
    words = [DMPCLI, "generalize", learned, "-o", url, "--pairs", table, *OPTIONS, "-q"]
    drawing = subprocess.Popen([str(word) for word in words], env=environment_of(store))

    def kill(method, path):
        if method == "PUT" and path.endswith("killed/part-00003.parquet"):
            os.kill(drawing.pid, signal.SIGKILL)

    store.happened = kill
    assert drawing.wait(timeout=120) == -signal.SIGKILL
    store.happened = None
    there = store.objects("killed/")
    assert {f"part-0000{n}.parquet" for n in range(3)} <= set(there)
    assert not {"_manifest.json", "pairs.parquet"} & set(there)
    assert all(files[name] == content for name, content in there.items())
    told = run(learned, table, url)
    assert re.search(r"[34] of 5 parts were there already", told)
    assert store.objects("killed/") == files
    assert all(files[name] == content for name, content in there.items())


@pytest.mark.slow
def test_a_ledger_in_a_store_spares_the_parts_it_tells_of(learned, whole, store, monkeypatch):
    table, files = whole
    url = f"s3://{BUCKET}/b"
    monkeypatch.setattr(ledger, "_TOGETHER", 2)
    run(learned, table, url, "--shard", "1/2")
    told = [name for name in store.objects("b/") if name.startswith("_ledger-1-of-2-")]
    assert len(told) == 2  # two lines, and at the end one
    store.requests.clear()
    run(learned, table, url, "--shard", "1/2")
    assert footers_read(store) == {"part-00000"}  # by what means the batch was begun
    for name in told:
        store.client().delete_object(Bucket=BUCKET, Key=f"b/{name}")
    store.requests.clear()
    run(learned, table, url, "--shard", "1/2")
    assert footers_read(store) == {"part-00000", "part-00002", "part-00004"}
    run(learned, table, url)
    assert store.objects("b/") == files


@pytest.mark.slow
def test_throttled_and_failing_requests_cost_time_and_nothing_else(learned, whole, store):
    table, files = whole
    store.faults += [
        Fault("PUT", "part-00001", times=2),
        Fault("PUT", "part-00003", "500 Oops", "InternalError", times=1),
        Fault("PUT", "part-00004", status="", times=1),
        Fault("HEAD", "part-00002", times=1),
        Fault("GET", "list-type", times=1),
        Fault("PUT", "_manifest", times=1),
    ]
    run(learned, table, f"s3://{BUCKET}/slow")
    assert all(fault.times == 0 for fault in store.faults)
    store.faults.clear()
    assert store.objects("slow/") == files


@pytest.mark.slow
def test_a_store_that_has_no_time_ends_the_run_and_the_next_one_goes_on(
    learned, whole, store, monkeypatch
):
    table, files = whole
    monkeypatch.setenv("AWS_MAX_ATTEMPTS", "2")
    store.faults.append(Fault("PUT", "part-00002"))
    told = run(learned, table, f"s3://{BUCKET}/b", code=4)
    assert len(told.splitlines()) == 1
    assert f"s3://{BUCKET}/b/part-00002.parquet: the store has no time (SLOW_DOWN)" in told
    store.faults.clear()
    assert "part-00002.parquet" not in store.objects("b/")
    assert "2 of 5 parts were there already" in run(learned, table, f"s3://{BUCKET}/b")
    assert store.objects("b/") == files


@pytest.mark.slow
@pytest.mark.parametrize(
    ("output", "environment", "code", "said"),
    [
        (f"s3://{BUCKET}x/b", {}, 2, f"s3://{BUCKET}x: there is no such bucket"),
        (f"s3://{BUCKET}/b", {"AWS_ENDPOINT_URL": "http://127.0.0.1:9"}, 4, "is not reached"),
        (f"s3://{BUCKET}/b", {"AWS_ENDPOINT_URL": "127.0.0.1"}, 2, "AWS_ENDPOINT_URL: must be"),
        (f"s3://k:s3cr3t/s3cr3t@{BUCKET}/b", {}, 2, "must not hold credentials"),
        ("s3a://b/c", {}, 2, "s3:// is meant"),
        (f"s3://{BUCKET}/p/p.csv", {}, 2, "is a file"),
        (f"s3://{BUCKET}/foreign", {}, 2, "holds part-0.parquet, which is not of dmpcli"),
    ],
)
def test_what_is_wrong_is_one_line_and_nothing_is_written(
    learned, whole, store, monkeypatch, tmp_path, output, environment, code, said
):
    monkeypatch.setenv("AWS_MAX_ATTEMPTS", "1")
    put(store, whole[0], "p/p.csv")
    put(store, whole[0], "foreign/part-0.parquet")
    before = store.objects()
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    log = tmp_path / "log"
    told = run(learned, whole[0], output, "--log", log, code=code)
    assert said in told
    assert len(told.splitlines()) == 1
    assert "s3cr3t" not in told + log.read_text()
    assert store.objects() == before


def test_without_credentials_it_is_one_line(learned, whole, store, monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("AWS_REGION", "eu-west-1")  # as a new process: nothing is reached yet
    for name in SECRETS:
        monkeypatch.delenv(name)
    store.faults.append(Fault("HEAD", ".*", "403 Forbidden"))
    told = run(learned, whole[0], f"s3://{BUCKET}/b", code=2)
    assert "the store refuses it (ACCESS_DENIED); no credentials are set" in told
    assert len(told.splitlines()) == 1


@pytest.mark.slow
def test_a_table_in_a_store_names_surfaces_beside_it_and_elsewhere(learned, store, tmp_path):
    V, F = box((120.0, 80.0, 20.0))
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "a.stl").write_bytes(written(V - V.min(axis=0), F, "stl"))
    (tmp_path / "b.json").write_text('{"point": [0, 0, 20], "normal": [0, 0, 1]}')
    there = put(store, tmp_path / "b.json", "elsewhere/b.json")
    head = "id,x0,y0,z0,xg,yg,zg,surface\n"
    rows = (
        "one,20,40,20,100,40,20,parts/a.stl\ntwo,20,40,20,100,40,20,{}\nlost,0,0,20,9,0,20,no.stl\n"
    )
    (tmp_path / "t.csv").write_text(head + rows.format(there))
    run(learned, tmp_path / "t.csv", tmp_path / "here")
    put(store, tmp_path / "parts" / "a.stl", "in/parts/a.stl")
    table = put(store, tmp_path / "t.csv", "in/t.csv")
    told = run(learned, table, f"s3://{BUCKET}/there")
    assert "no.stl: no such file" in told
    assert store.objects("there/") == content(tmp_path / "here")
    store.client().put_object(Bucket=BUCKET, Key="in/parts/a.stl", Body=b"solid")
    told = run(learned, table, f"s3://{BUCKET}/there", code=0)
    assert "parts were there already" not in told


def test_no_credentials_travel_with_a_job(store):
    task = Task(None, None, GeneralizeOptions())
    job = Job(task, True, Provenance("generalize"), Form(), f"s3://{BUCKET}/b")
    sent = pickle.dumps(job)
    assert not any(secret.encode() in sent for secret in SECRETS.values())


@pytest.mark.slow
def test_credentials_are_in_nothing_that_is_written_or_told(learned, whole, store, tmp_path):
    log = tmp_path / "log"
    url = f"s3://{BUCKET}/b"
    told = run(learned, whole[0], url, "--log", log, "--shard", "1/2")
    told += run(learned, whole[0], url, "--log", log)
    kept = b"".join(store.objects().values()) + told.encode() + log.read_bytes()
    for secret in SECRETS.values():
        assert secret.encode() not in kept
    assert BUCKET.encode() not in b"".join(store.objects("b/").values())
