"""Reading and writing whole files, with ``-`` for standard input and output.

An output is written beside its name and renamed when whole: never half there.
"""

import contextlib
import hashlib
import io
import os
import sys
from dataclasses import dataclass
from pathlib import Path

from dmpcli.errors import InputError

DASH = "-"


@dataclass(frozen=True)
class Source:
    """The whole content of one input, and what messages call it."""

    name: str
    content: bytes

    @property
    def sha256(self) -> str:
        """Hex digest of the content."""
        return hashlib.sha256(self.content).hexdigest()

    def open(self) -> io.BytesIO:
        """Return the content as a seekable binary file."""
        return io.BytesIO(self.content)


def read(path: str | Path) -> Source:
    """Read one input whole; ``-`` is standard input.

    Raises
    ------
    InputError
        The file is missing, a directory, empty or not readable.
    """
    if str(path) == DASH:
        source = Source("standard input", sys.stdin.buffer.read())
    else:
        file = Path(path)
        if file.is_dir():
            raise InputError(f"{path}: is a directory, a file is needed here")
        try:
            source = Source(str(path), file.read_bytes())
        except FileNotFoundError:
            raise InputError(f"{path}: no such file; check the name") from None
        except OSError as error:
            raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    if not source.content:
        raise InputError(f"{source.name}: is empty; the command that made it may have failed")
    return source


def check_writable(path: str | Path) -> None:
    """Refuse an output that could not be written, before any work is done.

    Raises
    ------
    InputError
        The folder is missing or not writable, or the name is a directory's.
    """
    if str(path) == DASH:
        if sys.stdout.isatty():
            raise InputError("-o -: would write a file to the terminal; redirect or name a file")
        return
    file = Path(path)
    if file.is_dir():
        raise InputError(f"{path}: is a directory, the output needs a file name")
    folder = file.parent
    if not folder.is_dir():
        raise InputError(f"{path}: the folder {folder} does not exist; make it first")
    if not os.access(folder, os.W_OK):
        raise InputError(f"{path}: the folder {folder} is not writable")


def write(path: str | Path, content: bytes) -> None:
    """Write one output whole, or not at all; ``-`` is standard output.

    Raises
    ------
    InputError
        The output cannot be written (no space, no right).
    """
    if str(path) == DASH:
        sys.stdout.buffer.write(content)
        sys.stdout.buffer.flush()
        return
    check_writable(path)
    file = Path(path)
    # A leading dot: dataset readers and Make patterns pass over it.
    temporary = file.with_name(f".{file.name}.{os.getpid()}.tmp")
    try:
        with temporary.open("wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        temporary.replace(file)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from None
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink()


PART = "part-*.parquet"


def check_folder(path: str | Path) -> None:
    """Refuse a dataset folder that could not be written, before any work is done.

    Raises
    ------
    InputError
        The name is a file's or ``-``, its parent is missing, or it holds files that are not ours.
    """
    folder = Path(path)
    if str(path) == DASH:
        raise InputError("-o -: many trajectories need a folder, not standard output")
    if folder.is_file():
        raise InputError(f"{path}: is a file; many trajectories need a folder")
    place = folder if folder.is_dir() else folder.absolute().parent
    if not place.is_dir():
        raise InputError(f"{path}: the folder {folder.parent} does not exist; make it first")
    if not os.access(place, os.W_OK):
        raise InputError(f"{path}: the folder {place} is not writable")


def begin_folder(path: str | Path) -> None:
    """Make a dataset folder, and remove the parts and the table of an older one.

    The table of pairs goes first: a folder without it is one that is not finished.
    """
    folder = Path(path)
    try:
        folder.mkdir(exist_ok=True)
        (folder / "pairs.parquet").unlink(missing_ok=True)
        for part in sorted(folder.glob(PART)):
            part.unlink()
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from None
