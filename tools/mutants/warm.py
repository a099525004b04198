"""Mutants within functions, tried where package and tests are loaded already.

To load both for each mutant takes longer than most tests do. A mutant that stands in a function is
that function's code: a child forked from a process that has loaded everything puts it in place, in
every name that holds the function. What functions made while the modules were loaded stays as it
was, so that a score may be too low for it. All other mutants (constants, defaults, decorators) are
tried in processes that load everything anew.
"""

import contextlib
import functools
import gc
import os
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

import hypothesis
import pytest
from _pytest.runner import runtestprotocol

from tools.mutants.operators import Mutant

Key = tuple[str, str, int]
"""Which function: its file, its qualified name and its first line."""

_functions: dict[Key, list[FunctionType]] = defaultdict(list)
_items: dict[str, pytest.Item] = {}


Judging = Callable[[int], dict[str, Any]]
"""Judges the mutant of a number, here or elsewhere."""


def take_one_example() -> None:
    """Let hypothesis look for one failing example, and not make it small."""
    once = [hypothesis.Phase.explicit, hypothesis.Phase.generate]
    hypothesis.settings.register_profile(
        "mutants", hypothesis.settings.default, phases=once, report_multiple_bugs=False
    )
    hypothesis.settings.load_profile("mutants")


class _Session:
    """A pytest plugin: what is to be done once all tests are collected, instead of running them."""

    def __init__(self, work: Callable[[], None]) -> None:
        self.work = work

    def pytest_sessionstart(self) -> None:
        take_one_example()

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        _items.update((item.nodeid, item) for item in session.items)
        _remember()
        self.work()
        return True


def within(files: Iterable[str], options: list[str], work: Callable[[], None]) -> None:
    """Do some work where files of tests, and with them the package, are loaded and collected."""
    pytest.main([*options, *sorted(set(files))], plugins=[_Session(work)])


def _remember() -> None:
    """Note where every function of the package is, and forget what was made by the way."""
    gc.collect()
    here = f"{Path.cwd()}/dmpcli/"
    for found in gc.get_objects():
        if isinstance(found, functools._lru_cache_wrapper):
            if str(getattr(found, "__module__", "")).startswith(("dmpcli", "tests")):
                found.cache_clear()
        elif isinstance(found, FunctionType) and found.__code__.co_filename.startswith(here):
            _functions[_key(found.__code__)].append(found)
    gc.freeze()


def run(tests: Iterable[str], scratch: str, begun: Callable[[str], None]) -> str:
    """Run collected tests in this order until one fails; its name, or nothing. In a child only."""
    chosen = [_items[name] for name in tests if name in _items]
    if chosen:
        factory = chosen[0].config._tmp_path_factory  # type: ignore[attr-defined]
        factory._given_basetemp, factory._basetemp = Path(scratch) / "t", None
    for item, following in zip(chosen, [*chosen[1:], None], strict=True):
        begun(item.nodeid)
        reports = runtestprotocol(item, log=False, nextitem=following)
        if any(report.failed for report in reports):
            return item.nodeid
    return ""


def _key(code: CodeType) -> Key:
    return code.co_filename, code.co_qualname, code.co_firstlineno


def _codes(code: CodeType) -> Iterator[CodeType]:
    """Every code within a module's."""
    for inner in code.co_consts:
        if isinstance(inner, CodeType):
            yield inner
            yield from _codes(inner)


def loaded() -> bool:
    """Whether this process has the package and its tests loaded."""
    return bool(_items)


def fits(mutant: Mutant) -> bool:
    """Whether a mutant may be put in place of functions that are loaded."""
    return loaded() and mutant.in_function


def put(changed: CodeType) -> bool:
    """Put a changed module's functions in place; False where not all of them have one."""
    codes = [code for code in _codes(changed) if _key(code) in _functions]
    many = Counter(_key(code) for code in codes)
    done = False
    for code in codes:
        for found in _functions[_key(code)]:
            if found.__code__ == code:
                continue
            if many[_key(code)] > 1:
                return False
            try:
                found.__code__ = code
            except ValueError:
                return False  # it uses other names of the function around it
            done = True
    return done


def apart(judge: Judging) -> Judging:
    """Judge in a process of its own, forked now: before anything of the repository is loaded."""
    here, there = Pipe()
    if os.fork() == 0:
        here.close()
        _serve(judge, there)
    there.close()

    def ask(number: int) -> dict[str, Any]:
        here.send(number)
        answer: dict[str, Any] = here.recv()
        return answer

    return ask


def _serve(judge: Judging, pipe: Connection) -> None:
    with contextlib.suppress(EOFError):
        while True:
            pipe.send(judge(pipe.recv()))
    os._exit(0)
