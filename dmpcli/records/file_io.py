"""Reading and writing whole files, with ``-`` for standard input and output.

An output is written beside its name and renamed when whole: never half there.
"""

import contextlib
import hashlib
import io
import itertools
import os
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import BinaryIO
from uuid import uuid4

from dmpcli.errors import InputError
from dmpcli.records.object_store import ObjectPath
from dmpcli.records.storage import Location, Stat, Stats, located

DASH = "-"

JOURNAL = ".journal"
"""Suffix of the journal of a run that has not come to its end."""

LARGEST = 2 * 2**30
"""Bytes of an input that is read whole; journals may be longer."""

_ARROW_STREAM = b"\xff\xff\xff\xff"


@dataclass(frozen=True)
class Source:
    """The whole content of one input, and what messages call it."""

    name: str
    content: bytes

    @cached_property
    def sha256(self) -> str:
        """Hex digest of the content."""
        return hashlib.sha256(self.content).hexdigest()

    def open(self) -> io.BytesIO:
        """Return the content as a seekable binary file."""
        return io.BytesIO(self.content)


def read(path: str | Location, journal: bool = False) -> Source:
    """Read one input whole; ``-`` is standard input.

    Parameters
    ----------
    path : str, Path or ObjectPath
    journal : bool
        Whether it may be a journal, which only `recover` reads.

    Raises
    ------
    InputError
        The file is missing, a directory, empty, too large or not readable; or it is a journal.
    """
    if str(path) == DASH:
        if sys.stdin is None:
            raise InputError("standard input: is closed; name a file")
        source = Source(shown(path), _limited(shown(path), sys.stdin.buffer, journal))
    else:
        file = located(path)
        if isinstance(file, ObjectPath):
            with contextlib.suppress(FileNotFoundError):
                return _checked(_fetched(file), path, journal)
        if file.is_dir():
            raise InputError(f"{path}: is a directory, a file is needed here")
        try:
            size = file.stat().st_size
            if size > LARGEST and not journal:
                raise _too_large(str(path), f"{size / 2**30:.1f} GiB")
            with file.open("rb") as stream:
                source = Source(str(path), _limited(str(path), stream, journal, min(size, LARGEST)))
        except FileNotFoundError:
            raise InputError(f"{path}: no such file; check the name") from None
        except OSError as error:
            raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    return _checked(source, path, journal)


def _fetched(file: ObjectPath) -> Source:
    """Read an object; journals lie on the machine that wrote them."""
    size = file.stat().st_size
    if size > LARGEST:
        raise _too_large(str(file), f"{size / 2**30:.1f} GiB")
    return Source(str(file), file.read_bytes())


def _checked(source: Source, path: str | Location, journal: bool) -> Source:
    """Return an input, unless it is empty or a journal."""
    if not source.content:
        raise InputError(f"{source.name}: is empty; the command that made it may have failed")
    if not journal and (source.name.endswith(JOURNAL) or source.content[:4] == _ARROW_STREAM):
        raise InputError(
            f"{source.name}: is the journal of a run; make its file with "
            f"'dmpcli recover {path} -o FILE'"
        )
    return source


def _limited(name: str, stream: BinaryIO, journal: bool, size: int = LARGEST) -> bytes:
    """Read a stream to its end, which not every one has: a device or a pipe may go on for ever.

    Parameters
    ----------
    name : str
        What messages call it.
    stream : binary file
    journal : bool
    size : int
        Bytes that are expected: room for many more takes longer to make than a part to be read.
    """
    if journal:
        return stream.read()
    content = stream.read(size + 1)
    if len(content) > size:
        content += stream.read(LARGEST + 1 - len(content))
    if len(content) > LARGEST:
        raise _too_large(name, f"over {LARGEST / 2**30:.0f} GiB")
    return content


def _too_large(name: str, size: str) -> InputError:
    return InputError(
        f"{name}: has {size}, more than the {LARGEST / 2**30:.0f} GiB that are read at once; cut "
        "it in parts, or leave out what is not needed"
    )


def shown(path: str | Location, output: bool = False) -> str:
    """Return what messages call a file name; ``-`` is standard input or output."""
    if str(path) != DASH:
        return str(path)
    return "standard output" if output else "standard input"


def say(content: bytes) -> None:
    """Write data to standard output.

    Raises
    ------
    InputError
        It is closed, or there is no space. A reader that has gone is a BrokenPipeError.
    """
    if sys.stdout is None:
        raise InputError("standard output: is closed")
    try:
        sys.stdout.buffer.write(content)
        sys.stdout.buffer.flush()
    except OSError as error:
        # What is left in the buffer would be tried, and fail, once more when Python ends.
        sys.stdout = open(os.devnull, "w")  # noqa: SIM115
        if isinstance(error, BrokenPipeError):
            raise
        raise InputError(f"standard output: cannot be written: {error.strerror}") from None


