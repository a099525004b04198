"""Settings of all tests."""

import functools
import gc
import os
import signal
import sys
from collections import defaultdict

import pytest
import typer.testing
from hypothesis import settings

from dmpcli.messages import LOG

# The machine may be busy: no test of ours asserts a time, and neither shall hypothesis. Of examples
# of chance a few stand for many, which make properties tries.
settings.register_profile(
    "dmpcli",
    deadline=None,
    derandomize=True,
    print_blob=True,
    max_examples=int(os.environ.get("DMPCLI_EXAMPLES", "30")),
)
settings.load_profile("dmpcli")

FIRST = tuple(
    f"tests/{part}" for part in ("pipeline", "tools", "faults", "docs", "commands", "surfaces")
)
"""What waits or takes long in one file: begun last, it would leave other cores idle at the end."""


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Collect without looking for garbage, there is none; nor look at what was collected later.

    Nor at each 700 objects, as Python does: tests that draw are slower by 4 % for that.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.set_threshold(10_000, 20, 20)
        gc.enable()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    items.sort(key=lambda item: not item.nodeid.startswith(FIRST))
    cases = defaultdict(list)
    for item in items:
        if item.get_closest_marker("sweep") is not None:
            cases[item.nodeid.partition("[")[0]].append(item)
    for swept in cases.values():
        _thin(swept)


def _thin(swept):
    """Mark the cases of a sweep as thorough, but for a few that are spread evenly over it."""
    kept = swept[0].get_closest_marker("sweep").kwargs["kept"]
    few = {(2 * k + 1) * len(swept) // (2 * kept) for k in range(kept)}
    for place, item in enumerate(swept):
        if place not in few:
            item.add_marker("thorough")


SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGTSTP)


@pytest.fixture(autouse=True)
def handlers_of_signals_are_put_back():
    """A test that leaves a signal ignored or counted fails itself, not the next one."""
    before = [signal.getsignal(number) for number in SIGNALS]
    yield
    after = [signal.getsignal(number) for number in SIGNALS]
    for number, handler in zip(SIGNALS, before, strict=True):
        signal.signal(number, handler)
    assert after == before


@pytest.fixture(autouse=True)
def nobody_listens_any_more():
    """A command that was called keeps its terminal: the next test hears messages by itself."""
    yield
    LOG.handlers.clear()
    LOG.propagate = True


def pytest_unconfigure():
    """Let go of what tests keep for one another: a mesh's search tree must not outlive igl."""
    for module in [m for name, m in sys.modules.items() if name.startswith("tests.")]:
        for kept in vars(module).values():
            if isinstance(kept, functools._lru_cache_wrapper):
                kept.cache_clear()
    gc.collect()


# Typer's runner builds all commands anew for each call, which takes longer than most calls do.
typer.testing._get_command = functools.cache(typer.testing._get_command)
