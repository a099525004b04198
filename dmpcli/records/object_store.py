"""Files in an object store, by ``s3://``, ``gs://`` and ``abfs://``, through Arrow's file systems.

A store has no folders and renames nothing: an object is there once all of it has been taken in, and
what its name begins with is all that folders are. Keys stand in a name as they are, without
percent signs. Credentials come from the environment of each process, and from nowhere else; of what
a store answers only its codes are told, never its words.
"""

import contextlib
import errno
import fnmatch
import io
import os
import random
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import timedelta
from functools import lru_cache
from pathlib import PurePosixPath
from typing import Any, Literal, NamedTuple, overload
from urllib.parse import urlsplit

from dmpcli.errors import InputError, InstrumentError
from dmpcli.records.store_complaints import complaint, no_bucket

SCHEMES = ("s3", "gs", "abfs", "abfss")

ATTEMPTS = 8
"""How often a request is made that a store has no time for, with longer and longer pauses."""

_FIRST_ATTEMPTS = 3
"""Of the first request: whether a store is there at all is told soon."""

_FIRST_PAUSE, _LONGEST_PAUSE = 0.05, 10.0
"""Before a reading is tried again, s."""

_SECONDS_A_TRY = 5
"""Of Google's, whose client counts no requests."""

_APART = 60.0
"""How long Azure's may take to answer the first time, s."""

_BUFFER = 1 << 18
_SECOND = 10**9


class Known(NamedTuple):
    """What a store says of an object, under the names that `os.stat_result` has.

    Attributes
    ----------
    st_size : int
    st_mtime_ns : int
        In whole seconds: some answers say no more.
    """

    st_size: int
    st_mtime_ns: int


class Listed(NamedTuple):
    """What lies in a folder: its name, whether it is one itself, and of an object what is known."""

    name: str
    folder: bool
    known: Known


