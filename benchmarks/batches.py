"""What a batch costs from the command line. ``python -m benchmarks.batches FOLDER [SECTION ...]``.

Sections, all without a word: ``pyarrow`` holds 100,000 pairs × 500 samples with two jobs against
pyarrow writing the same parts from memory in two processes; ``growth`` the cost per pair and the
memory from 20,000 to 1,000,000 pairs with --float32 (3 GB in FOLDER for a while); ``mesh`` strokes
on 50,000 faces against the same without files; ``dask`` two local workers against two jobs; ``bad``
a table with 1 % bad rows. Runs that are compared alternate; medians.
"""

import filecmp
import multiprocessing
import os
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import trimesh

from benchmarks.cluster_demo import BIN, cluster
from benchmarks.surfaces import FACES
from dmpcli.arrays import Floats
from dmpcli.batch import memory
from dmpcli.batch.task import Task
from dmpcli.dmp.drawn_strokes import GeneralizeOptions
from dmpcli.dmp.generalization import draw_blocks
from dmpcli.dmp.rollout import Pairs
from dmpcli.records import file_io
from dmpcli.records import skill as skill_file
from dmpcli.settings.batch import BatchOptions
from dmpcli.surfaces.mesh import Mesh
from tests.surfaces import cases, fields

HEADER = "x0,y0,z0,xg,yg,zg"
FEW, MANY, MILLION = 20_000, 100_000, 1_000_000
FIRST = 2 * BatchOptions().pairs_per_part
ROUNDS, GROWTH_TURNS = 4, 4
PLATE = -17.5


def main() -> None:
    """Run the sections that are named on the command line, or all."""
    place = Path(sys.argv[1])
    place.mkdir(parents=True, exist_ok=True)
    reference = Path("sample_runs/reference.parquet")
    subprocess.run([BIN / "dmpcli", "fit", reference, "-o", place / "skill.json", "-q"], check=True)
    sections: dict[str, Callable[[Path], None]] = {
        "pyarrow": against_pyarrow,
        "growth": growth,
        "mesh": on_a_mesh,
        "dask": against_dask,
        "bad": bad_rows,
    }
    for name in sys.argv[2:] or sections:
        sections[name](place)
        print(flush=True)


def level_pairs(count: int) -> Floats:
    """Start-goal pairs, shape (count, 6), 60 to 160 mm apart on a level plate."""
    rng = np.random.default_rng(5)
    start = rng.uniform([-800.0, -300.0, PLATE], [-400.0, 300.0, PLATE], (count, 3))
    angle, length = rng.uniform(-np.pi, np.pi, count), rng.uniform(60.0, 160.0, count)
    way = length[:, None] * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    return np.hstack([start, start + way])


def table_of(place: Path, rows: Floats, name: str) -> Path:
    """Write pairs as CSV, once."""
    path = place / f"{name}.csv"
    if not path.exists():
        np.savetxt(path, rows, fmt="%.3f", delimiter=",", header=HEADER, comments="")
    return path


def command(place: Path, table: Path, folder: Path, *options: object) -> list[str]:
    """Return the command line of a batch; its folder is removed first."""
    shutil.rmtree(folder, ignore_errors=True)
    words = [BIN / "dmpcli", "generalize", place / "skill.json", "--pairs", table, "-o", folder]
    return [str(word) for word in (*words, "-q", *options)]


def seconds(words: list[str]) -> float:
    """Run a command, with nothing waiting to be written to the disk, and return the wall time."""
    os.sync()
    begin = time.perf_counter()
    subprocess.run(words, check=True)
    return time.perf_counter() - begin


def spread(times: Iterable[float]) -> str:
    """Median and range."""
    found = sorted(times)
    return f"{np.median(found):.2f} ({found[0]:.2f} to {found[-1]:.2f})"


