from dataclasses import replace

import numpy as np
import pytest

from dmpcli.control.force_sensing import Sensing
from dmpcli.errors import InstrumentError, RefusedError
from dmpcli.instruments.clock import SimulatedClock
from dmpcli.instruments.protocols import Sample, SensorInfo
from dmpcli.simulation.mock import PEN, PEN_DOWN
from dmpcli.spatial import wrench
from tests.control.fake_sensors import BatchSensor

INFO = SensorInfo("fake", 100.0, np.array([100.0, 100.0, 100.0, 10.0, 10.0, 10.0]))
UNKNOWN = replace(PEN, weight=0.0, zero=None)
LEVEL = np.eye(3)


def sample(t, force=0.0, healthy=True, torque=0.0, seq=7):
    return Sample(t, seq, np.array([force, 0.0, 0.0, 0.0, torque, 0.0]), healthy, 0)


def sensing(*batches, rate=100.0, period=0.02):
    return Sensing(BatchSensor(*batches), INFO, rate, period, SimulatedClock())


UNBELIEVABLE = [
    (sample(0.0, healthy=False), "sample 7 is saturated"),
    (sample(0.0, np.nan), "sample 7 is not a number"),
    (sample(0.0, np.inf), "sample 7 is not a number"),
    (Sample(0.0, 7, [0.0] * 6, healthy=True, lost=0), "sample 7 is no array of six"),
    (Sample(0.0, 7, np.zeros(3), healthy=True, lost=0), "sample 7 is no array of six"),
    (sample(0.0, -80.5), "Fx = -80.5 is over 80% of its range"),
    (sample(0.0, torque=8.1), "Ty = 8.1 is over 80% of its range"),
]


@pytest.mark.parametrize(("bad", "words"), UNBELIEVABLE)
def test_what_must_not_be_believed_is_a_failure_in_motion(bad, words):
    with pytest.raises(InstrumentError, match=words):
        sensing([sample(0.0), bad, sample(0.0)]).hear(0.0)


@pytest.mark.parametrize(("bad", "words"), UNBELIEVABLE)
@pytest.mark.parametrize("tool", [UNKNOWN, PEN], ids=["no zero", "zero known"])
def test_no_zero_is_taken_from_it_and_no_motion_begins(bad, words, tool):
    with pytest.raises(InstrumentError, match=words):
        sensing([sample(0.0), bad, sample(0.0)]).zeroed(tool, LEVEL, 0.5)


def test_80_percent_of_the_range_is_allowed():
    assert len(sensing([sample(0.0, 80.0), sample(0.01, -80.0)]).hear(0.01)) == 2


def test_the_zero_is_the_mean_of_the_wait():
    felt = sensing([sample(0.1, 2.0), sample(0.2, 4.0)])
    np.testing.assert_allclose(felt.zeroed(UNKNOWN, LEVEL, 0.5).zero, [3.0, 0, 0, 0, 0, 0])
    assert felt.newest.t == 0.2


def test_a_known_zero_is_kept():
    assert sensing([sample(0.1, 2.0)]).zeroed(PEN, LEVEL, 0.5) is PEN


def at_rest(tool, external):
    """The sensor's reading of a tool that points straight down, with a wrench at its tip."""
    load = wrench.gravity(tool.weight, tool.inclination)
    own = wrench.of_weight(PEN_DOWN, load, tool.centre)
    reading = wrench.to_sensor(np.array(external), PEN_DOWN, tool.lever) + own + tool.zero
    return [Sample(0.05, 1, reading, healthy=True, lost=0)]


@pytest.mark.parametrize(
    "external",
    [np.zeros(6), [1.4, 0, 0, 0, 0, 0], [0, 0, 1.4, 0, 0, 0], [0, 0, -1.4, 0, 0, 0.1]],
)
def test_a_tool_that_explains_the_reading_within_the_tolerance_may_go_on(external):
    scaled = np.array(external) * np.array([0.7, 0.7, 1, 1, 1, 1])  # sideways it has a lever
    assert sensing(at_rest(PEN, scaled)).zeroed(PEN, PEN_DOWN, 0.5, 1.5) is PEN


