"""Curves: each can be told from every other, and says what it is."""

from dataclasses import replace

import numpy as np
import pytest

from dmpcli.reporting.curve_names import LONGEST, later, named, short, styles_of
from dmpcli.reporting.plane_figure import rounded
from tests.reporting.example_files import demonstrated, demonstration
from tests.reporting.test_figures import GOAL, START, planned, taught


def test_twenty_strokes_of_one_role_have_twenty_styles():
    one = planned(START, GOAL, 40.0)
    styles = styles_of([one] * 20)
    assert len({(style.color, style.line) for style in styles}) == 20
    assert styles[0].name == "modified DMP"


def test_two_roles_keep_their_colours():
    demo, drawn = styles_of([taught(), planned(START, GOAL, 40.0)])
    assert (demo.color, drawn.color) == ("#000000", "#E69F00")


def test_curves_are_numbered_and_called_by_their_file():
    curves = named([taught(), planned(START, GOAL, 40.0)])
    assert [curve.number for curve in curves] == ["1", "2"]
    assert curves[0].name == "demo: demonstration, wave 49.98 mm"
    assert "admittance" not in curves[0].name
    assert named([taught()])[0].number == ""


def test_the_same_motion_begun_later_is_moved_by_so_much():
    one = planned(START, GOAL, 40.0)
    t = np.concatenate([0.02 * np.arange(25), 0.5 + one.t])
    rest = np.repeat(one.position[:1], 25, axis=0)
    delayed = replace(one, t=t, position=np.vstack([rest, one.position]))
    assert later(one, delayed) == pytest.approx(0.5, abs=0.01)
    assert later(delayed, one) == pytest.approx(-0.5, abs=0.01)


def test_a_slower_motion_is_not_moved():
    one = planned(START, GOAL, 40.0)
    assert later(one, replace(one, t=1.3 * one.t)) == 0.0


def test_long_names_keep_both_ends():
    name = "a" * 40 + "-the-end"
    assert len(short(name)) <= LONGEST
    assert short(name).endswith("the-end")
    assert short("demo") == "demo"


@pytest.mark.parametrize(("value", "text"), [(213.4, "210"), (4.07, "4.1"), (1872.0, "1900")])
def test_how_much_larger_is_said_without_powers_of_ten(value, text):
    assert rounded(value) == text


def test_a_demonstration_keeps_how_its_tool_turned():
    record = demonstration()
    from dmpcli.spatial.trajectory import Trajectory

    turned = np.tile(np.eye(3), (len(record.t), 1, 1))
    stroke = demonstrated(Trajectory(record.t, record.position(), turned), "demo")
    assert stroke.rotation.shape == (len(stroke.t), 3, 3)
