"""Would the tests notice? Random small faults in the rooms, and which tests tell them.

    python -m tools.mutants [--count N] [--seed S] [--jobs J] [--room ROOM ...]
    python -m tools.mutants --again FILE     # what FILE lists as survived, with today's tests
    python -m tools.mutants --reach          # measure anew which tests reach which lines

A mutant is killed if a test fails, cannot be loaded, or does not end; the test is named. One that
no test reaches has survived. What is known to be the same program is in `equivalent.toml`, each
with its reason. docs/mutants.md says more. The sample depends on the seed and on each mutant's own
text alone, so that a change elsewhere does not draw another.
"""

import argparse
import collections
import gc
import hashlib
import json
import os
import random
import subprocess
import sys
import time
import tomllib
import traceback
from pathlib import Path
from typing import Any

from tools.mutants import choice, operators, reach, trial, warm

ROOMS = ("dmp", "admittance", "surfaces", "metrics", "planning", "control")
OTHERS = ("records", "reporting", "calibration")
"""Rooms whose tests judge too: they call the six in their own process."""

OUT = Path("out/mutants")
EQUIVALENT = Path(__file__).parent / "equivalent.toml"

Row = dict[str, Any]


def measured(tests: list[str], anew: bool) -> reach.Reach:
    """What each folder's tests reach in the rooms, measured in processes of their own.

    Files of tests that were changed since their folder was measured are measured by themselves.
    """
    kept: list[Path] = []
    for folder in tests:
        whole = _kept(folder)
        if anew or not whole.exists():
            _measure(folder)
        kept.append(whole)
        for file in sorted(Path(folder).rglob("test_*.py")):
            own, changed = _kept(str(file)), file.stat().st_mtime
            if changed > whole.stat().st_mtime:
                if not own.exists() or changed > own.stat().st_mtime:
                    _measure(str(file))
                kept.append(own)
    return reach.read(kept)


def _kept(tests: str) -> Path:
    return OUT / "reach" / (tests.replace("/", "-") + ".json")


def _measure(tests: str) -> None:
    print(f"running {tests} under coverage", flush=True)
    command = [sys.executable, "-m", "tools.mutants", "--measure", tests]
    if subprocess.run(command, check=False).returncode:
        raise SystemExit(f"{tests}: the tests fail as they are; mend them first")


def _rank(seed: int, mutant: operators.Mutant) -> bytes:
    place = f"{seed} {mutant.file} {mutant.number}"
    return hashlib.blake2b(place.encode(), digest_size=8).digest()


_COMPILED = "from dmpcli.compiled import kernel"


def drawn(rooms: list[str], count: int, seed: int) -> list[operators.Mutant]:
    """Draw mutants at random, each place as likely as any other.

    Not of kernels: what runs of them is compiled, so that no line of theirs is seen to be reached,
    and what was kept of one would run on in its mutant.
    """
    found = [
        mutant
        for room in rooms
        for path in sorted(Path("dmpcli", room).rglob("*.py"))
        if _COMPILED not in (text := path.read_text(encoding="utf-8"))
        for mutant in operators.mutants(str(path), text)
    ]
    return sorted(found, key=lambda mutant: _rank(seed, mutant))[:count]


def listed(again: Path) -> list[operators.Mutant]:
    """Find the survivors of an earlier run again, by name."""
    left = [row for row in _rows(again) if row.get("killed") is False]
    names = {row["name"] for row in left}
    files = sorted({row["file"] for row in left})
    return [
        mutant
        for file in files
        for mutant in operators.mutants(file, Path(file).read_text(encoding="utf-8"))
        if mutant.name in names
    ]


def judged(mutant: operators.Mutant, known: reach.Reach, budget: float) -> Row:
    """Try a mutant on the tests that may tell it, stage by stage."""
    row: Row = {
        "file": mutant.file,
        "line": mutant.line,
        "room": choice.room(mutant.file),
        "operator": mutant.operator,
        "name": mutant.name,
        "killed": False,
        "tests": 0,
    }
    begun = time.monotonic()
    for tests in choice.stages(mutant, known, budget):
        row["tests"] += len(tests)
        verdict = trial.attempt(mutant.file, mutant, {test: known.seconds[test] for test in tests})
        if verdict.misfit:
            return {"misfit": True}
        row |= {"killed": verdict.killed, "by": verdict.by, "how": verdict.how}
        if verdict.trouble:
            row["trouble"] = verdict.trouble
        if verdict.killed:
            break
    row["seconds"] = round(time.monotonic() - begun, 2)
    return row


def unharmed(sample: list[operators.Mutant], known: reach.Reach, budget: float) -> Row:
    """Try modules as they are where mutants are tried: what fails there says nothing of mutants."""
    failed = []
    for mutant in sample:
        for tests in choice.stages(mutant, known, budget):
            verdict = trial.attempt(
                mutant.file, None, {test: known.seconds[test] for test in tests}
            )
            if verdict.killed or verdict.trouble:
                failed.append(f"{verdict.by} {verdict.how}{verdict.trouble}")
    return {"name": "unharmed", "failed": failed}


