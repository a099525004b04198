import numpy as np
import pytest

from dmpcli.admittance import model
from dmpcli.control.chatter import FACTOR, ChatterDetector, damped
from tests.control.drag_fakes import drag_settings, rehearse

PERIOD = 0.02
DOWN = np.array([0.0, 0.0, -1.0])


def alarms(force, axis=DOWN):
    """Times of the alarms on a force along z, 50 samples per second."""
    detector = ChatterDetector(PERIOD)
    for i, value in enumerate(force):
        detector.feel(i * PERIOD, np.array([0.0, 0.0, value]), axis)
    return [alarm["t"] for alarm in detector.alarms]


T = np.arange(0.0, 12.0, PERIOD)


@pytest.mark.parametrize("frequency", [1.5, 2.0, 4.0])
def test_a_bouncing_tool_is_named_within_two_seconds(frequency):
    bounces = np.maximum(6.0 * np.sin(2.0 * np.pi * frequency * T), 0.0)
    assert alarms(bounces)[0] <= 2.0


@pytest.mark.parametrize("seed", range(8))
def test_tremor_touching_and_slow_tapping_are_no_chatter(seed):
    rng = np.random.default_rng(seed)
    tremor = 0.8 * np.sin(2.0 * np.pi * rng.uniform(6.0, 12.0) * T + rng.uniform(0.0, 6.0))
    noise = 0.1 * rng.standard_normal(len(T))
    press = 4.0 * (T > 3.0) - 4.0 * (T > 9.0)
    taps = 3.0 * (np.mod(T, rng.uniform(1.2, 2.0)) < 0.3)
    for force in (tremor, press + tremor, taps + noise):
        assert alarms(force + noise) == []


def test_a_force_across_the_tool_is_none_along_it():
    assert alarms(6.0 * np.sin(2.0 * np.pi * 2.0 * T), np.array([1.0, 0.0, 0.0])) == []


def test_only_the_axes_along_the_tool_are_damped_and_the_law_stays_stable():
    law = drag_settings().law
    made = damped(law, DOWN)
    np.testing.assert_allclose(made.damping / law.damping, [1, 1, FACTOR, 1, 1, 1])
    np.testing.assert_allclose(made.mass / law.mass, [1, 1, FACTOR, 1, 1, 1])
    model.check_stable(made)
    leaning = damped(law, np.array([0.6, 0.0, -0.8]))
    np.testing.assert_allclose(leaning.damping[:3] / law.damping[:3], [FACTOR, 1.0, FACTOR])


@pytest.mark.slow
@pytest.mark.parametrize("stiffness", [5, 20])
def test_a_calm_recording_raises_no_alarm(stiffness):
    url = f"mock:?stiffness={stiffness}"
    _, recorder, _ = rehearse(url, url)
    assert recorder.chatter.alarms == []


@pytest.mark.slow
def test_on_a_stiff_plate_behind_a_lagging_servo_the_chatter_is_ended():
    url = "mock:?stiffness=50&lag=0.05"
    _, recorder, outcome = rehearse(url, url)
    assert outcome.failure is None
    assert 1 <= len(recorder.chatter.alarms) <= 3
    columns = recorder.log.columns()
    last = columns["t"] > columns["t"][-1] - 2.5
    first = (columns["t"] > recorder.chatter.alarms[0]["t"] - 1.0) & ~last
    assert np.ptp(columns["fz"][last]) < 0.5 * np.ptp(columns["fz"][first])


def test_a_tool_that_leans_by_just_60_degrees_from_an_axis_takes_part_in_it():
    law = drag_settings().law
    for along, parts in (
        (0.5, [FACTOR, 1.0, FACTOR]),
        (np.nextafter(0.5, 0.0), [1.0, 1.0, FACTOR]),
    ):
        made = damped(law, np.array([-along, 0.0, 0.9]))
        np.testing.assert_allclose(made.damping[:3] / law.damping[:3], parts)
        np.testing.assert_array_equal(made.stiffness, law.stiffness)
        assert made.period == law.period


def test_an_alarm_says_when_how_hard_and_what_it_has_made_of_the_preset():
    detector = ChatterDetector(PERIOD)
    detector.alarms = [
        {"t": 1.25, "swing": 3.0, "factor": 1.6},
        {"t": 2.84, "swing": 4.26, "factor": 1.6**2},
    ]
    assert detector.said().startswith(
        "at 2.8 s the tool chatters on the work, by 4.3 N: its damping and inertia are 2.6 times "
        "the preset's now"
    )
    assert not detector.spent
    detector.alarms *= 3
    assert detector.spent


def test_each_alarm_makes_it_sixteen_tenths_as_heavy_again_and_is_dated_to_the_microsecond():
    detector, begun = ChatterDetector(PERIOD), 3e-6
    due = []
    for i, value in enumerate(6.0 * np.sin(2.0 * np.pi * 2.0 * T)):
        if detector.feel(begun + i * PERIOD, np.array([0.0, 0.0, value]), DOWN):
            due.append(begun + i * PERIOD)
    found = [(alarm["t"], alarm["factor"]) for alarm in detector.alarms[:3]]
    np.testing.assert_allclose([t for t, _ in found], due[:3], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose([factor for _, factor in found], [1.6, 2.56, 4.096])
    assert detector.alarms[0]["factor"] == FACTOR
