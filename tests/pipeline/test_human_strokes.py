"""fit, generalize and report over real human strokes, through files and pipes."""

import json

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from dmpcli import cli
from tests.human_strokes import shapes, strokes

PIPED = ("Angle", "Sine", "heee")
"""Drawn through three processes; the others run the same commands in this one."""


@pytest.fixture
def in_process(tmp_path, monkeypatch):
    """Run ``dmpcli ARGS`` in this process, in a folder of the test's own; returns its output."""
    monkeypatch.chdir(tmp_path)

    def run(*args, stdin=None):
        done = CliRunner().invoke(cli.app, [*map(str, args)], input=stdin)
        assert done.exit_code == 0, done.stderr
        return done.stdout_bytes

    return run


def check_fit_generalize_report(run, folder, shape):
    one = strokes(shape)[0]
    frame = pd.DataFrame(np.column_stack([one.t, one.position]), columns=list("txyz"))
    frame.to_csv(folder / "demo.csv", index=False, sep=" ")
    skill = run("fit", "demo.csv", "-o", "-", "--no-trim")
    drawn = run("generalize", "-", "-o", "-", "--reproduce", stdin=skill)
    report = run("report", "demo.csv", "-", "--json", stdin=drawn)
    demonstrated, stroke = (file["strokes"][0] for file in json.loads(report)["files"])
    size = np.linalg.norm(np.ptp(one.position, axis=0))
    # At 50 Hz; the report prepares the demonstration anew, trimmed and smoothed.
    assert stroke["deviation"]["nearest_rms"] < 0.005 * size
    assert stroke["length"] == pytest.approx(demonstrated["length"], rel=0.02)
    assert stroke["goal_error"] < 0.005 * size


@pytest.mark.slow
@pytest.mark.parametrize("shape", PIPED)
def test_fit_generalize_report_through_pipes(dmpcli, tmp_path, shape):
    check_fit_generalize_report(lambda *a, **k: dmpcli(*a, **k).stdout, tmp_path, shape)


@pytest.mark.parametrize("shape", [shape for shape in shapes() if shape not in PIPED])
def test_fit_generalize_report(in_process, tmp_path, shape):
    check_fit_generalize_report(in_process, tmp_path, shape)
