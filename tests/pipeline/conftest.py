"""Runs the installed command, as a shell would; or, where the process is not the point, here."""

import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from dmpcli import cli

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


@pytest.fixture
def in_process(tmp_path, monkeypatch):
    """Run ``dmpcli ARGS`` in this process, in a folder of the test's own; returns its result."""
    monkeypatch.chdir(tmp_path)

    def run(*args, stdin=None, code=0):
        done = CliRunner().invoke(cli.app, [*map(str, args)], input=stdin)
        assert done.exit_code == code, done.stderr
        return done

    return run
