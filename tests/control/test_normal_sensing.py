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


def leaning(sense, cycles, speed=15.0, planned=UP):
    for i in range(cycles):
        sense.feel(
            i * PERIOD, 5.0 * TRUE - [1.0, 0.0, 0.0], np.array([speed * i * PERIOD, 0, 0]), planned
        )


@pytest.mark.parametrize(("cycles", "known"), [(29, False), (30, True)])
def test_an_estimate_is_believed_after_25_cycles_that_have_told_something(cycles, known):
    """The first five only begin the window over which the tool's velocity is taken."""
    sense = NormalSense(PERIOD, NormalPolicy())
    leaning(sense, cycles)
    assert (sense.estimate is not None) is known
    assert bool(sense.facts()) is known


def test_what_is_told_of_its_lean_is_the_mean_and_the_95th_percentile_of_the_cycles():
    sense, angles = NormalSense(PERIOD, NormalPolicy(used=True)), []
    for i in range(120):
        lean = 0.002 * i
        true = np.array([0.0, np.sin(lean), np.cos(lean)])
        sense.feel(i * PERIOD, 5.0 * true - [1.0, 0, 0], np.array([15.0 * i * PERIOD, 0, 0]), UP)
        if sense.estimate is not None:
            angles.append(np.arccos(sense.estimate @ UP))
    found = sense.facts()["normal_angle"]
    assert found["mean"] == pytest.approx(np.mean(angles), abs=1e-6)
    assert found["p95"] == pytest.approx(np.percentile(angles, 95.0), abs=1e-6)
    assert found["used"]


def test_the_velocity_is_that_over_five_periods():
    """A tool that goes 2.1 mm/s on the whole tells, and 1.9 do not; however it shakes meanwhile."""
    for speed, tells in ((2.1, True), (1.9, False)):
        sense = NormalSense(PERIOD, NormalPolicy())
        for i in range(40):
            shake = 0.3 * (i % 5)
            sense.feel(i * PERIOD, 5.0 * TRUE, np.array([speed * i * PERIOD + shake, 0, 0]), UP)
        assert (sense.estimate is not None) is tells


def test_a_clock_that_stands_tells_nothing():
    sense = NormalSense(PERIOD, NormalPolicy())
    for i in range(60):
        sense.feel(3.0, 5.0 * TRUE, np.array([15.0 * i * PERIOD, 0.0, 0.0]), UP)
    assert sense.estimate is None


def test_a_used_normal_goes_round_a_curve_with_the_planned_one_and_keeps_its_lean():
    sense = NormalSense(PERIOD, NormalPolicy(used=True, angle=0.03, rate=10.0))
    for i in range(80):
        turn = 0.005 * i
        R = np.array([[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]])
        place = np.array([3000.0 * np.sin(turn), 0.0, 3000.0 * np.cos(turn)])
        sense.feel(i * PERIOD, R @ (5.0 * TRUE - [1.0, 0.0, 0.0]), place, R @ UP)
        used = sense.normal(R @ UP)
        if sense.estimate is not None:
            assert np.arccos(used @ (R @ UP)) == pytest.approx(0.03, abs=1e-6)
    policy = NormalPolicy()
    assert (policy.used, policy.angle, policy.rate) == (False, 0.175, 0.175)


def test_the_friction_that_was_found_is_what_the_next_stroke_begins_with():
    sense = NormalSense(PERIOD, NormalPolicy())
    for i in range(300):
        force = 5.0 * np.array([0.0, 0.0, 1.0]) - [2.5 if i % 60 < 30 else -2.5, 0.0, 0.0]
        x = 15.0 * PERIOD * (i % 60 if i % 60 < 30 else 60 - i % 60)
        sense.feel(i * PERIOD, tuple(force), (x, 0.0, 0.0), (0.0, 0.0, 1.0))
    found = sense._estimator.friction
    assert found > 0.3
    sense.begin()
    assert sense._estimator.friction == found
    assert sense._estimator.heard == 0
