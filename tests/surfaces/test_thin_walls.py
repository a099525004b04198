"""Goals measured behind a thin wall: on which side of it they are is a matter of its thickness."""

import numpy as np
import pytest
import trimesh

from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.thin_walls import mistaken


def wall(thickness):
    made = trimesh.creation.box((60.0, 40.0, thickness))
    made = made.subdivide().subdivide()
    return Mesh(np.array(made.vertices), np.array(made.faces))


@pytest.mark.parametrize(
    ("thickness", "off", "wrong"),
    [
        (0.8, 0.0, True),  # thinner than a millimetre is thin
        (1.0, 0.0, True),  # and so is one of just a millimetre
        (1.2, 0.0, False),
        (1.2, 0.4, True),  # as is what is thinner than four times the distance
        (1.2, 0.2, False),
        (5.0, 2.0, True),
        (5.0, 1.0, False),
    ],
)
def test_a_goal_is_mistaken_where_the_wall_is_thin_for_how_far_off_it_was_asked(
    thickness, off, wrong
):
    half = thickness / 2
    origin = np.array([[-20.0, 3.0, half]] * 3)
    # Behind the wall, in front of it, and so near behind its rim that the line over it is short.
    goal = np.array([[10.0, 4.0, -half], [10.0, 4.0, half], [10.0, 4.0, -half]])
    lengths = np.array([80.0, 30.0, 29.0])
    found = mistaken(wall(thickness), origin, goal, np.full(3, off), lengths)
    assert found.tolist() == [wrong, False, False]


def test_of_many_goals_the_right_ones_are_mistaken():
    origin = np.tile([-20.0, 3.0, 0.4], (5, 1))
    goal = np.array([[x, 2.0, 0.4 if x in (-10, 5) else -0.4] for x in (-15, -10, 0, 5, 20)])
    there = np.linalg.norm(goal - origin, axis=1)
    lengths = np.where(goal[:, 2] > 0.0, there, 70.0)
    found = mistaken(wall(0.8), origin, goal, np.zeros(5), lengths)
    assert found.tolist() == [True, False, True, False, True]