@pytest.mark.parametrize(
    ("external", "words"),
    [
        (
            [0, 0, 1.6, 0, 0, 0],
            r"1\.60 N and 0\.000 N·m of the reading at rest, over 1\.5 N and 0\.15 N·m",
        ),
        ([1.6, 0, 0, 0, 0, 0], r"1\.60 N and 0\.216 N·m"),
        ([0, 0, 0, 0, 0, 0.16], r"0\.00 N and 0\.160 N·m"),
    ],
)
def test_a_reading_that_the_tool_does_not_explain_is_refused(external, words):
    felt = sensing(at_rest(PEN, external))
    with pytest.raises(RefusedError, match=words) as refused:
        felt.zeroed(PEN, PEN_DOWN, 0.5, 1.5)
    assert "dmpcli calibrate" in str(refused.value)
    assert "--tool-check" in str(refused.value)


@pytest.mark.parametrize(
    "other",
    [
        replace(PEN, weight=8.0),
        replace(PEN, weight=4.0),
        replace(PEN, centre=np.array([40.0, -2.0, 45.0])),
        replace(PEN, zero=PEN.zero + np.array([0, 2.0, 0, 0, 0, 0])),
    ],
    ids=["heavier", "lighter", "off centre", "another zero"],
)
def test_the_calibration_of_another_tool_is_refused(other):
    felt = sensing(at_rest(PEN, np.zeros(6)))
    with pytest.raises(RefusedError, match="calibrated for another tool"):
        felt.zeroed(other, PEN_DOWN, 0.5, 1.5)


def test_what_presses_on_purpose_is_let_pass_with_a_wider_tolerance():
    felt = sensing(at_rest(PEN, [0, 0, 5.0, 0, 0, 0]))
    assert felt.zeroed(PEN, PEN_DOWN, 0.5, 6.0) is PEN


def test_the_calibration_of_another_sensor_is_refused_before_it_is_listened_to():
    other = replace(PEN, sensor="ATI Mini45 FT12345")
    with pytest.raises(RefusedError, match="with the sensor ATI Mini45 FT12345, and fake is conn"):
        sensing().zeroed(other, PEN_DOWN, 0.5, 1.5)
    same = replace(PEN, sensor="fake")
    assert sensing(at_rest(PEN, np.zeros(6))).zeroed(same, PEN_DOWN, 0.5, 1.5) is same


def test_a_zero_taken_now_needs_no_check():
    felt = sensing([sample(0.1, 9.0)])
    assert felt.zeroed(UNKNOWN, LEVEL, 0.5, 1.5).zero[0] == pytest.approx(9.0)


def test_a_sensor_that_never_speaks_is_named():
    with pytest.raises(InstrumentError, match=r"sends nothing within 0\.5 s"):
        sensing().zeroed(UNKNOWN, LEVEL, 0.5)


def test_silence_for_a_tenth_of_a_second_is_a_failure():
    felt = sensing([sample(1.0)])
    felt.hear(1.0)
    assert felt.hear(1.09) == []
    with pytest.raises(InstrumentError, match=r"silent for 0\.12 s"):
        felt.hear(1.12)


@pytest.mark.parametrize(("rate", "period", "age"), [(100.0, 0.02, 0.04), (100.0, 0.002, 0.02)])
def test_a_sample_is_fresh_for_two_periods_of_the_slower_side(rate, period, age):
    felt = sensing([sample(0.0)], rate=rate, period=period)
    felt.hear(0.0)
    assert felt.fresh(age)
    assert not felt.fresh(age + 1e-6)


