"""How ``generalize`` draws a table of pairs: the run, and what it tells."""

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np

from dmpcli.arrays import Integers
from dmpcli.batch.cut import by_site
from dmpcli.batch.part import Job
from dmpcli.batch.run import MOST_IN_ONE, SHOWN, Batch, BatchSummary, Shard, run
from dmpcli.batch.site import PairSites, SitesTold
from dmpcli.batch.workers import Draw
from dmpcli.dmp.feasibility import snapped
from dmpcli.dmp.generalization import draw, seen_from
from dmpcli.errors import InputError, RefusedError, about, counted
from dmpcli.messages import heard, progress, tell, tell_as, warn
from dmpcli.records import file_io, pair_stream, trajectory
from dmpcli.records.pair_stream import PairStream
from dmpcli.records.pairs import KNOWN, PairTable
from dmpcli.records.record import Form
from dmpcli.records.storage import Location
from dmpcli.records.table_shares import ChosenRows, Share
from dmpcli.settings.batch import BatchOptions
from dmpcli.surfaces.plane import Plane
from dmpcli.workflows.generalize import Ready
from dmpcli.workflows.process import SLOW, SPLIT
from dmpcli.workflows.table_sites import TableSites


def write(ready: Ready, output: Location, wanted: BatchOptions) -> None:
    """Draw the batch into a folder and say what became of it.

    Parameters
    ----------
    ready : Ready
    output : Path or ObjectPath
        The folder; parts of the same batch that are there already are not drawn anew.
    wanted : BatchOptions
        Among others which share of the pairs this process draws.

    Raises
    ------
    InputError, RefusedError
        As `draw_into`.
    """
    summary = draw_into(ready, output, wanted)
    _tell(ready.table.name, output, Shard(*wanted.share), summary)


def write_pieces(
    stream: PairStream,
    prepare: Callable[[PairTable], Ready],
    output: Location,
    wanted: BatchOptions,
    alone: bool = False,
    on: TableSites | None = None,
) -> None:
    """Draw a table piece by piece into a folder, and say what became of it.

    Parameters
    ----------
    stream : PairStream
    prepare : callable
        Checks a piece and makes it ready.
    output : Path or ObjectPath
    wanted : BatchOptions
    alone : bool
        Whether nothing but its own row decides what is drawn of a pair: then a shard reads and
        checks no rows but its own.
    on : TableSites, optional
        Where the table names surfaces.

    Raises
    ------
    InputError
        No pair can be drawn, or pieces see what they are drawn on from two sides.
    """
    rows = max(
        wanted.pairs_per_part, pair_stream.ROWS // wanted.pairs_per_part * wanted.pairs_per_part
    )
    shard = Shard(*wanted.share)
    whole, parts = stream, None
    if alone and not shard.whole and on is None:
        stream = stream.of_share(Share(wanted.pairs_per_part, shard.has), rows)
    elif alone and on is not None and not shard.whole:
        own = _rows_of(map(on.at, stream.places(rows)), shard, wanted)
        if len(own.parts):
            stream, parts = stream.of_share(own.rows, rows), own
    stream.check_ids(rows)
    if wanted.stop:
        with heard():  # it is told as they are drawn
            for table in stream.pieces(rows):
                prepare(table)
    told: set[str] = set()

    def pieces() -> Iterator[PairTable]:
        found = stream.pieces(rows)
        first = next(found, None)
        # A share that has no part has nothing to draw, and tells so.
        yield from whole.pieces(rows) if first is None else chain([first], found)

    def readies() -> Iterator[Ready]:
        for number, table in enumerate(pieces()):
            if number == 0:
                tell_of_unknown(table)
            with heard() as said:
                ready = prepare(table)
            for level, text in said:
                if text not in told:
                    told.add(text)
                    tell_as(level, text)
            yield ready

    nested = stream.rows > MOST_IN_ONE * wanted.pairs_per_part
    summary = _drawn(readies(), output, wanted, nested, stream.asked, parts)
    _tell(str(stream.path), output, shard, summary)


