"""Extras: one list, and what install.md, pyproject.toml, messages and skipped tests say of them."""

import re
import sys
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from dmpcli import extras
from dmpcli.batch import cluster
from dmpcli.errors import InputError
from dmpcli.extras import DASK, EXTRAS, UR
from tests.extras_here import needs

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
MACHINES = [("linux", "x86_64"), ("linux", "aarch64"), ("darwin", "arm64"), ("win32", "AMD64")]


def names(requirements):
    return [Requirement(line).name for line in requirements]


def table() -> str:
    """Return the table of extras in docs/install.md."""
    lines = ["| extra | for | installs | wheels |", "| --- | --- | --- | --- |"]
    for extra in EXTRAS:
        packages = ", ".join(extra.packages)
        where = extras._where(extra) if extra.wheels else "every Python and system"
        lines.append(f"| `dmpcli[{extra.name}]` | {extra.purpose} | {packages} | {where} |")
    return "\n".join(lines) + "\n"


def test_readmes_table_is_made_from_the_list():
    readme = (ROOT / "docs" / "install.md").read_text(encoding="utf-8")
    assert table() in readme


def test_pyproject_installs_what_the_list_says():
    optional = dict(PROJECT["optional-dependencies"])
    optional.pop("test")
    assert {name: names(lines) for name, lines in optional.items()} == {
        extra.name: list(extra.packages) for extra in EXTRAS
    }


def test_no_extra_is_needed_without_asking_for_it():
    asked = {package for extra in EXTRAS for package in extra.packages}
    assert not asked & set(names(PROJECT["dependencies"]))


@pytest.mark.slow
@pytest.mark.parametrize("extra", EXTRAS, ids=lambda extra: extra.name)
@pytest.mark.parametrize("python", [(3, 11), (3, 12), (3, 13), (3, 14), (3, 15)])
@pytest.mark.parametrize("machine", MACHINES, ids="-".join)
def test_the_tests_ask_for_an_extra_only_where_it_has_wheels(extra, python, machine):
    where = {
        "python_version": ".".join(map(str, python)),
        "sys_platform": machine[0],
        "platform_machine": machine[1],
    }
    for line in PROJECT["optional-dependencies"]["test"]:
        wanted = Requirement(line)
        if wanted.name in extra.packages and (not wanted.marker or wanted.marker.evaluate(where)):
            assert extra.has_wheel(python, " ".join(machine))


@pytest.mark.parametrize("lock", ["requirements.lock", "requirements-lowest.lock"])
def test_the_locks_name_nothing_without_a_wheel(lock):
    wanted = [Requirement(x) for x in (ROOT / lock).read_text().splitlines() if x[0] != "#"]
    (ur,) = [line for line in wanted if line.name == "ur-rtde"]
    for minor in (11, 12, 13, 14):
        version = {"python_version": f"3.{minor}", "python_full_version": f"3.{minor}.0"}
        for platform, machine in MACHINES:
            place = {"sys_platform": platform, "platform_machine": machine}
            if ur.marker.evaluate(version | place):
                assert UR.has_wheel((3, minor), f"{platform} {machine}")


def without(monkeypatch, *modules):
    for module in modules:
        monkeypatch.setitem(sys.modules, module, None)


def on(monkeypatch, python, machine):
    monkeypatch.setattr(extras, "here", lambda: (python, machine))


def test_a_missing_extra_is_exit_code_2_and_the_line_that_installs_it(monkeypatch):
    on(monkeypatch, (3, 12), "linux x86_64")
    without(monkeypatch, "distributed")
    with pytest.raises(InputError) as dask:
        cluster.workers("tcp://127.0.0.1:1")
    assert dask.value.exit_code == 2
    assert re.match(
        r"--cluster: needs dask, .*: pip install 'dmpcli\[dask\]' \(.*distributed", str(dask.value)
    )
    assert "wheel" not in str(dask.value)


def test_where_it_has_no_wheel_that_is_said_too(monkeypatch):
    on(monkeypatch, (3, 13), "linux x86_64")
    without(monkeypatch, "rtde_control", "rtde_receive")
    with pytest.raises(InputError) as error:
        extras.load(UR, "--robot ur", "rtde_control")
    first, second = str(error.value).splitlines()
    assert "pip install 'dmpcli[ur]'" in first
    assert second.startswith("ur-rtde has no wheel for CPython")
    assert "CPython 3.11 to 3.12 on Linux x86-64" in second


@pytest.mark.parametrize("extra", EXTRAS, ids=lambda extra: extra.name)
def test_an_extra_that_has_a_wheel_here_is_here(extra):
    if extra.has_wheel(*extras.here()):
        assert not needs(extra).args[0]


def test_tests_of_an_extra_without_a_wheel_are_passed_over_with_package_and_python(monkeypatch):
    on(monkeypatch, (3, 99), "linux x86_64")
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    mark = needs(UR)
    assert mark.args == (True,)
    assert mark.kwargs["reason"].startswith("ur-rtde has no wheel for CPython 3.")
    assert needs(DASK).args == (False,)
