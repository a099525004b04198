"""The optional packages: what each extra is for, and where its wheels exist.

The one list of them: the message of a command that misses one, the table of docs/install.md, and
the tests that are passed over where there is no wheel are made from it; pyproject.toml names the
same packages.
"""

import importlib
import os
import platform
import sys
from dataclasses import dataclass
from typing import Any

from dmpcli.errors import InputError


@dataclass(frozen=True)
class Wheels:
    """Where a package that is compiled has wheels.

    Attributes
    ----------
    newest : tuple of int
        The last CPython, as (3, 12); the first is the project's own.
    machines : tuple of str
        As ``sys.platform`` and ``platform.machine()`` say them: ``"linux x86_64"``.
    """

    newest: tuple[int, int]
    machines: tuple[str, ...]


@dataclass(frozen=True)
class Extra:
    """An optional part of the program.

    Attributes
    ----------
    name : str
        As in ``pip install 'dmpcli[NAME]'``.
    packages : tuple of str
        What it installs, as pyproject.toml names it.
    purpose : str
        What it is for.
    wheels : Wheels, optional
        Where it has wheels; everywhere without.
    """

    name: str
    packages: tuple[str, ...]
    purpose: str
    wheels: Wheels | None = None

    @property
    def install(self) -> str:
        """The line that installs it."""
        return f"pip install 'dmpcli[{self.name}]'"

    def has_wheel(self, python: tuple[int, int], machine: str) -> bool:
        """Tell whether it can be installed without a compiler there, see `Wheels`."""
        wheels = self.wheels
        return wheels is None or (python <= wheels.newest and machine in wheels.machines)


UR = Extra(
    "ur",
    ("ur-rtde",),
    "`ur://`, Universal Robots' arms",
    Wheels((3, 12), ("linux x86_64", "linux i686", "win32 AMD64")),
)
DASK = Extra("dask", ("dask", "distributed", "threadpoolctl"), "`generalize --cluster`")
SVG = Extra("svg", ("svgelements",), "`import` of SVG drawings")
ROS = Extra("ros", ("rosbags", "mcap"), "MCAP files and ROS 2 bags")
BENCH = Extra(
    "bench",
    ("mujoco",),
    "`bench://` and `simulate --physics mujoco`, contact with physics",
)
MENAGERIE = Extra(
    "menagerie",
    ("mujoco-menagerie",),
    "`bench://ur5e?model=menagerie`, an arm as the MuJoCo Menagerie describes it",
)
VIEW = Extra("view", ("k3d",), "`report --view`, a part that can be turned")
FAST = Extra(
    "fast",
    ("numba",),
    "`--kernels`, large tables on meshes in less than half the time",
    Wheels((3, 15), ("linux x86_64", "linux aarch64", "darwin arm64", "win32 AMD64")),
)
EXTRAS = (UR, DASK, SVG, ROS, BENCH, MENAGERIE, VIEW, FAST)

_MACHINES = {
    "linux x86_64": "Linux x86-64",
    "linux i686": "Linux i686",
    "linux aarch64": "Linux on ARM",
    "darwin arm64": "macOS on ARM",
    "win32 AMD64": "Windows x86-64",
}


def here() -> tuple[tuple[int, int], str]:
    """Return this Python and this machine, see `Wheels`."""
    return sys.version_info[:2], f"{sys.platform} {platform.machine()}"


def python_here() -> str:
    """Return this Python and this machine in words."""
    return f"{platform.python_implementation()} {platform.python_version()} on {here()[1]}"


def load(extra: Extra, option: str, *modules: str) -> list[Any]:
    """Import modules of an extra.

    Parameters
    ----------
    extra : Extra
    option : str
        What needs it, as the command line says it: ``--cluster``.
    *modules : str

    Raises
    ------
    InputError
        One is not there; it says how to install the extra, and where it can't be.
    """
    try:
        return [importlib.import_module(module) for module in modules]
    except ImportError as error:
        raise InputError(missing(extra, option, str(error))) from None


def missing(extra: Extra, option: str, why: str) -> str:
    """Say that an extra is not installed, and what to do.

    Parameters
    ----------
    extra : Extra
    option : str
        What needs it, as the command line says it: ``--cluster``.
    why : str
        What Python said as it looked for it.

    Returns
    -------
    str
        With where it can be had instead, where it has no wheel for this Python and machine.
    """
    text = f"{option}: needs {extra.packages[0]}, which is not installed: {extra.install} ({why})"
    if extra.has_wheel(*here()):
        return text
    return f"{text}\n{extra.packages[0]} has no wheel for {python_here()}: {_where(extra)} has"


def _where(extra: Extra) -> str:
    if extra.wheels is None:
        return "every Python"
    machines = ", ".join(_MACHINES[machine] for machine in extra.wheels.machines)
    return f"CPython 3.11 to {'.'.join(map(str, extra.wheels.newest))} on {machines}"


def kernels_off() -> bool:
    """Tell whether the environment keeps numba from compiling, as is done to look for faults."""
    return os.environ.get("NUMBA_DISABLE_JIT", "").strip() not in ("", "0")
