"""What is told while something is worked on: remarks, doubts with their remedy, and progress.

The words go through Python's logging, to the logger ``dmpcli``: the command line writes them to
standard error, and a program that calls the package decides for itself.
"""

import contextlib
import logging
import os
import sys
from collections.abc import Callable, Iterator
from typing import Any

from dmpcli.errors import printable

LOG = logging.getLogger("dmpcli")


class Terminal(logging.Handler):
    """Writes what is told to standard error; standard output is for data only."""

    def emit(self, record: logging.LogRecord) -> None:
        """Write one message; what a person must know carries the program's name."""
        said = record.getMessage()
        say(said if record.levelno < logging.WARNING else f"dmpcli: {said}")


class Unbreakable:
    """Standard error that raises nothing: who listens no longer must not end what goes on.

    Parameters
    ----------
    stream : TextIO
    """

    def __init__(self, stream: Any) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        """Write what can be written."""
        with contextlib.suppress(OSError, ValueError):
            self._stream.write(text)
        return len(text)

    def flush(self) -> None:
        """Bring out what can be."""
        with contextlib.suppress(OSError, ValueError):
            self._stream.flush()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def prepare_streams() -> None:
    """Make standard error one that raises nothing, and fill the places of what is closed.

    The next file to be opened would else get number 2, and what libraries complain of would be
    written into it.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
    stream = sys.stderr or open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    sys.stderr = Unbreakable(stream)


def say(text: str) -> None:
    """Write lines to standard error, with what they name made printable."""
    if sys.stderr is not None:
        with contextlib.suppress(OSError, ValueError):
            print(printable(text), file=sys.stderr)  # noqa: T201


def on_terminal(quiet: bool) -> None:
    """Write what is told to standard error from now on; when quiet, only what must be known."""
    if not any(isinstance(handler, Terminal) for handler in LOG.handlers):
        LOG.addHandler(Terminal())
        LOG.propagate = False
    LOG.setLevel(logging.WARNING if quiet else logging.INFO)


def wanted() -> bool:
    """Tell whether what a person may want to know is heard at all."""
    return LOG.isEnabledFor(logging.INFO)


def tell(message: str) -> None:
    """Say what a person may want to know."""
    LOG.info("%s", message)


def warn(message: str) -> None:
    """Say what a person must know, even with ``--quiet``."""
    LOG.warning("%s", message)


class _Heard(logging.Filter):
    """Keeps what is told instead of letting it through."""

    def __init__(self) -> None:
        super().__init__()
        self.told: list[tuple[int, str]] = []

    def filter(self, record: logging.LogRecord) -> bool:
        """Keep a message."""
        self.told.append((record.levelno, record.getMessage()))
        return False


@contextlib.contextmanager
def heard() -> Iterator[list[tuple[int, str]]]:
    """Keep what is told meanwhile, with its level, for somebody else to tell."""
    kept, level = _Heard(), LOG.level
    LOG.addFilter(kept)
    LOG.setLevel(logging.INFO)
    try:
        yield kept.told
    finally:
        LOG.removeFilter(kept)
        LOG.setLevel(level)


def tell_as(level: int, message: str) -> None:
    """Say what was heard elsewhere, see `heard`."""
    LOG.log(level, "%s", message)


@contextlib.contextmanager
def progress(label: str, total: int) -> Iterator[Callable[[int], None]]:
    """Show a progress bar on the command line's terminal; elsewhere, or when quiet, nothing.

    Yields
    ------
    callable
        Takes the number of steps done since the last call.
    """
    if not _watched():
        yield lambda _: None
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    columns = (TextColumn(label), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(label, total=total)
        yield lambda steps: bar.advance(task, steps)


@contextlib.contextmanager
def status(text: str) -> Iterator[None]:
    """Show a line on the command line's terminal while something goes on; elsewhere nothing."""
    if not _watched():
        yield
        return
    from rich.console import Console

    with Console(stderr=True).status(text):
        yield


def _watched() -> bool:
    """Tell whether a person sits before the command line's terminal, and wants to be told."""
    ours = any(isinstance(handler, Terminal) for handler in LOG.handlers)
    return ours and wanted() and sys.stderr.isatty()
