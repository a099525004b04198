"""Command line; see the package."""

import argparse
import signal
import sys
import tempfile
from pathlib import Path

from benchmarks import mutations
from benchmarks.mutations import importers, records
from benchmarks.mutations.worker import Asked, Findings, Make, runs, table
from dmpcli.records.file_io import Source

GROUPS: dict[str, dict[str, Make]] = {"readers": records.MAKES, "importers": importers.MAKES}
MAKES = {name: make for group in GROUPS.values() for name, make in group.items()}


def main() -> None:
    """Run what the command line names."""
    parser = argparse.ArgumentParser(
        description=(mutations.__doc__ or "").split("\n")[0],
        epilog=f"Groups: {', '.join(GROUPS)}; readers: {', '.join(MAKES)}",
    )
    parser.add_argument("reader", nargs="*", help="of the groups and readers below; all by default")
    parser.add_argument("--count", type=int, default=2000, help="mutations of each [2000]")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--keep", type=Path, help="folder for the inputs that were not held")
    parser.add_argument("--again", action="store_true", help="one mutation: READER NUMBER")
    asked = parser.parse_args()
    if asked.again:
        _again(" ".join(asked.reader[:-1]), asked.seed, int(asked.reader[-1]))
        return
    if asked.keep is not None:
        asked.keep.mkdir(parents=True, exist_ok=True)
    wanted: dict[str, Make] = {}
    for name in asked.reader or GROUPS:
        wanted |= GROUPS[name] if name in GROUPS else {name: MAKES[name]}
    for name in (signal.SIGTERM, signal.SIGINT):  # in the background SIGINT may be ignored
        signal.signal(name, signal.default_int_handler)
    found: list[Findings] = []

    def kept() -> object:
        for one in runs(wanted, Asked(asked.count, asked.seed, asked.keep), asked.jobs):
            found.append(one)
            yield one

    for line in table(kept()):
        print(line, flush=True)
    held = sum(len(one.held) for one in found)
    print(f"{sum(one.count for one in found):,} mutations, {held} neither read nor refused")
    sys.exit(1 if held or len(found) < len(wanted) else 0)


def _again(name: str, seed: int, number: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        reader = MAKES[name](Path(folder))
        content = reader.mutation(seed, number)
        sys.stdout.buffer.write(content[:2000] + b"\n")
        sys.stdout.flush()
        reader.read(Source(reader.file, content or b" "))


if __name__ == "__main__":
    main()
