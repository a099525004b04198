"""The Makefile for users makes a batch, makes nothing twice, and stops where something is wrong."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.docs.pages import ROOT

DMPCLI = str(Path(sys.executable).with_name("dmpcli"))


def make(folder, *words, code=0):
    done = subprocess.run(
        ["make", "--no-print-directory", f"DMPCLI={DMPCLI}", *words],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == code, done.stdout + done.stderr
    return done


@pytest.mark.thorough
def test_the_batch_that_users_copy(tmp_path):
    folder = tmp_path / "batch"
    shutil.copytree(ROOT / "sample_runs" / "batch", folder, ignore=shutil.ignore_patterns("out"))
    shutil.copy(ROOT / "sample_runs" / "bench.stl", tmp_path / "bench.stl")
    told = make(folder, "run").stderr
    assert "4 strokes drawn, 1 pair skipped" in told
    assert (folder / "out" / "run.parquet").exists()
    assert "dmpcli generalize" in (folder / "out" / "batch.log").read_text()
    assert "may be executed" in make(folder, "all").stdout
    assert "Nothing to be done" in make(folder, "run").stdout
    # A pair that is wrong stops the batch where nothing is to be skipped.
    draw = "DRAW=--ease-in 0.5 --ease-out 0.5"
    (folder / "pairs.csv").touch()
    make(folder, "all", draw, code=2)


def test_the_demonstration_leaves_the_papers_experiment_out():
    rules = (ROOT / "Makefile").read_text()
    demo = rules.split("\ndemo:")[1].split("\n\n")[0]
    assert "reproduce" not in demo
    assert "report.html" in demo
