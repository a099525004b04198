"""How force is held on a true surface that is not where the plan has it: on the bench, in physics.

``python -m benchmarks.force [TABLE ...] [--seeds N] [--so-far]``; tables: ``surfaces`` (that of
``make reproduce-force``), ``stiffness``, ``landing``, ``features``, ``zero``, ``profile``,
``arms``, ``normals``, ``reports``; all without a name. Apart from them ``stability``, a map as SVG
and PNG, and ``work``, what the coupling costs in a cycle.

The stroke is the paper's, 109 mm with a wave of 50 mm, in 12 s from rest to rest at 50 Hz, with
5 N; an EC66 with joints that lag by 25 ms, a pen of 2 N/mm, friction 0.2, noise 0.05 N. What is
displaced and tilted turns about the middle of the stroke. Forces are the true ones between pen and
surface, in each millisecond of the stroke; ``position`` leads the pen 5 N deep into the plan's
surface and feels nothing, with one seed. A wave is off by the difference between what the tip drew
and the plan carried along its normals onto the true surface, in height and, point by point, in
distance.

One process; each run is kept in ``out/force-runs.jsonl`` as it ends, so that an interrupted table
goes on where it was. What is kept counts for the same package alone, source by source.
"""

import argparse
import hashlib
import json
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import force_runs, force_stability, force_work
from benchmarks.force_cases import PEN, ROOT, TABLES, Case
from dmpcli.control.force_execution import DRIFTED

KEPT = ROOT / "out" / "force-runs.jsonl"
_SAID = 72  # of why a run ended, characters
POSITION_TOO = ("surfaces", "stiffness", "landing", "features")
HEAD = (
    "contact, % | mean off, N | RMS, N | peak, N | landing, N | wave, mm | off, mm | k̂ off, % "
    "| seeds | ended"
)


class KeptRuns:
    """Results on disk, a line each.

    Parameters
    ----------
    path : Path
    """

    def __init__(self, path: Path) -> None:
        self._path, self._code = path, fingerprint()
        self._known: dict[str, dict[str, Any]] = {}

    def read(self) -> "KeptRuns":
        """Look what is there by now: another process may make another table."""
        lines = self._path.read_text().splitlines() if self._path.exists() else []
        # A line that was cut off is of a run that is made again.
        self._known = dict(found for line in lines if (found := _kept(line)) is not None)
        return self

    def get(self, case: Case, seed: int) -> dict[str, Any] | None:
        """Return a result, if it is there."""
        return self._known.get(self._key(case, seed))

    def add(self, case: Case, seed: int, result: dict[str, Any]) -> None:
        """Keep a result."""
        key = self._key(case, seed)
        self._path.parent.mkdir(exist_ok=True)
        with self._path.open("a") as file:
            said = {"key": key, "name": case.name, "seed": seed, "result": result}
            file.write(json.dumps(said, ensure_ascii=False) + "\n")

    def _key(self, case: Case, seed: int) -> str:
        drawn = {key: value for key, value in asdict(case).items() if key != "name"}
        said = json.dumps([self._code, drawn, seed], sort_keys=True)
        return hashlib.sha256(said.encode()).hexdigest()


def _kept(line: str) -> tuple[str, dict[str, Any]] | None:
    try:
        said = json.loads(line)
        return said["key"], said["result"]
    except (ValueError, KeyError):
        return None


def fingerprint() -> str:
    """Digest of the package's sources."""
    made = hashlib.sha256()
    for path in sorted((ROOT / "dmpcli").rglob("*.py")):
        made.update(path.relative_to(ROOT).as_posix().encode() + b"\0" + path.read_bytes())
    return made.hexdigest()


def rows(table: str) -> list[Case]:
    """The rows of a table, position-only ones too."""
    found = []
    for case in TABLES[table]():
        found.append(case)
        if table in POSITION_TOO:
            brief = case.brief
            found.append(Case("… position only", case.plan, case.bench, coupled=False, brief=brief))
    return found


