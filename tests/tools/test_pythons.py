"""Which Pythons the continuous integration finds."""

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

TOOLS = Path(__file__).parents[2] / "tools"


@pytest.fixture
def pythons(monkeypatch):
    spec = importlib.util.spec_from_file_location("pythons", TOOLS / "pythons.py")
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "pythons", module)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def fake(tmp_path):
    """Make a program that tells of itself what a Python would."""

    def make(name, version, *, make="CPython", preview=False, free=False, venv=True):
        file = tmp_path / name
        file.parent.mkdir(parents=True, exist_ok=True)
        told = {"name": make, "version": version, "preview": preview, "free": free}
        told |= {"base": str(file), "venv": venv}
        file.write_text(f"#!/bin/sh\necho '{json.dumps(told)}'\n")
        file.chmod(0o755)
        return file

    return make


def test_one_a_minor_version_is_tried_and_it_can_make_environments(pythons, fake):
    files = [
        fake("debian/python3.11", [3, 11, 9], venv=False),
        fake("a/python3.11", [3, 11, 2]),
        fake("b/python3.13", [3, 13, 1]),
        fake("c/python3.13", [3, 13, 4]),
    ]
    tried, left = pythons.found(iter(files))
    assert [python.path for python in tried] == [str(files[1]), str(files[3])]
    assert left == []


def test_what_is_too_old_another_make_or_no_python_is_passed_by(pythons, fake, tmp_path):
    broken = tmp_path / "python3"
    broken.write_text("#!/bin/sh\nexit 127\n")
    broken.chmod(0o755)
    plain = tmp_path / "python3.12"
    plain.touch()
    files = [
        fake("old/python3", [3, 10, 4]),
        fake("pypy/python3", [3, 11, 13], make="PyPy"),
        broken,
        plain,
        tmp_path / "none",
    ]
    assert pythons.found(iter(files)) == ([], [])


def test_previews_and_free_threaded_builds_are_named_and_not_tried(pythons, fake):
    files = [
        fake("a/python3.15", [3, 15, 0], preview=True),
        fake("b/python3.14", [3, 14, 0], free=True),
    ]
    tried, left = pythons.found(iter(files))
    assert tried == []
    assert sorted(python.words.split(",")[0] for python in left) == [
        "3.14.0 (free-threaded)",
        "3.15.0 (preview)",
    ]


def test_version_managers_folders_are_looked_at(pythons, fake, tmp_path, monkeypatch):
    wanted = [
        fake("pyenv/versions/3.12.1/bin/python3", [3, 12, 1]),
        fake("uv/cpython-3.13.0-linux/bin/python3", [3, 13, 0]),
        fake("home/.asdf/installs/python/3.14.0/bin/python3", [3, 14, 0]),
    ]
    (tmp_path / "empty").mkdir()
    monkeypatch.setenv("PATH", str(tmp_path / "empty"))
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setenv("PYENV_ROOT", str(tmp_path / "pyenv"))
    monkeypatch.setenv("UV_PYTHON_INSTALL_DIR", str(tmp_path / "uv"))
    for other in ("ASDF_DATA_DIR", "MISE_DATA_DIR", "RYE_HOME", "HATCH_DATA_DIR"):
        monkeypatch.delenv(other, raising=False)
    tried, _ = pythons.found(pythons.candidates())
    assert [path for path in (python.path for python in tried) if str(tmp_path) in path] == [
        str(file) for file in wanted
    ]


@pytest.mark.slow
def test_it_finds_the_python_that_runs_it():
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    command = [sys.executable, TOOLS / "pythons.py"]
    done = subprocess.run(
        command, env=os.environ | {"PATH": path}, capture_output=True, text=True, check=True
    )
    minor = "import sys; print(sys.version_info[:2])"
    found = [
        subprocess.run([line, "-c", minor], capture_output=True, text=True, check=True).stdout
        for line in done.stdout.splitlines()
    ]
    assert f"{sys.version_info[:2]}\n" in found
