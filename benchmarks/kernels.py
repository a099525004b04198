"""Compiled kernels beside numpy, in turn. ``python -m benchmarks.kernels OUT [SECTION ...]``.

Sections: ``lift`` (charts and lift on meshes, one process), ``draw`` (as a part of a batch is
drawn, two processes, in memory), ``surface`` (`--orientation surface`, on a plane and on a mesh),
``files`` (a part to Parquet beside memory), ``start`` (one stroke, a whole process). Times are of
the processor but where it says so, so that what else a machine does tells less; each is the median
of turns A B A B ...
"""

import multiprocessing
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import trimesh

from benchmarks.batches import curved_pairs, level_pairs
from benchmarks.cluster_demo import BIN
from dmpcli.arrays import Floats
from dmpcli.batch import memory
from dmpcli.batch.part import Job, Part
from dmpcli.batch.part_drawing import draw_part
from dmpcli.batch.task import Task
from dmpcli.dmp.drawn_strokes import GeneralizeOptions
from dmpcli.dmp.generalization import draw_blocks
from dmpcli.dmp.rollout import Pairs
from dmpcli.records import file_io
from dmpcli.records import skill as skill_file
from dmpcli.records.record import Form, Provenance
from dmpcli.surfaces.kernels import ready
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.plane import Plane
from tests.surfaces import cases, fields

TURNS = 3
FACES = (50_000, 500_000)
PLATE = Plane(np.array([0.0, 0.0, -17.5]), np.array([0.0, 0.0, 1.0]))


def main() -> None:
    """Run the sections that are named on the command line, or all."""
    place = Path(sys.argv[1])
    place.mkdir(parents=True, exist_ok=True)
    ready.load()
    memory.keep()  # as who draws parts does
    sections = {
        "lift": lift, "draw": draw, "surface": surface, "files": files, "start": start,
    }  # fmt: skip
    for name in sys.argv[2:] or sections:
        sections[name](place)
        print(flush=True)


def in_turn(works: Sequence[Callable[[], object]], turns: int = TURNS) -> list[float]:
    """Processor time of each work, s: medians of so many turns; once before nothing counts."""
    times: list[list[float]] = [[] for _ in works]
    for turn in range(turns + 1):
        for work, mine in zip(works, times, strict=True):
            begin = time.process_time()
            work()
            if turn:
                mine.append(time.process_time() - begin)
    return [float(np.median(mine)) for mine in times]


def field_mesh(faces: int) -> Mesh:
    """Return the bumpy field, 400 x 400 mm."""
    return Mesh(*fields.square(cases.FIELDS["bumpy"], faces, reach=200.0))


def lifted(ends: Floats, on: Mesh) -> Floats:
    """Positions of strokes on a mesh, 0 where they cannot be drawn."""
    charts = on.charts(ends[:, :3], ends[:, 3:])
    found = charts.lift(fields.strokes(charts.lengths, 500, 1))
    return np.where(found.status[:, None, None] == 0, found.position, 0.0)


def lift(_place: Path) -> None:
    """Print strokes per processor second, charts and lift, and how far they differ."""
    print("| charts and lift, 500 poses, per CPU second | numpy | kernels | ratio | apart, mm |")
    print("| --- | ---: | ---: | ---: | ---: |")
    ends = curved_pairs(500)
    for faces in FACES:
        mesh = field_mesh(faces)
        works = [partial(lifted, ends, on) for on in (mesh, mesh.with_kernels)]
        pure, fast = in_turn(works)
        apart = np.abs(works[0]() - works[1]()).max()
        rates = f"{500 / pure:.0f} | {500 / fast:.0f} | {pure / fast:.2f} | {apart:.0e}"
        print(f"| {faces} faces | {rates} |", flush=True)


def fitted(place: Path) -> Path:
    """Fit the reference's skill."""
    path = place / "skill.json"
    reference = Path("sample_runs/reference.parquet")
    subprocess.run([BIN / "dmpcli", "fit", reference, "-o", path, "-q"], check=True)
    return path


_HELD: list[tuple[Task, Floats]] = []


def drawn(task: int, first: int, count: int) -> float:
    """Draw pairs as a part is drawn; return the processor time, s."""
    job, rows = _HELD[task]
    begin = time.process_time()
    ends = rows[first : first + count]
    pairs, lasting = Pairs(ends[:, :3], ends[:, 3:]), np.full(count, job.skill.duration)
    for _ in draw_blocks(job.skill, pairs, lasting, job.surface, job.style):
        pass
    return time.process_time() - begin


