from dataclasses import replace

import numpy as np
import pytest

from dmpcli.errors import InstrumentError
from dmpcli.instruments.clock import SimulatedClock
from dmpcli.instruments.mock import PEN
from dmpcli.instruments.protocols import Sample, SensorInfo
from dmpcli.instruments.sensing import Sensing

INFO = SensorInfo("fake", 100.0, np.array([100.0, 100.0, 100.0, 10.0, 10.0, 10.0]))
UNKNOWN = replace(PEN, weight=0.0, zero=None)
LEVEL = np.eye(3)


class FakeSensor:
    """Hands out one batch after the other."""

    def __init__(self, *batches):
        self.batches = list(batches)

    def poll(self):
        return self.batches.pop(0) if self.batches else []


def sample(t, force=0.0, healthy=True, torque=0.0, seq=7):
    return Sample(t, seq, np.array([force, 0.0, 0.0, 0.0, torque, 0.0]), healthy, 0)


def sensing(*batches, rate=100.0, period=0.02):
    return Sensing(FakeSensor(*batches), INFO, rate, period, SimulatedClock())


UNBELIEVABLE = [
    (sample(0.0, healthy=False), "sample 7 is saturated"),
    (sample(0.0, np.nan), "sample 7 is not a number"),
    (sample(0.0, np.inf), "sample 7 is not a number"),
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
