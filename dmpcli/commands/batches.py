"""How ``generalize`` draws a table of pairs: its own options, the run, and what it tells."""

from pathlib import Path
from typing import TYPE_CHECKING

from dmpcli.errors import InputError, RefusedError, counted

if TYPE_CHECKING:
    from dmpcli.arrays import Floats
    from dmpcli.batch.job import Task
    from dmpcli.batch.run import Shard, Summary
    from dmpcli.batch.workers import Draw
    from dmpcli.records.pairs import PairTable
    from dmpcli.records.record import Provenance
    from dmpcli.settings.batch import BatchOptions
    from dmpcli.settings.options import Given

SHOWN = 20
"""Bad pairs that are named on the terminal; all are in the folder's table."""


def check(wanted: "BatchOptions", given: "Given", pairs: bool) -> None:
    """Check the options that belong to ``--pairs``.

    Raises
    ------
    InputError
        One is given without ``--pairs``, or they say nothing together.
    """
    from dmpcli.settings.model import settings_of

    alone = next((one.flag for one in settings_of(type(wanted)) if one.name in given), None)
    if not pairs and alone is not None:
        raise InputError(f"{alone}: belongs to --pairs; leave it out")
    if wanted.cluster is not None and "jobs" in given:
        raise InputError("--jobs and --cluster: the cluster has its own workers; leave --jobs out")
    if wanted.cluster is not None and "://" not in wanted.cluster:
        raise InputError(f"--cluster {wanted.cluster}: must be an address, as in tcp://HOST:8786")


def write(
    task: "Task",
    table: "PairTable",
    duration: "Floats",
    provenance: "Provenance",
    output: Path,
    wanted: "BatchOptions",
    quiet: bool,
) -> None:
    """Draw the batch and say what became of it."""
    from dataclasses import replace

    from dmpcli.batch.job import Job
    from dmpcli.batch.run import Batch, Shard
    from dmpcli.commands.messages import about, progress
    from dmpcli.primitives.admission import snapped
    from dmpcli.primitives.drawing import draw, seen_from
    from dmpcli.records import trajectory
    from dmpcli.records.record import Form

    if not table.good.any():
        raise InputError(f"{table.name}: no pair can be drawn; the first: {table.status[0]}")
    drawable = table.pairs[table.good.nonzero()[0]]
    seen, heights = seen_from(task.skill, task.style, drawable, task.surface)
    facts = provenance.facts | trajectory.facts_of(seen, task.style, heights)
    facts |= {"rate": task.style.rate}
    form = Form(wanted.float32, wanted.compression)
    job = Job(task, wanted.stop, replace(provenance, facts=facts), form, str(output))
    pairs = table.pairs if task.surface is None else snapped(table.pairs, task.surface)
    shard = Shard(*wanted.share)
    batch = Batch(job, table, pairs, duration, wanted.pairs_per_part, shard)
    draw_with = _workers(wanted)
    first = table.good.nonzero()[0][:1]
    with about("skill"):
        # A skill that gives no stroke must not cost an older batch.
        draw(task.skill, pairs[first], duration[first], task.surface, task.style)
    with progress("drawing", batch.count, quiet) as advance:
        summary = batch.run(draw_with, advance)
    _tell(table, output, shard, summary, quiet)


def _workers(wanted: "BatchOptions") -> "Draw":
    from dmpcli.batch import workers

    if wanted.cluster is not None:
        from dmpcli.batch import cluster

        return cluster.workers(wanted.cluster)
    if wanted.jobs > 1:
        return workers.processes(wanted.jobs)
    from dmpcli.batch import memory

    memory.keep()
    return workers.here


def _tell(
    table: "PairTable", output: Path, shard: "Shard", summary: "Summary", quiet: bool
) -> None:
    from dmpcli.commands.messages import tell, warn
    from dmpcli.commands.process_options import SLOW, SPLIT
    from dmpcli.records import streams
    from dmpcli.records.pairs import OK

    if summary.unfolded:
        warn(
            f"{counted(summary.unfolded, 'stroke')} across a sharp crease, where no tool can "
            "follow the surface"
        )
    if summary.slow:
        warn(f"{output}: {counted(summary.slow, 'stroke')} {SLOW}")
    if summary.split:
        tell(f"{output}: {counted(summary.split, 'stroke')} {SPLIT}", quiet)
    if summary.kept:
        tell(f"{output}: {summary.kept} of {summary.parts} parts were there already", quiet)
    bad = [status for status in table.status if status != OK]
    for status in bad[:SHOWN]:
        tell(f"{table.name}: skipped: {status}", quiet)
    if len(bad) > SHOWN:
        more = f"{table.name}: and {len(bad) - SHOWN} more"
        tell(f"{more}; {output}/{streams.TABLE} names all" if shard.whole else more, quiet)
    if not shard.whole:
        tell(
            f"{output}: shard {shard.index}/{shard.count}: {counted(summary.drawn, 'stroke')} "
            f"drawn, {summary.failed} failed; once all shards are done, the same command without "
            "--shard writes the table and the manifest",
            quiet,
        )
        return
    if len(bad) == len(table):
        raise RefusedError(
            f"{table.name}: no pair can be drawn, {output}/{streams.TABLE} says why of each; move "
            "the pairs"
        )
    drawn = len(table) - len(bad)
    told = f"{output}: {counted(drawn, 'stroke')} drawn, {counted(len(bad), 'pair')} skipped"
    if bad:
        warn(told)
    else:
        tell(told, quiet)
