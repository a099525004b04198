"""Where bytes lie: on this machine, or in an object store; the one home of what a name means.

A file of this machine is a `pathlib.Path`, an object an `ObjectPath`, which answers to the same
calls; what differs is how a file is written, see `dmpcli.records.draft`.
"""

import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Protocol, TypeVar
from urllib.parse import unquote

from dmpcli.errors import InputError
from dmpcli.records.object_store import SCHEMES, ObjectPath

Location = Path | ObjectPath

_AT_ONCE = 16
"""Files that a store is asked for at once: each answer takes its time."""

T = TypeVar("T")
R = TypeVar("R")

_URL = re.compile(r"([A-Za-z][A-Za-z0-9+.-]*)://(.*)", re.DOTALL)
_FLAT = re.compile(rf"(?:{'|'.join(SCHEMES)}|file):/(?!/)", re.IGNORECASE)
_PASSWORD = re.compile(r"(?<=://)[^/\s@]*:[^\s@]*@")
_IN_BUCKET = re.compile(r"((?:^|=)(?:s3|gs)://)(?=[^/\s]*[:@])\S*", re.IGNORECASE)
# What signs a link (S3's X-Amz-Signature, Azure's sig), and the keys that Arrow's own names take.
_SIGNED = re.compile(
    r"((?:^|=)(?:https?|ftp|s3[an]?|gc?s|abfss?|az|adl|wasbs?)://[^?\s]*\?)\S*=\S*", re.IGNORECASE
)
_OPTIONS = re.compile(
    r"(?:^|&)(?:access_key|secret_key|session_token|region|scheme|endpoint_override|"
    r"allow_bucket_(?:creation|deletion)|account_key|sas_token|sig|x-(?:amz|goog)-\w[\w-]*)=",
    re.IGNORECASE,
)

_HINTS = {"s3a": "s3", "s3n": "s3", "gcs": "gs", "az": "abfs", "adl": "abfs", "wasb": "abfs"}


class Stat(Protocol):
    """What is known of a file: its size, and when it was written, ns."""

    @property
    def st_size(self) -> int:
        """Bytes."""

    @property
    def st_mtime_ns(self) -> int:
        """When it was written, ns since 1970."""


Stats = Mapping[str, Stat]
"""Of files, by their names."""


def located(name: str | Location) -> Location:
    """Return the place that a name means.

    Parameters
    ----------
    name : str, Path or ObjectPath
        A file or folder of this machine, ``file:///PATH``, or ``s3://BUCKET/KEY``,
        ``gs://BUCKET/KEY``, ``abfs://CONTAINER@ACCOUNT.dfs.core.windows.net/KEY``.

    Raises
    ------
    InputError
        It is of another kind, holds credentials, or names nothing.
    """
    if isinstance(name, ObjectPath):
        return name
    text = str(name)
    found = _URL.fullmatch(text)
    if found is None:
        if _FLAT.match(text):
            raise InputError(
                f"{hidden(text)}: names a store, which fit, generalize, execute, report and "
                "inspect read (with two slashes); elsewhere copy the file to this machine first"
            )
        return name if isinstance(name, Path) else Path(text)
    scheme, rest = found[1].lower(), found[2]
    if scheme == "file":
        return _local(text, rest)
    if scheme not in SCHEMES:
        hint = f"{_HINTS[scheme]}:// is meant" if scheme in _HINTS else "it is no kind of storage"
        if scheme in ("http", "https", "ftp"):
            hint = "it is no kind of storage, copy the file to this machine or into a bucket"
        raise InputError(
            f"{hidden(text)}: {hint}; s3://, gs://, abfs:// and file:// are known, and files"
        )
    return _in_store(scheme, rest)


def _local(text: str, rest: str) -> Path:
    host, slash, path = rest.partition("/")
    if host not in ("", "localhost") or not slash:
        raise InputError(f"{text}: must be whole, from the root on, as in file:///data/pairs.csv")
    return Path("/" + unquote(path))


def _in_store(scheme: str, rest: str) -> ObjectPath:
    bucket, _, key = rest.partition("/")
    names = (":", "@") if scheme in ("s3", "gs") else (":",)
    if any(sign in bucket for sign in names):
        raise InputError(
            f"{scheme}://...: a name must not hold credentials; set them in the environment "
            "(docs/storage.md)"
        )
    if not bucket or any(sign.isspace() for sign in bucket):
        text = hidden(f"{scheme}://{rest}")
        raise InputError(f"{text}: names no bucket, as in {scheme}://BUCKET/NAME")
    if scheme.startswith("abfs") and "@" not in bucket:
        raise InputError(
            f"{hidden(f'{scheme}://{rest}')}: names no account, as in "
            f"{scheme}://CONTAINER@ACCOUNT.dfs.core.windows.net/NAME"
        )
    if _OPTIONS.search(key.partition("?")[2]):
        raise InputError(
            f"{hidden(f'{scheme}://{rest}')}: a name holds no options and no signature; what "
            "they say comes from the environment (docs/storage.md)"
        )
    root = ObjectPath(f"{scheme}://{bucket}")
    key = key.rstrip("/")
    return root / key if key else root


def beside(folder: Location, name: str) -> Location:
    """Return the place that a name means which stands in a file of this folder.

    Raises
    ------
    InputError
        As `located`.
    """
    if _URL.fullmatch(name):
        return located(name)
    if isinstance(folder, Path):
        return folder / name
    if name.startswith("/"):
        return Path(name)
    steps: list[str] = []
    for step in (*folder.key.split("/"), *name.split("/")):
        if step == "..":
            steps = steps[:-1]
        elif step not in ("", "."):
            steps.append(step)
    return ObjectPath(folder.root, "/".join(steps))


def each(folder: Location, ask: Callable[[T], R], items: Iterable[T]) -> list[R]:
    """Return what each of some files in a folder answers; a store is asked for many at once.

    Parameters
    ----------
    folder : Path or ObjectPath
        Of this machine: one file after the other; in a store up to 16 at once.
    ask : callable
        Called with each item, in a store from several threads.
    items : iterable

    Returns
    -------
    list
        In the order of the items; the first error that `ask` raises, in that order, is raised.
    """
    if isinstance(folder, Path):
        return [ask(item) for item in items]
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(_AT_ONCE) as asking:
        return list(asking.map(ask, items))


def hidden(text: str) -> str:
    """Return a word of the command line without what may be a password or a key."""
    return _PASSWORD.sub("***@", _SIGNED.sub(r"\1***", _IN_BUCKET.sub(r"\1***", text)))
