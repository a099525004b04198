"""Mutations of every importer's file: how many are read, how many refused; none may do more.

Usage: python -m benchmarks.mutated_imports [COUNT] [IMPORTER ...]
"""

import sys
import tempfile
import time
import warnings
from pathlib import Path

from tests.formats.importers import FOLDERS, IMPORTERS
from tests.formats.mutations import survived


def main(count: int, names: list[str]) -> None:
    """Run them one importer after the other, and print a line for each."""
    warnings.simplefilter("ignore")
    for name in names or [*IMPORTERS, *FOLDERS]:
        with tempfile.TemporaryDirectory() as folder:
            if name in IMPORTERS:
                read, content = IMPORTERS[name]
            else:
                make, which = FOLDERS[name]
                read, content = make(Path(folder), which)
            begun = time.monotonic()
            taken, refused = survived(read, content, count, seed=20)
            seconds = time.monotonic() - begun
            print(f"{name:14} {taken:6} read {refused:6} refused {seconds:7.1f} s", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20_000, sys.argv[2:])
