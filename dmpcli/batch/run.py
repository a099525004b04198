"""One batch from its table of pairs to its manifest."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import overload

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.batch.cut import Cut, by_site, in_order
from dmpcli.batch.dataset_folder import Folder
from dmpcli.batch.part import Job, Outcome, Part
from dmpcli.batch.site import PairSites, Site, SitesTold
from dmpcli.batch.workers import Draw
from dmpcli.dmp.copies import ends
from dmpcli.dmp.rollout import Pairs
from dmpcli.dmp.time_scaling import timing
from dmpcli.errors import InputError, RefusedError
from dmpcli.messages import Advance
from dmpcli.records import manifest, trajectory
from dmpcli.records.pairs import PairTable
from dmpcli.records.record import Record
from dmpcli.records.schemas import OK
from dmpcli.surfaces.plane import Plane, pair_charts

MOST_IN_ONE = 4000
"""Parts that lie in one folder; more are put into several."""

SHOWN = 20
"""Bad pairs that are named on the terminal; all are in the folder's table."""

_AT_ONCE = 100_000
"""Pairs whose charts are laid at once."""


@dataclass(frozen=True)
class Shard:
    """A share of the parts: every `count`-th, from the `index`-th on, counted from 1."""

    index: int = 1
    count: int = 1

    @overload
    def has(self, number: int) -> bool: ...
    @overload
    def has(self, number: Integers) -> Booleans: ...

    def has(self, number: int | Integers) -> bool | Booleans:
        """Tell whether a part is of this share, or which of many are."""
        return number % self.count == self.index - 1

    @property
    def whole(self) -> bool:
        """Whether this is all of the batch."""
        return self.count == 1


@dataclass
class BatchSummary:
    """What a run did.

    Attributes
    ----------
    drawn, failed : int
        Pairs with and without a stroke, of those that this run was to draw.
    unfolded : int
        Strokes that cross a sharp crease.
    kept : int
        Parts that an earlier run had drawn.
    split : int
        Pairs whose stroke was split.
    slow : int
        Strokes that do not hold the speed that was asked for.
    parts : int
    told : SitesTold
        On surfaces that the table names.
    rows, bad : int
        Of the table, and those of them that have no stroke.
    skipped : list of str
        Why some of those have none: the first `SHOWN`.
    """

    drawn: int = 0
    failed: int = 0
    unfolded: int = 0
    kept: int = 0
    split: int = 0
    slow: int = 0
    parts: int = 0
    told: SitesTold = field(default_factory=SitesTold)
    rows: int = 0
    bad: int = 0
    skipped: list[str] = field(default_factory=list)


