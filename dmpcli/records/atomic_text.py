"""Text files that are written row by row, and take their names when whole."""

import contextlib
import io
import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TextIO

from dmpcli.errors import InputError
from dmpcli.records import file_io


@contextlib.contextmanager
def growing(folder: Path, names: Sequence[str]) -> Iterator[list[TextIO]]:
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
    made = _make(folder)
    files: dict[str, Path] = {}
    whole = False
    try:
        with contextlib.ExitStack() as stack:
            streams: list[TextIO] = []
            for name in names:
                files[name], raw = file_io.temporary_of(folder / name)
                text = io.TextIOWrapper(raw, encoding="utf-8", newline="")
                streams.append(stack.enter_context(text))
            yield streams
            for stream in streams:
                stream.flush()
                os.fsync(stream.fileno())
        for name, file in files.items():
            file.replace(folder / name)
        whole = True
    except OSError as error:
        if isinstance(error, BrokenPipeError):
            raise
        raise InputError(f"{folder}: cannot be written: {error.strerror}") from None
    finally:
        for file in files.values():
            with contextlib.suppress(OSError):
                file.unlink()
        for place in [] if whole else made:
            with contextlib.suppress(OSError):
                place.rmdir()


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