def against_pyarrow(place: Path) -> None:
    """Print wall times and memory beside what writing alone takes."""
    table = table_of(place, level_pairs(MANY), "many")
    folder, bare = place / "batch", place / "bare"
    words = command(place, table, folder, "--jobs", 2)
    rss, pss = peak(words)
    parts = sorted(folder / name for name in file_io.parts_of(folder))
    writers = [Writer(parts[i::2], bare) for i in range(2)]
    ours, theirs = [], []
    for _ in range(ROUNDS):
        shutil.rmtree(bare, ignore_errors=True)
        bare.mkdir()
        os.sync()
        begin = time.perf_counter()
        for writer in writers:
            writer.start()
        for writer in writers:
            writer.wait()
        theirs.append(time.perf_counter() - begin)
        same, _, _ = filecmp.cmpfiles(folder, bare, [part.name for part in parts], shallow=False)
        assert len(same) == len(parts), "pyarrow alone wrote something else"
        ours.append(seconds(command(place, table, folder, "--jobs", 2)))
    for writer in writers:
        writer.end()
    size = sum(part.stat().st_size for part in parts)
    shutil.rmtree(bare)
    shutil.rmtree(folder)
    ratio = np.median(ours) / np.median(theirs)
    print(f"| {MANY} pairs × 500 samples, {size / 1e6:.0f} MB | two processes |")
    print("| --- | ---: |")
    print(f"| pyarrow alone, from memory, s | {spread(theirs)} |")
    print(f"| dmpcli generalize --jobs 2, s | {spread(ours)} |")
    print(f"| ratio of the medians (≤ 1.35) | {ratio:.2f} |")
    print(f"| peak memory of all processes, RSS / PSS, MiB | {rss:.0f} / {pss:.0f} |")


class Writer:
    """A process that holds the tables of some parts in memory and writes them when told."""

    def __init__(self, parts: list[Path], folder: Path) -> None:
        self.pipe, theirs = multiprocessing.Pipe()
        context = multiprocessing.get_context("spawn")
        self.process = context.Process(target=hold_and_write, args=(parts, folder, theirs))
        self.process.start()
        self.wait()

    def start(self) -> None:
        """Have it write."""
        self.pipe.send(True)

    def wait(self) -> None:
        """Return when it has."""
        self.pipe.recv()

    def end(self) -> None:
        """End the process."""
        self.pipe.send(False)
        self.process.join()


def hold_and_write(parts: list[Path], folder: Path, pipe: Connection) -> None:
    """Hold the tables of parts, and write them whenever told, as `record.store` does."""
    tables = [pq.ParquetFile(part).read().combine_chunks() for part in parts]
    pipe.send(None)
    while pipe.recv():
        for part, table in zip(parts, tables, strict=True):
            write(table, folder / part.name)
        pipe.send(None)


def write(table: Any, path: Path) -> None:
    """Write a part with the options of `record.store`."""
    floating = [field.name for field in table.schema if pa.types.is_floating(field.type)]
    others = [name for name in table.column_names if name not in floating]
    said = {"use_byte_stream_split": floating, "use_dictionary": others}
    pq.write_table(table, path, compression="zstd", write_page_checksum=True, **said)


def peak(words: list[str]) -> tuple[float, float]:
    """Run a command; return the largest sums of RSS and of PSS over its processes, MiB."""
    process = subprocess.Popen(words)
    largest = [0.0, 0.0]

    def watch() -> None:
        while process.poll() is None:
            sums = np.sum([used(pid) for pid in family(process.pid)], axis=0)
            largest[:] = np.maximum(largest, sums).tolist()
            time.sleep(0.1)

    watching = threading.Thread(target=watch)
    watching.start()
    watching.join()
    assert process.returncode == 0
    return largest[0], largest[1]


def family(pid: int) -> list[int]:
    """Return a process and all that come from it."""
    try:
        children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    except OSError:
        children = []
    return [pid, *(one for child in children for one in family(int(child)))]


def used(pid: int) -> tuple[float, float]:
    """RSS and PSS of a process, MiB; 0 for one that has ended."""
    try:
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()[1:]
    except OSError:
        return 0.0, 0.0
    found = {line.split(":")[0]: float(line.split()[1]) / 1024 for line in lines}
    return found.get("Rss", 0.0), found.get("Pss", 0.0)