def check_writable(path: str | Location, here: bool = False) -> None:
    """Refuse an output that could not be written, before any work is done.

    Parameters
    ----------
    path : str, Path or ObjectPath
    here : bool
        Whether it must be of this machine: what an instrument said is not trusted to a network.

    Raises
    ------
    InputError
        The folder is missing or not writable, or the name is a directory's.
    """
    if str(path) == DASH:
        if sys.stdout is None:
            raise InputError("standard output: is closed; name a file")
        if sys.stdout.isatty():
            raise InputError("-o -: would write a file to the terminal; redirect or name a file")
        return
    file = located(path)
    if here and isinstance(file, ObjectPath):
        raise _not_here(file)
    if file.is_dir():
        raise InputError(f"{path}: is a directory, the output needs a file name")
    if isinstance(file, ObjectPath):
        return
    folder = file.parent
    if not folder.is_dir():
        raise InputError(f"{path}: the folder {folder} does not exist; make it first")
    if not os.access(folder, os.W_OK):
        raise InputError(f"{path}: the folder {folder} is not writable")


def write(path: str | Location, content: bytes) -> None:
    """Write one output whole, or not at all; ``-`` is standard output.

    Raises
    ------
    InputError
        The output cannot be written (no space, no right).
    """
    write_by(path, lambda stream: stream.write(content))


def write_by(path: str | Location, fill: Callable[[BinaryIO], object]) -> None:
    """Write one output whole, or not at all, by a function that fills an open file.

    Raises
    ------
    InputError
        The output cannot be written (no space, no right).
    """
    place = located(path)
    if isinstance(place, ObjectPath):
        whole = io.BytesIO()
        fill(whole)
        place.put(whole.getbuffer())
        return
    special = str(path) != DASH and place.exists() and not place.is_file()
    if str(path) == DASH or special:
        whole = io.BytesIO()
        if special:
            check_writable(path)
        fill(whole)
        if special:
            _write_special(_meant(place), whole.getvalue())
        else:
            say(whole.getvalue())
        return
    check_writable(path)
    file = _meant(place)
    with _written(path, file, fill) as temporary:
        temporary.replace(file)


def write_new(path: str | Path, content: bytes) -> Path:
    """Write one output that must replace nothing: what cannot be made again, beside what appeared.

    Returns
    -------
    Path
        Of the file: another name, ``NAME-1`` and so on, where somebody has made one of this name
        meanwhile.

    Raises
    ------
    InputError
        The output cannot be written (no space, no right).
    """
    if str(path) == DASH:
        say(content)
        return Path(DASH)
    check_writable(path, here=True)
    file = _meant(path)
    if file.exists() and not file.is_file():
        _write_special(file, content)
        return file
    with _written(path, file, lambda stream: stream.write(content)) as temporary:
        for number in itertools.count(1):
            try:
                _link(temporary, file)
            except FileExistsError:
                file = _meant(path)
                file = file.with_name(f"{file.stem}-{number}{file.suffix}")
            else:
                return file
    raise AssertionError  # pragma: no cover


def _not_here(path: ObjectPath) -> InputError:
    return InputError(
        f"{path}: what cannot be made again is written on this machine, and a store could replace "
        "what has its name; name a file here, and copy it"
    )


def _meant(path: str | Path) -> Path:
    """Return the file that a name means: where a link leads."""
    file = Path(path)
    return file.resolve() if file.is_symlink() else file


def temporary_of(file: Path) -> tuple[Path, BinaryIO]:
    """Create the file that an output grows in, beside it: one that nobody else has.

    It is created exclusively, so that no link that somebody has laid there is followed. The
    leading dot is for dataset readers and Make patterns, which pass over it.

    Raises
    ------
    OSError
    """
    temporary = file.with_name(f".{file.name}.{uuid4().hex}.tmp")
    flags = os.O_CREAT | os.O_EXCL | os.O_WRONLY | os.O_CLOEXEC | getattr(os, "O_NOFOLLOW", 0)
    return temporary, os.fdopen(os.open(temporary, flags, 0o666), "wb")


@contextlib.contextmanager
def _written(
    path: str | Location, file: Path, fill: Callable[[BinaryIO], object]
) -> Iterator[Path]:
    """Write a temporary file whole, for the caller to name; what is left of it goes."""
    temporary: Path | None = None
    try:
        temporary, stream = temporary_of(file)
        with stream:
            fill(stream)
            stream.flush()
            os.fsync(stream.fileno())
        yield temporary
        with contextlib.suppress(OSError):  # some network file systems cannot
            sync_folder(file.parent)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from None
    finally:
        if temporary is not None:
            with contextlib.suppress(OSError):
                temporary.unlink()


