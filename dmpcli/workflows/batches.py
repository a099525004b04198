"""How ``generalize`` draws a table of pairs: the run, and what it tells."""

from dataclasses import replace
from pathlib import Path

from dmpcli.batch.part import Job
from dmpcli.batch.run import Batch, Shard, Summary
from dmpcli.batch.site import SitesTold
from dmpcli.batch.workers import Draw
from dmpcli.dmp.feasibility import snapped
from dmpcli.dmp.generalization import draw, seen_from
from dmpcli.errors import InputError, RefusedError, about, counted
from dmpcli.messages import progress, tell, tell_as, warn
from dmpcli.records import file_io, trajectory
from dmpcli.records.pairs import KNOWN, PairTable
from dmpcli.records.record import Form
from dmpcli.records.schemas import OK
from dmpcli.settings.batch import BatchOptions
from dmpcli.workflows.generalize import Ready
from dmpcli.workflows.process import SLOW, SPLIT

SHOWN = 20
"""Bad pairs that are named on the terminal; all are in the folder's table."""


def write(ready: Ready, output: Path, wanted: BatchOptions) -> None:
    """Draw the batch into a folder and say what became of it."""
    _tell(ready.table, output, Shard(*wanted.share), draw_into(ready, output, wanted))


def draw_into(ready: Ready, output: Path, wanted: BatchOptions) -> Summary:
    """Draw the batch into a folder; return what was drawn.

    Raises
    ------
    InputError
        No pair can be drawn.
    """
    task, table, duration = ready.task, ready.table, ready.duration
    if not table.good.any():
        raise InputError(f"{table.name}: no pair can be drawn; the first: {table.status[0]}")
    facts = ready.provenance.facts | {"rate": task.style.rate}
    if ready.sites is None:
        drawable = table.pairs[table.good.nonzero()[0]]
        seen, heights = seen_from(task.skill, task.style, drawable, task.surface)
        facts |= trajectory.facts_of(seen, task.style, heights)
    form = Form(wanted.float32, wanted.compression)
    p = replace(ready.provenance, facts=facts)
    job = Job(task, wanted.stop, p, form, str(output), ready.prepare)
    pairs = table.pairs if task.surface is None else snapped(table.pairs, task.surface)
    batch = Batch(
        job,
        table,
        pairs,
        duration,
        wanted.pairs_per_part,
        Shard(*wanted.share),
        ready.sites,
        wanted.surfaces_per_part,
    )
    draw_with = _workers(wanted)
    first = table.good.nonzero()[0][:1]
    with about("skill"):
        # A skill that gives no stroke must not cost an older batch.
        draw(task.skill, pairs[first], duration[first], task.surface, task.style)
    with progress("drawing", batch.count) as advance:
        return batch.run(draw_with, advance)


def _workers(wanted: BatchOptions) -> Draw:
    from dmpcli.batch import workers

    if wanted.cluster is not None:
        from dmpcli.batch import cluster

        return cluster.workers(wanted.cluster)
    if wanted.jobs > 1:
        return workers.processes(wanted.jobs)
    from dmpcli.batch import memory

    memory.keep()
    return workers.here


def tell_of_unknown(table: PairTable) -> None:
    """Say once which columns of a table nobody reads."""
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


def _tell(table: PairTable, output: Path, shard: Shard, summary: Summary) -> None:
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
    bad = [status for status in table.status if status != OK]
    for status in bad[:SHOWN]:
        tell(f"{table.name}: skipped: {status}")
    if len(bad) > SHOWN:
        more = f"{table.name}: and {len(bad) - SHOWN} more"
        tell(f"{more}; {output}/{file_io.TABLE} names all" if shard.whole else more)
    if not shard.whole:
        tell(
            f"{output}: shard {shard.index}/{shard.count}: {counted(summary.drawn, 'stroke')} "
            f"drawn, {summary.failed} failed; once all shards are done, the same command without "
            "--shard writes the table and the manifest",
        )
        return
    if len(bad) == len(table):
        raise RefusedError(
            f"{table.name}: no pair can be drawn, {output}/{file_io.TABLE} says why of each; move "
            "the pairs"
        )
    drawn = len(table) - len(bad)
    told = f"{output}: {counted(drawn, 'stroke')} drawn, {counted(len(bad), 'pair')} skipped"
    if bad:
        warn(told)
    else:
        tell(told)
