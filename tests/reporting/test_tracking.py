"""A run whose arm lags, as the report sees it."""

from dataclasses import replace

import numpy as np
import pytest

from dmpcli.records.record import Provenance
from dmpcli.reporting import stroke_measures, tracking
from dmpcli.reporting.strokes import strokes_of
from tests.reporting.example_files import run, trajectory, wave


def lagging(cycles=25, **facts):
    """Half a second behind; after the stroke the set-points wait for as long, as of a retract."""
    planned = trajectory(wave(height=50.0))
    longer = np.vstack([wave(height=50.0), np.repeat(wave()[-1:], cycles, axis=0)])
    made = run(trajectory(longer), lag=cycles)
    made.columns["phase"][-cycles:] = "retract"
    said = {"trajectory": planned.provenance.facts, "simulated": True} | facts
    return replace(made, provenance=Provenance("execute", {}, (), said))


def test_a_stroke_is_what_the_arm_did_one_look_ahead_later():
    late, shifted = (strokes_of(lagging(**said), "run")[0] for said in ({}, {"lookahead": 0.5}))
    assert np.linalg.norm(late.position[-1] - late.goal) > 0.05
    np.testing.assert_allclose(shifted.position, wave(height=50.0), atol=1e-9)
    assert shifted.t[-1] == pytest.approx(10.0)
    assert shifted.wave.mean == pytest.approx(50.0, abs=0.01)


def test_tracking_is_measured_behind_the_look_ahead():
    late, shifted = (
        stroke_measures.deadlines_of(lagging(**said)) for said in ({}, {"lookahead": 0.5})
    )
    assert late["tracking_max"] > 10.0
    assert shifted["tracking_max"] < 1e-6
    assert (late["lookahead"], shifted["lookahead"]) == (0.0, 0.5)


def test_a_run_that_ends_before_the_arm_has_arrived_is_measured_as_far_as_it_goes():
    made = lagging(lookahead=0.5)
    cut = replace(made, columns={name: c[:200] for name, c in made.columns.items()})
    stroke = strokes_of(cut, "run")[0]
    np.testing.assert_allclose(stroke.position, wave(height=50.0)[: 200 - 25 - 5], atol=1e-9)


def test_a_report_of_the_controller_that_stands_in_several_rows_counts_once():
    made = lagging(lookahead=0.5)
    for name in ("t", "x", "y", "z"):
        made.columns[name][101::4] = made.columns[name][100:-1:4]
    stroke = strokes_of(made, "run")[0]
    assert np.diff(stroke.t).min() > 0.0
    assert stroke_measures.row_of(stroke, None)["peak_speed"] < 50.0


def test_rows_are_reached_by_time_where_deadlines_were_missed():
    made = lagging(lookahead=0.5)
    kept = np.delete(np.arange(len(made.t)), [100, 101, 102])
    gone = replace(made, columns={name: c[kept] for name, c in made.columns.items()})
    drawn = tracking.reached(gone, np.flatnonzero(gone.columns["phase"] == "stroke"))
    # Three set-points were not sent, and of three others it was not seen how they were reached.
    assert len(drawn.t) == 501 - 3 - 3
    at = np.rint(drawn.t / 0.02).astype(int) - 5 - 25
    np.testing.assert_allclose(drawn.position(), wave(height=50.0)[at], atol=1e-9)
