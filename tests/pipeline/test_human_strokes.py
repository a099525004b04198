"""fit, generalize and report over real human strokes, through files and pipes."""

import json

import numpy as np
import pytest

from tests.human_strokes import shapes, strokes

PIPED = "heee"
"""Drawn through three processes; others run the same commands in this one."""


def check_fit_generalize_report(run, folder, shape):
    import pandas as pd

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


@pytest.mark.thorough
def test_fit_generalize_report_through_pipes(dmpcli, tmp_path):
    check_fit_generalize_report(lambda *a, **k: dmpcli(*a, **k).stdout, tmp_path, PIPED)


@pytest.mark.sweep(kept=5)
@pytest.mark.slow
@pytest.mark.parametrize("shape", shapes()[::2])
def test_fit_generalize_report(in_process, tmp_path, shape):
    check_fit_generalize_report(lambda *a, **k: in_process(*a, **k).stdout_bytes, tmp_path, shape)
