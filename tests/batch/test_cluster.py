"""A Dask cluster draws the same bytes, also when a worker dies; its workers are checked."""

import os
import signal
import subprocess
import sys
import time
from concurrent.futures import CancelledError
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from dmpcli.batch import cluster
from dmpcli.batch.part import Job
from dmpcli.batch.task import Task
from dmpcli.dmp.drawn_strokes import GeneralizeOptions
from dmpcli.errors import InputError, InstrumentError
from dmpcli.records.object_store import ObjectPath
from dmpcli.records.record import Form, Provenance
from tests.batch.test_run import DMPCLI, content, learned, write_pairs
from tests.object_store import BUCKET, served

BIN = Path(sys.executable).parent

__all__ = ["learned"]


@pytest.fixture
def scheduler(tmp_path):
    """Address of a scheduler with two worker processes."""
    import distributed

    file = tmp_path / "scheduler.json"
    options = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", file]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    running = [subprocess.Popen([BIN / "dask", "scheduler", *map(str, options)], **quiet)]
    try:
        deadline = time.monotonic() + 60
        while not file.exists():
            assert time.monotonic() < deadline
            time.sleep(0.05)
        place = ["--scheduler-file", str(file), "--local-directory", str(tmp_path / "spill")]
        for _ in range(2):
            worker = [BIN / "dask", "worker", "--no-nanny", "--nthreads", "1", "--no-dashboard"]
            running.append(subprocess.Popen([*map(str, worker), *place], **quiet))
        with distributed.Client(scheduler_file=str(file), set_as_default=False) as client:
            client.wait_for_workers(2, timeout=60)
            yield client.scheduler.address, running[1:]
    finally:
        for process in running:
            process.kill()
        for process in running:
            process.wait()


@pytest.mark.thorough
def test_the_bytes_are_those_of_one_machine_also_when_a_worker_dies(learned, tmp_path, scheduler):
    address, workers = scheduler
    table = write_pairs(tmp_path / "p.csv", 3000)
    command = [DMPCLI, "generalize", learned, "--pairs", table, "--pairs-per-part", "150"]
    one, many = tmp_path / "one", tmp_path / "many"
    subprocess.run([*map(str, command), "-o", str(one), "-q"], check=True)
    drawing = subprocess.Popen([*map(str, command), "-o", str(many), "-q", "--cluster", address])
    while len(list(many.glob("part-*.parquet"))) < 3:
        assert drawing.poll() is None
        time.sleep(0.005)
    os.kill(workers[0].pid, signal.SIGKILL)
    assert drawing.wait(timeout=120) == 0
    assert content(many) == content(one)


def test_a_scheduler_that_does_not_answer_is_told_in_one_line(monkeypatch):
    monkeypatch.setattr(cluster, "PATIENCE", 0.3)
    with pytest.raises(InstrumentError, match="no scheduler answers"):
        cluster.workers("tcp://127.0.0.1:1")


class FakeClient:
    """Answers as a client of a cluster does, from given values."""

    def __init__(self, workers, found, sees=True):
        self.workers, self.found, self.sees = workers, found, sees

    def ncores(self):
        return dict.fromkeys(self.workers, 1)

    def run(self, function, *arguments):
        if function is cluster.versions:
            if isinstance(self.found, Exception):
                raise self.found
            return dict.fromkeys(self.workers, self.found)
        return dict.fromkeys(self.workers, self.sees)


@pytest.mark.parametrize(
    ("client", "message"),
    [
        (FakeClient([], {}), "has no workers"),
        (FakeClient(["w"], ModuleNotFoundError("dmpcli")), "cannot run dmpcli"),
        (FakeClient(["w"], cluster.versions() | {"numpy": "1.0"}), "worker w has numpy 1.0"),
        (FakeClient(["w"], cluster.versions(), sees=False), "does not see"),
    ],
)
def test_workers_that_would_draw_other_bytes_are_refused_by_name(client, message, tmp_path):
    with pytest.raises((InputError, InstrumentError), match=message):
        cluster._check(client, "tcp://x:1", tmp_path, kernels=False)
    assert not list(tmp_path.iterdir())


def test_a_worker_without_the_kernels_of_the_job_is_refused_by_name(tmp_path):
    client = FakeClient(["w"], cluster.versions())
    cluster._check(client, "tcp://x:1", tmp_path, kernels=False)
    with pytest.raises(InputError, match="worker w has numba None"):
        cluster._check(client, "tcp://x:1", tmp_path, kernels=True)


JOB = Job(Task(None, None, GeneralizeOptions()), True, Provenance("generalize"), Form(), "batch")


def test_a_worker_of_another_version_that_comes_later_is_refused_by_name(monkeypatch):
    ours = cluster.versions()
    assert cluster._brought(JOB, ours, "w") is JOB
    refusal = cluster._brought(JOB, ours | {"numpy": "1.0"}, "late")
    assert refusal == f"worker late has numpy {ours['numpy']}, here it is 1.0; install the same"
    monkeypatch.setattr("distributed.get_worker", lambda: SimpleNamespace(job=refusal))
    with pytest.raises(InputError, match="worker late has numpy"):
        cluster._draw("job", None)


class LostClient(FakeClient):
    """Loses its scheduler over the first part."""

    loop = None

    def __init__(self, error):
        super().__init__(["w"], cluster.versions())
        self.error, self.names = error, []

    def register_plugin(self, plugin):
        self.names.append(plugin.name)

    def unregister_worker_plugin(self, name):
        self.names.remove(name)
        raise OSError("Timed out trying to connect")

    def submit(self, *_, **__):
        return SimpleNamespace(result=self.fail)

    def fail(self):
        raise self.error


class Completed(list):
    """What `distributed.as_completed` gives, of what was added."""

    def __init__(self, **_):
        super().__init__()

    add, count = list.append, list.__len__


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (CancelledError("part"), 4, r"was lost \(CancelledError\); the same command goes on"),
        (OSError("gone"), 4, r"was lost \(OSError\)"),
        (ModuleNotFoundError("No module named 'dmpcli'"), 2, "a worker cannot run dmpcli"),
        (InputError("part-00000: cannot be written"), 2, "^part-00000: cannot be written"),
    ],
    ids=lambda one: type(one).__name__,
)
def test_what_ends_a_cluster_on_the_way_is_told_in_one_line(
    tmp_path, monkeypatch, error, code, said
):
    monkeypatch.setattr("distributed.as_completed", Completed)
    client, job = LostClient(error), replace(JOB, folder=str(tmp_path))
    with pytest.raises((InputError, InstrumentError), match=said) as told:
        list(cluster._drawn(client, "tcp://x:1", job, [None]))
    assert told.value.exit_code == code
    assert client.names == []


def test_a_worker_that_does_not_see_a_store_is_refused_with_what_it_needs(monkeypatch):
    with served() as store:
        for name, value in store.environment.items():
            monkeypatch.setenv(name, value)
        client = FakeClient(["w"], cluster.versions(), sees=False)
        folder = ObjectPath(f"s3://{BUCKET}", "b")
        with pytest.raises(InputError, match=r"w does not see s3://.*/b; it needs credentials"):
            cluster._check(client, "tcp://x:1", folder, kernels=False)
        assert store.objects() == {}
        monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:9")
        monkeypatch.setenv("AWS_MAX_ATTEMPTS", "1")
        assert not cluster._sees(f"s3://{BUCKET}/b/x")
