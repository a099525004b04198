"""Where a log has nothing no line is drawn: gaps in time, and samples without a number."""

import io
from dataclasses import replace

import matplotlib.image
import numpy as np
import pytest
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure

from dmpcli.records.record import Provenance, Record
from dmpcli.reporting import drawing, pose_errors, run_figures
from dmpcli.reporting.contact import contact_of
from dmpcli.reporting.contact_figure import contact_figure
from dmpcli.reporting.curve_names import named
from dmpcli.reporting.gaps import gaps, line, usual_step
from dmpcli.reporting.plane_figure import Beyond, plane_figure
from dmpcli.reporting.pose_error_figure import pose_error_figure
from dmpcli.reporting.strokes import strokes_of
from dmpcli.reporting.summary import sentences
from dmpcli.reporting.time_figure import time_figure
from dmpcli.spatial.trajectory import Trajectory
from tests.reporting.example_files import run, trajectory, wave


def felt(**columns):
    """A run that presses with 3 N; the rows of its stroke."""
    made = run(trajectory(wave()))
    n = len(made.t)
    columns = {"fx": np.zeros(n), "fy": np.zeros(n), "fz": np.full(n, 3.0)} | columns
    facts = {"trajectory": {"normal": [0.0, 0.0, 1.0]}}
    provenance = Provenance("execute", {}, (), facts)
    made = replace(made, columns=dict(made.columns) | columns, provenance=provenance)
    return made, np.flatnonzero(made.columns["phase"] == "stroke")


def coupled(made, states="drawing"):
    n = len(made.t)
    words = np.full(n, states, dtype=object)
    more = {"coupling": np.full(n, 0.5), "fn": np.full(n, 3.0), "contact": words}
    return replace(made, columns=dict(made.columns) | more)


def without(made, rows):
    """The run as its log has it when some rows are missing."""
    kept = np.delete(np.arange(len(made.t)), rows)
    return Record(made.schema, {name: c[kept] for name, c in made.columns.items()}, made.provenance)


def spans(axes):
    """Times over which the lines of a panel are drawn, s, one array (k, 2) of whole pieces."""
    found = []
    for one in axes.lines:
        if one.get_linestyle() == "None" or len(one.get_xdata()) < 3:
            continue
        x, y = (np.asarray(v, dtype=float) for v in one.get_data())
        known = np.isfinite(x) & np.isfinite(y)
        joined = known[1:] & known[:-1]
        found += [(a, b) for a, b in zip(x[:-1][joined], x[1:][joined], strict=True)]
    return np.array(found)


def test_a_step_of_more_than_three_usual_ones_is_a_gap():
    t = np.array([0.0, 0.02, 0.04, 0.08, 0.10, 0.18, 0.20])
    assert np.flatnonzero(gaps(t)).tolist() == [4]
    assert usual_step(t) == pytest.approx(0.02)
    assert not gaps(np.array([1.0])).any()
    assert usual_step(np.array([1.0])) == 0.0


def test_a_line_stops_at_gaps_and_a_sample_between_two_unknown_ones_is_a_dot():
    axes = Figure().add_subplot()
    x, y = np.arange(8.0), np.array([0.0, 1.0, np.nan, 3.0, np.nan, 5.0, 6.0, 7.0])
    line(axes, x, y, np.arange(7) == 5, color="#0072B2", lw=1.2)
    drawn, dots = axes.lines
    assert [tuple(pair) for pair in spans(axes)] == [(0.0, 1.0), (6.0, 7.0)]
    assert dots.get_xdata().tolist() == [3.0, 5.0]
    assert dots.get_color() == drawn.get_color()


def test_nothing_is_drawn_over_the_time_that_a_log_lacks():
    made, rows = felt()
    made = without(made, rows[100:200])
    t = made.t
    hole = np.array([t[rows[99]], t[rows[100]]])
    assert np.diff(hole)[0] == pytest.approx(101 * 0.02)
    force = run_figures.force_figure(made, contact_of(made))
    late = run_figures.deadline_figure(made)
    both = contact_figure(coupled(made))
    for axes in (force.axes[0], *late.axes, *both.axes[2:4]):
        pieces = spans(axes)
        assert len(pieces) > 100
        assert np.diff(pieces, axis=1).max() < 0.05
    # The state is not known there either, and the path is not joined.
    path, strip = both.axes[:2]
    (bars,) = strip.collections
    edges = [(p.vertices[:, 0].min(), p.vertices[:, 0].max()) for p in bars.get_paths()]
    assert len(edges) == 2
    assert edges[0][1] == pytest.approx(hole[0] + 0.02)
    assert edges[1][0] == pytest.approx(hole[1])
    (coloured,) = [one for one in path.collections if isinstance(one, LineCollection)]
    steps = np.linalg.norm(np.diff(np.array(coloured.get_segments()), axis=1), axis=2)
    assert steps.max() < 2.0


