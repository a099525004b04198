"""What a table of parts costs. ``python -m benchmarks.parts FOLDER [COUNT]``.

COUNT (1000) different STL files of 50,000 faces, one pose and one pair each, two jobs: a first run
that is killed half way and goes on, one in one go with a cache folder that is empty, one with the
cache, and one job for the bytes. Ten of the parts are bad. Wall and processor seconds; memory is
the largest sum over all processes (proportional set sizes, so that shared pages count once).
"""

import filecmp
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import trimesh

from benchmarks.batches import family
from benchmarks.cluster_demo import BIN

HALF, SIDE, BAD = 100.0, 159, 10
COLUMNS = "x0,y0,z0,xg,yg,zg,surface,pose,in"


def parts(folder: Path, count: int) -> Path:
    """Write the parts and their table; the bad ones are empty, cut off, or not there."""
    (folder / "stl").mkdir(parents=True, exist_ok=True)
    x = np.linspace(-HALF, HALF, SIDE)
    X, Y = np.meshgrid(x, x, indexing="ij")
    at = np.arange(SIDE * SIDE).reshape(SIDE, SIDE)
    a, b, c, d = at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]
    F = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
    rng = np.random.default_rng(0)
    rows = []
    for i in range(count):
        k, phase = rng.uniform(0.03, 0.06, 2), rng.uniform(0.0, 6.0, 2)

        def height(u: float, v: float, k=k, phase=phase) -> float:  # type: ignore[no-untyped-def]
            return 4.0 * np.sin(k[0] * u + phase[0]) * np.cos(k[1] * v + phase[1])

        file = folder / "stl" / f"{i}.stl"
        V = np.column_stack([X.ravel(), Y.ravel(), height(X, Y).ravel()])
        if i % (count // BAD) == 3:
            file.unlink(missing_ok=True)
            if i % 3:
                file.write_bytes(b"" if i % 2 else b"solid cut off\nfacet normal 0 0")
        elif not file.exists():
            trimesh.Trimesh(V, F, process=False).export(file)
        start, goal = rng.uniform(-35, -25, 2), rng.uniform(-8, 8, 2) + np.array([30.0, -30.0])
        ends = [*start, height(*start), *goal, height(*goal)]
        pose = " ".join(
            f"{v:.4f}" for v in (*rng.uniform(-300, 300, 3), *rng.uniform(-0.3, 0.3, 3))
        )
        rows.append(",".join([*(f"{v:.6f}" for v in ends), f"stl/{i}.stl", pose, "part"]))
    table = folder / "parts.csv"
    table.write_text("\n".join([COLUMNS, *rows]) + "\n")
    return table


def command(folder: Path, table: Path, output: str, *words: str) -> list[str]:
    """Return the command line of a batch."""
    said = ["generalize", folder / "skill.json", "-o", folder / output, "--pairs", table]
    return [str(BIN / "dmpcli"), *map(str, said), "--on-error", "skip", "-q", *words]


def memory_of(pid: int) -> int:
    """Proportional set size of a process and those under it, bytes."""
    try:
        rollup = Path(f"/proc/{pid}/smaps_rollup").read_text()
        below = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    except OSError:
        return 0
    own = sum(int(line.split()[1]) for line in rollup.splitlines() if line.startswith("Pss:"))
    return 1024 * own + sum(memory_of(int(child)) for child in below)


def processor_of(pid: int) -> float:
    """Processor seconds of a process."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(") ")[2].split()
    except OSError:
        return 0.0
    return sum(map(int, fields[11:13])) / os.sysconf("SC_CLK_TCK")


def measured(words: list[str], stop_at: Path | None = None, parts: int = 0) -> tuple[float, ...]:
    """Run a command; wall s, processor s, largest memory in MiB."""
    begin = time.perf_counter()
    process = subprocess.Popen(words, stderr=subprocess.DEVNULL)
    largest, spent = 0, {0: 0.0}

    def watch() -> None:
        nonlocal largest
        while process.poll() is None:
            largest = max(largest, memory_of(process.pid))
            spent.update({pid: processor_of(pid) for pid in family(process.pid)})
            time.sleep(0.2)

    watcher = threading.Thread(target=watch)
    watcher.start()
    if stop_at is not None:
        while len(list(stop_at.glob("part-*"))) < parts:
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
    process.wait()
    watcher.join()
    return time.perf_counter() - begin, sum(spent.values()), largest / 2**20


def alike(one: Path, other: Path) -> bool:
    """Tell whether two folders hold the same bytes."""
    names = sorted(os.listdir(one))
    same, _, _ = filecmp.cmpfiles(one, other, names, shallow=False)
    return names == sorted(os.listdir(other)) == sorted(same)


def main() -> None:
    """Print a Markdown table."""
    folder, count = Path(sys.argv[1]), int([*sys.argv, "1000"][2])
    table = parts(folder, count)
    subprocess.run([BIN / "dmpcli", "record", "-o", folder / "demo.parquet", "-q"], check=True)
    fit = [BIN / "dmpcli", "fit", folder / "demo.parquet", "-o", folder / "skill.json", "-q"]
    subprocess.run(fit, check=True)
    for name in ("stopped", "first", "kept", "one", "cache"):
        shutil.rmtree(folder / name, ignore_errors=True)
    jobs, cache = ("--jobs", "2"), ("--surface-cache", str(folder / "cache"))
    print(f"| {count} STL files, {2 * (SIDE - 1) ** 2} faces, one pair | wall s | CPU s | MiB |")
    print("| --- | ---: | ---: | ---: |")
    half = max(1, count // 32)
    rows = {
        "stopped half way": measured(
            command(folder, table, "stopped", *jobs), folder / "stopped", half
        ),
        "going on": measured(command(folder, table, "stopped", *jobs)),
        "in one go, the cache empty": measured(command(folder, table, "first", *jobs, *cache)),
        "with the cache": measured(command(folder, table, "kept", *jobs, *cache)),
        "one job": measured(command(folder, table, "one")),
    }
    for name, (wall, spent, memory) in rows.items():
        print(f"| {name} | {wall:.1f} | {spent:.1f} | {memory:.0f} |", flush=True)
    same = all(alike(folder / "one", folder / name) for name in ("stopped", "first", "kept"))
    status = pq.read_table(folder / "one" / "pairs.parquet")["status"].to_pylist()
    named = sum(f"stl/{i}.stl" in said for i, said in enumerate(status) if said != "ok")
    kept = [path.stat().st_size for path in (folder / "cache").iterdir()]
    print(
        f"\nThe same bytes: {'yes' if same else 'NO'}; bad parts named: {named} of {BAD}; ", end=""
    )
    print(f"drawn: {status.count('ok')}; a kept mesh has {max(kept) / 1e6:.1f} MB at most")


if __name__ == "__main__":
    main()
