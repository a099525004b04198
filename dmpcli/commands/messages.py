"""What every command says on standard error, and how messages name the file at fault."""

import contextlib
import sys
from collections.abc import Callable, Iterator

from dmpcli.errors import DmpError


def tell(message: str, quiet: bool = False) -> None:
    """Write a message for a person; standard output is for data only."""
    if not quiet:
        print(message, file=sys.stderr)  # noqa: T201


def warn(message: str) -> None:
    """Write what a person must know even with ``--quiet``."""
    print(f"dmpcli: {message}", file=sys.stderr)  # noqa: T201


@contextlib.contextmanager
def about(name: str, kind: type[DmpError] = DmpError) -> Iterator[None]:
    """Put a file's name before the messages of errors that mathematics raises about it.

    Parameters
    ----------
    name : str
    kind : type of DmpError
        Others are about something else, and pass as they are.
    """
    try:
        yield
    except kind as error:
        raise type(error)(f"{name}: {error}") from None


@contextlib.contextmanager
def progress(label: str, total: int, quiet: bool = False) -> Iterator[Callable[[int], None]]:
    """Show a progress bar on a terminal; elsewhere, or when quiet, nothing.

    Yields
    ------
    callable
        Takes the number of steps done since the last call.
    """
    if quiet or not sys.stderr.isatty():
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
