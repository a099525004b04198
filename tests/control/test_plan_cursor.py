from dataclasses import replace

import numpy as np
import pytest

from dmpcli.control.plan_cursor import PlanCursor
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.trajectory import StrokeTrajectory
from tests.control.streaming_fakes import START, WIDE, plan, stroke


def run(cursor, brake_at=None, cycles=3000):
    indices, phases = [cursor.index], [cursor.phase]
    for i in range(cycles):
        if i == brake_at:
            cursor.brake()
        if cursor.finished:
            break
        cursor.advance()
        indices.append(cursor.index)
        phases.append(cursor.phase)
    return np.array(indices), phases


def test_every_set_point_comes_once():
    indices, phases = run(PlanCursor(plan(), WIDE))
    assert np.array_equal(indices, np.arange(501))
    assert set(phases) == {"stroke"}


def test_phases_follow_each_other():
    made = plan(start=Pose(START + 5.0, stroke().rotation[0]))
    cursor = PlanCursor(made, WIDE)
    _, phases = run(cursor)
    assert phases == ["approach"] * made.lead + ["stroke"] * 501
    cursor.advance()
    assert cursor.phase == "stop"
    assert cursor.index == len(made) - 1


@pytest.mark.parametrize("at", [1, 50, 137, 250, 490, 499])
@pytest.mark.parametrize("duration", [10.0, 1.6])
def test_braking_ends_on_the_path_at_rest_inside_the_limits(at, duration):
    made = plan(stroke(duration=duration))
    at = min(at, len(made) - 2)
    cursor = PlanCursor(made, WIDE)
    indices, phases = run(cursor, brake_at=at)
    assert cursor.finished
    assert phases[at + 1] == "stop"
    assert np.all(np.diff(indices) >= 0)
    assert indices[-1] <= len(made) - 1
    path = np.array([made.at(i).position for i in indices] + [made.at(indices[-1]).position] * 3)
    acceleration = np.diff(path, 2, axis=0) / 0.02**2
    assert np.linalg.norm(acceleration, axis=1).max() <= WIDE.acceleration
    speeds = np.linalg.norm(np.diff(path, axis=0), axis=1) / 0.02
    assert speeds[-3:].max() == 0.0


def test_braking_a_fast_stroke_uses_most_of_the_acceleration():
    """It shall stop smoothly, not lazily: at 250 mm/s within half a second."""
    t = np.arange(301) * 0.02
    ramp = np.minimum(t, 0.3) ** 2 / 0.6 + np.maximum(t - 0.3, 0.0)
    made = plan(StrokeTrajectory(t, START + 240.0 * ramp[:, None] * np.array([1.0, 0, 0]), id="0"))
    cursor = PlanCursor(made, WIDE)
    indices, _ = run(cursor, brake_at=150)
    assert (len(indices) - 151) * 0.02 < 0.5
    assert cursor.index < len(made) - 1


def test_braking_at_rest_is_done_at_once():
    cursor = PlanCursor(plan(), WIDE)
    run(cursor)
    cursor.brake()
    assert cursor.finished


def test_it_waits_at_the_strokes_start_until_released():
    made = plan(start=Pose(START + 5.0, stroke().rotation[0]))
    cursor = PlanCursor(made, WIDE, wait=True)
    run(cursor, cycles=made.lead + 30)
    assert cursor.waiting
    assert cursor.index == made.lead
    assert cursor.phase == "approach"
    assert not cursor.finished
    cursor.release()
    cursor.advance()
    assert cursor.phase == "stroke"
    assert cursor.index == made.lead + 1


def test_braking_while_it_waits_is_done_at_once():
    cursor = PlanCursor(plan(), WIDE, wait=True)
    cursor.advance()
    cursor.brake()
    assert cursor.finished


def test_a_goal_that_moves_on_is_run_after_and_one_that_waits_is_waited_for():
    made, longer = plan(stroke(duration=2.0)), plan(stroke(duration=3.0))
    cursor = PlanCursor(made, WIDE)
    run(cursor, cycles=50)
    cursor.follow(longer)
    indices, _ = run(cursor)
    assert indices[-1] == len(longer) - 1
    # A plan whose stroke begins at its end holds there until it is released.
    short = PlanCursor(replace(made, lead=100, last=100), WIDE, wait=True)
    run(short, cycles=130)
    assert (short.index, short.waiting, short.finished) == (100.0, True, False)
    assert short.phase == "approach"
    short.release()
    assert short.finished
    assert short.phase == "stroke"
    short.advance()
    assert (short.phase, short.index) == ("stop", 100.0)


def test_brought_to_rest_twice_the_first_time_counts():
    cursor = PlanCursor(plan(), WIDE)
    run(cursor, cycles=250)
    cursor.brake()
    run(cursor, cycles=3)
    before = cursor._brake
    cursor.brake()
    assert cursor._brake == before
    # Half of the ramp's duration is what it runs over.
    begun, duration = before
    indices, _ = run(cursor)
    assert indices[-1] == pytest.approx(begun + duration / 2.0 / 0.02)