def run(
    mutants: list[operators.Mutant], known: reach.Reach, budget: float, jobs: int, kept: Path
) -> list[Row]:
    """Judge mutants in a few processes; what a stopped run has kept is not judged again."""
    kept.parent.mkdir(parents=True, exist_ok=True)
    done = {row["name"] for row in _rows(kept)}
    left = [mutant for mutant in mutants if mutant.name not in done]
    workers = []
    for job in range(jobs):
        worker = os.fork()
        if worker == 0:
            try:
                _work(left[job::jobs], known, budget, kept)
            except BaseException:
                traceback.print_exc()
            finally:
                os._exit(0)
        workers.append(worker)
    for worker in workers:
        os.waitpid(worker, 0)
    rows = {row["name"]: row for row in _rows(kept)}
    names = list(dict.fromkeys(["unharmed", *(mutant.name for mutant in mutants)]))
    if not rows.keys() >= set(names):
        raise SystemExit("a judge has died; run again, and it goes on from here")
    if rows["unharmed"]["failed"]:
        raise SystemExit(f"fail without a mutant too: {rows['unharmed']['failed']}")
    return [rows[name] for name in names[1:]]


def _work(mutants: list[operators.Mutant], known: reach.Reach, budget: float, kept: Path) -> None:
    """Judge mutants one after the other, each where it can be judged the soonest."""
    outer = [mutant for mutant in mutants if not mutant.in_function]

    def here(number: int) -> Row:
        if number < 0:
            return unharmed(outer[:2], known, budget)
        return judged(mutants[number], known, budget)

    anew = warm.apart(here)

    def work() -> None:
        for number, mutant in enumerate(mutants):
            row = here(number) if warm.fits(mutant) else anew(number)
            _keep(kept, anew(number) if "misfit" in row else row)
        if "unharmed" not in {row["name"] for row in _rows(kept)}:
            row = unharmed([mutant for mutant in mutants if mutant.in_function][:8], known, budget)
            _keep(kept, row | {"failed": row["failed"] + anew(-1)["failed"]})

    files = [test.partition("::")[0] for test in known.seconds]
    warm.within(files, [*reach.QUIET, "--tb=no"], work)


def _keep(kept: Path, row: Row) -> None:
    with kept.open("ab", buffering=0) as file:
        file.write((json.dumps(row, ensure_ascii=False) + "\n").encode())


def _rows(kept: Path) -> list[Row]:
    if not kept.exists():
        return []
    return [json.loads(line) for line in kept.read_text(encoding="utf-8").splitlines()]


def equivalents() -> dict[str, str]:
    """The reason by name of each mutant that is the same program."""
    if not EQUIVALENT.exists():
        return {}
    held = tomllib.loads(EQUIVALENT.read_text(encoding="utf-8"))
    return {one["mutant"]: one["reason"] for one in held["equivalent"]}


def table(rows: list[Row]) -> str:
    """Rooms by what became of their mutants; the score counts equivalents out."""
    same = equivalents()
    head = ("room", "mutants", "killed", "by kept results", "equivalent", "survived", "score")
    lines = ["| " + " | ".join(head) + " |", "|---|" + "--:|" * (len(head) - 1)]
    counts: dict[str, collections.Counter[str]] = collections.defaultdict(collections.Counter)
    for row in rows:
        kept = row["killed"] and choice.is_kept(row["by"])
        what = "killed" if row["killed"] else "equivalent" if row["name"] in same else "survived"
        for room in (row["room"], "all"):
            counts[room].update([what, "mutants", *(["kept"] if kept else [])])
    for room in [*(room for room in ROOMS if room in counts), "all"]:
        n = counts[room]
        score = n["killed"] / max(n["mutants"] - n["equivalent"], 1)
        cells = [
            room,
            *(str(n[key]) for key in ("mutants", "killed", "kept", "equivalent", "survived")),
        ]
        lines.append("| " + " | ".join([*cells, f"{score:.1%}"]) + " |")
    return "\n".join(lines)


def survivors(rows: list[Row]) -> str:
    """The mutants that no test tells, and those that are the same program, with the reason."""
    same = equivalents()
    left = sorted((r for r in rows if not r["killed"]), key=lambda r: (r["file"], r["line"]))
    lines = []
    for row in left:
        why = same.get(row["name"]) or ("reached by no test" if not row["tests"] else "")
        why = f" ({row['trouble']})" if row.get("trouble") else f"  \n  {why}" if why else ""
        lines.append(f"- {row['name']}{why}")
    return "\n".join(lines)


def main() -> int:
    """Run from the repository's folder."""
    parser = argparse.ArgumentParser(prog="python -m tools.mutants", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("--count", type=int, default=500)
    parser.add_argument("--seed", type=int)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--budget", type=float, default=20.0, help="seconds of tests for a mutant")
    parser.add_argument("--room", action="append", choices=ROOMS)
    parser.add_argument("--tests", action="append", help="folders of tests that judge, by room")
    parser.add_argument("--again", type=Path, metavar="FILE")
    parser.add_argument("--reach", action="store_true")
    parser.add_argument("--measure", help=argparse.SUPPRESS)
    args = parser.parse_args()
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    if args.measure:
        rooms = [Path.cwd() / "dmpcli" / room for room in ROOMS]
        return reach.measure(args.measure, rooms, _kept(args.measure))
    known = measured(args.tests or [f"tests/{room}" for room in ROOMS + OTHERS], args.reach)
    seed = random.SystemRandom().randrange(10**6) if args.seed is None else args.seed
    if args.again:
        mutants, kept = listed(args.again), OUT / f"again-{os.getpid()}.jsonl"
    else:
        mutants = drawn(args.room or list(ROOMS), args.count, seed)
        kept = OUT / f"seed-{seed}.jsonl"
        print(f"{len(mutants)} mutants of seed {seed}", flush=True)
    reach.load(known.modules)
    gc.collect()
    gc.freeze()
    rows = run(mutants, known, args.budget, args.jobs, kept)
    told = f"{table(rows)}\n\n{survivors(rows)}\n"
    kept.with_suffix(".md").write_text(told, encoding="utf-8")
    print(told)
    print(f"kept in {kept}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
