"""One batch from its table of pairs to its manifest."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.batch.cut import Cut, by_site, in_order
from dmpcli.batch.dataset_folder import Folder
from dmpcli.batch.part import Job, Outcome, Part, file_of
from dmpcli.batch.site import PairSites, SitesTold
from dmpcli.batch.workers import Draw
from dmpcli.dmp.copies import ends
from dmpcli.dmp.rollout import Pairs
from dmpcli.dmp.time_scaling import timing
from dmpcli.errors import InputError, RefusedError
from dmpcli.records import manifest, trajectory
from dmpcli.records.pairs import PairTable
from dmpcli.records.record import Record
from dmpcli.records.schemas import OK
from dmpcli.surfaces.plane import Plane, pair_charts

_AT_ONCE = 100_000
"""Pairs whose charts are laid at once."""


@dataclass(frozen=True)
class Shard:
    """A share of the parts: every `count`-th, from the `index`-th on, counted from 1."""

    index: int = 1
    count: int = 1

    def has(self, number: int) -> bool:
        """Tell whether a part is of this share."""
        return number % self.count == self.index - 1

    @property
    def whole(self) -> bool:
        """Whether this is all of the batch."""
        return self.count == 1


@dataclass
class Summary:
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
    """

    drawn: int = 0
    failed: int = 0
    unfolded: int = 0
    kept: int = 0
    split: int = 0
    slow: int = 0
    parts: int = 0
    told: SitesTold = field(default_factory=SitesTold)


@dataclass
class Batch:
    """A table of pairs, cut into parts.

    Parameters
    ----------
    job : Job
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
    """

    job: Job
    table: PairTable
    pairs: Pairs
    duration: Floats
    size: int
    shard: Shard = field(default_factory=Shard)
    sites: PairSites | None = None
    most_sites: int = 16

    def __post_init__(self) -> None:
        self._admitted = self.table.good
        self._outcomes: dict[int, Outcome] = {}

    @cached_property
    def cut(self) -> Cut:
        """Which rows each part has."""
        if self.sites is None:
            return in_order(len(self.table), self.size)
        lift = np.array([site.offset for site in self.sites.sites] + [0.0])
        return by_site(self.sites.of, lift[self.sites.of], self.size, self.most_sites)

    def _part(self, number: int) -> Part:
        rows = self.cut.rows(number)
        rows = rows[self._admitted[rows]]
        ids = [self.table.ids[row] for row in rows.tolist()]
        part = Part(number, rows, ids, self.pairs[rows], self.duration[rows])
        if self.sites is None:
            return part
        used, site = np.unique(self.sites.of[rows], return_inverse=True)
        return replace(part, sites=tuple(self.sites.sites[i] for i in used), site=site)

    @cached_property
    def sizes(self) -> dict[int, int]:
        """How many pairs each part of this shard is to draw; parts with none are left out."""
        counts = np.bincount(self.cut.part[self._admitted]).tolist()
        return {n: size for n, size in enumerate(counts) if size and self.shard.has(n)}

    def _hashes(self, number: int) -> list[list[str | None]]:
        """Hashes of the files that a part is drawn on, as they are now."""
        return [site.hashes() for site in self._part(number).sites]

    @property
    def count(self) -> int:
        """How many pairs this shard is to draw."""
        return sum(self.sizes.values())

    def run(self, draw: Draw, advance: Callable[[int], None]) -> Summary:
        """Draw what is not there yet; with all parts there, write table and manifest.

        Parameters
        ----------
        draw : callable
            Of `dmpcli.batch.workers`.
        advance : callable
            Told how many pairs are done.

        Returns
        -------
        Summary

        Raises
        ------
        RefusedError
            A pair cannot be drawn, and the job is to stop then. Finished parts stay.
        InputError
            The folder cannot be written.
        """
        folder = Folder(self.job)
        kept = folder.open(self.sizes, self.shard.whole, self._hashes)
        summary = Summary(kept=len(kept))
        try:
            for outcome in self._all(kept, draw):
                self._note(outcome, self.sizes[outcome.number], summary)
                advance(self.sizes[outcome.number])
        finally:
            folder.leave()
        if self.shard.whole:
            folder.finish(self._table(), self._manifest())
        return summary

    def _all(self, kept: dict[int, Outcome], draw: Draw) -> Iterator[Outcome]:
        yield from kept.values()
        yield from draw(self.job, map(self._part, (n for n in self.sizes if n not in kept)))

    def _note(self, outcome: Outcome, size: int, summary: Summary) -> None:
        self._outcomes[outcome.number] = outcome
        for row, why in outcome.failed.items():
            self.table.status[row] = f"{self.table.place(row)}, pair {self.table.ids[row]}: {why}"
        for remark in outcome.told:
            summary.told.add(remark)
        if outcome.fatal:
            said = f"{self.table.name}: {self.table.status[min(outcome.failed)]}"
            if not outcome.refused:
                raise InputError(f"{said}; or give --on-error skip")
            raise RefusedError(f"{said}; move the pair, or give --on-error skip")
        summary.parts += 1
        summary.drawn += size - len(outcome.failed)
        summary.failed += len(outcome.failed)
        summary.unfolded += outcome.unfolded
        summary.split += len(outcome.pieces)
        summary.slow += outcome.slow

    def _table(self) -> Record:
        """Return the table of pairs with what became of each; one row for each piece of a split."""
        good = self.table.good
        names = [file_of(number) for number in range(self.cut.count)]
        numbers = self.cut.part
        files = [names[n] if drawn else "" for n, drawn in zip(numbers.tolist(), good, strict=True)]
        ids, pairs, lasting = self.table.ids, self._ends(good), self._lasting(good)
        normals, status = self._normals(good), self.table.status
        pieces = {k: v for outcome in self._outcomes.values() for k, v in outcome.pieces.items()}
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
        hashes = [site.hashes()[0] or "" for site in self.sites.sites] + [""]
        of = self.sites.of[rows].tolist()
        return [names[i] for i in of], [hashes[i] for i in of]

    def _placed(self) -> tuple[Integers, Floats]:
        """Rows (k,) whose table names their surfaces, and start, goal and normal of each (k, 9)."""
        rows, places = [], []
        for outcome in self._outcomes.values():
            rows += list(outcome.placed)
            places += [(place + [np.nan] * 3)[:9] for place in outcome.placed.values()]
        return np.array(rows, dtype=np.int64), np.array(places).reshape(-1, 9)

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
            for row, seconds in outcome.clipped.items():
                lasting[row] = seconds
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

    def _manifest(self) -> dict[str, Any]:
        entries = [
            manifest.Entry(
                file=file_of(number),
                pairs=size,
                rows=self._outcomes[number].rows,
                bytes=self._outcomes[number].size,
            )
            for number, size in self.sizes.items()
            if self._outcomes[number].rows
        ]
        drawn = self.table.status.count(OK)
        return manifest.document(entries, len(self.table), drawn, self.job.provenance)
