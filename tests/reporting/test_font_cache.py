"""A home that cannot be written is no reason for a warning, nor to search for fonts each time."""

import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

DRAW = "import dmpcli.reporting.drawing, os; print(os.environ.get('MPLCONFIGDIR', ''))"


def drawn(tmp_path, **more):
    """Import what draws, with this environment; returns what it said and its folder."""
    kept = {k: v for k, v in os.environ.items() if not k.startswith(("XDG_", "MPL"))}
    environment = kept | {"TMPDIR": str(tmp_path), "HOME": str(tmp_path / "home")} | more
    command = [sys.executable, "-c", DRAW]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    # On a slow machine matplotlib says after 5 s that it still looks for fonts.
    said = [line for line in done.stderr.splitlines() if "building the font cache" not in line]
    return "\n".join(said), done.stdout.strip()


@pytest.fixture
def ours(tmp_path):
    return tmp_path / f"dmpcli-matplotlib-{os.getuid()}"


@pytest.mark.thorough
def test_a_home_that_can_be_written_is_left_to_matplotlib(tmp_path):
    assert drawn(tmp_path) == ("", "")


# A file where the home should be, and no folder at all: both stop root, too.
@pytest.mark.sweep(kept=1)
@pytest.mark.slow
@pytest.mark.parametrize("home", ["file", pytest.param("/dev/null/home", marks=pytest.mark.slow)])
def test_a_home_that_cannot_be_written_has_one_folder_for_each_user_instead(tmp_path, ours, home):
    (tmp_path / "file").touch()
    place = home if Path(home).is_absolute() else str(tmp_path / home)
    for _ in range(2):
        assert drawn(tmp_path, HOME=place) == ("", str(ours))
    assert stat.S_IMODE(ours.stat().st_mode) == 0o700
    assert any(ours.iterdir())


@pytest.mark.thorough
def test_a_folder_that_others_can_write_is_not_believed(tmp_path, ours):
    ours.mkdir()
    ours.chmod(0o777)
    _, folder = drawn(tmp_path, HOME="/dev/null/home")
    assert folder != str(ours)
    assert not any(ours.iterdir())


@pytest.mark.thorough
def test_what_the_user_chose_stands(tmp_path):
    chosen = str(tmp_path / "chosen")
    assert drawn(tmp_path, HOME="/dev/null/home", MPLCONFIGDIR=chosen) == ("", chosen)
