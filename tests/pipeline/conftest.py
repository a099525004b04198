"""Runs the installed command, as a shell would."""

import subprocess
import sys
from pathlib import Path

import pytest

DMPCLI = str(Path(sys.executable).with_name("dmpcli"))


@pytest.fixture
def dmpcli(tmp_path):
    """Run ``dmpcli ARGS`` in a folder of the test's own; returns the finished process."""

    def run(*args, stdin=None, code=0):
        done = subprocess.run(
            [DMPCLI, *map(str, args)], cwd=tmp_path, input=stdin, capture_output=True, check=False
        )
        assert done.returncode == code, done.stderr.decode()
        assert b"Traceback" not in done.stderr
        return done

    return run
