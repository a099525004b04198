"""The plane that a stroke was taught on, by each rule, for the strokes that tempt it to tilt."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from dmpcli.dmp.stroke_plane import stroke_planes
from tests import cases

UP = np.array([0.0, 0.0, 1.0])
FLAT = cases.wave(cases.U6)
ROUND = np.column_stack([40 * np.cos(7 * cases.U6), 30 * np.sin(7 * cases.U6), 0 * cases.U6])


def angle(a, b):
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))


def tilted(degrees, axis="x"):
    return cases.about(axis, degrees) @ UP


def found(position, tool=None, noise=0.0, closed=False, normal=None):
    return stroke_planes([position], [tool], noise, closed, normal)


def lifted(share, height=8.0):
    """Wave with the given middle share of its samples lifted off the plane."""
    at = np.linspace(0.0, 1.0, len(FLAT))
    up = cases.jerk((at - 0.5 + share / 2) / 0.06) - cases.jerk(
        (at - 0.5 - share / 2 + 0.06) / 0.06
    )
    return FLAT + np.outer(height * up, UP)


@pytest.mark.parametrize("tool", [None, UP, tilted(30.0), tilted(-30.0), tilted(44.0, "y")])
@pytest.mark.parametrize("share", [0.07, 0.15, 0.2])
def test_a_pen_lift_and_a_tool_held_aslant_tilt_nothing(tool, share):
    plane = found(lifted(share), tool)
    assert plane.rule == "fitted"
    assert angle(plane.normals[0], UP) < 0.01
    if tool is not None:
        assert plane.lean == pytest.approx(angle(tool, UP), abs=0.01)
        assert not plane.guessed


def test_the_tool_gives_the_side():
    for side in (UP, -UP, tilted(160.0)):
        assert found(FLAT, side).normals[0] @ side > 0.0


def test_a_one_sided_lift_gives_the_side_without_a_tool():
    assert not found(lifted(0.2)).guessed
    assert found(lifted(0.2)).normals[0] @ UP > 0.99
    turned = lifted(0.2) * [1.0, 1.0, -1.0]
    assert found(turned).normals[0] @ UP < -0.99
    assert found(FLAT).guessed


@pytest.mark.parametrize("degrees", [50.0, 90.0, 130.0])
def test_a_tool_far_from_the_fitted_normal_decides_itself(degrees):
    tool = tilted(degrees)
    plane = found(FLAT, tool)
    if degrees == 130.0:  # 50° from the other side
        assert plane.lean == pytest.approx(50.0, abs=0.1)
    assert plane.rule == "tool"
    assert plane.normals[0] @ tool > 0.0
    assert abs(plane.normals[0][0]) < 1e-9  # across the start-goal line


def test_a_path_that_lies_in_no_plane_leaves_it_to_the_tool():
    bent = FLAT + np.outer(0.002 * FLAT[:, 1] ** 2 + 0.01 * (FLAT[:, 0] - 150) ** 2 / 10, UP)
    plane = found(bent, tilted(10.0))
    assert plane.rule == "tool"
    assert plane.inside < 0.5
    assert angle(plane.normals[0], tilted(10.0)) < 0.01


@pytest.mark.parametrize(("tool", "rule"), [(None, "base"), (tilted(20.0), "tool")])
def test_a_nearly_straight_stroke_tells_no_plane(tool, rule):
    line = FLAT * [1.0, 0.05, 1.0]  # 2.5 mm across 300
    plane = found(line, tool)
    assert plane.rule == rule
    assert angle(plane.normals[0], UP if tool is None else tool) < 0.01
    assert plane.guessed == (tool is None)


def test_a_named_normal_is_taken_across_the_line():
    plane = found(FLAT, UP, normal=np.array([0.3, -2.0, 0.1]))
    assert plane.rule == "given"
    assert plane.normals[0] @ [1.0, 0.0, 0.0] == pytest.approx(0.0, abs=1e-12)
    assert plane.normals[0][1] < -0.99


def test_demonstrations_of_leaning_walls_are_pooled_and_square_ones_are_not():
    lean = [cases.wall(a)[:, 1:4] for a in (-3.0, 3.0, 2.0)]
    pooled = stroke_planes(lean, [None] * 3, 0.0, False)
    assert pooled.pooled
    assert pooled.apart < 6.1
    assert len({tuple(np.round(n, 12)) for n in pooled.normals}) == 1
    apart = stroke_planes([FLAT, FLAT @ cases.about("x", 40.0).T], [UP, UP], 0.0, False)
    assert not apart.pooled
    assert apart.apart > 15.0


def test_noise_widens_the_plane():
    noisy = FLAT + np.random.default_rng(0).normal(0.0, 0.4, FLAT.shape)
    assert found(noisy, UP, noise=0.4).inside > 0.95
    assert found(noisy, UP, noise=0.0).inside < 0.7


@pytest.mark.parametrize("tool", [None, tilted(25.0)])
def test_a_closed_stroke_has_its_plane_through_lifts(tool):
    up = 6.0 * (cases.jerk((cases.U6 - 0.5) / 0.1) - cases.jerk((cases.U6 - 0.6) / 0.1))
    plane = found(ROUND + np.outer(up, UP), tool, closed=True)
    assert plane.rule == "fitted"
    assert angle(plane.normals[0], UP) < 0.1


@settings(max_examples=30)
@given(
    turn=st.tuples(*[st.floats(-3.0, 3.0)] * 3), share=st.floats(0.07, 0.2), closed=st.booleans()
)
def test_the_plane_turns_with_stroke_and_tool(turn, share, closed):
    R = Rotation.from_rotvec(turn).as_matrix()
    position = ROUND if closed else lifted(share)
    here = found(position, tilted(20.0), closed=closed)
    there = found(position @ R.T + [5.0, 6.0, 7.0], R @ tilted(20.0), closed=closed)
    assert there.rule == here.rule
    np.testing.assert_allclose(there.normals[0], R @ here.normals[0], atol=1e-6)


@pytest.mark.slow
@settings(max_examples=15)
@given(order=st.permutations(range(4)))
def test_the_order_of_demonstrations_gives_the_same_normals(order):
    strokes = [cases.wall(a)[:, 1:4] for a in (-3.0, -1.0, 2.0, 3.0)]
    plain = stroke_planes(strokes, [None] * 4, 0.0, False).normals
    mixed = stroke_planes([strokes[i] for i in order], [None] * 4, 0.0, False).normals
    np.testing.assert_allclose(mixed, plain[list(order)], atol=1e-12)


@pytest.mark.parametrize("tool", [None, tilted(20.0), tilted(-40.0, "y")])
@pytest.mark.parametrize("height", [8.0, 11.0, 40.0])
def test_a_lift_where_the_stroke_swings_out_farthest_tilts_nothing(tool, height):
    """A fifth of the length is lifted, at the only large bulge: least absolute offsets lean."""
    u = cases.U6
    up = np.where((u > 0.4) & (u < 0.62), np.sin(np.pi * (u - 0.4) / 0.22) ** 2, 0.0)
    wide = np.sin(3.0 * np.pi * u) * np.sin(np.pi * u) ** 2
    flat = np.column_stack([240.0 * u, 26.0 * wide, 0.0 * u])
    plane = found(flat + height * np.outer(up, UP), tool)
    assert plane.rule == "fitted"
    assert angle(plane.normals[0], UP) < 0.1
    assert not plane.guessed
    assert plane.inside > 0.5


@pytest.mark.parametrize("tool", [None, UP])
@pytest.mark.parametrize("heading", [170.0, 180.0, 90.0, -120.0])
def test_strokes_of_one_plate_share_its_plane_whichever_way_they_run(tool, heading):
    tilt = cases.about("x", 25.0)
    strokes = [FLAT @ tilt.T, FLAT @ (tilt @ cases.about("z", heading)).T + [40.0, 9.0, 3.0]]
    axis = None if tool is None else tilt @ tool
    planes = stroke_planes(strokes, [axis] * 2, 0.0, False)
    assert planes.pooled
    assert planes.apart < 1e-4
    for normal in planes.normals:
        assert angle(normal, tilt @ UP) < 1e-5


@pytest.mark.parametrize("off", [[0.0, 0, 0], [500.0, 0, 0], [0.0, 300, -200]])
def test_a_way_there_and_back_tells_no_plane_wherever_it_lies(off):
    back = np.r_[FLAT, FLAT[::-1]] * [1.0, 0.02, 1.0] + off
    plane = found(back @ cases.about("z", 90.0).T, closed=True)
    assert plane.rule == "base"
    assert plane.guessed
    assert angle(plane.normals[0], UP) < 0.01


@pytest.mark.parametrize("off", [[0.0, 0, 0], [800.0, -500, 300]])
def test_the_plane_of_a_closed_stroke_does_not_depend_on_where_it_lies(off):
    plane = found(ROUND @ cases.about("x", 25.0).T + off, closed=True)
    assert angle(plane.normals[0], tilted(25.0)) < 0.01
    assert plane.inside == 1.0
