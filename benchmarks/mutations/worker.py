"""One reader after the other in forked processes, which may hang, grow or die."""

import faulthandler
import multiprocessing
import os
import resource
import signal
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import pyarrow as pa

from benchmarks.mutations import guard
from benchmarks.mutations.guard import Reader, tried

MEMORY = 2**30
"""Bytes beyond what the process has at its start."""

DEAF = 4.0 * guard.LONGEST
"""s of the processor on one input after which a process is ended: it hears no alarm."""

STILL = 600.0
"""s of the clock on one input after which it is ended: it waits for what does not come."""

MOST_DEATHS = 50
"""Of a reader's processes; what kills more is known by then."""

Make = Callable[[Path], Reader]
"""Makes a reader; what it must write goes into the folder."""


@dataclass
class Findings:
    """What became of a reader's mutations.

    Attributes
    ----------
    name : str
    read, refused : int
    slowest : float
        s of the processor.
    grown : int
        Bytes by which the process grew at most.
    spent : float
        s of the processor, making the mutations included.
    held : list of str
        One line for each that was neither: number, kind and where.
    """

    name: str = ""
    read: int = 0
    refused: int = 0
    slowest: float = 0.0
    grown: int = 0
    spent: float = 0.0
    held: list[str] = field(default_factory=list)

    @property
    def count(self) -> int:
        """How many were tried."""
        return self.read + self.refused + len(self.held)


@dataclass(frozen=True)
class Asked:
    """What is asked of every reader.

    Attributes
    ----------
    count, seed : int
    keep : Path, optional
        Folder for the inputs that were not held.
    """

    count: int
    seed: int = 0
    keep: Path | None = None


# Places in the memory that a process shares with its parent.
_NUMBER, _BEGIN, _READ, _REFUSED, _SLOWEST, _GROWN, _SPENT, _USED = range(8)


def run(
    reader: Reader,
    asked: Asked,
    first: int = 0,
    hold: Callable[[str], None] | None = None,
    shared: Any = None,
) -> Findings:
    """Read mutations in this process.

    Parameters
    ----------
    reader : Reader
    asked : Asked
    first : int
        Number of the first.
    hold : callable, optional
        Is told of each that is neither read nor refused.
    shared : array of float, optional
        Where the state is kept up.
    """
    found = Findings(reader.name)
    for content in reader.seeds:
        sound = tried(reader, content)
        assert sound == ("read", ""), f"{reader.name}: its start is not sound: {sound}"
    before, begun = _peak(), time.process_time()
    for number in range(first, asked.count):
        if shared is not None:
            shared[_NUMBER], shared[_BEGIN] = number, time.monotonic()
            shared[_USED] = time.process_time()
        content = reader.mutation(asked.seed, number)
        begin = time.process_time()
        kind, where = tried(reader, content)
        end = time.process_time()
        found.slowest = max(found.slowest, end - begin)
        if kind == "read":
            found.read += 1
        elif kind == "refused":
            found.refused += 1
        else:
            found.held.append(f"{reader.name} {number}: {kind[:150]} ({where})")
            if hold is not None:
                hold(found.held[-1])
            if asked.keep is not None:
                (asked.keep / f"{reader.name}-{number}").write_bytes(content)
        found.grown, found.spent = _peak() - before, end - begun
        if shared is not None:
            shared[_READ], shared[_REFUSED] = found.read, found.refused
            shared[_SLOWEST], shared[_GROWN] = found.slowest, found.grown
            shared[_SPENT] = found.spent
    if shared is not None:
        shared[_NUMBER] = asked.count
    return found


