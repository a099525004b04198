from dataclasses import replace

import numpy as np
import pytest

from dmpcli.records.record import Provenance
from dmpcli.reporting import document, tables
from dmpcli.reporting.contact import contact_of
from dmpcli.reporting.document import DocumentPart
from dmpcli.reporting.strokes import strokes_of
from dmpcli.spatial.rotations import from_euler, to_euler
from tests.reporting.example_files import run, trajectory, wave

SAID = {"least": -0.1, "mean": 3.01, "largest": 5.2, "absent": 0.0123, "threshold": 0.5}


def felt(normal=(0.0, 0.0, 1.0), rotation=None, facts=None):
    """3 N along a direction while drawing, 1 N on the fourth part of it, 9 N before."""
    made = run(trajectory(wave()))
    force = np.full(len(made.t), 3.0)
    drawing = np.flatnonzero(made.columns["phase"] == "stroke")
    force[drawing[: len(drawing) // 4]] = 0.25
    force[: drawing[0]] = 9.0
    columns = dict(made.columns)
    for axis, share in zip("xyz", normal, strict=True):
        columns[f"f{axis}"] = share * force
    if rotation is not None:
        angles = np.broadcast_to(to_euler(rotation), (len(force), 3))
        columns |= dict(zip(("rx", "ry", "rz"), angles.T, strict=True))
    said = made.provenance.facts if facts is None else facts
    return replace(made, columns=columns, provenance=Provenance("execute", {}, (), said))


def test_what_a_coupling_said_is_told():
    said = {"contact": SAID}
    assert contact_of(felt(facts=said)) == SAID


def test_a_run_without_a_sensor_has_none():
    assert contact_of(run(trajectory(wave()))) is None
    assert contact_of(felt(facts={})) is None  # nothing says which way the surface looks


@pytest.mark.parametrize("where", ["trajectory", "strokes", "tool"])
def test_the_force_is_taken_along_the_planes_normal_or_back_along_the_tool(where):
    normal = np.array([0.6, 0.0, 0.8])
    turned = from_euler(np.array([0.0, np.arctan2(0.6, 0.8) + np.pi, 0.0]))
    np.testing.assert_allclose(-turned[:, 2], normal, atol=1e-12)
    facts = {
        "trajectory": {"trajectory": {"normal": normal.tolist()}},
        "strokes": {
            "trajectory": {"normal": [0, 0, 1]},
            "strokes": [{"id": "1", "normal": normal.tolist()}],
        },
        "tool": {},
    }[where]
    made = felt(normal, turned if where == "tool" else None, facts)
    made.columns["id"] = np.array(["1"] * len(made.t), dtype=object)
    found = contact_of(made)
    assert found["largest"] == pytest.approx(3.0)
    assert found["least"] == pytest.approx(0.25)
    assert found["absent"] == pytest.approx(0.25, abs=0.01)


def test_the_report_has_a_table_of_it():
    made = felt(facts={"trajectory": {"normal": [0, 0, 1]}, "contact": SAID})
    part = DocumentPart("run", "0" * 64, "run", strokes_of(made, "run"), made)
    report = document.document([part])
    assert report["files"][0]["contact"] == SAID
    text = document.as_text(report, 80)
    assert "Force along the normal while drawing, N" in text
    assert "1.23 %" in text
    assert tables.number(3.01, 2) in text
