import numpy as np
import pytest

from dmpcli.control.normal_sensing import NormalPolicy, NormalSense

PERIOD = 0.02
UP = np.array([0.0, 0.0, 1.0])
LEAN = np.radians(4.0)
TRUE = np.array([0.0, np.sin(LEAN), np.cos(LEAN)])


def slid(sense, cycles=200, speed=15.0):
    """Draw along x on a plane that leans by 4 degrees about it; the normals that are used."""
    used = []
    for i in range(cycles):
        force = 5.0 * TRUE - [1.0, 0.0, 0.0]
        sense.feel(i * PERIOD, force, np.array([speed * i * PERIOD, 0.0, 0.0]), UP)
        used.append(sense.normal(UP))
    return np.array(used)


def lean(normals):
    return np.degrees(np.arccos(np.clip(normals @ UP, -1.0, 1.0)))


def test_it_is_told_and_not_used_unless_asked_for():
    sense = NormalSense(PERIOD, NormalPolicy())
    np.testing.assert_array_equal(slid(sense), np.broadcast_to(UP, (200, 3)))
    found = sense.facts()
    assert np.degrees(found["normal_angle"]["mean"]) == pytest.approx(4.0, abs=0.3)
    assert found["friction"] == pytest.approx(0.2, abs=0.03)
    assert not found["normal_angle"]["used"]


def test_used_it_turns_no_faster_and_no_further_than_it_may():
    policy = NormalPolicy(used=True, angle=np.radians(3.0), rate=np.radians(5.0))
    used = slid(NormalSense(PERIOD, policy))
    assert lean(used)[0] == 0.0
    assert np.diff(lean(used)).max() <= 5.0 * PERIOD + 1e-6
    assert lean(used)[-1] == pytest.approx(3.0, abs=1e-6)
    free = slid(NormalSense(PERIOD, NormalPolicy(used=True)))
    np.testing.assert_allclose(free[-1], TRUE, atol=0.005)


def test_another_stroke_begins_with_nothing_but_the_friction():
    sense = NormalSense(PERIOD, NormalPolicy(used=True))
    slid(sense)
    sense.begin()
    assert sense.estimate is None
    np.testing.assert_array_equal(sense.normal(UP), UP)
    slid(sense, 40)
    assert sense.facts()["friction"] == pytest.approx(0.2, abs=0.03)


def test_a_lifted_tool_is_not_taken_to_slide_from_where_it_was():
    sense = NormalSense(PERIOD, NormalPolicy())
    slid(sense, 60)
    sense.lift()
    before = sense.estimate
    far = np.array([500.0, 300.0, 80.0])
    sense.feel(9.0, 5.0 * TRUE, far, UP)
    np.testing.assert_array_equal(sense.estimate, before)


def test_nothing_was_felt():
    assert NormalSense(PERIOD, NormalPolicy()).facts() == {}
