"""Who draws the parts: this process, several on this machine, or the workers of a cluster.

Each takes the parts one by one and holds few of them at a time, so that memory does not grow with
their number, and gives back outcomes in whatever order they are done.
"""

import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import connection, parent_process

from dmpcli.batch import memory, process_pool
from dmpcli.batch.part import Job, Outcome, Part, draw_part
from dmpcli.errors import InputError

Draw = Callable[[Job, Iterable[Part]], Iterator[Outcome]]

_AHEAD = 2
"""Parts in hand for each process, so that none stands idle while a part travels."""

_job: Job | None = None


def here(job: Job, parts: Iterable[Part]) -> Iterator[Outcome]:
    """Draw the parts in this process."""
    for part in parts:
        yield draw_part(job, part)


def processes(count: int) -> Draw:
    """Return what draws parts in so many processes of this machine."""

    def draw(job: Job, parts: Iterable[Part]) -> Iterator[Outcome]:
        pool = ProcessPoolExecutor(
            count, mp_context=process_pool.context(), initializer=_begin, initargs=(job,)
        )
        waiting: set[Future[Outcome]] = set()
        try:
            for part in parts:
                waiting.add(pool.submit(_draw, part))
                if len(waiting) >= _AHEAD * count:
                    done, waiting = wait(waiting, return_when=FIRST_COMPLETED)
                    yield from (future.result() for future in done)
            while waiting:
                done, waiting = wait(waiting, return_when=FIRST_COMPLETED)
                yield from (future.result() for future in done)
        except BrokenProcessPool:
            raise InputError(
                "a process that draws was killed, perhaps for want of memory; the same command "
                "goes on from here: try fewer --jobs or --pairs-per-part"
            ) from None
        finally:
            # Parts in hand are finished: they need not be drawn again.
            pool.shutdown(wait=True, cancel_futures=True)

    return draw


def _begin(job: Job) -> None:
    """Begin a process that draws: the job comes once, and Ctrl-C is its parent's affair."""
    global _job
    _job = job
    memory.keep()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """Leave when the parent was killed: nobody would ever ask for another part."""
    parent = parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        os._exit(1)


def _draw(part: Part) -> Outcome:
    assert _job is not None
    return draw_part(_job, part)
