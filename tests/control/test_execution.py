"""What is judged before an arm moves, and the mock lab that a session is given."""

import numpy as np
import pytest

from dmpcli.control import execution
from dmpcli.instruments.protocols import RobotState
from dmpcli.planning.plan import PlannedStroke
from dmpcli.settings.execute import ExecuteSettings
from tests.control.streaming_fakes import PEN_DOWN, START, stroke
from tests.minimum_jerk import minimum_jerk


def straight(duration, length=100.0):
    """A straight minimum-jerk stroke along x."""
    source = stroke(duration)
    way = length * minimum_jerk(source.t / duration)
    return PlannedStroke("0", source.t, START + way[:, None] * [1.0, 0.0, 0.0], source.rotation)


def failed(source, position=START, **options):
    state = RobotState(0.0, np.array(position), PEN_DOWN, "ready")
    made, checks = execution.prepare(source, ExecuteSettings(**options), state)
    assert len(made) >= len(source.t)
    return {check.quantity: check.value for check in checks if not check.passed}


def test_a_stroke_beyond_a_limit_of_speed_acceleration_or_jerk_is_found_before_it_is_drawn():
    """A straight minimum-jerk stroke has 1.875 L/T, 5.7735 L/T² and 60 L/T³ (30 mm/s, 46 mm/s²)."""
    source = straight(6.25)
    assert failed(source) == {}
    assert failed(source, max_speed=29.0) == {"speed": pytest.approx(30.0, rel=1e-3)}
    [(quantity, value)] = failed(source, max_acceleration=14.0).items()
    assert quantity == "acceleration"
    assert value == pytest.approx(5.7735 * 100 / 6.25**2, rel=1e-2)
    assert failed(source, max_speed=31.0) == {}


def test_an_arm_that_stands_elsewhere_is_told_unless_it_is_to_come():
    away = START + [0.0, 3.0, 0.0]
    [value] = failed(straight(6.25), away).values()
    assert value == pytest.approx(3.0)
    assert failed(straight(6.25), away, start_tolerance=3.1) == {}
    assert failed(straight(6.25), away, approach=20.0) == {}


def test_the_plate_lies_under_a_stroke_that_begins_with_a_lifted_pen():
    normal = np.array([0.0, 0.6, 0.8])
    foot = np.array([300.0, 20.0, -5.0])
    position = foot + 8.0 * normal + np.linspace(0.0, 50.0, 11)[:, None] * [1.0, 0.0, 0.0]
    stroke = PlannedStroke(
        "1", np.linspace(0.0, 2.0, 11), position, None, np.tile(normal, (11, 1)), 1
    )
    lab = execution.scene(stroke, presses=True, height=8.0)
    assert lab.plate.point == pytest.approx(foot)
    assert lab.plate.normal == pytest.approx(normal)
    assert lab.position == pytest.approx(position[0])
    assert execution.scene(stroke, presses=True).plate.point == pytest.approx(position[0])
