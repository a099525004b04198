"""fit, generalize and report over real human strokes, through files and pipes."""

import json

import numpy as np
import pandas as pd
import pytest

from tests.human_strokes import shapes, strokes


@pytest.mark.parametrize("shape", shapes())
def test_fit_generalize_report(dmpcli, tmp_path, shape):
    for i, stroke in enumerate(strokes(shape)[:2]):
        frame = pd.DataFrame(np.column_stack([stroke.t, stroke.position]), columns=list("txyz"))
        frame.to_csv(tmp_path / f"{i}.csv", index=False, sep=", "[i])
    skill = dmpcli("fit", "0.csv", "1.csv", "-o", "-").stdout
    (tmp_path / "skill.json").write_bytes(skill)
    start, goal = ["100", "-200", "5"], ["160", "-170", "5"]
    drawn = dmpcli("generalize", "-", "-o", "-", "--start", *start, "--goal", *goal, stdin=skill)
    report = dmpcli("report", "skill.json", "-", "--json", stdin=drawn.stdout).stdout
    assert json.loads(report)["schema"] == "report"
    document = json.loads(skill)
    sizes = [np.linalg.norm(np.ptp(s.position, axis=0)) for s in strokes(shape)[:2]]
    # Two people's strokes are averaged by one skill; each alone is bounded in test_primitives.
    assert document["reproduction"][0]["rms"] < 0.35 * max(sizes)
