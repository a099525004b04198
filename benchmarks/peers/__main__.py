"""``make peers``: dmpcli beside other DMP packages in one run, on one thread each.

Fit, accuracy and throughput on the paper's stroke in six dimensions, 500 samples, and what the
machine itself could do at best. Prints docs/peers.md.
"""

import os
import sys
import tempfile
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import torch
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from benchmarks.accuracy import against_solve_ivp
from benchmarks.peers.models import (
    BASIS,
    D,
    K,
    Model,
    MovementPrimitives,
    Ours,
    Peer,
    ProDmp,
    PyDmps,
)
from dmpcli.arrays import Floats
from dmpcli.dmp import reference_paths
from dmpcli.metrics.paper_values import REPRODUCTION

SAMPLES, ROUNDS, MANY = 500, 3, 10_000
CHUNKS = (5, 10, 25, 50, 100, 200)
LOOPED = 50
"""Pairs that stand for more in packages that take one after the other."""

ALONE = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}


def main() -> None:
    """Print the page."""
    torch.set_num_threads(1)
    t, Y = demonstration()
    peers: list[Peer] = [
        MovementPrimitives("rk4-cython"),
        MovementPrimitives("euler-cython"),
        ProDmp(torch.float32, CHUNKS[0]),
        ProDmp(torch.float64, CHUNKS[0]),
        PyDmps(),
    ]
    ours = [Ours("keep"), Ours("surface")]
    models: list[Model] = [*ours, *peers]
    fits = {model.name: least(lambda m=model: m.fit(t, Y)) for model in models}
    for peer in peers:
        if isinstance(peer, ProDmp):
            peer.batch = best_chunk(peer, t, Y)
    print(f"# Beside other packages\n\n{PREAMBLE.format(**versions())}")
    throughput(models, fits, Y)
    accuracy(peers, t, Y)


def demonstration() -> tuple[Floats, Floats]:
    """Times (T,), s, and poses (T, 6), mm and rad, of the paper's stroke with a turning tool."""
    t = np.linspace(0.0, 10.0, SAMPLES)
    start, goal = np.array(REPRODUCTION.start), np.array(REPRODUCTION.goal)
    position = reference_paths.sine(start, goal, REPRODUCTION.demonstration, t, 10.0)
    s = reference_paths.minimum_jerk(t, 10.0)
    swing = 0.05 * np.sin(2.0 * np.pi * s)
    angles = np.stack([np.full(SAMPLES, 3.0) + swing, 0.02 * s, swing], axis=1)
    return t, np.hstack([position, angles])


def new_pairs(Y: Floats, count: int) -> tuple[Floats, Floats]:
    """Poses (B, 6) at starts and goals on a level plate; angles as demonstrated."""
    rng = np.random.default_rng(7)
    start, goal = np.tile(Y[0], (count, 1)), np.tile(Y[-1], (count, 1))
    start[:, :2] += rng.uniform(-300.0, 300.0, (count, 2))
    angle, length = rng.uniform(-np.pi, np.pi, count), rng.uniform(60.0, 160.0, count)
    way = length[:, None] * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    goal[:, :3] = start[:, :3] + way
    return start, goal


def seconds(task: Callable[[], object]) -> float:
    """Wall time of one call, s."""
    begin = time.perf_counter()
    task()
    return time.perf_counter() - begin


def least(task: Callable[[], object]) -> float:
    """Return the least wall time of ten calls after a first, s."""
    task()
    return min(seconds(task) for _ in range(10))


def best_chunk(model: ProDmp, t: Floats, Y: Floats) -> int:
    """Pairs at once with which the package is fastest."""
    model.fit(t, Y)
    start, goal = new_pairs(Y, 200)
    times = {}
    for chunk in CHUNKS:
        model.batch = chunk
        run = model.prepare(start, goal)
        times[chunk] = min(seconds(run) for _ in range(3))
    return min(times, key=lambda chunk: times[chunk])


def throughput(models: list[Model], fits: dict[str, float], Y: Floats) -> None:
    """Print trajectories per second, interleaved, medians of rounds."""
    tasks: dict[tuple[str, int], tuple[int, Callable[[], object]]] = {}
    counts = (1, 100, MANY)
    for model in models:
        for count in counts:
            taken = min(count, LOOPED) if model.batch == 1 else count
            tasks[model.name, count] = taken, model.prepare(*new_pairs(Y, taken))
    names = [model.name for model in models]
    for count in counts:
        tasks[FILL, count] = count, lambda n=count: fill(n)
    with tempfile.TemporaryDirectory() as folder:
        for count in (100, MANY):
            tasks[WRITE, count] = count, writer(Path(folder) / "limit.parquet", count)
        times: dict[tuple[str, int], list[float]] = {key: [] for key in tasks}
        for _ in range(ROUNDS):
            for key, (_, task) in tasks.items():
                times[key].append(typical(task))
    rate = {key: tasks[key][0] / float(np.median(found)) for key, found in times.items()}
    print("| trajectories per second | fit, ms | B = 1 | B = 100 | B = 10,000 | ours `keep` ÷ it |")
    print("| --- | ---: | ---: | ---: | ---: | ---: |")
    ours = rate[names[0], MANY]
    for model in models:
        shown = [figure(rate[model.name, count]) for count in counts]
        if model.batch == 1:
            shown[-1] = f"~{shown[-1]}"
        name = model.name + (f", {model.batch} at once" if isinstance(model, ProDmp) else "")
        ratio = figure(ours / rate[model.name, MANY])
        print(f"| {name} | {1e3 * fits[model.name]:.2f} | {' | '.join(shown)} | {ratio} |")
    for name in (FILL, WRITE):
        shown = [figure(rate[name, count]) if (name, count) in rate else "" for count in counts]
        print(f"| {name} | | {' | '.join(shown)} | {figure(ours / rate[name, MANY])} |")


