"""Text files that are written row by row, and take their names when whole."""

import contextlib
import io
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TextIO

from dmpcli.errors import InputError
from dmpcli.records.draft import Draft
from dmpcli.records.storage import Location


@contextlib.contextmanager
def growing(folder: Location, names: Sequence[str]) -> Iterator[list[TextIO]]:
    """Open text files in a folder that is made if need be; an error leaves nothing behind.

    Yields
    ------
    list of TextIO
        Of each name, in order.

    Raises
    ------
    InputError
        The folder cannot be made, or a file not be written.
    """
    made = _make(folder) if isinstance(folder, Path) else []
    files: list[Draft] = []
    whole = False
    try:
        with contextlib.ExitStack() as stack:
            streams: list[TextIO] = []
            for name in names:
                draft = Draft(folder / name)
                files.append(draft)
                text = io.TextIOWrapper(draft.stream, encoding="utf-8", newline="")
                streams.append(text)
                stack.callback(_let_go, text)
            yield streams
            for stream, draft in zip(streams, files, strict=True):
                stream.flush()
                draft.settle()
        for draft in files:
            draft.keep()
        whole = True
    except OSError as error:
        if isinstance(error, BrokenPipeError):
            raise
        raise InputError(f"{folder}: cannot be written: {error.strerror}") from None
    finally:
        for draft in files:
            draft.drop()
        for place in [] if whole else made:
            with contextlib.suppress(OSError):
                place.rmdir()


def _let_go(text: io.TextIOWrapper) -> None:
    """Leave the file open that a text is written into."""
    with contextlib.suppress(OSError, ValueError):
        text.detach()


def _make(folder: Path) -> list[Path]:
    """Make a folder and what it lies in; the ones that were not there, the innermost first."""
    missing = [place for place in (folder, *folder.parents) if not place.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise InputError(f"{folder}: is a file, -o needs the name of a folder") from None
    except OSError as error:
        raise InputError(f"{folder}: cannot be made: {error.strerror}") from None
    return missing
