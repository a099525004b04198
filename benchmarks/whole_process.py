"""What a run of the installed command takes: time of the clock, of the processor, memory."""

import resource
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

# Of its own the child knows its largest size; ours would count all children together.
_PROGRAM = (
    "import resource, subprocess, sys; done = subprocess.run(sys.argv[1:]); "
    "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss); sys.exit(done.returncode)"
)


@dataclass(frozen=True)
class Taken:
    """What it took.

    Attributes
    ----------
    clock, processor : float
        s.
    peak : float
        Largest size, MiB.
    stderr : str
    """

    clock: float
    processor: float
    peak: float
    stderr: str

    @property
    def cells(self) -> str:
        """Cells of a Markdown table: clock, processor, peak."""
        return f"{self.clock:.1f} | {self.processor:.1f} | {self.peak:.0f}"


def taken(words: list[str], folder: Path) -> Taken:
    """Run ``dmpcli`` with these words in a folder."""
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-c", _PROGRAM, str(Path(sys.executable).with_name("dmpcli")), *words],
        cwd=folder,
        capture_output=True,
        text=True,
        check=True,
    )
    clock = time.perf_counter() - begin
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Taken(clock, spent, int(done.stdout) / 2**10, done.stderr)
