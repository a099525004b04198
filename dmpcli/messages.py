"""What is told while something is worked on: remarks, doubts with their remedy, and progress.

The words go through Python's logging, to the logger ``dmpcli``: the command line writes them to
standard error, and a program that calls the package decides for itself.
"""

import contextlib
import logging
import os
import sys
from collections.abc import Callable, Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Protocol

from dmpcli.errors import DmpError, InputError, printable

LOG = logging.getLogger("dmpcli")


class Terminal(logging.Handler):
    """Writes what is told to standard error; standard output is for data only."""

    def __init__(self) -> None:
        super().__init__()
        self.shown: Callable[[str], None] = say

    def emit(self, record: logging.LogRecord) -> None:
        """Write one message; what a person must know carries the program's name."""
        said = record.getMessage()
        self.shown(said if record.levelno < logging.WARNING else f"dmpcli: {said}")


class LogFile(logging.Handler):
    """Keeps every message with its time; where it cannot, it says so once and goes on.

    Parameters
    ----------
    path : Path
        Appended to.

    Raises
    ------
    InputError
        It cannot be written.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(logging.INFO)
        try:
            self._stream = path.open("a", encoding="utf-8")
        except OSError as error:
            raise InputError(f"--log {path}: cannot be written: {error.strerror}") from None
        self._path, self._broken = path, False

    def emit(self, record: logging.LogRecord) -> None:
        """Write one message, its lines below one another."""
        now = datetime.now(UTC).isoformat(timespec="milliseconds").removesuffix("+00:00")
        text = printable(record.getMessage()).replace("\n", "\n    ")
        try:
            self._stream.write(f"{now}Z {record.levelname.lower():7} {text}\n")
            self._stream.flush()
        except (OSError, ValueError) as error:
            if not self._broken:
                self._broken = True
                say(f"dmpcli: --log {self._path}: {error}; what follows is not in it")

    def close(self) -> None:
        """Close the file."""
        with contextlib.suppress(OSError):
            self._stream.close()
        super().close()


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
    terminal = _terminal()
    if terminal is None:
        terminal = Terminal()
        LOG.addHandler(terminal)
        LOG.propagate = False
    terminal.setLevel(logging.WARNING if quiet else logging.INFO)
    heard = any(handler.level <= logging.INFO for handler in LOG.handlers)
    LOG.setLevel(logging.INFO if heard else logging.WARNING)


@contextlib.contextmanager
def logged(path: Path | None, line: str) -> Iterator[None]:
    """Keep every message in a file too, and how the command began and ended.

    Parameters
    ----------
    path : Path or None
        No file.
    line : str
        The command line.
    """
    if path is None:
        yield
        return
    file = LogFile(path)
    LOG.addHandler(file)

    def note(level: int, text: str) -> None:
        file.handle(logging.LogRecord(LOG.name, level, "", 0, text, None, None))

    note(logging.INFO, line)
    end = "done"
    try:
        yield
    except DmpError as error:
        note(logging.ERROR, str(error))
        end = f"exit code {error.exit_code}"
        raise
    except BaseException as error:
        code = getattr(error, "exit_code", getattr(error, "code", 1))
        end = f"exit code {code}" if code else "done"
        if isinstance(error, Exception) and not hasattr(error, "exit_code"):
            note(logging.ERROR, f"a defect: {type(error).__name__}: {error}")
        raise
    finally:
        note(logging.INFO, end)
        LOG.removeHandler(file)
        file.close()


@contextlib.contextmanager
def diverted(shown: Callable[[str], bool]) -> Iterator[None]:
    """Give what would be written to standard error to something that shows it above a picture.

    Parameters
    ----------
    shown : callable
        Takes a text; False where it could not be shown, and it is written as ever.
    """
    terminal = _terminal()
    if terminal is None:
        yield
        return

    def show(text: str) -> None:
        if not shown(printable(text)):
            say(text)

    terminal.shown = show
    try:
        yield
    finally:
        terminal.shown = say


def wanted() -> bool:
    """Tell whether what a person may want to know is heard at all."""
    terminal = _terminal()
    return LOG.isEnabledFor(logging.INFO) and (
        terminal is None or any(one.level <= logging.INFO for one in LOG.handlers)
    )


def tell(message: str, facts: Mapping[str, Any] | None = None) -> None:
    """Say what a person may want to know.

    Parameters
    ----------
    message : str
    facts : mapping, optional
        The same for a program, as JSON values: what ``--json`` prints beside the message.
    """
    LOG.info("%s", message, extra={"facts": dict(facts or {})})


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


class Advance(Protocol):
    """Told how much is done."""

    def __call__(self, steps: int, failed: int = 0, left_out: int = 0) -> None:
        """So many steps since the last call, of which so many failed; some are not to be done."""


def _unseen(steps: int, failed: int = 0, left_out: int = 0) -> None:
    """Nobody looks on."""


@contextlib.contextmanager
def progress(label: str, total: int) -> Iterator[Advance]:
    """Show on the command line's terminal how far something is; elsewhere, or when quiet, nothing.

    Shown are the share done, the count, how many a second, failures, and the time that is left.

    Yields
    ------
    Advance
    """
    if not watched():
        yield _unseen
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TaskProgressColumn,
        TextColumn,
        TimeRemainingColumn,
    )

    columns = (
        TextColumn(label),
        BarColumn(),
        TaskProgressColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TextColumn("[red]{task.fields[failures]}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(label, total=total, rate="", failures="")
        failures = 0

        def advance(steps: int, failed: int = 0, left_out: int = 0) -> None:
            nonlocal failures, total
            failures, total = failures + failed, total - left_out
            speed = bar.tasks[0].speed
            rate = "" if speed is None else f"{speed:,.3g}/s" if speed < 1e3 else f"{speed:,.0f}/s"
            said = f"{failures} failed" if failures else ""
            bar.update(task, total=total, advance=steps, rate=rate, failures=said)

        yield advance


def watched() -> bool:
    """Tell whether a person sits before the command line's terminal, and wants to be told."""
    terminal = _terminal()
    heard = terminal is not None and terminal.level <= logging.INFO
    return heard and sys.stderr is not None and sys.stderr.isatty()


def _terminal() -> Terminal | None:
    return next((one for one in LOG.handlers if isinstance(one, Terminal)), None)
