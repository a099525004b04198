import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dmpcli.calibration.resting import Watcher, at_rest
from dmpcli.errors import InstrumentError
from tests.calibration.calibration_fakes import PEN_DOWN, Arm, SimulatedClock, sensing


def watcher(at=lambda t: np.zeros(3), wrench=None, rotation=lambda t: PEN_DOWN):
    clock = SimulatedClock()
    felt = None if wrench is None else sensing(clock, wrench)
    return Watcher(Arm(clock, at, rotation), clock, felt), clock


def test_a_tool_that_stands_rests_after_just_the_time_asked_for():
    watch, clock = watcher()
    assert watch.rests(0.3, 5.0)
    assert clock.now() == pytest.approx(0.3, abs=0.021)


def test_a_tool_that_comes_to_rest_is_waited_for():
    watch, clock = watcher(lambda t: [20.0 * min(t, 2.0), 0, 0])
    assert watch.rests(0.3, 5.0)
    assert 2.25 < clock.now() < 2.35


def test_a_tool_that_never_rests_is_given_up():
    watch, clock = watcher(lambda t: [20.0 * t, 0, 0])
    assert not watch.rests(0.3, 1.0)
    assert clock.now() == pytest.approx(1.0, abs=0.05)


def test_a_tool_that_turns_does_not_rest():
    watch, _ = watcher(
        rotation=lambda t: Rotation.from_rotvec([0, 0.05 * t, 0]).as_matrix() @ PEN_DOWN
    )
    assert not watch.rests(0.3, 1.0)


def test_asking_ends_the_wait():
    watch, clock = watcher()
    assert not watch.rests(0.3, 5.0, lambda: clock.now() > 0.1)


def test_a_dwell_is_the_mean_of_pose_and_readings():
    rng = np.random.default_rng(0)
    noise = rng.standard_normal((1000, 6))
    shake = 0.01 * rng.standard_normal((1000, 3))
    watch, _ = watcher(
        lambda t: [1.0, 2.0, 3.0] + shake[round(50 * t)],
        lambda t: np.arange(6.0) + 0.1 * noise[round(100 * t)],
    )
    pose = watch.dwell(4.0)
    assert pose.samples == 400
    np.testing.assert_allclose(pose.wrench, np.arange(6.0), atol=0.025)
    np.testing.assert_allclose(pose.spread, 0.1, rtol=0.15)
    np.testing.assert_allclose(pose.position, [1.0, 2.0, 3.0], atol=0.005)
    np.testing.assert_allclose(pose.rotation, PEN_DOWN, atol=1e-12)
    assert at_rest(pose.moved, pose.turned)
    assert pose.unsteady < 0.05


def test_a_tool_that_moved_meanwhile_is_known_by_it():
    pose = watcher(lambda t: [2.0 * t, 0, 0])[0].dwell(1.0)
    assert pose.moved == pytest.approx(1.0, abs=0.05)
    assert not at_rest(pose.moved, pose.turned)
    assert pose.samples == 0
    assert np.isnan(pose.wrench).all()


def test_a_force_that_changes_meanwhile_is_known_by_it():
    pose = watcher(wrench=lambda t: np.array([t, 0, 0, 0, 0, 0]))[0].dwell(1.0)
    assert pose.unsteady == pytest.approx(0.5, abs=0.02)


def test_readings_from_before_the_dwell_are_left_out():
    watch, clock = watcher(wrench=lambda t: np.full(6, 50.0 if t <= 1.0 else 1.0))
    clock.sleep_until(1.0)
    np.testing.assert_allclose(watch.dwell(0.5).wrench, 1.0)


def test_a_dwell_too_short_for_the_sensor_is_named():
    watch, _ = watcher(wrench=lambda t: np.zeros(6))
    watch._sensing.hear = lambda now: []
    with pytest.raises(InstrumentError, match=r"0 readings in 0\.05 s; dwell longer"):
        watch.dwell(0.05)


def test_a_pose_that_is_not_a_number_is_an_instruments_failure():
    with pytest.raises(InstrumentError, match="not a number"):
        watcher(lambda t: [np.nan, 0, 0])[0].dwell(0.1)
