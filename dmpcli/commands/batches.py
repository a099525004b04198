"""How ``generalize`` draws a table of pairs: its own options, the run, and what it tells."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dmpcli.errors import InputError, RefusedError, counted

if TYPE_CHECKING:
    from dmpcli.arrays import Floats
    from dmpcli.batch.job import Task
    from dmpcli.batch.run import Shard, Summary
    from dmpcli.batch.workers import Draw
    from dmpcli.records.pairs import PairTable
    from dmpcli.records.record import Provenance

SHOWN = 20
"""Bad pairs that are named on the terminal; all are in the folder's table."""

PAIRS_PER_PART = 2000
_MOST_JOBS, _MOST_PER_PART, _MOST_SHARDS = 1024, 1_000_000, 1_000_000


@dataclass(frozen=True)
class Wanted:
    """What the command line says of a batch.

    Attributes
    ----------
    stop : bool
        Whether a bad pair ends the batch, else it is skipped.
    jobs : int
    cluster : str or None
    shard : tuple of int
        Which share, from 1, of how many.
    pairs_per_part : int
    float32 : bool
    compression : str
    """

    stop: bool = True
    jobs: int = 1
    cluster: str | None = None
    shard: tuple[int, int] = (1, 1)
    pairs_per_part: int = PAIRS_PER_PART
    float32: bool = False
    compression: str = "zstd"

    @property
    def options(self) -> dict[str, Any]:
        """The options that change the result; who draws, and in how many shares, does not."""
        return {
            "on_error": "stop" if self.stop else "skip",
            "pairs_per_part": self.pairs_per_part,
            "float32": self.float32,
            "compression": self.compression,
        }


def asked(
    pairs: Path | None,
    on_error: str | None,
    jobs: int | None,
    cluster: str | None,
    shard: str | None,
    pairs_per_part: int | None,
    float32: bool,
    compression: str | None,
) -> Wanted:
    """Check the options that belong to ``--pairs``.

    Raises
    ------
    InputError
        One is given without ``--pairs``, or is out of its range.
    """
    given = {
        "--on-error": on_error,
        "--jobs": jobs,
        "--cluster": cluster,
        "--shard": shard,
        "--pairs-per-part": pairs_per_part,
        "--float32": float32 or None,
        "--compression": compression,
    }
    alone = next((name for name, value in given.items() if value is not None), None)
    if pairs is None and alone is not None:
        raise InputError(f"{alone}: belongs to --pairs; leave it out")
    if on_error not in (None, "stop", "skip"):
        raise InputError(f"--on-error {on_error}: must be stop or skip")
    if cluster is not None and jobs is not None:
        raise InputError("--jobs and --cluster: the cluster has its own workers; leave --jobs out")
    if cluster is not None and "://" not in cluster:
        raise InputError(f"--cluster {cluster}: must be an address, as in tcp://HOST:8786")
    if compression not in (None, "zstd", "lz4", "snappy", "none"):
        raise InputError(f"--compression {compression}: must be zstd, lz4, snappy or none")
    return Wanted(
        on_error != "skip",
        _counted("--jobs", jobs, 1, _MOST_JOBS),
        cluster,
        _share(shard),
        _counted("--pairs-per-part", pairs_per_part, PAIRS_PER_PART, _MOST_PER_PART),
        float32,
        compression or "zstd",
    )


def _counted(name: str, value: int | None, default: int, most: int) -> int:
    if value is None:
        return default
    if not 1 <= value <= most:
        raise InputError(f"{name} {value}: must be 1 to {most}")
    return value


def _share(text: str | None) -> tuple[int, int]:
    if text is None:
        return 1, 1
    found = re.fullmatch(r"(\d{1,7})/(\d{1,7})", text)
    index, count = (int(found[1]), int(found[2])) if found else (0, 0)
    if not 1 <= index <= count <= _MOST_SHARDS:
        raise InputError(f"--shard {text}: must be I/N with I from 1 to N, as in 3/8")
    return index, count


def write(
    task: "Task",
    table: "PairTable",
    duration: "Floats",
    provenance: "Provenance",
    output: Path,
    wanted: Wanted,
) -> None:
    """Draw the batch and say what became of it."""
    from dataclasses import replace

    from dmpcli.batch.job import Job
    from dmpcli.batch.run import Batch, Shard
    from dmpcli.errors import about
    from dmpcli.messages import progress
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
    shard = Shard(*wanted.shard)
    batch = Batch(job, table, pairs, duration, wanted.pairs_per_part, shard)
    draw_with = _workers(wanted)
    first = table.good.nonzero()[0][:1]
    with about("skill"):
        # A skill that gives no stroke must not cost an older batch.
        draw(task.skill, pairs[first], duration[first], task.surface, task.style)
    with progress("drawing", batch.count) as advance:
        summary = batch.run(draw_with, advance)
    _tell(table, output, shard, summary)


def _workers(wanted: Wanted) -> "Draw":
    from dmpcli.batch import workers

    if wanted.cluster is not None:
        from dmpcli.batch import cluster

        return cluster.workers(wanted.cluster)
    if wanted.jobs > 1:
        return workers.processes(wanted.jobs)
    from dmpcli.batch import memory

    memory.keep()
    return workers.here


def _tell(table: "PairTable", output: Path, shard: "Shard", summary: "Summary") -> None:
    from dmpcli.commands.process_options import SLOW, SPLIT
    from dmpcli.messages import tell, warn
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
        tell(f"{output}: {counted(summary.split, 'stroke')} {SPLIT}")
    if summary.kept:
        tell(f"{output}: {summary.kept} of {summary.parts} parts were there already")
    bad = [status for status in table.status if status != OK]
    for status in bad[:SHOWN]:
        tell(f"{table.name}: skipped: {status}")
    if len(bad) > SHOWN:
        more = f"{table.name}: and {len(bad) - SHOWN} more"
        tell(f"{more}; {output}/{streams.TABLE} names all" if shard.whole else more)
    if not shard.whole:
        tell(
            f"{output}: shard {shard.index}/{shard.count}: {counted(summary.drawn, 'stroke')} "
            f"drawn, {summary.failed} failed; once all shards are done, the same command without "
            "--shard writes the table and the manifest",
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
        tell(told)