@dataclass(frozen=True)
class ObjectPath:
    """Name of an object, or of a folder; it answers as `pathlib.Path` does, as far as it goes.

    Parameters
    ----------
    root : str
        Scheme and bucket, ``s3://BUCKET``.
    key : str
        Without a slash at either end; empty for the bucket itself.

    Raises
    ------
    InputError
        Of what reaches the store: there is no such bucket, or it refuses us.
    InstrumentError
        The store is not reached, or has no time.
    """

    root: str
    key: str = ""

    def __str__(self) -> str:
        return f"{self.root}/{self.key}" if self.key else self.root

    def __truediv__(self, name: str) -> "ObjectPath":
        key = f"{self.key}/{name}" if self.key else name
        parts = key.split("/")
        if not name or any(part in ("", ".", "..") for part in parts):
            raise InputError(f"{self}/{name}: an object's name has no empty part, and no . or ..")
        return ObjectPath(self.root, key)

    @property
    def name(self) -> str:
        """The last part of its name."""
        return PurePosixPath(self.key).name or self.root.partition("://")[2]

    @property
    def stem(self) -> str:
        """The last part, without suffix."""
        return PurePosixPath(self.name).stem

    @property
    def suffix(self) -> str:
        """What it ends in, from the last dot on."""
        return PurePosixPath(self.name).suffix

    @property
    def parent(self) -> "ObjectPath":
        """The folder that it lies in."""
        return ObjectPath(self.root, self.key.rpartition("/")[0])

    def absolute(self) -> "ObjectPath":
        """Return itself: there is no other place to start from."""
        return self

    def exists(self) -> bool:
        """Tell whether it is an object or a folder."""
        return self._info()[0] is not None

    def is_file(self) -> bool:
        """Tell whether it is an object."""
        return self._info()[0] == "file"

    def is_dir(self) -> bool:
        """Tell whether objects' names begin with it; a bucket is one, empty too."""
        return self._info()[0] == "folder"

    def stat(self) -> Known:
        """Return size and time; FileNotFoundError where there is no object."""
        kind, known = self._info()
        if kind != "file":
            raise _missing(self)
        return known

    def _info(self) -> tuple[str | None, Known]:
        from pyarrow.fs import FileType

        store, name = self._open_store()
        with _told(self):
            [found] = store.get_file_info([name])
        kinds = {FileType.File: "file", FileType.Directory: "folder"}
        return kinds.get(found.type), _known(found)

    @overload
    def open(self, mode: Literal["rb"]) -> io.BufferedReader: ...

    @overload
    def open(
        self, mode: Literal["r"] = "r", encoding: str | None = None, errors: str | None = None
    ) -> io.TextIOWrapper: ...

    def open(
        self, mode: str = "r", encoding: str | None = None, errors: str | None = None
    ) -> io.BufferedReader | io.TextIOWrapper:
        """Open it for reading, ``r`` or ``rb``; what is read is asked for piece by piece.

        Parameters
        ----------
        mode : {'r', 'rb'}
        encoding, errors : str, optional
            Of text, as `io.TextIOWrapper` takes them.

        Raises
        ------
        FileNotFoundError
            There is no such object.
        InputError, InstrumentError
            The store refuses, or does not answer; while reading too.
        """
        store, name = self._open_store()
        with _told(self):
            opened = store.open_input_file(name)
        binary: io.BufferedReader = io.BufferedReader(_Pieces(self, opened), _BUFFER)
        if "b" in mode:
            return binary
        return io.TextIOWrapper(binary, encoding=encoding, errors=errors)

    def read_bytes(self) -> bytes:
        """Return all of it, asked for at once."""
        store, name = self._open_store()
        with _told(self):
            opened = store.open_input_file(name)
        size: int = opened.size()
        content = _patiently(self, lambda: opened.read_at(size, 0))
        if len(content) != size:
            raise InstrumentError(f"{self}: the store broke off at {len(content)} of {size} bytes")
        return content

    def put(self, content: Any) -> Known:
        """Write it whole, or not at all; what had its name is replaced in the same moment.

        Parameters
        ----------
        content : bytes-like
        """
        import mimetypes

        from pyarrow import py_buffer

        store, name = self._open_store()
        kind = mimetypes.guess_type(f"name{self.suffix}")[0] or "application/octet-stream"
        given = py_buffer(content)
        with _told(self):
            stream = store.open_output_stream(name, metadata={"Content-Type": kind})
            try:
                stream.write(given)
                stream.close()
            except BaseException:
                _abandon(stream)
                raise
        known = self.stat()
        if known.st_size != given.size:
            raise InstrumentError(
                f"{self}: has {known.st_size} bytes in the store, {given.size} were written: does "
                "somebody else write there? The same command goes on from here"
            )
        return known

    def mkdir(self, parents: bool = False, exist_ok: bool = True) -> None:
        """Do nothing: folders come with what lies in them."""

    def unlink(self, missing_ok: bool = False) -> None:
        """Remove an object. Arrow leaves an empty object that marks the folder it lay in."""
        store, name = self._open_store()
        try:
            with _told(self):
                store.delete_file(name)
        except FileNotFoundError:
            if not missing_ok:
                raise

    def entries(self) -> list[Listed]:
        """Return what lies in this folder, by name; nothing where there is none."""
        from pyarrow.fs import FileSelector, FileType

        store, name = self._open_store()
        with _told(self):
            found = store.get_file_info(FileSelector(name, allow_not_found=True))
        entries = [
            Listed(one.base_name, one.type == FileType.Directory, _known(one)) for one in found
        ]
        return sorted(entries)

    def glob(self, pattern: str) -> Iterator["ObjectPath"]:
        """Yield the objects in this folder whose names are like a pattern."""
        for entry in self.entries():
            if not entry.folder and fnmatch.fnmatchcase(entry.name, pattern):
                yield self / entry.name

    def reach(self) -> None:
        """Find the bucket, where nobody has yet in this process."""
        _reached(self.root, _where())

    def _open_store(self) -> tuple[Any, str]:
        self.reach()
        with _told(self):
            store, bucket = _file_system(self.root, attempts(), _where())
        return store, f"{bucket}/{self.key}" if self.key else bucket


class _Pieces(io.RawIOBase):
    """An object that is read piece by piece; what fails is told as of all of it."""

    def __init__(self, path: ObjectPath, opened: Any) -> None:
        self._path, self._opened = path, opened
        self._at, self._size = 0, int(opened.size())

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def readinto(self, into: Any) -> int:
        count = min(len(into), self._size - self._at)
        if count <= 0:
            return 0
        found = _patiently(self._path, lambda: self._opened.read_at(count, self._at))
        into[: len(found)] = found
        self._at += len(found)
        return len(found)

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        begin = {os.SEEK_SET: 0, os.SEEK_CUR: self._at, os.SEEK_END: self._size}[whence]
        self._at = max(0, begin + offset)
        return self._at

    def tell(self) -> int:
        return self._at

    def close(self) -> None:
        if not self.closed:
            self._opened.close()
        super().close()


def _patiently(path: ObjectPath, ask: Callable[[], bytes]) -> bytes:
    """Read, again and again if need be: of a reading that fails Arrow's client tries few again."""
    for tried in range(1, attempts() + 1):
        try:
            with _told(path):
                return ask()
        except InstrumentError:
            if tried == attempts():
                raise
        # Many processes that wait should not come back in the same moment.
        time.sleep(min(_LONGEST_PAUSE, _FIRST_PAUSE * 2**tried) * random.uniform(0.5, 1.0))
    raise AssertionError  # pragma: no cover


