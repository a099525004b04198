"""What a table costs beside its drawing. ``python -m benchmarks.long_tables FOLDER [ROWS ...]``.

A CSV table of so many pairs (100,000 and 10,000,000) is read, checked and written as a batch whose
drawing is replaced by nothing: what is left is the table, the ledger and the manifest. Each length
has a process of its own; processor time per pair, and the largest memory. ``resume`` instead of
lengths: 5,000 parts that were drawn, and the run that goes on. ``surfaces`` before the lengths:
a table that names one of 1,000 surfaces for each pair, of which one shard in a hundred is drawn.
"""

import contextlib
import resource
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from benchmarks.cluster_demo import BIN
from dmpcli.batch import workers
from dmpcli.batch.part import Job, Outcome, Part
from dmpcli.records import file_io

COLUMNS = "id,x0,y0,z0,xg,yg,zg"
AT_ONCE = 100_000


def table(place: Path, rows: int, surfaces: int = 0) -> Path:
    """Write a table of level pairs with ids; on one of so many planes each, if there are any."""
    path = place / (f"pairs-{rows}-on-{surfaces}.csv" if surfaces else f"pairs-{rows}.csv")
    if path.exists():
        return path
    rng = np.random.default_rng(0)
    for i in range(surfaces):
        (place / f"plane-{i}.json").write_text('{"point": [0, 0, 0], "normal": [0, 0, 1]}')
    with path.open("w") as stream:
        stream.write(COLUMNS + (",surface\n" if surfaces else "\n"))
        for first in range(0, rows, AT_ONCE):
            count = min(AT_ONCE, rows - first)
            start = rng.uniform(-300, 300, (count, 2)).round(3)
            goal = (start + rng.uniform([40, -60], [100, 60], (count, 2))).round(3)
            for i, (a, b) in enumerate(zip(start.tolist(), goal.tolist(), strict=True), first):
                on = f",plane-{rng.integers(surfaces)}.json" if surfaces else ""
                stream.write(f"p{i},{a[0]},{a[1]},0,{b[0]},{b[1]},0{on}\n")
    return path


def nothing(job: Job, parts: Iterable[Part]) -> Iterator[Outcome]:
    """Draw nothing: each part is a file of one byte."""
    for part in parts:
        file = Path(job.folder) / job.file_of(part.number)
        file.parent.mkdir(exist_ok=True)
        file.write_bytes(b"0")
        yield Outcome(part.number, {}, {}, 0, rows=len(part), size=1)


def alone(place: Path, rows: int, *more: str) -> None:
    """Run one command here, and print what it took."""
    from dmpcli.cli import main as command_line

    workers.here = nothing
    surfaces = 1000 if "--surfaces" in more else 0
    more = tuple(word for word in more if word != "--surfaces")
    path = table(place, rows, surfaces)
    words = ["generalize", place / "skill.json", "-o", place / f"batch-{rows}", "--pairs", path]
    sys.argv = ["dmpcli", *map(str, words), "-q", *more]
    begin = time.process_time()
    with contextlib.suppress(SystemExit):
        command_line()
    folder = place / f"batch-{rows}"
    # One shard of several writes no manifest.
    assert file_io.parts_of(folder) if more else (folder / file_io.MANIFEST).exists()
    spent = time.process_time() - begin
    largest = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"| {rows} {' '.join(more)} | {spent:.1f} | {1e6 * spent / rows:.2f} | {largest:.0f} |")


def resume(place: Path) -> None:
    """Print what it takes to go on from 5,000 parts."""
    path = table(place, 5_000)
    words = [BIN / "dmpcli", "generalize", place / "skill.json", "-o", place / "many"]
    words += ["--pairs", path, "--pairs-per-part", "1", "--rate", "10", "-q"]
    for shard in ("1/2", "2/2"):
        subprocess.run([*words, "--shard", shard], check=True)
    begin, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    process, queued = subprocess.Popen(words), 0.0
    while process.poll() is None:
        queued = max(queued, in_queue(process.pid))
        time.sleep(0.02)
    assert process.returncode == 0
    took = time.perf_counter() - begin
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print(
        f"going on from 5,000 parts: {took:.1f} s by the clock, processor {used:.1f} s, in line "
        f"for a processor {queued:.1f} s; it waited {took - used - queued:.1f} s for all else"
    )


def in_queue(pid: int) -> float:
    """How long a process's first thread has stood in line for a processor, s."""
    try:
        return int(Path(f"/proc/{pid}/schedstat").read_text().split()[1]) / 1e9
    except (OSError, IndexError):
        return 0.0


def main() -> None:
    """Print a Markdown table."""
    place = Path(sys.argv[1])
    place.mkdir(parents=True, exist_ok=True)
    if not (place / "skill.json").exists():
        fit = [BIN / "dmpcli", "fit", "sample_runs/reference.parquet", "-o", place / "skill.json"]
        subprocess.run([*fit, "-q"], check=True)
    if sys.argv[2:] == ["resume"]:
        resume(place)
    elif sys.argv[2:3] == ["alone"]:
        alone(place, int(sys.argv[3]), *sys.argv[4:])
    else:
        print("| pairs | processor s | µs a pair | MiB at most |")
        print("| --- | ---: | ---: | ---: |", flush=True)
        named = sys.argv[2:3] == ["surfaces"]
        more = ["--surfaces", "--shard", "1/100"] if named else []
        for rows in sys.argv[2 + named :] or ["100000", "10000000"]:
            words = [sys.executable, "-m", "benchmarks.long_tables", place, "alone", rows]
            subprocess.run([*words, *more], check=True)


if __name__ == "__main__":
    main()