def draw_into(ready: Ready, output: Location, wanted: BatchOptions) -> BatchSummary:
    """Draw the batch into a folder; return what was drawn.

    Parameters
    ----------
    ready : Ready
    output : Path or ObjectPath
        The folder; parts of the same batch that are there already are not drawn anew.
    wanted : BatchOptions

    Raises
    ------
    InputError
        No pair can be drawn, or the folder cannot be written.
    RefusedError
        A pair that cannot be drawn ends all, where the order says so.
    """
    table = ready.table
    if not table.good.any():
        raise InputError(f"{table.name}: no pair can be drawn; the first: {table.status[0]}")
    nested = len(table) > MOST_IN_ONE * wanted.pairs_per_part
    return _drawn(iter([ready]), output, wanted, nested, len(table))


@dataclass(frozen=True)
class _OwnRows:
    """The rows of a table that names surfaces of which a shard has the parts.

    Attributes
    ----------
    rows : ChosenRows
    parts : array of int, shape (k,)
        Number of the part of each.
    """

    rows: ChosenRows
    parts: Integers

    def parts_of(self, numbers: Integers) -> Integers:
        """Return the parts of some of the rows, by their numbers in the table."""
        return self.parts[np.searchsorted(self.rows.numbers, numbers)]


def _rows_of(pieces: Iterator[PairSites], shard: Shard, wanted: BatchOptions) -> _OwnRows:
    """Cut a table by the sites of its pieces, as it is cut where all of it is drawn."""
    numbers, parts, groups = [], [], []
    row = part = 0
    for sites in pieces:
        cut = by_site(sites.of, sites.lift, wanted.pairs_per_part, wanted.surfaces_per_part)
        own = np.flatnonzero(shard.has(cut.part + part))
        numbers.append(own + row)
        parts.append(cut.part[own] + part)
        groups.append(len(own))
        row, part = row + len(sites.of), part + cut.count
    return _OwnRows(ChosenRows(np.concatenate(numbers), groups), np.concatenate(parts))


def _drawn(
    readies: Iterator[Ready],
    output: Location,
    wanted: BatchOptions,
    nested: bool,
    total: int,
    own: _OwnRows | None = None,
) -> BatchSummary:
    with _workers(wanted) as draw_with, progress("drawing", total) as advance:
        return run(_batches(readies, output, wanted, nested, own), draw_with, advance)


def _batches(
    readies: Iterator[Ready],
    output: Location,
    wanted: BatchOptions,
    nested: bool,
    own_rows: _OwnRows | None,
) -> Iterator[Batch]:
    """Yield what is to be drawn; all of it is one job, that of the first piece."""
    job: Job | None = None
    first_part = 0
    for ready in readies:
        own = replace(_job(ready, output, wanted), nested=nested)
        if ready.sites is None and len(ready.table):
            first_part = int(ready.table.numbers[0]) // wanted.pairs_per_part
        parts = None if own_rows is None else own_rows.parts_of(ready.table.numbers)
        if parts is not None:
            first_part = int(parts.min())
        if job is None:
            job = own
            _try(ready)
        elif ready.table.good.any() and not _alike(job, own):
            raise InputError(
                f"{ready.table.name}: its pairs see the surface from two sides; draw them as "
                "two tables"
            )
        surface = job.task.surface
        batch = Batch(
            job,
            ready.table,
            ready.table.pairs if surface is None else snapped(ready.table.pairs, surface),
            ready.duration,
            wanted.pairs_per_part,
            Shard(*wanted.share),
            ready.sites,
            wanted.surfaces_per_part,
            first_part,
            parts,
        )
        first_part += batch.cut.count
        yield batch


def _job(ready: Ready, output: Location, wanted: BatchOptions) -> Job:
    task, table = ready.task, ready.table
    facts = ready.provenance.facts | {"rate": task.style.rate}
    if ready.sites is None:
        drawable = table.pairs[table.good.nonzero()[0]]
        seen, heights = seen_from(task.skill, task.style, drawable, task.surface)
        facts |= trajectory.facts_of(seen, task.style, heights)
    form = Form(wanted.float32, wanted.compression)
    p = replace(ready.provenance, facts=facts)
    return Job(task, wanted.stop, p, form, str(output), ready.prepare)


