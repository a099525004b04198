"""Where the processes that draw come from: one that has loaded everything once, for all of them.

It is begun as early as can be, and loads while the command reads its inputs.
"""

import multiprocessing
import signal
from multiprocessing import forkserver
from multiprocessing.context import BaseContext

_LOADED = ["dmpcli.cli", "dmpcli.batch.workers"]


def begin() -> None:
    """Begin to load; returns at once."""
    context().set_forkserver_preload(_LOADED)
    # What is ignored stays so in a new process: Ctrl-C is this one's affair.
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        forkserver.ensure_running()
    finally:
        signal.signal(signal.SIGINT, before)


def context() -> BaseContext:
    """Return what new processes are started with: never a copy of this one and its threads."""
    return multiprocessing.get_context("forkserver")
