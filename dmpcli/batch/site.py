"""Where the pairs of a part lie, when their table names surfaces itself: read where they are drawn.

A site is a surface in one pose with one stand-off, in words alone, so that a table of thousands is
cut into parts, and carried to those who draw them, before any of its surfaces is read.
"""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.batch.task import Task
from dmpcli.dmp.rollout import Pairs
from dmpcli.errors import InputError
from dmpcli.records import file_io
from dmpcli.records.storage import located


@dataclass(frozen=True)
class SiteFile:
    """A file that a table names.

    Attributes
    ----------
    path : str
        Where it is.
    name : str
        What the table calls it.
    """

    path: str
    name: str

    def read(self) -> file_io.Source:
        """Read it under the name that the table gives it: what is told of it names no machine.

        Raises
        ------
        InputError
            It cannot be read.
        """
        before = _state(self.path)
        try:
            source = file_io.Source(self.name, file_io.read(self.path).content)
        except InputError as error:
            raise InputError(str(error).replace(self.path, self.name)) from None
        if before is not None and before == _state(self.path):
            _remember(before, source.sha256)
        return source


@dataclass(frozen=True)
class Site:
    """A surface, where it lies, and how high over it strokes are drawn.

    Attributes
    ----------
    surface : SiteFile
    unit : str or None
        Of its lengths.
    pose : SiteFile, str or None
        A pose file, or ``X Y Z RX RY RZ``.
    axes : {'base', 'part'}
        Of the pairs.
    offset : float
        mm.
    """

    surface: SiteFile
    unit: str | None
    pose: SiteFile | str | None
    axes: str
    offset: float

    @property
    def files(self) -> list[SiteFile]:
        """What is read of it."""
        return [self.surface, *([self.pose] if isinstance(self.pose, SiteFile) else [])]

    def hashes(self) -> list[str | None]:
        """SHA-256 of its files; None of one that cannot be read."""
        return [_hash(file.path) for file in self.files]


_State = tuple[str, int, int]
"""Path of a file, and its size and time."""

_MOST_KNOWN = 1 << 16
_known: dict[_State, str] = {}
"""Hashes of files by what they were: a surface that was read is not read again to be hashed."""


def _state(path: str) -> _State | None:
    try:
        now = located(path).stat()
    except OSError:
        return None
    return path, now.st_size, now.st_mtime_ns


def _hash(path: str) -> str | None:
    state = _state(path)
    if state is None:
        return None
    if state not in _known:
        try:
            with located(path).open("rb") as stream:
                _remember(state, hashlib.file_digest(stream, "sha256").hexdigest())
        except OSError:
            return None
    return _known[state]


def _remember(state: _State, sha256: str) -> None:
    if len(_known) >= _MOST_KNOWN:
        _known.clear()
    _known[state] = sha256


@dataclass(frozen=True)
class PairSites:
    """The sites of a table of B pairs.

    Attributes
    ----------
    sites : list of Site
    of : array of int, shape (B,)
        Of each pair; -1 where there is none.
    """

    sites: list[Site]
    of: Integers

    @property
    def lift(self) -> Floats:
        """Stand-off of each pair, mm; 0 where there is no site."""
        lift: Floats = np.array([site.offset for site in self.sites] + [0.0])[self.of]
        return lift


@dataclass(frozen=True)
class PreparedSite:
    """Pairs of one site, ready to be drawn.

    Attributes
    ----------
    task : Task
    pairs : Pairs
        n pairs in the base frame, on the surface.
    start, goal : array, shape (n, 3)
        Where the strokes themselves begin and end, mm.
    against : dict of str
        What stands against a pair, by its place.
    refused : array of bool, shape (n,)
        Of pairs that something stands against: whether it is the stroke, not the input.
    turned : bool
        Whether all strokes are seen from the other side than was guessed for the skill.
    normal : list of float or None
        Of a plane.
    """

    task: Task
    pairs: Pairs
    start: Floats
    goal: Floats
    against: dict[int, str]
    refused: Booleans
    turned: bool
    normal: list[float] | None


@dataclass(frozen=True)
class Remark:
    """What is told of a site while it is prepared.

    Attributes
    ----------
    level : int
        Of Python's logging.
    name : str
        Of the surface.
    text : str
    """

    level: int
    name: str
    text: str


Prepare = Callable[[Site, list[str], Pairs, Floats], tuple[PreparedSite, list[Remark]]]
"""Makes the pairs of one site ready, with ids (n,) and durations (n,), s; raises what a user can
mend: then none of them can be drawn."""


@dataclass
class SitesTold:
    """Remarks on many sites, those of one text together.

    Attributes
    ----------
    first : dict
        Name of the first surface by level and text.
    count : dict of int
    """

    first: dict[tuple[int, str], str] = field(default_factory=dict)
    count: dict[tuple[int, str], int] = field(default_factory=dict)

    def add(self, remark: Remark) -> None:
        """Take up one more."""
        key = (remark.level, remark.text)
        self.first.setdefault(key, remark.name)
        self.count[key] = self.count.get(key, 0) + 1
