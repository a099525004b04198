"""What `report` costs over a batch. ``python -m benchmarks.reports FOLDER [PLANE [MESH]]``.

Batches of so many strokes (20,000 on a plane, 2,000 on 50,000 faces) and of a fifth of them are
reported with two processes, in turn: what a stroke takes is the difference between both, so that
reading the demonstration and drawing the figures is not in it. Processor time of all processes, and
the largest memory of all of them (proportional set sizes).
"""

import subprocess
import sys
from pathlib import Path

import numpy as np
import trimesh

from benchmarks.batches import PLANE, command, curved_pairs, level_pairs, table_of
from benchmarks.cluster_demo import BIN
from benchmarks.parts import measured
from benchmarks.surfaces import FACES
from tests.surfaces import cases, fields

REFERENCE = Path("sample_runs/reference.parquet")
TURNS = 3


def batches(place: Path, plane: int, mesh: int) -> None:
    """Draw the batches, once."""
    subprocess.run([BIN / "dmpcli", "fit", REFERENCE, "-o", place / "skill.json", "-q"], check=True)
    (place / "plane.json").write_text(PLANE)
    V, F = fields.square(cases.FIELDS["bumpy"], FACES[1], reach=200.0)
    trimesh.Trimesh(V, F, process=False).export(place / "bumpy.ply")
    on_mesh = ("--surface", place / "bumpy.ply", "--snap-tol", 1, "--on-error", "skip")
    for count in (plane // 5, plane):
        folder = place / f"plane-{count}"
        if not folder.exists():
            table = table_of(place, level_pairs(count), f"level-{count}")
            subprocess.run(command(place, table, folder, "--jobs", 2), check=True)
    for count in (mesh // 5, mesh):
        folder = place / f"mesh-{count}"
        if not folder.exists():
            table = table_of(place, curved_pairs(count), f"curved-{count}")
            part = ("--pairs-per-part", max(1, mesh // 10))
            subprocess.run(command(place, table, folder, "--jobs", 2, *part, *on_mesh), check=True)


def main() -> None:
    """Print a Markdown table."""
    place = Path(sys.argv[1])
    plane, mesh = (int(word) for word in [*sys.argv[2:], "20000", "2000"][:2])
    place.mkdir(parents=True, exist_ok=True)
    batches(place, plane, mesh)
    kinds: dict[str, tuple[str, int, list[str]]] = {
        "plane": ("plane", plane, []),
        "plane, `--surface plane.json`": ("plane", plane, ["--surface", str(place / "plane.json")]),
        "50,000 faces, `--surface`": ("mesh", mesh, ["--surface", str(place / "bumpy.ply")]),
    }
    took: dict[str, list[list[float]]] = {name: [] for name in kinds}
    largest = dict.fromkeys(kinds, 0.0)
    for _ in range(TURNS):
        for name, (kind, count, more) in kinds.items():
            walls, spent = [], []
            for size in (count // 5, count):
                words = [BIN / "dmpcli", "report", REFERENCE, place / f"{kind}-{size}"]
                words += ["-o", place / "report", "--jobs", "2", "-q", *more]
                wall, processor, memory = measured([str(word) for word in words])
                walls.append(wall)
                spent.append(processor)
                largest[name] = max(largest[name], memory)
            each = (count - count // 5) / np.array([np.diff(spent)[0], np.diff(walls)[0]])
            took[name].append(each.tolist())
    print("| strokes, two processes | a second of processor | a second | MiB at most |")
    print("| --- | ---: | ---: | ---: |")
    for name, (_, count, _) in kinds.items():
        processor, wall = np.median(took[name], axis=0)
        print(f"| {count} {name} | {processor:.0f} | {wall:.0f} | {largest[name]:.0f} |")


if __name__ == "__main__":
    main()
