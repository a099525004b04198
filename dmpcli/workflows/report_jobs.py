"""``report --jobs``: the parts of a batch measured in several processes of this machine."""

import signal
from collections import deque
from collections.abc import Iterator
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool

from dmpcli.arrays import Integers
from dmpcli.batch import memory, process_pool
from dmpcli.errors import InputError
from dmpcli.records.dataset import BatchFolder
from dmpcli.reporting.batch import MeasuredStrokes, Measurement

_AHEAD = 2
"""Parts in hand for each process, so that none stands idle while a part travels."""

_how: Measurement | None = None


class ReportProcesses:
    """Measures parts in so many processes; what they find comes in the order of the parts.

    Parameters
    ----------
    count : int
    """

    def __init__(self, count: int) -> None:
        self._count = count

    def __call__(
        self,
        how: Measurement,
        batch: BatchFolder,
        tasks: Iterator[tuple[BatchFolder, Integers]],
    ) -> Iterator[MeasuredStrokes]:
        """Measure parts of a batch; see `reporting.batch.Measure`."""
        count = min(self._count, len(batch.files))
        pool = process_pool.executor(count, _begin, how)
        begun: deque[Future[MeasuredStrokes]] = deque()
        try:
            for part, chosen in tasks:
                begun.append(pool.submit(_measure, part, chosen))
                if len(begun) >= _AHEAD * count:
                    yield begun.popleft().result()
            while begun:
                yield begun.popleft().result()
        except BrokenProcessPool:
            raise InputError(
                "a process that measures was killed, perhaps for want of memory: try fewer --jobs"
            ) from None
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def _begin(how: Measurement) -> None:
    """Begin a process: what is measured against comes once, and Ctrl-C is its parent's affair."""
    global _how
    _how = how
    memory.keep()
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _measure(part: BatchFolder, chosen: Integers) -> MeasuredStrokes:
    assert _how is not None
    return _how.part(part, chosen)