@dataclass
class Batch:
    """A table of pairs, or a piece of one, cut into parts.

    Parameters
    ----------
    job : Job
        Of all pieces.
    table : PairTable
        Pairs that cannot be drawn have their status; more get it here.
    pairs : Pairs
        Those of the table, on the surface.
    duration : array, shape (B,)
        Of each stroke without easing, s.
    size : int
        Pairs per part.
    shard : Shard
    sites : PairSites, optional
        Of the pairs, where the table names them.
    most_sites : int
        Sites in a part.
    first_part : int
        Number of its first part; those that its rows leave out have none.
    parts : array of int, shape (B,), optional
        Number of the part of each row, where these are not all rows and the whole was cut before.
    """

    job: Job
    table: PairTable
    pairs: Pairs
    duration: Floats
    size: int
    shard: Shard = field(default_factory=Shard)
    sites: PairSites | None = None
    most_sites: int = 16
    first_part: int = 0
    parts: Integers | None = None

    def __post_init__(self) -> None:
        self._admitted = self.table.good
        self._outcomes: dict[int, Outcome] = {}
        self._numbers = self.table.numbers

    def _here(self, number: int) -> int:
        """Which row of this piece has a number in the whole table."""
        return int(np.searchsorted(self._numbers, number))

    @cached_property
    def cut(self) -> Cut:
        """Which rows each part has."""
        if self.parts is not None:
            return Cut(self.parts - self.first_part)
        if self.sites is None:
            return in_order(self.table.numbers, self.size, self.first_part)
        return by_site(self.sites.of, self.sites.lift, self.size, self.most_sites)

    def _part(self, number: int) -> Part:
        rows = self.cut.rows(number - self.first_part)
        rows = rows[self._admitted[rows]]
        ids = [self.table.ids[row] for row in rows.tolist()]
        part = Part(number, self._numbers[rows], ids, self.pairs[rows], self.duration[rows])
        if self.sites is None:
            return part
        used, site = np.unique(self.sites.of[rows], return_inverse=True)
        return replace(part, sites=tuple(self.sites.sites[i] for i in used), site=site)

    @cached_property
    def sizes(self) -> dict[int, int]:
        """How many pairs each part of this shard is to draw; parts with none are left out."""
        counts = np.bincount(self.cut.part[self._admitted]).tolist()
        numbered = enumerate(counts, self.first_part)
        return {n: size for n, size in numbered if size and self.shard.has(n)}

    def _hashes(self, number: int) -> list[list[str | None]]:
        """Hashes of the files that a part is drawn on, as they are now."""
        return [site.hashes() for site in self._part(number).sites]

    @property
    def count(self) -> int:
        """How many pairs this shard is to draw."""
        return sum(self.sizes.values())

    def run(self, draw: Draw, advance: Advance) -> BatchSummary:
        """Draw the whole table, as `run`."""
        return run(iter([self]), draw, advance)

    def draw(self, folder: Folder, draw: Draw, advance: Advance, summary: BatchSummary) -> None:
        """Draw what is not there yet.

        Parameters
        ----------
        folder : Folder
            Open.
        draw : callable
            Of `dmpcli.batch.workers`.
        advance : Advance
            Told how many pairs are done, and could not be drawn.
        summary : BatchSummary
            Added to.

        Raises
        ------
        RefusedError, InputError
            As `run`.
        """
        # Rows that were refused before are done, and those of other shards are nobody's here.
        parts = range(self.first_part, self.first_part + self.cut.count)
        ours = np.array([self.shard.has(number) for number in parts], dtype=bool)[self.cut.part]
        refused = int((ours & ~self._admitted).sum())
        advance(refused, refused, left_out=int((~ours).sum()))
        kept = folder.kept(self.sizes, self._hashes)
        summary.kept += len(kept)
        for outcome in self._all(kept, draw):
            self._note(outcome, self.sizes[outcome.number], summary)
            if outcome.number not in kept:
                folder.note(outcome)
            advance(self.sizes[outcome.number], len(outcome.failed))
        bad = [status for status in self.table.status if status != OK]
        summary.rows += len(self.table)
        summary.bad += len(bad)
        summary.skipped += bad[: SHOWN - len(summary.skipped)]

    def _all(self, kept: dict[int, Outcome], draw: Draw) -> Iterator[Outcome]:
        yield from kept.values()
        yield from draw(self.job, map(self._part, (n for n in self.sizes if n not in kept)))

    def _note(self, outcome: Outcome, size: int, summary: BatchSummary) -> None:
        self._outcomes[outcome.number] = outcome
        for there, why in outcome.failed.items():
            row = self._here(there)
            self.table.status[row] = f"{self.table.place(row)}, pair {self.table.ids[row]}: {why}"
        for remark in outcome.told:
            summary.told.add(remark)
        if outcome.fatal:
            said = f"{self.table.name}: {self.table.status[self._here(min(outcome.failed))]}"
            if not outcome.refused:
                raise InputError(f"{said}; or give --on-error skip")
            raise RefusedError(f"{said}; move the pair, or give --on-error skip")
        summary.parts += 1
        summary.drawn += size - len(outcome.failed)
        summary.failed += len(outcome.failed)
        summary.unfolded += outcome.unfolded
        summary.split += len(outcome.pieces)
        summary.slow += outcome.slow

    def record(self) -> Record:
        """Return the table of pairs with what became of each; one row for each piece of a split."""
        good = self.table.good
        numbered = range(self.first_part, self.first_part + self.cut.count)
        names = [self.job.file_of(number) for number in numbered]
        numbers = self.cut.part
        files = [names[n] if drawn else "" for n, drawn in zip(numbers.tolist(), good, strict=True)]
        ids, pairs, lasting = self.table.ids, self._ends(good), self._lasting(good)
        normals, status = self._normals(good), self.table.status
        pieces = {
            self._here(there): ends
            for outcome in self._outcomes.values()
            for there, ends in outcome.pieces.items()
        }
        if pieces:
            counts = np.array([len(pieces.get(row, "1")) for row in range(len(ids))])
            rows = np.repeat(np.arange(len(ids)), counts)
            pairs, lasting, normals = pairs[rows], lasting[rows], normals[rows]
            number = np.arange(len(rows)) - np.repeat(np.cumsum(counts) - counts, counts)
            for i, (row, n) in enumerate(zip(rows.tolist(), number.tolist(), strict=True)):
                if row in pieces:
                    pairs.start[i], pairs.goal[i], lasting[i] = pieces[row][n]
            ids = [
                f"{ids[row]}.{n + 1}" if row in pieces else ids[row]
                for row, n in zip(rows.tolist(), number.tolist(), strict=True)
            ]
            files = [files[row] for row in rows.tolist()]
            status = [status[row] for row in rows.tolist()]
        p = self.job.provenance
        on = None
        if self.sites is not None:
            on = self._surfaces(rows if pieces else np.arange(len(self.table)))
        return trajectory.pairs_record(ids, pairs, lasting, normals, files, status, p, on)

    def _surfaces(self, rows: Integers) -> tuple[list[str], list[str]]:
        """Names and hashes of the surfaces of some rows; empty where there is none."""
        assert self.sites is not None
        names = [site.surface.name for site in self.sites.sites] + [""]
        told: dict[Site, str | None] = {}
        for number, outcome in self._outcomes.items():
            # As whoever drew them read them.
            for site, files in zip(self._part(number).sites, outcome.sites, strict=True):
                told[site] = files[0]
        hashes = [
            (told[site] if site in told else site.hashes()[0]) or "" for site in self.sites.sites
        ]
        hashes.append("")
        of = self.sites.of[rows].tolist()
        return [names[i] for i in of], [hashes[i] for i in of]

    def _placed(self) -> tuple[Integers, Floats]:
        """Rows (k,) whose table names their surfaces, and start, goal and normal of each (k, 9)."""
        rows, places = [], []
        for outcome in self._outcomes.values():
            rows += list(outcome.placed)
            places += [(place + [np.nan] * 3)[:9] for place in outcome.placed.values()]
        there = np.searchsorted(self._numbers, np.array(rows, dtype=np.int64))
        return there, np.array(places).reshape(-1, 9)

    def _ends(self, good: Booleans) -> Pairs:
        """Pairs with the ends that their strokes have themselves."""
        if self.sites is not None:
            rows, places = self._placed()
            start, goal = self.pairs.start.copy(), self.pairs.goal.copy()
            start[rows], goal[rows] = places[:, :3], places[:, 3:6]
            return replace(self.pairs, start=start, goal=goal)
        if self.pairs.shift is None:
            return self.pairs
        task, rows = self.job.task, np.flatnonzero(good)
        start, goal = self.pairs.start.copy(), self.pairs.goal.copy()
        start[rows], goal[rows] = ends(task.skill, self.pairs[rows], task.surface, task.style.turn)
        return replace(self.pairs, start=start, goal=goal)

    def _lasting(self, good: Booleans) -> Floats:
        """Duration of each trajectory with easing, s; where there is none, as it was asked."""
        skill, style = self.job.task.skill, self.job.task.style
        lasting = self.duration.copy()
        for seconds in np.unique(self.duration[good]).tolist():
            when = timing(
                seconds,
                style.rate,
                skill.duration,
                skill.spring.tau,
                style.ease_in,
                style.ease_out,
            )
            lasting[good & (self.duration == seconds)] = when.t[-1]
        for outcome in self._outcomes.values():
            for there, seconds in outcome.clipped.items():
                lasting[self._here(there)] = seconds
        return lasting

    def _normals(self, good: Booleans) -> Floats:
        """Unit normal of each pair's plane; NaN on a mesh, and where there is no stroke."""
        task, frame = self.job.task, self.job.task.skill.frame
        normal = np.full((len(self.table), 3), np.nan)
        if self.sites is not None:
            rows, places = self._placed()
            normal[rows] = np.where(good[rows, None], places[:, 6:], np.nan)
        elif isinstance(task.surface, Plane):
            normal[good] = task.surface.normal
        elif task.surface is None and task.skill.model == "original":
            normal[good] = frame.normal
        elif task.surface is None:
            drawn = np.flatnonzero(good)
            for first in range(0, len(drawn), _AT_ONCE):
                rows = drawn[first : first + _AT_ONCE]
                start, goal = self.pairs.start[rows], self.pairs.goal[rows]
                normal[rows] = pair_charts(start, goal, frame.normal, task.skill.closed).normal
        return normal

    def entries(self) -> list[manifest.Entry]:
        """Return what the manifest says of the parts."""
        return [
            manifest.Entry(
                file=self.job.file_of(number),
                pairs=size,
                rows=self._outcomes[number].rows,
                bytes=self._outcomes[number].size,
            )
            for number, size in self.sizes.items()
            if self._outcomes[number].rows
        ]


