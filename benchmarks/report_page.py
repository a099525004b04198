"""What a report of six files costs: processor time in process, and the size of its page.

    python -m benchmarks.report_page

A recording, two skills, a stroke on a flat place and two on a curved part, and the run of one of
them that presses; all are held against the part. The first report loads what reports load; of five
more the median counts. At most 3 s, and 1 MB.
"""

import statistics
import sys
import tempfile
import time
from pathlib import Path

import dmpcli
from dmpcli import messages
from dmpcli.arrays import Floats

PART = Path(__file__).parents[1] / "sample_runs" / "bench.stl"
TIMES, MOST_SECONDS, MOST_BYTES = 5, 3.0, 1_000_000
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


def main() -> int:
    """Print the figures; 1 where one is missed."""
    messages.LOG.setLevel("ERROR")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        written = files(folder)
        part = dmpcli.read_surface(PART)
        dmpcli.report(*written, surface=part, output=folder / "first")
        spent = []
        for _ in range(TIMES):
            begin = time.process_time()
            dmpcli.report(*written, surface=part, output=folder / "report")
            spent.append(time.process_time() - begin)
        size = (folder / "report" / "report.html").stat().st_size
    seconds = statistics.median(spent)
    good = seconds <= MOST_SECONDS and size <= MOST_BYTES
    print(
        f"report of six files: {seconds:.2f} s of processor time ({min(spent):.2f} to "
        f"{max(spent):.2f}), page of {size / 1000:.0f} kB: {'yes' if good else 'NO'}"
    )
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