def row(table: str, case: Case, results: list[dict[str, Any]]) -> str:
    """What several seeds gave: the worst of each, and the median in brackets."""
    name = case.name
    if table == "stiffness":
        name += f", static {static(case):.2f}"
    drawn = [one for one in results if "contact" in one]
    said = sorted({one["why"].splitlines()[0][:_SAID] for one in results if one["why"]})[:1]
    stopped = sum(bool(one["why"]) for one in results)
    ended = f"{stopped} × {said[0]}" if said else "done"
    ended += "; ".join(["", *more(results)])
    if not drawn:
        peak = max((one["peak_all"] for one in results if "peak_all" in one), default=np.nan)
        return f"| {name} | – | – | – | {peak:.2f} | – | – | – | – | {len(results)} | {ended} |"

    def cell(key: str, form: str, of: Callable[[Any], Any] = max, scale: float = 1.0) -> str:
        values = [scale * one[key] for one in drawn if key in one]
        if not values:
            return "–"
        if len(values) == 1:
            return f"{values[0]:{form}}"
        return f"{of(values):{form}} ({np.median(values):{form}})"

    def furthest(values: list[float]) -> float:
        return max(values, key=abs)

    for one in drawn:
        if "stiffness" in one:
            one["k_off"] = 100.0 * (one["stiffness"] / static(case) - 1.0)
    cells = [
        cell("contact", ".2f", min, 100.0),
        cell("mean", "+.3f", furthest),
        cell("rms", ".3f"),
        cell("peak", ".2f"),
        cell("landing", ".2f"),
        cell("wave", ".3f"),
        cell("off", ".3f"),
        cell("k_off", "+.1f", furthest),
    ]
    return f"| {name} | {' | '.join(cells)} | {len(results)} | {ended} |"


def static(case: Case) -> float:
    """Stiffness of a row's pen as the set-points meet it, N/mm."""
    pen = float(case.bench.get("stiffness", PEN))
    return force_runs.effective(pen, case.arm, case.bench.get("model", ""))


def more(results: list[dict[str, Any]]) -> list[str]:
    """What only some rows have to say."""

    def of(key: str) -> list[float]:
        return [one[key] for one in results if key in one]

    said = []
    if of("after"):
        said.append(
            f"without contact for {1e3 * max(of('gap')):.0f} ms (no loop answers within "
            f"{1e3 * max(of('answers')):.0f}); in contact on {100 * min(of('after')):.2f} % from "
            f"its answer to the end, {100 * min(of('whole')):.2f} % from the edge on, with at most "
            f"{max(of('peak_after')):.2f} N; on the edge {max(of('peak_edge')):.2f} N, along the "
            f"pen {max(of('along')):.1f} N"
        )
    if of("leans"):
        said.append(
            f"normal felt {max(of('leans')):.1f}° off the true one in the mean, "
            f"{max(of('leans_p95')):.1f}° (95 %), friction {min(of('friction')):.2f} to "
            f"{max(of('friction')):.2f}"
        )
    if max(of("zero_drift"), default=0.0) > DRIFTED:
        said.append(f"zero moved by {max(of('zero_drift')):.2f} N (told)")
    if of("unavoidable"):
        told = [one["wall"]["unavoidable"] for one in results if "wall" in one]
        ratio = max(one["across"] / one["unavoidable"] for one in results if "unavoidable" in one)
        also = f" (told: {min(told):.0f} N)" if told else ""
        said.append(
            f"across {max(of('across')):.0f} N, unavoidable {min(of('unavoidable')):.0f} N{also}, "
            f"ratio {ratio:.2f}"
        )
    return said


def main() -> None:
    """Print the tables that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    apart = {"stability": force_stability.main, "work": force_work.main}
    parser.add_argument("tables", nargs="*", metavar="TABLE", help=", ".join((*TABLES, *apart)))
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--so-far", action="store_true", help="run nothing, print what is kept")
    parser.add_argument("--keep", type=Path, default=KEPT, help="where the runs are kept")
    asked = parser.parse_args()
    if not set(asked.tables) <= {*TABLES, *apart}:
        parser.error(f"tables are {', '.join((*TABLES, *apart))}")
    for name in apart:
        if name in asked.tables:
            apart[name]()
    tables = [name for name in asked.tables if name in TABLES] if asked.tables else list(TABLES)
    kept = KeptRuns(asked.keep)
    work = [
        (case, seed)
        for seed in range(asked.seeds)
        for table in tables
        for case in rows(table)
        if case.coupled or not seed
    ]
    if not asked.so_far:
        for case, seed in work:
            if kept.read().get(case, seed) is None:
                kept.add(case, seed, force_runs.run(case, seed))
    kept.read()
    for table in tables:
        print(f"\n## {table}: the worst of the seeds (and their median)\n\n| case | {HEAD} |")
        print("| --- |" + " ---: |" * 9 + " --- |")
        for case in rows(table):
            found = [kept.get(case, seed) for seed in range(asked.seeds)]
            results = [one for one in found if one is not None]
            if results:
                print(row(table, case, results), flush=True)


if __name__ == "__main__":
    main()
