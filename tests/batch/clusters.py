"""A Dask cluster on loopback whose workers come and go, for tests."""

import contextlib
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

PATIENCE = 120.0


@dataclass
class Cluster:
    """A scheduler, and the worker processes that were begun.

    Attributes
    ----------
    address : str
    place : Path
        Where it keeps what it needs.
    environment : dict of str
        Of the workers.
    workers : list of Popen
    """

    address: str
    place: Path
    environment: dict[str, str]
    workers: list[subprocess.Popen[bytes]] = field(default_factory=list)

    def add(self) -> subprocess.Popen[bytes]:
        """Begin one more worker, in a folder of its own, and wait until it is there."""
        import distributed

        here = self.place / f"worker-{len(self.workers)}"
        here.mkdir()
        words = ["--no-nanny", "--nthreads", "1", "--no-dashboard", "--local-directory", here]
        self.workers.append(begun("worker", self.address, *words, cwd=here, env=self.environment))
        alive = sum(worker.poll() is None for worker in self.workers)
        with distributed.Client(self.address, set_as_default=False) as client:
            client.wait_for_workers(alive, timeout=PATIENCE)
        return self.workers[-1]


def begun(what: str, *words: Any, **said: Any) -> subprocess.Popen[bytes]:
    """Begin a process of Dask's."""
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    return subprocess.Popen([sys.executable, "-m", "dask", what, *map(str, words)], **quiet, **said)


@contextlib.contextmanager
def cluster(place: Path, environment: dict[str, str]) -> Any:
    """Run a scheduler without workers."""
    import distributed

    place.mkdir()
    file = place / "scheduler.json"
    options = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", file]
    scheduler = begun("scheduler", *options, cwd=place)
    made: Cluster | None = None
    try:
        waited_for(file.exists)
        with distributed.Client(scheduler_file=str(file), set_as_default=False) as client:
            made = Cluster(client.scheduler.address, place, environment)
        yield made
    finally:
        running = [scheduler, *(made.workers if made else ())]
        for process in running:
            process.kill()
        for process in running:
            process.wait()


def waited_for(happened: Any) -> None:
    """Return when it has happened."""
    deadline = time.monotonic() + PATIENCE
    while not happened():
        assert time.monotonic() < deadline
        time.sleep(0.01)
