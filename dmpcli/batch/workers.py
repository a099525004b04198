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
from dmpcli.batch.part import Job, Outcome, Part
from dmpcli.batch.part_drawing import draw_part
from dmpcli.errors import InputError

Draw = Callable[[Job, Iterable[Part]], Iterator[Outcome]]

_AHEAD = 2
"""Parts in hand for each process, so that none stands idle while a part travels."""

_job: Job | None = None


def here(job: Job, parts: Iterable[Part]) -> Iterator[Outcome]:
    """Draw the parts in this process."""
    if job.prepare is None:
        memory.keep()
    for part in parts:
        yield draw_part(job, part)


class Processes:
    """Draws parts in so many processes of this machine, which serve one job until they are closed.

    Parameters
    ----------
    count : int
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._pool: ProcessPoolExecutor | None = None

    def __call__(self, job: Job, parts: Iterable[Part]) -> Iterator[Outcome]:
        """Draw the parts."""
        if self._pool is None:
            self._pool = process_pool.executor(self._count, _begin, job)
        waiting: set[Future[Outcome]] = set()
        done = False
        try:
            for part in parts:
                waiting.add(self._pool.submit(_draw, part))
                if len(waiting) >= _AHEAD * self._count:
                    ended, waiting = wait(waiting, return_when=FIRST_COMPLETED)
                    yield from (future.result() for future in ended)
            while waiting:
                ended, waiting = wait(waiting, return_when=FIRST_COMPLETED)
                yield from (future.result() for future in ended)
            done = True
        except BrokenProcessPool:
            raise InputError(
                "a process that draws was killed, perhaps for want of memory; the same command "
                "goes on from here: try fewer --jobs or --pairs-per-part"
            ) from None
        finally:
            if not done:
                self.close()

    def close(self) -> None:
        """End the processes. Parts in hand are finished: they need not be drawn again."""
        if self._pool is not None:
            self._pool.shutdown(wait=True, cancel_futures=True)
            self._pool = None


def _begin(job: Job) -> None:
    """Begin a process that draws: the job comes once, and Ctrl-C is its parent's affair."""
    global _job
    _job = job
    if job.prepare is None:  # else each part takes another amount, of meshes
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
