"""Time and memory of fits. ``make bench``; ``python -m benchmarks.fit long`` for the longest.

The reference stroke, 500 samples × 6: medians and minima over many runs of one process; the ratio
to one ``numpy.linalg.solve`` of 80 equations in the same run lets machines be compared. Thirty
letters by N as the tolerance asks, and N = 2000. Then whole processes on a recording of a
million rows at 1 kHz.
"""

import sys
import tempfile
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq

from benchmarks.whole_process import taken
from dmpcli.arrays import Floats
from dmpcli.dmp import reference_paths
from dmpcli.dmp.canonical_system import even_in_time, phase
from dmpcli.dmp.learning import fit
from dmpcli.dmp.options import FitOptions
from dmpcli.dmp.preprocessing import preprocess
from dmpcli.dmp.regression import BandedRegression
from dmpcli.metrics.paper_values import REPRODUCTION
from dmpcli.spatial import rotations
from dmpcli.spatial.trajectory import Trajectory
from tests import cases

RUNS = 200
ROWS = 1_000_000


def milliseconds(task: Callable[[], object], runs: int = RUNS) -> tuple[float, float]:
    """Return the median and the minimum of so many runs after some warm ones, ms."""
    for _ in range(min(10, runs)):
        task()
    times = []
    for _ in range(runs):
        begin = time.perf_counter()
        task()
        times.append(1e3 * (time.perf_counter() - begin))
    return float(np.median(times)), min(times)


def reference() -> Trajectory:
    """Return the paper's stroke with a turning tool, 500 samples."""
    t = np.linspace(0.0, 10.0, 500)
    angles = np.stack([np.pi + 0.1 * np.sin(t), 0.1 * np.cos(t) - 0.1, 0.05 * t], axis=1)
    start, goal = np.array(REPRODUCTION.start), np.array(REPRODUCTION.goal)
    position = reference_paths.sine(start, goal, REPRODUCTION.demonstration, t, 10.0)
    return Trajectory(t, position, rotations.from_euler(angles))


def letters() -> Trajectory:
    """Return thirty cursive letters."""
    table = cases.letters()
    return Trajectory(table[:, 0], table[:, 1:4])


def short() -> None:
    """Print a Markdown table of the reference stroke."""
    stroke = reference()
    s = phase(np.linspace(0.0, 10.0, 641), 5.0, 1.0)
    basis = even_in_time(80, 10.0, 5.0, 1.0)
    forcing = np.random.default_rng(0).normal(size=(641, 6))
    square = np.random.default_rng(1).normal(size=(80, 80)) + 80 * np.eye(80)
    skill = fit([stroke], FitOptions()).skill
    t = np.linspace(0.0, skill.duration, 500)
    paper = FitOptions(alpha_1=1.7, widths="power", learning="paper")
    rows: dict[str, Callable[[], object]] = {
        "numpy.linalg.solve, 80 × 80, 6 right sides": lambda: np.linalg.solve(
            square, square[:, :6]
        ),
        "parts of the recording, noise, spline": lambda: preprocess(stroke),
        "regression, LWR": lambda: BandedRegression(basis, s).fit("lwr", forcing),
        "regression, ridge": lambda: BandedRegression(basis, s).fit("ridge", forcing),
        "response of eq. (9)-(11), 500 samples": lambda: skill.response(t),
        "whole fit, LWR": lambda: fit([stroke], FitOptions()),
        "whole fit, ridge": lambda: fit([stroke], FitOptions(regression="ridge")),
        "whole fit, preset paper": lambda: fit([stroke], paper),
    }
    print("| 500 samples × 6, N = 80 | median ms | least ms | × solve |")
    print("| --- | ---: | ---: | ---: |")
    unit = 1.0
    for i, (name, task) in enumerate(rows.items()):
        median, least = milliseconds(task)
        unit = median if i == 0 else unit
        print(f"| {name} | {median:.2f} | {least:.2f} | {median / unit:.1f} |", flush=True)


def many() -> None:
    """Print a Markdown table of fits with many functions."""
    stroke = letters()
    print("\n| thirty letters, 3001 samples | N | passes | RMS, mm | least ms | peak, MiB |")
    print("| --- | ---: | ---: | ---: | ---: | ---: |")
    for name, choices in {
        "--basis auto": FitOptions(),
        "--basis auto --regression ridge": FitOptions(regression="ridge"),
        "--basis 2000": FitOptions(basis=2000),
        "--basis 2000 --regression ridge": FitOptions(basis=2000, regression="ridge"),
    }.items():
        _, least = milliseconds(lambda c=choices: fit([stroke], c), 3)  # type: ignore[misc]
        tracemalloc.start()
        result = fit([stroke], choices)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        print(
            f"| {name} | {len(result.skill.basis)} | {result.skill.passes} "
            f"| {result.reproductions[0].rms:.4f} | {least:.0f} | {peak / 2**20:.0f} |",
            flush=True,
        )


def recording(rows: int) -> tuple[Floats, list[str]]:
    """Columns of 150 loops with 0.05 mm of noise and a tool that turns, 1 kHz."""
    t = np.arange(rows) / 1000.0
    a = 2.0 * np.pi * 150.0 * t / t[-1]
    position = np.column_stack([1500 * t / t[-1] + 6 * np.sin(a), 20 * np.cos(a), 0 * t])
    position += np.random.default_rng(1).normal(0.0, 0.05, position.shape)
    half = 0.1 * np.sin(a)
    quaternion = np.column_stack([np.cos(half), np.sin(half), 0 * t, 0 * t])
    return np.column_stack([t, position, quaternion]), ["t", *"xyz", "qx", "qy", "qz", "qw"]


def long() -> None:
    """Print a Markdown table of whole processes: time of the clock, of the processor, memory."""
    values, names = recording(ROWS)
    print(f"\n| `dmpcli fit`, {ROWS} rows at 1 kHz | clock, s | processor, s | peak, MiB | |")
    print("| --- | ---: | ---: | ---: | --- |")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for columns in (4, 8):
            table = pa.table(dict(zip(names[:columns], values.T, strict=False)))
            pq.write_table(table, folder / "long.parquet")
            pyarrow.csv.write_csv(table, folder / "long.csv")
            for kind in ("parquet", "csv"):
                words = ["fit", f"long.{kind}", "-o", "skill.json"]
                print(f"| {kind}, {columns} columns | {_process(words, folder)} |", flush=True)


def _process(words: list[str], folder: Path) -> str:
    """Return cells of one run of the installed command."""
    done = taken(words, folder)
    said = next(line for line in done.stderr.splitlines() if "N = " in line)
    return f"{done.cells} | {said.split(', ')[1]}"


def main() -> None:
    """Print all tables."""
    if sys.argv[1:] != ["long"]:
        short()
        many()
    long()


if __name__ == "__main__":
    main()
