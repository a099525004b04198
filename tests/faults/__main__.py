"""Run seeds: ``python -m tests.faults --seeds 10000``; one seed replays one failure."""

import argparse
import os
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

from tests.faults.planted import PLANTED
from tests.faults.runs import Finding, run


def main() -> int:
    """Run seeds; return 1 where an invariant did not hold."""
    parser = argparse.ArgumentParser(prog="python -m tests.faults", description=__doc__)
    parser.add_argument("--seeds", type=int, default=1000, help="How many.")
    parser.add_argument("--first", type=int, default=0, help="The first one.")
    parser.add_argument("--seed", type=int, help="This one alone, told whole.")

    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--planted", action="store_true", help="Look for planted defects.")
    given = parser.parse_args()
    if given.planted:
        return _look(given.seeds, given.jobs)
    if given.seed is not None:
        found = run(given.seed)
        _tell(found, whole=True)
        return bool(found.wrong)
    begun, bad, codes, commands = time.perf_counter(), 0, Counter[int](), Counter[str]()
    seeds = range(given.first, given.first + given.seeds)
    # What libraries keep for each call adds up: a process ends after some hundreds of runs.
    with get_context("spawn").Pool(given.jobs, maxtasksperchild=20) as pool:
        for found in pool.imap(run, seeds, chunksize=25):
            codes[found.code] += 1
            commands[found.command] += 1
            if found.wrong:
                bad += 1
                _tell(found)
    took = time.perf_counter() - begun
    print(f"{given.seeds} runs in {took:.0f} s, {60.0 * given.seeds / took:.0f} a minute")
    print("commands:", ", ".join(f"{name} {n}" for name, n in sorted(commands.items())))
    print("exit codes:", ", ".join(f"{code} {n}" for code, n in sorted(codes.items())))
    print(f"violations: {bad}")
    return bool(bad)


def _look(seeds: int, jobs: int) -> int:
    """Say after how many seeds each planted defect is found."""
    missed = 0
    with ProcessPoolExecutor(jobs) as pool:
        for name, found in zip(
            PLANTED, pool.map(_found, PLANTED, [seeds] * len(PLANTED)), strict=True
        ):
            missed += found is None
            where = "NOT FOUND" if found is None else f"seed {found[0]}: {found[1]}"
            print(f"{name}: {where}", flush=True)
    print(f"{len(PLANTED) - missed} of {len(PLANTED)} found within {seeds} seeds")
    return bool(missed)


def _found(name: str, seeds: int) -> tuple[int, str] | None:
    for seed in range(seeds):
        with PLANTED[name][0]():
            finding = run(seed)
        if finding.wrong:
            return seed, finding.wrong[0]
    return None


def _tell(found: Finding, whole: bool = False) -> None:
    print(f"seed {found.seed}: {found.command}, {found.stroke}; {found.faults}; exit {found.code}")
    for line in found.wrong:
        print(f"    {line}")
    if whole or found.wrong:
        print("   |", "\n   | ".join(found.told.strip().splitlines()[-4:]))
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
