"""Which tests reach which line: one run of a room's tests under coverage, test by test."""

import json
import sys
import time
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import coverage
import pytest

QUIET = (
    *("-q", "--tb=short", "-p", "no:cacheprovider", "-p", "no:xdist", "-p", "no:cov"),
    *("-W", "ignore::pytest.PytestAssertRewriteWarning"),  # plugins are loaded beforehand
)


class _Watch:
    """A pytest plugin: coverage is told which test runs, and each test's time is kept."""

    def __init__(self, cover: coverage.Coverage) -> None:
        self.cover = cover
        self.seconds: dict[str, float] = {}

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        self.cover.switch_context(item.nodeid)
        begun = time.process_time()
        answer = yield
        self.seconds[item.nodeid] = round(time.process_time() - begun, 4)
        self.cover.switch_context("")
        return answer


def measure(tests: str, rooms: list[Path], kept: Path) -> int:
    """Run the tests of a folder and keep what they reach in the rooms; pytest's exit code.

    Kept are the tests with their times, s of this process, for each file and line the tests that
    ran it (by number), and the modules that were loaded: a judge loads those of others beforehand.
    """
    cover = coverage.Coverage(
        data_file=None, include=[f"{room}/*" for room in rooms], config_file=False, messages=False
    )
    watch = _Watch(cover)
    cover.start()
    code = int(pytest.main([*QUIET, tests], plugins=[watch]))
    cover.stop()
    if code:
        return code
    data = cover.get_data()
    number = {name: n for n, name in enumerate(watch.seconds)}
    lines = {
        str(Path(file).relative_to(Path.cwd())): {
            str(line): sorted(number[name] for name in names if name)
            for line, names in data.contexts_by_lineno(file).items()
        }
        for file in sorted(data.measured_files())
    }
    modules = sorted(name for name, module in sys.modules.items() if not _here(module))
    kept.parent.mkdir(parents=True, exist_ok=True)
    kept.write_text(json.dumps({"seconds": watch.seconds, "lines": lines, "modules": modules}))
    return 0


@dataclass(frozen=True)
class Reach:
    """What the tests reach: seconds by test, and tests by file and line."""

    seconds: dict[str, float]
    lines: dict[str, dict[int, set[str]]]
    modules: list[str]

    def of(self, file: str, lines: set[int]) -> set[str]:
        """The tests that run any of a file's lines."""
        found = self.lines.get(file, {})
        return set().union(*(found.get(line, set()) for line in lines))


def read(kept: list[Path]) -> Reach:
    """What several folders' tests reach, together."""
    reach = Reach({}, {}, [])
    modules: dict[str, None] = {}
    for path in kept:
        held: dict[str, Any] = json.loads(path.read_text())
        names = list(held["seconds"])
        reach.seconds.update(held["seconds"])
        modules.update(dict.fromkeys(held["modules"]))
        for file, lines in held["lines"].items():
            table = reach.lines.setdefault(file, {})
            for line, tests in lines.items():
                table.setdefault(int(line), set()).update(names[n] for n in tests)
    reach.modules.extend(modules)
    return reach


def _here(module: ModuleType) -> bool:
    """Tell what lies in this repository: it, or what it loads, is what mutants are put into."""
    file = str(getattr(module, "__file__", None) or "")
    # The environment may stand in the repository's folder.
    return file.startswith(f"{Path.cwd()}/") and not file.startswith(f"{sys.prefix}/")


def load(modules: list[str]) -> None:
    """Load what the tests load of others, so that forked judges have it.

    Raises
    ------
    RuntimeError
        Something of the repository itself was loaded with it: no mutant of that would be seen.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name in modules:
            if not name.startswith(("_pytest.", "__", "py.")) and name not in sys.modules:
                try:
                    __import__(name)
                except Exception:
                    continue  # one that only its own program can load
    loaded = [n for n, m in sys.modules.items() if _here(m) and not n.startswith("tools")]
    if loaded := [name for name in loaded if name != "__main__" and name != "__mp_main__"]:
        raise RuntimeError(f"loaded before any mutant: {', '.join(loaded[:5])}")
