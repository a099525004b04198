from dataclasses import replace

import numpy as np
import pytest
from matplotlib.collections import LineCollection

from dmpcli.records.record import Provenance
from dmpcli.reporting import contact, tables
from dmpcli.reporting.contact_figure import STATES, contact_figure
from tests.reporting.example_files import run, trajectory, wave
from tests.reporting.test_contact import SAID

HELD = SAID | {
    "share": 0.998,
    "rms_error": 0.0423,
    "saturated": 0.02,
    "landing_peak": 5.61,
    "stiffness": 1.912,
    "delay": 0.051,
    "normal_angle": {"mean": np.radians(3.1), "p95": np.radians(3.6), "used": False},
    "friction": 0.2,
}


def coupled():
    """A run that presses with 3 N, rising along its stroke, and whose e is 1.5 mm."""
    made = run(trajectory(wave()))
    drawn = np.flatnonzero(made.columns["phase"] == "stroke")
    force, states = np.zeros(len(made.t)), np.full(len(made.t), "free", dtype=object)
    force[drawn] = np.linspace(2.0, 4.0, len(drawn))
    states[drawn] = "drawing"
    states[drawn[5:10]] = "lost"
    columns = dict(made.columns) | {"fx": 0.0 * force, "fy": 0.0 * force, "fz": force}
    columns |= {"coupling": np.full(len(force), 1.5), "fn": 3.0 * (force > 0.0)}
    columns["contact"] = states
    facts = {"trajectory": {"normal": [0.0, 0.0, 1.0]}, "contact": HELD}
    return replace(made, columns=columns, provenance=Provenance("execute", {}, (), facts)), drawn


def test_force_setpoint_e_and_state_over_time_and_the_force_on_the_path_are_drawn():
    made, drawn = coupled()
    figure = contact_figure(made)
    path, strip, shift, force = figure.axes[:4]
    lines = {tuple(np.asarray(line.get_ydata())[drawn].tolist()) for line in force.lines}
    assert tuple(np.linspace(2.0, 4.0, len(drawn)).tolist()) in lines
    assert tuple(np.full(len(drawn), 3.0).tolist()) in lines
    assert any(np.all(np.asarray(line.get_ydata())[drawn] == 1.5) for line in shift.lines)
    colours = {tuple(one.get_facecolor()[0]) for one in strip.collections}
    assert len(colours) == 3  # free, drawing, lost
    (coloured,) = [one for one in path.collections if isinstance(one, LineCollection)]
    shown = np.asarray(coloured.get_array())
    assert (shown.min(), shown.max()) == pytest.approx((2.0, 4.0), abs=0.1)
    length = np.linalg.norm(np.diff(made.position()[drawn], axis=0), axis=1).sum()
    segments = np.array(coloured.get_segments())
    drawn_length = np.linalg.norm(np.diff(segments, axis=1), axis=2).sum()
    assert drawn_length == pytest.approx(length, rel=1e-6)  # the stroke lies in its plane
    legend = {text.get_text() for text in figure.legends[0].get_texts()}
    assert {"set-point", "lost", "drawing"} <= legend
    assert "oscillating" in STATES
    assert "oscillating" not in legend


def test_a_run_without_a_coupling_has_no_such_figure():
    made, _ = coupled()
    bare = {name: column for name, column in made.columns.items() if name != "coupling"}
    assert contact_figure(replace(made, columns=bare)) is None


def test_what_a_coupling_held_is_a_table():
    text = tables.plain([contact.coupled_table([("a.parquet", HELD), ("b.parquet", SAID)])], 80)
    row = next(line for line in text.splitlines() if line.startswith("a.parquet"))
    for word in ("99.80 %", "0.042", "2.0 %", "5.61", "1.91", "0.051", "3.1", "0.20"):
        assert word in row
    assert "b.parquet" not in text
    assert contact.coupled_table([("b.parquet", SAID)]) is None