FILL = "limit: `np.empty` + `fill` of the same array"
WRITE = "limit: the same to Parquet by pyarrow alone"


def typical(task: Callable[[], object]) -> float:
    """Return the wall time of a long task, or the median of some calls of a short one, s."""
    first = seconds(task)
    # The first call of a short one may pay for memory that the others use again.
    return first if first > 1.2 else float(np.median([seconds(task) for _ in range(5)]))


def fill(count: int) -> None:
    """Fill a fresh array of poses."""
    np.empty((count, SAMPLES, 6)).fill(1.0)


def writer(path: Path, count: int) -> Callable[[], object]:
    """Return what writes poses as `generalize --pairs` does, in parts of 2000 pairs."""
    t, Y = demonstration()
    model = Ours("keep")
    model.fit(t, Y)
    parts = []
    for first in range(0, count, 2000):
        size = min(2000, count - first)
        start, goal = new_pairs(Y, count)
        rows = slice(first, first + size)
        found = np.asarray(model.prepare(start[rows], goal[rows])())
        columns = {"id": np.repeat([str(i) for i in range(first, first + size)], SAMPLES)}
        columns["t"] = np.tile(t, size)
        columns |= {name: found[..., i].ravel() for i, name in enumerate(COLUMNS)}
        parts.append(pa.table(columns))

    def run() -> None:
        for part in parts:
            pq.write_table(
                part,
                path,
                compression="zstd",
                use_byte_stream_split=["t", *COLUMNS],
                use_dictionary=["id"],
            )

    return run


COLUMNS = ("x", "y", "z", "rx", "ry", "rz")


def figure(value: float) -> str:
    """Three digits that count, with thousands apart."""
    if value >= 1000:
        size = 10 ** (len(str(int(value))) - 3)
        return f"{round(value / size) * size:,}"
    return f"{value:.3g}"


def accuracy(peers: list[Peer], t: Floats, Y: Floats) -> None:
    """Print errors of integrator and regression."""
    print("\n| RMS at the demonstrated ends, mm | integrator | regression | whole |")
    print("| --- | ---: | ---: | ---: |")
    for regression in ("lwr", "ridge"):
        model = Ours("keep", regression)
        model.fit(t, Y)
        whole = model.result.reproductions[0].rms
        most = against_solve_ivp(model.result.skill)
        print(f"| dmpcli, {regression} | {most:.0e} at most | {whole:.4f} | {whole:.4f} |")
    for peer in peers:
        at, found = peer.reproduce()
        solved = solution(peer, Y, at / at[-1])
        demonstrated = CubicSpline(t / t[-1], Y)(at / at[-1])
        errors = [rms(found - solved), rms(solved - demonstrated), rms(found - demonstrated)]
        print(f"| {peer.name} | " + " | ".join(f"{error:.4f}" for error in errors) + " |")


def solution(peer: Peer, Y: Floats, at: Floats) -> Floats:
    """Solve a package's equations with its weights, shape (T, 6), by `solve_ivp` at rtol 1e-10."""
    forcing, goal = peer.motion(), getattr(peer, "goal", Y[-1])

    def motion(t: float, z: Floats) -> Floats:
        return np.concatenate([z[6:], K * (goal - z[:6]) - D * z[6:] + forcing(t)])

    start = np.concatenate([Y[0], np.zeros(6)])
    done = solve_ivp(motion, (0.0, 1.0), start, "DOP853", at, rtol=1e-10, atol=1e-10, max_step=0.01)
    return np.asarray(done.y[:6].T)


def rms(difference: Floats) -> float:
    """Root mean square of positions, mm."""
    return float(np.sqrt(np.mean(np.sum(difference[:, :3] ** 2, axis=1))))


def versions() -> dict[str, str]:
    """Versions of all that is compared."""
    names = ("movement-primitives", "mp-pytorch", "pydmps", "torch", "numpy")
    found = {name.replace("-", "_"): version(name) for name in names}
    return found | {"basis": str(BASIS), "samples": str(SAMPLES), "looped": str(LOOPED)}


PREAMBLE = """`make peers` measures this page and writes it anew: movement-primitives
{movement_primitives}, mp-pytorch {mp_pytorch} (torch {torch}) and pydmps {pydmps}, in an
environment of their own, beside dmpcli in one process; numpy {numpy}, one thread.

One 6-D stroke: the paper's sine period, {samples} samples, N = {basis}, k = 100, d = 20 everywhere;
pairs 60 to 160 mm apart in all directions. Medians of interleaved rounds. Every package's inputs
are made beforehand; dmpcli's time holds the charts, a full transform per pair and all six
coordinates in one fresh array. ~ is measured on {looped} pairs: those packages take one after the
other. mp-pytorch takes so many pairs at once as are fastest. Ratios hold from machine to machine,
rates do not.
"""


if __name__ == "__main__":
    wanted = {key: value for key, value in os.environ.items() if key != "OPENBLAS_CORETYPE"} | ALONE
    if wanted != dict(os.environ):
        # Libraries read these when they are loaded.
        words = [sys.executable, "-m", "benchmarks.peers", *sys.argv[1:]]
        os.execve(sys.executable, words, wanted)
    main()
