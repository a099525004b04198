"""fit, generalize and report over real human strokes, through files and pipes."""

import json

import numpy as np
import pandas as pd
import pytest

from tests.human_strokes import shapes, strokes


@pytest.mark.parametrize("shape", shapes())
def test_fit_generalize_report(dmpcli, tmp_path, shape):
    one = strokes(shape)[0]
    frame = pd.DataFrame(np.column_stack([one.t, one.position]), columns=list("txyz"))
    frame.to_csv(tmp_path / "demo.csv", index=False, sep=" ")
    skill = dmpcli("fit", "demo.csv", "-o", "-", "--no-trim").stdout
    drawn = dmpcli("generalize", "-", "-o", "-", "--reproduce", stdin=skill).stdout
    report = dmpcli("report", "demo.csv", "-", "--json", stdin=drawn).stdout
    demonstrated, stroke = (file["strokes"][0] for file in json.loads(report)["files"])
    size = np.linalg.norm(np.ptp(one.position, axis=0))
    # At 50 Hz; the report prepares the demonstration anew, trimmed and smoothed.
    assert stroke["deviation"]["nearest_rms"] < 0.005 * size
    assert stroke["length"] == pytest.approx(demonstrated["length"], rel=0.02)
    assert stroke["goal_error"] < 0.005 * size
