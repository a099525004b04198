"""Where matplotlib keeps its list of fonts when the home folder cannot be written.

It would make a new folder and search for fonts in every process, and warn of that each time
(matplotlib issue 18011): one folder for each user in the system's place for such things will do.
"""

import contextlib
import os
import stat
import sys
import tempfile
from pathlib import Path


def choose() -> None:
    """Set ``MPLCONFIGDIR`` where it is not set and matplotlib's own places cannot be written.

    Only on the systems whose places follow XDG; before matplotlib is imported.
    """
    if "MPLCONFIGDIR" in os.environ or not sys.platform.startswith(("linux", "freebsd")):
        return
    places = (("XDG_CONFIG_HOME", "~/.config"), ("XDG_CACHE_HOME", "~/.cache"))
    usual = [Path(os.environ.get(name) or os.path.expanduser(home)) for name, home in places]
    if all(_can_be_made(place / "matplotlib") for place in usual):
        return
    folder = Path(tempfile.gettempdir(), f"dmpcli-matplotlib-{os.getuid()}")
    with contextlib.suppress(OSError):  # matplotlib then has its own way, and says so
        folder.mkdir(mode=0o700, exist_ok=True)
        if _nobody_elses(folder):
            os.environ["MPLCONFIGDIR"] = str(folder)


def _can_be_made(folder: Path) -> bool:
    """Tell whether a folder can be written, or made where it is not there yet."""
    there = next((place for place in (folder, *folder.parents) if os.path.lexists(place)), folder)
    return there.is_dir() and os.access(there, os.W_OK | os.X_OK)


def _nobody_elses(folder: Path) -> bool:
    """Tell whether only this user can write there: matplotlib believes what it finds."""
    found = folder.lstat()
    ours = stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid()
    return ours and not found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
