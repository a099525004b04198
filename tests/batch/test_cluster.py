"""A Dask cluster draws the same bytes, also when a worker dies; its workers are checked."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import distributed
import pytest

from dmpcli.batch import cluster
from dmpcli.errors import InputError, InstrumentError
from tests.batch.test_run import DMPCLI, content, learned, write_pairs

pytestmark = pytest.mark.slow

BIN = Path(sys.executable).parent

__all__ = ["learned"]


@pytest.fixture
def scheduler(tmp_path):
    """Address of a scheduler with two worker processes."""
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


def test_the_bytes_are_those_of_one_machine_also_when_a_worker_dies(learned, tmp_path, scheduler):
    address, workers = scheduler
    table = write_pairs(tmp_path / "p.csv", 8000)
    command = [DMPCLI, "generalize", learned, "--pairs", table, "--pairs-per-part", "400"]
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
