"""What a batch is drawn from, and what became of it, part by part.

A job and a part travel to other processes and machines, so both hold plain values.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from dmpcli.arrays import Floats, Integers
from dmpcli.batch.site import Prepare, Remark, Site
from dmpcli.batch.task import Task
from dmpcli.dmp.rollout import Pairs
from dmpcli.records import file_io
from dmpcli.records.record import Form, Provenance


@dataclass(frozen=True)
class Job:
    """What all parts of a batch share.

    Attributes
    ----------
    task : Task
    stop : bool
        Whether a pair that cannot be drawn ends the batch, and keeps its part from being written.
    provenance : Provenance
        Of every part.
    form : Form
    folder : str
        Where the parts go, or the URL of an object store; every process that draws must see it.
    prepare : callable, optional
        Makes pairs ready whose table names their surfaces; `task` then has none.
    nested : bool
        Whether there are so many parts that they lie in several folders.
    """

    task: Task
    stop: bool
    provenance: Provenance
    form: Form
    folder: str
    prepare: Prepare | None = None
    nested: bool = False

    def file_of(self, number: int) -> str:
        """Return the name of a part's file."""
        return file_io.part_name(number, self.nested)


@dataclass(frozen=True)
class Part:
    """Some of the pairs, in the order of their table.

    Attributes
    ----------
    number : int
    rows : array of int, shape (n,)
        Of the table.
    ids : list of str, length n
    pairs : Pairs
        n pairs, on the surface.
    duration : array, shape (n,)
        Of each stroke without easing, s.
    sites : tuple of Site
        Where they lie, if the table says it.
    site : array of int, shape (n,), optional
        Which of the sites each pair has.
    """

    number: int
    rows: Integers
    ids: list[str]
    pairs: Pairs
    duration: Floats
    sites: tuple[Site, ...] = ()
    site: Integers | None = None

    def __len__(self) -> int:
        return len(self.rows)


PieceEnds = tuple[list[float], list[float], float]
"""Of a piece of a stroke: start and goal, mm, and how long it lasts, s."""


@dataclass(frozen=True)
class Outcome:
    """What became of a part.

    Attributes
    ----------
    number : int
    failed : dict of str
        Why a pair could not be drawn, by its row in the table.
    clipped : dict of float
        How long a stroke lasts whose pair does not tell it, s, by its row: one that ends at the
        border, or whose speed is held.
    pieces : dict of list
        Of a stroke that is split: of each piece start, goal and seconds, by the row.
    unfolded : int
        How many strokes cross a sharp crease.
    slow : int
        How many strokes hold the speed that was asked for on less than `LEAST_HELD` of the path.
    rows, size : int
        Rows and bytes of the part's file; 0 where there is none.
    fatal : bool
        Whether a pair failed that ends the batch; then no file was written.
    refused : bool
        Whether the first of those that failed did so as a stroke, not for its input.
    placed : dict of list
        Of pairs whose table names their surfaces: start and goal as drawn, and the normal of a
        plane, by the row.
    sites : list of list
        SHA-256 of the files of each site.
    told : list of Remark
        On the sites.
    """

    number: int
    failed: dict[int, str]
    clipped: dict[int, float]
    unfolded: int
    rows: int = 0
    size: int = 0
    fatal: bool = False
    pieces: dict[int, list[PieceEnds]] = field(default_factory=dict)
    slow: int = 0
    refused: bool = True
    placed: dict[int, list[float]] = field(default_factory=dict)
    sites: list[list[str | None]] = field(default_factory=list)
    told: list[Remark] = field(default_factory=list)

    def fact(self) -> dict[str, Any]:
        """Return what the part's own metadata remember of it."""
        found: dict[str, Any] = {
            "number": self.number,
            "failed": {str(row): why for row, why in self.failed.items()},
            "clipped": {str(row): seconds for row, seconds in self.clipped.items()},
            "unfolded": self.unfolded,
        }
        if self.pieces:
            found["pieces"] = {str(row): ends for row, ends in self.pieces.items()}
        if self.slow:
            found["slow"] = self.slow
        if self.sites:
            found["sites"] = self.sites
            found["placed"] = {str(row): place for row, place in self.placed.items()}
        return found


def outcome_of(fact: Mapping[str, Any], rows: int, size: int) -> Outcome:
    """Return the outcome of a part that was drawn, from its own fact.

    Parameters
    ----------
    fact : mapping
        As JSON gave it.
    rows, size : int
        Rows and bytes of the part's file.

    Raises
    ------
    KeyError, TypeError, ValueError, AttributeError
        It is not what `Outcome.fact` makes.
    """

    def by_row(name: str) -> dict[int, Any]:
        return {int(row): value for row, value in fact.get(name, {}).items()}

    return Outcome(
        int(fact["number"]),
        by_row("failed"),
        by_row("clipped"),
        int(fact["unfolded"]),
        rows,
        size,
        pieces=by_row("pieces"),
        slow=int(fact.get("slow", 0)),
        placed=by_row("placed"),
        sites=list(fact.get("sites", ())),
    )


FACT = "part"
"""Name of a part's own fact in its metadata; all else in them is the batch's."""