def test_only_young_samples_are_recent_but_all_are_checked():
    heard = sensing([sample(0.01 * k, float(k)) for k in range(11)])
    assert [s.wrench[0] for s in heard.recent(0.1)] == [6.0, 7.0, 8.0, 9.0, 10.0]
    assert [s.wrench[0] for s in heard.recent(0.14)] == [10.0]
    assert heard.recent(0.15) == []
    with pytest.raises(InstrumentError, match="not a number"):
        sensing([sample(0.0, np.nan), sample(5.0)]).recent(5.0)


@pytest.mark.parametrize(
    ("force", "torque", "fits"),
    [
        (2.0, 0.0, True),
        (2.0 + 2.0**-20, 0.0, False),
        (0.0, 0.2, True),
        (0.0, 0.2 + 2.0**-20, False),
    ],
)
def test_a_reading_at_the_tolerance_itself_is_explained(force, torque, fits):
    tool = replace(PEN, weight=0.0, centre=np.zeros(3), zero=np.zeros(6))
    felt = sensing([Sample(0.0, 1, np.array([0.0, 0.0, force, 0.0, torque, 0.0]), True, 0)])
    if fits:
        assert felt.zeroed(tool, LEVEL, 0.5, 2.0) is tool
        return
    with pytest.raises(RefusedError, match=r"over 2 N and 0\.2 N·m"):
        felt.zeroed(tool, LEVEL, 0.5, 2.0)


@pytest.mark.parametrize(("rate", "silence"), [(100.0, 0.1), (10.0, 0.25)])
def test_silence_is_a_tenth_of_a_second_or_a_lost_sample_of_a_slow_sensor(rate, silence):
    felt = sensing([sample(1.0)], rate=rate)
    felt.hear(1.0)
    felt.hear(1.0 + silence - 1e-9)
    with pytest.raises(InstrumentError, match="silent"):
        felt.hear(1.0 + silence + 1e-6)


def test_before_the_first_sample_silence_counts_from_the_beginning():
    felt = sensing()
    assert (felt.newest.t, felt.newest.seq, felt.newest.lost) == (0.0, 0, 0)
    np.testing.assert_array_equal(felt.newest.wrench, 0.0)
    assert felt.newest.healthy
    assert felt.hear(0.1) == []


def test_a_sensor_that_knows_why_it_is_not_healthy_is_quoted():
    bad = Sample(0.0, 9, np.zeros(6), healthy=False, lost=0, reason="its gauge is broken")
    with pytest.raises(InstrumentError, match="sample 9: its gauge is broken, stopped"):
        sensing([bad]).hear(0.0)


def test_how_long_is_waited_for_a_zero_a_check_and_a_sign_of_life():
    for tool, tolerance, waited in ((UNKNOWN, None, 0.5), (PEN, None, 0.1), (PEN, 1e3, 0.1)):
        felt = sensing([sample(0.1, 1.0)])
        felt.zeroed(tool, LEVEL, 0.5, tolerance)
        assert felt._clock.now() == pytest.approx(waited)
    # Without a tolerance the tool may be another sensor's.
    assert sensing([sample(0.1)]).zeroed(replace(PEN, sensor="other"), LEVEL, 0.5)


def test_looking_back_takes_what_is_whole_and_fails_for_nothing():
    good = sample(0.0, 1.0)
    bad = [sample(0.01, healthy=False), sample(0.02, np.nan)]
    assert sensing([good, *bad]).rest() == [good]

    class Broken:
        def poll(self):
            raise InstrumentError("the cable is out")

    assert Sensing(Broken(), INFO, 100.0, 0.02, SimulatedClock()).rest() == []


@pytest.mark.parametrize("axis", [3, 4, 5])
def test_a_torque_about_any_axis_counts(axis):
    tool = replace(PEN, weight=0.0, centre=np.zeros(3), zero=np.zeros(6))
    felt = sensing([Sample(0.0, 1, 0.21 * np.eye(6)[axis], True, 0)])
    with pytest.raises(RefusedError, match=r"leaves 0\.00 N and 0\.210 N·m"):
        felt.zeroed(tool, LEVEL, 0.5, 2.0)