def _peak() -> int:
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def _child(
    make: Make, asked: Asked, first: int, folder: Path, shared: Any, out: Connection
) -> None:
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 2)  # libraries complain there
    faulthandler.disable()
    sys.unraisablehook = lambda _: None
    pa.set_cpu_count(1)
    pa.set_io_thread_count(1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        reader = make(folder)
        # What is loaded once is not the inputs'.
        run(reader, Asked(20, asked.seed + 1))
    with Path("/proc/self/statm").open(encoding="ascii") as statm:
        size = int(statm.read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (size + MEMORY, size + MEMORY))
    run(reader, asked, first, out.send, shared)


@dataclass
class _Running:
    """A process, and what those before it have found."""

    name: str
    make: Make
    folder: tempfile.TemporaryDirectory[str]
    found: Findings
    process: BaseProcess | None = None
    shared: Any = None
    pipe: Any = None
    deaths: int = 0
    begun: float = 0.0

    def start(self, asked: Asked, first: int) -> None:
        context = multiprocessing.get_context("fork")
        self.shared = context.Array("d", 8, lock=False)
        self.shared[_NUMBER] = first
        self.pipe, out = context.Pipe(duplex=False)
        task = (self.make, asked, first, Path(self.folder.name), self.shared, out)
        self.begun = time.monotonic()
        self.process = context.Process(target=_child, args=task)
        self.process.start()
        out.close()

    def deaf(self) -> bool:
        if time.monotonic() - max(self.shared[_BEGIN], self.begun) > STILL:
            return True
        assert self.process is not None
        return self.shared[_BEGIN] > 0.0 and _used(self.process) - self.shared[_USED] > DEAF

    def drain(self) -> None:
        try:
            while self.pipe.poll():
                self.found.held.append(self.pipe.recv())
        except (EOFError, OSError):
            pass

    def collect(self) -> None:
        """Add what a process that has ended had found."""
        self.drain()
        self.pipe.close()
        s = self.shared
        self.found.read += int(s[_READ])
        self.found.refused += int(s[_REFUSED])
        self.found.slowest = max(self.found.slowest, s[_SLOWEST])
        self.found.grown = max(self.found.grown, int(s[_GROWN]))
        self.found.spent += s[_SPENT]


def _used(process: BaseProcess) -> float:
    """Processor time of a process, s; 0 where it is gone."""
    try:
        words = Path(f"/proc/{process.pid}/stat").read_text(encoding="ascii").rpartition(")")[2]
    except OSError:
        return 0.0
    return sum(map(int, words.split()[11:13])) / os.sysconf("SC_CLK_TCK")


def runs(makes: dict[str, Make], asked: Asked, jobs: int) -> Iterator[Findings]:
    """Run every reader, so many at once; yield what each has found as it ends.

    What is under way when somebody interrupts is yielded as far as it came.
    """
    waiting = list(makes.items())
    running: list[_Running] = []
    place = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
    try:
        while waiting or running:
            while waiting and len(running) < jobs:
                name, make = waiting.pop(0)
                folder = tempfile.TemporaryDirectory(dir=place)
                one = _Running(name, make, folder, Findings(name))
                one.start(asked, 0)
                running.append(one)
            time.sleep(0.05)
            for one in list(running):
                if _ended(one, asked):
                    running.remove(one)
                    one.folder.cleanup()
                    yield one.found
    except KeyboardInterrupt:
        for one in running:
            assert one.process is not None
            one.process.kill()
            one.process.join()
            one.collect()
            one.folder.cleanup()
            yield one.found


def _ended(one: _Running, asked: Asked) -> bool:
    """Look after a process; True where its reader is done."""
    assert one.process is not None
    one.drain()
    if one.process.is_alive():
        if not one.deaf():
            return False
        one.process.kill()
        how = "hang: no alarm heard"
    else:
        how = f"its process died: {one.process.exitcode}"
    one.process.join()
    number = int(one.shared[_NUMBER])
    sound = one.process.exitcode == 0 and number == asked.count
    one.collect()
    if sound:
        return True
    one.found.held.append(f"{one.name} {number}: {how}")
    if asked.keep is not None:
        reader = one.make(Path(one.folder.name))
        content = reader.mutation(asked.seed, number)
        (asked.keep / f"{one.name}-{number}").write_bytes(content)
    one.deaths += 1
    if one.deaths > MOST_DEATHS or one.shared[_BEGIN] == 0.0:
        return True  # it does not even begin, or there is no end of it
    one.start(asked, number + 1)
    return False


def table(rows: Iterable[Findings]) -> Iterator[str]:
    """Yield the lines of a Markdown table, as its rows come."""
    yield "| reader | mutations | read | refused | neither | slowest, s | grown, MiB | ms each |"
    yield "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"
    for one in rows:
        each = 1e3 * one.spent / max(one.count, 1)
        yield (
            f"| {one.name} | {one.count:,} | {one.read:,} | {one.refused:,} | {len(one.held)} "
            f"| {one.slowest:.2f} | {one.grown / 2**20:.0f} | {each:.2f} |"
        )
        for line in one.held[:12]:
            yield f"    {line!a}"


__all__ = ["Asked", "Findings", "Make", "guard", "run", "runs", "table"]
