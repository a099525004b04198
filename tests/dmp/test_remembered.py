"""What a skill remembers of itself, and how far its stroke leads away from its line."""

import pickle

import numpy as np
import pytest

from dmpcli.dmp.feasibility import sideways
from dmpcli.dmp.learning import fit
from dmpcli.dmp.options import FitOptions
from dmpcli.spatial.trajectory import Trajectory
from dmpcli.surfaces.plane import Plane
from tests import cases

PLATE = Plane(np.zeros(3), np.array([0.0, 0.0, 1.0]))


@pytest.fixture(scope="module")
def skill():
    return fit([Trajectory(cases.T6, cases.wave(cases.U6))], FitOptions(), PLATE).skill


def test_a_response_that_is_asked_for_again_is_the_same_and_not_found_anew(skill):
    t = np.linspace(0.0, skill.duration, 201)
    first = skill.response(t)
    other = skill.response(t[:150])
    assert skill.response(t.copy()) is first
    assert other.a.shape == (150, 6)
    np.testing.assert_allclose(other.forced, first.forced[:150], atol=1e-9)
    for i in range(9):
        skill.response(t[: 20 + i])
    again = skill.response(t)
    assert again is not first
    assert again.forced.tobytes() == first.forced.tobytes()


def test_what_is_remembered_cannot_be_changed_by_whoever_gets_it(skill):
    found = skill.response(np.linspace(0.0, skill.duration, 11))
    with pytest.raises(ValueError, match="read-only"):
        found.forced[0] = 1.0


def test_what_is_remembered_does_not_travel(skill):
    empty = len(
        pickle.dumps(
            fit(
                [Trajectory(cases.T6, cases.wave(cases.U6))], FitOptions(), PLATE
            ).skill.turned_over()
        )
    )
    seen = skill.turned_over()
    seen.response(np.linspace(0.0, skill.duration, 5001))
    assert len(pickle.dumps(seen)) <= empty + 100
    assert np.array_equal(pickle.loads(pickle.dumps(seen)).weights, seen.weights)


def test_a_stroke_leads_away_from_its_line_as_far_as_it_was_taught(skill):
    path = cases.wave(cases.U6)
    chord = (path[-1] - path[0]) / np.linalg.norm(path[-1] - path[0])
    off = np.linalg.norm(np.cross(path - path[0], chord), axis=1)
    assert sideways(skill) == pytest.approx(off.max(), abs=0.2)
