"""The mock lab that a session is given where its URL says nothing."""

import numpy as np
import pytest

from dmpcli.control import execution
from dmpcli.planning.plan import PlannedStroke


def test_the_plate_lies_under_a_stroke_that_begins_with_a_lifted_pen():
    normal = np.array([0.0, 0.6, 0.8])
    foot = np.array([300.0, 20.0, -5.0])
    position = foot + 8.0 * normal + np.linspace(0.0, 50.0, 11)[:, None] * [1.0, 0.0, 0.0]
    stroke = PlannedStroke(
        "1", np.linspace(0.0, 2.0, 11), position, None, np.tile(normal, (11, 1)), 1
    )
    lab = execution.scene(stroke, presses=True, height=8.0)
    assert lab.plate.point == pytest.approx(foot)
    assert lab.position == pytest.approx(position[0])
    assert execution.scene(stroke, presses=True).plate.point == pytest.approx(position[0])