def _link(temporary: Path, file: Path) -> None:
    """Give a file its name, unless there is one of that name; FileExistsError where there is."""
    try:
        os.link(temporary, file, follow_symlinks=False)
    except FileExistsError:
        raise
    except OSError:
        # A file system without links: the name is taken first, then replaced by who has taken it.
        os.close(os.open(file, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        temporary.replace(file)


def sync_folder(folder: Path) -> None:
    """Bring a new name to the disk; OSError where the file system cannot."""
    number = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(number)
    finally:
        os.close(number)


def _write_special(file: Path, content: bytes) -> None:
    """Write to a named pipe or a device, which must not be replaced by a file."""
    try:
        file.write_bytes(content)
    except OSError as error:
        raise InputError(f"{file}: cannot be written: {error.strerror}") from None


TABLE = "pairs.parquet"
MANIFEST = "_manifest.json"

MOST_IN_FOLDER = 1000
"""Parts in one folder, where a batch has so many that they lie in several."""

_PART_FOLDER = re.compile(r"part-[0-9]{2,9}")
_PART_FILE = re.compile(r"part-[^/]*\.parquet")
_PART_NAME = re.compile(r"(?:part-[0-9]{2,9}/)?part-[0-9]{5,12}\.parquet")


def part_name(number: int, nested: bool) -> str:
    """Return the name of a part's file, in its folder where there are several."""
    name = f"part-{number:05d}.parquet"
    return f"part-{number // MOST_IN_FOLDER:02d}/{name}" if nested else name


def parts_of(folder: Location) -> Stats:
    """Return the names of what looks like parts of a batch, with size and time of each.

    Raises
    ------
    OSError
    """
    found: dict[str, Stat] = {}
    for inner in part_folders(folder):
        prefix = "" if inner == folder else f"{inner.name}/"
        if isinstance(inner, ObjectPath):
            listed = inner.entries()
            found |= {
                prefix + one.name: one.known
                for one in listed
                if _PART_FILE.fullmatch(one.name) and not one.folder
            }
            continue
        with os.scandir(inner) as entries:
            for entry in entries:
                if _PART_FILE.fullmatch(entry.name) and entry.is_file():
                    found[prefix + entry.name] = entry.stat()
    return dict(sorted(found.items()))


def part_folders(folder: Location) -> Sequence[Location]:
    """Return the folders that parts of a batch may lie in: its own, and those in it.

    Raises
    ------
    OSError
    """
    if isinstance(folder, ObjectPath):
        inner = [one.name for one in folder.entries() if one.folder]
        inner = [name for name in inner if _PART_FOLDER.fullmatch(name)]
    else:
        with os.scandir(folder) as entries:
            inner = [e.name for e in entries if _PART_FOLDER.fullmatch(e.name) and e.is_dir()]
    return [folder, *(folder / name for name in sorted(inner))]


def part_in(folder: str | Location, name: str, by: str) -> Location:
    """Return the file of a part of a batch, which a table or manifest names.

    Parameters
    ----------
    folder : str or Path
        Of the batch.
    name : str
        As it stands there.
    by : str
        What messages call the table or manifest.

    Raises
    ------
    InputError
        It is no name of a part: a file elsewhere, or one of another kind.
    """
    if _PART_NAME.fullmatch(name) is None:
        raise InputError(
            f"{by}: names the part {name!r}, and parts are called part-00000.parquet and so on; "
            "draw the batch again"
        )
    return located(folder) / name


def check_folder(path: str | Location) -> None:
    """Refuse a dataset folder that could not be written, before any work is done.

    Raises
    ------
    InputError
        The name is a file's or ``-``, or its parent is missing or not writable.
    """
    folder = located(path)
    if str(path) == DASH:
        raise InputError("-o -: many trajectories need a folder, not standard output")
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{path}: is a file; many trajectories need a folder")
    if isinstance(folder, ObjectPath):
        return
    place = folder if folder.is_dir() else folder.absolute().parent
    if not place.is_dir():
        raise InputError(f"{path}: the folder {folder.parent} does not exist; make it first")
    if not os.access(place, os.W_OK):
        raise InputError(f"{path}: the folder {place} is not writable")


def read_table(folder: str | Location) -> Source:
    """Read the table of pairs of a finished batch.

    Raises
    ------
    InputError
        The folder holds no batch, or one that is not finished.
    """
    table = located(folder) / TABLE
    if not table.is_file():
        raise InputError(
            f"{folder}: holds no finished batch ({TABLE} is missing); the command that draws it "
            "goes on from the parts that are there"
        )
    return read(table)
