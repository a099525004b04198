"""The paper's figures: which ones, the same bytes twice, peaks marked, no panel filled by noise."""

import io
import re

import matplotlib as mpl
import matplotlib.image
import numpy as np
import pytest

from dmpcli.reporting import drawing
from dmpcli.reporting import paper_figures as figures
from dmpcli.reporting.drawing import curve_of
from dmpcli.reporting.plane_curves import plane_curves
from dmpcli.reporting.strokes import strokes_of
from dmpcli.reporting.time_curves import time_curves
from dmpcli.spatial.trajectory import Trajectory
from tests.reporting.example_files import (
    GOAL,
    NEW_GOAL,
    NEW_START,
    START,
    demonstrated,
    demonstration,
    run,
    trajectory,
    wave,
)


def taught(**more):
    record = demonstration(**more)
    return demonstrated(Trajectory(record.t, record.position()), "demo", None, record.provenance)


def planned(start, goal, height, **facts):
    (stroke,) = strokes_of(trajectory(wave(start, goal, height), **facts), "t")
    return stroke


@pytest.fixture(scope="module")
def strokes():
    carried = trajectory(wave(NEW_START, NEW_GOAL, 49.2))
    return [
        taught(),
        taught(drag="builtin", noise=0.3),
        planned(START, GOAL, 47.7, model="original", forcing_scale="axis"),
        planned(START, GOAL, 49.2),
        planned(NEW_START, NEW_GOAL, 49.2),
        *strokes_of(run(carried), "run"),
    ]


@pytest.fixture(scope="module")
def files(strokes):
    return figures.gallery(strokes)


@pytest.mark.thorough
def test_the_papers_inputs_give_figures_4_to_8_twice_with_the_same_bytes(strokes, files):
    names = {name.rsplit(".", 1)[0] for name in files}
    assert names == {
        "fig4_drag_plane",
        "fig5_reproduction_time",
        "fig6_reproduction_plane",
        "fig7_generalization_time",
        "fig8_generalization_plane",
    }
    assert figures.gallery(strokes) == files


@pytest.mark.slow
def test_pictures_open_and_hold_the_styles_of_their_roles(files):
    for name, content in files.items():
        if name.endswith(".png"):
            picture = matplotlib.image.imread(io.BytesIO(content))
            assert min(picture.shape[:2]) > 300
            assert np.ptp(picture[..., :3]) > 0.9
    drag, new = (
        files[f"{n}_plane.svg"].decode().lower() for n in ("fig4_drag", "fig8_generalization")
    )
    assert "#0072b2" in drag
    assert "#0072b2" not in new
    assert "#e69f00" in new
    assert "<dc:date>" not in drag + new


@pytest.mark.slow
def test_a_readers_matplotlibrc_has_no_say_and_keeps_its_settings(strokes):
    expected = figures.gallery(strokes[:1])
    with mpl.rc_context({"lines.linewidth": 9.0, "font.size": 30.0, "svg.hashsalt": "x"}):
        assert figures.gallery(strokes[:1]) == expected
        assert mpl.rcParams["font.size"] == 30.0


@pytest.mark.slow
def test_a_demonstration_alone_is_drawn_too():
    assert set(figures.gallery([taught()])) == {
        f"{name}.{kind}"
        for name in ("fig5_reproduction_time", "fig6_reproduction_plane")
        for kind in ("svg", "png")
    }


@pytest.mark.slow
def test_further_places_have_their_own_figures_and_many_places_share_one():
    def at(i):
        aside = np.array([0.0, 50.0 * i, 0.0])
        return planned(START + aside, GOAL + aside, 30.0)

    assert "fig8_generalization_2_plane.svg" in figures.gallery([taught(), at(1), at(2)])
    many = figures.gallery([taught(), *(at(i) for i in range(1, 7))])
    assert set(many) == {"fig8_generalization_plane.svg", "fig8_generalization_plane.png"}


