"""What the report of a bug needs: versions, extras, drivers and the machine."""

import os
import platform
import sys
from importlib import metadata
from pathlib import Path
from typing import Any

from dmpcli import extras
from dmpcli.instruments import registry
from dmpcli.settings.layers import preset_names
from dmpcli.version import __version__


def info() -> dict[str, Any]:
    """Return what is told, as JSON values; nothing in it names a user or a host."""
    return {
        "schema": "info",
        "version": 1,
        "dmpcli": __version__,
        "installed_at": _anonymous(Path(__file__).parents[1]),
        "python": f"{platform.python_implementation()} {platform.python_version()}",
        "packages": {name: _version(name) for name in _required()},
        "extras": {
            extra.name: {package: _version(package) for package in extra.packages}
            for extra in extras.EXTRAS
        },
        "sensors": ["mock", *registry.schemes("sensor")],
        "robots": ["mock", *registry.schemes("robot")],
        "presets": preset_names(),
        "system": f"{platform.system()} {platform.release()} {platform.machine()}",
        "c_library": " ".join(platform.libc_ver()).strip(),
        "processors": os.cpu_count(),
        "usable_processors": _usable(),
        "memory_gib": _memory(),
        "blas_threads": os.environ.get("OPENBLAS_NUM_THREADS"),
        "encoding": sys.getfilesystemencoding(),
    }


def as_text(found: dict[str, Any]) -> str:
    """Return it as lines of ``name: value``."""
    lines = []
    for key, value in found.items():
        if key in ("schema", "version"):
            continue
        if key == "extras":
            value = {name: _extra(packages) for name, packages in value.items()}
        if isinstance(value, dict):
            text = ", ".join(f"{name} {one or 'not installed'}" for name, one in value.items())
        elif isinstance(value, list):
            text = ", ".join(value)
        else:
            text = "unknown" if value is None else str(value)
        lines.append(f"{key.replace('_', ' ')}: {text}")
    return "\n".join(lines) + "\n"


def _extra(packages: dict[str, str | None]) -> str:
    missing = [name for name, version in packages.items() if version is None]
    if missing:
        return f"(without {', '.join(missing)})"
    return "(" + ", ".join(f"{name} {version}" for name, version in packages.items()) + ")"


def _required() -> list[str]:
    """Packages that the program itself needs, by their names on the index."""
    try:
        lines = metadata.requires("dmpcli") or []
    except metadata.PackageNotFoundError:  # run from a folder, not installed
        return []
    names = []
    for line in lines:
        name, _, marker = line.partition(";")
        if "extra" not in marker:
            end = next((i for i, sign in enumerate(name) if sign in " <>=!~[("), len(name))
            names.append(name[:end])
    return names


def _version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


def _usable() -> int | None:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()


def _memory() -> float | None:
    """Return the machine's memory, GiB."""
    try:
        size = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (ValueError, OSError, AttributeError):
        return None
    return round(size / 2**30, 1)


def _anonymous(path: Path) -> str:
    """Return a path without the user's name in it."""
    home = Path.home()
    return f"~/{path.relative_to(home)}" if path.is_relative_to(home) else str(path)
