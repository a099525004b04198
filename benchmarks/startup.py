"""Start-up of the installed command, whole process, beside bare Python. ``make bench``."""

import subprocess
import sys
import time
from pathlib import Path

import numpy as np

RUNS = 15
DMPCLI = str(Path(sys.executable).with_name("dmpcli"))


def main() -> None:
    """Print a Markdown table."""
    commands = {
        "python -c pass": [sys.executable, "-c", "pass"],
        "dmpcli --version": [DMPCLI, "--version"],
        "dmpcli --help": [DMPCLI, "--help"],
        "dmpcli fit --help": [DMPCLI, "fit", "--help"],
    }
    print("| start-up | median ms | least ms |")
    print("| --- | ---: | ---: |")
    for name, command in commands.items():
        times = []
        for _ in range(RUNS + 1):
            begin = time.perf_counter()
            subprocess.run(command, capture_output=True, check=True)
            times.append(1e3 * (time.perf_counter() - begin))
        print(f"| `{name}` | {np.median(times[1:]):.0f} | {min(times[1:]):.0f} |")


if __name__ == "__main__":
    main()
