"""``make cluster-demo``: a batch on two Dask workers, one of which is killed in the middle.

The output is compared with the one of a single process, byte by byte.
"""

import contextlib
import filecmp
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

BIN = Path(sys.executable).parent
PAIRS = 20_000
PATIENCE = 60.0


def main() -> None:
    """Run the demonstration in the folder that is named on the command line."""
    place = Path(sys.argv[1])
    place.mkdir(parents=True, exist_ok=True)
    skill, table = place / "skill.json", place / "pairs.csv"
    subprocess.run(
        [BIN / "dmpcli", "fit", "sample_runs/reference.parquet", "-o", skill], check=True
    )
    write_pairs(table)
    command = [BIN / "dmpcli", "generalize", skill, "--pairs", table, "--pairs-per-part", "500"]
    one, many = place / "one", place / "many"
    for folder in (one, many):
        shutil.rmtree(folder, ignore_errors=True)
    subprocess.run([*command, "-o", one], check=True)
    with cluster(place) as (address, workers):
        print(f"two workers at {address}")
        drawing = subprocess.Popen([*command, "-o", many, "--cluster", address])
        wait_for(lambda: len(list(many.glob("part-*.parquet"))) >= 10)
        os.kill(workers[0].pid, signal.SIGKILL)
        print(f"killed one of them after {len(list(many.glob('part-*.parquet')))} parts")
        if drawing.wait() != 0:
            sys.exit("the batch failed")
    names = sorted(path.name for path in one.iterdir())
    same, different, odd = filecmp.cmpfiles(one, many, names, shallow=False)
    if different or odd or names != sorted(path.name for path in many.iterdir()):
        sys.exit(f"the outputs differ: {different + odd}")
    print(f"{len(same)} files, the same bytes as from a single process")


def write_pairs(path: Path) -> None:
    """Write pairs of 60 to 160 mm on a level plate, from a fixed seed."""
    rng = np.random.default_rng(5)
    start = rng.uniform([-800.0, -300.0, -17.5], [-400.0, 300.0, -17.5], (PAIRS, 3))
    angle, length = rng.uniform(-np.pi, np.pi, PAIRS), rng.uniform(60.0, 160.0, PAIRS)
    way = length[:, None] * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    rows = np.hstack([start, start + way])
    np.savetxt(path, rows, fmt="%.3f", delimiter=",", header="x0,y0,z0,xg,yg,zg", comments="")


@contextlib.contextmanager
def cluster(place: Path) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """Run a scheduler and two worker processes on loopback."""
    address = place / "scheduler.json"
    address.unlink(missing_ok=True)
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    at = ["--scheduler-file", str(address)]
    options = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
    running = [subprocess.Popen([BIN / "dask", "scheduler", *options, *at], **quiet)]  # type: ignore[call-overload]
    try:
        wait_for(address.exists)
        options = ["--no-nanny", "--nthreads", "1", "--no-dashboard"]
        spill = ["--local-directory", str(place / "spill")]
        for _ in range(2):
            worker = [BIN / "dask", "worker", *options, *at, *spill]
            running.append(subprocess.Popen(worker, **quiet))  # type: ignore[call-overload]
        from distributed import Client

        with Client(scheduler_file=str(address), set_as_default=False) as client:
            client.wait_for_workers(2, timeout=PATIENCE)
            yield client.scheduler.address, running[1:]
    finally:
        for process in running:
            process.kill()
        for process in running:
            process.wait()


def wait_for(happened: Callable[[], bool]) -> None:
    """Return when it has happened; give up after a while."""
    deadline = time.monotonic() + PATIENCE
    while not happened():
        if time.monotonic() > deadline:
            sys.exit("the cluster does not come up")
        time.sleep(0.01)


if __name__ == "__main__":
    main()
