"""List every CPython from 3.11 on that is found here, one a minor version: its path, a line each.

Looked at: ``python3`` and ``python3.N`` on the path, and what the version managers pyenv, uv, asdf,
mise, rye and hatch keep, and python.org's installer on macOS. Of several of a minor version one
that can make environments goes before one that can't (Debian without python3-venv), a later
release before an earlier one. Previews and builds without the global lock are named on standard
error and left out: nothing here says that it works with them.
"""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

OLDEST = (3, 11)
TELL = """
import importlib.util, json, platform, sys, sysconfig
print(json.dumps({
    "name": platform.python_implementation(),
    "version": list(sys.version_info[:3]),
    "preview": sys.version_info.releaselevel != "final",
    "free": bool(sysconfig.get_config_var("Py_GIL_DISABLED")),
    "base": getattr(sys, "_base_executable", sys.executable),
    "venv": all(importlib.util.find_spec(m) for m in ("venv", "ensurepip")),
}))
"""
FOLDERS = (
    ("PYENV_ROOT", "~/.pyenv", "versions/*/bin/python3"),
    ("UV_PYTHON_INSTALL_DIR", "~/.local/share/uv/python", "*/bin/python3"),
    ("ASDF_DATA_DIR", "~/.asdf", "installs/python/*/bin/python3"),
    ("MISE_DATA_DIR", "~/.local/share/mise", "installs/python/*/bin/python3"),
    ("RYE_HOME", "~/.rye", "py/*/bin/python3"),
    ("HATCH_DATA_DIR", "~/.local/share/hatch", "pythons/*/python/bin/python3"),
    ("", "/Library/Frameworks/Python.framework", "Versions/*/bin/python3"),
)
"""Where managers keep Pythons: the variable that moves the folder, the folder, what is in it."""
ASKED = (["pyenv", "root"], ["uv", "python", "dir"])
"""Managers that tell their folder, which may be elsewhere by a setting of theirs."""


@dataclass(frozen=True)
class Python:
    """A CPython as it tells of itself."""

    path: str
    version: tuple[int, int, int]
    preview: bool
    free: bool
    venv: bool

    @property
    def words(self) -> str:
        """What to call it."""
        kind = " (preview)" if self.preview else " (free-threaded)" if self.free else ""
        return f"{'.'.join(map(str, self.version))}{kind}, {self.path}"


def candidates() -> Iterator[Path]:
    """Every file that may be a Python; a link to another is named again."""
    names = ["python3", *(f"python3.{minor}" for minor in range(OLDEST[1], 30))]
    for folder in os.get_exec_path():
        yield from (Path(folder, name) for name in names)
    for variable, home, pattern in FOLDERS:
        root = Path(os.environ.get(variable) or home).expanduser()
        yield from sorted(root.glob(pattern))
    for command in ASKED:
        if shutil.which(command[0]):
            said = subprocess.run(command, capture_output=True, text=True, check=False)
            root = Path(said.stdout.strip() or os.devnull)
            yield from sorted([*root.glob("versions/*/bin/python3"), *root.glob("*/bin/python3")])


def ask(path: Path) -> Python | None:
    """Let a file say what Python it is; nothing where it is none, or not ours to try."""
    if not os.access(path, os.X_OK):
        return None
    command = [str(path), "-I", "-c", TELL]
    try:
        said = subprocess.run(
            command, capture_output=True, text=True, timeout=30, check=True
        ).stdout
        told = json.loads(said)
    except (OSError, ValueError, subprocess.SubprocessError):
        return None  # a manager's stand-in for a version that is not chosen, or no Python
    if told["name"] != "CPython" or tuple(told["version"]) < OLDEST:
        return None
    version = (told["version"][0], told["version"][1], told["version"][2])
    return Python(told["base"], version, told["preview"], told["free"], told["venv"])


def found(files: Iterator[Path]) -> tuple[list[Python], list[Python]]:
    """Return the Pythons to try, one a minor version, oldest first, and those that are left out."""
    asked: dict[str, Python] = {}
    seen: set[Path] = set()
    for file in files:
        if not file.exists() or file.resolve() in seen:
            continue
        # Stand-ins are one file for all versions: they are told apart by their own names.
        if file.parent.name != "shims":
            seen.add(file.resolve())
        python = ask(file)
        if python:
            asked.setdefault(os.path.realpath(python.path), python)
    out = [python for python in asked.values() if python.preview or python.free]
    best: dict[tuple[int, int], Python] = {}
    for python in sorted(set(asked.values()) - set(out), key=lambda p: (p.venv, p.version)):
        best[python.version[:2]] = python
    return [best[minor] for minor in sorted(best)], out


if __name__ == "__main__":
    tried, left = found(candidates())
    for python in left:
        print(f"pythons: not tried: {python.words}", file=sys.stderr)
    for python in tried:
        print(python.path)