def draw(place: Path) -> None:
    """Print trajectories per second of two processes that draw parts and write nothing."""
    skill, _ = skill_file.decode(file_io.read(fitted(place)))
    print("| parts of 250 pairs, 500 poses, two processes, per second of the clock | numpy "
          "| kernels | ratio | ratio of processor times |")  # fmt: skip
    print("| --- | ---: | ---: | ---: | ---: |")
    rows = curved_pairs(1000)
    for faces in FACES:
        _HELD.clear()
        mesh = field_mesh(faces)
        styles = [GeneralizeOptions(compiled=compiled) for compiled in (False, True)]
        _HELD.extend((Task(skill, mesh, style), rows) for style in styles)
        with multiprocessing.get_context("fork").Pool(2, memory.keep) as pool:
            clock: list[list[float]] = [[], []]
            processor: list[list[float]] = [[], []]
            for turn in range(TURNS + 1):
                for task in (0, 1):
                    begin = time.perf_counter()
                    parts = [(task, first, 250) for first in range(0, 1000, 250)]
                    spent = pool.starmap(drawn, parts, chunksize=1)
                    if turn:
                        clock[task].append(time.perf_counter() - begin)
                        processor[task].append(sum(spent))
        pure, fast = (float(np.median(times)) for times in clock)
        slow, quick = (float(np.median(times)) for times in processor)
        rates = f"{1000 / pure:.0f} | {1000 / fast:.0f} | {pure / fast:.2f} | {slow / quick:.2f}"
        print(f"| {faces} faces | {rates} |", flush=True)


def surface(place: Path) -> None:
    """Print strokes per processor second by the tool's turn."""
    skill, _ = skill_file.decode(file_io.read(fitted(place)))
    print("| strokes of 500 poses, drawn, per CPU second | keep, numpy | surface, numpy "
          "| surface, kernels | share of keep before | and with kernels |")  # fmt: skip
    print("| --- | ---: | ---: | ---: | ---: | ---: |")
    for name, on, rows in (
        ("plane", PLATE, level_pairs(2000)),
        (f"{FACES[0]} faces", field_mesh(FACES[0]), curved_pairs(500)),
    ):
        _HELD.clear()
        keep = GeneralizeOptions()
        turning = replace(keep, orientation="surface")
        fast = [replace(style, compiled=True) for style in (turning, keep)]
        _HELD.extend((Task(skill, on, style), rows) for style in (keep, turning, *fast))
        works = [partial(drawn, i, 0, len(rows)) for i in range(4)]
        rates = [len(rows) / spent for spent in in_turn(works)]
        shares = f"{rates[1] / rates[0]:.2f} | {rates[2] / rates[3]:.2f}"
        print(f"| {name} | {rates[0]:.0f} | {rates[1]:.0f} | {rates[2]:.0f} | {shares} |")


def processor(words: list[str]) -> float:
    """Processor time of a command that is one process, s."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(words, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def files(place: Path) -> None:
    """Print trajectories per second of a part that is drawn in memory and to Parquet, in turn."""
    skill, _ = skill_file.decode(file_io.read(fitted(place)))
    (place / "parts").mkdir(exist_ok=True)
    mesh, rows, count = field_mesh(FACES[0]), curved_pairs(1000), 1000
    print("| a part of 1000 pairs, 500 poses, one process, per CPU second | in memory | to Parquet "
          "| ratio (≥ 0.8) |")  # fmt: skip
    print("| --- | ---: | ---: | ---: |")
    for name in ("numpy", "kernels"):
        task = Task(skill, mesh, GeneralizeOptions(compiled=name == "kernels"))
        _HELD[:] = [(task, rows)]
        ends, ids = Pairs(rows[:, :3], rows[:, 3:]), list(map(str, range(count)))
        part = Part(0, np.arange(count), ids, ends, np.full(count, skill.duration))
        provenance = Provenance("generalize", {}, (), {})
        job = Job(task, False, provenance, Form(False, "zstd"), str(place / "parts"))
        memory, written = in_turn([partial(drawn, 0, 0, count), partial(draw_part, job, part)])
        rates = f"{count / memory:.0f} | {count / written:.0f} | {memory / written:.2f}"
        print(f"| {FACES[0]} faces, {name} | {rates} |", flush=True)


def start(place: Path) -> None:
    """Print what a process takes that draws one stroke on a mesh."""
    skill, part = fitted(place), place / "bumpy.ply"
    mesh = field_mesh(FACES[0])
    trimesh.Trimesh(mesh.V, mesh.F, process=False).export(part)
    ends = curved_pairs(1)[0]
    words = [BIN / "dmpcli", "generalize", skill, "-o", place / "one.parquet", "-q", "--surface"]
    words += [part, "--start", *ends[:3], "--goal", *ends[3:], "--snap-tol", 1]
    times: dict[str, list[float]] = {"auto": [], "compiled": []}
    for _ in range(2 * TURNS):
        for kernels, mine in times.items():
            mine.append(processor([str(word) for word in [*words, "--kernels", kernels]]))
    print("| one stroke on 50,000 faces, a whole process, CPU s | auto | --kernels compiled |")
    print("| --- | ---: | ---: |")
    medians = " | ".join(f"{np.median(mine):.2f}" for mine in times.values())
    print(f"| median of {2 * TURNS} | {medians} |")


if __name__ == "__main__":
    main()
