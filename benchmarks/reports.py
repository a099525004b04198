"""What `report` costs over a batch. ``python -m benchmarks.reports FOLDER [PLANE [MESH]]``.

Batches of so many strokes (100,000 on a plane and on 50,000 faces) are drawn once and reported, and
such of a fifth of them. Two things are told apart:

- measuring alone, of a twenty-fifth of the strokes in one process: reading the parts, figures of
  the strokes, lines of the CSV files. Processor time a stroke by kernels, least of three turns, and
  by numpy.
- the whole command with two processes, by kernels. What a stroke adds is the difference between
  both sizes, in processor time of all processes and by the clock; what is left of that without any
  stroke is starting, loading, reading the demonstration and the mesh, drawing figures and page.
  With it how long the larger one takes in all, and the largest memory of all processes
  (proportional set sizes).

``--first CHECKOUT`` is a working tree of an earlier commit, whose `report` is run in turn with this
one on a fifth and a twenty-fifth of the strokes, and the ratio of what a stroke adds is told. What
the clock says is to be believed only where nothing else runs. Six minutes and 3 GB, of which the
batches stay in FOLDER; 10000 2000 gives a rough answer in one.
"""

import argparse
import os
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import trimesh

from benchmarks.batches import PLANE, command, curved_pairs, level_pairs, table_of
from benchmarks.cluster_demo import BIN
from benchmarks.parts import measured
from benchmarks.surfaces import FACES
from dmpcli.batch import memory
from dmpcli.records import dataset, file_io
from dmpcli.records.storage import located
from dmpcli.reporting.batch import Measurement
from dmpcli.reporting.measurement_context import MeasurementContext
from dmpcli.reporting.recorded import Recorded
from dmpcli.reporting.report_surface import ReportSurface
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.plane import Plane
from dmpcli.workflows import recording, surface_input
from tests.surfaces import cases, fields

REFERENCE = Path("sample_runs/reference.parquet")
TURNS, FEWER = 3, 5
Kinds = dict[str, tuple[str, int, Path | None]]
"""What batches are called, how many strokes the larger ones have, and the surface that is named."""


def sizes(count: int) -> tuple[int, ...]:
    """Return how many strokes the batches have, the least first."""
    return count // FEWER**2, count // FEWER, count


