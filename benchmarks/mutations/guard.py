"""One input read under guard: how long it may take, and what may come out."""

import contextlib
import signal
import time
import traceback
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from random import Random

from benchmarks.mutations.mutator import mutated
from dmpcli.errors import DmpError
from dmpcli.records.file_io import Source

LONGEST = 5.0
"""s of the processor that one input may take."""

BAD_INPUT = 2
"""The only exit code of a file that is not read."""

Read = Callable[[Source], object]


class Hang(BaseException):
    """Not an Exception: no boundary may take it for the file's fault."""


@dataclass(frozen=True)
class Reader:
    """What is fed, and from where it starts.

    Attributes
    ----------
    name : str
    read : callable
    file : str
        What messages call the input; its ending may matter.
    seeds : tuple of bytes
        Sound inputs.
    """

    name: str
    read: Read
    file: str
    seeds: tuple[bytes, ...]

    def mutation(self, seed: int, number: int) -> bytes:
        """Return one mutation, the same whatever came before it."""
        return mutated(self.seeds, Random(f"{seed} {self.name} {number}"))


@contextlib.contextmanager
def _alarmed() -> Iterator[None]:
    def ring(*_: object) -> None:
        raise Hang

    before = signal.signal(signal.SIGPROF, ring)
    signal.setitimer(signal.ITIMER_PROF, LONGEST)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def tried(reader: Reader, content: bytes) -> tuple[str, str]:
    """Read one input; return ``read``, ``refused`` or what is wrong, and where."""
    source = Source(reader.file, content or b" ")
    begin = time.process_time()
    try:
        with _alarmed(), warnings.catch_warnings():
            warnings.simplefilter("error")
            reader.read(source)
    except DmpError as error:
        fault = _fault(reader, error)
        if fault is not None:
            return fault
    except Hang as hang:
        return "hang", _where(hang)
    except MemoryError as error:
        return "memory", _where(error)
    except Exception as error:
        return f"{type(error).__name__}: {error}", _where(error)
    else:
        return ("read", "") if time.process_time() - begin < LONGEST else ("hang", "")
    return ("refused", "") if time.process_time() - begin < LONGEST else ("hang", "")


def _fault(reader: Reader, error: DmpError) -> tuple[str, str] | None:
    """Tell what is wrong with a refusal: whose fault it is, its exit code, its words."""
    cause = error.__cause__
    if "needs more memory" in str(error):
        return "memory", _where(error)
    if isinstance(cause, Warning):
        return f"warning: {cause}", _where(cause)
    if error.exit_code != BAD_INPUT:
        return f"exit code {error.exit_code}: {error}", _where(error)
    if reader.file not in str(error):
        return f"no name of the file: {error}", type(cause).__name__ if cause else ""
    return None


def _where(error: BaseException) -> str:
    frames = [f for f in traceback.extract_tb(error.__traceback__) if "dmpcli" in f.filename]
    return f"{Path(frames[-1].filename).name}:{frames[-1].lineno}" if frames else ""
