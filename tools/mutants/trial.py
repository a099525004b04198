"""A mutant is tried in a process of its own, forked from one that has the others' packages loaded.

Neither the package nor its tests are loaded in the parent: the child puts the changed module in the
place of the file before anything imports it, so constants, defaults and what tests make once are
those of the mutant. What a child does to itself ends with it: memory, time and files are bounded.
"""

import ast
import contextlib
import importlib.abc
import importlib.machinery
import os
import resource
import select
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import CodeType, ModuleType

import pytest

from tools.mutants import warm
from tools.mutants.operators import Mutant
from tools.mutants.reach import QUIET

_MEMORY = 4 * 2**30
"""Bytes beyond those of the parent."""

_LIMIT = 5.0
"""Seconds that any test, or loading them all, may take beside four times its own."""


@dataclass(frozen=True)
class Verdict:
    """Whether a test failed, which one, and how; ``trouble`` is a fault of the trial itself.

    A misfit is a mutant that could not be put in place of what is loaded.
    """

    killed: bool
    by: str = ""
    how: str = ""
    trouble: str = ""
    misfit: bool = False


_LATE = (signal.SIGXCPU, signal.SIGKILL, signal.SIGPROF, signal.SIGALRM)


class _Changed(importlib.abc.MetaPathFinder, importlib.abc.InspectLoader):
    """Import one module from a changed tree, as if it stood in its file."""

    def __init__(self, name: str, file: Path, code: CodeType) -> None:
        self.name, self.file, self.code = name, file, code

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        """Find the one module only."""
        del path, target
        if fullname != self.name:
            return None
        packed = [str(self.file.parent)] if self.file.name == "__init__.py" else None
        spec = importlib.machinery.ModuleSpec(
            fullname, self, origin=str(self.file), is_package=packed is not None
        )
        spec.submodule_search_locations = packed
        spec.has_location = True
        return spec

    def get_code(self, fullname: str) -> CodeType:
        """Give the changed module's."""
        del fullname
        return self.code

    def get_source(self, fullname: str) -> str:
        """Give the source as it stands."""
        del fullname
        return self.file.read_text(encoding="utf-8")


class _Told:
    """A pytest plugin: the chosen tests in the given order, and each told as it begins or fails.

    A test that takes much longer than it was measured to take ends the process: by the processor's
    time, or by a clock where it waits.
    """

    def __init__(self, tests: Mapping[str, float], pipe: int) -> None:
        self.seconds, self.pipe = tests, pipe
        self.rank = {name: n for n, name in enumerate(tests)}

    def _tell(self, what: str, name: str) -> None:
        os.write(self.pipe, f"{what} {name}\n".encode())

    def pytest_sessionstart(self) -> None:
        warm.take_one_example()

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        chosen = [item for item in items if item.nodeid in self.rank]
        items[:] = sorted(chosen, key=lambda item: self.rank[item.nodeid])

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        self._tell("begun", nodeid)
        limit = _LIMIT + 4 * self.seconds[nodeid]
        signal.setitimer(signal.ITIMER_PROF, limit)
        signal.setitimer(signal.ITIMER_REAL, 12 * limit)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed:
            self._tell("failed", report.nodeid)

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        if report.failed:
            self._tell("unloaded", report.nodeid or "conftest.py")


def _in_child(
    file: str, mutant: Mutant | None, tests: Mapping[str, float], seconds: float, pipe: int
) -> None:
    """Run the tests of one trial; never returns."""
    code = 70
    scratch = ""
    try:
        os.setsid()
        null = os.open(os.devnull, os.O_RDWR)
        for stream in (0, 1, 2):
            os.dup2(null, stream)
        pages = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (pages + _MEMORY,) * 2)
        resource.setrlimit(resource.RLIMIT_CPU, (int(seconds) + 1, int(seconds) + 6))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        path = Path(file).resolve()
        tree = mutant.placed() if mutant else ast.parse(path.read_text(encoding="utf-8"))
        changed = compile(tree, str(path), "exec")
        scratch = tempfile.mkdtemp(prefix="mutant")
        told = _Told(tests, pipe)
        if warm.loaded() and (mutant is None or warm.fits(mutant)):
            if mutant and not warm.put(changed):
                os.write(pipe, b"misfit\n")
            elif failed := warm.run(tests, scratch, told.pytest_runtest_logstart):
                os.write(pipe, f"failed {failed}\n".encode())
            code = 0
            return
        name = ".".join(Path(file).with_suffix("").parts)
        sys.meta_path.insert(0, _Changed(name, path, changed))
        files = list(dict.fromkeys(test.partition("::")[0] for test in tests))
        options = [*QUIET, "--tb=no", "-x", f"--basetemp={scratch}/t"]
        code = int(pytest.main([*options, *files], plugins=[told]))
    except SyntaxError:
        os.write(pipe, b"unloaded the module itself\n")
    except BaseException as error:
        os.write(pipe, f"broken {error!r}\n".encode())
    finally:
        with contextlib.suppress(Exception):
            os.write(pipe, f"ended {code}\n".encode())
        shutil.rmtree(scratch, ignore_errors=True)
        os._exit(0)


def _listen(pipe: int, until: float) -> tuple[bytes, bool]:
    """Read what a child tells until it ends or the time is up."""
    told = b""
    while (left := until - time.monotonic()) > 0:
        if not select.select([pipe], [], [], left)[0]:
            break
        block = os.read(pipe, 65536)
        if not block:
            return told, True
        told += block
    return told, False


def attempt(file: str, mutant: Mutant | None, tests: Mapping[str, float]) -> Verdict:
    """Run tests with a module changed (None: as it is), first given first, until one fails.

    Each test's seconds are what it takes of the processor. One that takes over four times as many
    and some more is taken for endless, and so is the whole trial: a kill. On a clock twelve times
    that may pass for one that waits for ever.
    """
    seconds = _LIMIT + 4.0 * sum(tests.values())
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        _in_child(file, mutant, tests, seconds, writing)
    os.close(writing)
    told, ended = _listen(reading, time.monotonic() + 6 * seconds + 30)
    os.close(reading)
    for victim in (os.killpg, os.kill) if not ended else (os.killpg,):
        with contextlib.suppress(ProcessLookupError, PermissionError):
            victim(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    return _judged(told.decode(errors="replace").splitlines(), ended, status)


def _judged(told: list[str], ended: bool, status: int) -> Verdict:
    if "misfit" in told:
        return Verdict(False, misfit=True)
    begun = [line.partition(" ")[2] for line in told if line.startswith("begun ")]
    by = begun[-1] if begun else "loading the tests"
    for line in told:
        what, _, test = line.partition(" ")
        if what == "failed":
            return Verdict(True, test, "failed")
        if what == "unloaded":
            return Verdict(True, test, "could not be loaded")
    closed = [line.partition(" ")[2] for line in told if line.startswith("ended ")]
    if not ended:
        return Verdict(True, by, "time limit")
    if not closed:
        limit = os.WIFSIGNALED(status) and os.WTERMSIG(status) in _LATE
        return Verdict(True, by, "time limit" if limit else "process died")
    if closed[-1] in ("0", "5"):
        return Verdict(False)
    if closed[-1] == "2" and begun:
        return Verdict(True, by, "interrupted")
    broken = [line.partition(" ")[2] for line in told if line.startswith("broken ")]
    return Verdict(False, by, trouble=" ".join([f"pytest ended with {closed[-1]}", *broken]))
