"""Heights over a surface: contact, lift, offset, and what would dig in."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dmpcli.dmp import contact_heights as heights
from dmpcli.dmp.contact_heights import ContactHeights, contact_heights, end_heights, pressed
from dmpcli.dmp.learning import fit
from dmpcli.dmp.options import FitOptions
from dmpcli.spatial.trajectory import Trajectory
from dmpcli.surfaces.plane import Plane
from tests import cases

PLATE = Plane(np.zeros(3), np.array([0.0, 0.0, 1.0]))


def taught(height):
    """Skill of the wave at heights over the plate, a number or one for each sample."""
    position = cases.wave(cases.U6)
    position[:, 2] = height
    return fit([Trajectory(cases.T6, position)], FitOptions(), PLATE).skill


def bump(height, begin=2.4, end=3.6):
    """Height (601,) that is reached within 0.4 s and left again."""
    up, down = cases.jerk((cases.T6 - begin) / 0.4), cases.jerk((cases.T6 - end) / 0.4)
    return height * (up - down)


@pytest.mark.parametrize("height", [-0.6, -0.02, 0.0, 0.3, 0.9])
def test_what_is_near_everywhere_is_drawn_in_contact(height):
    found = contact_heights(taught(height), None)
    assert found.removed == pytest.approx(height, abs=1e-6)
    assert found.touching == pytest.approx(1.0)
    assert not found.deep
    assert found.lift == 0.0
    assert np.all(found.drawn(np.full(5, height)) == 0.0)


@pytest.mark.parametrize("height", [-0.9, 0.6, 0.95, 2.0, 6.0])
def test_an_arch_is_nowhere_at_an_offset(height):
    """Heights of all sizes, of which none is constant: their median was taken for one."""
    arch = height * np.sin(np.pi * np.linspace(0.0, 1.0, 601))
    assert contact_heights(taught(arch), None).removed == 0.0


@pytest.mark.parametrize("tilt", [0.05, 0.15])
def test_an_offset_that_leans_a_little_is_one(tilt):
    leaning = 0.8 + tilt * np.linspace(-1.0, 1.0, 601)
    found = contact_heights(taught(leaning), None)
    assert found.removed == pytest.approx(0.8, abs=0.02)
    assert found.touching == pytest.approx(1.0)


def test_a_lifted_part_keeps_its_height_above_the_offset_of_the_rest():
    found = contact_heights(taught(0.4 + bump(8.0)), None)
    assert found.removed == pytest.approx(0.4, abs=0.02)
    assert found.lift == pytest.approx(8.0, abs=0.1)
    assert 0.5 < found.touching < 0.7
    assert not found.deep


def test_a_dip_is_refused_by_its_depth_unless_contact_allows_it():
    skill = taught(-bump(3.0))
    found = contact_heights(skill, None)
    assert found.deep
    assert found.depth == pytest.approx(3.0, abs=0.05)
    assert not contact_heights(skill, 3.5).deep
    assert not contact_heights(skill, None, offset=3.1).deep


def test_an_offset_on_purpose_is_no_depth():
    found = contact_heights(taught(0.0), None, offset=-2.0)
    assert not found.deep
    assert found.depth == 0.0
    np.testing.assert_allclose(found.drawn(np.zeros(3)), -2.0)


def test_contact_of_zero_draws_every_height_as_it_is():
    w = np.linspace(-2.0, 9.0, 50)
    found = contact_heights(taught(0.3), 0.0)
    np.testing.assert_array_equal(found.drawn(w), w)
    assert not found.deep


def test_a_noisy_recording_touches_within_five_deviations():
    skill = taught(0.0)
    assert contact_heights(skill, None).band == 1.0
    noisy = replace(skill, reached=replace(skill.reached, noise=0.4))
    assert contact_heights(noisy, None).band == pytest.approx(2.0)
    assert contact_heights(noisy, 0.5).band == 0.5


def test_a_stroke_that_ends_lifted_ends_lifted():
    skill = taught(8.0 * cases.jerk((cases.T6 - 5.0) / 0.8))
    first, last = end_heights(skill, contact_heights(skill, None))
    assert first == 0.0
    assert last == pytest.approx(8.0, abs=0.01)


@settings(max_examples=60)
@given(band=st.floats(0.1, 5.0), w=st.floats(-20.0, 20.0))
def test_the_blend_is_contact_within_the_band_and_the_height_from_twice_it(band, w):
    found = ContactHeights(band, 0.0, 0.0, 0.0, 1.0, 0.0)
    drawn = float(found.drawn(np.array([w]))[0])
    if abs(w) <= band:
        assert drawn == 0.0
    elif abs(w) >= 2 * band:
        assert drawn == pytest.approx(w)
    else:
        assert 0.0 <= drawn / w <= 1.0
    near = found.drawn(np.array([w, w + 1e-6]))
    # Without a jump: nowhere steeper than a few times the height itself.
    assert abs(near[1] - near[0]) <= 5e-6


def test_the_tool_presses_in_contact_and_not_where_it_is_lifted():
    found = contact_heights(taught(0.4 + bump(8.0)), None, offset=-0.5)
    w = found.drawn(np.array([0.4, 0.9, 8.4]))
    np.testing.assert_array_equal(pressed(w, 3.0, found), [3.0, 3.0, 0.0])
    np.testing.assert_array_equal(pressed(np.array([0.4, -0.9, 8.4]), 3.0, None), [3.0, 3.0, 0.0])
    assert pressed(w, None, found) is None


def test_a_pen_just_as_high_as_the_band_touches(monkeypatch):
    """Its height is that of the part in contact, and is taken off."""
    skill, x = taught(0.0), np.zeros((2001, 6))
    x[:, 0], x[:, 2] = np.linspace(0.0, 100.0, 2001), 0.5
    monkeypatch.setattr(heights, "demonstrated_scale", lambda *_: x)
    found = contact_heights(skill, 0.5)
    assert (found.removed, found.touching) == (0.5, pytest.approx(1.0))
    assert contact_heights(skill, 0.499).removed == 0.0
