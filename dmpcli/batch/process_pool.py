"""Where the processes that draw come from: one that has loaded everything once, for all of them.

It is begun as early as can be, and loads while the command reads its inputs.
"""

import multiprocessing
import os
import signal
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import forkserver
from multiprocessing.context import BaseContext
from typing import TypeVar

T = TypeVar("T")

_LOADED = ["dmpcli.cli", "dmpcli.batch.workers"]


def begin(more: Sequence[str] = ()) -> None:
    """Begin to load; returns at once.

    Parameters
    ----------
    more : sequence of str
        Modules beside those that drawing needs; one that cannot be imported is left out.
    """
    context().set_forkserver_preload([*_LOADED, *more])
    # What is ignored stays so in a new process: Ctrl-C is this one's affair.
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        forkserver.ensure_running()
    finally:
        signal.signal(signal.SIGINT, before)


def context() -> BaseContext:
    """Return what new processes are started with: never a copy of this one and its threads."""
    return multiprocessing.get_context("forkserver")


def executor(count: int, begin: Callable[[T], None], given: T) -> ProcessPoolExecutor:
    """Return so many processes, each of which has begun with what is given.

    Parameters
    ----------
    count : int
    begin : callable
        Called first in each, with `given`.
    given : object
    """
    # What they are forked from may be older than a setting in this process's environment.
    first = (dict(os.environ), begin, given)
    return ProcessPoolExecutor(count, mp_context=context(), initializer=_begin, initargs=first)


def _begin(environment: dict[str, str], begin: Callable[[T], None], given: T) -> None:
    os.environ.clear()
    os.environ.update(environment)
    begin(given)