def batches(place: Path, plane: int, mesh: int) -> None:
    """Draw the batches, once."""
    subprocess.run([BIN / "dmpcli", "fit", REFERENCE, "-o", place / "skill.json", "-q"], check=True)
    (place / "plane.json").write_text(PLANE)
    if not (place / "bumpy.ply").exists():
        V, F = fields.square(cases.FIELDS["bumpy"], FACES[1], reach=200.0)
        trimesh.Trimesh(V, F, process=False).export(place / "bumpy.ply")
    on_mesh = ("--surface", place / "bumpy.ply", "--snap-tol", 1, "--on-error", "skip")
    for count in sizes(plane):
        folder = place / f"plane-{count}"
        if not folder.exists():
            table = table_of(place, level_pairs(count), f"level-{count}")
            subprocess.run(command(place, table, folder, "--jobs", 2), check=True)
    for count in sizes(mesh):
        folder = place / f"mesh-{count}"
        if not folder.exists():
            table = table_of(place, curved_pairs(count), f"curved-{count}")
            size = min(2000, max(1, count // 2))
            part = ("--pairs-per-part", size, "--kernels", "compiled")
            subprocess.run(command(place, table, folder, "--jobs", 2, *part, *on_mesh), check=True)


def context(surface: Path | None) -> MeasurementContext:
    """Return what a report of the reference and a surface measures against."""
    seen = recording.whole(file_io.read(str(REFERENCE)), None, wrench=True)
    recorded = Recorded(seen.stroke, "reference", str(REFERENCE), "0" * 64, None)
    reference = recorded.stroke(None)
    if surface is None:
        return MeasurementContext(reference)
    found = surface_input.read(located(str(surface)), None, None).surface
    V, F = (found.V, found.F) if isinstance(found, Mesh) else (None, None)
    normal = found.normal if isinstance(found, Plane) else None
    return MeasurementContext(reference, ReportSurface(surface.name, found, V, F), normal)


def alone(sight: MeasurementContext, folder: Path) -> Callable[[], float]:
    """Return what measures a batch in this process on one thread, and tells ms a stroke."""
    batch, _ = dataset.read(located(str(folder)))
    how, none = Measurement(folder.name, sight, told=True), np.empty(0, dtype=np.int64)

    def run() -> float:
        begin = time.process_time()
        for part, rows in enumerate(batch.rows_of_parts()):
            how.part(dataset.part_of(batch, part, rows), none)
        return 1e3 * (time.process_time() - begin) / len(batch)

    run()  # what is compiled, or kept of the mesh, is there then
    return run


def measuring(kinds: Kinds, place: Path) -> None:
    """Print what measuring alone takes."""
    memory.keep()
    print("| measuring alone, one process | numpy, CPU ms a stroke | kernels | strokes per CPU s |")
    print("| --- | ---: | ---: | ---: |")
    for name, (kind, count, surface) in kinds.items():
        least = sizes(count)[0]
        sight, folder = context(surface), place / f"{kind}-{least}"
        by_kernels = alone(replace(sight, compiled=True), folder)
        compiled = min(by_kernels() for _ in range(TURNS))
        pure = alone(sight, folder)()
        row = f"{least} {name} | {pure:.3f} | {compiled:.3f} | {1e3 / compiled:.0f}"
        print(f"| {row} |", flush=True)


def reported(
    program: list[str], more: list[str], batch: Path, surface: Path | None, place: Path
) -> tuple[float, ...]:
    """Report a batch by a program; wall s, processor s, largest memory in MiB."""
    said = ["report", REFERENCE, batch, "-o", place / "report", "-q", *more]
    said += [] if surface is None else ["--surface", surface]
    quietly = ["sh", "-c", 'exec "$@" > /dev/null', "sh"]
    return measured([*quietly, *program, *(str(word) for word in said)])


def commands(kinds: Kinds, place: Path, first: Path | None) -> None:
    """Print what the whole command takes, with two processes, and an earlier one in turn."""
    ours, by = [str(BIN / "dmpcli")], ["--jobs", "2", "--kernels", "compiled"]
    heads = [
        *("whole command, `--jobs 2`, by kernels", "CPU ms a stroke", "strokes/s by the clock"),
        *("all of it, s by the clock", "without a stroke, CPU s", "MiB at most"),
        *("earlier, CPU ms a stroke", "ratio"),
    ]
    print(f"| {' | '.join(heads)} |")
    print("| --- |" + " ---: |" * (len(heads) - 1))
    for name, (kind, count, surface) in kinds.items():
        least, few, _ = sizes(count)
        spent = {
            size: reported(ours, by, place / f"{kind}-{size}", surface, place)
            for size in (few, count)
        }
        wall, processor = ((spent[count][i] - spent[few][i]) / (count - few) for i in range(2))
        rest = spent[count][1] - processor * count
        most = max(found[2] for found in spent.values())
        row = f"{count} {name} | {1e3 * processor:.3f} | {1.0 / max(wall, 1e-9):.0f}"
        row += f" | {spent[count][0]:.1f} | {rest:.1f}"
        earlier = "- | -"
        if first is not None:
            there = ["env", f"PYTHONPATH={first}", sys.executable, "-m", "dmpcli"]
            took = [
                reported(there, [], place / f"{kind}-{size}", surface, place)[1]
                for size in (least, few)
            ]
            each = (took[1] - took[0]) / (few - least)
            earlier = f"{1e3 * each:.3f} | {each / processor:.1f}"
        print(f"| {row} | {most:.0f} | {earlier} |", flush=True)


def main() -> None:
    """Print two Markdown tables."""
    if "OPENBLAS_NUM_THREADS" not in os.environ:
        # As the command line has it; the library reads it once, as it is loaded.
        os.environ["OPENBLAS_NUM_THREADS"] = "1"
        os.execv(sys.executable, [sys.executable, "-m", "benchmarks.reports", *sys.argv[1:]])
    asked = argparse.ArgumentParser()
    asked.add_argument("folder", type=Path)
    asked.add_argument("plane", type=int, nargs="?", default=100_000)
    asked.add_argument("mesh", type=int, nargs="?", default=100_000)
    asked.add_argument("--first", type=Path, help="working tree of an earlier commit")
    said = asked.parse_args()
    place: Path = said.folder
    place.mkdir(parents=True, exist_ok=True)
    batches(place, said.plane, said.mesh)
    kinds: Kinds = {
        "plane": ("plane", said.plane, None),
        "plane, `--surface plane.json`": ("plane", said.plane, place / "plane.json"),
        "50,000 faces, `--surface`": ("mesh", said.mesh, place / "bumpy.ply"),
    }
    measuring(kinds, place)
    print()
    commands(kinds, place, said.first)


if __name__ == "__main__":
    main()