def growth(place: Path) -> None:
    """Print cost per pair and memory from few pairs to a million.

    What each process does once, the memory of its first part with it, is in the time of a batch of
    one part for each: it comes off. In one turn every size is drawn, the small ones more often.
    """
    folder = place / "batch"
    options = ("--jobs", 2, "--float32")
    sizes = {FIRST: 15, FEW: 15, MANY: 2, MILLION: 1}
    tables = {count: table_of(place, level_pairs(count), f"level-{count}") for count in sizes}
    walls: dict[int, list[float]] = {count: [] for count in sizes}
    for _ in range(GROWTH_TURNS):
        for count, times in sizes.items():
            for _ in range(times):
                walls[count].append(seconds(command(place, tables[count], folder, *options)))
    memories = {n: peak(command(place, tables[n], folder, *options)) for n in (FEW, MANY, MILLION)}
    size = sum(part.stat().st_size for part in folder.glob("*"))
    shutil.rmtree(folder)
    first = np.mean(walls[FIRST])
    print(f"{MILLION} pairs are {size / 1e9:.1f} GB; {FIRST} take {spread(walls[FIRST])} s.\n")
    print("| pairs | wall s | µs per pair after the first ones | peak RSS / PSS, MiB |")
    print("| ---: | ---: | ---: | ---: |")
    each = []
    for count in (FEW, MANY, MILLION):
        each.append(1e6 * (np.mean(walls[count]) - first) / (count - FIRST))
        rss, pss = memories[count]
        print(f"| {count} | {spread(walls[count])} | {each[-1]:.1f} | {rss:.0f} / {pss:.0f} |")
    print(f"\nLargest over smallest cost per pair (≤ 1.10): {max(each) / min(each):.2f}")


def on_a_mesh(place: Path) -> None:
    """Print trajectories per second on a mesh, with and without files."""
    folder, part = place / "batch", place / "bumpy.ply"
    field = cases.FIELDS["bumpy"]
    V, F = fields.square(field, FACES[1], reach=200.0)
    trimesh.Trimesh(V, F, process=False).export(part)
    few, many = 4_000, 16_000
    rows = curved_pairs(many)
    # The inner half: strokes that end near the border would leave it.
    words = ("--jobs", 2, "--surface", part, "--snap-tol", 1, "--on-error", "skip")
    short, long = [], []
    memory_rate = in_memory(place, V, F, rows)
    for _ in range(3):
        for count, times in ((few, short), (many, long)):
            table = table_of(place, rows[:count], f"curved-{count}")
            times.append(seconds(command(place, table, folder, *words)))
    parts = [folder / name for name in file_io.parts_of(folder)]
    good = sum(pq.read_metadata(path).num_rows for path in parts) // 501
    shutil.rmtree(folder)
    rate = (many - few) / (np.median(long) - np.median(short))
    print(f"| {len(F)} faces, {many} pairs × 501 samples, two processes | trajectories/s |")
    print("| --- | ---: |")
    print(f"| in memory | {memory_rate:.0f} |")
    print(f"| to Parquet, sustained from {few} to {many} pairs | {rate:.0f} |")
    print(f"| ratio (≥ 0.8) | {rate / memory_rate:.2f} |")
    print(f"| drawn, of {many} | {good} |")


def curved_pairs(count: int) -> Floats:
    """Start-goal pairs, shape (count, 6), 109 mm apart on the bumpy field."""
    field = cases.FIELDS["bumpy"]
    rng = np.random.default_rng(0)
    xy = rng.uniform(-80.0, 80.0, (count, 2))
    t = field.tangent(xy, rng.uniform(0.0, 2.0 * np.pi, count))
    ends = [
        field.walk(xy[i : i + 1000], t[i : i + 1000], np.full(len(xy[i : i + 1000]), 109.0))[0]
        for i in range(0, count, 1000)
    ]
    return np.hstack([field.point(*xy.T), field.point(*np.concatenate(ends).T)])


_HELD: list[tuple[Task, Floats]] = []


