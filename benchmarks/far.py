"""What far more strokes than one machine draws would cost. ``python -m benchmarks.far FOLDER``.

Strokes on a plane and on a mesh of 50,000 faces are drawn into a folder and into an object store on
loopback (moto), each at two lengths of the table; the difference of the two is what a stroke costs,
and the rest what a process costs before its first. Processor time of all processes of the command,
without the store's; a table that is read and not drawn is measured by `benchmarks.long_tables`.

From that: hours of a core, bytes and requests for a million strokes on a mesh and 10^8 on a plane.
It is extrapolated: that a stroke costs the same however many there are (docs/batches.md, 20,000 to
1,000,000 pairs), a core is one like this one and has nothing else to do, the network takes what is
drawn, and no machine is lost. ``--price CORE_HOUR GB_MONTH 1000_REQUESTS`` makes money of it.
"""

import argparse
import json
import resource
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import trimesh

from benchmarks.batches import FACES, curved_pairs, level_pairs, table_of
from benchmarks.cluster_demo import BIN
from tests.object_store import BUCKET, Store, empty, environment_of, served
from tests.surfaces import cases, fields

PLANE, MESH = (20_000, 60_000), (2_000, 6_000)
WANTED = (("plane", 100_000_000), ("mesh", 1_000_000))
TABLE = 9e-6
"""Processor time of a row of the table, s: `python -m benchmarks.long_tables`."""


@dataclass(frozen=True)
class Cost:
    """What strokes of one kind cost, one by one.

    Attributes
    ----------
    stroke : float
        s of a processor.
    begin : float
        s of a processor before the first.
    size : float
        Bytes.
    requests : float
        Of a store, by 1000 strokes; 0 of a folder.
    """

    stroke: float
    begin: float
    size: float
    requests: float


def main() -> None:
    """Print Markdown tables."""
    arguments = argparse.ArgumentParser()
    arguments.add_argument("folder", type=Path)
    arguments.add_argument("--price", type=float, nargs=3)
    arguments.add_argument("--quick", action="store_true", help="a tenth of the strokes")
    asked = arguments.parse_args()
    place = asked.folder
    place.mkdir(parents=True, exist_ok=True)
    skill = place / "skill.json"
    fit = [BIN / "dmpcli", "fit", "sample_runs/reference.parquet", "-o", skill, "-q"]
    subprocess.run(fit, check=True)
    print("| on | into | ms of a core a stroke | s before the first | kB | requests by 1000 |")
    print("| --- | --- | ---: | ---: | ---: | ---: |", flush=True)
    found = {}
    with served() as store:
        for kind, lengths in (("plane", PLANE), ("mesh", MESH)):
            for where in ("folder", "store"):
                sizes = [n // (10 if asked.quick else 1) for n in lengths]
                cost = measured(place, skill, kind, where, sizes, store)
                found[kind, where] = cost
                print(
                    f"| {kind} | {where} | {1e3 * cost.stroke:.3f} | {cost.begin:.1f} | "
                    f"{cost.size / 1e3:.2f} | {cost.requests:.2f} |",
                    flush=True,
                )
    print(
        "\n| strokes | hours of a core | table, h a reader | GB | requests | B/s a core |", end=""
    )
    print(" money |" if asked.price else "")
    print("| --- | ---: | ---: | ---: | ---: | ---: |" + (" ---: |" if asked.price else ""))
    for kind, number in WANTED:
        print(extrapolated(kind, number, found[kind, "store"], asked.price))


def extrapolated(kind: str, number: int, cost: Cost, price: list[float] | None) -> str:
    """Return a row of what so many strokes cost."""
    hours, size = number * cost.stroke / 3600, number * cost.size
    requests, table = number * cost.requests / 1000, number * TABLE / 3600
    row = f"| {number:,} on a {kind} | {hours:.1f} | {table:.2f} | {size / 1e9:,.0f} | "
    row += f"{requests:,.0f} | {cost.size / cost.stroke / 1e6:.1f} M |"
    if price:
        core, month, thousand = price
        row += f" {hours * core:.2f} + {size / 1e9 * month:.2f} a month + "
        row += f"{requests / 1000 * thousand:.2f} |"
    return row


def surface(place: Path) -> Path:
    """Write the mesh that `benchmarks.batches` draws on."""
    part = place / "bumpy.ply"
    if not part.exists():
        V, F = fields.square(cases.FIELDS["bumpy"], FACES[1], reach=200.0)
        trimesh.Trimesh(V, F, process=False).export(part)
    return part


def measured(
    place: Path, skill: Path, kind: str, where: str, lengths: list[int], store: Store
) -> Cost:
    """Draw two tables of one kind, and return what a stroke of it costs."""
    used, sizes, asked = [], [], []
    rows = level_pairs(lengths[1]) if kind == "plane" else curved_pairs(lengths[1])
    more = ["--pairs-per-part", "1000", "--on-error", "skip", "-q"]
    if kind == "mesh":
        more += ["--surface", surface(place), "--snap-tol", "1", "--kernels", "compiled"]
    for number, count in enumerate([100, *lengths]):
        table = table_of(place, rows[:count], f"{kind}-{count}")
        folder = place / "batch"
        shutil.rmtree(folder, ignore_errors=True)
        empty(store)
        output = str(folder) if where == "folder" else f"s3://{BUCKET}/batch"
        words = [BIN / "dmpcli", "generalize", skill, "-o", output, "--pairs", table, *more]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        environment = environment_of(store) | {"OPENBLAS_NUM_THREADS": "1"}
        subprocess.run(list(map(str, words)), check=True, env=environment)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        if number == 0:  # what is compiled once on a machine
            continue
        used.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
        asked.append(len(store.requests))
        if where == "folder":
            found = json.loads((folder / "_manifest.json").read_text())
        else:
            found = json.loads(store.objects("batch/_manifest")[".json"])
        assert found["drawn"] > 0.9 * count
        sizes.append(sum(part["bytes"] for part in found["parts"]))
    shutil.rmtree(folder, ignore_errors=True)
    empty(store)
    extra = lengths[1] - lengths[0]
    stroke = (used[1] - used[0]) / extra
    return Cost(
        stroke,
        used[0] - stroke * lengths[0],
        (sizes[1] - sizes[0]) / extra,
        1000 * (asked[1] - asked[0]) / extra,
    )


if __name__ == "__main__":
    main()