def markers(axes):
    """Marker points of a panel: x, y and whether they point up."""
    found = []
    for line in axes.lines:
        if line.get_marker() in ("^", "v"):
            found += [(x, y, line.get_marker() == "^") for x, y in line.get_xydata()]
    return sorted(found)


def test_peak_and_trough_are_marked_where_the_wave_height_was_taken():
    stroke = planned(START, GOAL, 40.0)
    figure = plane_curves([curve_of(stroke)], START, GOAL, stroke.axes)
    (right, left) = markers(figure.axes[0])[::-1]
    # u runs to base -x, so v = n × u is base -y: the first bulge is the lower one.
    assert right[2] is False
    assert left[2] is True
    assert np.hypot(left[0] - right[0], left[1] - right[1]) > 40.0
    assert markers(figure.axes[1]) == []
    in_time = time_curves([curve_of(stroke)])
    assert [len(markers(axes)) for axes in in_time.axes] == [0, 2, 0]
    (first, second) = markers(in_time.axes[1])
    assert (first[2], second[2]) == (False, True)
    assert [first[1], second[1]] == pytest.approx(stroke.wave.at(stroke.position)[:, 1])


def test_marks_follow_the_axis_that_the_wave_swings_along():
    start, goal = np.array([0.0, 0, 0]), np.array([0.0, 100, 0])
    figure = time_curves([curve_of(planned(start, goal, 40.0))])
    assert [len(markers(axes)) for axes in figure.axes] == [2, 0, 0]


def test_a_hundredth_of_a_millimetre_does_not_fill_an_axis():
    stroke = planned(START, GOAL, 40.0)
    for axes in (
        time_curves([curve_of(stroke)]).axes[2],
        plane_curves([curve_of(stroke)], START, GOAL, stroke.axes).axes[1],
    ):
        low, high = axes.get_ylim()
        assert high - low >= 10.0 - 1e-9


def test_the_plane_is_drawn_in_equal_aspect_and_sized_from_the_data():
    def pane(start, goal):
        stroke = planned(start, goal, 20.0)
        figure = plane_curves([curve_of(stroke)], start, goal, stroke.axes)
        axes = figure.axes[0]
        width, height = figure.get_size_inches() * axes.get_position().size
        (x0, x1), (y0, y1) = axes.get_xlim(), axes.get_ylim()
        assert width / (x1 - x0) == pytest.approx(height / (y1 - y0), rel=1e-6)
        return width, height

    wide = pane(np.zeros(3), np.array([300.0, 0, 0]))
    tall = pane(np.zeros(3), np.array([0.0, 300, 0]))
    assert wide[0] > wide[1]
    assert tall[0] < tall[1]


def test_a_standing_plane_is_drawn_in_its_own_coordinates():
    start, goal, normal = np.zeros(3), np.array([0.0, 0, 100]), np.array([1.0, 0, 0])
    path = wave(start, goal, 40.0, normal=normal)
    (stroke,) = strokes_of(trajectory(path, normal=normal.tolist()), "t")
    figure = plane_curves([curve_of(stroke)], start, goal, stroke.axes)
    assert [axes.get_ylabel() for axes in figure.axes] == ["across / mm", "off / mm"]
    heights = sorted(y for _, y, _ in markers(figure.axes[0]))
    assert heights == pytest.approx([-20.0, 20.0], abs=1e-2)


def test_legends_tell_strokes_of_one_role_apart_and_give_the_wave_height():
    two = [planned(START, GOAL, 40.0), planned(START, GOAL, 30.0)]
    names = [curve.name for curve in figures._named(two)]
    assert names == ["modified DMP (t), 40.00 mm", "modified DMP (t), 30.00 mm"]
    assert re.fullmatch(
        r"run, actual, \d+\.\d\d mm",
        figures._named(strokes_of(run(trajectory(wave())), "r"))[0].name,
    )


def test_limits_leave_a_margin():
    low, high = drawing.spanned(0.0, 100.0)
    assert low < 0.0 < 100.0 < high
    assert high - low < 120.0