def in_memory(place: Path, V: Floats, F: Any, rows: Floats) -> float:
    """Trajectories per second of two processes that draw parts and write nothing."""
    skill, _ = skill_file.decode(file_io.read(place / "skill.json"))
    task = Task(skill, Mesh(V, F), GeneralizeOptions())
    _HELD.append((task, rows))
    firsts = list(range(0, 16_000, 2000))
    with multiprocessing.get_context("fork").Pool(2, memory.keep) as pool:
        pool.map(draw_only, [0, 0], chunksize=1)
        times = []
        for _ in range(3):
            begin = time.perf_counter()
            pool.map(draw_only, firsts, chunksize=1)
            times.append(time.perf_counter() - begin)
    return float(16_000 / np.median(times))


def draw_only(first: int) -> None:
    """Draw 2000 pairs as a part is drawn."""
    task, rows = _HELD[0]
    ends = rows[first : first + 2000]
    pairs = Pairs(ends[:, :3], ends[:, 3:])
    lasting = np.full(len(ends), task.skill.duration)
    for _ in draw_blocks(task.skill, pairs, lasting, task.surface, task.style):
        pass


def against_dask(place: Path) -> None:
    """Print wall times of two Dask workers and of two jobs."""
    table = table_of(place, level_pairs(MANY), "many")
    one, other = place / "batch", place / "dask"
    jobs, dask = [], []
    with cluster(place) as (address, _):
        for _ in range(ROUNDS):
            jobs.append(seconds(command(place, table, one, "--jobs", 2)))
            dask.append(seconds(command(place, table, other, "--cluster", address)))
        names = [path.name for path in one.iterdir()]
        same, _, _ = filecmp.cmpfiles(one, other, names, shallow=False)
    alike = len(same) == len(names) == len(list(other.iterdir()))
    for folder in (one, other):
        shutil.rmtree(folder)
    print(f"| {MANY} pairs × 500 samples | wall s |")
    print("| --- | ---: |")
    print(f"| --jobs 2 | {spread(jobs)} |")
    print(f"| two local Dask workers | {spread(dask)} |")
    print(f"| ratio of the medians (≤ 1.5) | {np.median(dask) / np.median(jobs):.2f} |")
    print(f"| same bytes | {'yes' if alike else 'NO'} |")


def bad_rows(place: Path) -> None:
    """Print what becomes of tables with 1 % bad rows on a plane: all three kinds, and one alone."""
    folder, plane = place / "batch", place / "plane.json"
    plane.write_text(PLANE)
    bad = np.arange(50, MANY, 100)
    print(f"| {MANY} pairs, {len(bad)} of them bad | exit | strokes | rows named | last words |")
    print("| --- | ---: | ---: | ---: | --- |")
    for kind, mode in (("all", "skip"), *((kind, "stop") for kind in ("all", *BAD))):
        rows = level_pairs(MANY)
        for i, (name, spoil) in enumerate(BAD.items()):
            which = bad[i::3] if kind == "all" else bad
            if kind in ("all", name):
                rows[which] = spoil(rows[which])
        table = table_of(place, rows, f"bad-{kind.replace(' ', '-')}")
        options = ("--surface", plane, "--jobs", 2, "--on-error", mode)
        done = subprocess.run(command(place, table, folder, *options), stderr=subprocess.PIPE)
        named = drawn = 0
        if folder.is_dir():
            status = pq.read_table(folder / file_io.TABLE)["status"].to_pylist()
            named = int(np.sum([status[row] != "ok" and "line" in status[row] for row in bad]))
            drawn = status.count("ok")
        last = done.stderr.decode().strip().splitlines()[-1].replace(f"{place}/", "")
        print(f"| {kind}, --on-error {mode} | {done.returncode} | {drawn} | {named} | {last} |")
        shutil.rmtree(folder, ignore_errors=True)


BAD: dict[str, Callable[[Floats], Floats]] = {
    "not a number": lambda rows: np.where(np.arange(6) == 1, np.nan, rows),
    "start is goal": lambda rows: np.hstack([rows[:, :3], rows[:, :3]]),
    "off the plane": lambda rows: rows + np.array([0.0, 0.0, 30.0, 0.0, 0.0, 0.0]),
}
PLANE = '{"point": [0, 0, -17.5], "normal": [0, 0, 1]}'


if __name__ == "__main__":
    main()
