"""What is told while something is worked on: remarks, doubts with their remedy, and progress.

The words go through Python's logging, to the logger ``dmpcli``: the command line writes them to
standard error, and a program that calls the package decides for itself.
"""

import contextlib
import logging
import sys
from collections.abc import Callable, Iterator

LOG = logging.getLogger("dmpcli")


class Terminal(logging.Handler):
    """Writes what is told to standard error; standard output is for data only."""

    def emit(self, record: logging.LogRecord) -> None:
        """Write one message; what a person must know carries the program's name."""
        said = record.getMessage()
        text = said if record.levelno < logging.WARNING else f"dmpcli: {said}"
        print(text, file=sys.stderr)  # noqa: T201


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
