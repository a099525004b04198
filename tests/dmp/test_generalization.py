"""Strokes of several durations drawn together, what presses in them, and numbers beyond bounds."""

from dataclasses import replace

import numpy as np
import pytest

from dmpcli.dmp.contact_heights import contact_heights
from dmpcli.dmp.drawn_strokes import GeneralizeOptions
from dmpcli.dmp.generalization import draw
from dmpcli.dmp.learning import fit
from dmpcli.dmp.options import FitOptions
from dmpcli.dmp.rollout import Pairs
from dmpcli.errors import InputError
from dmpcli.spatial.trajectory import Trajectory
from dmpcli.surfaces.plane import Plane
from tests import cases
from tests.dmp.strokes import paper_stroke

PLATE = Plane(np.zeros(3), np.array([0.0, 0.0, 1.0]))
START = np.array([[0.0, 0, 0], [0.0, 50, 0], [9.0, -40, 0]])
PAIRS = Pairs(START, START + [[100.0, 0, 0], [60.0, 60, 0], [0.0, 120, 0]])


@pytest.fixture(scope="module")
def lifted():
    """A skill of a wave on the plate that is lifted by 8 mm between 2.4 and 4 s."""
    x = cases.wave(cases.U6)
    x[:, 2] = 8.0 * (cases.jerk((cases.T6 - 2.4) / 0.4) - cases.jerk((cases.T6 - 3.6) / 0.4))
    R = np.tile(np.diag([1.0, -1.0, -1.0]), (len(x), 1, 1))
    return fit([Trajectory(cases.T6, x, R)], FitOptions(), PLATE).skill


@pytest.mark.parametrize("heights", [True, False])
def test_where_the_tool_is_lifted_it_does_not_press_and_elsewhere_as_it_was_asked_to(
    lifted, heights
):
    known = contact_heights(lifted, None) if heights else None
    style = GeneralizeOptions(force=5.0, heights=known)
    drawn = draw(lifted, PAIRS, np.full(3, 6.0), PLATE, style)
    for stroke in drawn:
        t = stroke.timing.t
        assert set(stroke.force[(t > 2.75) & (t < 3.65)]) == {0.0}
        assert set(stroke.force[(t < 2.4) | (t > 4.0)]) == {5.0}
        high = np.abs(stroke.position[:, 2]) > (1e-6 if heights else 1.0)
        np.testing.assert_array_equal(stroke.force == 0.0, high)


def test_strokes_of_several_durations_come_in_the_order_of_their_pairs(lifted):
    duration = np.array([6.0, 3.0, 6.0])
    together = draw(lifted, PAIRS, duration, PLATE, GeneralizeOptions(rate=20.0))
    for i, stroke in enumerate(together):
        row = slice(i, i + 1)
        [alone] = draw(lifted, PAIRS[row], duration[row], PLATE, GeneralizeOptions(rate=20.0))
        np.testing.assert_array_equal(stroke.position, alone.position)
        np.testing.assert_array_equal(stroke.timing.t, alone.timing.t)
        assert stroke.timing.t[-1] == duration[i]
        np.testing.assert_allclose(
            stroke.position[[0, -1]], [PAIRS.start[i], PAIRS.goal[i]], atol=1e-6
        )


@pytest.mark.parametrize("surface", [PLATE, None])
def test_numbers_beyond_all_bounds_are_refused_without_a_warning(surface):
    """Too large a force for so long a way: what becomes of it is infinite, or no number."""
    skill = fit([paper_stroke()], FitOptions(basis=20)).skill
    far = Pairs(START, START + 1e150 * np.array([1.0, 0.2, 0.0]))
    for sign in (1.0, -1.0):
        huge = replace(skill, weights=np.full_like(skill.weights, sign * 1e200))
        with pytest.raises(InputError, match="no finite stroke"):
            draw(huge, far, np.full(3, 10.0), surface, GeneralizeOptions(rate=10.0))
