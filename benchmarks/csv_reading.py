"""A table of 200 MB as `fit` and `import` read it, beside pyarrow's own reader with one thread.

Usage: python -m benchmarks.csv_reading [MB]. Each of three rounds runs both in processes of their
own, one after the other; processor seconds and largest size of the process, medians. Ours is from
the file's name to the stroke: bytes, hash, text, numbers, units, rotations and all checks.
"""

import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import pyarrow as pa
import pyarrow.csv

from benchmarks.fit import recording

ROUNDS = 3
_HEAD = "import resource, sys, time\n"
_TAIL = (
    "print(time.process_time() - begin, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)"
)
PROGRAMS = {
    "pyarrow.csv.read_csv, one thread": "from pyarrow import csv\n"
    "begin = time.process_time()\n"
    "csv.read_csv(sys.argv[1], read_options=csv.ReadOptions(use_threads=False))\n",
    "dmpcli, hash included": "from dmpcli.records import file_io, recordings\n"
    "begin = time.process_time()\n"
    "source = file_io.read(sys.argv[1])\n"
    "source.sha256\n"
    "recordings.read(source)\n",
}


def main(size: float) -> None:
    """Print a Markdown table."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "long.csv"
        values, names = recording(round(size * 1e6 / 110.0))
        pyarrow.csv.write_csv(pa.table(dict(zip(names, values.T, strict=True))), path)
        print(f"{path.stat().st_size / 1e6:.0f} MB, {len(values):,} rows, {len(names)} columns\n")
        found: dict[str, list[tuple[float, float]]] = {name: [] for name in PROGRAMS}
        for _ in range(ROUNDS):
            for name, program in PROGRAMS.items():
                words = [sys.executable, "-c", _HEAD + program + _TAIL, str(path)]
                done = subprocess.run(words, check=True, capture_output=True, text=True)
                spent, peak = map(float, done.stdout.split())
                found[name].append((spent, peak))
    print("| | processor, s | peak, MiB |\n| --- | ---: | ---: |")
    seconds = {}
    for name, runs in found.items():
        seconds[name] = statistics.median(spent for spent, _ in runs)
        print(f"| {name} | {seconds[name]:.2f} | {max(peak for _, peak in runs):.0f} |")
    theirs, ours = seconds.values()
    each = [o[0] / t[0] for t, o in zip(*found.values(), strict=True)]
    print(
        f"| ratio (of each round: {', '.join(f'{r:.2f}' for r in each)}) | {ours / theirs:.2f} | |"
    )


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 216.0)