def run(pieces: Iterator[Batch], draw: Draw, advance: Advance) -> BatchSummary:
    """Draw what is not there yet; with all parts there, write table and manifest.

    Parameters
    ----------
    pieces : iterator of Batch
        Of one table in its order, with one job and shard; each is let go before the next is asked
        for.
    draw : callable
        Of `dmpcli.batch.workers`.
    advance : Advance
        Told how many pairs are done, and could not be drawn.

    Returns
    -------
    BatchSummary

    Raises
    ------
    RefusedError
        A pair cannot be drawn, and the job is to stop then. Finished parts stay.
    InputError
        The folder cannot be written.
    """
    summary, entries = BatchSummary(), list[manifest.Entry]()
    folder: Folder | None = None
    try:
        for piece in pieces:
            if folder is None:
                job, shard = piece.job, piece.shard
                folder = Folder(job, f"{shard.index}-of-{shard.count}")
                folder.open(shard.whole)
            piece.draw(folder, draw, advance, summary)
            if shard.whole:
                folder.add(piece.record())
                entries += piece.entries()
        assert folder is not None
        if shard.whole:
            drawn = summary.rows - summary.bad
            document = manifest.document(entries, summary.rows, drawn, job.provenance)
            folder.finish(document)
    finally:
        if folder is not None:
            folder.leave()
    return summary
