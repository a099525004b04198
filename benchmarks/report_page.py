"""What the pages of a report cost: processor time in process, and their size.

    python -m benchmarks.report_page

`report.html` of six files: a recording, two skills, a stroke on a flat place and two on a curved
part, and the run of one of them that presses; all are held against the part. The first report loads
what reports load; of five more the median counts. At most 3 s, and 1 MB.

`view.html` of a part of 50,000 faces with 20 strokes, apart from what they are measured by: at most
2 s, and 3 MB.
"""

import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import Any
from unittest import mock

import trimesh

import dmpcli
from benchmarks.batches import curved_pairs
from benchmarks.surfaces import FACES
from dmpcli import messages
from dmpcli.arrays import Floats
from dmpcli.reporting import turnable
from tests.surfaces import cases, fields

PART = Path(__file__).parents[1] / "sample_runs" / "bench.stl"
TIMES, MOST_SECONDS, MOST_BYTES = 5, 3.0, 1_000_000
VIEW_SECONDS, VIEW_BYTES, STROKES = 2.0, 3_000_000, 20
CURVED: tuple[Floats | list[float], ...] = (
    [-551.698, -37.58, -28.765],
    [-657.597, -43.254, -32.265],
)
FLAT: tuple[Floats | list[float], ...] = ([-701.698, 132.42, -17.538], [-807.597, 129.739, -17.518])
"""Start and goal, mm."""


def files(folder: Path) -> list[str]:
    """Write what is reported, and return its names."""
    part = dmpcli.read_surface(PART)
    demo = dmpcli.record(seed=1)
    skill, ridge = dmpcli.fit(demo), dmpcli.fit(demo, regression="ridge")
    ease = {"ease_in": 0.5, "ease_out": 0.5}
    flat = dmpcli.generalize(skill, *FLAT, **ease)
    curved = [
        dmpcli.generalize(one, *CURVED, part, orientation="surface", **ease)
        for one in (skill, ridge)
    ]
    run = dmpcli.execute(curved[0], coupling="force", force_setpoint=5.0)
    values = {
        "demo.parquet": demo, "skill.json": skill, "flat.parquet": flat,
        "curved.parquet": curved[0], "ridge.parquet": curved[1], "run.parquet": run,
    }  # fmt: skip
    for name, value in values.items():
        dmpcli.write(value, folder / name)
    return [str(folder / name) for name in values]


def report_page(folder: Path) -> tuple[list[float], int]:
    """Return the processor time of reports of six files, s, and the size of the page, bytes."""
    written = files(folder)
    part = dmpcli.read_surface(PART)
    dmpcli.report(*written, surface=part, output=folder / "first")
    spent = []
    for _ in range(TIMES):
        begin = time.process_time()
        dmpcli.report(*written, surface=part, output=folder / "report")
        spent.append(time.process_time() - begin)
    return spent, (folder / "report" / "report.html").stat().st_size


def view_page(folder: Path) -> tuple[list[float], int]:
    """Return the same of `view.html` alone, the first of which loads what it needs."""
    V, F = fields.square(cases.FIELDS["bumpy"], FACES[1], reach=200.0)
    trimesh.Trimesh(V, F, process=False).export(folder / "bumpy.ply")
    part = dmpcli.read_surface(folder / "bumpy.ply")
    rows = curved_pairs(STROKES)
    skill = dmpcli.fit(dmpcli.record(seed=1))
    drawn = dmpcli.generalize(skill, rows[:, :3], rows[:, 3:6], part)
    spent: list[float] = []
    made = turnable.page

    def timed(*words: Any) -> bytes:
        begin = time.process_time()
        content = made(*words)
        spent.append(time.process_time() - begin)
        return content

    with mock.patch.object(turnable, "page", timed):
        for _ in range(TIMES + 1):
            made_of = dmpcli.report(drawn, surface=part, output=folder / "view", view=True)
    assert len(made_of.strokes) == STROKES
    return spent[1:], (folder / "view" / "view.html").stat().st_size


def main() -> int:
    """Print the figures; 1 where one is missed."""
    messages.LOG.setLevel("ERROR")
    good = True
    for name, measure, seconds, most in (
        ("report.html of six files", report_page, MOST_SECONDS, MOST_BYTES),
        (f"view.html of 50,000 faces, {STROKES} strokes", view_page, VIEW_SECONDS, VIEW_BYTES),
    ):
        with tempfile.TemporaryDirectory() as place:
            spent, size = measure(Path(place))
        middle = statistics.median(spent)
        kept = middle <= seconds and size <= most
        good &= kept
        print(
            f"{name}: {middle:.2f} s of processor time ({min(spent):.2f} to {max(spent):.2f}), "
            f"{size / 1000:.0f} kB: {'yes' if kept else 'NO'}"
        )
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