def test_samples_without_a_force_are_neither_drawn_nor_counted_and_are_told():
    _, rows = felt()
    force = np.full(len(run(trajectory(wave())).t), 3.0)
    force[rows[: len(rows) // 2]] = np.nan
    made, rows = felt(fz=force)
    row = contact_of(made)
    assert row["unknown"] == pytest.approx(0.5, abs=0.01)
    assert (row["least"], row["absent"]) == (3.0, 0.0)
    figure = run_figures.force_figure(made, row)
    begun = made.t[rows[len(rows) // 2]]
    drawn = [pair for pair in spans(figure.axes[0]) if pair[0] >= made.t[rows[0]]]
    assert min(pair[0] for pair in drawn) == pytest.approx(begun, abs=0.021)
    both = contact_figure(coupled(made))
    assert "path without a known force" in [t.get_text() for t in both.legends[0].get_texts()]
    (coloured,) = [one for one in both.axes[0].collections if isinstance(one, LineCollection)]
    coloured.update_scalarmappable()
    colours = coloured.get_colors()
    assert tuple(colours[0]) == to_rgba("#AAAAAA")
    assert tuple(colours[-1]) != to_rgba("#AAAAAA")
    entry = {"file": "run", "strokes": [], "statistics": None, "states": None, "skill": None}
    told = {"cycles": 1, "worst": 0.0, "missed": 0, "tracking_max": 0.0}
    entry |= {"deadlines": told, "contact": row}
    [_, said] = sentences({"surface": None, "reference": None, "files": [entry]})
    assert "Of 49.9 % of what it drew no force is known" in said


def test_a_run_whose_sensor_never_spoke_has_no_figure_of_force():
    n = len(run(trajectory(wave())).t)
    made, _ = felt(**dict.fromkeys(("fx", "fy", "fz"), np.full(n, np.nan)))
    assert contact_of(made) is None
    assert run_figures.force_figure(made, None) is None
    assert contact_figure(coupled(made)) is None


def test_a_set_point_that_was_never_sent_has_no_lateness():
    made, _ = felt()
    late = np.array(made.columns["lateness"])
    late[50:] = np.nan
    made = replace(made, columns=dict(made.columns) | {"lateness": late})
    assert run_figures.deadline_figure(made).axes[0].get_ylim()[1] > 0.0
    never = replace(made, columns=dict(made.columns) | {"lateness": np.full(len(late), np.nan)})
    assert run_figures.deadline_figure(never) is not None


def test_rounding_does_not_fill_the_panels_of_punctuality():
    made, _ = felt()
    late = np.where(np.arange(len(made.t)) % 50 == 0, 1.8e-15, 0.0)
    figure = run_figures.deadline_figure(
        replace(made, columns=dict(made.columns) | {"lateness": late})
    )
    assert figure.axes[0].get_ylim()[1] >= 0.1


def test_a_stroke_is_not_drawn_over_what_its_run_lacks():
    """In time, on its plane and from the side."""
    made, rows = felt()
    made = without(made, rows[100:200])
    (stroke,) = strokes_of(made, "run")
    curves = named([stroke])
    for axes in time_figure(curves).axes:
        assert np.diff(spans(axes), axis=1).max() < 0.05
    beyond = Beyond(np.empty((0, 2, 3)), (), ())
    for axes in plane_figure(curves, [(stroke.start, stroke.goal)], None, beyond).axes:
        longest = max(
            np.nanmax(np.hypot(np.diff(x), np.diff(y)))
            for x, y in (one.get_data() for one in axes.lines)
            if len(x) > 100
        )
        assert longest < 2.0


def test_poses_that_have_no_like_are_not_joined():
    t = 0.02 * np.arange(400)
    whole = Trajectory(t, wave(n=400), None)
    kept = (t < 2.0) | (t > 4.0)
    holed = Trajectory(t[kept], whole.position[kept] + 0.1, None)
    pair = pose_errors.compared("b", "a", holed, whole)
    figure = pose_error_figure(pair)
    assert np.diff(spans(figure.axes[0]), axis=1).max() < 0.05


@pytest.mark.slow
def test_a_picture_of_a_lost_contact_shows_the_colour_of_each_state():
    made, rows = felt()
    states = np.full(len(made.t), "free", dtype=object)
    states[rows] = "drawing"
    states[rows[200:300]] = "lost"
    force = np.array(made.columns["fz"])
    force[rows[200:300]] = 0.0
    made = replace(coupled(made), columns=dict(coupled(made).columns) | {"contact": states})
    made = replace(made, columns=dict(made.columns) | {"fz": force})
    with drawing.settings():
        picture = drawing.saved(contact_figure(made))["png"]
    seen = matplotlib.image.imread(io.BytesIO(picture))[..., :3].reshape(-1, 3)
    for name in ("#009E73", "#E69F00", "#DDDDDD"):
        assert (np.abs(seen - to_rgba(name)[:3]).max(axis=1) < 0.01).sum() > 50, name