def _alike(job: Job, other: Job) -> bool:
    """Tell whether two pieces of one table are drawn alike."""
    one, two = job.task.surface, other.task.surface
    if isinstance(one, Plane) and isinstance(two, Plane) and one.normal @ two.normal < 0.0:
        return False
    return job.provenance.facts == other.provenance.facts


def _try(ready: Ready) -> None:
    """Draw a stroke: a skill that gives none must not cost an older batch."""
    task, table = ready.task, ready.table
    first = table.good.nonzero()[0][:1]
    pairs = table.pairs[first]
    if not len(first):
        return
    with about("skill"):
        pairs = pairs if task.surface is None else snapped(pairs, task.surface)
        draw(task.skill, pairs, ready.duration[first], task.surface, task.style)


@contextlib.contextmanager
def _workers(wanted: BatchOptions) -> Iterator[Draw]:
    from dmpcli.batch import workers

    if wanted.cluster is not None:
        from dmpcli.batch import cluster

        with cluster.workers(wanted.cluster) as drawing:
            yield drawing
    elif wanted.jobs > 1:
        processes = workers.Processes(wanted.jobs)
        try:
            yield processes
        finally:
            processes.close()
    else:
        yield workers.here


def tell_of_unknown(table: PairTable) -> None:
    """Say once how a table was read, and which of its columns nobody reads."""
    for remark in table.remarks:
        tell(f"{table.name}: {remark}")
    if table.unknown:
        tell(
            f"{table.name}: {', '.join(map(repr, table.unknown))}: no such column is known, and "
            f"none is read but {', '.join(KNOWN)}"
        )


def _tell_of_sites(told: SitesTold) -> None:
    """Say what was odd about the surfaces of a table, once what was so for several."""
    loud = sorted(told.first, key=lambda key: -key[0])
    for level, text in loud[:SHOWN]:
        more = told.count[level, text] - 1
        name = told.first[level, text] + (f" and {more} more" if more else "")
        tell_as(level, f"{name}: {text}")
    if len(loud) > SHOWN:
        tell(f"and {len(loud) - SHOWN} more remarks on surfaces")


def _tell(name: str, output: Location, shard: Shard, summary: BatchSummary) -> None:
    _tell_of_sites(summary.told)
    if summary.unfolded:
        warn(
            f"{counted(summary.unfolded, 'stroke')} across a sharp crease, where no tool can "
            "follow the surface"
        )
    if summary.slow:
        warn(f"{output}: {counted(summary.slow, 'stroke')} {SLOW}")
    if summary.split:
        tell(f"{output}: {counted(summary.split, 'stroke')} {SPLIT}")
    if summary.kept:
        tell(f"{output}: {summary.kept} of {summary.parts} parts were there already")
    for status in summary.skipped:
        tell(f"{name}: skipped: {status}")
    if summary.bad > len(summary.skipped):
        more = f"{name}: and {summary.bad - len(summary.skipped)} more"
        tell(f"{more}; {output}/{file_io.TABLE} names all" if shard.whole else more)
    if not shard.whole:
        tell(
            f"{output}: shard {shard.index}/{shard.count}: {counted(summary.drawn, 'stroke')} "
            f"drawn, {summary.failed} failed; once all shards are done, the same command without "
            "--shard writes the table and the manifest",
        )
        return
    if summary.bad == summary.rows:
        raise RefusedError(
            f"{name}: no pair can be drawn, {output}/{file_io.TABLE} says why of each; move "
            "the pairs"
        )
    drawn = summary.rows - summary.bad
    told = f"{output}: {counted(drawn, 'stroke')} drawn, {counted(summary.bad, 'pair')} skipped"
    if summary.bad:
        warn(told)
    else:
        tell(told)