def _known(found: Any) -> Known:
    written = found.mtime_ns
    return Known(found.size or 0, 0 if written is None else written // _SECOND * _SECOND)


def _missing(path: ObjectPath) -> FileNotFoundError:
    return FileNotFoundError(errno.ENOENT, "no such object", str(path))


def _abandon(stream: Any) -> None:
    """Keep a stream from ever being closed.

    Arrow has no other way to give up an upload (its issue 40502): once closed, also as Python ends,
    a stream whose writing failed makes an object of what it has, cut short or empty.
    """
    import ctypes

    ctypes.pythonapi.Py_IncRef(ctypes.py_object(stream))


# Where a bucket is.


def attempts() -> int:
    """Return how often a request is made, at most."""
    given = os.environ.get("AWS_MAX_ATTEMPTS", "")
    return int(given) if given.isdecimal() and int(given) > 0 else ATTEMPTS


def _where() -> tuple[str, str]:
    """Return the endpoint and the region that the environment names; empty where it does not."""
    names = os.environ.get
    endpoint = names("AWS_ENDPOINT_URL_S3") or names("AWS_ENDPOINT_URL") or ""
    return endpoint, names("AWS_REGION") or names("AWS_DEFAULT_REGION") or ""


@lru_cache(maxsize=16)
def _file_system(root: str, tries: int, where: tuple[str, str]) -> tuple[Any, str]:
    """Return a file system and what paths within it begin with."""
    from pyarrow import fs

    scheme, _, bucket = root.partition("://")
    if scheme == "gs":
        key = os.environ.get("GOOGLE_APPLICATION_CREDENTIALS")
        if key and not os.path.isfile(key):
            raise InputError(f"GOOGLE_APPLICATION_CREDENTIALS: {key}: no such file")
        # By itself it would try for a quarter of an hour, deaf to signals.
        limit = timedelta(seconds=_SECONDS_A_TRY * tries)
        return fs.GcsFileSystem(retry_time_limit=limit), bucket
    if scheme != "s3":
        store, path = fs.FileSystem.from_uri(f"{root}/")
        return store, path.strip("/")
    said: dict[str, Any] = {}
    endpoint, region = where
    if endpoint:
        said = _endpoint(endpoint)
    elif not region:
        said["region"] = fs.resolve_s3_region(bucket)
    store = fs.S3FileSystem(
        retry_strategy=fs.AwsStandardS3RetryStrategy(max_attempts=tries),
        background_writes=False,  # so that memory does not hold what the network is slow to take
        allow_delayed_open=True,
        **said,
    )
    return store, bucket


def _endpoint(url: str) -> dict[str, str]:
    found = urlsplit(url)
    odd = found.scheme not in ("http", "https") or "@" in found.netloc or not found.netloc
    if odd or found.path.strip("/") or found.query:
        raise InputError(
            "AWS_ENDPOINT_URL: must be http:// or https:// with a host, and a port if need be, as "
            "in http://127.0.0.1:9000"
        )
    return {"scheme": found.scheme, "endpoint_override": found.netloc}


@lru_cache(maxsize=16)
def _reached(root: str, where: tuple[str, str]) -> bool:
    """Find a bucket; what fails is asked again the next time."""
    from pyarrow.fs import FileType

    path = ObjectPath(root)
    if root.startswith("abfs"):
        _ask_apart(root)
    with _told(path):
        store, bucket = _file_system(root, min(_FIRST_ATTEMPTS, attempts()), where)
        [found] = store.get_file_info([bucket])
    if found.type == FileType.NotFound:
        raise no_bucket(path.root)
    return True


_ASK = """
import sys
from pyarrow import fs
store, path = fs.FileSystem.from_uri(sys.argv[1] + "/")
store.get_file_info([path.strip("/")])
"""


def _ask_apart(root: str) -> None:
    """Ask Azure's store from a process of its own: without credentials Arrow's client ends it.

    Raises
    ------
    InputError
    """
    ask = [sys.executable, "-c", _ASK, root]
    try:
        done = subprocess.run(
            ask, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            timeout=_APART, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        raise InstrumentError(f"{root}: the store is not reached; check the network") from None
    if done.returncode < 0:
        raise InputError(
            f"{root}: no credentials for Azure are found: set AZURE_TENANT_ID, AZURE_CLIENT_ID and "
            "AZURE_CLIENT_SECRET, or sign in by az login"
        )


@contextlib.contextmanager
def _told(path: ObjectPath) -> Iterator[None]:
    """Say what a store complains of in our words, and none of its own."""
    from pyarrow import ArrowException

    try:
        yield
    except FileNotFoundError:
        raise _missing(path) from None
    except (OSError, ArrowException) as error:
        raise complaint(path.root, str(path), str(error), attempts()) from None
