"""What `report` costs over a batch. ``python -m benchmarks.reports FOLDER [PLANE [MESH]]``.

Batches of so many strokes (10,000 on a plane, 400 on 50,000 faces) are reported, and such of a
fifth of them, by kernels and by numpy in turn. Three things are told apart, in processor time:
measuring alone, in one process, the best of three turns (reading the parts, figures of the strokes,
lines of the CSV files); the whole command with two processes, of which what a stroke adds is the
difference between both sizes; and what is left of that without any stroke: starting, loading,
reading the demonstration and the mesh, drawing the figures and the page. With it the largest memory
of all processes (proportional set sizes). Nothing is extrapolated. Some minutes.
"""

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
MEANS = ("pure", "compiled")


def batches(place: Path, plane: int, mesh: int) -> None:
    """Draw the batches, once."""
    subprocess.run([BIN / "dmpcli", "fit", REFERENCE, "-o", place / "skill.json", "-q"], check=True)
    (place / "plane.json").write_text(PLANE)
    if not (place / "bumpy.ply").exists():
        V, F = fields.square(cases.FIELDS["bumpy"], FACES[1], reach=200.0)
        trimesh.Trimesh(V, F, process=False).export(place / "bumpy.ply")
    on_mesh = ("--surface", place / "bumpy.ply", "--snap-tol", 1, "--on-error", "skip")
    for count in (plane // FEWER, plane):
        folder = place / f"plane-{count}"
        if not folder.exists():
            table = table_of(place, level_pairs(count), f"level-{count}")
            subprocess.run(command(place, table, folder, "--jobs", 2), check=True)
    for count in (mesh // FEWER, mesh):
        folder = place / f"mesh-{count}"
        if not folder.exists():
            table = table_of(place, curved_pairs(count), f"curved-{count}")
            part = ("--pairs-per-part", max(1, count // 2), "--kernels", "compiled")
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


def measuring(kinds: dict[str, tuple[str, int, Path | None]], place: Path) -> None:
    """Print what measuring alone takes."""
    memory.keep()
    print("| measuring alone, one process | numpy, ms | kernels, ms | strokes a second |")
    print("| --- | ---: | ---: | ---: |")
    for name, (kind, count, surface) in kinds.items():
        sight = context(surface)
        runs = {
            means: alone(replace(sight, compiled=means == "compiled"), place / f"{kind}-{count}")
            for means in MEANS
        }
        took: dict[str, list[float]] = {means: [] for means in MEANS}
        for _ in range(TURNS):
            for means in MEANS:
                took[means].append(runs[means]())
        pure, compiled = (min(took[means]) for means in MEANS)
        print(
            f"| {count} {name} | {pure:.3f} | {compiled:.3f} | {1e3 / compiled:.0f} |", flush=True
        )


def commands(kinds: dict[str, tuple[str, int, Path | None]], place: Path) -> None:
    """Print what the whole command takes, with two processes."""
    print("| whole command, `--jobs 2` | by | ms a stroke | without a stroke, s | MiB at most |")
    print("| --- | --- | ---: | ---: | ---: |")
    for name, (kind, count, surface) in kinds.items():
        for means in MEANS:
            spent, largest = [], 0.0
            for size in (count // FEWER, count):
                words = [BIN / "dmpcli", "report", REFERENCE, place / f"{kind}-{size}"]
                words += ["-o", place / "report", "--jobs", 2, "-q", "--kernels", means]
                words += [] if surface is None else ["--surface", surface]
                quietly = ["sh", "-c", 'exec "$@" > /dev/null', "sh"]
                _, processor, most = measured([*quietly, *(str(word) for word in words)])
                spent.append(processor)
                largest = max(largest, most)
            each = (spent[1] - spent[0]) / (count - count // FEWER)
            rest = spent[1] - each * count
            row = f"{count} {name} | {means} | {1e3 * each:.3f} | {rest:.1f} | {largest:.0f}"
            print(f"| {row} |", flush=True)


def main() -> None:
    """Print two Markdown tables."""
    if "OPENBLAS_NUM_THREADS" not in os.environ:
        # As the command line has it; the library reads it once, as it is loaded.
        os.environ["OPENBLAS_NUM_THREADS"] = "1"
        os.execv(sys.executable, [sys.executable, "-m", "benchmarks.reports", *sys.argv[1:]])
    place = Path(sys.argv[1])
    asked = [int(word) for word in sys.argv[2:4]]
    plane, mesh = asked + [10_000, 400][len(asked) :]
    place.mkdir(parents=True, exist_ok=True)
    batches(place, plane, mesh)
    kinds: dict[str, tuple[str, int, Path | None]] = {
        "plane": ("plane", plane, None),
        "plane, `--surface plane.json`": ("plane", plane, place / "plane.json"),
        "50,000 faces, `--surface`": ("mesh", mesh, place / "bumpy.ply"),
    }
    measuring(kinds, place)
    print()
    commands(kinds, place)


if __name__ == "__main__":
    main()
